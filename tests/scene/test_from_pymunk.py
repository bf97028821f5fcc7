"""A scene of a live Space: what it has, what is refused, and that Pymunk moves it as it moves the Space."""

import math
import random
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pymunk
import pytest

import sandbox
from sandbox.errors import SandboxError, SpaceWarning
from sandbox.scene.from_pymunk import from_space
from sandbox.scene.spawn import spawn

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


@pytest.mark.parametrize("seed", range(30))
def test_pymunk_moves_the_scene_as_it_moves_the_space(seed: int) -> None:
    space = random_space(seed)
    trajectory = sandbox.simulate(from_space(space), "pymunk", seconds=SECONDS)
    assert len(trajectory.contacts) > 0
    own = []
    for _ in range(SECONDS * RATE):
        space.step(1 / RATE)
        own.append([body.position for body in space.bodies if body.body_type == pymunk.Body.DYNAMIC])
    distance = np.abs(trajectory.position[1:] - np.array(own)).max()
    assert distance < MAX_DISTANCE, f"{distance} px"


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


def on_body(body_type: int) -> Callable[[pymunk.Space], None]:
    def add(space: pymunk.Space) -> None:
        body = pymunk.Body(1, 1, body_type=body_type)
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


def of_space(**settings: object) -> Callable[[pymunk.Space], None]:
    def change(space: pymunk.Space) -> None:
        for key, value in settings.items():
            setattr(space, key, value)

    return change


def add_second_shape(space: pymunk.Space) -> None:
    [circle] = (shape for shape in space.shapes if isinstance(shape, pymunk.Circle))
    space.add(pymunk.Circle(circle.body, 3))


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
    "1 dynamic polygon": on_body(pymunk.Body.DYNAMIC),
    "1 dynamic segment": add_dynamic(lambda body: pymunk.Segment(body, (0, 0), (9, 9), 1)),
    "1 static circle": lambda space: space.add(pymunk.Circle(space.static_body, 5)),
    "1 shape on a kinematic body": on_body(pymunk.Body.KINEMATIC),
    "1 sensor": lambda space: setattr(add_segment(space), "sensor", True),
    "1 dynamic body with several shapes": add_second_shape,
    "1 dynamic body without a shape": add_dynamic(lambda body: None),
    "1 circle off its body's centre of gravity": add_dynamic(lambda body: pymunk.Circle(body, 5, (3, 0))),
    "1 shape with an elasticity outside 0 to 1": lambda space: setattr(add_segment(space), "elasticity", 1.5),
    "1 segment without length": lambda space: space.add(pymunk.Segment(space.static_body, (9, 9), (9, 9), 1)),
    "1 infinite moment of a circle with friction": lambda space: setattr(
        add_ball(space, friction=1), "moment", math.inf
    ),
    "1 body with a force or torque": of_ball(force=(0, 5)),
    "1 custom velocity function": of_ball(velocity_func=lambda body, gravity, damping, dt: None),
    "1 custom position function": of_ball(position_func=lambda body, dt: None),
    "1 surface velocity": of_ball(surface_velocity=(10, 0)),
    "2 shapes with filters that ignore others": ignore_each_other,
    "1 collision handler": lambda space: space.on_collision(None, None, begin=lambda arbiter, space, data: None),
    "1 sleep_time_threshold": of_space(sleep_time_threshold=0.5),
    "1 damping outside 0 to 1": of_space(damping=1.5),
    "2 PivotJoints": add_joint,
}


@pytest.mark.parametrize("what", UNSUPPORTED)
def test_what_a_scene_cannot_have_is_refused_by_name_or_left_out_with_a_warning(what: str) -> None:
    space = simple_space()
    UNSUPPORTED[what](space)
    with pytest.raises(SandboxError) as raised:
        from_space(space)
    assert str(raised.value) == f"the Space has {what}, which a scene cannot have; skip=True leaves that out"
    add_ball(space, 200)
    with pytest.warns(SpaceWarning, match=f"left out of the scene: {what}") as warned:
        scene = from_space(space, skip=True)
    assert all(one.filename == __file__ for one in warned)
    assert len(scene.bodies) >= 1


def test_all_that_is_refused_is_in_one_message() -> None:
    space = simple_space()
    add_joint(space)
    for kind in (pymunk.Body.DYNAMIC, pymunk.Body.DYNAMIC, pymunk.Body.KINEMATIC):
        on_body(kind)(space)
    space.sleep_time_threshold = 1
    with pytest.raises(SandboxError, match=r"^the Space has [^;]+, which a scene cannot have; skip=True") as raised:
        from_space(space)
    for what in ("2 dynamic polygons", "1 shape on a kinematic body", "2 PivotJoints", "1 sleep_time_threshold"):
        assert what in str(raised.value)


def test_filters_that_ignore_nothing_and_handlers_without_callbacks_are_accepted() -> None:
    space = simple_space()
    for group, shape in enumerate(space.shapes, 1):
        shape.filter = pymunk.ShapeFilter(group=group, categories=group)
    space.on_collision(1, 2)
    assert len(from_space(space).bodies) == 1


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
    with pytest.warns(SpaceWarning, match="^1 contact has begun, and Pymunk starts from its impulse"):
        from_space(space)


def test_what_is_no_space_is_refused() -> None:
    with pytest.raises(SandboxError, match=r"space must be a pymunk\.Space, got str"):
        from_space("article")  # type: ignore[arg-type]


@pytest.mark.parametrize("seed", range(3))
def test_the_scene_of_a_space_is_written_and_loads_to_an_equal_one(seed: int, tmp_path: Path) -> None:
    scene = from_space(random_space(seed), title="Mine")
    sandbox.write(scene, tmp_path / "mine.toml")
    loaded = sandbox.load(tmp_path / "mine.toml")
    assert loaded == scene
    assert loaded != scene.changed(gravity=(1, 1))
    assert spawn(loaded).spin.tobytes() == spawn(scene).spin.tobytes()
