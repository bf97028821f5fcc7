"""Whether the contacts that an engine reports do what its balls did: its states are what it is judged by."""

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from sandbox.judge.step_errors import StepError
from sandbox.quantity import impulse_of, length
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.state import Contacts, Floats, Integers, States

ENOUGH: Final = 1e-3  # of a change of velocity, by which reports in single precision, of several substeps, may be off
MOST: Final = 100_000  # balls times steps that are kept


class Misreport(NamedTuple):
    """What an engine reports otherwise than its balls did.

    steps: how many; step: the first, of the run, from 1; ball: in it; seen, reported: px/s by which it changed.
    """

    steps: int
    step: int
    ball: int
    seen: Vector
    reported: Vector


class Reports:
    """Compares reported contacts with states, block by block."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._off: list[tuple[int, int, Vector, Vector]] = []  # step, ball, seen, reported

    def add(self, states: States, pushed: States, contacts: Contacts, rows: Integers, dt: Floats, done: int) -> None:
        """Add a block. states: of steps + 1 rows; pushed: these after the pushes with which the next step begins.

        rows: (k,) that each contact's step leads to; dt: s; done: steps before the block.
        """
        fallen = pushed.velocity[:-1] + np.multiply.outer(dt, self._scene.gravity)[:, None]
        seen = states.velocity[1:] - fallen
        reported = self._reported(contacts, rows, seen.shape)
        size = np.maximum(length(seen), length(reported))
        fastest = max(float(length(fallen).max()), float(length(states.velocity).max()))
        off = length(seen - reported) > ENOUGH * size + ENOUGH**2 * fastest
        off &= (states.velocity[1:] != pushed.velocity[:-1]).any(axis=2)  # what rests need report nothing
        for row, ball in np.argwhere(off)[: MOST - len(self._off)].tolist():
            (x, y), (u, v) = seen[row, ball].tolist(), reported[row, ball].tolist()
            self._off.append((done + row + 1, ball, (x, y), (u, v)))

    def _reported(self, contacts: Contacts, rows: Integers, shape: tuple[int, ...]) -> Floats:
        """Return by how much the contacts change velocities: (steps, n, 2) px/s."""
        changes, mass, push = np.zeros(shape), self._scene.bodies.mass, impulse_of(contacts)
        for name, sign in (("first", -1), ("second", 1)):
            ball = contacts[name]
            with_ball = ball >= 0
            given = sign * push[with_ball] / mass[ball[with_ball], None]
            np.add.at(changes, (rows[with_ball] - 1, ball[with_ball]), given)
        return changes

    def found(self, errors: Sequence[StepError]) -> Misreport | None:
        """Return what is reported otherwise than it was. errors: of steps; those in flight need no contact."""
        in_flight = {(error.step, ball) for error in errors if not error.contact for ball in error.balls}
        off = [each for each in self._off if each[:2] not in in_flight]
        return Misreport(len({step for step, *_ in off}), *off[0]) if off else None
