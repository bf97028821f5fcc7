"""Walls, discs and how they move between contacts, in 50 decimal digits, for `discs_in_decimal`.

x, y: px; vx, vy: px/s; angle, spin: rad, rad/s, positive from x to y; t: s; gravity: px/s². A wall is a segment with
round ends. A normal points away from a disc, to what it touches; the tangent is the normal turned from x to y. Slip is
the velocity of a disc's rim along the tangent, past what it touches.
"""

import random
from dataclasses import KW_ONLY, dataclass, replace
from decimal import Decimal, localcontext
from functools import cached_property
from typing import NamedTuple

from roots_in_decimal import DIGITS, ZERO

Vector = tuple[Decimal, Decimal]


def sign(number: Decimal) -> int:
    """Return -1, 0 or 1."""
    return (number > 0) - (number < 0)


@dataclass(frozen=True)
class Wall:
    """The side of an arena, which only stops what comes from inside, or a wall with two faces and round ends.

    number: 0 to 3 for the arena's left, top, right and bottom; then the others.
    """

    number: int
    x0: Decimal
    y0: Decimal
    x1: Decimal
    y1: Decimal
    half_thickness: Decimal
    elasticity: Decimal
    friction: Decimal = ZERO
    _: KW_ONLY
    one_sided: bool = False

    @cached_property
    def faces(self) -> tuple["Face", ...]:
        """The straight parts of its surface."""
        with localcontext(prec=DIGITS):
            dx, dy = self.x1 - self.x0, self.y1 - self.y0
            length = (dx * dx + dy * dy).sqrt()
            tx, ty = dx / length, dy / length
        there, back = Face(self, self.x0, self.y0, tx, ty, length), Face(self, self.x1, self.y1, -tx, -ty, length)
        return (there,) if self.one_sided else (there, back)

    def nearest(self, x: Decimal, y: Decimal) -> tuple[Decimal, Decimal, Decimal]:
        """Return the unit normal from a point to where the wall's line is nearest, and the distance of that, px.

        The side of an arena is nearest along its normal, from wherever.
        """
        face = self.faces[0]
        rx, ry = x - face.x, y - face.y
        along = face.along(rx, ry)
        if self.one_sided or 0 <= along <= face.length:
            off = face.into(rx, ry)
            side = -1 if off > 0 and not self.one_sided else 1
            return side * face.ty, -side * face.tx, -side * off
        end = self.ends[0 if along < 0 else 1]
        dx, dy = end.x - x, end.y - y
        distance = (dx * dx + dy * dy).sqrt()
        return dx / distance, dy / distance, distance

    @cached_property
    def ends(self) -> tuple["End", ...]:
        """The round parts of its surface."""
        return () if self.one_sided else (End(self, self.x0, self.y0), End(self, self.x1, self.y1))


class Face(NamedTuple):
    """A face of a wall. x, y: where its line begins; tx, ty: its tangent; its normal is (ty, -tx)."""

    wall: Wall
    x: Decimal
    y: Decimal
    tx: Decimal
    ty: Decimal
    length: Decimal

    def along(self, x: Decimal, y: Decimal) -> Decimal:
        """Return the component of a vector along the tangent."""
        return x * self.tx + y * self.ty

    def into(self, x: Decimal, y: Decimal) -> Decimal:
        """Return the component of a vector along the normal, into the wall."""
        return x * self.ty - y * self.tx

    def has(self, along: Decimal) -> bool:
        """Return whether the face is at a distance from its beginning; one of an arena is everywhere."""
        return self.wall.one_sided or 0 <= along <= self.length


class End(NamedTuple):
    """A round end of a wall. x, y: its centre."""

    wall: Wall
    x: Decimal
    y: Decimal


@dataclass
class Disc:
    """A disc in flight, or on a face.

    ax, ay: px/s²; turning: rad/s²; face: on which it lies; way: of its slip along the tangent there, -1 or 1, 0 if it
    rolls; pushed_x, pushed_y: px/s, the impulses of walls over its mass.
    """

    x: Decimal
    y: Decimal
    vx: Decimal
    vy: Decimal
    radius: Decimal
    mass: Decimal
    elasticity: Decimal
    friction: Decimal = ZERO
    spin: Decimal = ZERO
    _: KW_ONLY
    angle: Decimal = ZERO
    ax: Decimal = ZERO
    ay: Decimal = ZERO
    turning: Decimal = ZERO
    face: Face | None = None
    way: int = 0
    pushed_x: Decimal = ZERO
    pushed_y: Decimal = ZERO

    def release(self, gravity: Vector) -> None:
        """Let it fly freely."""
        (self.ax, self.ay), self.turning, self.face = gravity, ZERO, None

    def lie(self, face: Face, gravity: Vector, *, stuck: bool = False) -> None:
        """Let a face carry it. stuck: its slip has become 0, so it rolls if friction can hold its rim."""
        speed, rise = face.along(self.vx, self.vy), face.into(self.vx, self.vy)
        pull, grip = face.along(*gravity), face.into(*gravity) * self.friction * face.wall.friction
        self.vx -= rise * face.ty
        self.vy += rise * face.tx
        if stuck:
            self.spin = -speed / self.radius
        self.face, self.way = face, 0 if stuck else sign(speed + self.radius * self.spin)
        if self.way == 0 and abs(pull) > 3 * grip:
            self.way = sign(pull)
        friction = self.way * grip if self.way else pull / 3  # px/s²
        self.ax, self.ay = (pull - friction) * face.tx, (pull - friction) * face.ty
        self.turning = -2 * friction / self.radius


@dataclass
class Table:
    """All discs at one time, the walls and gravity."""

    discs: list[Disc]
    walls: tuple[Wall, ...]
    gravity: Vector
    time: Decimal = ZERO

    def copy(self) -> "Table":
        """Return a copy that can go its own way."""
        return replace(self, discs=[replace(disc) for disc in self.discs])

    def nudge(self, by: Decimal, rng: random.Random) -> None:
        """Change all coordinates, velocities and spins at random, by up to `by`; what lies or rolls still does."""
        for disc in self.discs:
            x, y, vx, vy, spin = (by * Decimal(rng.uniform(-1, 1)) for _ in range(5))
            if face := disc.face:
                x, y, vx, vy = x * face.tx, x * face.ty, vx * face.tx, vx * face.ty
                if disc.way == 0:
                    spin = -face.along(vx, vy) / disc.radius
            disc.x, disc.y, disc.vx, disc.vy, disc.spin = (
                disc.x + x,
                disc.y + y,
                disc.vx + vx,
                disc.vy + vy,
                disc.spin + spin,
            )

    def fly(self, wait: Decimal) -> None:
        """Move all discs, each with its constant acceleration."""
        gx, gy = self.gravity
        for disc in self.discs:
            disc.x += wait * (disc.vx + disc.ax * wait / 2)
            disc.y += wait * (disc.vy + disc.ay * wait / 2)
            disc.angle += wait * (disc.spin + disc.turning * wait / 2)
            disc.vx += disc.ax * wait
            disc.vy += disc.ay * wait
            disc.spin += disc.turning * wait
            disc.pushed_x += (disc.ax - gx) * wait
            disc.pushed_y += (disc.ay - gy) * wait
        self.time += wait
