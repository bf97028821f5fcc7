"""The comparison of a recorded Space with `exact`, over the longest part in which the program sets only velocities."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Final

import numpy as np

from sandbox.analysis.comparison import compare
from sandbox.engines import REFERENCE, Engine
from sandbox.engines.space_reader import ContactReader, Solved
from sandbox.engines.stand_ins import RecordedEngine
from sandbox.errors import SandboxError, shown
from sandbox.quantity import energy
from sandbox.run.inputs import Kick
from sandbox.run.trajectory import Trajectory
from sandbox.scene.clock import Clock
from sandbox.scene.fields import MAX_COUNT, MAX_NUMBER, Vector
from sandbox.scene.from_pymunk import SpaceContents, Unsupported, listed, other_moments, scene_of
from sandbox.scene.model import Scene
from sandbox.scene.walls import ARENA_COUNT, walls_of
from sandbox.scripting.comparison import Comparison
from sandbox.space.mechanics import Index, Rows, turned
from sandbox.space.recording import Recording, Step
from sandbox.state import Contacts, Damping, State, States

SPACE: Final = "space"  # the name of what is watched, in the comparison
ROUNDING: Final = 1e-9  # relative, of a dt that is 1 / a whole number
SHORTEST, LONGEST = 1 / MAX_COUNT, 1.0  # s, of a step
RATE: Final = 60  # of a scene, until its steps are known
MAX_BALL_STEPS: Final = 500_000  # states of balls that are compared: some 50 MB, and a minute of comparing
_MOTION: Final = ("position", "velocity", "angle", "spin")  # of BODY

_LASTING: Final = {  # of SpaceContents, within a part
    "circles": "the circles",
    "masses": "a mass or moment",
    "kinds": "a radius, elasticity or friction",
    "filters": "a filter",
    "walls": "a wall",
    "gravity": "the gravity",
    "settings": "a setting of the Space",
}


class AgainstExact:
    """Compares a recording with `exact`. size: of the view, px, as in `from_space`; title: of the scene.

    Velocities that the program set between steps become kicks, alike in every engine. After any other change, such as a
    body added or a position set, a part ends; the longest one is compared.
    """

    def __init__(self, recording: Recording | None, size: Vector | None = None, title: str = "") -> None:
        self._recording, self._size, self._title = recording, size, title
        self._breaks: list[tuple[int, str]] = []  # the step before which a part ended, and why
        self._parts: list[_Part] = []
        self._ended = False  # before the last step
        if recording:
            self._divide(recording)

    @cached_property
    def part(self) -> "_Part | None":
        """The longest part; None if no step can be compared."""
        return max(self._parts, key=lambda part: part.count, default=None)

    @property
    def why_not(self) -> str:
        """Why there is no comparison; empty if there is one."""
        return self._compared if isinstance(self._compared, str) else ""

    @property
    def comparison(self) -> Comparison | None:
        """The longest part, as the engine `space`, compared with `exact`; None if that is impossible."""
        return None if isinstance(self._compared, str) else self._compared

    @cached_property
    def _compared(self) -> Comparison | str:
        if self._recording is None:
            return "this version of Pymunk lays out its memory in another way"
        if self.part is None:
            return self._first_break() or "no step with a dt above 0 was done"
        try:
            return self.part.comparison(self._size, self._title)
        except SandboxError as error:
            return str(error)

    @property
    def trajectory(self) -> Trajectory | None:
        """The longest part; its times count from the first step of all."""
        return self.part.trajectory(self._size, self._title) if self.part else None

    def notes(self, what: str = "the comparison") -> Iterator[str]:
        """Yield what limits a comparison, or a trajectory."""
        if self.part is None or self._recording is None:
            return
        first = self.part.first
        covers = f"{what} covers the longest part without such changes, " if self._breaks else f"{what} covers "
        if self._breaks or self._ended:
            why = f"{self._first_break()}; " if self._breaks else ""
            yield f"{why}{covers}steps {first + 1} to {first + self.part.count} of {self._recording.count}"
        if what == "the comparison" and self.part.clock.varies:
            yield _varying(self.part.clock)

    @property
    def sentences(self) -> list[str]:
        """The notes on the comparison, as sentences."""
        return [f"{note[0].upper()}{note[1:]}." for note in self.notes()]

    def paragraphs(self) -> Iterator[str]:
        """Yield it as text, a paragraph each."""
        if self.comparison:
            yield "Compared with exact, the engine of this sandbox without time steps:"
            yield from (*self.comparison.verdict.split("\n"), *self.sentences)
        else:
            yield f"Not compared with exact: {self.why_not}."

    def _divide(self, recording: Recording) -> None:
        part: _Part | None = None
        contents, ids = None, np.empty(0, np.uint64)
        for step in recording.from_start:
            if recording.roster.read_until == step.number or (part and part.ball_steps > MAX_BALL_STEPS):
                self._ended = True
                break
            if contents is not (contents := recording.roster.contents(step.number)):
                ids = np.array([circle.body.id for circle in contents.circles if circle.body], np.uint64)
            moment = _Moment(contents, ids, step, recording.invalid.get(step.number, step.dt))
            if part and (why := part.why_it_ends(moment)):
                self._breaks.append((step.number, why))
                part = None
            if part:
                part.add(moment)
            elif why := moment.why_not():
                if not self._breaks or self._breaks[-1][1] != why:
                    self._breaks.append((step.number, why))
            else:
                part = _Part(moment)
                self._parts.append(part)
        self._ended |= len(recording.from_start) < recording.count
        if not self._parts and not self._breaks and recording.invalid:
            self._breaks = [(number, _wrong_dt(dt)) for number, dt in recording.invalid.items()]

    def _first_break(self) -> str:
        """Say which change a comparison does not reach across, if there was one."""
        if not self._breaks:
            return ""
        step, why = self._breaks[0]
        others = len(self._breaks) - 1
        more = f", and {others} more such change{'s' if others > 1 else ''}" if others else ""
        return f"before step {step + 1}, {why}{more}"


class _Moment:
    """A step, and what the Space had before it. ids: of its circles' bodies; dt: s, also of a step before it."""

    def __init__(self, contents: SpaceContents, ids: Rows, step: Step, dt: float) -> None:
        self.contents, self.ids, self.step, self._dt = contents, ids, step, dt

    @cached_property
    def motion(self) -> State:
        """That of its circles."""
        return _motion(self.step.before.bodies, self.ids)

    def why_not(self) -> str:
        """Return why the step cannot be compared; empty if it can be."""
        if left_out := self._left_out():
            return f"the Space had {listed(left_out)}, which a scene cannot have"
        if not self.contents.circles:
            return "there were no circles"
        if not SHORTEST <= self._dt <= LONGEST:  # NaN is not
            return _wrong_dt(self._dt)
        return _out_of_range(self.motion) or other_moments(self.contents, self.motion.spin)

    def _left_out(self) -> dict[tuple[str, str], int]:
        bodies, force = self.step.before.bodies, Unsupported.FORCE.value  # which each step has or has not
        bodies = bodies[np.isfinite(bodies["mass"])]
        pushed = np.count_nonzero(bodies["force"].any(axis=1) | (bodies["torque"] != 0))
        lasting = {key: count for key, count in self.contents.left_out.items() if key != force}
        return lasting | ({force: int(pushed)} if pushed else {})


