"""The engines: what each must offer, and the one registry that finds them by name.

An engine is a class built from a scene and its initial state. A package outside adds one with an entry point
in the group `sandbox.engines`:

    [project.entry-points."sandbox.engines"]
    mine = "my_package:MyEngine"
"""

from collections.abc import Callable
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec
from typing import Final, Protocol, cast

import numpy as np

from sandbox.errors import Refused, SandboxError, nearest
from sandbox.scene.model import ARENA_WALLS, Scene, Vector
from sandbox.state import CONTACT, Contacts, Floats, State

GROUP: Final = "sandbox.engines"
_BUILT_IN: Final = {
    name: EntryPoint(name, f"sandbox.engines.{name}:{engine}", GROUP)
    for name, engine in (
        ("pymunk", "PymunkEngine"),
        ("article", "ArticleEngine"),
        ("impulse", "ImpulseEngine"),
        ("exact", "ExactEngine"),
    )
}
_EXTRAS: Final = {"box2d": "pyb2d3"}  # engine, and extra of the same name -> the library that comes with it
COUNTERPARTS: Final = ("article", "impulse")  # what Pymunk is compared with where nothing is named: the first that can


class Engine(Protocol):
    """One solver running one scene. The same scene and the same kicks give the same bytes, in any process.

    A solver that resolves all contacts of one time together, not one after another, says so by `together = True` on
    its class: the ledger then asks of each contact what is right at the end of them all.

    One that refuses scenes may have a static method `check(scene)` too, which raises Refused: then it need not be built
    to find out, which takes a second where balls are many.
    """

    def step(self) -> None:
        """Advance by one step of 1/rate seconds."""

    def state(self) -> State:
        """Return a snapshot, which later steps leave alone."""

    def contacts(self) -> Contacts:
        """Return the contacts resolved since the last call, in order of time and, of one time, as they were resolved.

        The first call returns none and begins the collecting, so that who never asks pays nothing.
        """

    def kick(self, ball: int, dv: Vector) -> None:
        """Add dv (px/s) to a ball's velocity."""


def registry() -> dict[str, EntryPoint]:
    """Find every engine that can run here: the built-in ones first, then those of installed packages."""
    installed = {entry.name: entry for entry in entry_points(group=GROUP) if not _lacks_library(entry.name)}
    return _BUILT_IN | {name: installed[name] for name in sorted(installed) if name not in _BUILT_IN}


def _lacks_library(engine: str) -> bool:
    return engine in _EXTRAS and find_spec(_EXTRAS[engine]) is None


def _engine(name: str) -> "Callable[[Scene, State], Engine]":
    engines = _BUILT_IN if name in _BUILT_IN else registry()  # which takes 6 ms, and every edit builds engines anew
    if _lacks_library(name):
        raise SandboxError(f'{name}: needs {_EXTRAS[name]}, which is not installed; pip install -e ".[{name}]"')
    if name not in engines:
        raise SandboxError(f"no engine {name!r}; {nearest(name, engines)}")
    try:
        return cast("Callable[[Scene, State], Engine]", engines[name].load())
    except (ImportError, AttributeError) as error:
        raise SandboxError(f"{name}: {engines[name].value} cannot be loaded: {error}") from error


class _Guest:
    """An engine of another package, held to what it must offer: where it does not, that is told before it is believed.

    A figure of NaN is within every limit, and a snapshot that moves on is never apart from the engine.
    """

    def __init__(self, name: str, engine: Engine, scene: Scene) -> None:
        self.together = getattr(engine, "together", False)
        self.step = engine.step
        self.kick = engine.kick
        self._name = name
        self._engine = engine
        self._balls = len(scene.bodies)
        self._walls = len(ARENA_WALLS) + len(scene.walls)

    def state(self) -> State:
        state = self._engine.state()
        position, velocity = self._numbers("position", state.position), self._numbers("velocity", state.velocity)
        return State(state.time, position, velocity)

    def contacts(self) -> Contacts:
        contacts = self._engine.contacts()
        if not isinstance(contacts, np.ndarray) or contacts.dtype != CONTACT or contacts.ndim != 1:
            raise SandboxError(
                f"{self._name}: its contacts must be an array of sandbox.state.CONTACT, got {contacts!r:.40}"
            )
        first, second = contacts["first"], contacts["second"]
        if not np.all((first >= 0) & (first < self._balls) & (second >= -self._walls) & (second < self._balls)):
            raise SandboxError(f"{self._name}: its contacts must be of the {self._balls} balls and {self._walls} walls")
        numbers = (contacts[key] for key in ("time", "normal", "impulse", "depth"))
        if not all(np.isfinite(each).all() for each in numbers):
            raise SandboxError(f"{self._name}: its contacts must be of finite numbers")
        return contacts.copy()

    def _numbers(self, what: str, values: Floats) -> Floats:
        numbers = np.array(values, dtype=np.float64)
        if numbers.shape != (self._balls, 2):
            raise SandboxError(f"{self._name}: its {what} must be of shape {(self._balls, 2)}, got {numbers.shape}")
        if not np.isfinite(numbers).all():
            ball = int(np.argmin(np.isfinite(numbers).all(axis=1)))
            raise SandboxError(f"{self._name}: the {what} of ball {ball} must be finite, got {numbers[ball].tolist()}")
        return numbers


def create(name: str, scene: Scene, initial: State) -> Engine:
    """Build the named engine. Raises SandboxError for a name that is none, Refused for a scene it cannot honour.

    An engine of another package raises SandboxError too where what it gives is not what it must be.
    """
    engine = _engine(name)
    if name in _BUILT_IN:
        return engine(scene, initial)
    own = State(initial.time, initial.position.copy(), initial.velocity.copy())  # others begin with the same
    return _Guest(name, engine(scene, own), scene)


def takes(name: str, scene: Scene, initial: State) -> bool:
    """Tell whether the named engine can honour a scene: its `check` says so, and where it has none, building it."""
    engine = _engine(name)
    try:
        check = getattr(engine, "check", None)
        engine(scene, initial) if check is None else check(scene)
    except Refused:
        return False
    return True


def default_engines(scene: Scene, initial: State) -> list[str]:
    """Name the engines to run where the user names none: Pymunk, and the reference that can honour the scene."""
    return ["pymunk", *[name for name in COUNTERPARTS if takes(name, scene, initial)][:1]]
