"""A Space that was rebuilt from its description has the same state, and steps to the bit as one that was built anew."""

import math
import random
from collections.abc import Callable

import pymunk
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox.errors import SandboxError
from sandbox.space.description import Segment, SpaceDescription, describe, rebuild

DT = 1 / 60


def random_shape(draw: random.Random, body: pymunk.Body) -> pymunk.Shape:
    point = draw.uniform(-9, 9), draw.uniform(-9, 9)
    shape: pymunk.Shape
    match draw.randrange(4):
        case 0:
            shape = pymunk.Circle(body, draw.uniform(3, 12), point)
        case 1:
            shape = pymunk.Segment(body, point, (point[0] + 20, point[1] + draw.uniform(-9, 9)), draw.uniform(0, 3))
            if draw.random() < 0.5:
                shape.set_neighbors((draw.uniform(-99, 99), 1 / 3), (0.1, draw.uniform(-99, 99)))
        case 2:
            shape = pymunk.Poly.create_box(body, (draw.uniform(5, 20), draw.uniform(5, 20)), draw.choice([0, 1.5]))
        case _:
            corners = [(draw.uniform(-15, 15), draw.uniform(-15, 15)) for _ in range(draw.randint(3, 9))]
            shape = pymunk.Poly(body, corners, radius=draw.choice([0, 0.75]))
    shape.elasticity, shape.friction = draw.choice([0, 0.3, 0.9]), draw.choice([0, 0.7, 2])
    shape.surface_velocity = draw.choice([(0, 0), (30, -4)])
    shape.collision_type, shape.sensor = draw.randrange(3), draw.random() < 0.1
    shape.filter = draw.choice([pymunk.ShapeFilter(), pymunk.ShapeFilter(3, 0b101, 0xFFFFFFF7)])
    return shape


def random_body(draw: random.Random) -> pymunk.Body:
    kinds = [pymunk.Body.DYNAMIC, pymunk.Body.DYNAMIC, pymunk.Body.KINEMATIC, pymunk.Body.STATIC]
    body = pymunk.Body(draw.uniform(0.5, 9), draw.choice([draw.uniform(40, 900), math.inf]), draw.choice(kinds))
    body.angle = draw.choice([0, draw.uniform(-4, 4)])
    if draw.random() < 0.3:
        body.center_of_gravity = draw.uniform(-4, 4), draw.uniform(-4, 4)
    body.position = draw.uniform(0, 160), draw.uniform(0, 160)
    if body.body_type != pymunk.Body.STATIC:
        body.velocity, body.angular_velocity = (draw.uniform(-90, 90), draw.uniform(-90, 90)), draw.uniform(-5, 5)
    body.force, body.torque = draw.choice([(0, 0), (70, -30)]), draw.choice([0, 500])
    return body


def random_joint(draw: random.Random, a: pymunk.Body, b: pymunk.Body) -> pymunk.Constraint:
    (p, q), n = [(draw.uniform(-9, 9), draw.uniform(-9, 9)) for _ in range(2)], draw.uniform(0.2, 2)
    make: Callable[[], pymunk.Constraint] = draw.choice(
        [
            lambda: pymunk.PinJoint(a, b, p, q),
            lambda: pymunk.SlideJoint(a, b, p, q, 10 * n, draw.choice([40 * n, math.inf])),
            lambda: pymunk.PivotJoint(a, b, p),
            lambda: pymunk.PivotJoint(a, b, p, q),
            lambda: pymunk.GrooveJoint(a, b, p, (30, 1), q),
            lambda: pymunk.DampedSpring(a, b, p, q, 30 * n, 200 * n, 3 * n),
            lambda: pymunk.DampedRotarySpring(a, b, n, 5000 * n, 300 * n),
            lambda: pymunk.RotaryLimitJoint(a, b, -n, n),
            lambda: pymunk.RatchetJoint(a, b, n, n / 3),
            lambda: pymunk.GearJoint(a, b, n, n),
            lambda: pymunk.SimpleMotor(a, b, n),
        ]
    )
    joint = make()
    joint.max_force = draw.choice([math.inf, 1e5])
    joint.error_bias, joint.max_bias = draw.choice([joint.error_bias, 0.01]), draw.choice([math.inf, 50])
    joint.collide_bodies = draw.random() < 0.5
    if isinstance(joint, pymunk.PinJoint):
        joint.distance = draw.choice([joint.distance, 25.5])
    if isinstance(joint, pymunk.RatchetJoint):
        joint.angle = draw.choice([joint.angle, 0.125])
    return joint


