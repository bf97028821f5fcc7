"""As the rate doubles, time-stepped engines converge to the exact one, in scenes shorter than their horizon.

`pytest -m slow -s tests/slow/test_limit.py` doubles six times, to 3,840 steps a second, and prints the RMS gap at each
rate, and the order: the slope of the gap's logarithm over the rate's, by least squares.
"""

import numpy as np
import pytest
from conftest import sizes

from sandbox.analysis.comparison import compare
from sandbox.scene.files import load


@pytest.mark.wide
@pytest.mark.parametrize("doublings", sizes(4, slow=6))
@pytest.mark.parametrize(
    ("name", "seed", "seconds"),
    [
        ("oblique", 0, 2.0),
        ("article", 4, 4.0),
        ("heavy-among-light", 0, 1.5),
        ("bouncing", 0, 2.0),
        ("truths/free-fall-collision", 0, 1.0),
    ],
)
def test_gaps_shrink_with_the_step(name: str, seed: int, seconds: float, doublings: int) -> None:
    rates = [60 * 2**k for k in range(doublings + 1)]
    scene = load(name).changed(seed=seed, seconds=seconds, expect=())
    gaps: dict[str, list[float]] = {"impulse": [], "pymunk": []}
    for rate in rates:
        runs = compare(scene.changed(rate=rate), [*gaps, "exact"]).runs
        for engine, found in gaps.items():
            found.append(runs[engine].figures.gap_rms)
    for engine, found in gaps.items():
        order = -np.polyfit(np.log(rates), np.log(found), 1)[0]
        print(f"\n{name:28} {engine:8} order {order:4.2f}   px: " + "  ".join(f"{gap:8.2g}" for gap in found), end="")
        assert order > 0.7
        assert found[-1] < 3.2 * found[0] / 2**doublings
