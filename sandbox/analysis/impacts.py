"""What the contacts that an engine reports do: the motion before and after each, and whether the balls moved like that.

The states are what an engine is judged by; what it reports is only compared with them.
"""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.quantity import impulse_of, length
from sandbox.scene.model import Scene
from sandbox.state import Contacts, Floats, Integers, States

MAX_IMPACTS: Final = 500  # contacts of which a run keeps the motion before and after
IMPACT: Final = np.dtype([("before", "f8", (2, 3)), ("after", "f8", (2, 3))])  # px/s twice, and rad/s; zeros of a wall
ENOUGH: Final = 1e-3  # of a change of velocity, by which reports in single precision, of several substeps, may be off
Impacts = NDArray[np.void]


class Misreport(NamedTuple):
    """A ball that reported contacts change otherwise than it changed. step: of the run, from 1."""

    step: int
    ball: int


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


def misreports(
    scene: Scene, pushed: States, states: States, contacts: Contacts, rows: Integers, dt: Floats
) -> list[Misreport]:
    """Return the first misreport of each step.

    states: of steps + 1 rows; pushed: these after the pushes with which the next step begins; rows: (k,) that each
    contact's step leads to; dt: (steps,) s.
    """
    mass, push = scene.bodies.mass, impulse_of(contacts)
    fallen = pushed.velocity[:-1] + np.multiply.outer(dt, scene.gravity)[:, None]
    seen, reported = states.velocity[1:] - fallen, np.zeros_like(fallen)
    for ball, sign in ((contacts["first"], -1), (contacts["second"], 1)):
        is_ball = ball >= 0
        given = sign * push[is_ball] / mass[ball[is_ball], None]
        np.add.at(reported, (rows[is_ball] - 1, ball[is_ball]), given)
    fastest = float(max(length(fallen).max(initial=0.0), length(states.velocity).max()))
    off = length(seen - reported) > ENOUGH * np.maximum(length(seen), length(reported)) + ENOUGH**2 * fastest
    off &= (states.velocity[1:] != pushed.velocity[:-1]).any(axis=2)  # what rests need report nothing
    return [Misreport(step + 1, int(off[step].argmax())) for step in np.flatnonzero(off.any(axis=1)).tolist()]
