"""Engines that stop where they are when they fail or reach a limit, so that others beside them go on."""

from sandbox.engines.checked import CheckedEngine
from sandbox.engines.engine import Traits
from sandbox.errors import EngineError, LimitReached
from sandbox.scene.fields import Vector
from sandbox.state import Contacts, State, no_contacts


class StoppingEngine:
    """Runs an engine that is not built in. From when that fails, its balls stand still; error: why, None before."""

    def __init__(self, engine: CheckedEngine) -> None:
        self.traits = engine.traits
        self._engine = engine
        self._state = engine.state()
        self.error: EngineError | None = None

    def step(self) -> None:
        """Advance by one step."""
        if self.error is None:
            try:
                self._engine.step()
                self._state = self._engine.state()
            except EngineError as error:
                self.error = error

    def state(self) -> State:
        """Return a snapshot, the last one before the engine failed."""
        return self._state.copy()

    def record_contacts(self) -> None:
        """Start to record contacts."""
        if self.error is None:
            try:
                self._engine.record_contacts()
            except EngineError as error:
                self.error = error

    def contacts(self) -> Contacts:
        """Return the contacts since the last call, none once the engine has failed."""
        if self.error is None:
            try:
                return self._engine.contacts()
            except EngineError as error:
                self.error = error
        return no_contacts()

    def kick(self, ball: int, dv: Vector) -> None:
        """Add dv (px/s) to a ball's velocity."""
        if self.error is None:
            try:
                self._engine.kick(ball, dv)
                self._state = self._engine.state()
            except EngineError as error:
                self.error = error


class StoppedEngine:
    """Stands still in the last state of an engine that has reached a limit; error: which, and when."""

    def __init__(self, state: State, traits: Traits, error: LimitReached) -> None:
        self.traits = traits
        self._state = state
        self.error = error

    def step(self) -> None:
        """Do nothing."""

    def state(self) -> State:
        """Return a snapshot of where it stands."""
        return self._state.copy()

    def record_contacts(self) -> None:
        """Do nothing."""

    def contacts(self) -> Contacts:
        """Return no contacts."""
        return no_contacts()

    def kick(self, ball: int, dv: Vector) -> None:
        """Do nothing."""
