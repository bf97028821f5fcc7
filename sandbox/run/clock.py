"""When the steps of a run are: 1/rate of a second apart, at a rate that may change."""

from bisect import bisect_right


class Clock:
    """Steps -> s, and back.

    >>> clock = Clock(60)
    >>> clock.change(120, 240)
    >>> clock.time(120), clock.time(240), clock.step(2.5)
    (2.0, 2.5, 240)
    """

    def __init__(self, rate: int) -> None:
        self._steps = [0]  # since which each rate holds
        self._times = [0.0]  # s, then
        self._rates = [rate]

    def change(self, step: int, rate: int) -> None:
        """Go on at another rate from a step on, which is none before the last change."""
        self._times.append(self.time(step))
        self._steps.append(step)
        self._rates.append(rate)

    def time(self, step: int) -> float:
        """Return when a step is reached, s."""
        span = bisect_right(self._steps, step) - 1
        return self._times[span] + (step - self._steps[span]) / self._rates[span]

    def step(self, time: float) -> int:
        """Return the step that is nearest to a time (s)."""
        span = max(bisect_right(self._times, time) - 1, 0)
        return self._steps[span] + round((time - self._times[span]) * self._rates[span])
