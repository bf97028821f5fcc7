"""Speed of the engines, and of a Pymunk space as a user would set it up."""

import math
from collections.abc import Iterator
from functools import partial
from typing import Final

import pymunk

from sandbox.bench.figure import Figure, alternately, figure, processor_time, repeats_in
from sandbox.engines import create
from sandbox.engines.exact.engine import ExactEngine
from sandbox.engines.pymunk import WALL_HALF_THICKNESS
from sandbox.scene.files import load, parse
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.space.recording import Recording

SECONDS_PER_ROUND: Final = 0.2  # for which each side of a ratio is measured
SLOW_GAS: Final = 200  # px/s: 3.3 px a step; time-stepped engines need less than the radius
FAST_GAS: Final = 1000  # px/s, for the exact engine, whose figures do not depend on it
MIN_STEPS: Final = 20  # of the article's engine, from the start: later its gas has cooled into heaps
COLLISIONS: Final = 100_000  # in a round of the exact engine


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
    for scene in (load("article"), load("gas-1000"), gas(20_000, 0.2, SLOW_GAS)):
        n = len(scene.bodies)
        engine, step = create("pymunk", scene, spawn(scene)), partial(plain_space(scene).step, 1 / scene.rate)
        times = repeats_in(engine.step, SECONDS_PER_ROUND)
        processor_time(step, 2)  # steps that the engine has done: both are at the same step in every round
        ours, plain = partial(processor_time, engine.step, times), partial(processor_time, step, times)
        ratios = [a / b for a, b in alternately(rounds, ours, plain)]
        yield figure(f"pymunk n={n}", f"{n:,} balls: step / a plain Pymunk loop's", ratios)


def recording(rounds: int) -> Iterator[Figure]:
    """Measure what recording a Space adds to its steps, relative to `Space.step`, and the memory that a step takes."""
    for n in (100, 1_000):
        scene = gas(n, 0.5, SLOW_GAS)
        plain, recorded = plain_space(scene), plain_space(scene)
        kept = Recording(recorded)
        step, record = partial(plain.step, 1 / scene.rate), partial(kept.record, recorded.step, 1 / scene.rate)
        times = repeats_in(record, SECONDS_PER_ROUND)
        processor_time(step, 2)  # both are at the same step in every round
        measurements = partial(processor_time, record, times), partial(processor_time, step, times)
        ratios = [a / b - 1 for a, b in alternately(rounds, *measurements)]
        yield figure(f"recording n={n}", f"{n:,} balls: recording a step / Space.step", ratios)
        yield figure(f"recording memory n={n}", f"{n:,} balls: memory of a step", [kept.bytes / len(kept) / 1e6], "MB")


def article(rounds: int) -> Iterator[Figure]:
    """Measure the article's engine relative to `Space.step`, and how its time per ball grows with their number."""
    scene = gas(20_000, 0.2, SLOW_GAS)
    step = partial(plain_space(scene).step, 1 / scene.rate)
    pairs = alternately(rounds, partial(processor_time, step, 3), partial(first_steps, scene))
    means = "20,000 balls: speed / Pymunk's Space.step"
    yield figure("article / Space.step n=20000", means, [a / b for a, b in pairs], higher_is_better=True)

    few, many = gas(1_000, 0.2, SLOW_GAS), gas(100_000, 0.2, SLOW_GAS)
    pairs = alternately(rounds, partial(first_steps, few), partial(first_steps, many))
    yield figure("article n=1000", "1,000 balls: time per ball and step", [1e6 * a for a, _ in pairs], "ns")
    growth = [b / len(many.bodies) / (a / len(few.bodies)) for a, b in pairs]
    yield figure("article growth", "time per ball: 100,000 balls / 1,000", growth)


def first_steps(scene: Scene) -> float:
    """Return the time of a step of the article's engine at the start of a scene, s."""
    engine = create("article", scene, spawn(scene))
    engine.step()
    return processor_time(engine.step, max(MIN_STEPS, 20_000 // len(scene.bodies)))


def exact(rounds: int) -> Iterator[Figure]:
    """Measure collisions between discs per second."""
    for n, eta in ((100, 0.5), (1_000, 0.5), (100_000, 0.2), (100_000, 0.5)):
        engine = ExactEngine(scene := gas(n, eta, FAST_GAS), spawn(scene))
        engine.step()  # compiles, and leaves the initial order
        rates = [_collisions_per_second(engine) for _ in range(rounds)]
        means = f"{n:,} discs that cover {eta:.0%}: collisions"
        yield figure(f"exact n={n} eta={eta}", means, rates, "/s", higher_is_better=True)


def _collisions_per_second(engine: ExactEngine) -> float:
    before = engine.collisions

    def run() -> None:
        while engine.collisions - before < COLLISIONS:
            engine.step()

    time = processor_time(run)
    return (engine.collisions - before) / time


def plain_space(scene: Scene) -> pymunk.Space:
    """Return a space with the scene's elastic balls and arena, to be run by `space.step(1 / scene.rate)`.

    It has only what a user would write, and so costs the same. Tests of contacts and settings therefore have a loop of
    their own.
    """
    space = pymunk.Space()
    initial, bodies = spawn(scene), scene.bodies
    for ball, (position, velocity) in enumerate(zip(initial.position.tolist(), initial.velocity.tolist(), strict=True)):
        mass, radius = float(bodies.mass[ball]), float(bodies.radius[ball])
        body = pymunk.Body(mass, pymunk.moment_for_circle(mass, 0, radius))
        body.position, body.velocity = position, velocity
        circle = pymunk.Circle(body, radius)
        circle.elasticity = 1
        space.add(body, circle)
    (width, height), far = scene.arena.size, WALL_HALF_THICKNESS
    corners = [(-far, -far), (width + far, -far), (width + far, height + far), (-far, height + far)]
    for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
        wall = pymunk.Segment(space.static_body, a, b, far)
        wall.elasticity = 1
        space.add(wall)
    return space
