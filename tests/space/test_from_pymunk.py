"""A scene of a live Space: what it has, what is refused, and that Pymunk moves it as it moves the Space."""

import math
import random
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pymunk
import pytest

import sandbox
from sandbox.engines.pymunk import PymunkEngine
from sandbox.errors import SandboxError, SpaceWarning
from sandbox.scene.spawn import spawn
from sandbox.space.from_pymunk import from_space
from sandbox.state import Floats

RATE = 60
SECONDS = 2
MAX_DISTANCE = 1e-6  # px, between a Space and its scene in Pymunk after 2 s


def add_ball(space: pymunk.Space, x: float = 100, y: float = 100, **settings: float) -> pymunk.Body:
    """Add a disc of 2 kg and 10 px; settings of its shape."""
    body = pymunk.Body(2, pymunk.moment_for_circle(2, 0, 10))
    body.position = x, y
    circle = pymunk.Circle(body, 10)
    for key, value in settings.items():
        setattr(circle, key, value)
    space.add(body, circle)
    return body


def add_segment(space: pymunk.Space, body: pymunk.Body | None = None) -> pymunk.Segment:
    segment = pymunk.Segment(body or space.static_body, (0, 200), (300, 200), 3)
    space.add(*([body] if body else []), segment)
    return segment


def simple_space() -> pymunk.Space:
    space = pymunk.Space()
    add_ball(space)
    add_segment(space)
    return space


def random_space(seed: int) -> pymunk.Space:
    """Return a box with a wall and a polygon, each on a turned body, and some discs with friction, spin and angle."""
    rng, space = random.Random(seed), pymunk.Space()
    space.gravity = rng.uniform(-100, 100), rng.choice([300, 900])
    space.iterations, space.collision_slop = rng.choice([5, 10, 20]), rng.choice([0.0, 0.1, 0.3])
    space.collision_persistence, space.damping = rng.choice([1, 3]), rng.choice([0.8, 1.0])

    def add(shape: pymunk.Shape) -> None:
        shape.elasticity, shape.friction = rng.uniform(0.4, 1), rng.uniform(0, 1)
        space.add(shape)

    corners = [(0, 0), (640, 0), (640, 400), (0, 400)]
    for k in range(4):
        add(pymunk.Segment(space.static_body, corners[k - 1], corners[k], rng.uniform(2, 8)))
    for _ in range(2):
        body = pymunk.Body(body_type=pymunk.Body.STATIC)
        body.position, body.angle = (rng.uniform(150, 500), rng.uniform(230, 350)), rng.uniform(-3, 3)
        space.add(body)
        size = rng.uniform(30, 90), rng.uniform(20, 60)
        segment = pymunk.Segment(body, (-60, 0), (60, 10), 3)
        add(pymunk.Poly.create_box(body, size, rng.choice([0.0, 2.0])) if rng.random() < 0.7 else segment)
    for k in range(rng.randint(2, 5)):
        mass, radius = rng.uniform(0.5, 3), rng.uniform(6, 18)
        body = pymunk.Body(mass, pymunk.moment_for_circle(mass, 0, radius))
        body.position, body.velocity = (80 + 120 * k, 100), (rng.uniform(-250, 250), rng.uniform(-250, 250))
        body.angle, body.angular_velocity = rng.uniform(-3, 3), rng.uniform(-5, 5)
        space.add(body)
        add(pymunk.Circle(body, radius))
    return space


def positions_after_steps(space: pymunk.Space) -> Floats:
    """Run a Space, and return the positions of its dynamic bodies after each step: (steps, n, 2) px."""
    positions = []
    for _ in range(SECONDS * RATE):
        space.step(1 / RATE)
        positions.append([body.position for body in space.bodies if body.body_type == pymunk.Body.DYNAMIC])
    return np.array(positions)


@pytest.mark.parametrize("seed", range(30))
def test_pymunk_moves_the_scene_as_it_moves_the_space(seed: int) -> None:
    space = random_space(seed)
    trajectory = sandbox.simulate(from_space(space), "pymunk", seconds=SECONDS)
    assert len(trajectory.contacts) > 0
    distance = np.abs(trajectory.position[1:] - positions_after_steps(space)).max()
    assert distance < MAX_DISTANCE, f"{distance} px"


