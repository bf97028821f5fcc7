"""The energy ledger adds up, and its lines are those of closed forms."""

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pymunk
import pytest
from spaces import DT, add, at, ball, boxed, record, wall, world

from sandbox.space.diagnosis import Diagnosis
from sandbox.space.energy import Cause, Ledger, ledger_of
from sandbox.space.recording import Recording, Run

ROUNDING = 1e-9  # of the scale of the energy


def energy_of(space: pymunk.Space) -> float:
    """The kinetic and the potential energy, by Pymunk's own functions."""
    energy = 0.0
    for body in space.bodies:
        if body.body_type == pymunk.Body.DYNAMIC:
            centre = body.local_to_world(body.center_of_gravity)
            energy += body.mass * body.velocity.length**2 / 2 - body.mass * centre.dot(space.gravity)
            if math.isfinite(body.moment):
                energy += body.moment * body.angular_velocity**2 / 2
    return energy


def random_body(random: np.random.Generator, space: pymunk.Space) -> pymunk.Body:
    body = pymunk.Body()
    body.position, body.angle = tuple(random.uniform((60, 60), (540, 340))), random.uniform(0, 6)
    body.velocity, body.angular_velocity = tuple(random.uniform(-200, 200, 2)), random.uniform(-5, 5)
    size = random.uniform(5, 25)
    shape: pymunk.Shape
    match random.integers(3):
        case 0:
            shape = pymunk.Circle(body, size, (size / 3, 0))
        case 1:
            shape = pymunk.Poly(body, [(0, 0), (2 * size, 0), (2 * size, size), (size, 1.5 * size)], radius=0.5)
        case _:
            shape = pymunk.Segment(body, (-size, 0), (size, 3), 3)
    shape.density, shape.elasticity, shape.friction = (
        random.uniform(0.001, 0.01),
        random.uniform(0, 1),
        random.uniform(0, 1),
    )
    if random.integers(4) == 0:
        shape.surface_velocity = (random.uniform(-50, 50), 0)
    space.add(body, shape)
    return body


def random_joint(random: np.random.Generator, kind: int, a: pymunk.Body, b: pymunk.Body) -> pymunk.Constraint:
    p, q = (tuple(random.uniform(-15, 15, 2)) for _ in range(2))
    makers: list[Callable[[], pymunk.Constraint]] = [
        lambda: pymunk.PinJoint(a, b, p, q),
        lambda: pymunk.SlideJoint(a, b, p, q, 20, 60),
        lambda: pymunk.PivotJoint(a, b, p, q),
        lambda: pymunk.GrooveJoint(a, b, (-30, 5), (30, -5), q),
        lambda: pymunk.DampedSpring(a, b, p, q, 40, random.uniform(50, 500), random.uniform(0, 10)),
        lambda: pymunk.DampedRotarySpring(a, b, 0.5, random.uniform(1e3, 1e5), random.uniform(0, 1e4)),
        lambda: pymunk.RotaryLimitJoint(a, b, -0.5, 0.5),
        lambda: pymunk.RatchetJoint(a, b, 0.2, math.pi / 3),
        lambda: pymunk.GearJoint(a, b, 0.3, random.uniform(0.5, 3)),
        lambda: pymunk.SimpleMotor(a, b, random.uniform(-5, 5)),
    ]
    return makers[kind]()


def random_space(seed: int) -> tuple[pymunk.Space, np.random.Generator]:
    random = np.random.default_rng(seed)
    space = pymunk.Space()
    space.gravity, space.damping = tuple(random.uniform(-300, 300, 2)), random.uniform(0.7, 1)
    boxed(space, 600, 400, elasticity=0.9, friction=0.7)
    bodies = [random_body(random, space) for _ in range(12)]
    bodies[0].moment = math.inf
    paddle = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
    paddle.position, paddle.velocity, paddle.angular_velocity = (300, 100), (20, 10), 1
    space.add(paddle, pymunk.Poly.create_box(paddle, (80, 20)))
    partners = [*bodies, paddle, space.static_body]
    for kind in range(10):
        a, b = random.choice(len(partners), 2, replace=False)
        if {int(a), int(b)} <= {0, 12, 13}:  # nothing that a motor could turn
            a = 3
        joint = random_joint(random, kind, partners[a], partners[b])
        joint.max_force = random.choice([math.inf, 1e5])
        space.add(joint)
    return space, random