class _Part:
    """Successive steps between which the program changes nothing but velocities."""

    def __init__(self, moment: _Moment) -> None:
        self._contents, self._ids = moment.contents, moment.ids
        self._steps: list[Step] = []
        self._before: list[State] = []
        self._after: list[State] = []
        self.add(moment)

    @property
    def first(self) -> int:
        """The number of its first step."""
        return self._steps[0].number

    @property
    def count(self) -> int:
        """The number of its steps."""
        return len(self._steps)

    @property
    def ball_steps(self) -> int:
        """The number of states of balls that it has."""
        return (self.count + 1) * len(self._ids)

    @cached_property
    def clock(self) -> Clock:
        """The times of its steps."""
        return Clock.of_rates([_rate_of(step.dt) for step in self._steps])

    def why_it_ends(self, moment: _Moment) -> str:
        """Return what changed since its last step and ends it; empty if only velocities and dt did."""
        if why := moment.why_not():
            return why
        for key, what in _LASTING.items() if moment.contents is not self._contents else ():
            if getattr(self._contents, key) != getattr(moment.contents, key):
                return f"{what} changed"
        for key, what in (("position", "position"), ("spin", "angular velocity")):
            changed = np.argwhere(getattr(self._after[-1], key) != getattr(moment.motion, key))
            if len(changed):
                return f"the {what} of ball {changed[0, 0]} was set"
        return ""

    def add(self, moment: _Moment) -> None:
        """Add the next step."""
        self._steps.append(moment.step)
        self._before.append(moment.motion)
        self._after.append(_motion(moment.step.after.bodies, self._ids))

    def trajectory(self, size: Vector | None, title: str) -> Trajectory:
        """Return what was recorded, with times since the first step of all parts."""
        scene = self._scene(size, title)
        states, contacts = self._states, self._contacts(scene)
        since = self._steps[0].time
        contacts["time"] += since
        bodies, view = scene.bodies, scene.arena.size
        return Trajectory(
            **states._asdict(),
            time=since + self.clock.times(np.arange(self.count + 1)),
            radius=bodies.radius,
            mass=bodies.mass,
            size=view,
            contacts=contacts,
            energy=energy(states, bodies, scene.gravity, view),
        )

    def comparison(self, size: Vector | None, title: str) -> Comparison:
        """Compare what was recorded with the reference."""
        scene, clock, states = self._scene(size, title), self.clock, self._states
        contacts = self._contacts(scene)
        states = states._replace(angle=states.angle - states.angle[0])  # a scene's balls start without

        def recorded(scene: Scene, initial: State) -> Engine:
            return RecordedEngine(states, contacts, clock, self._damping)

        seconds = clock.time(self.count)
        rate = min(max(1, round(self.count / seconds)), MAX_COUNT)
        scene = scene.changed(rate=rate, seconds=seconds).timed(clock)
        comparison = compare(scene, {SPACE: recorded, REFERENCE: REFERENCE}, inputs=list(self._kicks()))
        return Comparison.of(replace(comparison, since=self._steps[0].time))

    def _scene(self, size: Vector | None, title: str) -> Scene:
        return scene_of(self._contents, self._before[0], size=size, rate=RATE, title=title)

    @property
    def _states(self) -> States:
        return States.stack([self._before[0], *self._after])

    @property
    def _damping(self) -> Damping:
        return Damping(float(self._steps[0].before.settings["damping"]))

    def _kicks(self) -> Iterator[Kick]:
        for number, (after, before) in enumerate(zip(self._after, self._before[1:], strict=False), 1):
            given = before.velocity - after.velocity
            for ball in np.flatnonzero(given.any(axis=1)).tolist():
                x, y = given[ball].tolist()
                yield Kick(step=number, ball=ball, velocity=(x, y))

    def _contacts(self, scene: Scene) -> Contacts:
        """Return all contacts, with times since the part began."""
        settings = self._steps[0].before.settings
        carriers = {number: wall.body.id for number, wall in enumerate(self._contents.walls, ARENA_COUNT)}
        persistence = int(settings["persistence"])
        reader = ContactReader(self._ids.tolist(), scene.bodies.radius, carriers, walls_of(scene), persistence)
        dt = np.array([step.dt for step in self._steps])
        left = np.array([self._damping.left_after(step.dt) for step in self._steps])
        before = States.stack(self._before)
        call, contacts = reader.contacts(
            _solved([step.after.contacts for step in self._steps]),
            0,
            np.divide(dt, np.append(dt[0], dt[:-1])),
            left[:, None, None] * before.velocity + settings["gravity"] * dt[:, None, None],
            left[:, None] * before.spin,
            States.stack(self._after).position,
        )
        contacts["time"] = self.clock.times(1 + call)
        return contacts


