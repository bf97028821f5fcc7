"""The engines: the interface of an engine, and the registry that finds engines by name.

An engine is a class built from a scene and its initial state. Another package adds one with an entry point in the
group `sandbox.engines`:

    [project.entry-points."sandbox.engines"]
    mine = "my_package:MyEngine"

Where an engine is named, Pymunk may have other settings than the scene's: `pymunk(substeps=16, iterations=200)`.
"""

from collections.abc import Callable, Mapping
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec
from inspect import signature
from typing import Final, Protocol, cast

import numpy as np

from sandbox.errors import Refused, SandboxError, suggestion
from sandbox.scene.fields import Vector
from sandbox.scene.model import ARENA_WALLS, Scene
from sandbox.state import CONTACT, Contacts, Floats, State, States

ENTRY_POINTS: Final = "sandbox.engines"
_BUILT_IN: Final = {
    name: EntryPoint(name, f"sandbox.engines.{name}:{engine}", ENTRY_POINTS)
    for name, engine in (
        ("pymunk", "PymunkEngine"),
        ("article", "ArticleEngine"),
        ("impulse", "ImpulseEngine"),
        ("exact", "ExactEngine"),
    )
}
_EXTRAS: Final = {"box2d": "pyb2d3"}  # engine, which is an extra of the same name -> the library that it needs
TUNED: Final = "pymunk"  # the engine that a scene has settings for
EXAMPLE: Final = f"{TUNED}(substeps=4, iterations=30)"  # of an engine with settings, in messages
TEXTBOOK_ENGINES: Final = ("article", "impulse")  # the first that can run the scene is compared with Pymunk by default


class Engine(Protocol):
    """One solver running one scene. The same scene and kicks give the same bytes, in any process on one machine.

    A solver that resolves all contacts of one time together, not one after another, sets `together = True` on its
    class: the ledger then judges each contact by the velocities after all of them.

    A solver that reports no impulses, so that those of its contacts are inferred from the changes of velocity, sets
    `infers_impulses = True`: they are then no evidence of where its momentum went.

    A solver that limits friction by the impulse without restitution sets `clamps_friction_early = True`: the sentence
    on a contact with just that much friction says why it is too little.

    An engine that refuses scenes may have a static method `check(scene)` that raises Refused. It saves building the
    engine to find out, which takes a second for many balls.
    """

    def step(self) -> None:
        """Advance by one step of 1/rate seconds."""

    def state(self) -> State:
        """Return a snapshot, which later steps do not change."""

    def contacts(self) -> Contacts:
        """Return the contacts resolved since the last call, by time; at equal times, in the order they were resolved.

        The first call returns none and starts recording; a run whose contacts are never read does not pay for them.
        """

    def kick(self, ball: int, dv: Vector) -> None:
        """Add dv (px/s) to a ball's velocity."""


class BlockEngine(Engine, Protocol):
    """An engine that can also do many steps in one call, which saves the time to return each state."""

    def advance(self, steps: int, position: Floats, velocity: Floats, angle: Floats, spin: Floats) -> None:
        """Do some steps, and write the state after each into the rows of arrays.

        position, velocity: (steps, n, 2) px, px/s; angle, spin: (steps, n) rad, rad/s, zeros until then. States and
        contacts are to the byte those of as many calls of `step`, `state` and `contacts`.
        """


def advance(engine: Engine, states: States) -> None:
    """Do as many steps as there are rows, and write the state after each into them, in any engine."""
    steps = len(states.position)
    if hasattr(engine, "advance"):
        cast("BlockEngine", engine).advance(steps, *states)
        return
    for step in range(steps):
        engine.step()
        states.fill(step, engine.state())


def registry() -> dict[str, EntryPoint]:
    """Return every engine whose library is installed: the built-in ones, then those from entry points by name."""
    installed = {entry.name: entry for entry in entry_points(group=ENTRY_POINTS) if not _lacks_library(entry.name)}
    return _BUILT_IN | {name: installed[name] for name in sorted(installed) if name not in _BUILT_IN}


def _lacks_library(engine: str) -> bool:
    return engine in _EXTRAS and find_spec(_EXTRAS[engine]) is None


