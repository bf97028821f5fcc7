"""Speed of the engines."""

import math
from collections.abc import Iterator
from functools import partial
from typing import Final

from sandbox.bench.figure import Figure, alternately, figure, processor_time, repeats_in
from sandbox.bench.plain import PlainArticle, PlainDiscs, plain_space
from sandbox.engines import create
from sandbox.engines.exact.engine import ExactEngine
from sandbox.scene.files import load, parse
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn

SECONDS_PER_ROUND: Final = 0.2  # for which each side of a ratio is measured
SLOW_GAS: Final = 200  # px/s: 3.3 px a step; time-stepped engines need less than the radius
FAST_GAS: Final = 1000  # px/s, for the exact engine, whose figures do not depend on it
MIN_STEPS: Final = 20  # of the article's engine, from the start: later its gas has cooled into heaps


def gas(n: int, eta: float, rms_speed: float) -> Scene:
    """Make a square box with a gas of n discs of radius 5 px that cover the fraction eta of it."""
    side = 5 * math.sqrt(n * math.pi / eta)
    return parse(
        f"arena.size = [{side}, {side}]\nballs = [{{ count = {n}, radius = 5, rms_speed = {rms_speed}, "
        f"inside = [[0, 0], [{side}, {side}]] }}]",
        "gas",
    )


def against_plain_pymunk(rounds: int) -> Iterator[Figure]:
    """Measure a step of the engine `pymunk` relative to a step of a plain Pymunk loop, on the same scenes."""
    for scene in (load("article"), load("gas-100"), load("gas-1000"), gas(20_000, 0.2, SLOW_GAS)):
        n = len(scene.bodies)
        engine, step = create("pymunk", scene, spawn(scene)), partial(plain_space(scene).step, 1 / scene.rate)
        times = repeats_in(engine.step, SECONDS_PER_ROUND)
        processor_time(step, 2)  # steps that the engine has done: both are at the same step in every round
        ours, plain = partial(processor_time, engine.step, times), partial(processor_time, step, times)
        ratios = [a / b for a, b in alternately(rounds, ours, plain)]
        yield figure(f"pymunk n={n}", f"{n:,} balls: step / a plain Pymunk loop's", ratios)


def article(rounds: int) -> Iterator[Figure]:
    """Measure the article's engine relative to its loop in plain Python and to `Space.step`, on the same scenes."""
    yield _faster_than_plain_python(load("article"), rounds)
    yield _faster_than_plain_python(gas(1_000, 0.2, SLOW_GAS), rounds)
    yield _faster_than_pymunk(gas(20_000, 0.2, SLOW_GAS), rounds)
    yield from _cost_of_a_ball(rounds)


def first_steps(scene: Scene) -> float:
    """Return the time of a step of the article's engine at the start of a scene, s."""
    engine = create("article", scene, spawn(scene))
    engine.step()
    return processor_time(engine.step, max(MIN_STEPS, 20_000 // len(scene.bodies)))


def _faster_than_plain_python(scene: Scene, rounds: int) -> Figure:
    plain, n = PlainArticle(scene), len(scene.bodies)
    times = min(MIN_STEPS, repeats_in(plain.step, SECONDS_PER_ROUND))
    pairs = alternately(rounds, partial(processor_time, plain.step, times), partial(first_steps, scene))
    means = f"{n:,} balls: speed / plain Python's"
    return figure(f"article / plain Python n={n}", means, [a / b for a, b in pairs], higher_is_better=True)


def _faster_than_pymunk(scene: Scene, rounds: int) -> Figure:
    step, n = partial(plain_space(scene).step, 1 / scene.rate), len(scene.bodies)
    pairs = alternately(rounds, partial(processor_time, step, 3), partial(first_steps, scene))
    means = f"{n:,} balls: speed / Pymunk's Space.step"
    return figure(f"article / Space.step n={n}", means, [a / b for a, b in pairs], higher_is_better=True)


def _cost_of_a_ball(rounds: int) -> Iterator[Figure]:
    few, many = gas(1_000, 0.2, SLOW_GAS), gas(100_000, 0.2, SLOW_GAS)
    pairs = [
        (a / len(few.bodies), b / len(many.bodies))
        for a, b in alternately(rounds, partial(first_steps, few), partial(first_steps, many))
    ]
    for scene, costs in zip((few, many), zip(*pairs, strict=True), strict=True):
        n = len(scene.bodies)
        yield figure(f"article n={n}", f"{n:,} balls: time per ball and step", [1e9 * cost for cost in costs], "ns")
    growth = [among_many / among_few for among_few, among_many in pairs]
    yield figure("article growth", "time per ball: 100,000 balls / 1,000", growth)


def exact(rounds: int) -> Iterator[Figure]:
    """Measure collisions between discs per second, and relative to the algorithm in plain Python."""
    for n in (100, 1_000, 10_000, 100_000):
        for eta in (0.2, 0.5):
            engine = ExactEngine(scene := gas(n, eta, FAST_GAS), spawn(scene))
            engine.step()  # compiles, and leaves the initial order
            rates = [_collisions_per_second(engine) for _ in range(rounds)]
            means = f"{n:,} discs that cover {eta:.0%}: collisions"
            yield figure(f"exact n={n} eta={eta}", means, rates, "/s", higher_is_better=True)
    engine, plain = ExactEngine(scene := gas(100, 0.5, FAST_GAS), spawn(scene)), PlainDiscs(scene)
    pairs = alternately(rounds, partial(_collisions_per_second, engine), partial(processor_time, plain.collide, 300))
    means = "100 discs: collisions / plain Python's"
    yield figure("exact / plain Python", means, [rate * each for rate, each in pairs], higher_is_better=True)


def _collisions_per_second(engine: ExactEngine) -> float:
    before = engine.collisions

    def run() -> None:
        while engine.collisions - before < 100_000:
            engine.step()

    time = processor_time(run)
    return (engine.collisions - before) / time
