"""The restitutions that wrong impulses amount to, and what those of a run's contacts have in common."""

from collections.abc import Callable, Mapping, Sequence
from itertools import chain
from typing import Final, NamedTuple

import numpy as np

from sandbox.judge.fit import Outcome
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


def bounces_of(scene: Scene, outcome: Outcome) -> list[Bounce]:
    """Return the bounces of an outcome with another restitution, none if that is not what is wrong with it."""
    trial, bounces = outcome.trial, list[Bounce]()
    if trial.fault not in ("impulse", "restitution"):
        return bounces
    for first, second, closing in outcome.met[["first", "second", "closing"]].tolist():
        if trial.concerns(first, second):
            factors = float(scene.bodies.elasticity[first]), _elasticity(scene, second)
            due = factors[0] * factors[1]
            got = trial.value * (1 + due) - 1 if trial.fault == "impulse" else trial.value * due
            bounces.append(Bounce(factors, got, closing, second < 0))
    return bounces


def _elasticity(scene: Scene, second: int) -> float:
    """Return the factor of a ball, or of ~wall."""
    if second >= 0:
        return float(scene.bodies.elasticity[second])
    inner = ~second - len(ARENA_WALLS)
    return scene.arena.elasticity if inner < 0 else scene.walls[inner].elasticity


def in_common(scene: Scene, outcomes: Sequence[Outcome]) -> str:
    """Return what the restitutions of some outcomes have in common, empty if nothing."""
    each = [bounces_of(scene, outcome) for outcome in outcomes]
    known = [*chain(*each)]
    if not all(each) or min(bounce.got for bounce in known) < 0:
        return ""
    factors, got = np.array([bounce.factors for bounce in known]), np.array([bounce.got for bounce in known])
    due, closing = factors.prod(axis=1), np.array([bounce.closing for bounce in known])
    parting, more = got * closing, (got - due) * closing
    if np.ptp(got) <= ALIKE * got.max():
        range_due = f"{due.min():.4g}" if np.ptp(due) <= ALIKE * due.max() else f"{due.min():.4g} to {due.max():.4g}"
        return f"That is a restitution of {float(np.median(got)):.4g}, where {range_due} is due."
    rules = [name for name, rule in RULES.items() if np.allclose(rule(*factors.T), got, rtol=ALIKE)]
    if len(rules) == 1:
        two = ("ball", "wall") if all(bounce.with_wall for bounce in known) else ("first ball", "second ball")
        return f"The restitution is {rules[0].format(two[0], other=two[1])}."
    if len(known) >= SEVERAL and np.ptp(parting) <= ALIKE * parting.max():
        speed = scene.units.text(Dimension.VELOCITY, "{:.4g}", float(np.median(parting)))
        return f"The two part at {speed}, however fast they met."
    if len(known) >= SEVERAL and np.ptp(more) <= ALIKE * np.abs(more).max():
        speed = scene.units.text(Dimension.VELOCITY, "{:.4g}", abs(float(np.median(more))))
        return f"The two part {speed} {'faster' if more[0] > 0 else 'slower'} than is due, however fast they met."
    return ""
