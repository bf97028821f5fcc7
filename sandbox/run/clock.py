"""The times of a run's steps, at a rate that may change."""

from bisect import bisect_right


class Clock:
    """Converts numbers of steps to times in s, and back.

    >>> clock = Clock(60)
    >>> clock.change(120, 240)
    >>> clock.time(120), clock.time(240), clock.step(2.5)
    (2.0, 2.5, 240)
    """

    def __init__(self, rate: int) -> None:
        self._steps = [0]  # at which each rate begins
        self._times = [0.0]  # s, of these steps
        self._rates = [rate]

    def change(self, step: int, rate: int) -> None:
        """Continue at another rate from a step on, which must not be before the last change."""
        self._times.append(self.time(step))
        self._steps.append(step)
        self._rates.append(rate)

    def time(self, step: int) -> float:
        """Return the time of a step, s."""
        span = bisect_right(self._steps, step) - 1
        return self._times[span] + (step - self._steps[span]) / self._rates[span]

    def step(self, time: float) -> int:
        """Return the step nearest to a time in s."""
        span = max(bisect_right(self._times, time) - 1, 0)
        return self._steps[span] + round((time - self._times[span]) * self._rates[span])