@pytest.mark.parametrize("seed", range(12))
def test_the_ledger_of_a_random_space_adds_up_and_leaves_nothing_over(seed: int) -> None:
    space, _ = random_space(seed)
    start = energy_of(space)
    ledger = ledger_of(Run(record(space, 90)))
    assert_adds_up(ledger)
    assert energy_of(space) - start == pytest.approx(ledger.total[-1] - ledger.total[0], abs=ROUNDING * ledger.scale)
    assert np.abs(ledger.work[Cause.CALLBACKS]).max() < ROUNDING * ledger.scale


def assert_adds_up(ledger: Ledger) -> None:
    error = np.abs(np.cumsum(sum(ledger.work.values())) - (ledger.total[1:] - ledger.total[0]))
    assert error.max() < ROUNDING * max(ledger.scale, np.abs(ledger.potential).max())


def resting_on_floor(body: pymunk.Body, shape: pymunk.Shape, *, friction: float = 0.0) -> pymunk.Space:
    space = pymunk.Space()
    floor = pymunk.Segment(space.static_body, (-10_000, 0), (10_000, 0), 1)
    floor.elasticity = 1
    floor.friction, shape.friction = 1, friction
    space.add(floor, body, shape)
    return space


def only(ledger: Ledger, *causes: Cause) -> None:
    """Assert that no other line is more than rounding."""
    for cause, value in ledger.lines.items():
        if cause not in causes:
            assert abs(value) < ROUNDING * ledger.scale, cause


def test_a_sliding_box_loses_what_coulomb_s_law_takes() -> None:
    """The work is μ m g times the distance; the box goes on with a step's first velocity, friction acts on the mean."""
    mass, gravity, mu, speed, steps = 2.0, 900.0, 0.4, 300.0, 30
    body = pymunk.Body(mass, math.inf)
    space = resting_on_floor(body, pymunk.Poly.create_box(body, (60, 10)), friction=mu)
    space.gravity, body.position, body.velocity = (0, -gravity), (0, 5.95), (speed, 0)
    ledger = ledger_of(Run(record(space, steps)))
    distance = body.position.x + (body.velocity.x - speed) * DT / 2
    assert body.velocity.x == pytest.approx(speed - mu * gravity * steps * DT, rel=1e-12)
    assert ledger.lines[Cause.FRICTION] == pytest.approx(-mu * mass * gravity * distance, rel=1e-12)
    assert ledger.total[-1] - ledger.total[0] == pytest.approx(ledger.lines[Cause.FRICTION], rel=1e-12)


@pytest.mark.parametrize("elasticity", [0, 0.6, 1])
def test_a_bouncing_ball_loses_what_its_restitution_says(elasticity: float) -> None:
    body = pymunk.Body(3, 50)
    shape = pymunk.Circle(body, 10)
    shape.elasticity = elasticity
    space = resting_on_floor(body, shape)
    body.position, body.velocity = (0, 40), (30, -250)
    ledger = ledger_of(Run(record(space, 30)))
    assert ledger.lines[Cause.RESTITUTION] == pytest.approx(-(1 - elasticity**2) * 3 * 250**2 / 2, rel=1e-12)
    only(ledger, Cause.RESTITUTION)


def test_a_box_that_falls_on_an_edge_loses_by_the_mass_that_the_edge_feels() -> None:
    mass, moment, half, angle, e, speed = 2.0, 300.0, 10.0, 0.5, 0.3, 200.0
    body = pymunk.Body(mass, moment)
    shape = pymunk.Poly.create_box(body, (2 * half, 2 * half))
    shape.elasticity = e
    space = resting_on_floor(body, shape)
    arm = half * math.cos(angle) - half * math.sin(angle)  # to the lowest edge, along the floor
    below = half * math.cos(angle) + half * math.sin(angle)
    body.position, body.angle, body.velocity = (0, 1 + below + 5), angle, (0, -speed)
    ledger = ledger_of(Run(record(space, 3)))
    felt = 1 / (1 / mass + arm**2 / moment)
    assert ledger.lines[Cause.RESTITUTION] == pytest.approx(-(1 - e**2) * felt * speed**2 / 2, rel=1e-9)
    only(ledger, Cause.RESTITUTION)