def random_space(seed: int) -> pymunk.Space:
    draw = random.Random(seed)
    space = pymunk.Space()
    space.gravity, space.damping = (draw.uniform(-90, 90), draw.uniform(0, 900)), draw.choice([1, 0.8])
    space.iterations, space.collision_slop = draw.randint(1, 20), draw.choice([0.1, 0.5])
    space.collision_bias, space.collision_persistence = draw.choice([0.002, 0.1]), draw.randint(0, 5)
    space.sleep_time_threshold = draw.choice([math.inf, 0.25])
    space.static_body.position = draw.choice([(0, 0), (3, 7)])
    floor = pymunk.Segment(space.static_body, (-200, 180), (400, 190), 2)
    floor.elasticity, floor.friction = 0.5, 0.5
    space.add(floor)
    bodies = [random_body(draw) for _ in range(draw.randint(1, 7))]
    for body in bodies:
        shapes = [random_shape(draw, body) for _ in range(draw.randint(0, 2))]
        if draw.random() < 0.3:
            for shape in shapes:
                shape.density = 0.01
        space.add(body, *shapes)
    loose = pymunk.Body(body_type=pymunk.Body.STATIC)
    loose.position = 80, 20
    for _ in range(draw.randint(0, 6)):
        a, b = draw.sample([*bodies, space.static_body, loose], 2)
        if pymunk.Body.DYNAMIC in (a.body_type, b.body_type):
            space.add(random_joint(draw, a, b))
    return space


def state_of(space: pymunk.Space) -> list[tuple[object, ...]]:
    """Every number of every body, so that equal lists are equal to the bit; a body may have become NaN."""
    names = ("mass", "moment", "center_of_gravity", "position", "angle", "velocity", "angular_velocity", "force")
    return [tuple(repr(getattr(body, name)) for name in (*names, "is_sleeping")) for body in space.bodies]


def wake(*spaces: pymunk.Space) -> None:
    """Wake all bodies: Pymunk 7.3 may abort the process when Python collects a Space with bodies that sleep."""
    for space in spaces:
        for body in space.bodies:
            body.activate()


@given(st.integers(0, 2**32))
@settings(max_examples=100)
def test_a_rebuilt_space_steps_as_one_that_was_built_anew(seed: int) -> None:
    space, twin = random_space(seed), random_space(seed)
    description = describe(space)
    rebuilt = rebuild(description)
    assert state_of(rebuilt.space) == state_of(space)
    for _ in range(20):
        rebuilt.space.step(DT)
        twin.step(DT)
        assert state_of(rebuilt.space) == state_of(twin)
    wake(space, twin, rebuilt.space)


@given(st.integers(0, 2**32))
@settings(max_examples=60)
def test_the_description_of_a_rebuilt_space_is_the_same_in_the_middle_of_a_run_too(seed: int) -> None:
    space = random_space(seed)
    for _ in range(40):
        space.step(DT)
    bodies = *space.bodies, space.static_body
    if not all(math.isfinite(sum(body.position + body.velocity) + body.angular_velocity) for body in bodies):
        wake(space)
        return
    description = describe(space)
    rebuilt = rebuild(description)
    assert state_of(rebuilt.space) == state_of(space)
    assert describe(rebuilt.space) == description
    text = description.model_dump_json()
    assert SpaceDescription.model_validate_json(text).model_dump_json() == text
    wake(space, rebuilt.space)


def test_a_pendulum_steps_as_pymunk_s_own_copy() -> None:
    space = pymunk.Space()
    space.gravity = (0, 900)
    bob, hook = pymunk.Body(2, 50), pymunk.Body(body_type=pymunk.Body.STATIC)  # which is not in the Space
    bob.position, hook.position = (100, 0), (30, 10)
    space.add(bob, pymunk.Circle(bob, 5), pymunk.PinJoint(hook, bob))
    copy, rebuilt = space.copy(), rebuild(describe(space))
    assert [body.in_space for body in describe(space).bodies] == [True, False]
    assert rebuilt.bodies[1].space is None
    for _ in range(100):
        copy.step(DT)
        rebuilt.space.step(DT)
    assert state_of(copy) == state_of(rebuilt.space)
    assert rebuilt.bodies[0].position.get_distance((30, 10)) == pytest.approx(math.hypot(70, 10), rel=0.05)


@given(st.tuples(*[st.floats(-1e6, 1e6)] * 4))
def test_neighbours_are_kept_to_the_bit(numbers: tuple[float, float, float, float]) -> None:
    x, y, u, v = numbers
    space = pymunk.Space()
    segment = pymunk.Segment(space.static_body, (x, y), (y, v), 1)
    segment.set_neighbors((u, v), (x * 1e-9, u / 3))
    space.add(segment)
    for ends in describe(space).shapes, describe(rebuild(describe(space)).space).shapes:
        assert isinstance(ends[0], Segment)
        previous, following = ends[0].neighbors or ((x, y), (y, v))
        assert (previous[0] - x, previous[1] - y) == (u - x, v - y)
        assert (following[0] - y, following[1] - v) == (x * 1e-9 - y, u / 3 - v)


