"""The instruments: what the chart can show of a run, one entry each."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from sandbox.report.scales import BothSigns, Scale, Span, gap_scale, round_up
from sandbox.scene.units import Dimension, Units
from sandbox.session.samples import Quantity, Samples
from sandbox.state import Floats

LAW: Final = "theory"  # name of a law's line
ROUNDING: Final = 1e-9  # of any unit; less is an engine's rounding error
TICKS: Final = 6  # of a linear axis, about
SLACK: Final = 0.05  # of the distance of two ticks, by which a line may leave the axis before that grows


@dataclass(frozen=True)
class Instrument:
    """What the chart can show over time or, without values, of the step shown.

    values: of each engine in the samples from one on, before they are scaled to the unit. digits: how a value is
    written. logarithmic: its other scale, if it has one. is_relative: whether values are against the reference, which
    then has no line.
    """

    name: str
    meaning: str
    unit: Dimension | str = ""
    values: Callable[[Samples, int], Floats] | None = None
    digits: str = "{:,.6g}"
    logarithmic: Callable[[Units], Scale] | None = None
    is_relative: bool = False
    of_ball: bool = False

    def unit_in(self, units: Units) -> str:
        """Return what its numbers are."""
        return units.name(self.unit) if isinstance(self.unit, Dimension) else self.unit

    def scaled(self, samples: Samples, units: Units, since: int) -> Floats:
        """Return the values in the unit."""
        factor = units.factor(self.unit) if isinstance(self.unit, Dimension) else 1.0
        return factor * self.values(samples, since) if self.values else np.empty((0, 0))

    def heading(self, samples: Samples, units: Units) -> str:
        """Return what is written over the chart."""
        against = "the start" if samples.is_alone else samples.reference
        more = f" against {against}" * self.is_relative + f", ball {samples.ball}" * self.of_ball
        return f"{self.name}, {self.unit_in(units)}{more}"

    def columns(self, samples: Samples) -> dict[str, int]:
        """Return the column of each line by the name at its end."""
        hidden = samples.reference if self.is_relative and not samples.is_alone else None
        return {name: k for k, name in enumerate(samples.engines) if name != hidden}

    def text(self, value: float, units: Units) -> str:
        """Return a value as it is written; what is only rounding is 0."""
        if not np.isfinite(value):
            return "not known"
        return f"{self.digits.format(0.0 if abs(value) < ROUNDING else value)} {self.unit_in(units)}"


def _of(quantity: Quantity) -> Callable[[Samples, int], Floats]:
    return lambda samples, since: samples.of(quantity, since)


def _ball(name: str, quantity: Quantity, dimension: Dimension) -> Instrument:
    meaning = "of the selected ball, from the upper left"
    return Instrument(f"ball {name}", meaning, dimension, _of(quantity), "{:.4f}", of_ball=True)


ENERGY: Final = Instrument(
    "energy", "kinetic and potential, from the lowest place that a ball can reach", Dimension.ENERGY,
    _of(Quantity.ENERGY),
)  # fmt: skip
ERROR: Final = Instrument(
    "error", "of the energy, in % of the largest kinetic energy that the reference has had by then", "%",
    Samples.errors, "{:+.4g}", lambda units: BothSigns(), is_relative=True,
)  # fmt: skip
GAP: Final = Instrument(
    "gap", "how far its balls are off, at most", Dimension.LENGTH, _of(Quantity.GAP), "{:.4g}", gap_scale,
    is_relative=True,
)  # fmt: skip
MOMENTUM: Final = Instrument(
    "momentum", "of all balls together; walls and gravity change it", Dimension.MOMENTUM, _of(Quantity.MOMENTUM)
)
SPEEDS: Final = Instrument("speeds", "how many balls have each speed, beside the law")
TABS: Final = (ENERGY, ERROR, GAP, MOMENTUM, SPEEDS)
OTHERS: Final = (  # in a menu
    Instrument("kinetic energy", "of flight and spin", Dimension.ENERGY, _of(Quantity.KINETIC)),
    Instrument("contacts", "counted from the start", "", _of(Quantity.CONTACTS), "{:,.0f}"),
    _ball("x", Quantity.X, Dimension.LENGTH),
    _ball("y", Quantity.Y, Dimension.LENGTH),
    _ball("vx", Quantity.VX, Dimension.VELOCITY),
    _ball("vy", Quantity.VY, Dimension.VELOCITY),
    Instrument("step time", "how long each engine's steps take here", "ms", _of(Quantity.COST), "{:.3g}"),
)  # fmt: skip
INSTRUMENTS: Final = (*TABS, *OTHERS)


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
        return [(at, f"{at:,.6g}".replace("e+0", "e")) for at in [*others[-1:], lowest, *between]]