def test_contacts_that_an_unconverged_solver_leaves_are_not_due() -> None:
    """A row of balls is hit and does not bounce: with few iterations, contacts end while bodies still approach."""
    errors = []
    for iterations in (3, 200):
        space = pymunk.Space()
        space.iterations = iterations
        bodies = [pymunk.Body(1, 50) for _ in range(5)]
        for k, body in enumerate(bodies):
            body.position = (19.95 * k, 0)
            space.add(body, pymunk.Circle(body, 10))
        bodies[0].velocity = (100, 0)
        ledger = ledger_of(Run(record(space, 1)))
        assert_adds_up(ledger)
        errors.append(abs(ledger.lines[Cause.RESTITUTION_ERROR]))
    assert errors[0] > 0.01 * ledger.scale
    assert errors[1] < 1e-6 * errors[0]


def test_free_fall_gains_half_of_what_gravity_adds_in_a_step() -> None:
    """v = n g dt and y = -g dt² n (n - 1) / 2, so that the energy grows by m g² dt² / 2 a step."""
    space, body = pymunk.Space(), pymunk.Body(2, 10)
    space.gravity = (0, -900)
    space.add(body)
    ledger = ledger_of(Run(record(space, 50)))
    assert ledger.lines[Cause.INTEGRATION] == pytest.approx(50 * 2 * (900 * DT) ** 2 / 2, rel=1e-9)
    only(ledger, Cause.INTEGRATION)


def test_what_drives_bodies_through_joints_is_not_said_to_be_an_error_of_the_joints() -> None:
    """A chain of three swings freely, until a joint of limited force pulls its end."""
    space = pymunk.Space()
    space.gravity = (0, -900)
    chain = [pymunk.Body(1, 40) for _ in range(3)]
    for k, (last, link) in enumerate(zip([space.static_body, *chain], chain, strict=False)):
        link.position = (20 * k + 20, 0)
        space.add(link, pymunk.PivotJoint(last, link, (20 * k, 0)))
    free = ledger_of(Run(record(space, 20)))
    only(free, Cause.JOINTS, Cause.INTEGRATION)
    assert free.lines[Cause.JOINTS] != 0
    hand = pymunk.PivotJoint(space.static_body, chain[2], (0, 300), (0, 0))
    hand.max_force = 1e5
    space.add(hand)
    only(ledger_of(Run(record(space, 20))), Cause.DRIVEN, Cause.INTEGRATION)


@pytest.mark.wide
def test_a_pendulum_s_joint_does_no_work_in_the_limit_of_small_steps() -> None:
    totals = []
    for rate in (120, 240, 480):
        space, body = pymunk.Space(), pymunk.Body(2, math.inf)
        space.gravity, body.position = (0, -900), (100, 0)
        space.add(body, pymunk.PinJoint(space.static_body, body))
        ledger = ledger_of(Run(record(space, rate, dt=1 / rate)))
        assert_adds_up(ledger)
        totals.append(abs(ledger.lines[Cause.JOINTS]) / ledger.scale)
    assert totals[0] < 0.2
    assert totals[2] / totals[1] == pytest.approx(0.5, abs=0.15)


@pytest.mark.parametrize("damping", [1, 0.5])
def test_what_a_spring_gives_is_its_line_also_where_the_space_damps(damping: float) -> None:
    """A quarter of a period, in which 80 · 30² / 2 become kinetic; with damping, all that is not taken."""
    space, body = pymunk.Space(), pymunk.Body(2, math.inf)
    space.damping, body.position = damping, (130, 0)
    space.add(body, pymunk.DampedSpring(space.static_body, body, (0, 0), (0, 0), 100, 80, 0))
    seconds = math.pi / 2 * math.sqrt(2 / 80)
    ledger = ledger_of(Run(record(space, 1000, dt=seconds / 1000)))
    assert ledger.lines[Cause.DRIVEN] == pytest.approx(80 * 30**2 / 2, rel=0.01)
    assert ledger.lines[Cause.CALLBACKS] == pytest.approx(0, abs=ROUNDING * ledger.scale)
    assert (ledger.lines[Cause.DAMPING] < 0) == (damping < 1)


