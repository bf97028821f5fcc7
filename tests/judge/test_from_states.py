"""What the judge reads off an engine's states: overlaps at the start, momentum out of nothing, normals, passages."""

import math
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from conftest import numbers_in, scene_of

from sandbox.analysis.comparison import compare
from sandbox.analysis.verdict import verdict
from sandbox.judge.causes import Cause
from sandbox.judge.judge import Judge
from sandbox.judge.models import BY_NAME
from sandbox.judge.timeline import Timeline
from sandbox.judge.words import of_turn
from sandbox.run.inputs import Kick
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.scene.units import PIXELS
from sandbox.state import PUSH, Floats, States

DT = 1 / 60
Row = tuple[Sequence[Sequence[float]], Sequence[Sequence[float]]]  # positions, px, and velocities, px/s


def judged(scene: Scene, *rows: Row) -> Timeline:
    """Judge steps from each row to the next."""
    states = States.empty(len(rows), len(scene.bodies))
    for k, (position, velocity) in enumerate(rows):
        states.position[k], states.velocity[k] = position, velocity
    judge = Judge(scene)
    judge.add(states, np.empty(0, PUSH), np.full(len(rows) - 1, DT))
    return Timeline(judge)


def pair(x: float, y: float = 300.0) -> Scene:
    return scene_of("radius = 20\nposition = [300, 300]", f"radius = 20\nposition = [{x}, {y}]", more="rate = 60")


STILL = ((0.0, 0.0), (0.0, 0.0))


def test_balls_that_overlap_at_the_start_are_pushed_apart_without_blame() -> None:
    """By half of 6 px each, in the first step or in the second: no step led them into each other."""
    start, apart = ((300.0, 300.0), (334.0, 300.0)), ((297.0, 300.0), (337.0, 300.0))
    for rows in ([(start, STILL), (apart, STILL)], [(start, STILL), (start, STILL), (apart, STILL)]):
        [error] = judged(pair(334), *rows).errors
        assert error.cause == Cause.OVERLAPPED
        assert error.because == (
            "Ball 0 and ball 1 overlapped by 6 px when the comparison began: no step led them into each other."
        )
        assert error.displacement == pytest.approx(6)


def test_balls_that_came_apart_are_blamed_for_the_next_overlap() -> None:
    """They part by 10 px in a step. Then one turns, and is found 6 px deep in the other, whose velocity it gets."""
    apart, back = ((-600.0, 0.0), (0.0, 0.0)), ((600.0, 0.0), (0.0, 0.0))
    rows: list[Row] = [
        (((300.0, 300.0), (334.0, 300.0)), apart),
        (((290.0, 300.0), (334.0, 300.0)), back),
        (((300.0, 300.0), (334.0, 300.0)), ((0.0, 0.0), (600.0, 0.0))),
    ]
    error = judged(pair(334), *rows).errors[-1]
    assert (error.step, error.contact, error.cause) == (2, (0, 1), Cause.LATE)


def test_a_contact_that_may_follow_after_the_end_is_not_missed_yet() -> None:
    """The two overlap in the last step, without an impulse; a step later, they have passed into each other."""
    velocity = ((240.0, 0.0), (0.0, 0.0))
    rows: list[Row] = [(((x, 300.0), (342.0, 300.0)), velocity) for x in (300.0, 304.0, 308.0)]
    assert judged(pair(342), *rows[:2]).errors == []
    assert [error.cause for error in judged(pair(342), *rows).errors] == [Cause.MISSED]


def test_momentum_that_a_pair_makes_is_counted_and_what_a_wall_gives_is_not() -> None:
    """One of two equal balls that meet head-on gets nothing: 60 px/s are gained, and 300 px of angular momentum arm."""
    scene = pair(342)
    meets: list[Row] = [
        (((300.0, 300.0), (342.0, 300.0)), ((240.0, 0.0), (0.0, 0.0))),
        (((302.0, 300.0), (344.0, 300.0)), ((240.0, 0.0), (240.0, 0.0))),
    ]
    mass = float(scene.bodies.mass[0])
    gained = judged(scene, *meets).gained(1)
    assert gained[0, :2] == pytest.approx((240 * mass, 0))
    assert abs(gained[0, 2]) <= 1e-9 * 240 * mass * 300  # about the centre, on whose height they are
    at_wall: list[Row] = [
        (((22.0, 300.0), (342.0, 300.0)), ((-240.0, 0.0), (0.0, 0.0))),
        (((22.0, 300.0), (342.0, 300.0)), ((480.0, 0.0), (0.0, 0.0))),
    ]
    assert not judged(scene, *at_wall).gained(1).any()


