"""What recorded steps show: known faults put into Spaces are named, and varied Spaces without them have no finding."""

import math
from collections.abc import Callable

import pymunk
import pytest
from spaces import DT, add, at, ball, body, box, boxed, ground, keys_in, wall, watched, world

from sandbox.space import findings, steps
from sandbox.space.diagnosis import Diagnosis
from sandbox.space.energy import Ledger
from sandbox.space.findings import Certainty, Fault, Finding


def findings_of(diagnosis: Diagnosis) -> dict[str, Finding]:
    return {finding.rule: finding for finding in diagnosis.findings}


def ledger_of(diagnosis: Diagnosis) -> Ledger:
    assert diagnosis.energy
    return diagnosis.energy


def chain(mass: float, iterations: int, dt: float = DT, seconds: float = 2) -> Diagnosis:
    """Twenty links that swing, with a mass at the end."""
    space, last = world(iterations), None
    for k in range(20):
        link = box(space, 30 * k + 15, 0, (30, 4), mass=mass if k == 19 else 1)
        next(iter(link.shapes)).filter = pymunk.ShapeFilter(group=1)
        space.add(pymunk.PivotJoint(last or space.static_body, link, (30 * k, 0)))
        last = link
    return watched(space, round(seconds / dt), dt=lambda _: dt)


def pendulum() -> Diagnosis:
    """On a body at (300, 0) that is not in the Space, which Pymunk allows."""
    space, pivot = world(), pymunk.Body(body_type=pymunk.Body.STATIC)
    pivot.position = 300, 0
    space.add(pymunk.PinJoint(pivot, ball(space, 400, 0)))
    return watched(space, 120)


def tower(iterations: int) -> Diagnosis:
    """A heavy box on ten light ones."""
    space = ground(iterations)
    for k in range(10):
        box(space, 0, 185 - 20 * k)
    box(space, 0, -15, mass=300)
    return watched(space, 90)


def shot(speed: float = 840) -> Diagnosis:
    """A ball that comes in its third step, of 14 px or of 25, to y = 193, where it is 8 px deep in the floor."""
    space = ground(gravity=0)
    ball(space, 0, 193 - speed / 20, velocity=(0, speed), elasticity=0.5)
    return watched(space, 5)


def lands_flat() -> Diagnosis:
    """A plank of 10 px that is found 4.8 px deep in the floor, from where Pymunk takes it out in 0.2 s and more."""
    space = ground(gravity=0)
    box(space, 0, 194.8 - 3 * 4.9, (60, 10), velocity=(0, 4.9 / DT))
    return watched(space, 60)


def lands_on_corners() -> Diagnosis:
    """A plank that is turned comes down on one corner, and in the next step deeper on the other."""
    space = ground()
    box(space, 0, 120, (60, 20), velocity=(0, 600)).angle = 0.2
    return watched(space, 60)


def rammed() -> Diagnosis:
    """Seen from above, a ram sends a crate off and stops: what the crate has friction for, it did touch."""
    space, ram = world(gravity=0), body(0, 0, (200, 0), kind=pymunk.Body.KINEMATIC)
    add(space, pymunk.Poly.create_box(ram, (60, 40)), elasticity=0)
    box(space, 60, 0, elasticity=0)
    return watched(space, 240, lambda number: setattr(ram, "velocity", (200 * (number < 12), 0)))


def explodes() -> Diagnosis:
    """A spring that is too stiff for its masses throws them through a wall, further each time."""
    space = world(gravity=0)
    wall(space, (90, -50), (90, 50))
    space.add(pymunk.DampedSpring(ball(space, 0, 0), ball(space, 50, 0), (0, 0), (0, 0), 49, 7500, 0))
    return watched(space, 400)


def handled(change: Callable[[pymunk.Arbiter], None], event: str) -> Diagnosis:
    space = ground(gravity=0)
    ball(space, 0, 150, velocity=(0, 300), elasticity=0.8)

    def handle(arbiter: pymunk.Arbiter, _: pymunk.Space, __: object) -> None:
        change(arbiter)

    space.on_collision(0, 0, **{event: handle})
    return watched(space, 30)


def teleported() -> Diagnosis:
    space = world(gravity=0)
    body = box(space, 0, 0)
    return watched(space, 40, lambda number: setattr(body, "position", (2.0 * number, 0)))