def test_a_motor_s_work_is_the_energy_of_the_wheel() -> None:
    space, wheel = pymunk.Space(), pymunk.Body(1, 40)
    motor = pymunk.SimpleMotor(space.static_body, wheel, -3)
    motor.max_force = 200
    space.add(wheel, motor)
    ledger = ledger_of(Run(record(space, 60)))
    assert ledger.lines[Cause.DRIVEN] == pytest.approx(40 * 3**2 / 2, rel=1e-9)
    only(ledger, Cause.DRIVEN)


def test_a_ball_that_a_motor_presses_to_a_wall_is_no_bounce_against_its_elasticity() -> None:
    space, arm = world(gravity=0), pymunk.Body()
    wall(space, (0, 60), (200, 60), elasticity=0.5)
    add(space, pymunk.Segment(arm, (0, 0), (100, 0), 5), mass=10, elasticity=0.5)
    ball(space, 80, 40, elasticity=0.5)
    space.add(pymunk.PivotJoint(space.static_body, arm, (0, 0)), pymunk.SimpleMotor(space.static_body, arm, -3))
    assert ledger_of(Run(record(space, 120))).suspect == {}


def test_a_rope_that_becomes_taut_takes_what_goes_along_it_and_that_is_no_error() -> None:
    space, fallen = pymunk.Space(), pymunk.Body(2, math.inf)
    fallen.velocity = (0, 60)
    rope = pymunk.SlideJoint(space.static_body, fallen, (0, 0), (0, 0), 0, 50)
    rope.error_bias = 1  # which pulls nothing back
    space.add(fallen, rope)
    ledger = ledger_of(Run(record(space, 60)))
    assert ledger.lines[Cause.DRIVEN] == pytest.approx(-2 * 60**2 / 2, rel=1e-9)
    assert ledger.suspect == {}


@pytest.mark.parametrize("number", [0, 10])
def test_a_pin_takes_what_an_impulse_gives_against_it_and_that_is_no_error(number: int) -> None:
    """Of a rod's energy, the pin at its end leaves that of a turn about it: 1/4, as the impulse is in its middle."""
    space, rod, impulse, half = pymunk.Space(), pymunk.Body(3, 3 * 20**2 / 3), 30, 20
    pin = pymunk.PivotJoint(space.static_body, rod, (0, 0), (-half, 0))
    rod.position, pin.error_bias = (half, 0), 1
    space.add(rod, pin)
    push = at(number, lambda: rod.apply_impulse_at_local_point((0, impulse)))
    ledger = ledger_of(Run(record(space, number + 1, push)))
    assert ledger.lines[Cause.DRIVEN] == pytest.approx(-(impulse**2) / 3 / 2 / 4, rel=1e-9)
    assert ledger.suspect == {}


@pytest.mark.parametrize("number", [0, 10])
def test_a_rod_that_comes_in_with_a_velocity_loses_to_its_pin_what_it_may_not_have(number: int) -> None:
    space, rod = pymunk.Space(), pymunk.Body(3, 3 * 20**2 / 3)
    rod.position, rod.velocity = (20, 0), (0, 10)
    pin = pymunk.PivotJoint(space.static_body, rod, (0, 0), (-20, 0))
    ledger = ledger_of(Run(record(space, number + 1, at(number, lambda: space.add(rod, pin)))))
    assert ledger.lines[Cause.DRIVEN] < 0
    assert ledger.suspect == {}


@pytest.mark.parametrize("steers", [False, True])
def test_an_error_of_joints_is_one_also_beside_a_body_that_the_program_steers(steers: bool) -> None:
    """Two balls are to be at one place, and are not; a third one is on no joint."""
    space = world(gravity=0)
    a, b, other = (ball(space, x, 0) for x in (0, 50, 500))
    space.add(pymunk.PivotJoint(a, b, (0, 0), (10, 0)))

    def steer(number: int) -> None:
        if steers:
            other.velocity = 0, number

    assert Cause.JOINTS in ledger_of(Run(record(space, 6, steer))).suspect


@pytest.mark.parametrize("off", [0, 60])
def test_what_hangs_at_rest_sags_by_less_than_anybody_sees(off: float) -> None:
    """The joints of a row of balls give back what gravity takes in the first steps; or one begins far off its law."""
    space = world()
    bodies = [space.static_body, *(ball(space, 0, 20 * k) for k in range(10))]
    for k, (a, b) in enumerate(pairwise(bodies)):
        space.add(pymunk.PivotJoint(a, b, (0, 10 if k else -10), (0, -10 - off * (k == 9))))
    ledger = ledger_of(Run(record(space, 60)))
    assert abs(ledger.shares[Cause.JOINTS]) > 0.05
    assert (Cause.JOINTS in ledger.suspect) == bool(off)