@pytest.mark.parametrize("speed", [300.0, 900.0])
def test_a_late_contact_has_the_normal_at_its_touch_and_the_one_it_was_found_on(speed: float) -> None:
    """20 px off centre, radii 20: they touch at sin = 1/2, and are found `deep` px closer along x."""
    touch = 20 * math.sqrt(3)
    x = 300 + touch + speed * DT / 2  # they touch in the middle of the step
    scene = pair(x, 320)
    found = np.array([x - 300 - speed * DT, 20.0])
    n = found / np.hypot(*found)
    push = speed * n[0] * n
    after: Floats = np.array([[speed, 0.0], [0.0, 0.0]]) + np.array([-push, push])
    start = ((300.0, 300.0), (x, 320.0)), ((speed, 0.0), (0.0, 0.0))
    end = ((300.0 + speed * DT, 300.0), (x, 320.0)), after.tolist()
    timeline = judged(scene, start, end)
    [error] = timeline.errors
    assert error.cause == Cause.LATE
    normal, should_normal = timeline.touches.normals(error)
    assert should_normal == pytest.approx((math.sqrt(3) / 2, 0.5))
    assert normal == pytest.approx(tuple(n))
    turned = math.degrees(math.asin(n[1]) - math.asin(0.5))
    assert numbers_in(timeline.touches.said(error))[-1] == float(f"{turned:.2g}")


def test_balls_that_pass_each_other_within_a_step_are_missed() -> None:
    """At 3,000 px/s they overlap for 2 x 40 / 3,000 s."""
    scene = pair(345)
    velocity = ((6000.0, 0.0), (0.0, 0.0))
    rows: list[Row] = [
        (((300.0, 300.0), (345.0, 300.0)), velocity),
        (((400.0, 300.0), (345.0, 300.0)), velocity),
        (((500.0, 300.0), (345.0, 300.0)), velocity),
        (((600.0, 300.0), (345.0, 300.0)), velocity),
    ]
    [error] = judged(scene, *rows).errors
    assert (error.cause, error.contact, error.step) == (Cause.MISSED, (0, 1), 1)
    overlapped = 1e3 * 2 * 40 / 6000
    assert numbers_in(error.because) == [float(f"{overlapped:.3g}"), 100]


def test_two_that_are_put_apart_and_keep_their_velocities_may_have_been_resolved_twice_or_not_at_all() -> None:
    """Of elasticity 1, a second impulse takes the first back: nothing tells these two apart."""
    velocity = ((240.0, 0.0), (0.0, 0.0))
    rows: list[Row] = [(((300.0, 300.0), (342.0, 300.0)), velocity), (((303.0, 300.0), (343.0, 300.0)), velocity)]
    timeline = judged(pair(342), *rows, (((380.0, 300.0), (343.0, 300.0)), velocity))
    error = timeline.errors[0]
    assert error.cause == Cause.MISSED
    assert timeline.touches.said(error).startswith("The contact changes no velocity: ")


def test_two_that_are_found_as_they_part_already_and_are_only_put_apart_have_missed_their_contact() -> None:
    """They graze each other on 5.65 px of the way, of which the step's end is 3.8 px on."""
    velocity = ((600.0, 0.0), (0.0, 0.0))
    away = np.array([-1.0, 39.9])
    push = away * (40 / float(np.hypot(*away)) - 1) / 2
    first, second = np.array([310.0, 300.0]) - push, np.array([309.0, 339.9]) + push
    rows: list[Row] = [
        (((300.0, 300.0), (309.0, 339.9)), velocity),
        ((first.tolist(), second.tolist()), velocity),
        ((np.add(first, (10.0, 0.0)).tolist(), second.tolist()), velocity),
    ]
    timeline = judged(pair(309, 339.9), *rows)
    error = timeline.errors[0]
    assert error.cause == Cause.MISSED
    assert timeline.touches.said(error).endswith("The two were already parting, 0.0875 px deep.")


