"""An event-driven engine without a fault, and a stepped one, which share no code with the engines of the sandbox.

`EventDriven` flies on exact parabolas and resolves contacts at their exact times, few discs by brute force. `Stepped`
finds contacts at the end of a step and puts the balls where a contact in time would have led them; what it differs in
by itself is `late`. Faults override one method or factor.

Points and vectors are complex numbers, x + iy, in px, px/s and px/s².
"""

import math
from typing import Any, ClassVar, Final

import numpy as np

from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.state import CONTACT, Contacts, State, no_contacts

NEVER: Final = math.inf
OUTWARD: Final = (-1 + 0j, -1j, 1 + 0j, 1j)  # of the arena's left, top, right and bottom wall


def dot(a: complex, b: complex) -> float:
    return a.real * b.real + a.imag * b.imag


def cross(a: complex, b: complex) -> float:
    return (a.conjugate() * b).imag


def turned(degrees: float) -> complex:
    return complex(math.cos(math.radians(degrees)), math.sin(math.radians(degrees)))


def to_face(depth: float, speed: float, pull: float) -> float:
    """Return when a depth (px, negative outside) grows to 0, now by `speed` px/s, which grows by `pull` px/s²."""
    square = speed * speed - 2 * pull * depth
    if square < 0 or (speed <= 0 and pull <= 0):
        return NEVER
    root = math.sqrt(square)
    time = -2 * depth / (speed + root) if speed > 0 else (root - speed) / pull
    return max(time, 0.0)


def to_circle(away: complex, speed: complex, reach: float) -> float:
    """Return when a centre, now `away` from another, comes within reach of it at a constant relative velocity."""
    approach, near = dot(speed, away), abs(away) ** 2 - reach * reach
    if approach <= 0:
        return NEVER
    square = approach * approach - abs(speed) ** 2 * near
    return NEVER if square < 0 else max(near / (approach + math.sqrt(square)), 0.0)


def to_circle_falling(away: complex, velocity: complex, gravity: complex, reach: float) -> float:
    """Return when a falling centre comes within reach of a point, from which it is `away` now."""
    quartic = [
        abs(gravity) ** 2 / 4,
        dot(gravity, velocity),
        abs(velocity) ** 2 - dot(gravity, away),
        -2 * dot(velocity, away),
        abs(away) ** 2 - reach * reach,
    ]
    cubic = np.polyder(quartic)
    times = []
    for root in np.roots(quartic):
        if abs(root.imag) < 1e-6:
            time = float(root.real)
            for _ in range(3):
                time -= float(np.polyval(quartic, time) / np.polyval(cubic, time))
            if time > -1e-9 and np.polyval(cubic, time) < 0:
                times.append(max(time, 0.0))
    return min(times, default=NEVER)


