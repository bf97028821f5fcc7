"""How fast the time of a scene really passes on the screen."""

import math
from collections.abc import Callable
from time import perf_counter
from typing import Final

MEASURED_SECONDS: Final = 1.0  # so long is measured before the number changes
KEPT_UP: Final = 0.95  # share of the speed asked for, below which the machine does not keep up


class Pace:
    """Measures how many seconds of a scene pass in a second on the screen, while nothing interrupts them.

    measured: over the last second or so; None until a second has passed since `restart`. clock: returns s.
    """

    def __init__(self, clock: Callable[[], float] = perf_counter) -> None:
        self._clock = clock
        self.restart()

    def restart(self) -> None:
        """Measure afresh from the next frame on: time stood still, jumped, or was asked to pass at another speed."""
        self.measured: float | None = None
        self._begun: tuple[float, float] | None = None  # s on the screen, s of the scene

    def observe(self, time: float) -> None:
        """Note the time of the scene (s) in a frame."""
        now = self._clock()
        if self._begun is None:
            self._begun = now, time
        elif now - self._begun[0] >= MEASURED_SECONDS:
            self.measured = (time - self._begun[1]) / (now - self._begun[0])
            self._begun = now, time

    def text(self, speed: float) -> str:
        """Return the speed asked for, which can be infinite, and the measured one if it is another."""
        measured = self.measured
        if speed == math.inf:
            return "fastest" if measured is None else f"fastest, {_rounded(measured)} x"
        if measured is None or measured >= KEPT_UP * speed:
            return f"{speed:g} x"
        return f"{_rounded(measured)} x, as {speed:g} x is too fast here"


def _rounded(measured: float) -> str:
    return f"{float(f'{measured:.2g}'):g}"
