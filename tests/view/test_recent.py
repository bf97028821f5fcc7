"""What a pane keeps of the latest steps."""

from typing import Final

import numpy as np
import pytest

from sandbox.run.lockstep import Lockstep
from sandbox.scene.files import load
from sandbox.state import CONTACT, State
from sandbox.view.overlay import CONTACT_SECONDS, MAX_CONTACTS, MAX_POSITIONS, RecentContacts, Trail

RADIUS: Final = np.array([20.0])


def state_at(time: float, x: float) -> State:
    return State(time, np.array([[x, 100.0]]), np.zeros((1, 2)))


def test_a_trail_keeps_the_latest_places_and_drops_undone_ones() -> None:
    trail = Trail(1)
    for step in range(MAX_POSITIONS + 10):
        trail.add(state_at(step / 60, step))
    assert trail.positions()[:, 0, 0].tolist() == list(range(10, MAX_POSITIONS + 10))
    trail.add(state_at((MAX_POSITIONS + 5) / 60, -1))  # gone back, and on another course
    assert trail.positions()[-2:, 0, 0].tolist() == [MAX_POSITIONS + 4, -1]
    trail.add(state_at(1e3, 7))  # after a long pause
    assert trail.positions()[:, 0, 0].tolist() == [7]


def test_trails_of_many_balls_are_shorter() -> None:
    trail = Trail(5_000)
    for step in range(100):
        trail.add(State(step / 60, np.zeros((5_000, 2)), np.zeros((5_000, 2))))
    assert trail.positions().shape == (4, 5_000, 2)


def contacts_of(*rows: tuple[float, int, int, tuple[float, float], float]) -> np.ndarray:
    return np.array([(*row, 0.0, 0.0, 0.0) for row in rows], CONTACT)


def test_a_contact_is_placed_where_the_ball_was_at_its_time() -> None:
    contacts = RecentContacts()
    state = State(1.0, np.array([[90.0, 300.0]]), np.array([[-100.0, 0.0]]))  # it has flown 0.1 s since
    contacts.add(contacts_of((0.9, 0, -3, (1.0, 0.0), 5.0)), state, RADIUS)
    assert contacts.latest()["point"].tolist() == [[120.0, 300.0]]
    assert contacts.latest()["impulse"].tolist() == [5.0]
    contacts.add(contacts_of(), State(0.9 + CONTACT_SECONDS + 0.01, state.position, state.velocity), RADIUS)
    assert len(contacts.latest()) == 0


def test_contacts_are_dropped_after_a_step_back_and_bounded_in_number() -> None:
    contacts = RecentContacts()
    state = State(1.0, np.zeros((1, 2)), np.zeros((1, 2)))
    contacts.add(contacts_of(*[(1.0, 0, -1, (1.0, 0.0), float(k)) for k in range(3 * MAX_CONTACTS)]), state, RADIUS)
    assert contacts.latest()["impulse"].tolist() == list(range(2 * MAX_CONTACTS, 3 * MAX_CONTACTS))
    contacts.add(contacts_of(), State(0.99, state.position, state.velocity), RADIUS)
    assert len(contacts.latest()) == 0


@pytest.mark.parametrize("engine", ["pymunk", "impulse", "exact"])
def test_the_contact_of_a_head_on_collision_is_between_the_balls(engine: str) -> None:
    scene = load("head-on")
    lockstep = Lockstep(scene, [engine])
    lockstep.engines[engine].record_contacts()
    contacts = RecentContacts()
    while not len(contacts.latest()):
        lockstep.step()
        contacts.add(lockstep.engines[engine].contacts(), lockstep.states()[engine], scene.bodies.radius)
    [contact] = contacts.latest()
    (left, right), (u, v) = lockstep.initial.position[:, 0], lockstep.initial.velocity[:, 0]
    radius, approach = scene.bodies.radius[0], u - v
    meet = left + radius + u * (right - left - 2 * radius) / approach
    late = {"pymunk": 7, "impulse": 7, "exact": 1e-9}[engine]  # px that a ball goes in a step
    assert contact["point"] == pytest.approx([meet, 300], abs=late)
    assert contact["impulse"] == pytest.approx(approach * 1 * 1 / (1 + 1) * 2, rel=1e-6)  # equal masses, e = 1
