"""An engine that stops where it is when it fails, so that others beside it go on."""

from sandbox.engines.checked import CheckedEngine
from sandbox.errors import EngineError
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
