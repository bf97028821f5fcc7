"""An engine built from one function: a user's own loop, without a class."""

from collections.abc import Callable

from sandbox.errors import SandboxError
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.state import Floats, State

StepFunction = Callable[[Floats, Floats, float, Scene], object]


class FunctionEngine:
    """Runs a scene by a function that does one step of dt s: it changes position and velocity, (n, 2), in place.

    It reports no contacts. Balls that turn keep their spins.
    """

    def __init__(self, function: StepFunction, scene: Scene, initial: State) -> None:
        self._function = function
        self._scene, self._clock = scene, scene.clock
        self._initial = initial
        self._position, self._velocity = initial.position.copy(), initial.velocity.copy()
        self._steps = 0

    def step(self) -> None:
        """Advance by one step. Raises SandboxError if the function returns something."""
        dt = float(1 / self._clock.rates(self._steps + 1))
        returned = self._function(self._position, self._velocity, dt, self._scene)
        if returned is not None:
            raise SandboxError(
                "it must change the arrays position and velocity in place and return nothing, "
                f"got {type(returned).__name__}"
            )
        self._steps += 1

    def state(self) -> State:
        """Return a snapshot."""
        time, spin = self._clock.time(self._steps), self._initial.spin
        angle = self._initial.angle + spin * time
        return State(time, self._position.copy(), self._velocity.copy(), angle, spin.copy())

    def kick(self, ball: int, dv: Vector) -> None:
        """Add dv (px/s) to a ball's velocity."""
        self._velocity[ball] += dv