class Discs:
    """The balls of a scene, the contacts found, and what an engine shows of them."""

    impulse_factor: ClassVar = 1.0
    clock_factor: ClassVar = 1.0
    gravity_factor: ClassVar[complex] = 1.0

    def __init__(self, scene: Scene, initial: State) -> None:
        self.scene, self.dt, self.steps = scene, self.clock_factor * (1 / scene.rate), 0
        self.x = [complex(*point) for point in initial.position.tolist()]
        self.v = [complex(*vector) for vector in initial.velocity.tolist()]
        bodies = scene.bodies
        self.r: list[float] = bodies.radius.tolist()
        self.m: list[float] = bodies.mass.tolist()
        self.e: list[float] = bodies.elasticity.tolist()
        self.balls = range(len(self.x))
        self.f: list[float] = bodies.friction.tolist()
        self.w: list[float] = initial.spin.tolist()
        self.g = complex(*scene.gravity) * self.gravity_factor
        self.wall_f = [scene.arena.friction] * 4 + [wall.friction for wall in scene.walls]
        self.wall_e = [scene.arena.elasticity] * 4 + [wall.elasticity for wall in scene.walls]
        self.found: list[tuple[Any, ...]] = []
        self.random = np.random.default_rng(1)

    @property
    def now(self) -> float:
        return self.steps / self.scene.rate

    def state(self) -> State:
        position, velocity = (np.array([(z.real, z.imag) for z in each]) for each in (self.x, self.v))
        return State(self.now, position, velocity, np.zeros(len(self.w)), np.array(self.w, float))

    def record_contacts(self) -> None:
        """They are recorded from the start."""

    def contacts(self) -> Contacts:
        found, self.found = self.found, []
        return np.array(found, CONTACT) if found else no_contacts()

    def kick(self, ball: int, dv: Vector) -> None:
        self.v[ball] += complex(*dv)

    def report(
        self, time: float, i: int, other: int, n: complex, impulse: float, depth: float, rubs: float, slip: float
    ) -> None:
        self.found.append((time, i, other, (n.real, n.imag), impulse, depth, rubs, slip))

    # What a contact does

    def restitution(self, i: int, other: int) -> float:
        return self.e[i] * (self.e[other] if other >= 0 else self.wall_e[~other])

    def friction(self, i: int, other: int) -> float:
        return self.f[i] * (self.f[other] if other >= 0 else self.wall_f[~other])

    def rub(self, slip: float, mass: float, most: float) -> float:
        """Return the friction of a contact. mass: kg, one over the sum of the inverse masses; most: of the impulse."""
        return max(-most, min(most, slip * mass / 3))

    def most(self, i: int, other: int, impulse: float) -> float:
        return self.friction(i, other) * impulse

    def turn(self, i: int, rubs: float) -> None:
        """Let friction at its rim turn a ball."""
        self.w[i] -= 2 * rubs / (self.m[i] * self.r[i])

    def slip(self, i: int, other: int, n: complex) -> float:
        rims = self.r[i] * self.w[i] + (self.r[other] * self.w[other] if other >= 0 else 0.0)
        return self.approach(i, other, 1j * n) + rims

    def apply_friction(self, i: int, other: int, n: complex, impulse: float) -> tuple[float, float]:
        """Return the friction that two bodies get, and the slip before."""
        slip = self.slip(i, other, n)
        mass = 1 / (1 / self.m[i] + (1 / self.m[other] if other >= 0 else 0.0))
        rubs = self.rub(slip, mass, self.most(i, other, impulse))
        if rubs:
            for ball, sign in ((i, -1), (other, 1)):
                if ball >= 0:
                    self.v[ball] += sign * rubs * 1j * n / self.m[ball]
                    self.turn(ball, rubs)
        return rubs, slip

    def push(self, i: int, other: int, impulse: complex) -> None:
        """Give two bodies an impulse, which points from the first to the second."""
        self.v[i] -= impulse / self.m[i]
        if other >= 0:
            self.v[other] += impulse / self.m[other]

    def approach(self, i: int, other: int, n: complex) -> float:
        return dot(self.v[i] - (self.v[other] if other >= 0 else 0), n)

    def right_impulse(self, i: int, other: int, n: complex) -> float:
        """Return the textbook's impulse along a normal."""
        masses = 1 / self.m[i] + (1 / self.m[other] if other >= 0 else 0.0)
        return (1 + self.restitution(i, other)) * self.approach(i, other, n) / masses

    def resolve(self, time: float, i: int, other: int, n: complex, depth: float) -> None:
        impulse = self.impulse_factor * self.right_impulse(i, other, n)
        slipping = self.apply_friction(i, other, n, impulse)
        self.push(i, other, impulse * n)
        self.report(time, i, other, n, impulse, depth, *slipping)


