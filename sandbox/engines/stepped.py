"""Base of the engines that advance all balls by steps of a kernel."""
# ruff: noqa: D102 (the interface of an engine documents the methods)

from typing import Any, Final

import numpy as np

from sandbox.compiled import Function, as_python, columns, compiled, write_back
from sandbox.engines.contact_log import ContactLog, empty_log
from sandbox.engines.engine import RunningEngine
from sandbox.engines.machine_code import MachineCode
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.state import Bodies, Contacts, Floats, State, States
from sandbox.threads import checkpoint

LOG_ROWS: Final = 64  # of a new engine's log
_MOVING: Final = ("x", "y", "vx", "vy", "angle", "spin")  # px, px in the engine's unit of time, rad
_OF_BODY: Final = ("radius", "mass", "elasticity", "friction")
_IN_GRID: Final = ("cell", "next")  # its cell, and another ball there, or NONE
BALL: Final = np.dtype([(name, "f8") for name in (*_MOVING, *_OF_BODY)] + [(name, "i4") for name in _IN_GRID])


def balls_of(bodies: Bodies) -> Any:
    """Return an array of balls (n,) that are nowhere yet."""
    ball = np.zeros(len(bodies), BALL).view(np.recarray)
    for name in _OF_BODY:
        ball[name] = getattr(bodies, name)
    return ball


class SteppedEngine(RunningEngine):
    """An engine whose steps are calls of a kernel step(world, now, log). now: s, at the end of the step.

    world: a named tuple of arrays, of which `ball` has the type BALL; code: decides about machine code; unit: the
    kernel's unit of velocity, px/s; impulse_unit: its unit of impulse, kg px/s.
    """

    def __init__(
        self,
        scene: Scene,
        initial: State,
        world: Any,
        step: Function,
        code: MachineCode,
        *,
        unit: float = 1.0,
        impulse_unit: float = 1.0,
    ) -> None:
        self._unit = unit
        self._impulse_unit = impulse_unit
        self._rate = scene.rate
        self._steps = 0
        self._log = empty_log(LOG_ROWS)
        self._contacts = ContactLog()
        self._arrays, self._world, self._kernel, self._code = world, as_python(world), step, code
        self._runs_python = True
        self._work = len(world.ball)  # of a step
        self._put(np.stack([*initial.position.T, *initial.velocity.T / unit, initial.angle, initial.spin]))
        self._change_over(work=0)

    def _change_over(self, work: int) -> None:
        """Change over to machine code, if that is due after more work: balls, in each step."""
        if self._runs_python and self._code.is_due(work, len(self._world.ball)):
            write_back(self._world, self._arrays)
            self._world, self._kernel, self._runs_python = self._arrays, compiled(self._kernel), False

    def step(self) -> None:
        checkpoint()
        before = columns(self._world.ball, *_MOVING)
        while (rows := self._run_kernel()) > len(self._log.row):
            self._put(before)
            self._log = empty_log(2 * rows)
        self._steps += 1
        if rows:
            contacts = self._log.row[:rows].copy()
            contacts["impulse"] *= self._impulse_unit  # engines with a unit of their own have no friction
            self._contacts.add(contacts)
        self._change_over(self._work)

    def _run_kernel(self) -> int:
        """Take a step, and return how many rows it has for the log, which are more than the log may have."""
        log = self._log._replace(collects=self._contacts.recording)
        log.filled[0] = 0
        self._kernel(self._world, (self._steps + 1) / self._rate, log)
        return int(log.filled[0])

    def _put(self, moving: Floats) -> None:
        """Set _MOVING of all balls: (6, n)."""
        for name, values in zip(_MOVING, moving.tolist(), strict=True):
            for ball, value in zip(self._world.ball, values, strict=True):
                setattr(ball, name, value)

    def advance(self, steps: int, *states: Floats) -> None:
        moving = np.empty((steps, len(_MOVING), len(self._world.ball)))
        for row in moving:
            self.step()
            row[:] = columns(self._world.ball, *_MOVING)
        for part, values in zip(states, self._parts(moving), strict=True):
            part[:] = values

    def state(self) -> State:
        return State(self._steps / self._rate, *self._parts(columns(self._world.ball, *_MOVING)))

    def _parts(self, moving: Floats) -> States:
        """Return _MOVING, (..., 6, n), as the parts of states."""
        x, y, vx, vy, angle, spin = np.moveaxis(moving, -2, 0)
        return States(np.stack([x, y], axis=-1), np.stack([vx, vy], axis=-1) * self._unit, angle, spin)

    def record_contacts(self) -> None:
        self._contacts.recording = True

    def contacts(self) -> Contacts:
        return self._contacts.take()

    def kick(self, ball: int, dv: Vector) -> None:
        x, y = np.divide(dv, self._unit).tolist()
        self._world.ball[ball].vx += x
        self._world.ball[ball].vy += y
