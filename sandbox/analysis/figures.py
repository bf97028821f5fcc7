"""One engine's run in figures, and over time."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.analysis.difference import Difference, Passage
from sandbox.analysis.gas import TheoryRow
from sandbox.analysis.impacts import Impacts
from sandbox.analysis.misreports import Misreport
from sandbox.judge.causes import Entry
from sandbox.judge.timeline import Suffered
from sandbox.scene.model import Scene
from sandbox.scores.expectations import Score
from sandbox.state import Contacts, Floats, State


@dataclass(frozen=True)
class Figures:
    """One engine's figures; the names are those of JSON and CSV. What an engine does not report is None."""

    energy_ratio: float | None  # at the end: 1 + the change as a fraction of the comparison's scale; None if that is 0
    energy_drift: float | None  # the largest change of that, at any time
    energy_error: float | None  # the largest of `Run.energy_gap`, as a magnitude
    momentum_drift: float | None  # no wall, gravity or mouse gave it; as a fraction of the sum of all balls' |momentum|
    angular_momentum_drift: float | None  # likewise of angular momentum about the arena's centre, of flight and spin
    gap_rms: float  # px from the reference, over all balls and times
    gap_max: float  # px, of any ball at any time
    pair_contacts: int | None
    wall_contacts: int | None
    max_overlap: float  # px, of two balls at the end of any step
    escaped: int  # balls whose centre was outside the arena's walls at any step
    expected: int  # of the scene's expectations, the number that fall into the run and can be judged
    met: int  # the number of those that the engine meets
    skipped: int  # expectations that fall into the run and cannot be judged, because a contact is next to their time
    first_difference: Difference | None  # from the reference
    ledger: tuple[Entry, ...]  # every change of energy, momentum and positions, by its cause


def keeps_energy(scene: Scene) -> bool:
    """Return whether no contact of a scene takes or gives energy, so that it is known beyond every horizon."""
    factors = [*(wall.elasticity for wall in scene.surfaces), *scene.bodies.elasticity]
    return all(factor == 1 for factor in factors) and not scene.bodies.friction.any()


class Escape(NamedTuple):
    """Balls whose centres left the arena."""

    time: float  # s, when the first of them was outside
    ball: int  # the first of them
    balls: int  # how many did
    furthest: float  # px from the arena
    left: int  # how many are still outside at the end


@dataclass(frozen=True, repr=False)
class Run:
    """What one engine did, over time.

    energy: (steps + 1,) kg px²/s²; energy_scale: kg px²/s², the `EnergyScale` of the reference, which all shares of
    energy are of, 0 if nothing moves; energy_gap: (steps + 1,) the difference from the reference's energy as a fraction
    of the scale, give or take a step, NaN where the reference's energy means nothing and where soft contacts hold part
    of the engine's; momentum: (steps + 1, 2) kg px/s; angular_momentum: (steps + 1,) kg px²/s, about the arena's
    centre; centre_of_mass: (steps + 1, 2) px;
    gap_rms, gap_max: (steps + 1,) px from the reference over the balls;
    apart: s, when a ball is first more than its radius from the reference's, None if never while the reference's paths
    mean anything; contacts: as reported, in order of time; impacts: the motion before and after the first MAX_IMPACTS
    of them; differences: its wrong steps, in order; missed: the contacts that did not happen; escape: the balls that
    left the arena, None if none did; suffered: what the run suffers from, the worst first; misreport: where the
    contacts reported are others than what the balls did; scores: for the scene's expectations that fall into the run;
    theory: figures of a gas, measured and expected; path:
    (frames, n, 2) px, float32, one frame in every so many steps.
    """

    figures: Figures
    energy: Floats
    energy_scale: float
    energy_gap: Floats
    momentum: Floats
    angular_momentum: Floats
    centre_of_mass: Floats
    gap_rms: Floats
    gap_max: Floats
    apart: float | None
    contacts: Contacts
    impacts: Impacts
    differences: tuple[Difference, ...]
    missed: tuple[Passage, ...]
    escape: Escape | None
    suffered: tuple[Suffered, ...]
    misreport: Misreport | None
    scores: list[Score]
    theory: tuple[TheoryRow, ...]
    path: NDArray[np.float32]
    final: State

    @property
    def energy_change(self) -> Floats:
        """The energy since the start, as a fraction of the scale: (steps + 1,), NaN if that is 0."""
        return change_of(self.energy, self.energy_scale)

    def __repr__(self) -> str:
        return (
            f"<Run: {len(self.energy) - 1} steps, {len(self.contacts)} contacts, RMS gap {self.figures.gap_rms:.4g} px>"
        )


def change_of(energy: Floats, scale: float) -> Floats:
    """Return by how much an energy (kg px²/s²) has changed since its first value, as a fraction of a scale."""
    change: Floats = (energy - energy[0]) / (scale or np.nan)
    return change
