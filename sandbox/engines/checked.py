"""Engines that are not built in: each call is checked against the contract of docs/engines.md."""
# ruff: noqa: D102 (the interface of an engine documents the methods)

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import fields, replace
from inspect import Signature, signature
from typing import Any, Final

import numpy as np

from sandbox.engines.engine import RunningEngine, Traits, traits_of
from sandbox.errors import EngineError, Refused, SandboxError, shown, traceback_beyond
from sandbox.quantity import length
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.state import CONTACT, Contacts, Floats, State, States, no_contacts

Factory = Callable[..., Any]  # a class or function of (scene, initial), or a function of one step
StepFunction = Callable[[Floats, Floats, float, Scene], object]

ROUNDING: Final = 1e-3  # of a step, a radius, a speed or a unit vector: more than an engine in float32 is off
MAX_CLOCK_ERROR: Final = 0.5  # of a step, of an engine's own clock
REQUIRED: Final = ("step", "state")  # methods; contacts and kick are optional
STEP: Final = "step(position, velocity, dt, scene)"
FACTORY: Final = f"an engine is a class or a function of (scene, initial), or a function {STEP}"


def build(name: str, factory: Factory, scene: Scene, initial: State) -> RunningEngine:
    """Build an engine that is not built in.

    Its scene has arrays that cannot be written to; the initial state is its own, and begins at 0 s. Raises EngineError
    if the engine breaks the contract, here and whenever it is used, Refused if it cannot run the scene.
    """
    arguments = _with_read_only_arrays(scene), replace(initial.copy(), time=0.0)
    with _errors_of(name, initial.time):
        engine = FunctionEngine(factory, *arguments) if _is_step(name, factory) else factory(*arguments)
    for method in REQUIRED:
        if not callable(getattr(engine, method, None)):
            raise EngineError(name, f"has no method {method}; {FACTORY}")
    if not isinstance(traits := getattr(engine, "traits", Traits()), Traits):
        raise EngineError(name, f"its traits must be sandbox.Traits(...), got {_short(traits)}")
    return CheckedEngine(name, engine, scene, initial)


def _is_step(name: str, factory: Factory) -> bool:
    """Return whether a factory is a function of one step. Raises EngineError if its arguments fit no factory."""
    try:
        parameters = signature(factory)
    except ValueError:  # of some functions in C
        return False
    if _accepts(parameters, 2):
        return False
    if isinstance(factory, type) or not _accepts(parameters, 4):
        raise EngineError(name, f"its arguments are {parameters}; {FACTORY}")
    return True


def _accepts(parameters: Signature, count: int) -> bool:
    try:
        parameters.bind(*range(count))
    except TypeError:
        return False
    return True


def _with_read_only_arrays(scene: Scene) -> Scene:
    copy = scene.changed()
    for field in fields(copy.bodies):
        getattr(copy.bodies, field.name).setflags(write=False)
    return copy


@contextmanager
def _errors_of(name: str, time: float) -> Iterator[None]:
    """Raise what an engine raises as an EngineError with its traceback. time: s."""
    try:
        yield
    except (EngineError, Refused):
        raise
    except SandboxError as error:
        raise EngineError(name, str(error), time) from error
    except (Exception, SystemExit) as error:
        what = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
        details = traceback_beyond(error, __file__)
        raise EngineError(name, f"raised {what}", time, details) from error


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
        time, spin = self._clock.time(self._steps), self._initial.spin
        angle = self._initial.angle + spin * time
        return State(time, self._position.copy(), self._velocity.copy(), angle, spin.copy())

    def kick(self, ball: int, dv: Vector) -> None:
        self._velocity[ball] += dv


