"""Recording the steps of any `pymunk.Space`: its state before and after each step, and the impulses.

Handlers and callbacks stay as they are. Bodies and constraints may come and go between steps, and within them.
"""

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final

import pymunk

from sandbox.space.memory import Snapshot, SpaceMemory, joint_key

MAX_BYTES: Final = 1_000_000_000  # of snapshots, by default
MAX_SECONDS: Final = 600.0  # of the Space's time, by default


@dataclass(frozen=True, slots=True)
class Step:
    """One call of `Space.step`: from `time` on, `dt` s long; the Space just before and just after it."""

    number: int  # from 0, of all steps
    time: float
    dt: float
    before: Snapshot
    after: Snapshot


class Recording:
    """The last steps of a Space, as many as `max_bytes` and `max_seconds` (of its time) allow.

    Bodies are known by `pymunk.Body.id`, constraints by `joint_key`. All that were seen are kept alive, because Pymunk
    would give their ids to others.
    """

    def __init__(self, space: pymunk.Space, *, max_bytes: float = MAX_BYTES, max_seconds: float = MAX_SECONDS) -> None:
        self._space, self._memory = space, SpaceMemory(space)
        self._max_bytes, self._max_seconds = max_bytes, max_seconds
        self._steps: deque[Step] = deque()
        self._bytes = self._count = 0
        self._time = 0.0
        self._bodies: dict[int, tuple[int, pymunk.Body]] = {}  # kept, so that no other body gets their id
        self._joints: dict[int, tuple[int, pymunk.Constraint]] = {}
        self._listed: tuple[list[pymunk.Body], list[pymunk.Constraint]] = [], []

    @property
    def steps(self) -> "deque[Step]":
        """The steps that are kept, in the order of time."""
        return self._steps

    @property
    def dropped(self) -> int:
        """The number of steps that are no longer kept."""
        return self._count - len(self._steps)

    @property
    def bytes(self) -> int:
        """The size of the snapshots."""
        return self._bytes

    def record(self, step: Callable[[float], None], dt: float) -> None:
        """Call a Space's own `step`, and record what it does. dt: s; a step of 0 s does nothing and is not recorded.

        If a callback of the program raises in the step, the step is not recorded.
        """
        if dt == 0:
            step(dt)
            return
        self._name_new()
        before = self._memory.snapshot()
        step(dt)
        after = self._memory.snapshot()
        if self._steps and before == self._steps[-1].after:
            before = self._steps[-1].after  # share it: the program changed nothing
        else:
            self._bytes += before.bytes
        self._bytes += after.bytes
        self._steps.append(Step(self._count, self._time, dt, before, after))
        self._count += 1
        self._time += dt
        while len(self._steps) > 1 and not self._fits():
            self._drop()

    def body(self, body_id: int) -> pymunk.Body | None:
        """Return a body by its `id`; None for a static body of the Space's own."""
        return self._bodies[body_id][1] if body_id in self._bodies else None

    def body_number(self, body_id: int) -> int | None:
        """Return the number of a body, in the order in which the bodies were first seen, from 0."""
        return self._bodies[body_id][0] if body_id in self._bodies else None

    def joint(self, key: int) -> pymunk.Constraint:
        """Return a constraint by its `key`."""
        self._name_new()
        return self._joints[key][1]

    def joint_number(self, key: int) -> int:
        """Return the number of a constraint, in the order in which they were first seen, from 0."""
        self._name_new()
        return self._joints[key][0]

    def __len__(self) -> int:
        return len(self._steps)

    def __iter__(self) -> Iterator[Step]:
        return iter(self._steps)

    def _fits(self) -> bool:
        return self._bytes <= self._max_bytes and self._time - self._steps[0].time <= self._max_seconds

    def _drop(self) -> None:
        first = self._steps.popleft()
        self._bytes -= first.before.bytes
        if self._steps[0].before is not first.after:
            self._bytes -= first.after.bytes

    def _name_new(self) -> None:
        listed = list(self._space.bodies), list(self._space.constraints)
        if listed == self._listed:
            return
        self._listed = listed
        for body in listed[0]:
            self._bodies.setdefault(body.id, (len(self._bodies), body))
        for joint in listed[1]:
            self._joints.setdefault(joint_key(joint), (len(self._joints), joint))
