"""Whether the contacts that an engine reports do what its balls did: its states are what it is judged by."""

from typing import Final, NamedTuple

import numpy as np

from sandbox.quantity import impulse_of, length
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.state import Contacts, Floats, Integers, States

ENOUGH: Final = 1e-3  # of a change of velocity, by which reports in single precision, of several substeps, may be off


class Misreport(NamedTuple):
    """A ball that reported contacts change otherwise than it changed.

    step: of the run, from 1; seen, reported: px/s by which it changed; steps: how many such steps the run has.
    """

    step: int
    ball: int
    seen: Vector
    reported: Vector
    steps: int = 1


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
    steps = np.flatnonzero(off.any(axis=1))
    balls = off[steps].argmax(axis=1)
    pairs = zip(seen[steps, balls].tolist(), reported[steps, balls].tolist(), strict=True)
    found = zip(steps.tolist(), balls.tolist(), pairs, strict=True)
    return [Misreport(step + 1, ball, (x, y), (u, v)) for step, ball, ((x, y), (u, v)) in found]
