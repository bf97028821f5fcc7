"""Scenes of few discs and straight walls, as numbers: written for the sandbox, and for the programs in decimals."""

from dataclasses import dataclass
from decimal import Decimal
from typing import Final

from table_in_decimal import Disc, Table, Wall

STEPS: Final = 60  # of a run


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

    def table(self) -> Table:
        """Write the scene for the independent program."""
        width, height = map(Decimal, self.size)
        corners = [(Decimal(0), height), (Decimal(0), Decimal(0)), (width, Decimal(0)), (width, height)]
        sides = zip(corners, corners[1:] + corners[:1], strict=True)
        factors = Decimal(self.elasticity), Decimal(self.friction)
        walls = [
            Wall(number, *start, *end, Decimal(0), *factors, one_sided=True)
            for number, (start, end) in enumerate(sides)
        ]
        for number, (*ends, thickness, elasticity, friction) in enumerate(self.walls, len(walls)):
            walls.append(Wall(number, *map(Decimal, (*ends, thickness / 2, elasticity, friction))))
        discs = [Disc(*map(Decimal, ball)) for ball in self.balls]
        return Table(discs, tuple(walls), (Decimal(self.gravity[0]), Decimal(self.gravity[1])))
