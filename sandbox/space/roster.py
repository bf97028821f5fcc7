"""What is in a Space while it is recorded: bodies, shapes and joints have numbers, and are described when they come."""

from bisect import bisect_right
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import pymunk

from sandbox.errors import SandboxError
from sandbox.scene.from_pymunk import SpaceContents, contents_of
from sandbox.space.description import (
    Parts,
    SpaceDescription,
    bodies_of,
    describe,
    describe_body,
    describe_constraint,
    describe_shape,
    shapes_of,
)
from sandbox.space.memory import joint_key, shape_address, shape_fingerprints

MAX_DESCRIBED: Final = 10_000  # bodies, shapes and joints, which take some 0.1 ms each
MAX_READ: Final = 100_000  # shapes in all readings for a scene, which take some 25 µs each

Numbers = tuple[list[int], list[int], list[int]]  # of bodies, shapes and joints


@dataclass(frozen=True)
class Change:
    """What was removed from a Space and then added to it before a step, and shapes that changed, by numbers.

    parts: describes what was added, in the order of its numbers, then the shapes that changed; indices of bodies in it
    are numbers. Its bodies may only have joints in the Space. boxes: where the Space looks for the shapes that changed.
    """

    removed: Numbers
    added: Numbers
    changed: list[int]
    parts: Parts
    boxes: list[pymunk.BB]


class Roster:
    """Follows what is in a Space, and keeps it, because Pymunk would give the ids of what is gone to others.

    bodies (also those that only have a shape or a joint in it), shapes, joints: the number of each, in the order in
    which they came, from 0; by_id, by_key, by_address: bodies, joints and shapes as snapshots name them; start: the
    whole Space before its first step; changes: by the number of the step before which they were; why_not: why what came
    before step `until` and later is not described, if so; read_until: the step from which on what a scene can have is
    no longer read, after too many changes, else None.
    """

    def __init__(self, space: pymunk.Space) -> None:
        self._space = space
        self.bodies: dict[pymunk.Body, int] = {}
        self.shapes: dict[pymunk.Shape, int] = {}
        self.joints: dict[pymunk.Constraint, int] = {}
        self.by_id: dict[int, pymunk.Body] = {}
        self.by_key: dict[int, pymunk.Constraint] = {}
        self.by_address: dict[int, pymunk.Shape] = {}
        self.start: SpaceDescription | None = None
        self.changes: dict[int, list[Change]] = {}
        self.why_not, self.until = "", 0
        self.read_until: int | None = None
        self._described = self._read = 0
        self._contents: list[tuple[int, SpaceContents]] = []  # by the step before which they were
        self._seen: object = None
        self._prints = np.empty(0, np.uint64)  # their fingerprints
        self._listed: tuple[list[Any], list[Any], list[Any]] = [], [], []  # without shapes that have no body

    def look(self, step: int, fingerprint: int) -> None:
        """Look at what is new. step: the number of the next step; fingerprint: of the Space now, as SETTING has it."""
        callbacks = "begin", "pre_solve", "post_solve", "separate"
        handlers = [getattr(each, name) for each in self._space._handlers.values() for name in callbacks]
        if (fingerprint, handlers) == self._seen:
            return
        self._seen = fingerprint, handlers
        self._read_contents(step)
        listed = list(self._space.bodies), shapes_of(self._space), list(self._space.constraints)
        before, self._listed = self._listed, listed
        known = len(self.bodies)
        used = bodies_of(self._space)
        self._number(self.bodies, used)
        self._number(self.shapes, listed[1])
        self._number(self.joints, listed[2])
        self.by_id |= {body.id: body for body in used}
        self.by_key |= {joint_key(joint): joint for joint in listed[2]}
        new = list(self.shapes)[len(self.by_address) :]
        self.by_address |= {int(shape_address(shape)): shape for shape in new}
        if not self.why_not:
            try:
                self._describe(step, before, known)
            except SandboxError as error:
                self.why_not, self.until = str(error), step

    def contents(self, step: int) -> SpaceContents:
        """Return what a scene can have of the Space before a step, and what it cannot."""
        return self._contents[bisect_right(self._contents, step, key=lambda entry: entry[0]) - 1][1]

    def _read_contents(self, step: int) -> None:
        self._read += len(self._space.shapes)
        if self.read_until is None and self._contents and self._read > MAX_READ:
            self.read_until = step
        if self.read_until is None:
            self._contents.append((step, contents_of(self._space)))

    def _describe(self, step: int, before: tuple[list[Any], ...], known: int) -> None:
        """Describe what is new. known: the number of bodies before."""
        gone, new = _difference(before, self._listed), _difference(self._listed, before)
        changed = self._changed_shapes(set(new[1]))
        self._described += sum(map(len, new)) + len(changed)
        if self._described > MAX_DESCRIBED:
            raise SandboxError(f"more than {MAX_DESCRIBED:,} bodies, shapes and joints came into the Space, or changed")
        if self.start is None:
            self.start = describe(self._space)
            return
        guests = [body for body in list(self.bodies)[known:] if body.space is None]
        bodies, shapes, joints = [*new[0], *guests], new[1], new[2]
        number_of = {**self.bodies, self._space.static_body: None}
        parts = Parts(
            bodies=[describe_body(body, {}) for body in bodies],
            shapes=[describe_shape(shape, number_of) for shape in (*shapes, *changed)],
            constraints=[describe_constraint(joint, number_of) for joint in joints],
        )
        change = Change(
            removed=self._numbers(*gone),
            added=self._numbers(bodies, shapes, joints),
            changed=[self.shapes[shape] for shape in changed],
            parts=parts,
            boxes=[shape.bb for shape in changed],
        )
        self.changes.setdefault(step, []).append(change)

    def _changed_shapes(self, new: set[pymunk.Shape]) -> list[pymunk.Shape]:
        """Return the shapes in the Space, other than new ones, that are not what they were when it was looked at."""
        shapes = list(self.shapes)
        before, self._prints = self._prints, shape_fingerprints(np.array([*self.by_address], np.uint64))
        changed = np.flatnonzero(self._prints[: len(before)] != before).tolist()
        present = set(self._listed[1]) - new if changed else new
        return [shapes[number] for number in changed if shapes[number] in present]

    def _numbers(self, bodies: list[Any], shapes: list[Any], joints: list[Any]) -> Numbers:
        return (
            [self.bodies[body] for body in bodies],
            [self.shapes[shape] for shape in shapes],
            [self.joints[joint] for joint in joints],
        )

    @staticmethod
    def _number(register: dict[Any, int], things: list[Any]) -> None:
        for thing in things:
            register.setdefault(thing, len(register))


def _difference(of: tuple[list[Any], ...], without: tuple[list[Any], ...]) -> list[list[Any]]:
    """Return the bodies, shapes and joints that are only in the first lists."""
    return [
        [thing for thing in things if thing not in others] for things, others in zip(of, map(set, without), strict=True)
    ]