def test_what_a_callback_removes_takes_its_energy_there() -> None:
    space = world(gravity=0)
    wall(space, (100, -50), (100, 50))
    shot = ball(space, 0, 0, velocity=(300, 0))

    def remove(*_: object) -> None:
        space.remove(*shot.shapes, shot)

    space.on_collision(0, 0, begin=remove)
    ledger = ledger_of(Run(record(space, 30)))
    assert ledger.lines[Cause.CALLBACKS] == pytest.approx(-(300**2) / 2, rel=1e-9)
    only(ledger, Cause.CALLBACKS)


def test_damping_takes_its_power_of_the_energy() -> None:
    space, body = pymunk.Space(), pymunk.Body(2, 30)
    space.damping, body.velocity, body.angular_velocity = 0.8, (100, -50), 7
    space.add(body)
    ledger = ledger_of(Run(record(space, 120)))
    start = 2 * (100**2 + 50**2) / 2 + 30 * 7**2 / 2
    assert ledger.lines[Cause.DAMPING] == pytest.approx((0.8**4 - 1) * start, rel=1e-9)
    assert ledger.shares[Cause.DAMPING] == pytest.approx(0.8**4 - 1)
    half_life = math.log(0.5) / math.log(0.8) / 2
    is_lost = -np.cumsum(ledger.work[Cause.DAMPING]) > start / 2
    assert ledger.time[1 + is_lost.argmax()] == pytest.approx(half_life, abs=DT)
    only(ledger, Cause.DAMPING)


def test_a_kinematic_paddle_gives_what_it_does_to_the_ball() -> None:
    space = pymunk.Space()
    paddle, ball = pymunk.Body(body_type=pymunk.Body.KINEMATIC), pymunk.Body(2, 50)
    paddle.velocity, ball.position = (70, 0), (30, 0)
    shapes = pymunk.Poly.create_box(paddle, (10, 50)), pymunk.Circle(ball, 10)
    for shape in shapes:
        shape.elasticity = 1
    space.add(paddle, ball, *shapes)
    ledger = ledger_of(Run(record(space, 60)))
    assert ledger.lines[Cause.KINEMATIC] == pytest.approx(2 * (2 * 70) ** 2 / 2, rel=1e-12)
    only(ledger, Cause.KINEMATIC)


def test_what_the_program_sets_between_steps_is_its_own() -> None:
    space, body = pymunk.Space(), pymunk.Body(2, 30)
    body.velocity = (3, 4)
    space.add(body)
    other = pymunk.Body(5, 1)
    other.velocity = (2, 0)

    def between(number: int) -> None:
        match number:
            case 1:
                body.velocity = (30, 40)
            case 2:
                body.mass = 3
            case 3:
                space.add(other)
            case 4:
                space.remove(other)
            case 5:
                body.angular_velocity = 10

    ledger = ledger_of(Run(record(space, 6, before=between)))
    assert ledger.work[Cause.PROGRAM] == pytest.approx([0, 2475, 1250, 10, -10, 1500])
    only(ledger, Cause.PROGRAM)
    assert_adds_up(ledger)


def test_forces_of_the_program_give_their_work() -> None:
    space, body = pymunk.Space(), pymunk.Body(2, 30)
    space.add(body)

    def push(_: int) -> None:
        body.force, body.torque = (60, 0), 90

    ledger = ledger_of(Run(record(space, 60, before=push)))
    assert ledger.lines[Cause.FORCES] == pytest.approx(2 * 30**2 / 2 + 30 * 3**2 / 2, rel=1e-9)
    only(ledger, Cause.FORCES)


def test_velocity_functions_and_handlers_have_lines_of_their_own() -> None:
    """Halved by a function, a body has (50, 37.5) px/s after a step of gravity, in which it fell by 1 px."""
    space, body = pymunk.Space(), pymunk.Body(2, 30)
    space.gravity, body.velocity = (0, 900), (100, 60)

    def half(body: pymunk.Body, gravity: pymunk.Vec2d, damping: float, dt: float) -> None:
        pymunk.Body.update_velocity(body, gravity, damping, dt)
        body.velocity = body.velocity / 2

    body.velocity_func = half
    space.add(body)
    ledger = ledger_of(Run(record(space, 1)))
    assert ledger.lines[Cause.DRIVEN] == pytest.approx(50**2 + 37.5**2 - 100**2 - 60**2 - 2 * 900 * 1)
    only(ledger, Cause.DRIVEN)


