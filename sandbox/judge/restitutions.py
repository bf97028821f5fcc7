"""The restitutions that wrong impulses amount to, and what those of a run's contacts have in common."""

from collections.abc import Callable, Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np

from sandbox.judge.fit import Outcome
from sandbox.judge.law import Scope
from sandbox.judge.thresholds import ALIKE
from sandbox.scene.model import ARENA_WALLS, Scene
from sandbox.scene.units import Dimension
from sandbox.state import Floats

SEVERAL: Final = 3  # contacts that part at one speed; fewer may do so by chance
RULES: Final[Mapping[str, Callable[[Floats, Floats], Floats]]] = {  # of the two factors of a contact
    "the larger of the two elasticities, not their product": np.maximum,
    "the smaller of the two elasticities, not their product": np.minimum,
    "the mean of the two elasticities, not their product": lambda a, b: (a + b) / 2,
    "the root of the elasticities' product, not the product": lambda a, b: np.sqrt(a * b),
    "that of the {} alone": lambda a, _: a,
    "that of the {other} alone": lambda _, b: b,
}


class Bounce(NamedTuple):
    """A contact whose impulse is wrong.

    factors: whose product is due; got: its restitution; closing: px/s; with_wall: whether the second is one.
    """

    factors: tuple[float, float]
    got: float
    closing: float
    with_wall: bool


def bounce_of(scene: Scene, outcome: Outcome) -> Bounce | None:
    """Return the bounce of an outcome, None if that is not of one contact with another restitution."""
    trial, met = outcome.trial, outcome.met
    if trial.fault not in ("impulse", "restitution") or len(met) != 1 or trial.scope.get("scope") == Scope.ONE:
        return None
    first, second = int(met["first"][0]), int(met["second"][0])
    factors = float(scene.bodies.elasticity[first]), _elasticity(scene, second)
    due = factors[0] * factors[1]
    got = trial.value * (1 + due) - 1 if trial.fault == "impulse" else trial.value * due
    return Bounce(factors, got, float(met["closing"][0]), second < 0)


def _elasticity(scene: Scene, second: int) -> float:
    """Return the factor of a ball, or of ~wall."""
    if second >= 0:
        return float(scene.bodies.elasticity[second])
    inner = ~second - len(ARENA_WALLS)
    return scene.arena.elasticity if inner < 0 else scene.walls[inner].elasticity


def in_common(scene: Scene, outcomes: Sequence[Outcome]) -> str:
    """Return what the restitutions of some outcomes have in common, empty if nothing."""
    bounces = [bounce_of(scene, outcome) for outcome in outcomes]
    known = [bounce for bounce in bounces if bounce]
    if not known or len(known) < len(bounces) or min(bounce.got for bounce in known) < 0:
        return ""
    factors, got = np.array([bounce.factors for bounce in known]), np.array([bounce.got for bounce in known])
    parting = got * [bounce.closing for bounce in known]
    due = factors.prod(axis=1)
    rules = [name for name, rule in RULES.items() if np.allclose(rule(*factors.T), got, rtol=ALIKE)]
    if len(rules) == 1:
        two = ("ball", "wall") if all(bounce.with_wall for bounce in known) else ("first ball", "second ball")
        return f"The restitution is {rules[0].format(two[0], other=two[1])}."
    if np.ptp(got) <= ALIKE * got.max():
        range_due = f"{due.min():.4g}" if np.ptp(due) <= ALIKE * due.max() else f"{due.min():.4g} to {due.max():.4g}"
        return f"That is a restitution of {float(np.median(got)):.4g}, where {range_due} is due."
    if len(known) >= SEVERAL and np.ptp(parting) <= ALIKE * parting.max():
        speed = scene.units.text(Dimension.VELOCITY, "{:.4g}", float(np.median(parting)))
        return f"The two part at {speed}, however fast they met."
    return ""