def pushed() -> Diagnosis:
    """The program walks a box into a wall, and out on the other side."""
    space = ground()
    wall(space, (60, 0), (60, 200))
    hero = box(space, 0, 184)
    return watched(space, 40, lambda _: setattr(hero, "velocity", (400, hero.velocity.y)))


def leant_on() -> Diagnosis:
    """The program drives a ball against a thin wall, at the velocity that it sets, until it is behind."""
    space = world(gravity=0)
    wall(space, (250, -200), (250, 200), 1)
    made = ball(space, 0, 0, 16)
    made.moment = math.inf
    return watched(space, 90, lambda _: setattr(made, "velocity", (250, 0)))


def lands_and_goes_round() -> Diagnosis:
    """A player comes into a platform by its middle, is pushed out above, walks off, and slides down its side."""
    space = world()
    add(space, pymunk.Poly(space.static_body, [(-150, 0), (50, 0), (50, 60), (-150, 60)]))
    player = ball(space, 0, -404, 6, velocity=(0, 600), elasticity=0, friction=0)

    def walk(number: int) -> None:
        speed = 30 if player.position.y < -5 else 0 if player.position.y < 2 else -20
        player.velocity = (speed if number > 60 else 0), player.velocity.y

    return watched(space, 290, walk)


def pushed_out_behind() -> Diagnosis:
    """A ball is 6 px past the middle of a thin wall at the end of a step, which pushes it out on that side."""
    space = world(gravity=0)
    wall(space, (40, -100), (40, 100), 2)
    ball(space, 12, 0, velocity=(2040, 0))
    return watched(space, 30)


def slow_steps() -> Diagnosis:
    """Steps of a second, in the first two of which a ball of 20 px falls by 900 px, through the floor."""
    space = ground()
    ball(space, 0, 100)
    return watched(space, 5, dt=lambda _: 1.0)


def dropped(*, meet: bool = False, meant: bool = False) -> Diagnosis:
    """Two bouncy balls fall, or meet before, on a floor that is dead, by default or as the program sets it."""
    space = ground(elasticity=0)
    [floor] = space.shapes
    for x in (-60, 60):
        ball(space, x, 100, velocity=(-3 * x if meet else 0, 0), elasticity=0.9)
    return watched(space, 60, lambda _: setattr(floor, "elasticity", 0) if meant else None)


def crate_on_a_shelf() -> Diagnosis:
    """Everything bounces but a crate, which alone touches the shelf."""
    space = ground(elasticity=0.9)
    wall(space, (100, 120), (200, 120), elasticity=0.9)
    ball(space, 0, 100, elasticity=0.9)
    box(space, 150, 90, elasticity=0)
    return watched(space, 60)


def thrust(call: str, force: tuple[float, float], point: tuple[float, float] | None = None, x: int = 300) -> Diagnosis:
    """A rocket that is pushed in each step: by default, at its position."""
    space = world(gravity=0)
    rocket = box(space, x, x - 100, (20, 60))
    return watched(space, 30, lambda _: getattr(rocket, call)(force, point=point or rocket.position))


def dumbbell_thrust_at_its_end() -> Diagnosis:
    space, dumbbell = world(gravity=0), body(300, 200)
    ends = [pymunk.Circle(dumbbell, 10, (x, 0)) for x in (-200, 200)]
    for end in ends:
        end.mass = 1
    space.add(dumbbell, *ends)
    return watched(space, 10, lambda _: dumbbell.apply_force_at_local_point((0, -40), (200, 0)))


def lands_on_tiles(step: float = 0, height: float = 150) -> Diagnosis:
    """A box that flies and slides to the right over square tiles; from x = 400 on, they are higher by a step."""
    space = world()
    for k in range(20):
        tile = body(50 * k + 25, 225 - (step if k > 7 else 0), kind=pymunk.Body.STATIC)
        add(space, pymunk.Poly.create_box(tile, (50, 50)))
    slider = box(space, 40, 170 - height, (30, 60), velocity=(400, 0), friction=0.1)
    slider.moment = math.inf
    return watched(space, 90)


def falls_on_a_seam() -> Diagnosis:
    space = world()
    for x in (-25, 25):
        add(space, pymunk.Poly.create_box(body(x, 225, kind=pymunk.Body.STATIC), (50, 50)))
    ball(space, 0.5, 160)
    return watched(space, 60)


def mouse() -> Diagnosis:
    """A joint of limited force, which is meant to give way."""
    space, hand = world(), pymunk.Body(body_type=pymunk.Body.KINEMATIC)
    joint = pymunk.PivotJoint(hand, ball(space, 60, 0), (0, 0), (0, 0))
    joint.max_force = 5000
    space.add(joint)
    return watched(space, 60)


