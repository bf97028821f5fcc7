"""The motion of both bodies before and after each contact, from the impulses that an engine reports."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from sandbox.quantity import impulse_of
from sandbox.scene.model import Scene
from sandbox.state import Bools, Contacts, Floats, Integers, States

MAX_IMPACTS: Final = 500  # contacts of which a run keeps the motion before and after
IMPACT: Final = np.dtype([("before", "f8", (2, 3)), ("after", "f8", (2, 3))])  # px/s twice, and rad/s; zeros of a wall
Impacts = NDArray[np.void]


def impacts_in(
    scene: Scene, states: States, contacts: Contacts, step_of: Integers, within: Floats, *, together: bool
) -> Impacts:
    """Return the motion before and after each contact: (k,) IMPACT.

    states: of steps + 1 rows, the first before the steps; step_of: (k,), the row that each contact's step leads to, and
    within: s since that step began; together: whether contacts at one time act on the velocities before all of them.
    """
    impacts = np.zeros(len(contacts), IMPACT)
    if not len(contacts):
        return impacts
    motion = np.dstack([states.velocity, states.spin])
    pull = np.append(scene.gravity, 0.0)
    now, step, last = motion[0], 0, 0.0
    starts = np.flatnonzero(_begins(contacts, step_of, together=together)).tolist()
    for begin, end in zip(starts, [*starts[1:], len(contacts)], strict=True):
        if step_of[begin] != step:
            step, last = int(step_of[begin]), 0.0
            now = motion[step - 1].copy()
        now += pull * (within[begin] - last)
        last = float(within[begin])
        group = range(begin, end)
        for k in group:
            impacts["before"][k] = _of_bodies(now, contacts[k])
        for k in group:
            _apply(scene, contacts[k], now)
        for k in group:
            impacts["after"][k] = _of_bodies(now, contacts[k])
    return impacts


def _begins(contacts: Contacts, step_of: Integers, *, together: bool) -> Bools:
    """Return whether a contact is the first of those that act on the same velocities."""
    begins = np.ones(len(contacts), bool)
    if together:
        begins[1:] = (np.diff(contacts["time"]) != 0) | (np.diff(step_of) != 0)
    return begins


def _of_bodies(motion: Floats, contact: np.void) -> Floats:
    """Return the motion of a contact's bodies, (2, 3)."""
    first, second = int(contact["first"]), int(contact["second"])
    return np.stack([motion[first], motion[second] if second >= 0 else np.zeros(3)])


def _apply(scene: Scene, contact: np.void, motion: Floats) -> None:
    """Change the motion of balls, (n, 3), by a contact's impulses."""
    bodies, push = scene.bodies, impulse_of(contact)
    for ball, sign in ((int(contact["first"]), -1), (int(contact["second"]), 1)):
        if ball >= 0:
            motion[ball, :2] += sign * push / bodies.mass[ball]
            motion[ball, 2] -= contact["tangential"] * bodies.radius[ball] / bodies.moment[ball]
