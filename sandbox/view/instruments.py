"""The instruments: what each chart can show of a run."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Final

import numpy as np

from sandbox.analysis.gas import why_no_gas
from sandbox.report.scales import BothSigns, Scale, Span, gap_scale, round_up
from sandbox.scene.model import Scene
from sandbox.scene.units import Dimension, Units
from sandbox.session.samples import Quantity, Samples
from sandbox.state import Floats

Values = Callable[[Samples, int], Floats]

LAW: Final = "theory"  # name of a law's line
CONTACT_SECONDS: Final = 1.0  # s, over which contacts are counted
ROUNDING: Final = 1e-9  # of any unit; less is an engine's rounding error
TICKS: Final = 6  # of a linear axis, about
SLACK: Final = 0.05  # of the distance of two ticks, by which a line may leave the axis before that grows
PRESSURE_SECONDS: Final = 10.0  # s, over which the pressure is averaged: balls hit walls one at a time


class Instrument(Enum):
    """What a chart can show. The value is its name."""

    ENERGY = "energy"
    GAP = "gap"
    MOMENTUM = "momentum"
    ANGULAR_MOMENTUM = "angular momentum"
    HEIGHT = "height"
    CONTACTS = "contacts a second"
    PRESSURE = "pressure"
    BALL = "ball"
    COST = "step time"
    SPEEDS = "speeds"


LOGARITHMIC: Final = (Instrument.ENERGY, Instrument.GAP)  # those that can have a logarithmic axis
MEANINGS: Final[Mapping[Instrument, str]] = {
    Instrument.ENERGY: "of each engine, in % of the largest kinetic energy so far; logarithmic: how far it is off",
    Instrument.GAP: "how far its balls are off, at most",
    Instrument.MOMENTUM: "of all balls together; walls and gravity change it",
    Instrument.ANGULAR_MOMENTUM: "of flight and spin, about the arena's middle",
    Instrument.HEIGHT: "of the centre of mass, above the lower edge",
    Instrument.CONTACTS: "counted over the last second",
    Instrument.PRESSURE: "on the arena's walls over 10 s, beside theory",
    Instrument.BALL: "position or velocity of the selected ball, from the upper left",
    Instrument.COST: "how long each engine's steps take here",
    Instrument.SPEEDS: "how many balls have each speed, beside the law",
}
OF_BALL: Final[Mapping[Quantity, tuple[str, Dimension]]] = {  # what can be shown of a ball
    Quantity.X: ("x", Dimension.LENGTH),
    Quantity.Y: ("y", Dimension.LENGTH),
    Quantity.VX: ("vx", Dimension.VELOCITY),
    Quantity.VY: ("vy", Dimension.VELOCITY),
}


@dataclass(frozen=True)
class TimeChart:
    """An instrument's chart over time.

    unit: what its numbers are; digits: how a value is written; in_pixels: values of each engine in the samples from one
    on, with a law in a further column, if there is one, to be multiplied by a factor. is_relative: whether they are
    differences from the reference.
    """

    instrument: Instrument
    unit: str
    scale: Scale
    digits: str
    in_pixels: Values
    factor: float = 1.0
    is_relative: bool = False

    def values(self, samples: Samples, since: int) -> Floats:
        """Return the values in the unit."""
        return self.factor * self.in_pixels(samples, since)

    def columns(self, samples: Samples) -> dict[str, int]:
        """Return the column of each line by the name at its end. The reference has no line for its gap from itself."""
        hidden = samples.reference if self.is_relative and not samples.is_alone else None
        if self.instrument is Instrument.GAP:
            hidden = samples.reference
        law = {LAW: len(samples.engines)} if self.instrument is Instrument.PRESSURE else {}
        return {name: samples.engines.index(name) for name in samples.engines if name != hidden} | law

    def remark(self, samples: Samples, scene: Scene) -> str:
        """Return why the chart, or its law, is not there; nothing if it is."""
        if self.instrument is Instrument.GAP and samples.is_alone:
            return "one engine alone: nothing to be apart from"
        if self.instrument is not Instrument.PRESSURE:
            return ""
        if not scene.arena.walls:
            return "no walls stand round the arena"
        return f"no theory: {why}" if (why := why_no_gas(scene)) else ""

    def text(self, value: float) -> str:
        """Return a value as it is written; what is only rounding is 0."""
        return self.digits.format(0.0 if abs(value) < ROUNDING else value)


@dataclass(frozen=True)
class Even:
    """A linear axis from 0, or from the lowest value if that is negative, with ticks at round numbers.

    unit: written at the highest tick.
    """

    unit: str = ""

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
        ordered = [*others[-1:], lowest, *between]
        return [(at, f"{at:,.6g}{self.unit if at == ordered[0] else ''}") for at in ordered]


def time_chart(
    instrument: Instrument, samples: Samples, units: Units, *, logarithmic: bool, of_ball: Quantity = Quantity.X
) -> TimeChart | None:
    """Return the chart of an instrument over time, or None for speeds, which are of the step shown.

    logarithmic: whether its axis is; of_ball: what is shown of a ball.
    """
    if instrument is Instrument.SPEEDS:
        return None
    percent = bool(samples.energy_scale)
    if instrument is Instrument.ENERGY:
        return _energy_chart(samples, units, percent=percent, logarithmic=logarithmic)
    if instrument is Instrument.GAP:
        unit = units.name(Dimension.LENGTH)
        scale = gap_scale(units) if logarithmic else Even(f" {unit}")
        line, factor = f"{unit} from {samples.reference}", units.factor(Dimension.LENGTH)
        return TimeChart(instrument, line, scale, f"{{:.4g}} {unit}", _of(Quantity.GAP), factor)
    if instrument is Instrument.BALL:
        name, of_name = OF_BALL[of_ball]
        factor, unit = units.factor(of_name), units.name(of_name)
        line = f"{name}, {unit}, ball {samples.ball}"
        return TimeChart(instrument, line, Even(), f"{{:.4f}} {unit}", _of(of_ball), factor)
    dimension, digits, in_pixels = OVER_TIME[instrument]
    if isinstance(dimension, Dimension):
        factor, unit = units.factor(dimension), units.name(dimension)
    else:
        factor, unit = 1.0, dimension
    return TimeChart(instrument, unit, Even(), f"{digits} {unit}", in_pixels, factor)


def _energy_chart(samples: Samples, units: Units, *, percent: bool, logarithmic: bool) -> TimeChart:
    unit, factor = ("%", 1.0) if percent else (units.name(Dimension.ENERGY), units.factor(Dimension.ENERGY))
    if logarithmic:
        line, errors = f"{unit} from {'the start' if samples.is_alone else samples.reference}", _of(Quantity.ENERGY)
        return TimeChart(Instrument.ENERGY, line, BothSigns(), f"{{:+.4g}} {unit}", errors, factor, is_relative=True)
    line, axis = ("% of the energy", Even(" %")) if percent else (unit, Even())
    return TimeChart(Instrument.ENERGY, line, axis, f"{{:.4g}} {unit}", Samples.energies, factor)


def _of(quantity: Quantity) -> Values:
    return lambda samples, since: samples.of(quantity, since)


def _contacts(samples: Samples, since: int) -> Floats:
    return samples.rate(Quantity.CONTACTS, CONTACT_SECONDS, since)


def _pressures(samples: Samples, since: int) -> Floats:
    measured = samples.rate(Quantity.WALL_IMPULSE, PRESSURE_SECONDS, since)
    return np.column_stack([measured, samples.pressure_in_theory(since)])


OVER_TIME: Final[Mapping[Instrument, tuple[Dimension | str, str, Values]]] = {  # a dimension, or a unit
    Instrument.MOMENTUM: (Dimension.MOMENTUM, "{:,.6g}", _of(Quantity.MOMENTUM)),
    Instrument.ANGULAR_MOMENTUM: (Dimension.ANGULAR_MOMENTUM, "{:,.6g}", _of(Quantity.ANGULAR_MOMENTUM)),
    Instrument.HEIGHT: (Dimension.LENGTH, "{:.4f}", _of(Quantity.HEIGHT)),
    Instrument.CONTACTS: ("in the last second", "{:,.6g}", _contacts),
    Instrument.PRESSURE: ("kg/s²", "{:,.5g}", _pressures),
    Instrument.COST: ("ms", "{:.3g}", _of(Quantity.COST)),
}
