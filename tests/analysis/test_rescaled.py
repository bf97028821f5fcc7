"""Impulses of lasting contacts that Pymunk rescales where dt changes: named where they did harm, and only there."""

import warnings

import numpy as np
import pymunk
import pytest

from sandbox.analysis.rescaled import PERSISTENCE, RescaledImpulses
from sandbox.analysis.verdict import verdict
from sandbox.errors import SpaceWarning
from sandbox.judge.causes import Cause
from sandbox.scene.clock import Clock
from sandbox.scripting.watch import Watched, watch
from sandbox.state import CONTACT


@pytest.mark.parametrize(
    ("dt", "impulse", "found"),
    [
        (0.02, 100, True),  # it grew: 200 were applied, and 100 taken back
        (0.02, 130, False),  # 70 were taken back, because 130 are right
        (0.01, 100, False),  # it is constant
        (0.01, -100, False),
        (0.005, -30, True),  # it shrank: 50 were applied, and 80 taken back
        (0.005, -50, True),  # all that was counted is taken back
        (0.005, -60, False),  # no solver takes back more than it counts
        (0.005, 50, False),
    ],
)
def test_an_impulse_is_by_a_change_of_dt_only_if_nothing_else_is_left_of_it(
    dt: float, impulse: float, found: bool
) -> None:
    """An impulse of 100 kg px/s before, in a step of 0.01 s."""
    assert found_in([0.01, dt], [(1, 100), (2, impulse)]) == [False, found]


def test_a_touch_after_two_have_parted_is_no_lasting_contact() -> None:
    """What is left of the impulse is counted at the next touch, but none of it is applied."""
    assert found_in([0.01, 0.01, 0.02], [(1, 100), (3, 100)]) == [False, False]
    assert found_in([0.01, 0.01, 0.005], [(1, 100), (3, -30)]) == [False, False]


def test_a_contact_s_impulse_is_kept_as_long_as_pymunk_keeps_it_by_default() -> None:
    assert pymunk.Space().collision_persistence == PERSISTENCE


def found_in(lengths: list[float], impulses: list[tuple[int, float]]) -> list[bool]:
    """Return which contacts of one pair are found. impulses: step and kg px/s."""
    clock = Clock.of_rates([1 / length for length in lengths])
    rows = [(clock.time(step), 0, -4, (0, 1), impulse, 0, 0, 0) for step, impulse in impulses]
    contacts = np.array(rows, CONTACT)
    found: list[bool] = RescaledImpulses(clock, None).find(contacts, np.array([step for step, _ in impulses])).tolist()
    return found


def dropped(*lengths: float) -> Watched:
    """Watch a ball that lands in the second step, and that the floor sends back at half of its speed. lengths: s."""
    space = pymunk.Space()
    space.gravity = 0, 900
    floor = pymunk.Segment(space.static_body, (0, 300), (400, 300), 5)
    body = pymunk.Body(1, 200)
    body.position, body.velocity = (100, 272), (0, 150)
    ball = pymunk.Circle(body, 20)
    floor.elasticity = ball.elasticity = 0.5**0.5
    space.add(floor, body, ball)
    with warnings.catch_warnings(action="ignore", category=SpaceWarning), watch(space) as watched:
        for length in lengths:
            space.step(length)
        assert watched.comparison
    return watched


def causes(watched: Watched) -> dict[Cause, str]:
    """Return the causes of the differences, each with its first sentence."""
    return {one.cause: one.because for one in reversed(watched.comparison.runs["space"].differences)}


def test_the_reason_is_given_where_an_impulse_that_grew_with_dt_pushes_a_ball() -> None:
    """Its impulse of 262.5 kg px/s grows by 8 %: 21 of it stay, and nothing else does."""
    watched = dropped(*[1 / 60] * 2, *[0.018] * 7)
    [_, push] = watched.comparison.runs["space"].contacts["impulse"].tolist()
    assert push == pytest.approx(262.5 * 0.08)
    assert causes(watched)[Cause.RESCALED].startswith("dt grew from 16.7 to 18 ms. Then Pymunk multiplies the impulse ")
    assert Cause.LARGE not in causes(watched)
    assert "a constant dt, such as 1/60 s, avoids it" in verdict(watched.comparison)


def test_a_push_in_the_last_step_is_a_difference_though_the_reference_may_have_a_contact_after_the_end() -> None:
    """The two were parting: no contact of the reference can be its match."""
    assert Cause.RESCALED in causes(dropped(1 / 60, 1 / 60, 0.018))


def test_a_ball_that_is_pulled_back_after_dt_shrank_had_no_earlier_touch() -> None:
    watched = dropped(*[1 / 60] * 2, *[1 / 120] * 8)
    assert causes(watched)[Cause.RESCALED].startswith("dt shrank from 16.7 to 8.33 ms. Then Pymunk multiplies ")
    assert Cause.STALE not in causes(watched)


@pytest.mark.parametrize("lengths", [[1 / 60] * 8, [1 / 60, 1 / 30, 1 / 30, 1 / 30], [1 / 60] + [1 / 120] * 4])
def test_no_impulse_is_called_rescaled_where_dt_did_not_change_in_a_lasting_contact(lengths: list[float]) -> None:
    """The last two land after the change."""
    watched = dropped(*lengths)
    assert len(watched.comparison.runs["space"].contacts)
    assert Cause.RESCALED not in {entry.cause for entry in watched.comparison.runs["space"].figures.ledger}
    assert "constant dt" not in verdict(watched.comparison)
