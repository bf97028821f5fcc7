"""What recorded steps show: known faults put into Spaces are named, and Spaces without them have no finding."""

import math
from collections.abc import Callable, Sequence

import pymunk
import pytest
from spaces import DT, ball, box, record, wall, world

from sandbox.space.contents import Contents
from sandbox.space.diagnosis import Diagnosis
from sandbox.space.energy import Ledger
from sandbox.space.findings import Finding, Kind
from sandbox.space.origins import Origins
from sandbox.space.recording import Run
from sandbox.space.rules import END_RULES
from sandbox.space.steps import STEP_RULES, Evidence, reversals
from sandbox.space.watch import watch

FLOOR = (-500, 200), (500, 200)


def watched(
    space: pymunk.Space, steps: int, before: Callable[[int], None] = lambda _: None, dt: float = DT
) -> Diagnosis:
    with watch(space) as recorded:
        for number in range(steps):
            before(number)
            space.step(dt)
    return recorded.diagnosis


def ledger_of(diagnosis: Diagnosis) -> Ledger:
    assert diagnosis.energy
    return diagnosis.energy


def said_of(diagnosis: Diagnosis) -> list[Finding]:
    """Return the findings that are printed."""
    return [finding for finding in diagnosis.findings if finding.kind is not Kind.POSSIBLE]


def chain(mass: float, iterations: int, dt: float = DT, seconds: float = 2) -> Diagnosis:
    """Twenty links that swing, with a mass at the end."""
    space, last = world(iterations), None
    for k in range(20):
        link = box(space, 30 * k + 15, 0, (30, 4), mass=mass if k == 19 else 1)
        next(iter(link.shapes)).filter = pymunk.ShapeFilter(group=1)
        space.add(pymunk.PivotJoint(last or space.static_body, link, (30 * k, 0)))
        last = link
    return watched(space, round(seconds / dt), dt=dt)


def heavy_chain() -> Diagnosis:
    return chain(500, 10)


def pendulum() -> Diagnosis:
    """On a body at (300, 0) that is not in the Space, which Pymunk allows."""
    space, pivot = world(), pymunk.Body(body_type=pymunk.Body.STATIC)
    pivot.position = 300, 0
    space.add(pymunk.PinJoint(pivot, ball(space, 400, 0)))
    return watched(space, 120)


def tower(iterations: int) -> Diagnosis:
    """A heavy box on ten light ones."""
    space = world(iterations)
    wall(space, *FLOOR)
    for k in range(10):
        box(space, 0, 185 - 20 * k)
    box(space, 0, -15, mass=300)
    return watched(space, 90)


def crushed() -> Diagnosis:
    return tower(1)


def carried() -> Diagnosis:
    return tower(300)


def shot(speed: float = 840) -> Diagnosis:
    """A ball that comes in its third step, of 14 px or of 25, to y = 193, where it is 8 px deep in the floor."""
    space = world(gravity=0)
    wall(space, *FLOOR)
    ball(space, 0, 193 - speed / 20, velocity=(0, speed), elasticity=0.5)
    return watched(space, 5)


def runs_through_a_wall() -> Diagnosis:
    """It lies in the floor by more than collision_slop, so that each step lifts it too."""
    space = world()
    wall(space, *FLOOR)
    wall(space, (60, 0), (60, 200), 2)
    runner = box(space, 0, 185.5)
    runner.velocity = 6000, 0
    return watched(space, 1)


def swatted() -> Diagnosis:
    """A thin bat that turns by 0.5 rad in a step, from one side of a ball at rest to the other."""
    return swung(30)


def batted() -> Diagnosis:
    return swung(3)


def swung(spin: float) -> Diagnosis:
    space, bat = world(gravity=0), pymunk.Body(body_type=pymunk.Body.KINEMATIC)
    bat.angular_velocity, bat.angle = spin, -0.25
    space.add(bat, pymunk.Segment(bat, (0, 0), (100, 0), 1))
    ball(space, 80, 0)
    return watched(space, 1)


def shot_through_each_other() -> Diagnosis:
    return shot_at(1500, 25)


