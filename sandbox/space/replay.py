"""The recorded steps of a Space done again: as they were, in finer steps, or with other settings.

What the program did between two steps is the difference between the end of one and the start of the next. A velocity,
a position or an angle that it changed is set alike if it is rounder than the change, as 300 is after 12.3471; otherwise
it is changed by as much, as by an impulse. Forces, which last for one step, act throughout it. Kinematic and static
bodies go where they went.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Final, NamedTuple

import numpy as np
import pymunk
from numpy.typing import NDArray

from sandbox.space.description import (
    AnyShape,
    Circle,
    Parts,
    Poly,
    Segment,
    SpaceDescription,
    build_body,
    build_constraint,
    build_shape,
    change_shape,
    place,
    rebuild,
    set_mass,
)
from sandbox.space.mechanics import Floats, Index, Rows, common
from sandbox.space.memory import SETTINGS, JointKind, Snapshot, SpaceMemory
from sandbox.space.recording import Recording
from sandbox.space.roster import Change

Complexes = NDArray[np.complex128]
Numbers = NDArray[np.intp]

STATIC: Final = -1  # the number of the Space's own static body
DIGITS: Final = 9  # of a number that is not round at all
SAME: Final = 1e-7  # of a body's size: two runs that differ by rounding alone are closer
SHIFT: Final = 4  # units in the last place
AWAKE: Final = {"sleep_time_threshold": 1e9}  # s; programs that put bodies to sleep need a finite one
_CHANGEABLE: Final = ("position", "angle", "velocity", "spin", "mass", "moment")  # of BODY
_SPACE_SETTINGS: Final = {  # of SETTING
    "gravity": "gravity",
    "damping": "damping",
    "slop": "collision_slop",
    "persistence": "collision_persistence",
}
_original_step: Final = pymunk.Space.step


@dataclass(frozen=True)
class Variant:
    """How steps are done again.

    iterations: a factor; settings: attributes of the Space, in place of the program's; is_shifted: whether bodies start
    some units in the last place off; is_reversed: whether what is in the Space at the start is added in reverse order.
    """

    substeps: int = 1
    iterations: int = 1
    settings: Mapping[str, float] = field(default_factory=dict)
    is_shifted: bool = False
    is_reversed: bool = False


@dataclass(frozen=True)
class Motion:
    """Where bodies were after each step, by their numbers: (steps, bodies), NaN while they were not in the Space.

    place: of the centre of gravity, px, as complex numbers; angle: rad.
    """

    place: Complexes
    angle: Floats

    @classmethod
    def empty(cls, steps: int, bodies: int) -> "Motion":
        """Return a motion without any body."""
        return cls(np.full((steps, bodies), complex(np.nan, np.nan)), np.full((steps, bodies), np.nan))

    def first(self, count: int) -> "Motion":
        """Return the first steps."""
        return Motion(self.place[:count], self.angle[:count])

    def extrapolated(self, finer: "Motion") -> "Motion":
        """Return where steps of length 0 lead, from a run with steps half as long, if errors go with their length."""
        return Motion(2 * finer.place - self.place, 2 * finer.angle - self.angle)

    def put(self, step: int, numbers: Numbers, rows: Rows) -> None:
        """Enter the rows of bodies with these numbers, without the Space's own static body."""
        known = numbers != STATIC
        self.place[step, numbers[known]] = rows["position"][known] @ np.array([1, 1j])
        self.angle[step, numbers[known]] = rows["angle"][known]


class Setting(NamedTuple):
    """A number of a body that the program changed: its name in BODY, the component, what it was and what it became."""

    body: int
    name: str
    component: int
    old: float
    new: float
    is_set: bool

    def value(self, current: float) -> float:
        """Return what it becomes where it is another number."""
        return self.new if self.is_set or current == self.old else current + (self.new - self.old)


@dataclass(frozen=True)
class Between:
    """What the program did before a step, apart from what it added and removed. Bodies and joints are numbers.

    asleep: whether bodies were put to sleep or woken up; guests: where bodies are, px and rad, that only have joints in
    the Space; forces: with torques.
    """

    bodies: list[Setting]
    asleep: list[tuple[int, bool]]
    joints: list[tuple[int, str, float]]
    space: dict[str, Any]
    guests: list[tuple[int, tuple[float, float], float]]
    forces: list[tuple[int, tuple[float, float], float]]