@pytest.mark.parametrize("walls_first", [True, False])
def test_touching_discs_move_as_in_the_space_whether_walls_or_balls_were_added_first(walls_first: bool) -> None:
    def add_balls() -> None:
        for k in range(12):
            add_ball(space, 140 + 40 * (k % 4) + 5 * (k // 4), 100 + 40 * (k // 4), friction=0.6)

    def add_funnel() -> None:
        for start, end in pairwise([(0, 100), (150, 380), (250, 380), (400, 100)]):
            space.add(pymunk.Segment(space.static_body, start, end, 5))

    space = pymunk.Space()
    space.gravity = 0, 900
    for add in (add_funnel, add_balls) if walls_first else (add_balls, add_funnel):
        add()
    trajectory = sandbox.simulate(from_space(space), "pymunk", seconds=SECONDS)
    own = positions_after_steps(space)
    assert np.array_equal(trajectory.position[1:], own), f"{np.abs(trajectory.position[1:] - own).max()} px"


def test_everything_a_scene_can_have_is_read() -> None:
    space = pymunk.Space()
    space.gravity, space.iterations, space.damping = (5, 900), 30, 0.9
    body = add_ball(space, 120, 80, elasticity=0.8, friction=0.5)
    body.velocity, body.angle, body.angular_velocity = (30, -40), 1.5, 7
    carrier = pymunk.Body(body_type=pymunk.Body.STATIC)
    carrier.position, carrier.angle = (100, 50), math.pi / 2
    segment = pymunk.Segment(carrier, (10, 0), (70, 0), 2.5)
    segment.elasticity, segment.friction = 0.7, 0.3
    space.add(carrier, segment)
    scene = from_space(space, rate=120, title="Mine")
    assert (scene.title, scene.rate, scene.gravity, scene.arena.walls) == ("Mine", 120, (5, 900), False)
    assert scene.pymunk.model_dump(exclude_defaults=True) == {"iterations": 30, "damping": 0.9}
    assert [part.tolist() for part in (scene.bodies.radius, scene.bodies.mass)] == [[10], [2]]
    assert [part.tolist() for part in (scene.bodies.elasticity, scene.bodies.friction)] == [[0.8], [0.5]]
    state = spawn(scene)
    assert [part.tolist() for part in (state.position, state.velocity)] == [[[120, 80]], [[30, -40]]]
    assert state.spin.tolist() == [7]
    [wall] = scene.walls
    assert wall.start == pytest.approx((100, 60))
    assert wall.to == pytest.approx((100, 120))
    assert (wall.thickness, wall.elasticity, wall.friction, wall.joined) == (5, 0.7, 0.3, False)
    assert scene.arena.size == (130, 123)
    assert from_space(space, size=(300, 200)).arena.size == (300, 200)


def test_a_static_polygon_becomes_its_joined_sides() -> None:
    space = simple_space()
    box = pymunk.Poly.create_box(space.static_body, (40, 20), radius=1.5)
    space.add(box)
    sides = from_space(space).walls[1:]
    assert [side.to for side in sides] == [side.start for side in (*sides[1:], sides[0])]
    assert {side.start for side in sides} == {(-20, -10), (20, -10), (20, 10), (-20, 10)}
    assert all((side.thickness, side.joined) == (3, True) for side in sides)


def test_static_circles_and_segments_without_length_become_pegs_off_which_pymunk_bounces_alike() -> None:
    space = simple_space()
    space.gravity = 0, 900
    carrier = pymunk.Body(body_type=pymunk.Body.STATIC)
    carrier.position, carrier.angle = (120, 100), math.pi / 2
    circle, point = pymunk.Circle(carrier, 12, (30, 0)), pymunk.Segment(carrier, (0, 60), (0, 60), 4)
    circle.elasticity, circle.friction = 0.7, 0.3
    space.add(carrier, circle, point)
    scene = from_space(space)
    [_, peg, other] = scene.walls
    assert peg.is_peg
    assert peg.start == pytest.approx((120, 130))
    assert (peg.thickness, peg.elasticity, peg.friction) == (24, 0.7, 0.3)
    assert other.is_peg
    assert other.start == pytest.approx((60, 100))
    ball = next(body for body in space.bodies if body.body_type == pymunk.Body.DYNAMIC)
    ball.position = 116, 60
    trajectory = sandbox.simulate(from_space(space), "pymunk", seconds=SECONDS)
    assert ~5 in trajectory.contacts["second"]
    assert np.abs(trajectory.position[1:] - positions_after_steps(space)).max() < MAX_DISTANCE


def test_a_kinematic_body_at_rest_carries_walls_as_a_static_one_does() -> None:
    spaces = [simple_space(), simple_space()]
    for space, kind in zip(spaces, (pymunk.Body.STATIC, pymunk.Body.KINEMATIC), strict=True):
        space.gravity = 0, 900
        carrier = pymunk.Body(body_type=kind)
        carrier.position = 98, 150
        space.add(carrier, pymunk.Circle(carrier, 12))
    assert from_space(spaces[0]) == from_space(spaces[1])
    on_static, on_kinematic = map(positions_after_steps, spaces)
    assert np.array_equal(on_static, on_kinematic)


def test_sensors_touch_nothing_and_are_left_out_with_a_warning() -> None:
    space = simple_space()
    carrier = pymunk.Body(body_type=pymunk.Body.STATIC)
    [body] = (body for body in space.bodies if body.body_type == pymunk.Body.DYNAMIC)
    sensors = pymunk.Segment(carrier, (0, 120), (300, 120), 3), pymunk.Circle(body, 30)
    for sensor in sensors:
        sensor.sensor = True
    space.add(carrier, *sensors)
    with pytest.warns(SpaceWarning, match="^left out of the scene: 2 sensors, which touch nothing$"):
        scene = from_space(space)
    assert scene == from_space(simple_space())


def on_body(body_type: int) -> Callable[[pymunk.Space], None]:
    def add(space: pymunk.Space) -> None:
        body = pymunk.Body(1, 1, body_type=body_type)
        body.angular_velocity = 1
        space.add(body, pymunk.Poly.create_box(body))

    return add


def add_joint(space: pymunk.Space) -> None:
    [body] = (one for one in space.bodies if one.body_type == pymunk.Body.DYNAMIC)
    space.add(pymunk.PivotJoint(space.static_body, body, (0, 0)), pymunk.PivotJoint(space.static_body, body, (9, 9)))


def of_ball(**settings: object) -> Callable[[pymunk.Space], None]:
    def change(space: pymunk.Space) -> None:
        [circle] = (shape for shape in space.shapes if isinstance(shape, pymunk.Circle))
        for key, value in settings.items():
            setattr(circle if hasattr(circle, key) else circle.body, key, value)

    return change


def add_dynamic(make: Callable[[pymunk.Body], pymunk.Shape | None]) -> Callable[[pymunk.Space], None]:
    def add(space: pymunk.Space) -> None:
        body = pymunk.Body(1, 1)
        shape = make(body)
        space.add(body, *([shape] if shape else []))

    return add


def ignore_each_other(space: pymunk.Space) -> None:
    for shape in space.shapes:
        shape.filter = pymunk.ShapeFilter(group=1)


UNSUPPORTED = {
    "1 x dynamic shape that is not a circle round its body's place": add_dynamic(
        lambda body: pymunk.Circle(body, 5, (3, 0))
    ),
    "1 x moving kinematic body": on_body(pymunk.Body.KINEMATIC),
    "1 x dynamic body with more or less than one shape": add_dynamic(lambda body: None),
    "1 x force or torque": of_ball(force=(0, 5)),
    "1 x function for a velocity or position": of_ball(position_func=lambda body, dt: None),
    "1 x surface velocity": of_ball(surface_velocity=(10, 0)),
    "1 x filter between a ball and a wall": ignore_each_other,
    "1 x collision handler": lambda space: space.on_collision(None, None, begin=lambda arbiter, space, data: None),
    "2 x PivotJoint": add_joint,
}


OUT_OF_RANGE: dict[str, Callable[[pymunk.Space], None]] = {
    "walls[1].elasticity must be at most 1, got 1.5": lambda space: setattr(add_segment(space), "elasticity", 1.5),
    "balls[0].position[0] must be a finite number, got nan": of_ball(position=(math.nan, 100)),
    "balls[0].position[0] must be a finite number, got inf": of_ball(position=(math.inf, 100)),
    "damping must be at most 1, got 1.5": lambda space: setattr(space, "damping", 1.5),
    "walls[1].thickness must be greater than 0 where to is the same point as from": (
        lambda space: space.add(pymunk.Segment(space.static_body, (9, 9), (9, 9), 0))
    ),
}
REFUSED = {f"the Space has what a scene cannot have: {what}": add for what, add in UNSUPPORTED.items()} | OUT_OF_RANGE


@pytest.mark.parametrize("message", REFUSED)
def test_what_a_scene_cannot_have_is_refused_in_one_message(message: str) -> None:
    REFUSED[message](space := simple_space())
    with pytest.raises(SandboxError) as raised:
        from_space(space)
    assert str(raised.value) == message


def test_all_that_is_refused_is_in_one_message() -> None:
    space = simple_space()
    add_joint(space)
    for kind in (pymunk.Body.DYNAMIC, pymunk.Body.DYNAMIC, pymunk.Body.KINEMATIC):
        on_body(kind)(space)
    with pytest.raises(SandboxError) as raised:
        from_space(space)
    for what in ("2 x dynamic shape", "1 x moving kinematic body", "2 x PivotJoint"):
        assert what in str(raised.value)


def test_filters_that_ignore_nothing_and_handlers_without_callbacks_are_accepted() -> None:
    space = simple_space()
    for group, shape in enumerate(space.shapes, 1):
        shape.filter = pymunk.ShapeFilter(group=group, categories=group)
    space.on_collision(1, 2)
    assert len(from_space(space).bodies) == 1


def test_filters_between_balls_are_those_of_the_scene(tmp_path: Path) -> None:
    space = simple_space()
    filters = [(2**40, 0b1, 0b10), (5, 0xFFFFFFFF, 0xFFFFFFFF), (2**40, 0b11, 0xFFFFFFFF), (0, 0xFFFFFFFF, 0xFFFFFFF2)]
    for k, of_ball in enumerate(filters, 2):
        next(iter(add_ball(space, 50 * k).shapes)).filter = pymunk.ShapeFilter(*of_ball)
    next(shape for shape in space.shapes if isinstance(shape, pymunk.Segment)).filter = pymunk.ShapeFilter(9, 0b10)
    scene = from_space(space)
    # A group is only a name: they are numbered in their order.
    names = (1, 2, 1, 0)
    assert scene.bodies.filters.tolist()[-4:] == [
        [name, *rest] for name, (_, *rest) in zip(names, filters, strict=True)
    ]
    sandbox.dump(scene, tmp_path / "mine.toml")
    assert sandbox.load(tmp_path / "mine.toml").bodies.filters.tolist() == scene.bodies.filters.tolist()
    shapes = [
        shape.filter for shape in PymunkEngine(scene, spawn(scene)).space.shapes if isinstance(shape, pymunk.Circle)
    ]
    assert shapes[-4:] == [pymunk.ShapeFilter(name, *rest) for name, (_, *rest) in zip(names, filters, strict=True)]


def test_a_body_that_sleeps_is_a_ball_at_rest() -> None:
    space = simple_space()
    space.gravity, space.sleep_time_threshold, space.idle_speed_threshold = (0, 900), 0.2, 20
    ball = add_ball(space, 100)
    ball.position, ball.velocity = (200, 187), (5, 0)
    for _ in range(RATE):
        space.step(1 / RATE)
    assert ball.is_sleeping
    assert ball.velocity.x == pytest.approx(5)  # which Pymunk keeps for when it wakes
    scene = from_space(space)
    assert not spawn(scene).velocity.any()
    assert (scene.pymunk.sleep_time_threshold, scene.pymunk.idle_speed_threshold) == (0.2, 20)


def test_other_moments_are_listed_in_a_warning_where_they_matter() -> None:
    space = simple_space()
    add_ball(space, 50, friction=0.5).moment = 250
    add_ball(space, 150).moment = math.inf
    with pytest.warns(SpaceWarning, match=r"with moments m r²/2; in this Space, ball 1 250 instead of 100$") as warned:
        from_space(space)
    assert len(warned) == 1


def test_contacts_that_have_begun_are_warned_of() -> None:
    space = simple_space()
    space.gravity = 0, 900
    for _ in range(60):
        space.step(1 / RATE)
    with pytest.warns(SpaceWarning, match="^the next step starts from the impulses of 1 contact"):
        from_space(space)


@pytest.mark.parametrize("seed", range(3))
def test_the_scene_of_a_space_is_written_and_loads_to_an_equal_one(seed: int, tmp_path: Path) -> None:
    scene = from_space(random_space(seed), title="Mine")
    sandbox.dump(scene, tmp_path / "mine.toml")
    loaded = sandbox.load(tmp_path / "mine.toml")
    assert loaded == scene
    assert loaded != scene.changed(gravity=(1, 1))
    assert spawn(loaded).spin.tobytes() == spawn(scene).spin.tobytes()
