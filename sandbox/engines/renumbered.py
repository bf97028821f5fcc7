"""An engine whose balls have other numbers inside."""

from collections.abc import Callable

import numpy as np

from sandbox.engines.engine import Engine, advance, traits_of
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.state import Contacts, Floats, State, States


class RenumberedEngine:
    """Runs a scene in an engine with its balls in reverse order; outside, they have the scene's numbers.

    build: builds the engine from a scene and a state. Wherever the engine does not depend on the numbers, it does the
    same to the bit.
    """

    def __init__(self, build: Callable[[Scene, State], Engine], scene: Scene, initial: State) -> None:
        # A group's balls are all of one kind, so that groups in reverse order are balls in reverse order.
        reverse = scene.changed(balls=scene.balls[::-1], expect=())
        self._engine = build(reverse, _reversed(initial))
        self.traits = traits_of(self._engine)
        self._last = len(initial.position) - 1

    def step(self) -> None:
        """Advance by one step."""
        self._engine.step()

    def advance(self, steps: int, position: Floats, velocity: Floats, angle: Floats, spin: Floats) -> None:
        """Do some steps, and write the state after each: (steps, n, 2) px, px/s; (steps, n) rad, rad/s."""
        inside = States.empty(steps, self._last + 1)
        advance(self._engine, inside)
        for outside, part in zip((position, velocity, angle, spin), inside, strict=True):
            outside[:] = part[:, ::-1]

    def state(self) -> State:
        """Return a snapshot."""
        return _reversed(self._engine.state())

    def record_contacts(self) -> None:
        """Start to record contacts."""
        self._engine.record_contacts()

    def contacts(self) -> Contacts:
        """Return the contacts since the last call."""
        contacts = self._engine.contacts().copy()
        first, second = contacts["first"].copy(), contacts["second"].copy()
        between = second >= 0  # then the second ball has the lower number outside
        contacts["first"] = self._last - np.where(between, second, first)
        contacts["second"] = np.where(between, self._last - first, second)
        contacts["normal"][between] *= -1
        return contacts

    def kick(self, ball: int, dv: Vector) -> None:
        """Add dv (px/s) to a ball's velocity."""
        self._engine.kick(self._last - ball, dv)


def _reversed(state: State) -> State:
    return State(state.time, *(getattr(state, name)[::-1].copy() for name in States._fields))