def settings_in(name: str) -> tuple[str, dict[str, float]]:
    """Return an engine's name without its settings, and these. Raises SandboxError if they cannot be read.

    >>> settings_in("pymunk(substeps=4, collision_bias=0.5)")
    ('pymunk', {'substeps': 4, 'collision_bias': 0.5})
    """
    base, bracket, rest = name.partition("(")
    if not bracket:
        return name, {}
    if not base:
        raise SandboxError(f"{name}: must begin with the engine's name, as in {TUNED}{name}")
    if base != base.rstrip():
        raise SandboxError(f"{name}: must have no space before the bracket, as in {base.rstrip()}({rest}")
    if base != TUNED:
        raise SandboxError(f"{name}: {base} takes no settings; only {TUNED} does")
    if not rest.endswith(")"):
        raise SandboxError(f"{name}: must end with a bracket, as in {EXAMPLE}")
    values: dict[str, float] = {}
    for pair in rest[:-1].split(","):
        key, _, text = (part.strip() for part in pair.partition("="))
        if key in values:
            raise SandboxError(f"{name}: has {key} twice")
        try:
            value = float(text)
        except ValueError:
            raise SandboxError(f"{name}: {pair.strip()!r} must be a setting and its number, as in {EXAMPLE}") from None
        values[key] = int(value) if value.is_integer() else value
    return base, values


def with_settings(name: str, settings: Mapping[str, float]) -> str:
    """Return the name of an engine with settings, which `settings_in` reads.

    >>> with_settings("pymunk", {"substeps": 4, "collision_bias": 0.5})
    'pymunk(substeps=4, collision_bias=0.5)'
    """
    return f"{name}({', '.join(f'{key}={value}' for key, value in settings.items())})" if settings else name


def _with_settings(name: str, scene: Scene) -> tuple[str, Scene]:
    """Return an engine's name without its settings, and the scene with them. Raises SandboxError if one is wrong."""
    base, settings = settings_in(name)
    if not settings:
        return base, scene
    known = type(scene.pymunk).model_fields
    for key in settings:
        if key not in known:
            raise SandboxError(f"{name}: {key} is not a setting of {TUNED}; {suggestion(key, known)}")
    try:
        return base, scene.changed(pymunk=scene.pymunk.model_dump(exclude_unset=True) | settings)
    except SandboxError as error:
        raise SandboxError(f"{name}: {error}") from error


def check_name(name: str) -> None:
    """Raise SandboxError if there is no engine of this name, or its library is not installed."""
    base, _ = settings_in(name)
    if base in _BUILT_IN:
        return
    if _lacks_library(base):
        raise SandboxError(f'{base}: needs {_EXTRAS[base]}, which is not installed; pip install -e ".[{base}]"')
    if base not in (engines := registry()):
        raise SandboxError(f"no engine {base!r}; {suggestion(base, engines)}")


def _engine(name: str) -> "Callable[[Scene, State], Engine]":
    check_name(name)
    engines = _BUILT_IN if name in _BUILT_IN else registry()  # registry() takes 6 ms, and edits rebuild every engine
    try:
        return cast("Callable[[Scene, State], Engine]", engines[name].load())
    except (ImportError, AttributeError) as error:
        raise SandboxError(f"{name}: {engines[name].value} cannot be loaded: {error}") from error


class _CheckedEngine:
    """An engine from an entry point, whose states and contacts are checked and copied before they are used.

    A NaN exceeds no limit, and a state that shares the engine's arrays would change with later steps.
    """

    def __init__(self, name: str, engine: Engine, scene: Scene) -> None:
        self.together = getattr(engine, "together", False)
        self.infers_impulses = getattr(engine, "infers_impulses", False)
        self.clamps_friction_early = getattr(engine, "clamps_friction_early", False)
        self.kick = engine.kick
        self._name = name
        self._engine = engine
        self._balls = len(scene.bodies)
        self._walls = len(ARENA_WALLS) + len(scene.walls)
        self._rate = scene.rate
        self._steps = 0
        # Of steps since contacts were last read, by the engine's clock and by ours, s; None until they are.
        self._ends: dict[float, float] | None = None

    def step(self) -> None:
        self._engine.step()
        self._steps += 1

    def state(self) -> State:
        state = self._engine.state()
        if self._ends is not None:
            self._ends[float(state.time)] = self._steps / self._rate
        checked = {what: np.array(getattr(state, what), dtype=np.float64) for what in States._fields}
        for what, numbers in checked.items():
            shape = (self._balls, 2)[: 2 if what in ("position", "velocity") else 1]
            if numbers.shape != shape:
                raise SandboxError(f"{self._name}: its {what} must be of shape {shape}, got {numbers.shape}")
            self._check_finite(what, numbers[None])
        return State(state.time, **checked)

    def contacts(self) -> Contacts:
        contacts = self._engine.contacts()
        if not isinstance(contacts, np.ndarray) or contacts.dtype != CONTACT or contacts.ndim != 1:
            raise SandboxError(
                f"{self._name}: its contacts must be an array of sandbox.state.CONTACT, got {contacts!r:.40}"
            )
        first, second = contacts["first"], contacts["second"]
        if not np.all((first >= 0) & (first < self._balls) & (second >= -self._walls) & (second < self._balls)):
            raise SandboxError(f"{self._name}: its contacts must name the {self._balls} balls and {self._walls} walls")
        numbers = (contacts[key] for key in ("time", "normal", "impulse", "depth", "tangential", "slip"))
        if not all(np.isfinite(each).all() for each in numbers):
            raise SandboxError(f"{self._name}: its contacts must have finite numbers")
        contacts, self._ends = _in_order(contacts, self._ends or {}), {}
        return contacts

    def _check_finite(self, what: str, numbers: Floats) -> None:
        """Raise SandboxError for the first ball that has a number which is not finite. numbers: (steps, n, ...)."""
        finite = np.isfinite(numbers).reshape(*numbers.shape[:2], -1).all(axis=2)
        if not finite.all():
            step, ball = np.argwhere(~finite)[0].tolist()
            values = numbers[step, ball].tolist()
            raise SandboxError(f"{self._name}: the {what} of ball {ball} must be finite, got {values}")


