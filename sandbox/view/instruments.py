"""The instruments: what each chart can show of a run."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import partial
from typing import Final

import numpy as np

from sandbox.analysis.gas import why_no_gas
from sandbox.report.scales import BothSigns, Linear, Logarithmic, Scale
from sandbox.scene.model import Scene
from sandbox.session.samples import Quantity, Samples
from sandbox.state import Floats

LAW: Final = "theory"  # name of a law's line
CONTACT_SECONDS: Final = 1.0  # s, over which contacts are counted
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
    SPEEDS = "speeds"


MEANINGS: Final[Mapping[Instrument, str]] = {
    Instrument.ENERGY: "what an engine lost or made",
    Instrument.GAP: "how far its balls are off, at most",
    Instrument.MOMENTUM: "of all balls together; walls and gravity change it",
    Instrument.ANGULAR_MOMENTUM: "of flight and spin, about the arena's middle",
    Instrument.HEIGHT: "of the centre of mass, above the lower edge",
    Instrument.CONTACTS: "counted over the last second",
    Instrument.PRESSURE: "on the arena's walls over 10 s, beside theory",
    Instrument.SPEEDS: "how many balls have each speed, beside the law",
}


@dataclass(frozen=True)
class TimeChart:
    """An instrument's chart over time.

    lines: its title and unit; digits: how a value is written; values: of each engine in the samples from one on, with a
    law in a further column, if there is one.
    """

    instrument: Instrument
    lines: tuple[str, ...]
    scale: Scale
    digits: str
    values: Callable[[Samples, int], Floats]

    def columns(self, samples: Samples) -> dict[str, int]:
        """Return the column of each line by the name at its end. The reference has no line for its gap from itself."""
        compared = self.instrument in (Instrument.ENERGY, Instrument.GAP)
        is_own = self.instrument is Instrument.ENERGY and samples.is_alone
        shown = [name for name in samples.engines if is_own or not compared or name != samples.reference]
        law = {LAW: len(samples.engines)} if self.instrument is Instrument.PRESSURE else {}
        return {name: samples.engines.index(name) for name in shown} | law

    def remark(self, samples: Samples, scene: Scene) -> str:
        """Return why the chart, or its law, is not there; nothing if it is."""
        if self.instrument is Instrument.GAP and samples.is_alone:
            return "one engine alone: nothing to be apart from"
        if self.instrument is not Instrument.PRESSURE:
            return ""
        if not scene.arena.walls:
            return "no walls stand round the arena"
        return f"no theory: {why}" if (why := why_no_gas(scene)) else ""


def default_instruments(samples: Samples) -> tuple[Instrument, Instrument]:
    """Return what the two charts show at first; an engine alone has no gap."""
    return Instrument.ENERGY, Instrument.MOMENTUM if samples.is_alone else Instrument.GAP


def time_charts(instruments: Sequence[Instrument], samples: Samples) -> list[TimeChart]:
    """Return the charts of those instruments that are drawn over time."""
    against = "the start" if samples.is_alone else samples.reference
    unit = "%" if samples.energy_scale else "kg px²/s²"
    made: dict[Instrument, tuple[tuple[str, ...], Scale, str, Quantity]] = {
        Instrument.ENERGY: ((f"energy, {unit}", f"from {against}"), BothSigns(), f"{{:+.4g}} {unit}", Quantity.ENERGY),
        Instrument.GAP: (("gap, px", f"from {samples.reference}"), Logarithmic(), "{:.4g} px", Quantity.GAP),
        Instrument.MOMENTUM: (("momentum", "kg px/s"), Linear(), "{:,.6g} kg px/s", Quantity.MOMENTUM),
        Instrument.ANGULAR_MOMENTUM: (
            ("angular", "momentum", "kg px²/s"), Linear(), "{:,.6g} kg px²/s", Quantity.ANGULAR_MOMENTUM
        ),
        Instrument.HEIGHT: (("height", "px"), Linear(), "{:.4f} px", Quantity.HEIGHT),
    }  # fmt: skip
    charts = {
        instrument: TimeChart(instrument, lines, scale, digits, partial(_quantity, quantity))
        for instrument, (lines, scale, digits, quantity) in made.items()
    }
    charts[Instrument.CONTACTS] = TimeChart(
        Instrument.CONTACTS, ("contacts", "a second"), Linear(), "{:,.6g} in the last second", _contacts
    )
    charts[Instrument.PRESSURE] = TimeChart(
        Instrument.PRESSURE, ("pressure", "kg/s²"), Linear(), "{:,.5g} kg/s²", _pressures
    )
    return [charts[instrument] for instrument in instruments if instrument in charts]


def _quantity(quantity: Quantity, samples: Samples, since: int) -> Floats:
    return samples.of(quantity, since)


def _contacts(samples: Samples, since: int) -> Floats:
    return samples.rate(Quantity.CONTACTS, CONTACT_SECONDS, since)


def _pressures(samples: Samples, since: int) -> Floats:
    measured = samples.rate(Quantity.WALL_IMPULSE, PRESSURE_SECONDS, since)
    return np.column_stack([measured, samples.pressure_in_theory(since)])
