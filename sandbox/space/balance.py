"""The balance of a Space's energy, in words: how much there was, and what changed it."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from sandbox.space.causes import Cause
from sandbox.space.energy import Ledger
from sandbox.space.mechanics import Floats

LEAST_SHARE: Final = 0.005  # of the largest kinetic energy; smaller lines are printed together
SMALLEST_SHOWN: Final = 5e-5
MAX_SHARE: Final = 10.0  # of the largest kinetic energy: beyond, that is no measure of what changed
STEPS: Final = "gravity and what bears it, in steps instead of at every moment"
WORDS: Final[Mapping[Cause, str]] = {
    Cause.RESTITUTION: "bounces, as elasticities say",
    Cause.RESTITUTION_ERROR: "bounces, other than elasticities say",
    Cause.SUPPORT: STEPS,
    Cause.FRICTION: "friction",
    Cause.SURFACE: "surface velocities",
    Cause.JOINTS: "joints",
    Cause.MOTORS: "motors",
    Cause.SPRINGS: "springs with a law of the program",
    Cause.SPRING_DAMPING: "dampers of springs",
    Cause.SPRING_INTEGRATION: "springs, in steps instead of at every moment",
    Cause.KINEMATIC: "kinematic bodies that push",
    Cause.DAMPING: "the Space's damping",
    Cause.FORCES: "forces and torques",
    Cause.INTEGRATION: STEPS,
    Cause.CORRECTION: "bodies moved apart that overlapped",
    Cause.POSITION_FUNCTIONS: "position functions",
    Cause.VELOCITY_FUNCTIONS: "velocity functions",
    Cause.CALLBACKS: "handlers and callbacks",
    Cause.VELOCITY_SET: "the program: velocities and impulses",
    Cause.POSITION_SET: "the program: positions",
    Cause.MASS_SET: "the program: masses and moments",
    Cause.GRAVITY_SET: "the program: gravity",
    Cause.SPRINGS_SET: "the program: springs",
    Cause.ADDED: "bodies added",
    Cause.REMOVED: "bodies removed",
}


@dataclass(frozen=True)
class Balance:
    """What an energy ledger says."""

    ledger: Ledger

    @property
    def shares(self) -> dict[str, float]:
        """The lines in words as shares of the scale, the largest first."""
        shares: dict[str, float] = {}
        for cause, share in self.ledger.shares.items():
            shares[WORDS[cause]] = shares.get(WORDS[cause], 0.0) + share
        return dict(sorted(shares.items(), key=lambda line: -abs(line[1])))

    @property
    def drift_so_far(self) -> tuple[Floats, Floats]:
        """Times, s, and the largest change of energy until each, as a share of the scale; 0 if nothing moved."""
        change = np.abs(self.ledger.total - self.ledger.total[0])
        return self.ledger.time, np.maximum.accumulate(change) / (self.ledger.scale or 1.0)

    def lines(self) -> Iterator[str]:
        """Yield it as text."""
        total, scale = self.ledger.total, self.ledger.scale
        if not scale:
            yield "Its energy: nothing moved."
            return
        since, until = self.ledger.time[[0, -1]].tolist()
        is_small = max(map(abs, self.shares.values()), default=0.0) > MAX_SHARE
        unit = "kg px²/s²; its largest kinetic energy is" if is_small else "% of the largest kinetic energy,"
        yield f"Its energy from {since:.4g} to {until:.4g} s, in {unit} {scale:.3g}:"
        large = {words: share for words, share in self.shares.items() if abs(share) >= LEAST_SHARE}
        change = float(total[-1] - total[0]) / scale
        rest = change - sum(large.values())
        lines = [*large.items(), *([("all else", rest)] if abs(rest) >= SMALLEST_SHOWN else []), ("together", change)]
        for words, share in lines:
            yield f"  {share * scale:+12.3g}  {words}" if is_small else f"  {100 * share:+9.2f} %  {words}"

    def as_json(self) -> dict[str, Any]:
        """Return it as a JSON document has it: energies in kg px²/s², times in s."""
        ledger = self.ledger
        return {
            "since": float(ledger.time[0]),
            "until": float(ledger.time[-1]),
            "start": float(ledger.total[0]),
            "end": float(ledger.total[-1]),
            "largest_kinetic": ledger.scale,
            "lines": {str(cause): value for cause, value in ledger.lines.items() if value},
        }
