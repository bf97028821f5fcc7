"""Snapshots: moments of a run to return to, with what had been done until then."""

from dataclasses import dataclass
from typing import Final

from sandbox.run.inputs import Input
from sandbox.view.notice import Kind, Notice
from sandbox.view.playback import Playback

MAX_SNAPSHOTS: Final = 8  # more, and the earliest goes


@dataclass(frozen=True, eq=False)
class Snapshot:
    """A step, its time (s), and the inputs up to it, from which the engines run again to the same bits."""

    step: int
    time: float
    inputs: tuple[Input, ...]


class Snapshots:
    """The snapshots of a scene's runs, the earliest taken first."""

    def __init__(self, playback: Playback, notice: Notice) -> None:
        self._playback = playback
        self._notice = notice
        self.taken: list[Snapshot] = []

    def take(self) -> None:
        """Take a snapshot of the step shown."""
        session = self._playback.session
        snapshot = Snapshot(session.step, self._playback.view.moment.time, tuple(session.given()))
        self.taken = [*self.taken, snapshot][-MAX_SNAPSHOTS:]
        self._notice.show(f"snapshot at {snapshot.time:.2f} s: 4, or the page Scene, returns to it", Kind.DONE)

    def return_to_latest(self) -> None:
        """Return to the snapshot taken last."""
        if self.taken:
            self.return_to(self.taken[-1])
        else:
            self._notice.show("there is no snapshot; 3 takes one")

    def return_to(self, snapshot: Snapshot) -> None:
        """Pause, and go to a snapshot; what was done otherwise since then is dropped."""
        self._playback.paused = True
        self._playback.return_to(snapshot.step, snapshot.inputs)

    def forget(self) -> None:
        """Forget all, as another scene runs."""
        self.taken = []