def test_the_impulse_of_the_article_is_named_with_its_restitution() -> None:
    """Divided by the diameter of 40 px, an impulse is 1/20 of what equal masses need."""
    scene = pair(342)
    rows: list[Row] = [
        (((300.0, 300.0), (342.0, 300.0)), ((240.0, 0.0), (0.0, 0.0))),
        (((304.0, 300.0), (342.0, 300.0)), ((228.0, 0.0), (12.0, 0.0))),
    ]
    timeline = judged(scene, *rows)
    [error] = timeline.errors
    said = "The impulse is 0.05 of what is due. It is divided by the diameter, 40 px: a restitution of -0.9."
    assert timeline.touches.said(error).startswith(said)


def test_a_ball_that_is_kicked_after_a_block_at_rest_is_judged() -> None:
    """What of gravity's integration showed while it lay is no longer asked once it flies."""
    resting = "radius = 15\nposition = [200, 285]"
    scene = scene_of(resting, size="[400, 300]", more="gravity = [0, 900]\nseconds = 8")
    run = compare(scene, ["pymunk", "exact"], inputs=[Kick(step=300, ball=0, velocity=(0.0, -300.0))]).runs["pymunk"]
    [of_flight] = [found for found in run.suffered if found.cause == Cause.GRAVITY]
    assert numbers_in(of_flight.because) == [900 / 60**2 / 2]


def test_a_share_of_velocities_and_spins_that_every_step_takes_is_one_habit() -> None:
    spinning = (
        "radius = 15\nspin = 3.0\nposition = [200, 150]\nvelocity = [60, 20]",
        "radius = 15\nposition = [300, 50]",
    )
    scene = scene_of(*spinning, size="[800, 600]\nfriction = 0.5")
    judge, steps = Judge(scene), 10
    start, kept = spawn(scene), 0.99 ** np.arange(steps + 1)[:, None]
    velocity = kept[..., None] * start.velocity
    position = start.position + DT * np.cumsum(np.vstack([0 * velocity[:1], velocity[1:]]), axis=0)
    judge.add(
        States(position, velocity, 0 * kept * start.spin, kept * start.spin), np.empty(0, PUSH), np.full(steps, DT)
    )
    [found] = Timeline(judge).suffered
    assert found.because == "Every step multiplies velocities and spins by 0.99, without a contact."


def test_a_wall_that_is_found_too_soon_is_named_with_its_distance() -> None:
    """The ball flies on until it is 2 px before the wall, and turns there."""
    scene = scene_of("radius = 20\nposition = [773, 300]", size="[800, 600]")
    timeline = judged(scene, (((773.0, 300.0),), ((300.0, 0.0),)), (((778.0, 300.0),), ((-300.0, 0.0),)))
    [error] = timeline.errors
    assert (error.cause, error.contact) == (Cause.EARLY, (0, -3))
    assert numbers_in(timeline.touches.said(error)) == [2]


def test_what_no_contact_can_do_is_said_to_be_put_elsewhere_though_the_ball_is_at_a_wall() -> None:
    """The ball comes in again on the other side, while another bounces beside it."""
    scene = scene_of("radius = 20\nposition = [778, 300]", "radius = 20\nposition = [778, 341]", size="[800, 600]")
    velocity = ((300.0, 0.0), (300.0, 0.0))
    rows: list[Row] = [
        (((778.0, 300.0), (778.0, 341.0)), velocity),
        (((23.0, 300.0), (777.0, 341.0)), ((300.0, 0.0), (-300.0, 0.0))),
    ]
    [error] = judged(scene, *rows).errors
    assert (error.cause, error.balls) == (Cause.TELEPORTED, (0,))
    assert numbers_in(error.because)[:3] == [0, -760, 0]


