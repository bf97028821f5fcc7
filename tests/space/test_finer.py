"""Recorded steps done again are the same to the bit, and finer steps lead to where closed forms do."""

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pymunk
import pytest

from sandbox.errors import SandboxError
from sandbox.space.finer import Finer, finer
from sandbox.space.recording import Recording
from sandbox.space.replay import Script, Variant, distance, is_rounder, replay, replayable

DT = 1 / 60
GRAVITY = 900.0


def recorded(
    space: pymunk.Space, steps: int = 60, before: Callable[[int], object] = lambda _: None, dt: float = DT
) -> Recording:
    recording = Recording(space)
    for number in range(steps):
        before(number)
        recording.record(space.step, dt)
    return recording


def world(floor_friction: float = 0.5) -> pymunk.Space:
    """Return a Space with a floor at y = 0, and gravity downwards, towards larger y."""
    space = pymunk.Space()
    space.gravity = 0, GRAVITY
    floor = pymunk.Segment(space.static_body, (-1000, 0), (2000, 0), 5)
    floor.friction = floor_friction
    space.add(floor)
    return space


def box(space: pymunk.Space, x: float, y: float, size: float = 20) -> pymunk.Body:
    body = pymunk.Body(1, pymunk.moment_for_box(1, (size, size)))
    body.position = x, y
    shape = pymunk.Poly.create_box(body, (size, size))
    shape.friction = 1
    space.add(body, shape)
    return body


def ball(space: pymunk.Space, x: float, y: float, radius: float = 10) -> pymunk.Body:
    body = pymunk.Body(1, pymunk.moment_for_circle(1, 0, radius))
    body.position = x, y
    shape = pymunk.Circle(body, radius)
    shape.friction, shape.elasticity = 0.5, 0.5
    space.add(body, shape)
    return body


def pyramid(space: pymunk.Space, rows: int) -> None:
    for row in range(rows):
        for column in range(rows - row):
            box(space, 22 * column + 11 * row, -15 - 20 * row)


def rope(space: pymunk.Space, count: int, group: int = 1) -> list[pymunk.Body]:
    links = [ball(space, 20 * (k + 1), -300, 5) for k in range(count)]
    for link in links:
        for shape in link.shapes:
            shape.filter = pymunk.ShapeFilter(group=group)
    anchor = pymunk.PinJoint(space.static_body, links[0], (0, -300), (0, 0))
    space.add(anchor, *(pymunk.PinJoint(a, b) for a, b in pairwise(links)))
    return links


def again(recording: Recording) -> float:
    """Return the largest distance between a recording and the same steps done again, px."""
    script = Script(recording, len(recording))
    since = replayable(script)
    assert (since == len(script.steps)).all()
    motion = replay(script, Variant(), since, len(script.steps))
    return float(np.nanmax(distance(script.outlines, script.recorded, motion)))


def test_the_same_steps_lead_to_the_same_bits() -> None:
    space = world()
    space.damping = 0.9
    pyramid(space, 4)
    links = rope(space, 5)
    space.add(pymunk.DampedSpring(links[-1], space.static_body, (0, 0), (150, -100), 40, 30, 0.5))
    links[1].torque = 30
    assert again(recorded(space, 120)) == 0


def test_what_a_program_does_between_steps_is_repeated_to_the_bit() -> None:
    space = world()
    space.sleep_time_threshold = 0.3
    pyramid(space, 3)
    links = rope(space, 3)
    lift = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
    lift.position = 300, -20
    plate = pymunk.Poly.create_box(lift, (100, 10))
    space.add(lift, plate)
    hand = pymunk.Body(body_type=pymunk.Body.KINEMATIC)  # not in the Space
    motor = pymunk.SimpleMotor(space.static_body, box(space, 300, -40), 3)
    space.add(motor)
    grip: list[pymunk.Constraint] = []

    def play(step: int) -> None:
        lift.velocity = 0, -40 * math.sin(step / 9)
        if step == 10:
            links[0].apply_impulse_at_local_point((70.5, -20), (1, 0))
        if 20 <= step < 30:
            links[1].apply_force_at_local_point((900, 0))
        if step == 25:
            motor.rate, space.gravity = -2, (100, 800)
        if step == 30:
            dropped = ball(space, 120, -200)
            dropped.velocity = 40, 0
        if step == 40:
            hand.position = links[2].position
            grip.append(pymunk.PivotJoint(hand, links[2], (0, 0), (0, 0)))
            space.add(*grip)
        if step > 40:
            hand.position += (1.5, -0.5)
        if step == 60:
            space.remove(*grip)
            links[2].position, links[2].velocity = (250, -150), (0, 0)

    assert again(recorded(space, 90, play)) == 0


