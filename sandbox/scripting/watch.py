"""Watching a live `pymunk.Space`: its steps are recorded beside its own program, and then compared with `exact`."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from types import TracebackType
from typing import Any, Final, Self
from warnings import warn

import numpy as np
import pymunk

from sandbox.analysis.comparison import compare
from sandbox.engines import REFERENCE, Engine
from sandbox.engines.recorded import RecordedEngine
from sandbox.engines.space_reader import SpaceReader
from sandbox.errors import SandboxError, SpaceWarning, shown
from sandbox.run.inputs import Kick
from sandbox.scene.clock import Clock
from sandbox.scene.fields import MAX_COUNT, MAX_NUMBER, Vector
from sandbox.scene.from_pymunk import (
    SpaceContents,
    contents_of,
    listed,
    motion_of,
    other_moments,
    refuse_unsupported,
    scene_of,
)
from sandbox.scene.model import Scene
from sandbox.scene.walls import ARENA_COUNT, walls_of
from sandbox.scripting.comparison import Comparison
from sandbox.state import Contacts, State, States

SPACE: Final = "space"  # the name of what is watched, in the comparison
ROUNDING: Final = 1e-9  # relative, of a dt that is 1 / a whole number
SHORTEST, LONGEST = 1 / MAX_COUNT, 1.0  # s, of a step
RATE: Final = 60  # of a part, until its steps are known


def watch(space: pymunk.Space, *, size: Vector | None = None, title: str = "") -> "Watched":
    """Record what the steps of a Space do, and compare it with the exact reference at the end.

    size: width and height of the view, px, as in `from_space`.
    Raises SandboxError, which lists all that a scene cannot have, if the Space has such things, or other moments of
    inertia than its balls.

    >>> space = pymunk.Space()
    >>> body = pymunk.Body(1, 50)
    >>> space.add(body, pymunk.Circle(body, 10))
    >>> with watch(space) as watched:
    ...     for _ in range(60):
    ...         space.step(1 / 60)
    >>> len(watched.comparison.time)
    61
    """
    contents = contents_of(space)
    refuse_unsupported(contents)
    if odd := other_moments(contents):
        raise SandboxError(odd)
    if contents.circles:  # what a scene refuses is refused at once
        scene_of(contents, motion_of(contents.circles), size=size, rate=RATE, title=title)
    return Watched(space, space.step, size, title)


class Watched:
    """Records the steps of a Space: of `Space.step` within a `with` block, or of its own `step`.

    Between steps, the program may set velocities: they become kicks, alike in every engine. After any other change,
    such as a body added or a position set, the recording begins anew; the longest part is compared.
    """

    def __init__(
        self, space: pymunk.Space, step: Callable[[float], None], size: Vector | None = None, title: str = ""
    ) -> None:
        self._space, self._step, self._size, self._title = space, step, size, title
        self._patched: Any = None  # what was in place of `Space.step` before
        self._steps = 0
        self._time = 0.0  # s
        self._part: _Part | None = None
        self._longest: _Part | None = None
        self._breaks: list[tuple[int, str]] = []  # the step before which a part ended, and why
        self._compared: Comparison | None = None
        self._unsupported = ""

    def __enter__(self) -> Self:
        self._patched = vars(self._space).get("step")
        vars(self._space)["step"] = self.step
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        del vars(self._space)["step"]
        if self._patched:
            vars(self._space)["step"] = self._patched

    def step(self, dt: float) -> None:
        """Call `Space.step`, and record what it does. dt: s; a step of 0 s, which does nothing, does not count."""
        if dt == 0:
            self._step(dt)
            return
        self._compared = None
        contents = contents_of(self._space)
        self._unsupported = _unsupported(contents)
        why = self._part.why_it_ends(contents, dt) if self._part else ""
        if why:
            self._end_part(why)
        if not self._part:
            self._begin_part(contents, dt)
        if self._part:
            self._part.record(self._step, dt)
        else:
            self._step(dt)
        self._steps += 1
        self._time += dt

    @property
    def ball_steps(self) -> int:
        """The number of states of balls that the present part has."""
        return self._part.ball_steps if self._part else 0

    @property
    def unsupported(self) -> str:
        """Say what the Space had before the last step that a scene cannot have; empty if there was nothing."""
        return self._unsupported

    @property
    def comparison(self) -> Comparison:
        """The recorded run, as the engine `space`, compared with `exact`; of the longest part, if there are several.

        Raises SandboxError if nothing was recorded.
        """
        if self._compared is None:
            part = self._longest_part()
            if part is None:
                raise SandboxError(f"there is nothing to compare: {self._first_break() or 'no step was done'}")
            if self._breaks:
                last = part.first + part.steps
                warn(
                    f"{self._first_break()}; the comparison covers the longest part without such changes, steps "
                    f"{part.first + 1} to {last} of {self._steps}",
                    SpaceWarning,
                    stacklevel=2,
                )
            if part.clock.varies:
                warn(_varying(part.clock), SpaceWarning, stacklevel=2)
            self._compared = part.comparison()
        return self._compared

    def _begin_part(self, contents: SpaceContents, dt: float) -> None:
        """Begin a part, unless it could not be compared."""
        why = _why_not(contents, dt)
        if not why:
            self._part = _Part(self._space, contents, self._steps, self._time, self._size, self._title)
        elif not self._breaks or self._breaks[-1][1] != why:
            self._breaks.append((self._steps, why))

    def _end_part(self, why: str) -> None:
        self._longest, self._part = self._longest_part(), None
        self._breaks.append((self._steps, why))

    def _longest_part(self) -> "_Part | None":
        return max((part for part in (self._part, self._longest) if part), key=lambda part: part.steps, default=None)

    def _first_break(self) -> str:
        """Say which change a comparison does not reach across, if there was one."""
        if not self._breaks:
            return ""
        step, why = self._breaks[0]
        others = len(self._breaks) - 1
        more = f", and {others} more such change{'s' if others > 1 else ''}" if others else ""
        return f"before step {step + 1}, {why}{more}"


class _Part:
    """Steps between which the program changes nothing but velocities."""

    def __init__(
        self,
        space: pymunk.Space,
        contents: SpaceContents,
        first: int,
        since: float,
        size: Vector | None,
        title: str,
    ) -> None:
        self.first, self._since, self._contents = first, since, contents
        motion = motion_of(contents.circles)
        self._scene: Scene = scene_of(contents, motion, size=size, rate=RATE, title=title)
        self._rates: list[float] = []  # 1/s, of each step
        self._states = [motion]
        self._contacts: list[Contacts] = []
        self._kicks: list[Kick] = []
        carriers = {number: wall.body for number, wall in enumerate(contents.walls, ARENA_COUNT)}
        bodies = [circle.body for circle in contents.circles if circle.body]
        self._reader = SpaceReader(space, bodies, self._scene.bodies.radius, carriers, walls_of(self._scene), RATE)
        self._reader.log.recording = True

    @property
    def steps(self) -> int:
        """The number of steps recorded."""
        return len(self._states) - 1

    @property
    def ball_steps(self) -> int:
        """The number of states of balls recorded."""
        return len(self._states) * len(self._contents.circles)

    def why_it_ends(self, contents: SpaceContents, dt: float) -> str:
        """Return what changed since the last step and ends this part; empty if only velocities and dt did."""
        if contents.left_out or not _is_step(dt):
            return _why_not(contents, dt)
        now = motion_of(contents.circles)
        if why := _out_of_range(now):
            return why
        for before, after, what in _compared(self._contents, contents):
            if before != after:
                return f"{what} changed"
        for key, what in (("position", "position"), ("spin", "angular velocity")):
            changed = np.argwhere(getattr(self._states[-1], key) != getattr(now, key))
            if len(changed):
                return f"the {what} of ball {changed[0, 0]} was set"
        return ""

    def record(self, step: Callable[[float], None], dt: float) -> None:
        """Do a step, and record it with the kicks before it."""
        given = motion_of(self._contents.circles).velocity - self._states[-1].velocity
        for ball in np.flatnonzero(given.any(axis=1)).tolist():
            x, y = given[ball].tolist()
            self._kicks.append(Kick(step=self.steps, ball=ball, velocity=(x, y)))
        self._reader.dt = dt
        self._reader.begin()
        step(dt)
        self._reader.read()
        self._reader.end()
        self._rates.append(_rate_of(dt))
        self._states.append(self._reader.states().state(-1, 0.0))
        self._contacts.append(self._reader.log.take())

    @property
    def clock(self) -> Clock:
        """The times of its steps."""
        return Clock.of_rates(self._rates)

    def comparison(self) -> Comparison:
        """Compare what was recorded with the reference."""
        clock, states, contacts = self.clock, States.stack(self._states), np.concatenate(self._contacts)
        states = states._replace(angle=states.angle - states.angle[0])  # a scene's balls start without
        contacts["time"] = np.repeat(
            clock.times(np.arange(1, self.steps + 1)), [len(contacts_of_step) for contacts_of_step in self._contacts]
        )

        def recorded(scene: Scene, initial: State) -> Engine:
            return RecordedEngine(states, contacts, clock, self._reader.damping)

        seconds = clock.time(self.steps)
        rate = min(max(1, round(self.steps / seconds)), MAX_COUNT)
        scene = self._scene.changed(rate=rate, seconds=seconds).timed(clock)
        comparison = compare(scene, {SPACE: recorded, REFERENCE: REFERENCE}, inputs=self._kicks)
        return Comparison.of(replace(comparison, since=self._since))


def _why_not(contents: SpaceContents, dt: float) -> str:
    """Return why steps of a Space cannot be compared; empty if they can."""
    if contents.left_out:
        return _unsupported(contents)
    if not contents.circles:
        return "there were no circles"
    if not _is_step(dt):
        return f"dt was {dt:g} s, which must be from {SHORTEST:g} to {LONGEST:g} s"
    return _out_of_range(motion_of(contents.circles)) or other_moments(contents)


def _unsupported(contents: SpaceContents) -> str:
    return f"the Space had {listed(contents.left_out)}, which a scene cannot have" if contents.left_out else ""


def _out_of_range(motion: State) -> str:
    """Return which number of a motion a scene cannot have; empty if it can have all."""
    for key, what in (("position", "position"), ("velocity", "velocity"), ("spin", "angular velocity")):
        numbers = getattr(motion, key)
        wrong = np.argwhere(~(np.abs(numbers) <= MAX_NUMBER))  # NaN is not
        if len(wrong):
            ball = wrong[0, 0]
            return f"the {what} of ball {ball} was {shown(numbers[ball].tolist())}, not within ±{MAX_NUMBER:g}"
    return ""


def _compared(before: SpaceContents, after: SpaceContents) -> Iterator[tuple[object, object, str]]:
    """Yield each thing that a Space has, before and after, and its name."""
    yield before.circles, after.circles, "the circles"
    yield before.masses, after.masses, "a mass or moment"
    yield before.kinds, after.kinds, "a radius, elasticity or friction"
    yield before.walls, after.walls, "a wall"
    yield before.gravity, after.gravity, "the gravity"
    yield before.settings, after.settings, "a setting of the Space"


def _is_step(dt: float) -> bool:
    """Return whether a step is of a length that can be compared."""
    return SHORTEST <= dt <= LONGEST  # NaN is not


def _rate_of(dt: float) -> float:
    """Return 1 / dt, a whole number if that is meant, so that the times of steps are rounded once."""
    rate = round(1 / dt)
    return rate if abs(rate * dt - 1) <= ROUNDING else 1 / dt


def _varying(clock: Clock) -> str:
    """Say that dt varied, and what that does to a simulation."""
    shortest, longest = clock.lengths
    return (
        f"dt varied from {shortest:.4g} to {longest:.4g} s: in longer steps, contacts are found later and gravity is "
        "integrated more coarsely; where dt grows, Pymunk multiplies the impulses of lasting contacts by the ratio, "
        "which can add energy; and runs with other dt differ. A constant dt, such as 1/60, avoids all three"
    )
