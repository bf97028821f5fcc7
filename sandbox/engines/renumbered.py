"""An engine whose balls have other numbers inside."""

import numpy as np

from sandbox.engines import advance, create
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.state import Contacts, Floats, State, States


class RenumberedEngine:
    """Runs a scene in the named engine with its balls in reverse order; outside, they have the scene's numbers.

    Wherever the engine does not depend on the numbers, it does the same to the bit.
    """

    def __init__(self, name: str, scene: Scene, initial: State) -> None:
        position, velocity = initial.position[::-1].copy(), initial.velocity[::-1].copy()
        # A group's balls are all of one kind, so that groups in reverse order are balls in reverse order.
        reverse = scene.changed(balls=scene.balls[::-1], expect=())
        self._engine = create(name, reverse, State(initial.time, position, velocity))
        self.together = getattr(self._engine, "together", False)
        self._last = len(position) - 1

    def step(self) -> None:
        """Advance by one step."""
        self._engine.step()

    def advance(self, steps: int, position: Floats, velocity: Floats) -> None:
        """Do some steps, and write the state after each: (steps, n, 2) px, px/s."""
        found = States.empty(steps, self._last + 1)
        advance(self._engine, steps, *found)
        position[:], velocity[:] = found.position[:, ::-1], found.velocity[:, ::-1]

    def state(self) -> State:
        """Return a snapshot."""
        state = self._engine.state()
        return State(state.time, state.position[::-1].copy(), state.velocity[::-1].copy())

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
