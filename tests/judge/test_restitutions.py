"""What the restitutions of wrong contacts have in common, of head-on bounces that are computed by hand."""

from collections.abc import Callable, Sequence
from typing import Final

import numpy as np
import pytest
from conftest import scene_of

from sandbox.judge.judge import Judge
from sandbox.judge.timeline import Timeline
from sandbox.state import PUSH, States

DT: Final = 1 / 60
R: Final = 20.0
GAP: Final = 1.0  # px, before each contact
RULED: Final = ((0.9, 0.6), (0.7, 0.95), (0.5, 0.8))
EQUAL: Final = ((0.9, 0.9),) * 3

Restitution = Callable[[float, float, float], float]  # of two factors and the closing speed, px/s


def pairs(factors: Sequence[tuple[float, float]], speeds: Sequence[float], restitution: Restitution) -> str:
    """Return what is said of pairs of equal balls, far from each other, whose first hits the second in one step."""
    tables, places, before, after, ends = list[str](), list[float](), list[float](), list[float](), list[float]()
    for (a, b), u in zip(factors, speeds, strict=True):
        e, first = restitution(a, b, u), 100.0 + 150 * len(places)
        left = DT - GAP / u
        new = u * (1 - e) / 2, u * (1 + e) / 2
        places += [first, first + 2 * R + GAP]
        before += [u, 0.0]
        after += new
        ends += [first + GAP + left * new[0], first + 2 * R + GAP + left * new[1]]
        for x, v, factor in zip(places[-2:], before[-2:], (a, b), strict=True):
            tables.append(f"radius = {R}\nposition = [{x}, 300]\nvelocity = [{v}, 0]\nelasticity = {factor}")
    states = States.empty(2, len(places))
    states.position[:], states.velocity[:] = 300.0, 0.0
    states.position[0, :, 0], states.position[1, :, 0] = places, ends
    states.velocity[0, :, 0], states.velocity[1, :, 0] = before, after
    judge = Judge(scene_of(*tables, size="[2000, 600]"))
    judge.add(states, np.empty(0, PUSH), np.full(1, DT))
    [suffered] = Timeline(judge).suffered
    return suffered.because


RULES: Final[dict[str, Restitution]] = {
    "The restitution is the larger of the two elasticities, not their product.": lambda a, b, _: max(a, b),
    "The restitution is the smaller of the two elasticities, not their product.": lambda a, b, _: min(a, b),
    "The restitution is the mean of the two elasticities, not their product.": lambda a, b, _: (a + b) / 2,
    "The restitution is the root of the elasticities' product, not the product.": lambda a, b, _: (a * b) ** 0.5,
    "The restitution is that of the first ball alone.": lambda a, b, _: a,
    "The restitution is that of the second ball alone.": lambda a, b, _: b,
    "That is a restitution of 0.85, where 0.4 to 0.665 is due.": lambda a, b, _: 0.85,
    "The two part at 100 px/s, however fast they met.": lambda a, b, u: 100 / u,
    "The two part 30 px/s faster than is due, however fast they met.": lambda a, b, u: a * b + 30 / u,
    "The two part 20 px/s slower than is due, however fast they met.": lambda a, b, u: a * b - 20 / u,
}


@pytest.mark.parametrize("says", RULES)
def test_the_rule_of_restitutions_is_named(says: str) -> None:
    assert pairs(RULED, (120, 150, 200), RULES[says]).endswith(f" {says}")


def test_equal_elasticities_do_not_tell_rules_apart() -> None:
    """Of 0.9 and 0.9, the larger, the smaller, the mean and the root are the same."""
    said = pairs(EQUAL, (120, 150, 200), lambda a, b, _: max(a, b))
    assert said == "The impulse is 1.05 times what is due. That is a restitution of 0.9, where 0.81 is due."


def test_one_restitution_of_contacts_of_one_kind_is_no_rule_of_two() -> None:
    """0.9 may be the mean of 1 and 0.8, or a number in the program."""
    said = pairs(((1.0, 0.8),) * 3, (120, 150, 200), lambda a, b, _: 0.9)
    assert said.endswith("That is a restitution of 0.9, where 0.8 is due.")


def test_impulses_without_a_rule_have_their_range_alone() -> None:
    said = pairs(RULED, (120, 150, 200), lambda a, b, u: 2 * a * b - u / 1000)
    assert said.endswith(" in all).")


def test_the_elasticity_of_balls_alone_at_a_wall() -> None:
    """Balls of 0.7 and 0.9 hit the right wall of 0.8 at 150 px/s, and 0.7 and 0.9 are left of that."""
    tables, left = list[str](), DT - 1 / 150
    states = States.empty(2, 2)
    for ball, e in enumerate((0.7, 0.9)):
        y = 200.0 + 200 * ball
        tables.append(f"radius = {R}\nposition = [779, {y}]\nvelocity = [150, 0]\nelasticity = {e}")
        states.position[:, ball], states.velocity[:, ball] = (
            ((779, y), (780 - 150 * e * left, y)),
            ((150, 0), (-150 * e, 0)),
        )
    judge = Judge(scene_of(*tables, size="[800, 600]\nelasticity = 0.8"))
    judge.add(states, np.empty(0, PUSH), np.full(1, DT))
    [suffered] = Timeline(judge).suffered
    assert suffered.because.endswith("The restitution is that of the ball alone.")