def shot_at(speed: float, distance: float, aside: float = 0, steps: int = 1) -> Diagnosis:
    space = world(gravity=0)
    ball(space, 0, 0, velocity=(speed, 0))
    ball(space, distance, 0, velocity=(-speed, aside))
    return watched(space, steps)


def lands_flat() -> Diagnosis:
    """A plank of 10 px that is found 4.8 px deep in the floor, from where Pymunk takes it out in 0.2 s and more."""
    space = world(gravity=0)
    wall(space, *FLOOR)
    plank = box(space, 0, 194.8 - 3 * 4.9, (60, 10))
    plank.velocity = 0, 4.9 / DT
    return watched(space, 60)


def overlapping() -> Diagnosis:
    """Balls that come in overlapping, which the linter says."""
    space = world(gravity=0)
    ball(space, 0, 0)
    ball(space, 5, 0)
    return watched(space, 30)


def handled(change: Callable[[pymunk.Arbiter], None], event: str) -> Diagnosis:
    space = world(gravity=0)
    wall(space, *FLOOR)
    ball(space, 0, 150, velocity=(0, 300), elasticity=0.8)

    def handle(arbiter: pymunk.Arbiter, _: pymunk.Space, __: object) -> None:
        change(arbiter)

    space.on_collision(0, 0, **{event: handle})
    return watched(space, 30)


def deadened_by_handler() -> Diagnosis:
    def deaden(arbiter: pymunk.Arbiter) -> None:
        arbiter.restitution = 0.1

    return handled(deaden, "pre_solve")


def counted_by_handler() -> Diagnosis:
    return handled(lambda _: None, "pre_solve")


def teleported() -> Diagnosis:
    space = world(gravity=0)
    body = box(space, 0, 0)

    def move(number: int) -> None:
        body.position = 2.0 * number, 0

    return watched(space, 40, move)


def pushed() -> Diagnosis:
    """The program walks a box into a wall, and out on the other side."""
    space = world()
    wall(space, *FLOOR)
    wall(space, (60, 0), (60, 200))
    hero = box(space, 0, 184)

    def walk(_: int) -> None:
        hero.velocity = 400, hero.velocity.y

    return watched(space, 40, walk)


def thrust(push: Callable[[pymunk.Body], None]) -> Diagnosis:
    space = world(gravity=0)
    rocket = box(space, 300, 200, (20, 60))
    return watched(space, 30, lambda _: push(rocket))


def thrust_at_a_point_of_the_space() -> Diagnosis:
    return thrust(lambda rocket: rocket.apply_force_at_local_point((30, -400), rocket.position))


def kicked_at_a_point_of_the_body() -> Diagnosis:
    return thrust(lambda rocket: rocket.apply_impulse_at_world_point((0, -4), (0, 30)))


def thrust_at_its_tail() -> Diagnosis:
    return thrust(lambda rocket: rocket.apply_force_at_local_point((30, -400), (0, 30)))


def thrust_and_turned() -> Diagnosis:
    """By a torque that no force on it has."""

    def push(rocket: pymunk.Body) -> None:
        rocket.force, rocket.torque = (0, -4), 5e4

    return thrust(push)


def fallen() -> Diagnosis:
    space = world()
    ball(space, 0, 0)
    return watched(space, 200)


def shaken() -> Diagnosis:
    """The program pushes a box, that lies, to and fro."""
    space = world()
    wall(space, *FLOOR)
    body = box(space, 0, 184)

    def push(number: int) -> None:
        body.velocity = (20 if number % 2 else -20), 0

    return watched(space, 90, push)


def lies() -> Diagnosis:
    space = world()
    wall(space, *FLOOR)
    box(space, 0, 184)
    return watched(space, 90)


def off_its_law(steps: int = 60) -> Diagnosis:
    """A ball on a pin joint that is to be 100 px shorter than it is."""
    space = world(gravity=0)
    a, b = ball(space, 0, 0), ball(space, 200, 0)
    joint = pymunk.PinJoint(a, b)
    joint.distance = 100
    space.add(joint)
    return watched(space, steps)


