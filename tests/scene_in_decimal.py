"""Scenes of few discs and straight walls, as numbers: written for the sandbox, and for `impacts_in_decimal`."""

from dataclasses import dataclass
from decimal import Decimal
from typing import Final, NamedTuple

STEPS: Final = 60  # of a run


@dataclass
class Disc:
    """A disc. x, y: px; vx, vy: px/s; spin: rad/s, positive from x to y."""

    x: Decimal
    y: Decimal
    vx: Decimal
    vy: Decimal
    radius: Decimal
    mass: Decimal
    elasticity: Decimal
    friction: Decimal = Decimal(0)
    spin: Decimal = Decimal(0)


class Wall(NamedTuple):
    """A segment, of which only what is beside it counts. x0, y0, x1, y1: px, of its ends."""

    x0: Decimal
    y0: Decimal
    x1: Decimal
    y1: Decimal
    half_thickness: Decimal
    elasticity: Decimal
    friction: Decimal

    def nearest(self, x: Decimal, y: Decimal) -> tuple[Decimal, Decimal, Decimal]:
        """Return the unit normal from a point to the wall's line, and the distance to it, px."""
        dx, dy = self.x1 - self.x0, self.y1 - self.y0
        length = (dx * dx + dy * dy).sqrt()
        off = ((x - self.x0) * dy - (y - self.y0) * dx) / length
        side = 1 if off > 0 else -1
        return -side * dy / length, side * dx / length, side * off


@dataclass(frozen=True)
class Numbers:
    """The numbers of a scene.

    balls: (x, y, vx, vy, radius, mass, elasticity, friction, spin); walls: (x, y, x, y, thickness, elasticity,
    friction).
    """

    size: tuple[float, float]
    elasticity: float
    friction: float
    gravity: tuple[float, float]
    rate: int
    balls: tuple[tuple[float, ...], ...]
    walls: tuple[tuple[float, ...], ...]

    def toml(self) -> str:
        """Write the scene for the sandbox."""
        lines = [f"rate = {self.rate}", f"seconds = {STEPS / self.rate!r}", f"gravity = {[*self.gravity]}"]
        lines += ["[arena]", f"size = {[*self.size]}", f"elasticity = {self.elasticity!r}"]
        lines += [f"friction = {self.friction!r}"]
        for x, y, vx, vy, radius, mass, elasticity, friction, spin in self.balls:
            lines += ["[[balls]]", f"position = {[x, y]}", f"velocity = {[vx, vy]}", f"spin = {spin!r}"]
            lines += [f"radius = {radius!r}", f"mass = {mass!r}", f"elasticity = {elasticity!r}"]
            lines += [f"friction = {friction!r}"]
        for x0, y0, x1, y1, thickness, elasticity, friction in self.walls:
            lines += ["[[walls]]", f"from = {[x0, y0]}", f"to = {[x1, y1]}", f"thickness = {thickness!r}"]
            lines += [f"elasticity = {elasticity!r}", f"friction = {friction!r}"]
        return "\n".join(lines)

    def discs(self) -> list[Disc]:
        """Return the discs in decimals."""
        return [Disc(*map(Decimal, ball)) for ball in self.balls]

    def surfaces(self) -> list[Wall]:
        """Return the sides of the arena, and then the walls, in decimals."""
        width, height = self.size
        corners = [(0.0, height), (0.0, 0.0), (width, 0.0), (width, height)]
        factors = 0.0, self.elasticity, self.friction
        sides = [(*start, *end, *factors) for start, end in zip(corners, corners[1:] + corners[:1], strict=True)]
        walls = [(*ends, thickness / 2, e, mu) for *ends, thickness, e, mu in self.walls]
        return [Wall(*map(Decimal, wall)) for wall in (*sides, *walls)]
