"""A recording of a Space has what Pymunk's own functions say, and leaves the program as it is."""

import math
from itertools import pairwise

import numpy as np
import pymunk
import pytest

from sandbox.space.energy import Cause, ledger_of
from sandbox.space.recording import Recording, Run, address, knows_joints

DT = 1 / 64


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


def recorded(space: pymunk.Space, steps: int) -> Recording:
    recording = Recording(space)
    for _ in range(steps):
        recording.record(space.step, DT)
    return recording


def test_a_snapshot_has_the_state_that_pymunk_returns() -> None:
    """The position is that of the centre of gravity."""
    space, body = falling_box()
    body.angle, body.angular_velocity, body.force, body.torque = math.pi / 2, -1.5, (2, 3), 4
    body.center_of_gravity = 3, 0
    before = recorded(space, 1).steps[0].before
    row = next(row for row in before.bodies if row["id"] == body.id)
    assert (row["mass"], row["moment"], row["angle"], row["spin"], row["torque"]) == (2, 120, math.pi / 2, -1.5, 4)
    assert row["position"] == pytest.approx((0, 10.8 + 3))
    assert row["velocity"].tolist() == [40, -10]
    assert row["force"].tolist() == [2, 3]


def test_the_impulses_of_both_points_sum_to_the_arbiter_s_total() -> None:
    space, _ = falling_box()
    totals: list[pymunk.Vec2d] = []
    space.on_collision(0, 0, post_solve=lambda arbiter, *_: totals.append(arbiter.total_impulse))
    solved = [step.after.contacts for step in recorded(space, 10).steps]
    assert [len(contacts) for contacts in solved] == [2] * 10  # the program's own handler was called
    for total, contacts in zip(totals, solved, strict=True):
        tangent = np.stack([-contacts["normal"][:, 1], contacts["normal"][:, 0]], axis=1)
        impulse = contacts["impulse"][:, None] * contacts["normal"] + contacts["tangential"][:, None] * tangent
        assert np.abs(impulse.sum(axis=0)) == pytest.approx(np.abs(total), rel=1e-12)


def test_bodies_that_come_and_go_are_in_the_steps_in_which_they_were_there() -> None:
    space, body = falling_box()
    recording = recorded(space, 1)
    ball = pymunk.Body(1, 10)
    space.add(ball, pymunk.Circle(ball, 5))
    recording.record(space.step, DT)
    space.remove(body, *body.shapes)
    recording.record(space.step, DT)
    moving = [{int(row["id"]) for row in step.after.bodies if math.isfinite(row["mass"])} for step in recording.steps]
    assert moving == [{body.id}, {body.id, ball.id}, {ball.id}]
    assert recording.bodies[body.id] is body


def test_sleeping_bodies_are_recorded_as_asleep() -> None:
    space, body = falling_box()
    space.sleep_time_threshold = 0.25
    recording = recorded(space, 200)
    assert body.is_sleeping
    last = recording.steps[-1].after.bodies
    assert last["asleep"][last["id"] == body.id]
    assert not recording.steps[0].after.bodies["asleep"].any()


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
        pymunk.DampedSpring(a, b, (0, 0), (0, 0), 10, 1, 0),
        pymunk.SimpleMotor(a, b, 1),
    ]
    for joint in joints:
        joint.max_force = 0
    space.add(a, b, *joints)
    b.position = (14, 3)
    rows = recorded(space, 1).steps[0].after.joints
    length = math.hypot(14, 3)
    assert rows["error"] == pytest.approx([length - 10, length - 11, 5, 4, 0, 0])
    assert rows["key"].tolist() == [address(joint._constraint) for joint in joints]


def test_the_impulses_and_arms_of_joints_are_where_this_chipmunk_keeps_them() -> None:
    space = pymunk.Space()
    space.gravity = 3.5, -211.25
    a, b = pymunk.Body(2.5, 70.5), pymunk.Body(3.5, 71.5)
    a.position, a.velocity, a.angular_velocity = (0, 30.5), (-2.75, 4.5), 0.5
    b.position, b.angle, b.angular_velocity = (7.25, 31.5), 0.125, -0.5
    joints: list[pymunk.Constraint] = [
        pymunk.PinJoint(a, b, (1, 2), (3, 4.5)),
        pymunk.SlideJoint(a, b, (1, 2), (3, 4), 0.5, 1.25),
        pymunk.PivotJoint(a, b, (4, 31)),
        pymunk.GrooveJoint(a, b, (-3, 1), (5, 2), (1, 1.5)),
        pymunk.DampedSpring(a, b, (1, 0), (0, 1), 3.5, 17.5, 0.75),
        pymunk.DampedRotarySpring(a, b, 0.25, 19.5, 1.75),
        pymunk.RotaryLimitJoint(a, b, 0.5, 1.5),
        pymunk.RatchetJoint(a, b, 0.5, 1.25),
        pymunk.GearJoint(a, b, 0.5, 1.5),
        pymunk.SimpleMotor(a, b, 2.25),
    ]
    space.add(a, b, *joints)
    for joint in joints:
        joint.max_force = 100  # so that none leaves nothing to the others
    for row, joint in zip(recorded(space, 2).steps[1].after.joints, joints, strict=True):
        assert math.hypot(*row["impulse"]) == pytest.approx(abs(joint.impulse)) != 0
        for body, side in ((a, "a"), (b, "b")):
            if anchor := getattr(joint, f"anchor_{side}", None):
                assert row[f"arm_{side}"] == pytest.approx(body.local_to_world(anchor) - body.position, abs=1e-12)


def test_a_long_recording_forgets_its_first_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each step counts as 106 rows: 100, two bodies before and after, and two contacts."""
    monkeypatch.setattr("sandbox.space.recording.MAX_ROWS", 1_060)
    steps = recorded(falling_box()[0], 100).steps
    assert len(steps) == 10
    assert [round(step.time / DT) for step in steps] == [*range(90, 100)]


def test_what_the_program_did_not_change_is_stored_once() -> None:
    space, body = falling_box()
    recording = recorded(space, 3)
    body.velocity = (0, 100)
    recording.record(space.step, DT)
    steps = list(recording.steps)
    assert [step.before is last.after for last, step in pairwise(steps)] == [True, True, False]


def test_recording_leaves_the_run_as_it_is() -> None:
    (plain, body), (space, other) = falling_box(), falling_box()
    recorded(space, 60)
    for _ in range(60):
        plain.step(DT)
    assert (body.position, body.angle, body.velocity) == (other.position, other.angle, other.velocity)


def test_a_step_of_no_time_is_not_recorded() -> None:
    space, _ = falling_box()
    recording = Recording(space)
    recording.record(space.step, 0)
    assert not recording.steps


def test_without_a_known_layout_of_joints_the_ledger_has_fewer_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    assert knows_joints()
    for module in ("recording", "energy"):
        monkeypatch.setattr(f"sandbox.space.{module}.knows_joints", lambda: False)
    space, body = falling_box()
    body.position = 0, 300
    space.add(pymunk.PinJoint(space.static_body, body, (100, 300)))
    ledger = ledger_of(Run(recorded(space, 30)))
    assert ledger.lines[Cause.JOINTS] == 0
    assert ledger.lines[Cause.CALLBACKS] != 0
    assert "joints, motors, springs, handlers: in one, as this Pymunk is not known" in ledger.shares
    assert sum(ledger.lines.values()) == pytest.approx(float(ledger.total[-1] - ledger.total[0]), abs=1e-6)
