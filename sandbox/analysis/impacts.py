"""The motion of both bodies before and after each contact, from the impulses that an engine reports."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from sandbox.quantity import impulse_of
from sandbox.scene.model import Scene
from sandbox.state import Contacts, Floats, Integers, States

MAX_IMPACTS: Final = 500  # contacts of which a run keeps the motion before and after
IMPACT: Final = np.dtype([("before", "f8", (2, 3)), ("after", "f8", (2, 3))])  # px/s twice, and rad/s; zeros of a wall
Impacts = NDArray[np.void]


def impacts_in(
    scene: Scene, states: States, contacts: Contacts, rows: Integers, within: Floats, *, together: bool
) -> Impacts:
    """Return the motion before and after each contact: (k,) IMPACT.

    states: after the pushes, of steps + 1 rows, the first before the steps; rows: (k,) that each contact's step leads
    to, and within: s since that step began; together: whether contacts at one time act on the velocities before all.
    """
    impacts, bodies, push = np.zeros(len(contacts), IMPACT), scene.bodies, impulse_of(contacts)
    motion, pull = np.dstack([states.velocity, states.spin]), np.append(scene.gravity, 0.0)
    bodies_of = np.stack([contacts["first"], contacts["second"]], axis=1).tolist()
    pairs = [[(side, ball) for side, ball in enumerate(pair) if ball >= 0] for pair in bodies_of]
    begins = np.ones(len(contacts), bool)
    begins[1:] = not together
    begins[1:] |= (np.diff(contacts["time"]) != 0) | (np.diff(rows) != 0)
    now, row, last = motion[0], 0, 0.0
    for group in np.split(np.arange(len(contacts)), np.flatnonzero(begins)[1:]) if len(contacts) else ():
        if rows[group[0]] != row:
            row, last = int(rows[group[0]]), 0.0
            now = motion[row - 1].copy()
        now += pull * (within[group[0]] - last)
        last = float(within[group[0]])
        before = now.copy()
        for k in group:
            for side, ball in pairs[k]:
                now[ball, :2] += (1 if side else -1) * push[k] / bodies.mass[ball]
                now[ball, 2] -= contacts["tangential"][k] * bodies.radius[ball] / bodies.moment[ball]
        for k in group:
            for side, ball in pairs[k]:
                impacts["before"][k, side], impacts["after"][k, side] = before[ball], now[ball]
    return impacts