def shot_into_each_other() -> Diagnosis:
    """By 50 px in a step, from which they are 10 px deep in each other. Only one bounces, as would a third."""
    space = ground(gravity=0, elasticity=0)
    ball(space, 0, 100, elasticity=0.9)
    ball(space, 0, 0, velocity=(1500, 0), elasticity=0.9)
    ball(space, 110, 0, velocity=(-1500, 0), elasticity=0)
    return watched(space, 2)


def slowed_by_handler() -> Diagnosis:
    def halve(arbiter: pymunk.Arbiter) -> None:
        body = max((shape.body for shape in arbiter.shapes if shape.body), key=lambda body: body.velocity.length)
        body.velocity /= 2

    return handled(halve, "post_solve")


def put_back() -> Diagnosis:
    """A game that puts a ball back once."""
    space = world()
    body = ball(space, 0, 0)
    return watched(space, 40, at(20, lambda: setattr(body, "position", (0, 0))))


def ragdoll_in_itself() -> Diagnosis:
    space = ground()
    a, b = box(space, 0, 100), box(space, 15, 100)
    space.add(pymunk.PivotJoint(a, b, (7.5, 100)))
    return watched(space)


def varying_steps() -> Diagnosis:
    space = ground()
    ball(space, 0, 100)
    return watched(space, dt=lambda number: DT * (1 + 0.1 * (number % 3)))


def shot_at_a_wall() -> pymunk.Space:
    space = ground()
    ball(space, 0, 120, velocity=(0, 3300))
    return space


def shot_through_a_wall() -> Diagnosis:
    return watched(shot_at_a_wall(), 4)


def box_through_a_box() -> Diagnosis:
    space = world()
    add(space, pymunk.Poly.create_box(space.static_body, (400, 16)))
    box(space, 0, -35, (10, 10), velocity=(0, 4000))
    return watched(space, 3)


def pool_table() -> Diagnosis:
    space = world(gravity=0)
    space.damping = 0.7
    boxed(space, 400, 200, elasticity=0.8, friction=0.5)
    for row in range(4):
        for k in range(row + 1):
            ball(space, 280 + 18 * row, 100 + 20.5 * (k - row / 2), elasticity=0.95, friction=0.2)
    cue = ball(space, 100, 100, velocity=(350, 0), elasticity=0.95, friction=0.2)
    cue.angle, cue.angular_velocity = 7, 30
    return watched(space, 60)


def well_solved_pyramid() -> Diagnosis:
    space = ground(30)
    for row in range(5):
        for k in range(5 - row):
            box(space, 21 * k + 10.5 * row, 184.99 - 20 * row)
    return watched(space, 60)


def ragdoll() -> Diagnosis:
    """A torso that hangs on its head, with light limbs."""
    space = world(60)
    group = pymunk.ShapeFilter(group=1)
    torso = box(space, 0, 100, (20, 40), mass=4, filter=group)
    space.add(pymunk.PivotJoint(space.static_body, torso, (0, 80)))
    for x in (-9, 9):
        limb = box(space, x, 134, (8, 28), mass=0.5, filter=group)
        space.add(pymunk.PivotJoint(torso, limb, (x, 120)), pymunk.RotaryLimitJoint(torso, limb, -1, 1))
        limb.velocity = 20, 0
    return watched(space, 60)


def lift() -> Diagnosis:
    """Its program sets its velocity, and its position too, so that rounding errors do not add up."""
    space, lift = world(), body(0, 0, kind=pymunk.Body.KINEMATIC)
    add(space, pymunk.Poly.create_box(lift, (100, 10)))
    box(space, 0, -15)

    def rise(number: int) -> None:
        lift.position, lift.velocity = (0, -number / 3), (0, -1 / 3 / DT)

    return watched(space, before=rise)


def platformer() -> Diagnosis:
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

    return watched(space, 60, play)


def one_way_platform() -> Diagnosis:
    """A player who jumps up through a platform, as a handler lets it."""
    space = ground()
    wall(space, (-50, 120), (50, 120), collision_type=2)
    player = ball(space, 0, 184.9, collision_type=1)

    def is_falling(arbiter: pymunk.Arbiter, _: pymunk.Space, __: object) -> None:
        arbiter.process_collision = player.velocity.y > 0

    space.on_collision(1, 2, begin=is_falling)
    return watched(space, 60, at(5, lambda: setattr(player, "velocity", (0, -500))))


