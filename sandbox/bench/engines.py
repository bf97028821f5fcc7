"""How fast the engines are."""

import math
from collections.abc import Iterator
from functools import partial
from typing import Final

from sandbox.bench.figure import ROUNDS, Figure, figure, in_turn, seconds, times_for
from sandbox.bench.plain import PlainArticle, PlainDiscs, plain_space
from sandbox.engines import create
from sandbox.engines.exact.engine import ExactEngine
from sandbox.scene.files import load, parse
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn

ROUND: Final = 0.2  # s that each side of a ratio is measured for in a round
CALM: Final = 200  # px/s: 3.3 px a step, less than the radius, as engines that step want it
FAST: Final = 1000  # px/s, of the exact engine's gas: its figures do not depend on it
STEPS: Final = 20  # of the article's rule from the start on, of many balls: later its gas has cooled, and is in heaps


def gas(n: int, eta: float, rms_speed: float) -> Scene:
    """Make a square gas of n discs of radius 5 px that cover a share eta of it."""
    side = 5 * math.sqrt(n * math.pi / eta)
    return parse(
        f"arena.size = [{side}, {side}]\nballs = [{{ count = {n}, radius = 5, rms_speed = {rms_speed}, "
        f"inside = [[0, 0], [{side}, {side}]] }}]",
        "gas",
    )


def beside_pymunk() -> Iterator[Figure]:
    """Measure our Pymunk engine's step in turn with that of a plain Pymunk loop, on the same scene."""
    for scene in (load("article"), load("gas-100"), load("gas-1000"), gas(20_000, 0.2, CALM)):
        n = len(scene.bodies)
        engine, step = create("pymunk", scene, spawn(scene)), partial(plain_space(scene).step, 1 / scene.rate)
        times = times_for(engine.step, ROUND)
        seconds(step, 2)  # which the engine has done too: both are at the same step in every round
        ratios = [a / b for a, b in in_turn(partial(seconds, engine.step, times), partial(seconds, step, times))]
        yield figure(f"pymunk n={n}", f"{n:,} balls: our step / plain Pymunk's", ratios)


def article() -> Iterator[Figure]:
    """Measure the article's rule in turn with its loop in plain Python, and with `Space.step`, on the same scenes."""
    yield _faster_than_plain_python(load("article"))
    yield _faster_than_plain_python(gas(1_000, 0.2, CALM))
    yield _faster_than_pymunk(gas(20_000, 0.2, CALM))
    yield from _cost_of_a_ball()


def first_steps(scene: Scene) -> float:
    """Return how long a step of the article's rule takes at a scene's start, s."""
    engine = create("article", scene, spawn(scene))
    engine.step()
    return seconds(engine.step, max(STEPS, 20_000 // len(scene.bodies)))


def _faster_than_plain_python(scene: Scene) -> Figure:
    plain, n = PlainArticle(scene), len(scene.bodies)
    times = min(STEPS, times_for(plain.step, ROUND))
    ratios = [a / b for a, b in in_turn(partial(seconds, plain.step, times), partial(first_steps, scene))]
    return figure(f"article / plain Python n={n}", f"{n:,} balls: speed / plain Python's", ratios)


def _faster_than_pymunk(scene: Scene) -> Figure:
    step, n = partial(plain_space(scene).step, 1 / scene.rate), len(scene.bodies)
    ratios = [a / b for a, b in in_turn(partial(seconds, step, 3), partial(first_steps, scene))]
    return figure(f"article / Space.step n={n}", f"{n:,} balls: speed / Pymunk's Space.step", ratios)


def _cost_of_a_ball() -> Iterator[Figure]:
    few, many = gas(1_000, 0.2, CALM), gas(100_000, 0.2, CALM)
    rounds = [
        (a / len(few.bodies), b / len(many.bodies))
        for a, b in in_turn(partial(first_steps, few), partial(first_steps, many))
    ]
    for scene, costs in zip((few, many), zip(*rounds, strict=True), strict=True):
        n = len(scene.bodies)
        yield figure(f"article n={n}", f"{n:,} balls: cost of each, a step", [1e9 * cost for cost in costs], "ns")
    growth = [among_many / among_few for among_few, among_many in rounds]
    yield figure("article growth", "cost of each among 100,000 / among 1,000", growth)


def exact() -> Iterator[Figure]:
    """Measure collisions between discs a second, on one core; and in turn with the algorithm in plain Python."""
    for n in (100, 1_000, 10_000, 100_000):
        for eta in (0.2, 0.5):
            engine = ExactEngine(scene := gas(n, eta, FAST), spawn(scene))
            engine.step()  # compiles, and leaves the order of the start
            rates = [_collisions_a_second(engine) for _ in range(ROUNDS)]
            yield figure(f"exact n={n} eta={eta}", f"{n:,} discs that cover {eta:.0%}: collisions", rates, "/s")
    engine, plain = ExactEngine(scene := gas(100, 0.5, FAST), spawn(scene)), PlainDiscs(scene)
    pairs = in_turn(partial(_collisions_a_second, engine), partial(seconds, plain.collide, 300))
    means = "100 discs: collisions / plain heapq's"
    yield figure("exact / plain Python", means, [rate * each for rate, each in pairs])


def _collisions_a_second(engine: ExactEngine) -> float:
    before = engine.collisions

    def play() -> None:
        while engine.collisions - before < 100_000:
            engine.step()

    time = seconds(play)
    return (engine.collisions - before) / time