@pytest.mark.parametrize("into", ["wall", "ball"])
def test_what_is_passed_is_missed_however_gravity_is_integrated(into: str) -> None:
    """Places are moved at the velocity before gravity, as Pymunk does; at 60 px a step the ball misses what is there.

    Gravity in steps takes m g² dt² / 2 in each step, and nothing is put down to rounding.
    """
    other = "radius = 3\nposition = [300, 300]" if into == "ball" else "radius = 3\nposition = [600, 100]"
    wall = "\n[[walls]]\nfrom = [0, 300]\nto = [500, 300]\nthickness = 2" if into == "wall" else ""
    scene = scene_of("radius = 3\nposition = [300, 20]", other + wall, size="[800, 6000]", more="gravity = [0, 900]")
    x, v = np.array([[300.0, 20.0], scene.balls[1].position]), np.array([[0.0, 3600.0], [0.0, 0.0]])
    g, rows = np.array([0.0, 900.0]), list[Row]()
    for _ in range(9):
        rows.append((x.tolist(), v.tolist()))
        x, v = x + DT * v, v + DT * g
    timeline = judged(scene, *rows)
    assert timeline.suffered[0].cause == Cause.MISSED
    assert [error.cause for error in timeline.errors].count(Cause.MISSED) == 1
    mass = float(scene.bodies.mass.sum())
    assert timeline.sums[0, Cause.GRAVITY] == pytest.approx(8 * mass * (900 * DT) ** 2 / 2)
    assert abs(timeline.sums[0, Cause.ROUNDING]) <= 1e-9 * mass * 3600**2


def fall(scene: Scene, steps: int, change: Callable[[Floats], Floats]) -> list[Row]:
    """Return steps of a scene's ball that falls exactly, but for what changes its velocity, and turns at the floor."""
    x, v = np.array([scene.balls[0].position]), np.zeros((1, 2))
    g, rows = np.array([0.0, 900.0]), list[Row]()
    for _ in range(steps):
        rows.append((x.tolist(), v.tolist()))
        x, v = x + DT * v + g * DT**2 / 2, change(v + DT * g)
        if x[0, 1] > 580 and v[0, 1] > 0:
            v[0, 1] *= -1
    return rows


def test_no_contact_is_blamed_for_what_is_wrong_with_the_flight() -> None:
    """Drag with the cube of the speed, which is no habit that the judge knows: bounces are right but late."""
    scene = scene_of("radius = 20\nposition = [400, 130]", size="[800, 600]", more="gravity = [0, 900]")
    rows = fall(scene, 200, lambda v: v - 1e-7 * DT * np.hypot(*v[0]) ** 2 * v)
    assert {error.cause for error in judged(scene, *rows).errors} <= {Cause.UNREPORTED, Cause.UNKNOWN}


def test_a_limit_of_speeds_that_balls_fall_at_is_no_damping() -> None:
    """From 150 px/s on, each step makes 165 px/s of it, and cuts them to 150, which is 0.909 of them."""
    scene = scene_of("radius = 20\nposition = [400, 100]", size="[800, 600]", more="gravity = [0, 900]")
    timeline = judged(scene, *fall(scene, 180, lambda v: np.minimum(v, 150)))
    assert {error.cause for error in timeline.errors} <= {Cause.UNREPORTED, Cause.UNKNOWN, Cause.LATE}
    assert not any("multiplies" in error.because for error in timeline.errors)


def test_changes_of_velocity_without_a_contact_are_said_with_their_range() -> None:
    """A ball in flight is kicked three times, by 3, 5 and 9 px/s in changing directions, and put elsewhere twice."""
    kicks = ((0, 0), (3, 0), (0, 0), (-3, 4), (0, 0), (0, -9), (0, 0))
    position, velocity, rows = np.array([200.0, 200.0]), np.array([30.0, 20.0]), list[Row]()
    for number, kick in enumerate(kicks):
        position = position + velocity * DT + ((0.5, 0) if number in (2, 4) else (0, 0))
        velocity = velocity + kick
        rows.append(([position.tolist()], [velocity.tolist()]))
    scene = scene_of("radius = 20\nposition = [200, 200]", size="[800, 600]")
    said = {found.cause: found.because for found in judged(scene, *rows).suffered}
    assert said[Cause.UNREPORTED].endswith("without a contact; such changes are of 3 to 9 px/s.")
    assert said[Cause.TELEPORTED].endswith("; such changes are of 0.5 px.")


@pytest.mark.parametrize(
    ("fault", "values", "said"),
    [
        ("turn", np.radians([-1, 2, 6]), "The normal is turned by 2° (the median; 1 to 6 in all)."),
        ("impulse", np.array([-0.2, 0.5, 0.7]), "The impulse is 0.5 of what is due (the median; -0.2 to 0.7 in all)."),
        (
            "impulse",
            np.array([-0.2, -0.3, 0.1]),
            "The impulse pulls instead of pushing, 0.2 of what is due (the median; -0.1 to 0.3 in all).",
        ),
        ("offset", np.array([-1.5, -0.5, -1.0]), "Found 1 px deep (the median; 0.5 to 1.5 in all)."),
    ],
)
def test_the_range_of_a_parameter_is_in_the_numbers_of_its_sentence(fault: str, values: Floats, said: str) -> None:
    assert BY_NAME[fault].sentence_of_many(values, PIXELS) == said


