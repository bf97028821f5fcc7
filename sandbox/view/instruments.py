"""The instruments: what the chart can show of a run, one entry each; its linear axis, and its histogram of speeds."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from sandbox.analysis.gas import expected_counts, speed_law, why_lawless
from sandbox.quantity import length
from sandbox.report.scales import Scale, Span, gap_scale, round_up
from sandbox.scene.units import Dimension, Units
from sandbox.session.history import Moment
from sandbox.session.samples import Quantity, Samples
from sandbox.state import Floats

LAW: Final = "theory"  # name of a law's line
ROUNDING: Final = 1e-9  # of any unit; less is an engine's rounding error
TICKS: Final = 6  # of a linear axis, about
SLACK: Final = 0.05  # of the distance of two ticks, by which a line may leave the axis before that grows
MIN_BALLS: Final = 50  # fewer make no histogram
MIN_BINS: Final = 8
MAX_BINS: Final = 24
REACH: Final = 3.0  # length of the axis in units of the root mean square speed; faster balls are in the last bin
MAX_PEAK: Final = 1.8  # of the axis of counts, in units of the law's peak
CURVE_POINTS: Final = 120


@dataclass(frozen=True)
class Instrument:
    """What the chart can show over time or, without values, of the step shown.

    values: of each engine in the samples, before they are scaled to the unit. digits: how a value is written. scale:
    of the axis, by default linear. is_relative: whether values are against the reference, which then has no line.
    """

    name: str
    meaning: str
    unit: Dimension | str
    values: Callable[[Samples], Floats] | None = None
    digits: str = "{:,.6g}"
    scale: Callable[[Units], Scale] = lambda _: Even()
    is_relative: bool = False

    def unit_in(self, units: Units) -> str:
        """Return what its numbers are."""
        return units.name(self.unit) if isinstance(self.unit, Dimension) else self.unit

    def scaled(self, samples: Samples, units: Units) -> Floats:
        """Return the values in the unit: (samples, engines)."""
        factor = units.factor(self.unit) if isinstance(self.unit, Dimension) else 1.0
        return factor * self.values(samples) if self.values else np.empty((0, 0))

    def heading(self, samples: Samples, units: Units) -> str:
        """Return what is written over the chart."""
        against = "the start" if samples.is_alone else samples.reference
        return f"{self.name}, {self.unit_in(units)}{f' against {against}' * self.is_relative}"

    def columns(self, samples: Samples) -> dict[str, int]:
        """Return the column of each line by the name at its end."""
        hidden = samples.reference if self.is_relative and not samples.is_alone else None
        return {name: k for k, name in enumerate(samples.engines) if name != hidden}

    def text(self, value: float, units: Units) -> str:
        """Return a value as it is written; what is only rounding is 0."""
        if not np.isfinite(value):
            return "not known"
        return f"{self.digits.format(0.0 if abs(value) < ROUNDING else value)} {self.unit_in(units)}"


def _of(quantity: Quantity) -> Callable[[Samples], Floats]:
    return lambda samples: samples.of(quantity)


ENERGY: Final = Instrument(
    "energy", "kinetic and potential, from the lowest place that a ball can reach", Dimension.ENERGY,
    _of(Quantity.ENERGY),
)  # fmt: skip
ERROR: Final = Instrument(
    "error",
    "of the energy, in % of the largest kinetic energy that the reference has had by then;\n"
    "more than 100 % can be missing where balls fall, as height is lost too", "%",
    Samples.errors, "{:+.4g}", is_relative=True,
)  # fmt: skip
GAP: Final = Instrument(
    "gap", "how far its balls are off, at most", Dimension.LENGTH, _of(Quantity.GAP), "{:.4g}", gap_scale,
    is_relative=True,
)  # fmt: skip
MOMENTUM: Final = Instrument(
    "momentum",
    "its size, of all balls together; walls and gravity change it",
    Dimension.MOMENTUM,
    _of(Quantity.MOMENTUM),
)
SPEEDS: Final = Instrument("speeds", "how many balls have each speed, beside the law", Dimension.VELOCITY)
INSTRUMENTS: Final = (
    ENERGY,
    Instrument("kinetic energy", "of flight and spin", Dimension.ENERGY, _of(Quantity.KINETIC)),
    *(ERROR, GAP, MOMENTUM, SPEEDS),
)


class Histogram(NamedTuple):
    """How many balls have each speed.

    end, top: of the axes, px/s and balls; lines: the points of each engine, and of the law if it applies, px/s and
    balls; refusal: why there are no lines, or why there is no law, or "".
    """

    end: float
    top: float
    lines: dict[str, tuple[Floats, Floats]]
    refusal: str


@lru_cache(maxsize=1)
def histogram_of(moment: Moment, reference: str) -> Histogram:
    """Count the speeds of a moment's engines. The law's energy is the reference's, or the last engine's without it."""
    n, speeds = len(moment.scene.bodies), {name: length(state.velocity) for name, state in moment.states.items()}
    whole = float(np.sqrt(np.sum(speeds.get(reference, next(reversed(speeds.values()))) ** 2)))  # of a single ball
    if n < MIN_BALLS:
        balls = "one ball is" if n == 1 else f"{n} balls are"
        return Histogram(1.0, 1.0, {}, f"{balls} too few: {MIN_BALLS} make a histogram")
    if not 0 < whole < np.inf:
        return Histogram(1.0, 1.0, {}, "nothing moves")
    edges = np.linspace(0.0, REACH * whole / np.sqrt(n), min(max(round(np.sqrt(n)), MIN_BINS), MAX_BINS) + 1)
    counts = {name: np.histogram(np.minimum(each, edges[-1]), edges)[0].astype(float) for name, each in speeds.items()}
    highest, lines, lawless = max(float(count.max()) for count in counts.values()), {}, why_lawless(moment.scene)
    if not lawless:  # in the middle of a bin, what the law expects there
        half, highest = edges[1] / 2, min(highest, MAX_PEAK * float(expected_counts(edges, whole, n).max()))
        speed = np.linspace(half, edges[-1] - half, CURVE_POINTS)
        lines[LAW] = speed, n * (speed_law(speed + half, whole, n) - speed_law(speed - half, whole, n))
    top = round_up(max(1.0, highest))  # an engine that leaves the law behind is cut off there
    outline = np.repeat(edges, 2)[1:-1]
    lines |= {name: (outline, np.minimum(np.repeat(count, 2), top)) for name, count in counts.items()}
    return Histogram(float(edges[-1]), top, lines, f"no law: {lawless}" if lawless else "")


@dataclass(frozen=True)
class Even:
    """A linear axis from 0, or from the lowest value if that is negative, with ticks at round numbers."""

    def position(self, value: Floats) -> Floats:
        """Return the values."""
        return value

    def span(self, low: float, high: float) -> Span:
        """Return whole numbers of steps between ticks."""
        low, high = min(low, 0.0) if np.isfinite(low) else 0.0, max(high, 0.0) if np.isfinite(high) else 0.0
        if high - low < ROUNDING:
            return low, low + 1.0
        step = self._step((low, high))
        return step * float(np.floor(low / step + SLACK)), step * float(np.ceil(high / step - SLACK))

    @staticmethod
    def _step(span: Span) -> float:
        return round_up((span[1] - span[0]) / TICKS)

    def ticks(self, span: Span) -> list[tuple[float, str]]:
        """Return round numbers: the ends first, then 0, then from the highest down."""
        step = self._step(span)
        numbers = 0.0 + step * np.arange(np.ceil(span[0] / step - 1e-9), np.floor(span[1] / step + 1e-9) + 1)
        lowest, *others = numbers.tolist()
        between = sorted(others[:-1], key=lambda at: (at != 0, -at))
        end = max(map(abs, span))
        power = 3 * int(np.log10(end) / 3) if end >= 1e6 else 0  # of ten, which all numbers of the axis then have
        return [
            (at, f"{at / 10**power:,.6g}{f'e{power}' if power and at else ''}")
            for at in [*others[-1:], lowest, *between]
        ]
