"""A recording of a Space has what Pymunk's own functions say, and leaves the program as it is."""

import itertools
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pymunk
import pytest

from sandbox.space import memory
from sandbox.space.contents import body_of
from sandbox.space.memory import SpaceMemory, check_layout, joint_key
from sandbox.space.recording import Recording

DT = 1 / 64


def falling_box() -> tuple[pymunk.Space, pymunk.Poly]:
    space = pymunk.Space()
    space.gravity = (0, -900)
    floor = pymunk.Segment(space.static_body, (-100, 0), (100, 0), 1)
    body = pymunk.Body(2, 120)
    box = pymunk.Poly.create_box(body, (20, 20))
    floor.friction = box.friction = 0.5
    body.position, body.velocity = (0, 10.8), (40, -10)
    space.add(body, box, floor)
    return space, box


def test_a_snapshot_has_the_state_that_pymunk_returns() -> None:
    space, box = falling_box()
    body = box.body
    assert body
    body.angle, body.angular_velocity, body.force, body.torque = 0.3, -1.5, (2, 3), 4
    row = next(row for row in SpaceMemory(space).snapshot().bodies if row["id"] == body.id)
    assert (row["mass"], row["moment"]) == (2, 120)
    assert (row["position"] == body.position).all()
    assert (row["velocity"] == body.velocity).all()
    assert (row["angle"], row["spin"], row["torque"]) == (0.3, -1.5, 4)
    assert (row["force"] == (2, 3)).all()


def test_a_position_is_that_of_the_centre_of_gravity() -> None:
    space, body = pymunk.Space(), pymunk.Body(1, 1)
    body.center_of_gravity, body.angle, body.position = (3, 0), math.pi / 2, (10, 20)
    space.add(body)
    assert SpaceMemory(space).snapshot().bodies["position"][0] == pytest.approx((10, 23))


def test_the_impulses_of_both_points_sum_to_the_arbiter_s_total() -> None:
    space, _box = falling_box()
    totals: list[pymunk.Vec2d] = []
    space.on_collision(0, 0, post_solve=lambda arbiter, *_: totals.append(arbiter.total_impulse))
    recording = Recording(space)
    for _ in range(10):
        recording.record(space.step, DT)
    solved = [step.after.contacts for step in recording if len(step.after.contacts)]
    assert len(totals) == len(solved) == 10  # the program's own handler was called
    for total, contacts in zip(totals, solved, strict=True):
        assert len(contacts) == 2
        tangent = np.stack([-contacts["normal"][:, 1], contacts["normal"][:, 0]], axis=1)
        impulse = contacts["impulse"][:, None] * contacts["normal"] + contacts["tangential"][:, None] * tangent
        assert abs(impulse.sum(axis=0)[1]) == pytest.approx(abs(total.y), rel=1e-12)
        assert abs(impulse.sum(axis=0)[0]) == pytest.approx(abs(total.x), rel=1e-12)


def test_bodies_that_come_and_go_are_in_the_steps_in_which_they_were_there() -> None:
    space, box = falling_box()
    recording = Recording(space)
    recording.record(space.step, DT)
    ball = pymunk.Body(1, 10)
    space.add(ball, pymunk.Circle(ball, 5))
    recording.record(space.step, DT)
    assert box.body
    space.remove(box, box.body)
    recording.record(space.step, DT)
    moving = [{int(row["id"]) for row in step.after.bodies if math.isfinite(row["mass"])} for step in recording]
    assert moving == [{box.body.id}, {box.body.id, ball.id}, {ball.id}]
    assert recording.body(box.body.id) is box.body


def test_sleeping_bodies_are_recorded_as_asleep() -> None:
    space, box = falling_box()
    space.sleep_time_threshold = 0.25
    recording = Recording(space)
    for _ in range(200):
        recording.record(space.step, DT)
    assert box.body
    assert box.body.is_sleeping
    last = recording.steps[-1].after.bodies
    assert last["asleep"][last["id"] == box.body.id] != 0
    assert not recording.steps[0].after.bodies["asleep"].any()