def car() -> Diagnosis:
    space = ground(30)
    group = pymunk.ShapeFilter(group=1)
    chassis = box(space, 0, 165, (60, 16), mass=4, filter=group)
    for x in (-20, 20):
        wheel = ball(space, x, 182, 12, friction=1.2, filter=group)
        space.add(pymunk.PivotJoint(chassis, wheel, (x, 182)))
        motor = pymunk.SimpleMotor(chassis, wheel, 6)
        motor.max_force = 300
        space.add(motor)
    return watched(space, 100, dt=lambda _: DT / 4)


def sleeping_pile() -> Diagnosis:
    space = world(20)
    space.sleep_time_threshold = 0.3
    boxed(space, 100, 120)
    for k in range(9):
        ball(space, 20 + 25 * (k % 3) + k // 3, 50 + 22 * (k // 3))
    return watched(space, 150)


def spawned_and_removed() -> Diagnosis:
    """Balls that are gone before the end, and with them what their friction lacked."""
    space = ground(friction=0)

    def spawn(number: int) -> None:
        if number % 20 == 0:
            ball(space, number - 60, 100).angle = number
        for each in [each for each in space.bodies if each.position.y > 180 and number % 20 == 19]:
            space.remove(each, *each.shapes)

    return watched(space, 60, spawn)


def asteroid() -> Diagnosis:
    """It leaves the screen every 4 steps, and comes in again on the other side."""
    space = world(gravity=0)
    rock = ball(space, 0, 0, velocity=(900, 0))
    return watched(space, 60, lambda _: setattr(rock, "position", (rock.position.x % 60, 0)))


def wraps_round() -> Diagnosis:
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
    return watched(space, 60)


def cradle() -> Diagnosis:
    space = world(30)
    for k in range(5):
        at = (20.2 * k, 0)
        bob = ball(space, 20.2 * k, 100, elasticity=1, friction=0)
        space.add(pymunk.PinJoint(space.static_body, bob, at))
        if not k:
            bob.velocity = -200, 0
    for shape in space.shapes:
        shape.friction = 0.1
    return watched(space, 60)


def bricks() -> Diagnosis:
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
    return watched(space, 60)


THRUST, KICK = "apply_force_at", "apply_impulse_at"
FAULTS: dict[str, tuple[Callable[[], Diagnosis], set[str]]] = {
    "ragdoll in itself": (ragdoll_in_itself, {"overlap", "contacts-within", "joint-stretched"}),
    "varying steps": (varying_steps, {"dt-varies"}),
    "shot through a wall": (shot_through_a_wall, {"passed-through"}),
    "box through a box": (box_through_a_box, {"passed-through"}),
    "heavy chain": (lambda: chain(500, 10), {"joint-stretched"}),
    "pendulum": (pendulum, set()),
    "crushed": (lambda: tower(1), {"sinks-in", "passed-through"}),
    "carried": (lambda: tower(300), set()),
    "shot hard": (lambda: shot(1500), {"deep-at-once"}),
    "lands flat": (lands_flat, {"deep-at-once"}),
    "lands on corners": (lands_on_corners, {"deep-at-once"}),
    "rammed": (rammed, set()),
    "teleported": (teleported, {"moved-by-hand"}),
    "pushed": (pushed, {"passed-through", "velocity-set"}),
    "pushed out behind": (pushed_out_behind, {"passed-through"}),
    "leant on": (leant_on, {"passed-through"}),
    "slow steps": (slow_steps, {"dt-large", "passed-through"}),
    "dropped on a dead floor": (dropped, {"elasticity-unused"}),
    "bouncing off each other only": (lambda: dropped(meet=True), {"elasticity-unused"}),
    "dropped on a floor dead on purpose": (lambda: dropped(meant=True), set()),
    "crate on a shelf": (crate_on_a_shelf, set()),
    "thrust at a point of the space": (lambda: thrust(f"{THRUST}_local_point", (30, -400)), {"wrong-point"}),
    "kicked at its own point": (lambda: thrust(f"{KICK}_world_point", (0, -4), (0, 30)), {"wrong-point", "adds-up"}),
    "thrust at the corner of all": (lambda: thrust(f"{THRUST}_world_point", (0, 40), (0, 0), 90), {"wrong-point"}),
    "thrust at its tail": (lambda: thrust(f"{THRUST}_local_point", (30, -400), (0, 30)), set()),
    "spun by a long lever": (lambda: thrust(f"{THRUST}_local_point", (0.1, 0), (0, 1000)), set()),
    "dumbbell thrust at its end": (dumbbell_thrust_at_its_end, set()),
    "lands on tiles": (lands_on_tiles, {"seams"}),
    "falls on a seam": (falls_on_a_seam, set()),
    "slides against a step": (lambda: lands_on_tiles(20, 0), set()),
    "mouse": (mouse, set()),
    "shot into each other": (shot_into_each_other, {"deep-at-once"}),
    "slowed by handler": (slowed_by_handler, set()),
    "put back": (put_back, set()),
    "explodes": (explodes, {"stiff-spring", "not-finite"}),
    "goes round": (lands_and_goes_round, {"elasticity-unused", "friction-unused", "sinks-in", "velocity-set"}),
}


HEALTHY = (
    *(cradle, bricks, pool_table, well_solved_pyramid, ragdoll, platformer, one_way_platform, car),
    *(sleeping_pile, spawned_and_removed, asteroid, wraps_round, lift),
)


@pytest.mark.parametrize(("make", "rules"), FAULTS.values(), ids=FAULTS)
def test_a_fault_of_the_steps_is_named_and_nothing_else(make: Callable[[], Diagnosis], rules: set[str]) -> None:
    findings = make().findings
    assert {finding.rule for finding in findings} == rules
    certainties = [finding.certainty is Certainty.POSSIBLE for finding in findings]
    assert certainties == sorted(certainties)


def test_of_what_is_seen_the_largest_is_first_and_after_what_is_wrong_with_the_program() -> None:
    faults = [Fault(rule, None, size) for rule, size in {"hangs": 1.0, "sinks-in": 3.0, "moment": 0.1}.items()]
    assert [finding.rule for finding in findings.findings_of(faults)] == ["moment", "sinks-in", "hangs"]


@pytest.mark.parametrize("make", HEALTHY, ids=lambda make: make.__name__)
def test_a_space_without_a_fault_has_no_finding(make: Callable[[], Diagnosis]) -> None:
    assert make().findings == ()


def test_a_finding_says_since_when_where_and_how_much() -> None:
    [finding] = shot().findings
    # At 193 px the ball, of radius 10, is 8 px deep in a floor whose top is at 195 px
    assert finding.since == pytest.approx(3 * DT)
    assert finding.symptom == "Impacts are found late: bodies are 8 px deep in each other for a moment"
    assert finding.bodies[0].index == 0
    assert finding.bodies[0].position == pytest.approx((0, 193))
    assert finding.bodies[0].detail == "8 px deep in the Space's static body at 0.050 s"


def test_the_shares_of_a_balance_sum_to_the_change() -> None:
    ledger = ledger_of(chain(500, 10))
    change = (ledger.total[-1] - ledger.total[0]) / ledger.scale
    assert sum(ledger.shares.values()) == pytest.approx(change, abs=1e-9)
    assert math.isclose(float(list(ledger.text())[-1].split()[0]), 100 * change, abs_tol=0.006)


def test_a_space_at_rest_has_no_balance() -> None:
    """Its ball is pushed out of the floor, and stopped before each step."""
    space = ground()
    made = ball(space, 0, 190)
    ledger = ledger_of(watched(space, 30, lambda _: setattr(made, "velocity", (0, 0))))
    assert list(ledger.text()) == ["Its energy: hardly anything had a velocity."]
    assert ledger.suspect == {}


@pytest.mark.parametrize("way", ["joint", "filter", "handler", "sensor"])
def test_a_body_that_may_pass_a_wall_is_not_said_to_have_passed(way: str) -> None:
    space = shot_at_a_wall()
    floor, shot = space.shapes
    match way:
        case "joint":
            spring = pymunk.DampedSpring(space.static_body, next(iter(space.bodies)), (0, 0), (0, 0), 10, 0, 0)
            spring.collide_bodies = False
            space.add(spring)
        case "filter":
            floor.filter = shot.filter = pymunk.ShapeFilter(group=3)
        case "handler":
            space.on_collision(0, 0, begin=lambda *_: None)
        case _:
            floor.sensor = True
    assert "passed-through" not in findings_of(watched(space, 4))


def test_each_rule_of_steps_has_a_fault() -> None:
    of_programs = {"contacts-within", "hangs"}  # in the small programs
    of_others = {"dt-varies", "not-finite", "ghosts"}  # below, and in the tests of whole Spaces
    assert set().union(*(rules for _, rules in FAULTS.values())) >= keys_in(steps) - of_programs - of_others


def test_figures_are_of_what_a_rule_may_name() -> None:
    """Not of a long joint that is off by more, which is little for it; nor of balls that came in as one."""
    space = world(gravity=0)
    long, short = ball(space, 1000, 0), ball(space, 20, 0)
    for made, off in ((long, 40), (short, 15)):
        space.add(pymunk.PinJoint(space.static_body, made, (0, 0), (0, 0)))
        made.position += off, 0
    ball(space, 1000, 900)
    ball(space, 1002, 900)
    figures = watched(space, 10).figures
    assert [figures["joint-stretched"], figures["sinks-in"]] == pytest.approx([15, 0], rel=0.2)


def test_a_joint_to_a_body_of_the_mouse_says_so() -> None:
    space, mouse = world(), body(0, 0, kind=pymunk.Body.KINEMATIC)
    space.add(pymunk.PinJoint(mouse, ball(space, 0, 40)))
    found = findings_of(watched(space, 60, lambda number: setattr(mouse, "position", (20 * number, 0))))
    assert "to a kinematic body without a shape is off" in found["joint-stretched"].bodies[0].detail


def test_a_fast_ball_is_not_said_to_be_pushed_by_a_bat_that_is_moved() -> None:
    """A bat follows a ball that bounces between it and a ceiling: the ball is deep in it for a step each time."""
    space = world(gravity=0)
    space.collision_slop = 0.01
    wall(space, (-200, 0), (200, 0), elasticity=1)
    bat = body(0, 100, kind=pymunk.Body.KINEMATIC)
    add(space, pymunk.Segment(bat, (-20, 0), (20, 0), 5), elasticity=1)
    made = ball(space, 0, 60, 5, velocity=(90, 500), elasticity=1, friction=0)
    found = findings_of(watched(space, 300, lambda _: setattr(bat, "position", (made.position.x, 100))))
    assert "deep-at-once" in found
    assert "sinks-in" not in found


def test_what_the_program_puts_into_another_is_not_said_to_be_found_late() -> None:
    """A ball is put where another rests, as where balls come in again."""
    space = ground()
    made = ball(space, 0, 190)
    ball(space, 100, 190)
    found = findings_of(watched(space, 60, at(20, lambda: setattr(made, "position", (92, 190)))))
    assert "deep-at-once" not in found


def test_an_arm_that_the_program_turns_is_named_by_what_it_touches_and_by_its_joint() -> None:
    """A box lies on it in the first of its steps, and a weight hangs from it."""
    space, arm = world(), body(0, 0, kind=pymunk.Body.KINEMATIC)
    add(space, pymunk.Poly.create_box(arm, (100, 10)))
    box(space, 0, -15)
    space.add(pymunk.PinJoint(arm, ball(space, 50, 60), (50, 0), (0, 0)))
    found = findings_of(watched(space, 60, lambda number: setattr(arm, "angle", 0.08 * number)))
    assert found["moved-by-hand"].bodies[0].detail == "before 59 of the steps"
    assert "as the program puts one of them elsewhere" in found["joint-stretched"].bodies[0].detail


@pytest.mark.parametrize("leaves", [True, False])
def test_a_body_that_is_gone_is_named_by_its_shape(leaves: bool) -> None:
    """Also if that is left behind, and goes on to touch the floor."""
    space = ground()
    made = ball(space, 0, 150, velocity=(0, 800))
    gone = [made] if leaves else [made, *made.shapes]
    found = findings_of(watched(space, 30, at(20, lambda: space.remove(*gone))))
    assert found["deep-at-once"].bodies[0].kind == "a dynamic circle of radius 10"
    assert ("body-not-added" in found) == leaves


@pytest.mark.parametrize("kind", [None, pymunk.Body.STATIC, pymunk.Body.KINEMATIC])
def test_a_thin_wall_is_judged_alike_whatever_body_it_is_on(kind: int | None) -> None:
    """A ball of radius 20 that comes 8 px deep into a wall of 2 px, less than half its radius, in its second step."""
    space = world()
    on = space.static_body if kind is None else body(0, 0, kind=kind)
    add(space, pymunk.Segment(on, (-500, 200), (500, 200), 1))
    ball(space, 0, 179 - 8, 20, velocity=(0, 480))
    assert findings_of(watched(space, 30)).keys() == set()