def _solved(contacts: Sequence[Rows]) -> Solved:
    """Return what steps solved, from the contacts of each."""
    rows, call = np.concatenate(contacts), np.repeat(np.arange(len(contacts)), [*map(len, contacts)])
    n = rows["normal"]
    impulse = -(rows["impulse"][:, None] * n + rows["tangential"][:, None] * turned(n))
    bodies = np.stack([rows["body_a"], rows["body_b"]], axis=1)
    return Solved(call, bodies, impulse, n, -rows["distance"])


def _motion(bodies: Rows, ids: Rows) -> State:
    """Return the motion of bodies with these ids: (n, 2) px, px/s; (n,) rad, rad/s; NaN if one is not in the Space.

    What is asleep does not move.
    """
    index = Index(bodies["id"]).rows(ids)
    values = (bodies[key] for key in _MOTION)
    motion = State(0.0, *(np.append(of, np.full((1, *of.shape[1:]), np.nan), axis=0)[index] for of in values))
    asleep = np.append(bodies["asleep"] != 0, False)[index]
    motion.velocity[asleep] = motion.spin[asleep] = 0.0
    return motion


def _wrong_dt(dt: float) -> str:
    return f"dt was {dt:g} s, which must be from {SHORTEST:g} to {LONGEST:g} s"


def _out_of_range(motion: State) -> str:
    """Return which number of a motion a scene cannot have; empty if it can have all."""
    for key, what in (("position", "position"), ("velocity", "velocity"), ("spin", "angular velocity")):
        numbers = getattr(motion, key)
        wrong = np.argwhere(~(np.abs(numbers) <= MAX_NUMBER))  # NaN is not
        if len(wrong):
            ball = wrong[0, 0]
            return f"the {what} of ball {ball} was {shown(numbers[ball].tolist())}, not within ±{MAX_NUMBER:g}"
    return ""


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
