"""Live Spaces of a few bodies, for tests of what they show."""

import inspect
from collections.abc import Callable
from types import ModuleType
from typing import Any

import pymunk

from sandbox.space.diagnosis import Diagnosis
from sandbox.space.findings import TEXTS
from sandbox.space.recording import Recording
from sandbox.space.watch import watch

DT = 1 / 60


def record(
    space: pymunk.Space, steps: int, before: Callable[[int], None] = lambda _: None, dt: float = DT
) -> Recording:
    """Record steps of a Space; before each, call a function with its number."""
    recording = Recording(space)
    for number in range(steps):
        before(number)
        recording.record(space.step, dt)
    return recording


def watched(
    space: pymunk.Space,
    steps: int = 30,
    before: Callable[[int], object] = lambda _: None,
    dt: Callable[[int], float] = lambda _: DT,
) -> Diagnosis:
    """Return the diagnosis of steps; before each, call a function with its number."""
    with watch(space) as recorded:
        for number in range(steps):
            before(number)
            space.step(dt(number))
    return recorded.diagnosis


def keys_in(module: ModuleType) -> set[str]:
    """The rules whose faults a module finds."""
    return {rule for rule in TEXTS if f'"{rule}"' in inspect.getsource(module)}


def at(step: int, act: Callable[[], object]) -> Callable[[int], None]:
    """Return a function to call before each step, which acts before one of them."""

    def act_then(number: int) -> None:
        if number == step:
            act()

    return act_then


def world(iterations: int = 10, gravity: float = 900) -> pymunk.Space:
    space = pymunk.Space()
    space.gravity, space.iterations = (0, gravity), iterations
    return space


def ground(iterations: int = 10, gravity: float = 900, **values: Any) -> pymunk.Space:
    """A Space with a floor, whose top is at y = 195."""
    space = world(iterations, gravity)
    wall(space, (-500, 200), (500, 200), **values)
    return space


def add(space: pymunk.Space, shape: Any, **values: Any) -> Any:
    for name, value in ({"elasticity": 0.2, "friction": 0.8} | values).items():
        setattr(shape, name, value)
    space.add(shape) if shape.body is space.static_body else space.add(shape.body, shape)
    return shape


def wall(space: pymunk.Space, a: tuple[float, float], b: tuple[float, float], r: float = 5, **values: Any) -> Any:
    return add(space, pymunk.Segment(space.static_body, a, b, r), **values)


def boxed(space: pymunk.Space, width: float, height: float, **values: Any) -> None:
    corners = [(0, 0), (width, 0), (width, height), (0, height)]
    for k in range(4):
        wall(space, corners[k - 1], corners[k], **values)


def body(x: float, y: float, velocity: tuple[float, float] = (0, 0), kind: int = pymunk.Body.DYNAMIC) -> pymunk.Body:
    made = pymunk.Body(body_type=kind)
    made.position, made.velocity = (x, y), velocity
    return made


def ball(space: pymunk.Space, x: float, y: float, r: float = 10, **values: Any) -> Any:
    velocity = values.pop("velocity", (0, 0))
    made = body(x, y, velocity)  # a shape does not keep its body alive
    return add(space, pymunk.Circle(made, r), **{"mass": 1} | values).body


def box(space: pymunk.Space, x: float, y: float, size: tuple[float, float] = (20, 20), **values: Any) -> Any:
    velocity = values.pop("velocity", (0, 0))
    made = body(x, y, velocity)
    return add(space, pymunk.Poly.create_box(made, size), **{"mass": 1} | values).body
