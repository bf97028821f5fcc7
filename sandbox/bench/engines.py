"""Speed of the engines, and of a Pymunk space as a user would set it up."""

import math
from collections.abc import Iterator
from functools import partial
from time import process_time
from typing import Final

import pymunk

from sandbox.bench.figure import Figure, alternately, figure, processor_time, repeats_of
from sandbox.engines import create
from sandbox.engines.exact.engine import ExactEngine
from sandbox.engines.pymunk import WALL_HALF_THICKNESS
from sandbox.scene.files import load, parse
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn

RMS_SPEED: Final = 200  # px/s, of a gas: 3.3 px a step; time-stepped engines need less than the radius
COLLISIONS: Final = 100_000  # in a round of the exact engine


def gas(n: int, eta: float) -> Scene:
    """Make a square box with a gas of n discs of radius 5 px that cover the fraction eta of it."""
    side = 5 * math.sqrt(n * math.pi / eta)
    return parse(
        f"arena.size = [{side}, {side}]\nballs = [{{ count = {n}, radius = 5, rms_speed = {RMS_SPEED}, "
        f"inside = [[0, 0], [{side}, {side}]] }}]",
        "gas",
    )


def against_plain_pymunk(rounds: int) -> Iterator[Figure]:
    """Measure a step of the engine `pymunk` relative to a step of a plain Pymunk loop, on the same scenes."""
    for scene in (load("article"), load("gas-1000"), gas(20_000, 0.2)):
        n = len(scene.bodies)
        engine, step = create("pymunk", scene, spawn(scene)), partial(plain_space(scene).step, 1 / scene.rate)
        times = repeats_of(engine.step)
        processor_time(step, 2)  # steps that the engine has done: both are at the same step in every round
        ours, plain = partial(processor_time, engine.step, times), partial(processor_time, step, times)
        ratios = [a / b for a, b in alternately(rounds, ours, plain)]
        yield figure(f"pymunk n={n}", f"{n:,} balls: step / a plain Pymunk loop's", ratios)


def exact(rounds: int) -> Iterator[Figure]:
    """Measure collisions between discs that cover half of their box, per second."""
    for n in (100, 1_000, 10_000, 100_000):
        engine = ExactEngine(scene := gas(n, 0.5), spawn(scene))
        engine.step()  # compiles, and leaves the initial order
        rates = [_collisions_per_second(engine) for _ in range(rounds)]
        yield figure(f"exact n={n}", f"{n:,} discs: collisions", rates, "/s")


def _collisions_per_second(engine: ExactEngine) -> float:
    before, start = engine.collisions, process_time()
    while engine.collisions - before < COLLISIONS:
        engine.step()
    return (engine.collisions - before) / (process_time() - start)


def plain_space(scene: Scene) -> pymunk.Space:
    """Return a space with the scene's elastic balls and arena, to be run by `space.step(1 / scene.rate)`.

    It has only what a user would write, and so costs the same.
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