class EventDriven(Discs):
    """No fault: few discs from contact to contact, by brute force."""

    def reach(self, i: int, other: int) -> float:
        """Return the distance at which a ball meets a ball, or a wall's face or centre line."""
        return self.r[i] + (self.r[other] if other >= 0 else self.half_thickness(~other))

    def half_thickness(self, wall: int) -> float:
        return self.scene.walls[wall - 4].thickness / 2 if wall >= 4 else 0.0

    just: tuple[int, int] = (-1, -1)  # whose contact was resolved last, in this step

    def sees(self, i: int, other: int) -> bool:
        return True

    def meets(self, i: int, other: int, time: float) -> bool:
        """Return whether two bodies meet after some time (s); those just resolved do not meet again at once."""
        return self.sees(i, other) and (time > 1e-12 or (i, other) != self.just)

    def face(self, wall: int) -> float:
        """Return how far out a wall of the arena stands."""
        width, height = self.scene.arena.size
        return (0.0, 0.0, width, height)[wall]

    def ends(self, wall: int) -> tuple[complex, ...]:
        """Return the round ends of an inner wall."""
        segment = self.scene.walls[wall - 4]
        return complex(*segment.start), complex(*segment.to)

    def to_inner_wall(self, i: int, wall: int) -> tuple[float, complex]:
        """Return when a ball meets an inner wall, and the point of the centre line that is nearest then."""
        segment, reach = self.scene.walls[wall - 4], self.reach(i, ~wall)
        start, to = complex(*segment.start), complex(*segment.to)
        along = (to - start) / abs(to - start)
        off = cross(along, self.x[i] - start)
        towards = along * (-1j if off > 0 else 1j)
        best, where = NEVER, start
        time = NEVER
        if abs(off) > reach / 2:
            time = to_face(reach - abs(off), dot(self.v[i], towards), dot(self.g, towards))
        if time < NEVER:
            then = self.x[i] + time * (self.v[i] + time * self.g / 2)
            part = dot(along, then - start)
            if 0 <= part <= abs(to - start):
                best, where = time, start + part * along
        for end in self.ends(wall):
            away = end - self.x[i]
            time = to_circle_falling(away, self.v[i], self.g, reach) if self.g else to_circle(away, self.v[i], reach)
            if time < best:
                best, where = time, end
        return best, where

    def next_contact(self, within: float) -> tuple[float, int, int, complex]:
        """Return the first contact within some time (s): when, of whom, and where or along which normal at a wall."""
        first = (NEVER, -1, 0, 0j)
        for i in self.balls:
            for j in range(i + 1, len(self.x)):
                away = self.x[j] - self.x[i]
                time = to_circle(away, self.v[i] - self.v[j], self.reach(i, j))
                if time <= within and self.meets(i, j, time):
                    first, within = (time, i, j, 0j), time
            for wall, n in enumerate(OUTWARD):
                depth = dot(self.x[i], n) + self.reach(i, ~wall) - self.face(wall)
                time = to_face(depth, dot(self.v[i], n), dot(self.g, n))
                if time <= within and self.meets(i, ~wall, time):
                    first, within = (time, i, ~wall, n), time
            for wall in range(4, 4 + len(self.scene.walls)):
                time, where = self.to_inner_wall(i, wall)
                if time <= within and self.meets(i, ~wall, time):
                    first, within = (time, i, ~wall, where), time
        return first

    def fly(self, time: float) -> None:
        for i in self.balls:
            self.x[i] += time * (self.v[i] + time * self.g / 2)
            self.v[i] += time * self.g

    def resolve_at(self, now: float, i: int, other: int, where: complex) -> None:
        """Resolve a contact of bodies that have met."""
        if other >= 0:
            away = self.x[other] - self.x[i]
            depth, n = self.r[i] + self.r[other] - abs(away), away / abs(away)
        elif ~other >= 4:
            away = where - self.x[i]
            depth, n = self.r[i] + self.half_thickness(~other) - abs(away), away / abs(away)
        else:
            width, height = self.scene.arena.size
            depth, n = dot(self.x[i], where) + self.r[i] - (0.0, 0.0, width, height)[~other], where
        self.resolve(now, i, other, n, depth)

    def step(self) -> None:
        left = self.dt
        while True:
            time, i, other, where = self.next_contact(left)
            if i < 0:
                break
            self.fly(time)
            left -= time
            self.just = (i, other)
            self.resolve_at(self.now + self.dt - left, i, other, where)
        self.fly(left)
        self.just = (-1, -1)
        self.steps += 1
        self.after_step()

    def after_step(self) -> None:
        pass


class Stepped(Discs):
    """Finds contacts at the end of a step on a true parabola, and parts balls along the normal as found."""

    reflects: ClassVar = True  # a ball found in a wall is put where a bounce in time would have led it

    def sees(self, i: int, other: int) -> bool:
        return True

    def move(self) -> None:
        for i in self.balls:
            self.x[i] += self.dt * (self.v[i] + self.dt * self.g / 2)
            self.v[i] += self.dt * self.g

    def pairs(self) -> list[tuple[int, int]]:
        return [(i, j) for i in self.balls for j in range(i + 1, len(self.x))]

    def step(self) -> None:
        self.steps += 1
        self.move()
        width, height = self.scene.arena.size
        for i in self.balls:
            for wall, n in enumerate(OUTWARD):
                depth = dot(self.x[i], n) + self.r[i] - (0.0, 0.0, width, height)[wall]
                if depth > 0 and dot(self.v[i], n) > 0 and self.sees(i, ~wall):
                    self.resolve(self.now, i, ~wall, n, depth)
                    self.x[i] -= (1 + self.restitution(i, ~wall) * self.reflects) * depth * n
        for i, j in self.pairs():
            away = self.x[j] - self.x[i]
            depth, n = self.r[i] + self.r[j] - abs(away), away / abs(away)
            if depth > 0 and self.approach(i, j, n) > 0 and self.sees(i, j):
                self.resolve(self.now, i, j, n, depth)
                self.part(i, j, depth * n)

    def part(self, i: int, j: int, overlap: complex) -> None:
        pass