class _CheckedBlockEngine(_CheckedEngine):
    """A checked engine that can do many steps in one call."""

    def advance(self, steps: int, position: Floats, velocity: Floats, angle: Floats, spin: Floats) -> None:
        theirs = States.empty(steps, self._balls)
        theirs.position[:] = theirs.velocity[:] = np.nan  # so that a state left out is not finite
        engine = cast("BlockEngine", self._engine)
        engine.advance(steps, *theirs[: len(signature(engine.advance).parameters) - 1])  # angle and spin are optional
        self._steps += steps
        for what, ours, numbers in zip(States._fields, (position, velocity, angle, spin), theirs, strict=True):
            ours[:] = numbers
            self._check_finite(what, numbers)


def _in_order(contacts: Contacts, ends: Mapping[float, float]) -> Contacts:
    """Return a copy of contacts, each with the lower ball first, and with our time if it was at the end of a step.

    ends: of steps, by the engine's clock, which may round otherwise than ours, and by ours, s.
    """
    contacts = contacts.copy()
    contacts["time"] = [ends.get(time, time) for time in contacts["time"].tolist()]
    turned = contacts["second"] >= 0
    turned &= contacts["first"] > contacts["second"]
    contacts["first"][turned], contacts["second"][turned] = contacts["second"][turned], contacts["first"][turned]
    contacts["normal"][turned] *= -1
    return contacts


def create(name: str, scene: Scene, initial: State) -> Engine:
    """Build the named engine. Raises SandboxError if the name is unknown, Refused if the engine cannot run the scene.

    An engine from an entry point also raises SandboxError when its states or contacts are not valid.
    """
    name, scene = _with_settings(name, scene)
    engine = _engine(name)
    if name in _BUILT_IN:
        return engine(scene, initial)
    built = engine(scene, initial.copy())  # other engines start from initial
    checked = _CheckedBlockEngine if _has_own_advance(type(built)) else _CheckedEngine
    return checked(name, built, scene)


def _has_own_advance(engine: type) -> bool:
    """Return whether an engine has `advance`, and does not replace `step` or `state` of the class that it is from."""
    return hasattr(engine, "advance") and all(
        issubclass(_owner(engine, "advance"), _owner(engine, method)) for method in ("step", "state")
    )


def _owner(engine: type, method: str) -> type:
    """Return the class that an engine has a method from; `object` if only its instances have it."""
    return next((one for one in engine.__mro__ if method in vars(one)), object)


def can_run(name: str, *scenes: Scene) -> bool:
    """Return whether the named engine can run all scenes: by its `check` or, if it has none, by building it."""
    from sandbox.scene.spawn import spawn  # noqa: PLC0415 (it imports numba, and listing engines must not wait for that)

    base, _ = settings_in(name)
    check = getattr(_engine(base), "check", None)
    try:
        for scene in scenes:
            if check:
                check(scene)
            else:
                create(name, scene, spawn(scene))
    except Refused:
        return False
    return True


def refusal(name: str, scene: Scene) -> str:
    """Return why the named engine's `check` refuses a scene; nothing if it accepts the scene, or has no `check`."""
    base, _ = settings_in(name)
    check = getattr(_engine(base), "check", None)
    try:
        if check:
            check(scene)
    except Refused as refused:
        return str(refused)
    return ""


def default_engines(*scenes: Scene) -> list[str]:
    """Return the engines to run by default: Pymunk, and the first textbook engine that can run all scenes."""
    return ["pymunk", *[name for name in TEXTBOOK_ENGINES if can_run(name, *scenes)][:1]]
