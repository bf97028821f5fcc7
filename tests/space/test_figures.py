"""Figures of a run, against scenes whose figures are known."""

import math

import pymunk
import pytest
from spaces import DT, ball, record, wall

from sandbox.space.figures import (
    escapes,
    jitter,
    joint_errors,
    joint_residuals,
    overlaps,
    stretches,
    wrong_bounces,
)
from sandbox.space.memory import JointKind, joint_key


def test_the_deepest_overlap_is_the_way_that_a_ball_went_too_far() -> None:
    space = pymunk.Space()
    wall(space, (100, -50), (100, 50), 0, elasticity=1)
    body = ball(space, 60, 0, velocity=(600, 0))  # 10 px a step: at 90 after three, at 97 after 3.7
    body.position = (63, 0)
    recording = record(space, 10)
    worst = overlaps(recording)
    assert len(worst) == 1
    assert worst[0].worst[1] == pytest.approx(3)
    assert worst[0].worst[0] == 2
    assert set(worst[0].ends) == {body.id, space.static_body.id}


def test_overlaps_that_are_equally_deep_come_in_the_order_of_their_contacts() -> None:
    """Not in that of their bodies' addresses, which is another in every run."""
    space = pymunk.Space()
    space.add(pymunk.Segment(space.static_body, (-10, 0), (1000, 0), 0))
    for number in (7, 2, 9, 4, 1, 8, 3, 6, 0, 5):
        ball(space, 100 * number, 19, velocity=(0, -600))
    recording = record(space, 1)
    [step] = recording
    ends = step.after.contacts[["body_a", "body_b"]].tolist()
    assert len(ends) == 10
    assert [overlap.ends for overlap in overlaps(recording)] == ends


def test_each_joint_s_error_is_that_of_its_law() -> None:
    """Free bodies are put where each law is broken by a known amount; joints without force leave them there."""
    space = pymunk.Space()
    a, b = pymunk.Body(1, 1), pymunk.Body(1, 1)
    b.position = (10, 0)
    joints: list[pymunk.Constraint] = [
        pymunk.PinJoint(a, b),
        pymunk.SlideJoint(a, b, (0, 0), (0, 0), 2, 11),
        pymunk.PivotJoint(a, b, (0, 0), (-10, 0)),
        pymunk.GrooveJoint(a, b, (0, -5), (0, 5), (-10, 0)),
        pymunk.RotaryLimitJoint(a, b, -0.25, 0.125),
        pymunk.RatchetJoint(a, b, 0, 1),
        pymunk.GearJoint(a, b, 0.125, 2),
    ]
    for joint in joints:
        joint.max_force = 0
    space.add(a, b, *joints)
    b.position = (14, 3)
    recording = record(space, 1)
    length = math.hypot(14, 3)
    expected = [length - 10, length - 11, 5, 4, 0, 0, -0.125]
    assert joint_errors(recording.steps[0].after.joints) == pytest.approx(expected)
    b.angle = -0.5  # its anchors turn
    recording.record(space.step, DT)
    assert joint_errors(recording.steps[1].after.joints)[4:] == pytest.approx([-0.25, 0.5, -1.125])
    by_kind = {stretch.first["kind"]: stretch for stretch in stretches(recording)}
    assert by_kind[JointKind.PIN].worst[1] == pytest.approx(length - 10)
    number, error = by_kind[JointKind.GEAR].worst
    assert number == 1
    assert error == pytest.approx(-1.125)


def test_springs_and_motors_have_no_stretch() -> None:
    space = pymunk.Space()
    a, b = pymunk.Body(1, 1), pymunk.Body(1, 1)
    b.position = (50, 0)
    space.add(a, b, pymunk.DampedSpring(a, b, (0, 0), (0, 0), 10, 1, 0), pymunk.SimpleMotor(a, b, 1))
    assert stretches(record(space, 3)) == []


def test_only_a_contact_that_ends_otherwise_is_a_wrong_bounce() -> None:
    space = pymunk.Space()
    ball(space, 0, 0, velocity=(300, 0))
    ball(space, 50, 0, velocity=(0, 0))
    assert wrong_bounces(record(space, 20)) == []


def test_a_handler_that_halves_a_velocity_makes_a_wrong_bounce() -> None:
    space = pymunk.Space()
    wall(space, (100, -50), (100, 50), 0, elasticity=0.8)
    body = ball(space, 70, 0, velocity=(300, 0), elasticity=0.5)

    def halve(*_: object) -> None:
        body.velocity = body.velocity / 2

    space.on_collision(0, 0, post_solve=halve)
    bounces = wrong_bounces(record(space, 10))
    assert [{bounce.body_a, bounce.body_b} for bounce in bounces] == [{body.id, space.static_body.id}]
    assert bounces[0].approach == pytest.approx(300)
    assert bounces[0].elasticity == pytest.approx(0.4)
    assert bounces[0].separation == pytest.approx(0.2 * 300)


def test_jitter_is_the_share_of_steps_that_reverse_a_resting_body() -> None:
    space = pymunk.Space()
    space.gravity = (0, -600)
    shaken, still = pymunk.Body(1, 1), pymunk.Body(1, 1)
    space.add(shaken, still)
    for body in (shaken, still):
        body.velocity_func = lambda *_: None  # they move as the program says

    def shake(number: int) -> None:
        shaken.velocity, still.velocity = (3 if number % 2 else -3, 0), (3, 0)

    shares = jitter(record(space, 50, shake))
    assert shares[shaken.id] == pytest.approx(49 / 50)
    assert shares[still.id] == 0


def test_a_body_that_falls_out_of_the_world_or_becomes_nan_has_escaped() -> None:
    space = pymunk.Space()
    stays, leaves, rests = (ball(space, 100 * k, 0, velocity=(0, 0)) for k in range(3))
    leaves.velocity = (0, -60_000)  # 1,000 px a step

    def divide(number: int) -> None:
        if number == 4:
            space.add(pymunk.SimpleMotor(space.static_body, broken, 1))

    broken = pymunk.Body(1, math.inf)
    space.add(broken)
    left = escapes(record(space, 10, divide))
    assert [(escape.body, escape.is_finite) for escape in left] == [(leaves.id, True), (broken.id, False)]
    assert {stays.id, rests.id}.isdisjoint({escape.body for escape in left})


def test_one_pass_over_two_rods_leaves_the_first_half_of_what_it_had_to_do() -> None:
    """The first rod, 1 px too long, is to shorten at b; then the second halves the velocities of its equal bodies."""
    space = pymunk.Space()
    space.gravity, space.iterations = (0, 900), 1
    upper, lower = pymunk.Body(1, math.inf), pymunk.Body(1, math.inf)
    upper.position, lower.position = (0, 100), (0, 200)
    first, second = pymunk.PinJoint(space.static_body, upper), pymunk.PinJoint(upper, lower)
    first.distance = 99
    space.add(upper, lower, first, second)
    recording = record(space, 1)
    residuals = {int(joint.first["key"]): joint for joint in joint_residuals(list(recording), recording.joint)}
    b = (1 - first.error_bias**DT) / DT
    of_first, of_second = (residuals[joint_key(joint)].values[0] for joint in (first, second))
    assert of_first == pytest.approx((900 * DT - b) / 2 + b)
    assert of_second == 0
    first.max_bias = b / 2
    slower = joint_residuals(list(recording), recording.joint)[0].values[0]
    assert slower == pytest.approx((900 * DT - b) / 2 + b / 2)
