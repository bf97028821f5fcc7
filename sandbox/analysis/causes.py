"""Why an engine changed energy, momentum or a position."""

from typing import Final

CAUSES: Final = {
    "elasticity": "the scene's own elasticity",
    "hand": "the hand",
    "small": "impulse too small",
    "large": "impulse too large",
    "late": "found late",
    "early": "found early",
    "pushed": "pushed apart",
    "overshoot": "overshoot thrown away",
    "turned": "wall turned it round again",
    "stale": "stale cached impulse",
    "unconverged": "contacts not converged",
    "missed": "missed",
    "gravity": "gravity's integration",
    "friction": "friction",
    "untold": "told by no contact",
    "rounding": "rounding",
}


(
    ELASTICITY, HAND, SMALL, LARGE, LATE, EARLY, PUSHED, OVERSHOOT, TURNED, STALE, UNCONVERGED, MISSED, GRAVITY,
    FRICTION, UNTOLD, ROUNDING,
) = range(len(CAUSES))  # fmt: skip


CAUSE: Final = tuple(CAUSES)
SHARE: Final = 1e-6  # of an impulse, a speed or a radius, below which an error is rounding
