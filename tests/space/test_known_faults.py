"""Known faults put into whole Spaces are named, and varied Spaces without them have no finding."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import pymunk
import pytest
from spaces import DT, add, ball, body, box, boxed, ground, wall, world

import sandbox
from sandbox.space.findings import Finding
from sandbox.space.watch import watch


class Game(NamedTuple):
    """A Space, the number of its steps, what its program does before each, and how long each is, s."""

    space: pymunk.Space
    steps: int = 30
    before: Callable[[int], None] = lambda _: None
    dt: Callable[[int], float] = lambda _: DT


def findings_of(game: Game) -> dict[str, Finding]:
    with watch(game.space) as watched:
        for number in range(game.steps):
            game.before(number)
            game.space.step(game.dt(number))
    return {finding.rule: finding for finding in watched.findings}


def only(shapes_of: pymunk.Body) -> Any:
    return next(iter(shapes_of.shapes))


# Faults of how a Space is set up.


def ragdoll_in_itself() -> Game:
    space = ground()
    a, b = box(space, 0, 100), box(space, 15, 100)
    space.add(pymunk.PivotJoint(a, b, (7.5, 100)))
    return Game(space)


def varying_steps() -> Game:
    space = ground()
    ball(space, 0, 100)
    return Game(space, dt=lambda number: DT * (1 + 0.1 * (number % 3)))


# Faults that steps show.


def shot_through_a_wall() -> Game:
    space = ground()
    ball(space, 0, 120, velocity=(0, 3300))
    return Game(space, 4)


def box_through_a_box() -> Game:
    space = world()
    add(space, pymunk.Poly.create_box(space.static_body, (400, 16)))
    box(space, 0, -35, (10, 10), velocity=(0, 4000))
    return Game(space, 3)


def on_a_slope(iterations: int) -> Game:
    """A box on a slope of 20°, which friction holds: tan 20° = 0.36, and 0.64."""
    space, angle = world(iterations), math.radians(20)
    x, y = math.cos(angle), math.sin(angle)
    wall(space, (-500 * x, -500 * y), (500 * x, 500 * y))
    box(space, 15.02 * y, -15.02 * x).angle = angle
    return Game(space, 150)


def rocket_pushed_at_its_place() -> Game:
    space = world(gravity=0)
    rocket = box(space, 300, 200)

    def push(_: int) -> None:
        rocket.apply_force_at_local_point((0, -100), rocket.position)

    return Game(space, before=push)


FAULTS: dict[Callable[[], Game], str] = {
    ragdoll_in_itself: "overlap",
    varying_steps: "dt-varies",
    shot_through_a_wall: "passed-through",
    box_through_a_box: "passed-through",
    rocket_pushed_at_its_place: "wrong-point",
}


@pytest.mark.parametrize("make", FAULTS, ids=lambda make: make.__name__)
def test_a_known_fault_is_named(make: Callable[[], Game]) -> None:
    assert FAULTS[make] in findings_of(make())


# Spaces without a fault.


def pool_table() -> Game:
    space = world(gravity=0)
    space.damping = 0.7
    boxed(space, 400, 200, elasticity=0.8, friction=0.5)
    for row in range(4):
        for k in range(row + 1):
            ball(space, 280 + 18 * row, 100 + 20.5 * (k - row / 2), elasticity=0.95, friction=0.2)
    ball(space, 100, 100, velocity=(350, 0), elasticity=0.95, friction=0.2)
    return Game(space, 60)


def well_solved_pyramid() -> Game:
    space = ground(30)
    for row in range(5):
        for k in range(5 - row):
            box(space, 21 * k + 10.5 * row, 184.99 - 20 * row)
    return Game(space, 60)


def box_that_friction_holds() -> Game:
    return on_a_slope(10)


def ragdoll() -> Game:
    """A torso that hangs on its head, with light limbs."""
    space = world(60)
    group = pymunk.ShapeFilter(group=1)
    torso = box(space, 0, 100, (20, 40), mass=4, filter=group)
    space.add(pymunk.PivotJoint(space.static_body, torso, (0, 80)))
    for x in (-9, 9):
        limb = box(space, x, 134, (8, 28), mass=0.5, filter=group)
        space.add(pymunk.PivotJoint(torso, limb, (x, 120)), pymunk.RotaryLimitJoint(torso, limb, -1, 1))
        limb.velocity = 20, 0
    return Game(space, 60)


def lift() -> Game:
    """Its program sets its velocity, and its position too, so that rounding errors do not add up."""
    space, lift = world(), body(0, 0, kind=pymunk.Body.KINEMATIC)
    add(space, pymunk.Poly.create_box(lift, (100, 10)))
    box(space, 0, -15)

    def rise(number: int) -> None:
        lift.position, lift.velocity = (0, -number / 3), (0, -1 / 3 / DT)

    return Game(space, before=rise)


def conveyor_belt() -> Game:
    space = ground()
    wall(space, (-400, 100), (400, 100), surface_velocity=(60, 0))
    box(space, 0, 84.9)
    return Game(space, 60)


def platformer() -> Game:
    """A player who runs and jumps, by velocities, and a platform that carries."""
    space = ground()
    space.iterations = 20
    carrier, hero = body(120, 120, (30, 0), pymunk.Body.KINEMATIC), pymunk.Body(1, math.inf)
    platform = add(space, pymunk.Poly.create_box(carrier, (80, 10)))
    player = add(space, pymunk.Poly.create_box(hero, (16, 30))).body
    player.position = 120, 99.9

    def play(number: int) -> None:
        platform.body.velocity = (30 if number % 60 < 30 else -30), 0
        if number == 60:
            player.velocity = 80, -300

    return Game(space, 60, play)


def one_way_platform() -> Game:
    """A player who jumps up through a platform, as a handler lets it."""
    space = ground()
    wall(space, (-50, 120), (50, 120), collision_type=2)
    player = ball(space, 0, 184.9, collision_type=1)

    def is_falling(arbiter: pymunk.Arbiter, _: pymunk.Space, __: object) -> None:
        arbiter.process_collision = player.velocity.y > 0

    space.on_collision(1, 2, begin=is_falling)

    def jump(number: int) -> None:
        if number == 5:
            player.velocity = 0, -500

    return Game(space, 60, jump)


def car() -> Game:
    space = ground(30)
    group = pymunk.ShapeFilter(group=1)
    chassis = box(space, 0, 165, (60, 16), mass=4, filter=group)
    for x in (-20, 20):
        wheel = ball(space, x, 182, 12, friction=1.2, filter=group)
        space.add(pymunk.PivotJoint(chassis, wheel, (x, 182)))
        motor = pymunk.SimpleMotor(chassis, wheel, 6)
        motor.max_force = 300
        space.add(motor)
    return Game(space, 100, dt=lambda _: DT / 4)


def sleeping_pile() -> Game:
    space = world(20)
    space.sleep_time_threshold = 0.3
    boxed(space, 100, 120)
    for k in range(9):
        ball(space, 20 + 25 * (k % 3) + k // 3, 50 + 22 * (k // 3))
    return Game(space, 150)


def gas() -> Game:
    space = world(gravity=0)
    boxed(space, 200, 200, elasticity=1, friction=0.1)
    for k in range(9):
        ball(
            space, 40 + 50 * (k % 3), 40 + 50 * (k // 3), velocity=(37 * (k % 4) - 60, 50 - 29 * (k % 5)), elasticity=1
        )
    return Game(space, 60)


def spawned_and_removed() -> Game:
    space = ground()

    def spawn(number: int) -> None:
        if number % 20 == 0:
            ball(space, number - 60, 100)
        for each in [each for each in space.bodies if each.position.y > 180 and number % 20 == 19]:
            space.remove(each, *each.shapes)

    return Game(space, 60, spawn)


def wraps_round() -> Game:
    """A ball whose position function puts it back to the left, across a wall."""
    space = world(gravity=0)
    wall(space, (100, -50), (100, 50))
    made = ball(space, 120, 0, velocity=(120, 0))

    def move(each: pymunk.Body, dt: float) -> None:
        pymunk.Body.update_position(each, dt)
        if each.position.x > 200:
            each.position = 20, 0
        elif each.position.x < 60 and each.velocity.x > 0:
            each.velocity = -each.velocity

    made.position_func = move
    return Game(space, 60)


def walker() -> Game:
    """A program that sets a friction and a surface velocity between steps, with a handler that only looks."""
    space = ground()
    feet = only(box(space, 0, 184.99))
    space.on_collision(0, 0, pre_solve=lambda *_: None)

    def walk(number: int) -> None:
        feet.surface_velocity, feet.friction = (20 * (number % 3), 0), 1 + number % 2

    return Game(space, 60, walk)


def limited_speed() -> Game:
    space = ground()
    made = ball(space, 0, 0)

    def limit(each: pymunk.Body, gravity: tuple[float, float], damping: float, dt: float) -> None:
        pymunk.Body.update_velocity(each, gravity, damping, dt)
        if each.velocity.length > 250:
            each.velocity = each.velocity * (250 / each.velocity.length)

    made.velocity_func = limit
    return Game(space, 60)


def neighbours() -> Game:
    space = world()
    for x in range(-300, 300, 100):
        wall(space, (x, 200), (x + 100, 200)).set_neighbors((x - 100, 200), (x + 200, 200))
    ball(space, -50, 184.9, velocity=(80, 0))
    return Game(space, 60)


def springs() -> Game:
    space = world()
    for k in range(3):
        spring = pymunk.DampedSpring(space.static_body, ball(space, 50 * k, 60), (50 * k, 0), (0, 0), 50, 60, 1 + k)
        space.add(spring)
    return Game(space, 60)


def cradle() -> Game:
    space = world(30)
    for k in range(5):
        at = (20.2 * k, 0)
        bob = ball(space, 20.2 * k, 100, elasticity=1, friction=0)
        space.add(pymunk.PinJoint(space.static_body, bob, at))
        if not k:
            bob.velocity = -200, 0
    for shape in space.shapes:
        shape.friction = 0.1
    return Game(space, 60)


def bricks() -> Game:
    """A ball that removes the bricks that it hits, and flies where they were."""
    space = world(gravity=0)
    boxed(space, 200, 200, elasticity=1)
    for k in range(4):
        brick = body(40 + 40 * k, 60, kind=pymunk.Body.STATIC)
        add(space, pymunk.Poly.create_box(brick, (36, 12)), elasticity=1, collision_type=2)
    ball(space, 100, 150, 6, velocity=(90, -300), elasticity=1, collision_type=1)

    def remove(arbiter: pymunk.Arbiter, space: pymunk.Space, _: object) -> None:
        brick = next(shape for shape in arbiter.shapes if shape.collision_type == 2)
        if brick.body:
            space.remove(brick, brick.body)

    space.on_collision(1, 2, separate=remove)
    return Game(space, 60)


def sensors() -> Game:
    """A ball that flies fast through a sensor, a gate of its group, and a door that was opened."""
    space = world(gravity=0)
    wall(space, (100, -50), (100, 50)).sensor = True
    group = pymunk.ShapeFilter(group=1)
    wall(space, (200, -50), (200, 50), filter=group)
    door = wall(space, (300, -50), (300, 50))
    ball(space, 0, 0, velocity=(1900, 0), filter=group)

    def open_door(number: int) -> None:
        if not number:
            space.remove(door)

    return Game(space, 12, open_door)


def planet() -> Game:
    """A moon on a circle about the origin, by a velocity function."""
    space = world(gravity=0)
    moon = ball(space, 200, 0, velocity=(0, 150))

    def attract(each: pymunk.Body, _: tuple[float, float], damping: float, dt: float) -> None:
        pull = -each.position * (150**2 * 200 / each.position.length**3)
        pymunk.Body.update_velocity(each, pull, damping, dt)

    moon.velocity_func = attract
    return Game(space, 60)


def gears_and_ratchets() -> Game:
    space = world(gravity=0)
    a, b, c = (ball(space, 60 * k, 0) for k in range(3))
    for each in (a, b, c):
        space.add(pymunk.PivotJoint(space.static_body, each, each.position))
    space.add(pymunk.GearJoint(a, b, 0, -1), pymunk.RatchetJoint(b, c, 0, 0.3))
    a.angular_velocity, b.angular_velocity = 2, -2
    return Game(space, 60)


def handler_that_ignores() -> Game:
    space = ground()
    ball(space, 0, 175, velocity=(100, 100), elasticity=0.9)

    def ignore(arbiter: pymunk.Arbiter, _: pymunk.Space, __: object) -> None:
        arbiter.process_collision = False

    space.on_collision(0, 0, begin=ignore)
    return Game(space, 20)


HEALTHY = (
    *(springs, cradle, bricks, sensors, planet, gears_and_ratchets, handler_that_ignores),
    *(pool_table, well_solved_pyramid, box_that_friction_holds, ragdoll),
    *(conveyor_belt, platformer, one_way_platform, car, sleeping_pile, gas, spawned_and_removed),
    *(
        wraps_round,
        walker,
        limited_speed,
        neighbours,
        lift,
    ),
)


@pytest.mark.parametrize("make", HEALTHY, ids=lambda make: make.__name__)
def test_a_space_without_a_fault_has_no_finding(make: Callable[[], Game]) -> None:
    assert findings_of(make()) == {}


def test_a_passage_is_named_with_its_wall_and_what_prevents_it() -> None:
    """A ball of radius 10, by 55 px a step, and half a wall of 5: dt < 15 / 3300 s, or a wall of 2 (55 - 10) px."""
    passage = findings_of(shot_through_a_wall())["passed-through"]
    assert passage.since == pytest.approx(2 * DT)
    assert "through a segment of length 1000" in passage.bodies[0].detail
    assert "dt below 0.0045 s or a wall 90" in passage.bodies[0].detail


def test_a_body_that_went_through_a_wall_is_not_said_to_be_able_to_as_well() -> None:
    assert "tunnelling" in {finding.rule for finding in sandbox.lint(shot_through_a_wall().space)}
    assert findings_of(shot_through_a_wall()).keys() & {"tunnelling", "passed-through"} == {"passed-through"}


@pytest.mark.parametrize("speed", [500, 2000, 2200, 2800])
def test_what_flies_lengthwise_is_long(speed: float) -> None:
    """An arrow of 60 x 4 px: its centre is beyond the middle of a wall of 10 px from 35 px a step on, 2100 px/s."""
    space = world(gravity=0)
    wall(space, (100, -100), (100, 100))
    box(space, 66 - speed / 30, 0, (60, 4), velocity=(speed, 0))
    assert ("tunnelling" in findings_of(Game(space, 3))) == (speed > 2100)


def dropped_on_a_floor(*, meets: bool, of_handler: float | None = None) -> Game:
    """A box that falls on a floor; there is a wall without friction and elasticity, which it may meet."""
    space = ground()
    wall(space, (60 if meets else 400, 0), (60 if meets else 400, 200), friction=0, elasticity=0)
    box(space, 0, 184, velocity=(120, 0), friction=0.1)

    def handle(arbiter: pymunk.Arbiter, _: pymunk.Space, __: object) -> None:
        if of_handler is not None:
            arbiter.friction = arbiter.restitution = of_handler

    space.on_collision(0, 0, pre_solve=handle)
    return Game(space, 40)


def test_a_shape_without_friction_counts_once_something_touches_it() -> None:
    zero = {"friction-zero", "elasticity-zero"}
    assert findings_of(dropped_on_a_floor(meets=False)).keys() & zero == set()
    found = findings_of(dropped_on_a_floor(meets=True))
    assert found.keys() & zero == zero
    assert "a segment of length 200 has friction 0" in found["friction-zero"].bodies[0].detail
    since = found["friction-zero"].since
    assert since
    assert 45 / 120 <= since <= 0.6
    assert findings_of(dropped_on_a_floor(meets=True, of_handler=0.5)).keys() & zero == set()
    assert zero == {finding.rule for finding in sandbox.lint(dropped_on_a_floor(meets=False).space)}


def test_a_fast_ball_is_not_said_to_be_pushed_by_a_bat_that_is_moved() -> None:
    """A bat follows a ball that bounces between it and a ceiling: the ball is deep in it for a step each time."""
    space = world(gravity=0)
    space.collision_slop = 0.01
    wall(space, (-200, 0), (200, 0), elasticity=1)
    bat = body(0, 100, kind=pymunk.Body.KINEMATIC)
    add(space, pymunk.Segment(bat, (-20, 0), (20, 0), 5), elasticity=1)
    made = ball(space, 0, 60, 5, velocity=(90, 500), elasticity=1, friction=0)

    def follow(_: int) -> None:
        bat.position = made.position.x, 100

    found = findings_of(Game(space, 300, follow))
    assert "deep-at-once" in found
    assert "sinks-in" not in found


def test_what_the_program_puts_into_another_is_not_said_to_be_found_late() -> None:
    """A ball is put where another rests, as where balls come in again."""
    space = ground()
    made = ball(space, 0, 190)
    ball(space, 100, 190)

    def put(number: int) -> None:
        if number == 20:
            made.position = 92, 190

    assert "deep-at-once" not in findings_of(Game(space, 60, put))


def test_a_platform_that_is_moved_before_each_step_is_said_to_be_so_though_little_stands_on_it() -> None:
    """A box falls on it for the first of its steps."""
    space, lift = world(), body(0, 0, kind=pymunk.Body.KINEMATIC)
    add(space, pymunk.Poly.create_box(lift, (100, 10)))
    box(space, 0, -25)

    def rise(number: int) -> None:
        lift.position = 0, -number / 2

    [found] = findings_of(Game(space, 30, rise))["moved-by-hand"].bodies
    assert found.detail == "before 29 of the steps"


def test_a_wrong_moment_comes_before_what_it_does() -> None:
    space = ground()
    add(space, pymunk.Poly.create_box(made := pymunk.Body(1, 10), (40, 40)))
    made.position = 0, 160
    assert next(iter(findings_of(Game(space, 180)))) == "moment"


@pytest.mark.parametrize("make", [ragdoll_in_itself, rocket_pushed_at_its_place], ids=lambda make: make.__name__)
def test_what_is_wrong_in_the_program_comes_before_what_follows_from_it(make: Callable[[], Game]) -> None:
    assert next(iter(findings_of(make()))) in {"overlap", "wrong-point"}


def test_a_shape_that_is_gone_when_the_run_ends_is_found_too() -> None:
    space = ground(elasticity=0)
    wall(space, (-500, 195), (-500, 0))
    made = ball(space, 0, 150)

    def remove(number: int) -> None:
        if number == 29:
            space.remove(made, *made.shapes)

    [report] = findings_of(Game(space, 30, remove))["elasticity-zero"].bodies
    assert report.kind == "a dynamic circle of radius 10"


def test_a_body_that_is_gone_is_named_by_its_shape() -> None:
    space = ground()
    made = ball(space, 0, 150, velocity=(0, 800))

    def remove(number: int) -> None:
        if number == 20:
            space.remove(made, *made.shapes)

    assert findings_of(Game(space, 30, remove))["deep-at-once"].bodies[0].kind == "a dynamic circle of radius 10"


def test_what_is_crushed_is_not_said_to_be_hit_too_fast() -> None:
    """A block of 500 kg on two of 1 kg sinks in slowly, by some px a step."""
    space = ground()
    for k, mass in enumerate((1, 1, 500)):
        box(space, 0, 175 - 40 * k, (40, 40), mass=mass)
    found = findings_of(Game(space, 180))
    assert "sinks-in" in found
    assert "deep-at-once" not in found


@pytest.mark.parametrize("kind", [None, pymunk.Body.STATIC, pymunk.Body.KINEMATIC])
def test_a_thin_wall_is_judged_alike_whatever_body_it_is_on(kind: int | None) -> None:
    """A ball of radius 20 that comes 8 px deep into a wall of 2 px, less than half its radius, in its second step."""
    space = world()
    on = space.static_body if kind is None else body(0, 0, kind=kind)
    add(space, pymunk.Segment(on, (-500, 200), (500, 200), 1))
    ball(space, 0, 179 - 8, 20, velocity=(0, 480))
    assert findings_of(Game(space, 30)).keys() == set()
