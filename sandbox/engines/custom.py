"""Engines of the user's own without a package: a class or a function in a file, such as `mine.py:Mine`."""

import hashlib
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any

from sandbox.engines.specs import file_and_name
from sandbox.errors import EngineError, SandboxError, suggestion, traceback_beyond
from sandbox.files import read_text
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.state import Floats, State
from sandbox.text import printable


def load_from_file(spec: str) -> Callable[..., Any]:
    """Return the class or function of a spec such as "mine.py:Mine".

    The file runs once, and once more if it has changed. Raises SandboxError if it cannot be read or has no such class
    or function, EngineError if it raises an exception.
    """
    named = file_and_name(spec)
    assert named
    file, name = named
    try:
        module = _module(file.resolve(), read_text(file))
    except (Exception, SystemExit) as error:
        if isinstance(error, SandboxError):
            raise
        what = f"cannot be loaded: {type(error).__name__}: {error}"
        raise EngineError(spec, what, details=traceback_beyond(error, __file__)) from error
    if not callable(engine := getattr(module, name, None)):
        known = [key for key, value in vars(module).items() if getattr(value, "__module__", "") == module.__name__]
        has = suggestion(name, known) if known else "it has no class and no function"
        raise SandboxError(f"{printable(str(file))}: has no class or function {name!r}; {has}")
    return engine


@cache
def _module(file: Path, text: str) -> ModuleType:
    """Run a file, and return it as a module; text: its content."""
    name = f"{file.stem}_{hashlib.sha256(str(file).encode()).hexdigest()[:8]}"  # no other module's
    spec = spec_from_file_location(name, file)
    assert spec
    module = module_from_spec(spec)
    sys.modules[name] = module  # where dataclasses look for it
    with _importing_from(str(file.parent)):
        exec(compile(text, file, "exec"), vars(module))
    return module


@contextmanager
def _importing_from(folder: str) -> Iterator[None]:
    """Let a file import others beside it, as if it were run by Python; installed packages come first."""
    sys.path.append(folder)
    try:
        yield
    finally:
        sys.path.remove(folder)


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
