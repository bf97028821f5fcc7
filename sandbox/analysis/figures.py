"""One engine's run in figures, and over time."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from sandbox.analysis.difference import Difference, differences
from sandbox.analysis.expectations import Score
from sandbox.analysis.gas import TheoryRow
from sandbox.judge.causes import Cause, Entry
from sandbox.judge.ledger import Errors
from sandbox.judge.summary import CauseOfError
from sandbox.quantity import length
from sandbox.scene.model import Scene
from sandbox.state import Bools, Contacts, Floats, State

IMPACT: Final = np.dtype([("before", "f8", (2, 3)), ("after", "f8", (2, 3))])  # px/s twice, and rad/s; zeros of a wall
Impacts = NDArray[np.void]


@dataclass(frozen=True)
class Figures:
    """One engine's figures; the names are those of JSON and CSV. What an engine does not report is None."""

    energy_ratio: float | None  # at the end: 1 + the change as a fraction of the comparison's scale; None if that is 0
    energy_drift: float | None  # the largest change of that, at any time
    energy_error: float | None  # the largest difference from the reference's energy, as a fraction of the scale
    momentum_drift: float | None  # what no wall, gravity or mouse gave; as a fraction of the sum of all momenta
    gap_rms: float  # px from the reference, over all balls and times
    gap_max: float  # px, of any ball at any time
    pair_contacts: int | None  # number of contacts of two balls; None if the engine does not report them
    wall_contacts: int | None  # likewise of a ball and a wall
    max_overlap: float  # px, of two balls at the end of any step
    escaped: int  # balls whose centre was outside the arena's walls at any step
    expected: int  # number of the scene's expectations that can be judged
    met: int  # number of those that the engine meets
    skipped: int  # number of those that cannot be judged, such as those between two steps
    first_difference: Difference | None  # its first wrong step
    causes: tuple[CauseOfError, ...]  # what is wrong with its steps, the largest share first
    ledger: tuple[Entry, ...]  # every change of energy, momentum and positions, by its cause


class Escape(NamedTuple):
    """Balls whose centres left the arena."""

    time: float  # s, when the first of them was outside
    ball: int  # the first of them
    balls: int  # how many did
    furthest: float  # px from the arena


@dataclass(frozen=True)
class Course:
    """Values after each step, (steps + 1,) of each.

    energy: kg px²/s²; touching: whether a soft contact holds part of it; momentum: (steps + 1, 2) kg px/s; lengths: the
    sum of the lengths of all momenta, kg px/s; gap_rms, gap_max: px from the reference over the balls.
    """

    energy: Floats
    touching: Bools
    momentum: Floats
    lengths: Floats
    gap_rms: Floats
    gap_max: Floats

    @classmethod
    def joined(cls, parts: "Sequence[Course]") -> Self:
        """Return the values of steps that follow one another."""
        return cls(*map(np.concatenate, zip(*(vars(part).values() for part in parts), strict=True)))


@dataclass(frozen=True, repr=False)
class Run(Course):
    """What one engine did, over time.

    energy_scale: kg px²/s², the `EnergyScale` of the reference, which all shares of energy are of, 0 if nothing moves;
    energy_gap: (steps + 1,) the difference from the reference's energy as a fraction of the scale, give or take a step,
    NaN where that means nothing or soft contacts hold energy; apart: s, when a ball is first more than its radius from
    the reference's; impacts: the motion before and after the first contacts; misreports: a step, from 1, and a ball
    that reported contacts change otherwise than it changed; gained: (steps, 3), momentum and angular momentum that
    nothing outside gave; errors: of its first wrong steps, none of the reference's; flights: as in `Verdict`; missed:
    how many contacts did not happen; path: (frames, n, 2) px.
    """

    scene: Scene
    energy_scale: float
    energy_gap: Floats
    apart: float | None
    max_overlap: float
    contacts: Contacts
    reports_contacts: bool
    impacts: Impacts
    misreports: tuple[tuple[int, int], ...]
    gained: Floats
    ledger: tuple[Entry, ...]
    errors: Errors
    flights: dict[str, str]
    missed: int
    causes: tuple[CauseOfError, ...]
    is_spinless: bool
    escape: Escape | None
    scores: tuple[Score, ...]
    theory: tuple[TheoryRow, ...]
    path: NDArray[np.float32]
    start: State
    final: State

    @cached_property
    def figures(self) -> Figures:
        """The figures of the run."""
        pairs = int(np.count_nonzero(self.contacts["second"] >= 0))
        scale, change = self.energy_scale, self.energy_change
        return Figures(
            energy_ratio=float(1 + change[-1]) if scale else None,
            energy_drift=float(np.abs(change)[~self.touching].max(initial=0.0)) if scale else None,
            energy_error=float(np.nanmax(np.abs(self.energy_gap))) if scale else None,
            momentum_drift=float(length(self.gained).max(initial=0.0) / (self.lengths.max() or 1.0)),
            gap_rms=float(np.sqrt(np.mean(self.gap_rms**2))),
            gap_max=float(self.gap_max.max()),
            pair_contacts=pairs if self.reports_contacts else None,
            wall_contacts=len(self.contacts) - pairs if self.reports_contacts else None,
            max_overlap=self.max_overlap,
            escaped=self.escape.balls if self.escape else 0,
            expected=sum(not score.skipped for score in self.scores),
            met=sum(score.passed for score in self.scores if not score.skipped),
            skipped=sum(bool(score.skipped) for score in self.scores),
            first_difference=next(iter(differences(self.scene, self.errors[:1], self.flights)), None),
            causes=self.causes,
            ledger=self.ledger,
        )

    @cached_property
    def differences(self) -> tuple[Difference, ...]:
        """Its wrong steps, none of the reference's."""
        return differences(self.scene, self.errors, self.flights)

    @property
    def energy_change(self) -> Floats:
        """The energy since the start, as a fraction of the scale: (steps + 1,), NaN if that is 0."""
        change: Floats = (self.energy - self.energy[0]) / (self.energy_scale or np.nan)
        return change

    @property
    def energy_by_cause(self) -> dict[Cause, float]:
        """The energy of each line of the ledger, kg px²/s²."""
        return {entry.cause: entry.energy for entry in self.ledger}

    def __repr__(self) -> str:
        return (
            f"<Run: {len(self.energy) - 1} steps, {len(self.contacts)} contacts, RMS gap {self.figures.gap_rms:.4g} px>"
        )