def test_many_bodies_contacts_and_joints_fit() -> None:
    space = pymunk.Space()
    bodies = [pymunk.Body(1, 1) for _ in range(300)]
    space.add(*bodies, *(pymunk.Circle(body, 5) for body in bodies))
    joints = [pymunk.PinJoint(a, b, (0, 0), (1, 0)) for a, b in itertools.pairwise(bodies)]
    space.add(*joints)
    for k, body in enumerate(bodies):
        body.position = (8 * (k % 20), 8 * (k // 20))
    space.step(DT)
    snapshot = SpaceMemory(space).snapshot()
    assert len(snapshot.bodies) == 300
    assert snapshot.joints["key"].tolist() == [joint_key(joint) for joint in joints]
    assert len(snapshot.contacts) > 300


@pytest.mark.parametrize("limit", ["bytes", "seconds"])
def test_a_ring_buffer_bounds_the_recording(limit: str) -> None:
    space, _ = falling_box()
    recording = Recording(space, max_bytes=20000) if limit == "bytes" else Recording(space, max_seconds=10 * DT)
    for _ in range(100):
        recording.record(space.step, DT)
    assert recording.dropped == 100 - len(recording)
    assert recording.steps[-1].number == 99
    if limit == "bytes":
        kept = {id(part): part.bytes for step in recording for part in (step.before, step.after)}
        assert recording.bytes == sum(kept.values()) <= 20_000
        assert len(recording) > 10
    else:
        assert len(recording) == 10


CHANGES: dict[str, Callable[[pymunk.Space, pymunk.Poly], object]] = {
    "elasticity": lambda _, box: setattr(box, "elasticity", 0.3),
    "friction": lambda _, box: setattr(box, "friction", 0.3),
    "surface velocity": lambda _, box: setattr(box, "surface_velocity", (1, 0)),
    "sensor": lambda _, box: setattr(box, "sensor", True),
    "filter": lambda _, box: setattr(box, "filter", pymunk.ShapeFilter(mask=2)),
    "radius": lambda _, box: box.unsafe_set_radius(1),
    "mass": lambda _, box: setattr(box.body, "mass", 3),
    "centre of gravity": lambda _, box: setattr(box.body, "center_of_gravity", (1, 0)),
    "velocity function": lambda _, box: setattr(box.body, "velocity_func", lambda *_: None),
    "wall moved": lambda space, _: setattr(space.static_body, "position", (0, 1)),
    "gravity": lambda space, _: setattr(space, "gravity", (0, 1)),
    "iterations": lambda space, _: setattr(space, "iterations", 7),
    "persistence": lambda space, _: setattr(space, "collision_persistence", 7),
    "shape removed": lambda space, box: space.remove(box),
    "joint added": lambda space, box: space.add(pymunk.PivotJoint(space.static_body, body_of(box), (0, 0))),
}


@pytest.mark.parametrize("change", CHANGES)
def test_the_fingerprint_of_a_space_is_another_after_a_change(change: str) -> None:
    space, box = falling_box()
    memory = SpaceMemory(space)
    before = memory.snapshot().fingerprint
    CHANGES[change](space, box)
    assert memory.snapshot().fingerprint != before


def test_motion_leaves_the_fingerprint_of_a_space_as_it_is() -> None:
    space, box = falling_box()
    memory = SpaceMemory(space)
    before = memory.snapshot().fingerprint
    assert box.body
    box.body.velocity, box.body.angle, box.body.force = (30, 4), 0.5, (1, 2)
    space.step(DT)
    assert memory.snapshot().fingerprint == before


def test_what_the_program_did_not_change_is_stored_once() -> None:
    space, box = falling_box()
    recording = Recording(space)
    for _ in range(3):
        recording.record(space.step, DT)
    assert box.body
    box.body.velocity = (0, 100)
    recording.record(space.step, DT)
    steps = list(recording)
    assert steps[1].before is steps[0].after
    assert steps[2].before is steps[1].after
    assert steps[3].before != steps[2].after


def test_recording_leaves_the_run_as_it_is() -> None:
    plain, box = falling_box()
    recorded, recorded_box = falling_box()
    recording = Recording(recorded)
    for _ in range(60):
        plain.step(DT)
        recording.record(recorded.step, DT)
    assert box.body
    assert recorded_box.body
    assert (box.body.position, box.body.angle) == (recorded_box.body.position, recorded_box.body.angle)


def test_a_step_of_no_time_is_not_recorded() -> None:
    space, _ = falling_box()
    recording = Recording(space)
    recording.record(space.step, 0)
    assert len(recording) == 0


def test_the_check_of_the_layout_notices_another_one() -> None:
    check_layout()
    space, joints = memory._probe()
    seen = SpaceMemory(space).snapshot()
    assert all(memory._agreements(space, joints, seen))
    for part in ("body_bytes", "contact_bytes", "joint_bytes", "setting_bytes"):
        shifted = getattr(seen, part)[8:] + bytes(8)
        assert not all(memory._agreements(space, joints, replace(seen, **{part: shifted})))