@pytest.mark.parametrize(("method", "gravity"), [("begin", -1), ("post_solve", -1), ("post_solve", 0)])
def test_a_handler_that_sets_what_it_will_is_not_blamed_on_the_contact(method: str, gravity: float) -> None:
    body = pymunk.Body(2, math.inf)
    shape = pymunk.Circle(body, 10)
    shape.elasticity = 1
    space = resting_on_floor(body, shape)
    body.position, body.velocity = (0, 12), (0, -100)

    def boost(*_: object) -> None:
        body.velocity, body.position = (0, 150), (50, 50)

    space.on_collision(0, 0, **{method: boost})
    space.gravity = 0, gravity
    ledger = ledger_of(Run(record(space, 3)))
    assert gravity or ledger.lines[Cause.CALLBACKS] == pytest.approx(2 * (150**2 - 100**2) / 2)
    assert ledger.lines[Cause.RESTITUTION_ERROR] == ledger.lines[Cause.CORRECTION] == 0
    assert_adds_up(ledger)


def remove(space: pymunk.Space, body: pymunk.Body) -> None:
    space.remove(body, *body.shapes, *(joint for joint in body.constraints if joint in space.constraints))


@pytest.mark.parametrize("seed", range(4))
def test_the_ledger_adds_up_with_steps_of_any_length_and_bodies_that_come_and_go(seed: int) -> None:
    space, random = random_space(seed)
    recording = Recording(space)
    for number in range(120):
        if number % 20 == 5:
            random_body(random, space)
        if number % 20 == 15:
            body = list(space.bodies)[3]
            remove(space, body)
        recording.record(space.step, DT * random.uniform(0.5, 1.5))
    ledger = ledger_of(Run(recording))
    assert_adds_up(ledger)
    assert np.abs(ledger.work[Cause.CALLBACKS]).max() < ROUNDING * ledger.scale


def test_a_heap_that_falls_asleep_and_is_woken_adds_up() -> None:
    space = pymunk.Space()
    space.gravity, space.sleep_time_threshold = (0, -500), 0.3
    boxed(space, 600, 400, elasticity=0.9, friction=0.7)
    for k in range(4):
        body = pymunk.Body()
        body.position = (300 + k, 15.5 + 20 * k)
        box = pymunk.Poly.create_box(body, (20, 20))
        box.density, box.friction = 0.01, 0.8
        space.add(body, box)
    ball = pymunk.Body()
    circle = pymunk.Circle(ball, 8)
    circle.density, ball.position, ball.velocity = 0.02, (40, 40), (200, 200)
    recording = record(space, 300, before=at(150, lambda: space.add(ball, circle)))
    asleep = [int((step.new["asleep"] != 0).sum()) for step in recording.steps]
    assert max(asleep[:150]) == 4
    assert min(asleep[150:]) == 0
    ledger = ledger_of(Run(recording))
    assert_adds_up(ledger)
    assert np.abs(ledger.work[Cause.CALLBACKS]).max() < ROUNDING * ledger.scale


def test_a_ledger_ends_before_what_is_not_finite() -> None:
    space, body = pymunk.Space(), pymunk.Body(1, math.inf)
    space.add(body, pymunk.SimpleMotor(space.static_body, body, 1))  # nothing that it could turn
    free = pymunk.Body(1, 1)
    free.velocity = (10, 0)
    space.add(free)
    ledger = ledger_of(Run(record(space, 3)))
    assert np.shape([*ledger.work.values()]) == (len(Cause), 0)
    assert ledger.kinetic == pytest.approx([50])


def test_a_headline_says_no_more_than_ten_times_the_largest_kinetic_energy() -> None:
    ledger = Ledger(np.zeros(2), np.array([0.0, 1.0]), np.zeros(2), {Cause.JOINTS: np.array([1e9])})
    diagnosis = Diagnosis(1, "", 1, 1.0, 1, 1, 0, (), ledger, {}, 0.0)
    assert "joints beyond +1,000 % of" in diagnosis.headline
