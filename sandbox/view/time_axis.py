"""The axis of time that the charts share: all of a run, or the part that one has zoomed into."""

from typing import Final, TypeVar

import numpy as np
from pygame import Rect

from sandbox.state import Floats

MAX_FIRST_SECONDS: Final = 60.0  # on the axis at the start of a run
MIN_SECONDS: Final = 0.1  # on the axis, however far one zooms in
Time = TypeVar("Time", float, Floats)  # s


class TimeAxis:
    """Which times are shown. selection: two times (s), marked; time: at the cursor, s."""

    def __init__(self, seconds: float) -> None:
        self.selection: tuple[float, float] | None = None
        self.time = 0.0
        self._zoom: tuple[float, float] | None = None  # start and length, s; None shows all
        self._seconds = min(seconds, MAX_FIRST_SECONDS)  # of all

    @property
    def shown(self) -> tuple[float, float]:
        """The first time shown and how many seconds from there on, s."""
        return self._zoom or (0.0, self._seconds)

    def x(self, plot: Rect, time: Time) -> Time:
        """Return where a time (s) is in a chart, px."""
        start, seconds = self.shown
        return plot.x + (time - start) / seconds * (plot.width - 1)

    def column(self, plot: Rect, time: float) -> int:
        """Return the column of a chart in which a time (s) is."""
        return round(self.x(plot, time))

    def time_at(self, plot: Rect, x: int) -> float:
        """Return the time (s) of a column, clamped to what is shown."""
        start, seconds = self.shown
        return start + min(max((x - plot.x) / plot.width, 0.0), 1.0) * seconds

    def show_as(self, other: "TimeAxis") -> None:
        """Show the same part of the time as another axis."""
        self._zoom, self._seconds = other._zoom, other._seconds

    def zoom(self, time: float, factor: float) -> None:
        """Make the axis longer or shorter by a factor, with a time (s) in its place; at most all is shown."""
        start, seconds = self.shown
        self._show(time - (time - start) * factor, seconds * factor)

    def zoom_to_selection(self) -> None:
        """Show what is selected; if that is a moment, show all."""
        if self.selection:
            first, last = sorted(self.selection)
            self.selection = None
            self._show(first, last - first if last - first >= MIN_SECONDS else np.inf)

    def _show(self, start: float, seconds: float) -> None:
        if seconds >= self._seconds:
            self._zoom = None
        else:
            seconds = max(seconds, MIN_SECONDS)
            self._zoom = min(max(start, 0.0), self._seconds - seconds), seconds

    def follow(self, time: float, latest: float) -> None:
        """Let the axis include the latest sample, and a part that is shown follow the cursor out of it. Times: s."""
        while self._seconds < latest:
            self._seconds *= 2
        if self._zoom and self.time <= sum(self._zoom) < time:
            self._zoom = time - self._zoom[1] / 10, self._zoom[1]
        self.time = time
