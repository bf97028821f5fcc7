"""What the judge reads off an engine's states: overlaps at the start, momentum out of nothing, normals, passages."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from conftest import numbers_in, scene_of

from sandbox.analysis.comparison import compare
from sandbox.judge.causes import Cause
from sandbox.judge.judge import Judge
from sandbox.judge.timeline import Timeline
from sandbox.run.inputs import Kick
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
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


def test_the_impulse_of_the_article_is_named_with_its_restitution() -> None:
    """Divided by the diameter of 40 px, an impulse is 1/20 of what equal masses need."""
    scene = pair(342)
    rows: list[Row] = [
        (((300.0, 300.0), (342.0, 300.0)), ((240.0, 0.0), (0.0, 0.0))),
        (((304.0, 300.0), (342.0, 300.0)), ((228.0, 0.0), (12.0, 0.0))),
    ]
    [error] = judged(scene, *rows).errors
    said = "The impulse is 0.05 of what is due. It is divided by the diameter, 40 px: a restitution of -0.9."
    assert error.because.startswith(said)


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
