"""Engines in the place of others: with other numbers inside, or standing still after a failure."""
# ruff: noqa: D102 (the interface of an engine documents the methods)

from collections.abc import Callable
from typing import ParamSpec, TypeVar

import numpy as np

from sandbox.engines.engine import RunningEngine, advance, traits_of
from sandbox.errors import EngineError, LimitReached
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.state import Contacts, Floats, State, States, no_contacts

P = ParamSpec("P")
T = TypeVar("T")


class RenumberedEngine:
    """Runs a scene in an engine with its balls in reverse order; outside, they have the scene's numbers.

    build: builds the engine from a scene and a state. Wherever the engine does not depend on the numbers, it does the
    same to the bit.
    """

    def __init__(self, build: Callable[[Scene, State], RunningEngine], scene: Scene, initial: State) -> None:
        # A group's balls are all of one kind, so that groups in reverse order are balls in reverse order.
        reverse = scene.changed(balls=scene.balls[::-1], expect=())
        self._engine = build(reverse, _reversed(initial))
        self.traits = traits_of(self._engine)
        self._last = len(initial.position) - 1

    def step(self) -> None:
        self._engine.step()

    def state(self) -> State:
        return _reversed(self._engine.state())

    def advance(self, _: int, *states: Floats) -> None:
        advance(self._engine, States(*(each[:, ::-1] for each in states)))

    def record_contacts(self) -> None:
        self._engine.record_contacts()

    def contacts(self) -> Contacts:
        contacts = self._engine.contacts().copy()
        first, second = contacts["first"].copy(), contacts["second"].copy()
        between = second >= 0  # then the second ball has the lower number outside
        contacts["first"] = self._last - np.where(between, second, first)
        contacts["second"] = np.where(between, self._last - first, second)
        contacts["normal"][between] *= -1
        return contacts

    def kick(self, ball: int, dv: Vector) -> None:
        self._engine.kick(self._last - ball, dv)


class StoppingEngine:
    """Runs an engine until it raises EngineError. Then its balls stand still in the state that it had before.

    state: of the engine; error: why it stands still, None before, or a limit that it has reached.
    """

    def __init__(self, engine: RunningEngine, state: State, error: EngineError | LimitReached | None = None) -> None:
        self.traits = traits_of(engine)
        self.error = error
        self._engine = engine
        self._state = state

    def step(self) -> None:
        self._attempt(self._engine.step)
        self._read()

    def state(self) -> State:
        return self._state.copy()

    def record_contacts(self) -> None:
        self._attempt(self._engine.record_contacts)

    def contacts(self) -> Contacts:
        contacts = self._attempt(self._engine.contacts)
        return no_contacts() if contacts is None else contacts

    def kick(self, ball: int, dv: Vector) -> None:
        self._attempt(self._engine.kick, ball, dv)
        self._read()

    def _read(self) -> None:
        self._state = self._attempt(self._engine.state) or self._state

    def _attempt(self, method: Callable[P, T], *arguments: P.args, **keywords: P.kwargs) -> T | None:
        """Call a method of the engine, unless it stands still; return None then."""
        if self.error is None:
            try:
                return method(*arguments, **keywords)
            except EngineError as error:
                self.error = error
        return None


def _reversed(state: State) -> State:
    return State(state.time, *(getattr(state, name)[::-1].copy() for name in States._fields))