def found_late(scene: Scene, *rows: Row) -> list[str]:
    """Judge rows, of which the first step misses contacts. Returns what is said of those that are found late."""
    timeline = judged(scene, *rows)
    missed = [error for error in timeline.errors if error.step == 1]
    assert {error.cause for error in missed} == {Cause.LATE}
    return [timeline.touches.said(error) for error in missed]


def test_the_normal_of_a_ball_that_was_stopped_at_a_wall_is_that_where_it_stands() -> None:
    """At its speed it would be beyond the middle of the wall when it is found, with the normal turned round."""
    scene = scene_of("radius = 10\nposition = [380, 300]").changed(walls=[{"from": (400, 0), "to": (400, 600)}])
    rows: list[Row] = [(((x, 300.0),), ((v, 0.0),)) for x, v in ((380.0, 1200.0), (388.5, 1200.0), (388.5, -1200.0))]
    assert found_late(scene, *rows) == ["Found 1 step late."]


def test_a_ball_that_bounces_beside_another_does_not_hide_that_its_contact_was_found_late() -> None:
    """Both meet the floor at 580 px, ball 1 in time, in the step in which ball 0 is found."""
    scene = scene_of("radius = 20\npositions = [[300, 578], [350, 574]]")
    rows: list[Row] = [
        (((300.0, 578.0), (350.0, 574.0)), ((0.0, 240.0), (0.0, 240.0))),
        (((300.0, 582.0), (350.0, 578.0)), ((0.0, 240.0), (0.0, 240.0))),
        (((300.0, 586.0), (350.0, 578.0)), ((0.0, -240.0), (0.0, -240.0))),
    ]
    assert found_late(scene, *rows) == ["Found 1 step late."]


def test_a_ball_that_two_walls_push_at_once_was_found_late() -> None:
    """In the step in which it is found in the right wall, it meets the floor, which pushes it more."""
    rows: list[Row] = [
        (((779.0, 574.0),), ((100.0, 240.0),)),
        (((779.0 + 100 * DT, 578.0),), ((100.0, 240.0),)),
        (((779.0 + 200 * DT, 578.0),), ((-100.0, -240.0),)),
    ]
    assert found_late(scene_of("radius = 20\nposition = [779, 574]"), *rows) == ["Found 1 step late."]


def test_what_is_over_where_balls_overlap_from_the_start_is_not_blamed_on_what_they_lean_on() -> None:
    """`exact` parts no overlap: three balls that lie in each other stay so."""
    balls = "radius = 20\nelasticity = 0.5\npositions = [[200, 380], [200, 350], [230, 380]]"
    scene = scene_of(balls, size="[400, 400]", more="gravity = [0, 900]\nseconds = 0.2")
    comparison = compare(scene, ["exact"])
    assert {each.cause for each in comparison.runs["exact"].suffered} == {Cause.OVERLAPPED}
    assert "not free of errors" not in verdict(comparison)


def test_the_numbers_of_one_of_several_pushes_are_called_an_example() -> None:
    """Pymunk leaves a ball of elasticity 0 in the wall, and moves it out by a share of its depth in each step."""
    scene = scene_of("radius = 20\nelasticity = 0\nposition = [750, 300]\nvelocity = [190, 0]", more="seconds = 1")
    comparison = compare(scene, ["pymunk", "exact"])
    pushed = next(each for each in comparison.runs["pymunk"].suffered if each.cause == Cause.POSITION_CORRECTION)
    assert pushed.is_example
    assert f"{pushed.times} times" in verdict(comparison)
    assert "of its error: for example, pushed apart by" in " ".join(verdict(comparison).split())


def test_angles_have_two_digits_that_count() -> None:
    turned = [of_turn("Late.", (1, 0), (math.cos(a), math.sin(a))) for a in np.radians([0.0144, 1.44, 144])]
    assert [numbers_in(said)[-1] for said in turned] == [0.014, 1.4, 140]
    assert turned[-1] == "Late, so the normal is turned by 140°."
