"""A Space beside its finer self: both against closed forms, with the same mouse and the same forces."""

import math

import pymunk
import pytest

from sandbox.space.description import SpaceDescription, describe
from sandbox.space.side_by_side import COARSE, FINE, SideBySide

GRAVITY = 900.0
DT = 1 / 60


def ball_in_the_air(**more: object) -> SpaceDescription:
    space, ball = pymunk.Space(), pymunk.Body(1, 50)
    space.gravity = (0, GRAVITY)
    space.add(ball, pymunk.Circle(ball, 10), pymunk.Segment(space.static_body, (-300, 900), (300, 900), 1))
    return describe(space).model_copy(update=more)


def test_the_finer_one_is_nearer_to_a_free_fall() -> None:
    """Chipmunk moves bodies before it accelerates them: with steps of h, a body falls g h t / 2 less than g t² / 2."""
    pair = SideBySide(ball_in_the_air())
    assert (pair.substeps, pair.iterations) == (64, 40)
    assert pair.names == ("pymunk", "pymunk in 64 substeps, 40 iterations")
    for _ in range(60):
        pair.step()
    too_high = GRAVITY * DT * 1.0 / 2
    for side, error in ((COARSE, too_high), (FINE, too_high / 64)):
        assert pair.sides[side].bodies[0].position.y == pytest.approx(GRAVITY / 2 - error, rel=1e-9)
    gap, body = pair.gap
    assert gap == pytest.approx(too_high * 63 / 64)
    assert body == 0
    first = next(n for n in range(60) if n * DT * GRAVITY * DT / 2 * 63 / 64 > pair.visible)
    assert pair.apart_since == pytest.approx(first * DT)
    assert pair.readout == f"7.38 px apart (bodies[0]); first more than 2 px apart at {first * DT:.2f} s"
    pair.restart()
    assert (pair.time, pair.gap[0]) == (0, 0)
    assert pair.readout == "not apart; never more than 2 px apart so far"


def test_both_are_pulled_to_the_mouse() -> None:
    pair = SideBySide(ball_in_the_air())
    pair.grab(FINE, (3, 4))
    pair.move((103, 54))
    for _ in range(60):
        pair.step()
    for side in pair.sides:
        assert side.bodies[0].position.get_distance((100, 50)) < 2 * GRAVITY / 25**2  # by which gravity pulls it down
    pair.release()
    for _ in range(10):
        pair.step()
    assert all(side.bodies[0].position.y > 55 for side in pair.sides)


def test_the_mouse_holds_no_static_body_and_no_empty_place() -> None:
    pair = SideBySide(ball_in_the_air())
    for place in ((0, 900), (50, 50)):
        pair.grab(COARSE, place)
        assert pair.held is None


def test_a_force_in_the_file_acts_through_the_whole_first_step() -> None:
    description = ball_in_the_air()
    pushed = description.bodies[0].model_copy(update={"force": (60.0, 0.0), "torque": 6.0})
    pair = SideBySide(description.model_copy(update={"bodies": (pushed,)}))
    for _ in range(2):
        pair.step()
        for side in pair.sides:
            assert side.bodies[0].velocity.x == pytest.approx(60 * DT)
            assert side.bodies[0].angular_velocity == pytest.approx(6 / 50 * DT)


def test_many_bodies_have_fewer_substeps() -> None:
    space = pymunk.Space()
    for k in range(200):
        body = pymunk.Body(1, 1)
        body.position = (30 * k, 0)
        space.add(body, pymunk.Circle(body, 10))
    assert SideBySide(describe(space)).substeps == 4


def test_numbers_that_are_no_longer_finite_end_the_run() -> None:
    space, body = pymunk.Space(), pymunk.Body(1, 1)
    body.velocity = (1.7e308, 0)
    space.add(body)
    pair = SideBySide(describe(space))
    for _ in range(100):
        pair.step()
    assert pair.readout == f"pymunk: the position of bodies[0] is not finite at {pair.time:.2f} s"
    assert math.isinf(pair.sides[COARSE].bodies[0].position.x)
    assert pair.steps < 100
