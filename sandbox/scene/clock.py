"""The times of a run's steps, which may be of different lengths."""

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from sandbox.state import Floats, Integers
from sandbox.text import counted

ROUNDING: Final = 1e-6  # of a step, by which a time that is meant to be the end of a step may be after it


class Clock:
    """Converts numbers of steps to times in s, and back.

    Steps of one length form a span: k steps of it end k / rate after it begins, so that their times are rounded once.
    Each edit begins a span too: the engines built for it count their steps from there, and so round alike.

    >>> clock = Clock(60)
    >>> clock.change(120, 240)
    >>> clock.time(120), clock.time(240), clock.step(2.5)
    (2.0, 2.5, 240)
    """

    def __init__(self, rate: float) -> None:
        self._steps = np.array([0])  # before each span
        self._times = np.array([0.0])  # s, when each begins
        self._rates = np.array([float(rate)])  # steps per second

    def change(self, step: int, rate: float | None = None) -> None:
        """Begin a span at a step, which must not be before the last one begins; None: of the same rate."""
        rate = float(self._rates[-1]) if rate is None else rate
        self._times = np.append(self._times, self.time(step))
        self._steps = np.append(self._steps, step)
        self._rates = np.append(self._rates, float(rate))

    def __str__(self) -> str:
        """Return how long the first steps are: "at 60 steps a second"."""
        return f"at {counted(int(self._rates[0]), 'step')} a second"

    def time(self, step: int) -> float:
        """Return the time of a step, s."""
        return float(self.times(step)) if len(self._steps) > 1 else step / float(self._rates[0])

    def times(self, steps: ArrayLike) -> Floats:
        """Return the times of some steps, s."""
        span = np.searchsorted(self._steps, steps, side="right") - 1
        times: Floats = self._times[span] + (steps - self._steps[span]) / self._rates[span]
        return times

    def rates(self, steps: ArrayLike) -> Floats:
        """Return 1 / the length of each of some steps, 1/s; step 1 is the first."""
        span = np.searchsorted(self._steps, steps, side="left") - 1
        rates: Floats = self._rates[np.maximum(span, 0)]
        return rates

    def steps(self, time: float) -> float:
        """Return how many steps are done at a time in s, with the part of the one that is not."""
        span = max(int(np.searchsorted(self._times, time, side="right")) - 1, 0)
        return float(self._steps[span] + (time - self._times[span]) * self._rates[span])

    def step(self, time: float) -> int:
        """Return the step nearest to a time in s."""
        return round(self.steps(time))

    def steps_containing(self, times: Floats | float) -> Integers:
        """Return the step in which each time (s) lies: the first that ends no sooner, counted from 1."""
        span = np.maximum(np.searchsorted(self._times, times, side="left") - 1, 0)
        since = np.ceil((times - self._times[span]) * self._rates[span] - ROUNDING).astype(np.int64)
        step = self._steps[span] + since
        steps: Integers = np.maximum(step + (times > self.times(step)), 1)
        return steps
