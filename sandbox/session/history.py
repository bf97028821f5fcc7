"""The moments of a run, in bounded memory: all recent ones, and one in so many of the older ones."""

from dataclasses import dataclass, field
from typing import Final, NamedTuple

from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.state import State

MAX_RECENT: Final = 1200  # moments kept without gaps: twenty seconds at 60 steps per second
MAX_BYTES_KEPT: Final = 12_000_000  # of recent moments, and as much again of older ones
MOMENT_BYTES: Final = 1_500  # approximate size of a moment without its arrays, and the same again for each engine
STATE_BYTES: Final = 48  # of a ball: its place, velocity, angle and spin


class Reading(NamedTuple):
    """An engine at a step.

    work: what mouse and edits have added to its energy; stands: why it stands still, or nothing.
    """

    state: State
    energy: float  # kg px²/s², as is the work
    work: float
    stands: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """One step of a run, as it is shown.

    engines: what each is; balls: each ball's number among all that ever were in the run. held: the ball that the mouse
    holds, pulled to target (px). suspended: why an engine cannot run the scene as it is. is_complete: whether it has
    the engine that is computed beside the others.
    """

    step: int
    time: float  # s
    scene: Scene
    engines: dict[str, Reading]
    balls: tuple[int, ...]
    held: int | None
    target: Vector
    suspended: dict[str, str] = field(default_factory=dict)
    is_complete: bool = True

    @property
    def states(self) -> dict[str, State]:
        """The state of each engine that can run the scene."""
        return {name: reading.state for name, reading in self.engines.items()}

    @property
    def running(self) -> dict[str, Reading]:
        """The engines that have not come to a stand."""
        return {name: reading for name, reading in self.engines.items() if not reading.stands}

    @property
    def size(self) -> int:
        """Its approximate size in bytes."""
        of_engine = MOMENT_BYTES + STATE_BYTES * len(self.balls)
        return of_engine * len(self.engines) + 8 * len(self.balls) + MOMENT_BYTES


class History:
    """Moments by their step: all recent ones, and one in so many of the older ones, fewer the more there are."""

    def __init__(self) -> None:
        self._recent: dict[int, Moment] = {}  # in the order in which they were kept
        self._older: dict[int, Moment] = {}
        self._stride = 1  # of the older ones

    def keep(self, moment: Moment) -> None:
        """Keep a moment, in place of any kept for its step."""
        self._drop(moment.step)
        self._recent[moment.step] = moment
        most = max(1, min(MAX_RECENT, MAX_BYTES_KEPT // moment.size))  # moments of a run are of about one size
        while len(self._recent) > most:
            oldest = self._recent.pop(next(iter(self._recent)))
            if oldest.step % self._stride == 0:
                self._older[oldest.step] = oldest
        while len(self._older) > max(1, MAX_BYTES_KEPT // moment.size):
            self._stride *= 2
            self._older = {step: kept for step, kept in self._older.items() if step % self._stride == 0}

    def complete(self, moment: Moment, completed: Moment) -> None:
        """Keep a moment that now has every engine in the place of the same one without, if that is still kept."""
        for kept in (self._recent, self._older):
            if kept.get(moment.step) is moment:
                kept[moment.step] = completed

    def nearest(self, step: int) -> Moment:
        """Return the moment nearest to a step; at least one must be kept."""
        exact = self._recent.get(step) or self._older.get(step)
        return exact or min((*self._recent.values(), *self._older.values()), key=lambda moment: abs(moment.step - step))

    def between(self, first: int, last: int) -> list[Moment]:
        """Return the moments kept between two steps, both included, in order."""
        steps = range(first, last + 1)
        return [kept for step in steps if (kept := self._recent.get(step) or self._older.get(step))]

    def drop(self, moment: Moment) -> None:
        """Drop a moment, if it is still kept."""
        if moment is (self._recent.get(moment.step) or self._older.get(moment.step)):
            self._drop(moment.step)

    def drop_from(self, step: int) -> None:
        """Drop a step and all after it."""
        for kept in [*self._recent, *self._older]:
            if kept >= step:
                self._drop(kept)

    def _drop(self, step: int) -> None:
        self._recent.pop(step, None)
        self._older.pop(step, None)