def change_shapes(space: pymunk.Space) -> Callable[[int], None]:
    """Return a program that changes all that a shape has."""
    bodies = [ball(space, 40 * k, -60) for k in range(6)] + [box(space, 300, -16)]
    shapes = [next(iter(body.shapes)) for body in bodies]
    floor = next(iter(space.shapes))
    assert isinstance(floor, pymunk.Segment)
    round_shapes = [shape for shape in shapes if isinstance(shape, pymunk.Circle)]
    bodies[6].velocity = 200, 0

    def play(step: int) -> None:
        match step:
            case 3:
                shapes[0].elasticity, floor.elasticity = 1, 0.9
                shapes[1].friction, bodies[1].angular_velocity = 0, 20
                shapes[2].sensor = True
                shapes[3].filter, shapes[4].surface_velocity = pymunk.ShapeFilter(mask=2), (50, 0)
                round_shapes[5].unsafe_set_radius(14)
                round_shapes[0].unsafe_set_offset((1, 2))
            case 10:
                shapes[6].friction = 0
            case 20:
                shapes[2].sensor = False
                floor.unsafe_set_endpoints((-1000, 0), (2000, -100))
                space.reindex_shape(floor)
                space.add(pymunk.Circle(bodies[5], 4, (12, 0)))
            case 40:
                shapes[6].unsafe_set_vertices([(-20, -8), (20, -8), (20, 8), (-20, 8)])
                floor.unsafe_set_radius(8)
                space.static_body.position = 0, -5
                space.reindex_shapes_for_body(space.static_body)

    return play


def test_shapes_that_the_program_changes_are_repeated_to_the_bit() -> None:
    space = world()
    assert again(recorded(space, 90, change_shapes(space))) == 0


def test_a_centre_of_gravity_off_the_origin_is_put_back_to_where_it_was() -> None:
    space = world()
    body = box(space, 0, -100)
    body.center_of_gravity = 5, 3

    def play(step: int) -> None:
        if step == 20:
            body.position = 40, -90

    assert again(recorded(space, 60, play)) < 1e-9


def test_a_body_that_the_program_puts_back_starts_anew_in_finer_steps_too() -> None:
    space = world()
    body = ball(space, 0, -400)

    def play(step: int) -> None:
        if step == 30:
            body.position, body.velocity = (0, -400), (0, 0)

    result = finer(recorded(space, 45, play))
    assert result.error[29, 0] == pytest.approx(GRAVITY * DT * 30 * DT / 2, rel=0.05)  # g t dt / 2
    assert result.error[30, 0] < 0.2


@pytest.mark.parametrize(
    ("number", "change", "rounder"),
    [(300, 300 - 12.3471, True), (312.3471, 300, False), (0, -87.123, True), (-540, -640, False), (3.3, 1.7, False)],
)
def test_what_a_program_set_is_the_rounder_number(number: float, change: float, *, rounder: bool) -> None:
    assert is_rounder(number, change) == rounder


def test_what_a_callback_adds_is_there_from_the_next_step_on() -> None:
    space = world()
    first = ball(space, 0, -30)
    for shape in first.shapes:
        shape.collision_type = 3
    sparks: list[pymunk.Body] = []

    def spark(*_: object) -> None:
        if not sparks:
            sparks.append(ball(space, 100, -200))

    space.on_collision(3, 0, post_solve=spark)

    def play(_: int) -> None:
        for body in sparks:
            body.velocity += (1, 0)

    recording = recorded(space, 60, play)
    assert sparks
    assert again(recording) < 1e-9


