"""How fast the engines are: figures that are measured in turn, in one run, with their spread.

Machines are noisy, so a ratio of two things measured in turn says more than either alone.
"""

import heapq
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from statistics import median
from time import perf_counter

from sandbox.engines.exact import ExactEngine
from sandbox.scene import Scene, parse
from sandbox.spawn import spawn

ROUNDS = 5


@dataclass(frozen=True)
class Figure:
    """A figure and its spread over the rounds. `means` says what it is."""

    name: str
    means: str
    median: float
    lowest: float
    highest: float


def bench() -> Iterator[Figure]:
    """Measure the exact engine: collisions a second, and how much that is beside plain Python."""
    yield from exact_rates()
    yield beside_plain_python()


def gas(n: int, eta: float) -> Scene:
    """Make a square gas of n discs of radius 5 px that cover a share eta of it."""
    side = 5 * math.sqrt(n * math.pi / eta)
    return parse(
        f"arena.size = [{side}, {side}]\nballs = [{{ count = {n}, radius = 5, rms_speed = 1000, "
        f"inside = [[0, 0], [{side}, {side}]] }}]",
        "gas",
    )


def exact_rates() -> Iterator[Figure]:
    """Measure collisions between discs a second, on one core."""
    for n, eta in ((100, 0.5), (1_000, 0.2), (1_000, 0.5), (10_000, 0.5), (100_000, 0.2), (100_000, 0.5)):
        engine = ExactEngine(scene := gas(n, eta), spawn(scene))
        engine.step()  # compiles, and leaves the order of the start
        means = f"collisions a second of the exact engine, {n:,} discs that cover {eta:.0%}"
        yield _figure(f"exact n={n} eta={eta}", means, [_rate_of(engine, 100_000) for _ in range(ROUNDS)])


def beside_plain_python() -> Figure:
    """Measure the exact engine in turn with the same algorithm in plain Python, at 100 discs."""
    scene = gas(100, 0.5)
    engine, plain = ExactEngine(scene, spawn(scene)), PlainDiscs(scene)
    ratios = [_rate_of(engine, 100_000) / _rate(plain.collide, 300) for _ in range(ROUNDS)]
    return _figure("exact / plain Python", "collisions a second beside a heapq of predicted events, 100 discs", ratios)


def _rate_of(engine: ExactEngine, collisions: int) -> float:
    before, start = engine.collisions, perf_counter()
    while engine.collisions - before < collisions:
        engine.step()
    return (engine.collisions - before) / (perf_counter() - start)


def _rate(act: Callable[[], None], times: int) -> float:
    start = perf_counter()
    for _ in range(times):
        act()
    return times / (perf_counter() - start)


def _figure(name: str, means: str, values: list[float]) -> Figure:
    return Figure(name, means, median(values), min(values), max(values))


class PlainDiscs:
    """Event-driven discs as the textbook has them: one heap of predicted collisions, stale ones passed over.

    After R. Sedgewick and K. Wayne, Algorithms (4th ed.), section 6.1; all discs alike and elastic.
    """

    def __init__(self, scene: Scene) -> None:
        initial = spawn(scene)
        self.x, self.v = initial.position.tolist(), initial.velocity.tolist()
        self.radius, self.size = float(scene.bodies.radius[0]), scene.arena.size
        self.time = 0.0
        self.turns = [0] * len(self.x)  # how often each disc has been turned, so that stale events are known
        self.events: list[tuple[float, int, int, int, int]] = []
        for i in range(len(self.x)):
            self._predict(i)

    def _predict(self, i: int) -> None:
        (x, y), (vx, vy), r = self.x[i], self.v[i], self.radius
        for axis, (c, v) in enumerate(((x, vx), (y, vy))):
            if v:
                t = ((self.size[axis] - r if v > 0 else r) - c) / v
                heapq.heappush(self.events, (self.time + t, i, ~axis, self.turns[i], 0))
        for j, ((ox, oy), (ovx, ovy)) in enumerate(zip(self.x, self.v, strict=True)):
            dx, dy, dvx, dvy = ox - x, oy - y, ovx - vx, ovy - vy
            b = dx * dvx + dy * dvy
            if b < 0:
                discriminant = b * b - (dvx * dvx + dvy * dvy) * (dx * dx + dy * dy - 4 * r * r)
                if discriminant > 0:
                    t = (dx * dx + dy * dy - 4 * r * r) / (-b + math.sqrt(discriminant))
                    heapq.heappush(self.events, (self.time + max(0.0, t), i, j, self.turns[i], self.turns[j]))

    def collide(self) -> None:
        """Go on to the next collision of two discs."""
        while True:
            time, i, j, turns_i, turns_j = heapq.heappop(self.events)
            if self.turns[i] != turns_i or (j >= 0 and self.turns[j] != turns_j):
                continue
            for x, v in zip(self.x, self.v, strict=True):
                x[0] += v[0] * (time - self.time)
                x[1] += v[1] * (time - self.time)
            self.time = time
            self.turns[i] += 1
            if j < 0:
                self.v[i][~j] *= -1
                self._predict(i)
                continue
            self.turns[j] += 1
            nx, ny = ((b - a) / (2 * self.radius) for a, b in zip(self.x[i], self.x[j], strict=True))
            impulse = (self.v[i][0] - self.v[j][0]) * nx + (self.v[i][1] - self.v[j][1]) * ny
            for axis, n in enumerate((nx, ny)):
                self.v[i][axis] -= impulse * n
                self.v[j][axis] += impulse * n
            self._predict(i)
            self._predict(j)
            return
