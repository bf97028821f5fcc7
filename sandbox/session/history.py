"""What a run has shown, kept in bounded memory: all recent moments, and of the older ones every so many-th."""

from dataclasses import dataclass
from typing import Final

from sandbox.scene.model import Scene, Vector
from sandbox.state import Contacts, State

RECENT: Final = 1200  # moments kept one by one: twenty seconds at 60 steps a second
BYTES: Final = 12_000_000  # of recent moments, and as much again of older ones
OVERHEAD: Final = 1_500  # bytes of a moment without its arrays, about, and as much again for each engine


@dataclass(frozen=True, slots=True)
class Moment:
    """One step of a run, as it is shown.

    states, contacts (found in the step that led here), counts (of contacts so far): of each engine. balls: which
    each ball is of all that there ever were. held: the ball in the hand, pulled to target (px).
    """

    step: int
    time: float  # s
    scene: Scene
    states: dict[str, State]
    contacts: dict[str, Contacts]
    counts: dict[str, int]
    balls: tuple[int, ...]
    held: int | None
    target: Vector

    @property
    def size(self) -> int:
        """About how many bytes it takes."""
        states = sum(state.position.nbytes + state.velocity.nbytes for state in self.states.values())
        contacts = sum(found.nbytes for found in self.contacts.values())
        return states + contacts + 8 * len(self.balls) + OVERHEAD * (1 + len(self.states))


class History:
    """Moments by their step. Whenever the older ones become too many, every second of them is forgotten."""

    def __init__(self) -> None:
        self._recent: dict[int, Moment] = {}  # in the order in which they were kept
        self._older: dict[int, Moment] = {}
        self._recent_bytes = 0
        self._older_bytes = 0
        self._stride = 1  # of the older ones

    def keep(self, moment: Moment) -> None:
        """Remember a moment, in place of what was remembered of its step."""
        self._forget(moment.step)
        self._recent[moment.step] = moment
        self._recent_bytes += moment.size
        while len(self._recent) > 1 and (len(self._recent) > RECENT or self._recent_bytes > BYTES):
            oldest = self._recent.pop(next(iter(self._recent)))
            self._recent_bytes -= oldest.size
            if oldest.step % self._stride == 0:
                self._older[oldest.step] = oldest
                self._older_bytes += oldest.size
        while len(self._older) > 1 and self._older_bytes > BYTES:
            self._stride *= 2
            self._older = {step: kept for step, kept in self._older.items() if step % self._stride == 0}
            self._older_bytes = sum(kept.size for kept in self._older.values())

    def nearest(self, step: int) -> Moment:
        """Return the moment that is nearest to a step; at least one must be kept."""
        exact = self._recent.get(step) or self._older.get(step)
        return exact or min((*self._recent.values(), *self._older.values()), key=lambda one: abs(one.step - step))

    def between(self, first: int, last: int) -> list[Moment]:
        """Return the moments that are kept of some steps, in order."""
        steps = range(first, last + 1)
        return [kept for step in steps if (kept := self._recent.get(step) or self._older.get(step))]

    def forget_from(self, step: int) -> None:
        """Forget a step and all after it."""
        for kept in [*self._recent, *self._older]:
            if kept >= step:
                self._forget(kept)

    def _forget(self, step: int) -> None:
        if step in self._recent:
            self._recent_bytes -= self._recent.pop(step).size
        if step in self._older:
            self._older_bytes -= self._older.pop(step).size
