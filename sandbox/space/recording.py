"""Recording the steps of any `pymunk.Space`: its state before and after each step, and the impulses.

Handlers and callbacks stay as they are. Bodies and constraints may come and go between steps, and within them.
"""

import math
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final

import pymunk

from sandbox.space.memory import Snapshot, SpaceMemory
from sandbox.space.roster import Roster

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

    @property
    def end(self) -> float:
        """When it ends, s."""
        return self.time + self.dt


class Recording:
    """The last steps of a Space, as many as `max_bytes` and `max_seconds` (of its time) allow.

    Bodies are known by `pymunk.Body.id`, constraints by `joint_key`; the roster has them, and what they are. steps:
    those that are kept, in the order of time; count: of all that were recorded; bytes: the size of the snapshots.
    """

    def __init__(self, space: pymunk.Space, *, max_bytes: float = MAX_BYTES, max_seconds: float = MAX_SECONDS) -> None:
        self._space, self._memory = space, SpaceMemory(space)
        self._max_bytes, self._max_seconds = max_bytes, max_seconds
        self.steps: deque[Step] = deque()
        self.bytes = self.count = 0
        self._time = 0.0
        self.roster = Roster(space)

    @property
    def dropped(self) -> int:
        """The number of steps that are no longer kept."""
        return self.count - len(self.steps)

    def record(self, step: Callable[[float], None], dt: float) -> None:
        """Call a Space's own `step`, and record what it does. dt: s; a step of 0 s does nothing and is not recorded.

        If dt is below 0 or not finite, or if a callback of the program raises in the step, it is not recorded either.
        """
        if not 0 < dt < math.inf:
            step(dt)
            return
        before = self._memory.snapshot()
        self.roster.look(before.fingerprint)
        step(dt)
        after = self._memory.snapshot()
        if self.steps and before == self.steps[-1].after:
            before = self.steps[-1].after  # share it: the program changed nothing
        else:
            self.bytes += before.bytes
        self.bytes += after.bytes
        self.steps.append(Step(self.count, self._time, dt, before, after))
        self.count += 1
        self._time += dt
        while len(self.steps) > 1 and not self._fits():
            self._drop()

    def body(self, body_id: int) -> pymunk.Body | None:
        """Return a body by its `id`; None for a static body of the Space's own."""
        return self.roster.by_id.get(body_id)

    def joint(self, key: int) -> pymunk.Constraint:
        """Return a constraint by its `key`."""
        self.roster.look(self._memory.snapshot().fingerprint)
        return self.roster.by_key[key]

    def __len__(self) -> int:
        return len(self.steps)

    def __iter__(self) -> Iterator[Step]:
        return iter(self.steps)

    def _fits(self) -> bool:
        return self.bytes <= self._max_bytes and self._time - self.steps[0].time <= self._max_seconds

    def _drop(self) -> None:
        first = self.steps.popleft()
        self.bytes -= first.before.bytes
        if self.steps[0].before is not first.after:
            self.bytes -= first.after.bytes
