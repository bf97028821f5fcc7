"""The lessons' answers from the law are what their scenes give."""

from math import sqrt

import numpy as np
import pytest
from test_docs import ROOT, files

from sandbox.analysis.comparison import compare
from sandbox.analysis.figures import Impacts
from sandbox.scene.files import parse
from sandbox.scene.model import Scene

PAGE = ROOT / "docs" / "teaching.md"


def lesson(name: str) -> tuple[Scene, Impacts, np.ndarray]:
    """Return the scene of a lesson, the motion at its contacts in `exact`, and their times."""
    scene = parse(files(PAGE)[name], name)
    run = compare(scene, ["exact"]).runs["exact"]
    return scene, run.impacts, run.contacts["time"]


@pytest.mark.parametrize("name", ["carts.toml", "head-on-carts.toml"])
def test_two_carts_keep_their_momentum_and_part_at_the_restitution_times_their_speed(name: str) -> None:
    scene, impacts, _ = lesson(name)
    mass, e = scene.bodies.mass, np.prod(scene.bodies.elasticity)
    before, after = impacts["before"][0, :, 0], impacts["after"][0, :, 0]
    centre = mass @ before / mass.sum()
    assert after == pytest.approx(centre - e * (before - centre), abs=1e-4)  # impacts are kept in single precision
    assert after == pytest.approx({"carts.toml": (50, 150), "head-on-carts.toml": (0, 200)}[name], abs=1e-4)


def test_a_thrown_ball_lands_and_returns_as_galileo_has_it() -> None:
    scene, impacts, times = lesson("throw.toml")
    gravity, height, e = 981.0, 400 - 180 - 20, scene.bodies.elasticity[0]
    fall = sqrt(2 * height / gravity)
    assert times == pytest.approx([fall, fall + 2 * e * fall], rel=1e-9)
    assert impacts["before"][0, 0, :2] == pytest.approx((200, gravity * fall), rel=1e-6)
    assert impacts["after"][0, 0, :2] == pytest.approx((200, -e * gravity * fall), rel=1e-6)
    assert e**2 * height == pytest.approx(128)
