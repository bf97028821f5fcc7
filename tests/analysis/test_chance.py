"""The laws of chance in two bundled scenes: the shares are those of the law, and so are the balls of `exact`."""

from math import comb

import numpy as np
import pytest

from sandbox import load, simulate
from sandbox.analysis.expectations import shares_in
from sandbox.scene.model import Columns, Scene
from sandbox.state import Floats

SLOTS, ROWS, SLOT = 9, 5, 2  # of the Plinko board: rows at slots, each followed by one between slots; where discs start
SAMPLES = 100_000


def random_walk() -> Floats:
    """Return the shares of a walk by half slots, whose ends send it back, by going through all of its steps."""
    shares: Floats = np.eye(SLOTS)[SLOT]
    for _ in range(ROWS):
        between = np.zeros(SLOTS + 1)  # the sides of the slots
        for slot, share in enumerate(shares):
            left, right = slot > 0, slot + 1 < SLOTS
            between[slot] += share * left / (left + right)
            between[slot + 1] += share * right / (left + right)
        shares = (between[:-1] + between[1:]) / 2
    return shares


LAWS = {"galton-board": np.array([comb(8, k) for k in range(9)]) / 2**8, "plinko": random_walk()}


def columns_of(scene: Scene) -> Columns:
    [expect] = scene.expect
    assert expect.columns is not None
    return expect.columns


@pytest.mark.parametrize("name", LAWS)
def test_the_shares_are_those_of_the_law_and_the_tolerance_that_of_chance(name: str) -> None:
    scene, law = load(name), LAWS[name]
    shares = columns_of(scene).shares
    assert np.divide(shares, sum(shares)) == pytest.approx(law, abs=1e-15)
    n = len(scene.bodies)
    samples = np.random.default_rng(1).multinomial(n, law, SAMPLES) / n
    distances = np.abs(np.cumsum(samples - law, axis=1)).max(axis=1)
    assert np.mean(distances <= scene.expect[0].tolerance) == pytest.approx(0.99, abs=3e-3)


@pytest.mark.wide
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", LAWS)
def test_exact_has_the_shares_of_the_law(name: str, seed: int) -> None:
    scene, law = load(name).changed(seed=seed), LAWS[name]
    measured = shares_in(columns_of(scene), simulate(scene, "exact").position[-1, :, 0])
    n = len(scene.bodies)
    often = law * n >= 1  # columns of so few balls that the statistic means little are left out
    samples = np.random.default_rng(1).multinomial(n, law, SAMPLES) / n
    chi_square, of_samples = (
        ((shares[..., often] - law[often]) ** 2 / law[often]).sum(axis=-1) for shares in (measured, samples)
    )
    assert measured.sum() == pytest.approx(1)
    assert chi_square < np.quantile(of_samples, 0.999)