class Script:
    """What all replays of the first steps of a recording repeat.

    numbers: returns those of bodies by their ids; recorded: where bodies were; between: what the program did before
    each step; retyped: bodies that became or ceased to be dynamic before a step; at_rest: whether bodies are added at
    rest, as `rebuild` has it.
    """

    def __init__(self, recording: Recording, count: int) -> None:
        self.roster, self.at_rest = recording.roster, False
        self.steps = recording.from_start[:count]
        numbers = {body_id: self.roster.bodies[body] for body_id, body in self.roster.by_id.items()}
        self.numbers = _numbers_by(numbers)
        self.recorded = Motion.empty(len(self.steps), len(self.roster.bodies))
        for number, step in enumerate(self.steps):
            self.recorded.put(number, self.numbers(step.after.bodies["id"]), step.after.bodies)
        self.retyped: dict[int, list[int]] = {}
        self._poses: dict[int, tuple[tuple[float, ...], float]] = {}  # of bodies that are not in the Space
        self.between = [self._between(number) for number in range(len(self.steps))]

    def added_at_rest(self) -> "Script":
        """Return the same, with bodies that get their velocities after they are added."""
        script = copy(self)
        script.at_rest = True
        return script

    @cached_property
    def outlines(self) -> list[Complexes]:
        """Points of each body from its centre of gravity, px, as complex numbers: corners, ends, middles of circles."""
        return [np.array([point for point, _ in points] or [0j]) for points in self._points]

    @cached_property
    def sizes(self) -> Floats:
        """How far the furthest point of each body is from its centre of gravity, px; without shapes, the median."""
        sizes = np.array([max((abs(point) + r for point, r in points), default=0.0) for points in self._points])
        return np.where(sizes > 0, sizes, np.median(sizes[sizes > 0]) if sizes.any() else 1.0)

    @cached_property
    def _points(self) -> list[list[tuple[complex, float]]]:
        """The points of the shapes of each body, from its centre of gravity, and the shapes' radii."""
        assert self.roster.start is not None
        points: list[list[tuple[complex, float]]] = [[] for _ in self.roster.bodies]
        parts: list[SpaceDescription | Parts] = [self.roster.start]
        parts += [change.parts for changes in self.roster.changes.values() for change in changes]
        centers = [complex(*body.center_of_gravity) for body in self.roster.bodies]
        for shape in (shape for part in parts for shape in part.shapes):
            if shape.body is not None:
                of_shape = [complex(*point) - centers[shape.body] for point in points_of(shape)]
                points[shape.body] += [(point, shape.radius) for point in of_shape]
        return points

    def pairs(self, step: int) -> Numbers:
        """Return the numbers of the bodies of finite mass that touch or are joined in a step, (k, 2)."""
        after = self.steps[step].after
        ends = [np.stack([rows["body_a"], rows["body_b"]], axis=1) for rows in (after.contacts, after.joints)]
        light = after.bodies["id"][np.isfinite(after.bodies["mass"])]
        pairs = np.concatenate(ends)
        return self.numbers(pairs[np.isin(pairs, light).all(axis=1)])

    @property
    def is_steered(self) -> bool:
        """Whether the program did anything between the steps, other than to add and remove."""
        changes = (change for changes in self.roster.changes.values() for change in changes)
        return any(change.changed for change in changes) or any(
            between.bodies or between.asleep or between.joints or between.space or between.guests or between.forces
            for between in self.between
        )

    def _between(self, number: int) -> Between:
        before = self.steps[number].before
        last = self.steps[number - 1].after if number else before
        old, new = _changed(last.bodies, before.bodies, "id")
        old_joints, new_joints = _changed(last.joints, before.joints, "key")
        sleeping = (old["asleep"] != 0) != (new["asleep"] != 0)
        pushed = before.bodies[before.bodies["force"].any(axis=1) | (before.bodies["torque"] != 0)]
        return Between(
            bodies=list(self._settings(number, old, new)),
            asleep=list(zip(self.numbers(new["id"][sleeping]).tolist(), new["asleep"][sleeping] != 0, strict=True)),
            joints=list(self._joint_settings(old_joints, new_joints)),
            space={
                name: before.settings[key].tolist()
                for key, name in _SPACE_SETTINGS.items()
                if not np.array_equal(before.settings[key], last.settings[key])
            },
            guests=list(self._guests(before)),
            forces=[
                (body, tuple(row["force"].tolist()), float(row["torque"]))
                for body, row in zip(self.numbers(pushed["id"]).tolist(), pushed, strict=True)
            ],
        )

    def _settings(self, step: int, old: Rows, new: Rows) -> Iterator[Setting]:
        numbers = self.numbers(new["id"])
        is_moved = np.isinf(new["mass"])
        for name in _CHANGEABLE:
            was, became = (rows[name].reshape(len(rows), rows[name].size // max(1, len(rows))) for rows in (old, new))
            for row, component in np.argwhere(was != became).tolist():
                first, last = float(was[row, component]), float(became[row, component])
                if name in ("mass", "moment") and math.isinf(first) != math.isinf(last):
                    self.retyped.setdefault(step, []).append(int(numbers[row]))
                    continue
                is_set = bool(is_moved[row]) or name in ("mass", "moment") or is_rounder(last, last - first)
                yield Setting(int(numbers[row]), name, component, first, last, is_set)

    def _joint_settings(self, old: Rows, new: Rows) -> Iterator[tuple[int, str, float]]:
        for was, became in zip(old, new, strict=True):
            number = self.roster.joints[self.roster.by_key[int(became["key"])]]
            names = SETTINGS[JointKind(became["kind"])]
            values = zip(names, was["setting"].tolist(), became["setting"].tolist(), strict=False)
            for name, first, last in [*values, ("max_force", float(was["max_force"]), float(became["max_force"]))]:
                if first != last and name != "bias":
                    yield number, name, last

    def _guests(self, before: Snapshot) -> Iterator[tuple[int, tuple[float, float], float]]:
        """Yield where bodies are that are not in the Space, when that is new."""
        joints, present = before.joints, before.bodies["id"]
        for side in ("a", "b") if len(joints) else ():
            numbers = np.where(np.isin(joints[f"body_{side}"], present), -1, self.numbers(joints[f"body_{side}"]))
            for number, row in zip(numbers[numbers >= 0].tolist(), joints[numbers >= 0], strict=True):
                pose = tuple(row[f"place_{side}"].tolist()), float(row[f"angle_{side}"])
                if self._poses.get(number) != pose:
                    self._poses[number] = pose
                    yield number, *pose


def is_rounder(number: float, other: float) -> bool:
    """Return whether a number has fewer digits than another one of the same calculation.

    >>> is_rounder(300.0, 300.0 - 12.3471), is_rounder(312.3471, 300.0)
    (True, False)
    """
    scale = max(abs(number), abs(other))
    return _digits(number, scale) < _digits(other, scale)


def _digits(number: float, scale: float) -> int:
    """Return how many digits a number has, from the first one of the scale on."""
    if not math.isfinite(number) or not scale:
        return DIGITS
    first = -math.floor(math.log10(scale))
    return next((k for k in range(DIGITS) if abs(round(number, first + k) - number) <= scale * 10.0**-DIGITS), DIGITS)


def points_of(shape: AnyShape) -> tuple[tuple[float, float], ...]:
    """Return the points that a shape is around, in the coordinates of its body, px."""
    match shape:
        case Circle():
            return (shape.offset,)
        case Segment():
            return shape.a, shape.b
        case Poly():
            return shape.vertices


def _numbers_by(number_of: Mapping[int, int]) -> Callable[[Rows], Numbers]:
    """Return a function that returns the numbers of bodies by their ids, STATIC for unknown ones."""
    index, numbers = Index(np.array([*number_of], np.uint64)), np.array([*number_of.values(), STATIC], np.intp)
    return lambda ids: numbers[index.rows(ids)]


def _changed(old: Rows, new: Rows, key: str) -> tuple[Rows, Rows]:
    """Return the rows that two tables have in common, or none if nothing changed."""
    return (old[:0], new[:0]) if old.tobytes() == new.tobytes() else common(old, new, key)


class Stage:
    """A Space in which the steps of a script are done again. now: rows of its bodies; numbers: those of the rows."""

    def __init__(self, script: Script, variant: Variant) -> None:
        self._script, self._variant = script, variant
        assert script.roster.start is not None
        start = script.roster.start
        rebuilt = rebuild(start.in_reverse if variant.is_reversed else start, at_rest=script.at_rest)
        self._space = rebuilt.space
        order = slice(None, None, -1 if variant.is_reversed else 1)
        self._bodies = {**dict(enumerate(rebuilt.bodies[order])), STATIC: self._space.static_body}
        self._shapes = dict(enumerate(rebuilt.shapes[order]))
        self._joints = dict(enumerate(rebuilt.constraints[order]))
        self._space.iterations *= variant.iterations
        for name, value in variant.settings.items():
            setattr(self._space, name, value)
        if variant.is_shifted:
            self._shift()
        self._memory = SpaceMemory(self._space)
        self._name_bodies()
        self._read()

    def step(self, number: int, driven: Numbers) -> None:
        """Do a step, and before it what the program did. driven: bodies that are put where they were."""
        between, step = self._script.between[number], self._script.steps[number]
        for change in self._script.roster.changes.get(number, []):
            self._change(change)
        for name, value in between.space.items():
            if name not in self._variant.settings:
                setattr(self._space, name, value)
        for joint, name, value in between.joints:
            setattr(self._joints[joint], name, value)
        for body, position, angle in between.guests:
            _move(self._bodies[body], position, angle)
        self._set(between.bodies)
        self._drive(driven, step.before.bodies)
        for change in self._script.roster.changes.get(number, []):
            for shape, box in zip(change.changed, change.boxes, strict=True):
                if self._shapes[shape].bb != box:
                    self._space.reindex_shape(self._shapes[shape])
        for body, is_asleep in between.asleep:
            if is_asleep != self._bodies[body].is_sleeping:
                (self._bodies[body].sleep if is_asleep else self._bodies[body].activate)()
        for _ in range(self._variant.substeps):
            for body, force, torque in between.forces:
                self._bodies[body].force, self._bodies[body].torque = force, torque
            _original_step(self._space, step.dt / self._variant.substeps)
        self._read()

    def close(self) -> None:
        """Wake all bodies: Pymunk aborts if a Space with sleeping ones is freed."""
        for body in self._space.bodies:
            body.activate()

    def _read(self) -> None:
        self.now = self._memory.snapshot().bodies
        self.numbers = self._numbers_by(self.now["id"])

    def _name_bodies(self) -> None:
        self._numbers_by = _numbers_by({body.id: number for number, body in self._bodies.items()})

    def _shift(self) -> None:
        """Put bodies some units in the last place off, each in another direction."""
        bodies = [body for body in self._bodies.values() if body.body_type == pymunk.Body.DYNAMIC]
        ulp = SHIFT * math.ulp(max((abs(x) for body in bodies for x in body.position), default=1.0) or 1.0)
        for number, body in enumerate(bodies):
            x, y = body.position
            body.position = x + ulp * (-1) ** (number // 2), y + ulp * (-1) ** number
            body.angle += SHIFT * math.ulp(1.0) * (-1) ** number

    def _change(self, change: Change) -> None:
        """Remove and add what the program did."""
        registers: tuple[dict[int, Any], ...] = self._bodies, self._shapes, self._joints
        for register, numbers in zip(reversed(registers), reversed(change.removed), strict=True):
            self._space.remove(*(register[number] for number in numbers))
        bodies, shapes, joints = change.added
        for number, body in zip(bodies, change.parts.bodies, strict=True):
            if number not in self._bodies:
                self._bodies[number] = build_body(body, at_rest=self._script.at_rest)
            if body.in_space:
                self._space.add(self._bodies[number])
        of_index: dict[int | None, pymunk.Body] = {**dict(self._bodies.items()), None: self._space.static_body}
        added, changed = change.parts.shapes[: len(shapes)], change.parts.shapes[len(shapes) :]
        for number, shape in zip(shapes, added, strict=True):
            self._shapes[number] = build_shape(shape, of_index[shape.body])
            self._space.add(self._shapes[number])
        for number, shape in zip(change.changed, changed, strict=True):
            change_shape(self._shapes[number], shape)
        for number, joint in zip(joints, change.parts.constraints, strict=True):
            self._joints[number] = build_constraint(joint, of_index[joint.a], of_index[joint.b])
            self._space.add(self._joints[number])
        for number, body in zip(bodies, change.parts.bodies, strict=True):
            set_mass(self._bodies[number], body)  # shapes with masses have changed it
            place(self._bodies[number], body)
        self._name_bodies()

    def _set(self, settings: list[Setting]) -> None:
        """Set what the program set."""
        if not settings:
            return
        row_of = {number: row for row, number in enumerate(self.numbers.tolist())}
        changes: dict[int, list[Setting]] = {}
        for setting in settings:
            changes.setdefault(setting.body, []).append(setting)
        for number, changed in changes.items():
            if number not in row_of:  # it came with this step, described as it is
                continue
            row = self.now[row_of[number]]
            values = {name: np.atleast_1d(row[name]).tolist() for name in _CHANGEABLE}
            for setting in changed:
                values[setting.name][setting.component] = setting.value(values[setting.name][setting.component])
            _write(self._bodies[number], values, {setting.name for setting in changed})

    def _drive(self, driven: Numbers, rows: Rows) -> None:
        """Put bodies where they were."""
        if not len(driven):
            return
        for number, row in zip(self._script.numbers(rows["id"]).tolist(), rows, strict=True):
            if number in driven:
                values = {name: np.atleast_1d(row[name]).tolist() for name in _CHANGEABLE}
                _write(self._bodies[number], values, {"position", "angle", "velocity", "spin"})


def _write(body: pymunk.Body, values: dict[str, list[float]], names: set[str]) -> None:
    """Give a body the values of some of _CHANGEABLE."""
    if names & {"position", "angle"}:
        _move(body, values["position"], values["angle"][0])
    for name, attribute in (("spin", "angular_velocity"), ("mass", "mass"), ("moment", "moment")):
        if name in names:
            setattr(body, attribute, values[name][0])
    if "velocity" in names:
        body.velocity = values["velocity"][0], values["velocity"][1]


def _move(body: pymunk.Body, center: Sequence[float], angle: float) -> None:
    """Put a body's centre of gravity somewhere, without rounding errors of where its origin is."""
    center_of_gravity = body.center_of_gravity
    body.center_of_gravity = (0, 0)
    body.position = center[0], center[1]
    body.center_of_gravity = center_of_gravity
    body.angle = angle  # which computes where the origin is


def replay(script: Script, variant: Variant, since: Numbers, count: int) -> Motion:
    """Return where bodies are if the first steps are done again. since: see `replayable`."""
    stage, motion = Stage(script, variant), Motion.empty(count, len(since))
    for number in range(count):
        stage.step(number, np.flatnonzero(since < number))
        motion.put(number, stage.numbers, stage.now)
    stage.close()
    return motion


def replayable(script: Script) -> Numbers:
    """Return, for each body, the first step after which it is not where the same step done again puts it.

    What moves it is not in the recording, or is no longer the same, and so for what touches it or is joined to it from
    then on. From the next step on, all of them go where they went. If there is no such step, the number of steps.
    """
    stage, since = Stage(script, Variant()), np.full(len(script.roster.bodies), len(script.steps))
    again = Motion.empty(*script.recorded.place.shape)
    for number in range(len(script.steps)):
        for body in script.retyped.get(number, []):
            since[body] = min(since[body], number - 1)
        stage.step(number, np.flatnonzero(since < number))
        again.put(number, stage.numbers, stage.now)
        off = np.abs(again.place[number] - script.recorded.place[number]) > SAME * script.sizes
        off |= np.abs(again.angle[number] - script.recorded.angle[number]) > SAME
        since[off & (since > number)] = number
        _spread(since, script.pairs(number), number)
    stage.close()
    return since


def _spread(since: Numbers, pairs: Numbers, number: int) -> None:
    """Let what was put where it was by a step concern what touches it."""
    while True:
        first, second = (since[pairs] <= number).T
        reached = np.concatenate([pairs[first & ~second, 1], pairs[second & ~first, 0]])
        if not len(reached):
            return
        since[reached] = number


def distance(outlines: Sequence[Complexes], first: Motion, second: Motion) -> Floats:
    """Return how far apart the points of bodies are at most, (steps, bodies) px; NaN where one is not there."""
    apart = np.abs(first.place - second.place)
    for body, points in enumerate(outlines):
        if len(points) > 1 or points[0]:
            turn = np.exp(1j * first.angle[:, body]) - np.exp(1j * second.angle[:, body])
            shift = (first.place - second.place)[:, body]
            apart[:, body] = np.abs(shift[:, None] + turn[:, None] * points).max(axis=1)
    return apart