def mouse() -> Diagnosis:
    """A joint of limited force, which is meant to give way."""
    space, hand = world(), pymunk.Body(body_type=pymunk.Body.KINEMATIC)
    joint = pymunk.PivotJoint(hand, ball(space, 60, 0), (0, 0), (0, 0))
    joint.max_force = 5000
    space.add(joint)
    return watched(space, 60)


def fine_chain() -> Diagnosis:
    return chain(1, 300, DT / 4, seconds=1)


def coarse_chain() -> Diagnosis:
    """It cracks like a whip, too fast for its steps."""
    return chain(1, 300)


def lax_chain() -> Diagnosis:
    return chain(1, 2)


def shot_hard() -> Diagnosis:
    return shot(1500)


def shot_into_each_other() -> Diagnosis:
    """50 px in a step, from which they are 10 px deep in each other: as far as if they had passed."""
    return shot_at(1500, 110, steps=2)


def slow_shot() -> Diagnosis:
    space = world(gravity=0)
    wall(space, *FLOOR)
    ball(space, 0, 128, velocity=(0, 200), elasticity=0.5)
    return watched(space, 30)


def shot_past_each_other() -> Diagnosis:
    """Balls of radius 10, of which one leaves the other's way within the step: their centres pass 22.4 px apart."""
    return shot_at(1500, 25, aside=6000)


def kicked_into_another() -> Diagnosis:
    """By 11.7 px in a step, once."""
    space = world(gravity=0)
    kicked = box(space, 0, 0)
    box(space, 20.5, 0)

    def kick(number: int) -> None:
        if number == 5:
            kicked.velocity = 700, 0

    return watched(space, 60, kick)


def slowed_by_handler() -> Diagnosis:
    def halve(arbiter: pymunk.Arbiter) -> None:
        body = max((shape.body for shape in arbiter.shapes if shape.body), key=lambda body: body.velocity.length)
        body.velocity /= 2

    return handled(halve, "post_solve")


def hits_two() -> Diagnosis:
    """Its bounces differ from its elasticity, as it meets two balls at once: no fault of a handler."""
    space = world(gravity=0)
    ball(space, 0, 0, velocity=(200, 0), elasticity=0.9)
    for y in (-10.5, 10.5):
        ball(space, 40, y, elasticity=0.9)
    return watched(space, 20)


def put_back() -> Diagnosis:
    """A game that puts a ball back once."""
    space = world()
    body = ball(space, 0, 0)

    def move(number: int) -> None:
        if number == 20:
            body.position = 0, 0

    return watched(space, 40, move)


def pulled_together() -> Diagnosis:
    """The same, while the joint still speeds it up."""
    return off_its_law(5)


FAULTS: Sequence[tuple[Callable[[], Diagnosis], set[str]]] = (
    (heavy_chain, {"joint-stretched"}),
    (pendulum, set()),
    (crushed, {"sinks-in", "deep-at-once"}),
    (carried, set()),
    (shot, {"deep-at-once"}),
    (runs_through_a_wall, {"passed-through", "overlap"}),
    (swatted, {"passed-through"}),
    (batted, set()),
    (shot_through_each_other, {"passed-through"}),
    (lands_flat, {"deep-at-once"}),
    (overlapping, {"overlap"}),
    (deadened_by_handler, set()),
    (counted_by_handler, set()),
    (teleported, {"moved-by-hand"}),
    (pushed, {"deep-at-once"}),
    (thrust_at_a_point_of_the_space, {"wrong-point"}),
    (kicked_at_a_point_of_the_body, {"wrong-point"}),
    (thrust_at_its_tail, set()),
    (thrust_and_turned, set()),
    (fallen, set()),
    (shaken, {"jitters"}),
    (lies, set()),
    (off_its_law, {"joint-stretched"}),
    (mouse, set()),
    (fine_chain, set()),
    (coarse_chain, {"joint-stretched"}),
    (lax_chain, {"joint-stretched"}),
    (shot_hard, {"deep-at-once"}),
    (shot_into_each_other, {"deep-at-once"}),
    (slow_shot, set()),
    (shot_past_each_other, set()),
    (kicked_into_another, {"deep-at-once"}),
    (slowed_by_handler, set()),
    (hits_two, set()),
    (put_back, set()),
    (pulled_together, {"joint-stretched"}),
)


