"""A recording of a Space has what Pymunk's own functions say, and leaves the program as it is."""

import math

import numpy as np
import pymunk
import pytest
from spaces import DT, record

from sandbox.space.recording import Recording


def falling_box() -> tuple[pymunk.Space, pymunk.Body]:
    space = pymunk.Space()
    space.gravity = (0, -900)
    floor = pymunk.Segment(space.static_body, (-100, 0), (100, 0), 1)
    body = pymunk.Body(2, 120)
    box = pymunk.Poly.create_box(body, (20, 20))
    floor.friction = box.friction = 0.5
    body.position, body.velocity = (0, 10.8), (40, -10)
    space.add(body, box, floor)
    return space, body


def test_a_snapshot_has_the_state_that_pymunk_returns() -> None:
    """The position is that of the centre of gravity."""
    space, body = falling_box()
    body.angle, body.angular_velocity, body.force, body.torque = math.pi / 2, -1.5, (2, 3), 4
    body.center_of_gravity = 3, 0
    before = record(space, 1).steps[0]
    row = next(row for row in before.old if row["id"] == body.id)
    assert (row["mass"], row["moment"], row["angle"], row["spin"], row["torque"]) == (2, 120, math.pi / 2, -1.5, 4)
    assert row["position"] == pytest.approx((0, 10.8 + 3))
    assert row["velocity"].tolist() == [40, -10]
    assert row["force"].tolist() == [2, 3]


def test_the_impulses_of_both_points_sum_to_the_arbiter_s_total() -> None:
    space, _ = falling_box()
    totals: list[pymunk.Vec2d] = []
    space.on_collision(0, 0, post_solve=lambda arbiter, *_: totals.append(arbiter.total_impulse))
    solved = [step.contacts for step in record(space, 10).steps]
    assert [len(contacts) for contacts in solved] == [2] * 10  # the program's own handler was called
    for total, contacts in zip(totals, solved, strict=True):
        tangent = np.stack([-contacts["normal"][:, 1], contacts["normal"][:, 0]], axis=1)
        impulse = contacts["impulse"][:, None] * contacts["normal"] + contacts["tangential"][:, None] * tangent
        assert np.abs(impulse.sum(axis=0)) == pytest.approx(np.abs(total), rel=1e-12)


def test_contacts_come_in_the_order_in_which_shapes_were_added() -> None:
    """Not in that of addresses, which is another in every run."""
    space = pymunk.Space()
    space.add(pymunk.Segment(space.static_body, (-10, 0), (1000, 0), 0))
    balls = [pymunk.Body(1, 10) for _ in range(10)]
    for place, ball in zip((7, 2, 9, 4, 1, 8, 3, 6, 0, 5), balls, strict=True):
        ball.position = (100 * place, 9)
        space.add(ball, pymunk.Circle(ball, 10))
    contacts = record(space, 1).steps[0].contacts
    pairs = [{row["body_a"], row["body_b"]} - {space.static_body.id} for row in contacts]
    assert pairs == [{ball.id} for ball in balls]


def test_bodies_that_come_and_go_are_in_the_steps_in_which_they_were_there() -> None:
    space, body = falling_box()
    recording = record(space, 1)
    ball = pymunk.Body(1, 10)
    space.add(ball, pymunk.Circle(ball, 5))
    recording.record(space.step, DT)
    space.remove(body, *body.shapes)
    recording.record(space.step, DT)
    moving = [{int(row["id"]) for row in step.new if math.isfinite(row["mass"])} for step in recording.steps]
    assert moving == [{body.id}, {body.id, ball.id}, {ball.id}]
    assert recording.bodies[body.id] is body


def test_each_joint_s_error_is_that_of_its_law() -> None:
    """The ends of a slide joint are where its law is broken by a known amount before any step can mend that."""
    space = pymunk.Space()
    a, b = pymunk.Body(1, math.inf), pymunk.Body(1, math.inf)
    b.position = (10, 0)
    joints: list[pymunk.Constraint] = [
        pymunk.PinJoint(a, b),
        pymunk.SlideJoint(a, b, (0, 0), (0, 0), 2, 11),
        pymunk.PivotJoint(a, b, (0, 0), (-10, 0)),
        pymunk.SimpleMotor(a, b, 1),
    ]
    for joint in joints:
        joint.error_bias = 1  # that all of an error is left after a second
    space.add(a, b, *joints)
    b.position = (14, 3)
    rows = record(space, 1).steps[0].joints
    length = math.hypot(14, 3)
    assert rows["error"] == pytest.approx([length - 10, length - 11, 5, 0])
    assert rows["key"].tolist() == [id(joint) for joint in joints]
    assert rows["is_hard"].tolist() == [True, False, True, False]


def test_a_long_recording_forgets_its_first_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each step counts as 106 rows: 100, two bodies before and after, and two contacts."""
    monkeypatch.setattr("sandbox.space.recording.MAX_ROWS", 1_060)
    steps = record(falling_box()[0], 100).steps
    assert len(steps) == 10
    assert [round(step.time / DT) for step in steps] == [*range(90, 100)]


def test_recording_leaves_the_run_as_it_is() -> None:
    (plain, body), (space, other) = falling_box(), falling_box()
    record(space, 60)
    for _ in range(60):
        plain.step(DT)
    assert (body.position, body.angle, body.velocity) == (other.position, other.angle, other.velocity)


def test_a_step_of_no_time_is_not_record() -> None:
    space, _ = falling_box()
    recording = Recording(space)
    recording.record(space.step, 0)
    assert not recording.steps
