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


def impacts_in(scene: Scene, states: States, contacts: Contacts, rows: Integers, within: Floats) -> Impacts:
    """Return the motion before and after each contact, one after another: (k,) IMPACT.

    states: after the pushes, of steps + 1 rows, the first before the steps; rows: (k,) that each contact's step leads
    to, and within: s since that step began.
    """
    impacts, bodies, push = np.zeros(len(contacts), IMPACT), scene.bodies, impulse_of(contacts)
    motion, pull = np.dstack([states.velocity, states.spin]), np.append(scene.gravity, 0.0)
    now, last = motion[0], (0, 0.0)
    for k, (row, time) in enumerate(zip(rows.tolist(), within.tolist(), strict=True)):
        if row != last[0]:
            now, last = motion[row - 1].copy(), (row, 0.0)
        now += pull * (time - last[1])
        last = row, time
        for side, ball in enumerate(contacts[["first", "second"]][k]):
            if ball >= 0:
                impacts["before"][k, side] = now[ball]
                now[ball, :2] += (1 if side else -1) * push[k] / bodies.mass[ball]
                now[ball, 2] -= contacts["tangential"][k] * bodies.radius[ball] / bodies.moment[ball]
                impacts["after"][k, side] = now[ball]
    return impacts