@pytest.mark.parametrize(("make", "rules"), FAULTS, ids=lambda value: getattr(value, "__name__", None))
def test_a_fault_of_the_steps_is_named_and_nothing_else(make: Callable[[], Diagnosis], rules: set[str]) -> None:
    assert {finding.rule for finding in said_of(make())} == rules


def test_a_finding_says_since_when_where_and_how_much() -> None:
    [finding] = said_of(shot())
    # At 193 px the ball, of radius 10, is 8 px deep in a floor whose top is at 195 px
    assert finding.since == pytest.approx(3 * DT)
    assert finding.symptom == "Impacts are found late: bodies are 8 px deep in each other for a moment"
    assert finding.bodies[0].index == 0
    assert finding.bodies[0].position == pytest.approx((0, 193))
    assert finding.bodies[0].detail == "8 px deep in the Space's static body at 0.050 s"


def test_the_balance_of_a_box_that_slides_to_rest_is_all_friction() -> None:
    space = world()
    wall(space, *FLOOR)
    sliding = box(space, 0, 185.05, (40, 20))
    sliding.velocity = 100, 0
    lines = list(ledger_of(watched(space, 60)).text())
    assert lines[0] == "Its energy from 0 to 1 s, in % of the largest kinetic energy, 5e+03:"
    assert any(line.endswith("%  friction") and float(line.split()[0]) < -99 for line in lines)


def test_the_shares_of_a_balance_sum_to_the_change() -> None:
    ledger = ledger_of(heavy_chain())
    change = (ledger.total[-1] - ledger.total[0]) / ledger.scale
    assert sum(ledger.shares.values()) == pytest.approx(change, abs=1e-9)
    assert math.isclose(float(list(ledger.text())[-1].split()[0]), 100 * change, abs_tol=0.006)


def test_a_balance_is_in_units_of_energy_where_hardly_anything_moves_by_itself() -> None:
    """The program lifts a ball of 1 kg by 1 px in each of 9 steps, against 900 px/s²; none falls far in a step."""
    space = world()
    body = ball(space, 0, 0)

    def lift(number: int) -> None:
        body.position, body.velocity = (0, -float(number)), (0, 0)

    lines = list(ledger_of(watched(space, 10, lift)).text())
    assert "in kg px²/s²; its largest kinetic energy is 112:" in lines[0]  # of 15 px/s
    [of_program] = [line for line in lines if line.endswith("  the program: positions")]
    assert float(of_program.split()[0]) == pytest.approx(9 * 900, rel=0.01)


def test_a_space_at_rest_has_no_balance() -> None:
    space = world(gravity=0)
    ball(space, 0, 0)
    assert list(ledger_of(watched(space, 3)).text()) == ["Its energy: nothing moved."]


def test_a_passage_of_two_bodies_is_named_with_what_prevents_it() -> None:
    """50 px in a step of 1/60 s, of balls that are 10 px from centre to rim: 20 px take 1/150 s."""
    [finding] = said_of(shot_through_each_other())
    assert [body.detail for body in finding.bodies] == [
        "went 50 px through body 1, a dynamic circle of radius 10 in the step; dt below 0.0067 s prevents that"
    ]