def test_groups_of_sleeping_bodies_sleep_together() -> None:
    space = pymunk.Space()
    space.sleep_time_threshold = 0.5
    bodies = [pymunk.Body(1 + k, 1) for k in range(6)]
    space.add(*bodies)
    for body, first in ((1, None), (4, 1), (3, 1), (5, None), (0, 5)):
        bodies[body].sleep() if first is None else bodies[body].sleep_with_group(bodies[first])
    space.sleep_time_threshold = math.inf  # they sleep on
    description = describe(space)
    rebuilt = rebuild(description)
    assert description.sleeping == ((1, 3, 4), (5, 0)) == describe(rebuilt.space).sleeping
    assert rebuilt.space.sleep_time_threshold == math.inf
    rebuilt.bodies[3].activate()
    assert [body.is_sleeping for body in rebuilt.bodies] == [True, False, False, False, False, True]
    wake(space, rebuilt.space)


def test_a_body_whose_centre_of_gravity_was_set_last_moves_in_its_first_step_as_in_pymunk() -> None:
    def build() -> pymunk.Space:
        space, body = pymunk.Space(), pymunk.Body(1, 10)
        body.position, body.angle, body.center_of_gravity = (10, 20), 0.5, (3, 4)
        space.add(body)
        return space

    space, twin = build(), build()
    rebuilt = rebuild(describe(space))
    assert rebuilt.bodies[0].position == (10, 20)
    twin.step(DT)
    rebuilt.space.step(DT)
    assert state_of(rebuilt.space) == state_of(twin)
    assert rebuilt.bodies[0].position != (10, 20)


def test_functions_of_the_program_are_named() -> None:
    def slow(body: pymunk.Body, gravity: pymunk.Vec2d, damping: float, dt: float) -> None:
        pymunk.Body.update_velocity(body, gravity, damping, dt)

    space, bodies = pymunk.Space(), [pymunk.Body(1, 1), pymunk.Body(1, 1)]
    bodies[1].velocity_func = slow
    bodies[0].velocity_func = pymunk.Body.update_velocity
    springs = [pymunk.DampedSpring(bodies[0], bodies[1], (0, 0), (0, 0), 1, 1, 1) for _ in range(2)]
    springs[1].force_func = lambda spring, distance: 0.0
    springs[0].force_func = pymunk.DampedSpring.spring_force
    space.add(*bodies, *springs)
    space.on_collision(1, 2, begin=print)
    lines = slow.__code__.co_firstlineno, springs[1].force_func.__code__.co_firstlineno
    where = f"{test_functions_of_the_program_are_named.__name__}.<locals>"
    assert describe(space).callables == (
        f"bodies[1].velocity_func: {where}.slow (test_description.py:{lines[0]})",
        f"constraints[1].force_func: {where}.<lambda> (test_description.py:{lines[1]})",
        "on_collision(1, 2).begin: print",
    )


def test_contents_that_pymunk_keeps_in_unusual_ways() -> None:
    space = pymunk.Space(threaded=True)
    space.threads = 2
    moving = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
    moving.moment = 5
    segment = pymunk.Segment(moving, (0, 0), (5, 0), 1)
    segment.unsafe_set_endpoints((1, 2), (30, 4))
    circle = pymunk.Circle(moving, 3)
    circle.color = (1, 2.5, 3, 255)
    gone = pymunk.Body(1, 1)
    left = pymunk.Circle(gone, 4)
    space.add(moving, segment, circle, gone, left)
    space.remove(gone)  # but not its shape
    description = describe(space)
    rebuilt = rebuild(description)
    assert describe(rebuilt.space) == description
    assert (description.settings.threads, rebuilt.space.threads) == (space.threads, space.threads)
    assert rebuilt.bodies[0].moment == 5
    assert rebuilt.shapes[0].normal == segment.normal
    assert rebuilt.shapes[1].color == (1, 2.5, 3, 255)
    assert rebuilt.bodies[1].space is None


def test_a_space_with_a_number_that_is_not_finite_is_refused() -> None:
    space, body = pymunk.Space(), pymunk.Body(1, 1)
    space.add(body)
    body.position = (math.nan, 0)
    with pytest.raises(SandboxError, match=r"^bodies\[0\]\.position\[0\] must be a finite number, got nan"):
        describe(space)