def test_a_static_body_that_moves_and_one_that_changes_its_type_are_repeated_or_left_out() -> None:
    space = world()
    space.sleep_time_threshold = 0.2
    dropped, rests = ball(space, 0, -200), ball(space, 200, -16)

    def play(step: int) -> None:
        space.static_body.position = 0, step / 10
        if step == 20:
            dropped.body_type = pymunk.Body.KINEMATIC
        if step == 40:
            dropped.body_type = pymunk.Body.DYNAMIC
            dropped.mass, dropped.moment = 1, 50

    result = finer(recorded(space, 60, play))
    assert result.since.tolist() == [19, 60]
    assert math.isfinite(rests.position.y)


def test_a_velocity_function_leaves_out_its_body_and_what_it_touches_from_then_on() -> None:
    space = world()
    space.gravity = 0, 0
    pushed, _, apart = (ball(space, x, -100) for x in (0, 60, 300))
    apart.velocity = 0, -30

    def drive(body: pymunk.Body, gravity: tuple[float, float], damping: float, dt: float) -> None:
        body.velocity = 120, 0

    pushed.velocity_func = drive
    recording = recorded(space)
    since = finer(recording).since.tolist()
    touches = next(step.number for step in recording if len(step.after.contacts))
    assert since[0] == 1  # the first step moves it with its own velocity
    assert since[1] == touches
    assert since[2] == 60


def test_a_handler_that_decides_leaves_out_its_body() -> None:
    space = world()
    falls, rests = ball(space, 0, -16), ball(space, 100, -15)
    for shape in falls.shapes:
        shape.collision_type = 7

    def ignore(arbiter: pymunk.Arbiter, *_: object) -> None:
        arbiter.process_collision = False

    space.on_collision(7, 0, pre_solve=ignore)
    result = finer(recorded(space, 30))
    assert result.since[0] < 15
    assert result.since[1] == 30
    assert result.left_out.tolist() == [0]
    assert math.isfinite(rests.position.y)


def test_bodies_that_get_their_velocity_after_they_were_added_are_repeated() -> None:
    """Pymunk's index looks ahead in the direction that a body has when it is added, and sets the order of contacts."""
    space = world()
    hero = box(space, -200, -15)
    pyramid(space, 4)

    def walk(_: int) -> None:
        hero.velocity = 200, hero.velocity.y

    result = finer(recorded(space, 75, walk))
    assert result.script.at_rest
    assert not len(result.left_out)


def test_a_handler_that_only_counts_changes_nothing() -> None:
    space = world()
    ball(space, 0, -40)
    seen: list[object] = []
    space.on_collision(0, 0, post_solve=lambda *_: seen.append(1))
    assert again(recorded(space, 40)) == 0
    assert seen


def reference_end(result: Finer, body: int = 0) -> tuple[complex, float]:
    """Return where the reference puts a body after the last step, and the error bar."""
    assert result.until[body] == len(result.error)
    return complex(result.reference.place[-1, body]), float(result.bar[-1, body])


def test_a_sliding_box_stops_after_v2_by_2_mu_g() -> None:
    space = world()
    body = box(space, 0, -15)
    body.velocity = 300, 0
    place, bar = reference_end(finer(recorded(space)))
    assert place.real == pytest.approx(300**2 / (2 * 0.5 * GRAVITY), abs=max(bar, 0.01))
    assert body.position.x == pytest.approx(102.5, abs=0.2)  # at the old velocity for one more step: v dt / 2


def test_a_spring_swings_as_a_cosine() -> None:
    space = pymunk.Space()
    body = pymunk.Body(1, 10)
    body.position = 150, 0
    space.add(body, pymunk.DampedSpring(space.static_body, body, (0, 0), (0, 0), 100, 50, 0))
    result = finer(recorded(space, 90))
    time = np.arange(1, 91) * DT
    exact = 100 + 50 * np.cos(math.sqrt(50) * time)
    assert np.abs(result.reference.place[:, 0].real - exact).max() < 0.02
    assert result.largest == pytest.approx(np.abs(result.script.recorded.place[:, 0].real - exact).max(), rel=0.01)