@pytest.mark.parametrize("fault", ["joint", "filter", "handler", "removed", "set"])
def test_bodies_that_may_pass_are_not_said_to_have_passed(fault: str) -> None:
    space = world(gravity=0)
    a, b = ball(space, 0, 0, velocity=(1500, 0)), ball(space, 25, 0, velocity=(-1500, 0))
    first, second = (next(iter(body.shapes)) for body in (a, b))

    def remove(shape: pymunk.Shape) -> None:
        space.remove(shape)
        assert shape.body
        shape.body.mass, shape.body.moment = 1, 50  # which were those of the shape

    match fault:
        case "joint":
            spring = pymunk.DampedSpring(a, b, (0, 0), (0, 0), 10, 0, 0)
            spring.collide_bodies = False
            space.add(spring)
        case "filter":
            first.filter = second.filter = pymunk.ShapeFilter(group=3)
        case "handler":
            space.on_collision(0, 0, begin=lambda *_: None)
        case "removed":
            remove(second)
        case _:
            second.sensor = True

    def play(number: int) -> None:
        if number and fault == "removed":
            remove(first)
        if number and fault == "set":
            second.sensor = False

    rules = {finding.rule for finding in said_of(watched(space, 2, play))}
    assert rules == ({"shape-not-added"} if fault == "removed" else set())


def test_each_rule_of_steps_has_a_fault() -> None:
    of_programs = {"contacts-within", "seams", "friction-untouched", "hangs"}  # in the small programs
    of_others = {"leaves", "dt-varies", "not-finite"}  # below, and in the tests of whole Spaces
    assert set().union(*(rules for _, rules in FAULTS)) >= set(STEP_RULES) - set(END_RULES) - of_programs - of_others


def test_what_left_the_world_is_only_counted() -> None:
    diagnosis = fallen()
    [finding] = diagnosis.findings
    assert finding.rule == "leaves"
    assert [body.index for body in finding.bodies] == [0]
    text = "Could go wrong, but did not: bodies far outside of where all began (1)."
    assert text in diagnosis.lines(120)


def test_overlaps_that_are_equally_deep_come_in_the_order_of_their_contacts() -> None:
    """Not in that of their bodies' addresses, which is another in every run."""
    space = world(gravity=0)
    wall(space, (-10, 0), (1000, 0), 0)
    for number in (7, 2, 9, 4, 1, 8, 3, 6, 0, 5):
        ball(space, 100 * number, 19, velocity=(0, -600))
    recording = record(space, 1)
    ends = recording.steps[0].after.contacts[["body_a", "body_b"]].tolist()
    assert len(ends) == 10
    overlaps = Evidence(recording, Contents(space, Origins())).overlaps
    assert [overlap.ends for overlap in overlaps] == ends


def test_the_deepest_overlap_is_how_far_a_ball_went_too_far() -> None:
    """10 px in a step, to 93 px after its third, 3 px into a wall at 100 px; then it bounces."""
    space = world(gravity=0)
    wall(space, (100, -50), (100, 50), 0, elasticity=1)
    made = ball(space, 63, 0, velocity=(600, 0), elasticity=1)
    [overlap] = Evidence(record(space, 10), Contents(space, Origins())).overlaps
    number, depth = overlap.worst
    assert number == 2
    assert depth == pytest.approx(3)
    assert set(overlap.ends) == {made.id, space.static_body.id}


def test_jitter_is_the_share_of_steps_that_reverse_a_resting_body() -> None:
    space = world(gravity=-600)
    shaken, still = pymunk.Body(1, 1), pymunk.Body(1, 1)
    space.add(shaken, still)
    for body in (shaken, still):
        body.velocity_func = lambda *_: None  # they move as the program says

    def shake(number: int) -> None:
        shaken.velocity, still.velocity = (3 if number % 2 else -3, 0), (3, 0)

    shares = reversals(Run(record(space, 50, shake)))
    assert shares == {shaken.id: pytest.approx(49 / 50), still.id: 0}


def test_an_empty_space_has_no_finding() -> None:
    assert watched(world(gravity=0), 2).findings == ()


def test_a_bullet_that_the_program_removes_has_passed() -> None:
    space = world(gravity=0)
    wall(space, *FLOOR)
    bullet = ball(space, 0, 170, velocity=(0, 4800))
    evidence = watched(space, 3, lambda number: space.remove(bullet, *bullet.shapes) if number == 2 else None)
    [finding] = said_of(evidence)
    assert finding.rule == "passed-through"
    assert finding.bodies[0].position == (0, 250)