class CheckedEngine:
    """An engine that is not built in. Its states and contacts are checked, and copied, before they are used.

    A NaN exceeds no limit, and a state that shares the engine's arrays would change with later steps. The time of a
    state is ours.
    """

    def __init__(self, name: str, engine: Any, scene: Scene, initial: State) -> None:
        self.traits = traits_of(engine)
        self._name = name
        self._engine = engine
        self._balls = len(scene.bodies)
        self._walls = ~np.array(scene.wall_numbers, np.int64)  # as contacts have them
        self._clock = scene.clock
        self._start = initial.time  # s, of the run, when this engine takes over
        self._steps = 0
        self._read = 0.0  # s, when contacts were last read
        self._check_initial(self.state(), initial, scene)

    def step(self) -> None:
        self._steps += 1
        with self._errors():
            self._engine.step()

    def state(self) -> State:
        """Return a snapshot. Raises EngineError if the engine's is not valid."""
        with self._errors():
            state = self._engine.state()
        if not isinstance(state, State):
            raise self._error(f"its state must be a sandbox.State, got {_short(state)}")
        return State(self._time, *(self._numbers(what, getattr(state, what)) for what in States._fields))

    def record_contacts(self) -> None:
        """Start to record contacts; an engine that has no such method may start when they are first read."""
        if not self.traits.reports_contacts:
            return
        if callable(getattr(self._engine, "record_contacts", None)):
            with self._errors():
                self._engine.record_contacts()
            self._read = self._time
        else:
            self.contacts()

    def contacts(self) -> Contacts:
        """Return the contacts since the last call. Raises EngineError if one is not valid."""
        if not self.traits.reports_contacts:
            return no_contacts()
        with self._errors():
            contacts = self._engine.contacts()
        if not isinstance(contacts, np.ndarray) or contacts.dtype != CONTACT or contacts.ndim != 1:
            raise self._error(f"its contacts must be an array of sandbox.state.CONTACT, got {_short(contacts)}")
        self._check_contacts(contacts)
        self._read = self._time
        return self._in_order(contacts)

    def kick(self, ball: int, dv: Vector) -> None:
        """Add dv (px/s) to a ball's velocity; only if the engine can be dragged."""
        with self._errors():
            self._engine.kick(ball, dv)

    @property
    def _time(self) -> float:
        """The time since the engine was built, s."""
        return self._clock.time(self._steps)

    @property
    def _step(self) -> float:
        """The length of the last step, s."""
        return float(1 / self._clock.rates(self._steps))

    def _error(self, what: str) -> EngineError:
        return EngineError(self._name, what, self._start + self._time)

    def _errors(self) -> AbstractContextManager[None]:
        return _errors_of(self._name, self._start + self._time)

    def _check_initial(self, state: State, initial: State, scene: Scene) -> None:
        """Raise EngineError unless the engine starts with the state that it was given."""
        limits = (
            ("position", scene.bodies.radius),
            ("velocity", length(initial.velocity).max()),
            ("spin", np.abs(initial.spin).max()),
        )
        for what, limit in limits:
            actual, expected = getattr(state, what), getattr(initial, what)
            rounding = np.finfo(np.float32).eps * np.abs(expected)
            error = (np.abs(actual - expected) - rounding).reshape(self._balls, -1).max(axis=1)
            if (wrong := error > ROUNDING * limit).any():
                ball = int(wrong.argmax())
                values = f"{shown(expected[ball].tolist())}, got {shown(actual[ball].tolist())}"
                raise self._error(f"must start with the state it is built from: {what} {values} of ball {ball}")

    def _numbers(self, what: str, numbers: object) -> Floats:
        """Return a copy of a state's numbers. Raises EngineError if they are not (n, 2) or (n,) finite ones."""
        shape = (self._balls, 2)[: 2 if what in ("position", "velocity") else 1]
        try:
            copy = np.array(numbers, dtype=np.float64)
        except (TypeError, ValueError):
            copy = np.empty(0)
        if copy.shape != shape:
            raise self._error(f"its {what} must be an array of shape {shape}, got {_short(numbers)}")
        finite = np.isfinite(copy.reshape(self._balls, -1)).all(axis=1)
        if not finite.all():
            ball = int(finite.argmin())
            raise self._error(f"the {what} of ball {ball} must be finite, got {copy[ball].tolist()}")
        return copy

    def _check_contacts(self, contacts: Contacts) -> None:
        """Raise EngineError unless contacts have known bodies and finite numbers, in order since the last call."""
        first, second, time, step = contacts["first"], contacts["second"], contacts["time"], self._step
        known = np.isin(second, self._walls) | ((second >= 0) & (second < self._balls))
        if not np.all((first >= 0) & (first < self._balls) & known & (first != second)):
            raise self._error(f"its contacts must be of two of its {self._balls} balls and {len(self._walls)} walls")
        numbers = (contacts[key] for key in ("time", "normal", "impulse", "depth", "tangential", "slip"))
        if not all(np.isfinite(each).all() for each in numbers):
            raise self._error("its contacts must have finite numbers")
        if (np.abs(length(contacts["normal"]) - 1) > ROUNDING).any():
            raise self._error("the normals of its contacts must be unit vectors")
        begin, end = self._read - MAX_CLOCK_ERROR * step, self._time + MAX_CLOCK_ERROR * step
        if (np.diff(time, prepend=begin, append=end) < -ROUNDING * step).any():
            raise self._error(
                "the times of its contacts must be in order, from the last call until now, "
                f"{self._read:g} to {self._time:g} s since the engine was built"
            )

    def _in_order(self, contacts: Contacts) -> Contacts:
        """Return a copy of contacts, each with the lower ball first, by our clock, which may round otherwise."""
        contacts, time, slack = contacts.copy(), contacts["time"], ROUNDING * self._step
        end = self._clock.times(self._clock.steps_containing(time - slack))
        contacts["time"] = np.minimum(np.where(np.abs(time - end) <= slack, end, time), self._time)
        turned = (contacts["second"] >= 0) & (contacts["first"] > contacts["second"])
        contacts["first"][turned], contacts["second"][turned] = contacts["second"][turned], contacts["first"][turned]
        contacts["normal"][turned] *= -1
        return contacts


def _short(value: object) -> str:
    return " ".join(f"{value!r:.40}".split())