def pendulums(lengths: list[float], seconds: float) -> np.ndarray:
    """Return where point masses on a chain of rods, let go level, are in the end: (n, 2) px, by RK4 in 5 µs steps."""
    count = len(lengths)
    share = np.array([[count - max(i, j) for j in range(count)] for i in range(count)], float)
    length = np.array(lengths)

    def rates(state: np.ndarray) -> np.ndarray:
        angle, spin = state
        between = angle[:, None] - angle
        mass = share * np.outer(length, length) * np.cos(between)
        force = -(share * np.outer(length, length) * np.sin(between)) @ spin**2
        force += GRAVITY * length * np.cos(angle) * np.diagonal(share)
        return np.array([spin, np.linalg.solve(mass, force)])

    state, steps = np.zeros((2, count)), round(seconds * 2000)
    h = seconds / steps
    for _ in range(steps):
        k1 = rates(state)
        k2 = rates(state + h / 2 * k1)
        k3 = rates(state + h / 2 * k2)
        k4 = rates(state + h * k3)
        state += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    ends = length[:, None] * np.column_stack([np.cos(state[0]), np.sin(state[0])])
    return np.cumsum(ends, axis=0)


@pytest.mark.parametrize("count", [1, 2, 4])
def test_rods_swing_as_lagrange_s_equations_say(count: int) -> None:
    space = pymunk.Space()
    space.gravity = 0, GRAVITY
    last = space.static_body
    for k in range(count):
        link = pymunk.Body(1, 1e4)
        link.position = 60 * (k + 1), 0
        space.add(link, pymunk.PinJoint(last, link, (0, 0), (0, 0)))
        last = link
    result = finer(recorded(space, 40))
    exact = pendulums([60.0] * count, 40 * DT)
    for body in range(count):
        place, bar = reference_end(result, body)
        off = abs(place - complex(*exact[body]))
        program = abs(complex(*list(space.bodies)[body].position) - complex(*exact[body]))
        assert off < max(bar, 0.02) < program / 3, (body, off, bar, program)


def test_the_reference_of_a_box_on_its_corner_ends_with_rounding() -> None:
    space = world()
    body = box(space, 0, -5 - 10 * math.sqrt(2))
    body.angle = math.pi / 4
    result = finer(recorded(space, 420))
    assert result.is_rounding.all()
    assert 100 < result.until[0] < 420


def test_nothing_is_said_of_a_space_whose_bodies_do_not_move() -> None:
    space = world()
    box(space, 0, -14.9)
    result = finer(recorded(space))
    assert not result.matters
    assert not result.tried


def test_more_iterations_help_where_the_solver_stops_too_early() -> None:
    space = world()
    space.iterations = 1
    pyramid(space, 6)
    result = finer(recorded(space, 40))
    removed = {(tried.setting, tried.value): tried.removed for tried in result.tried}
    assert removed["iterations", 4] > 0.3
    assert abs(removed["collision_persistence", 60]) < 0.05


def test_the_order_matters_where_the_solver_stops_too_early() -> None:
    by_order = []
    for iterations in (1, 100):
        space = world()
        space.iterations = iterations
        rope(space, 6)
        result = finer(recorded(space, 40))
        by_order.append(result.by_order)
    assert by_order[0] > 1
    assert by_order[1] < 0.001


def test_a_space_of_kinematic_bodies_is_not_compared() -> None:
    space = world()
    lift = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
    space.add(lift, pymunk.Circle(lift, 10))
    with pytest.raises(SandboxError, match="moves by forces"):
        finer(recorded(space))


def test_a_space_that_only_a_function_moves_is_not_compared() -> None:
    space = world()

    def orbit(body: pymunk.Body, gravity: tuple[float, float], damping: float, dt: float) -> None:
        body.velocity = body.position.perpendicular()

    ball(space, 50, -100).velocity_func = orbit
    with pytest.raises(SandboxError, match=r"not in the recording: bodies\[0\].velocity_func: .*orbit"):
        finer(recorded(space))


def test_steps_with_too_many_bodies_are_compared_for_a_shorter_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sandbox.space.finer.MAX_WORK", 40_000)
    space = world()
    pyramid(space, 3)
    result = finer(recorded(space))
    assert 1 < len(result.error) < 60
