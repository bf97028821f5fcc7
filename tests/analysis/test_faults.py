"""Engines with one known fault each: the first difference never has a cause that is not true."""

from importlib.metadata import EntryPoint
from typing import Final

import pytest
from conftest import scene_of
from faults import FAULTS

import sandbox.engines
from sandbox.analysis.comparison import compare
from sandbox.scene.model import Scene

EIGHT: Final = "count = 8\nradius = 20\nspeed = 200\ninside = [[20, 20], [380, 280]]"
MIXED: Final = (
    "count = 4\nradius = 15\nspeed = 250\ninside = [[20, 20], [190, 280]]",
    "count = 3\nradius = 25\nmass = 5\nspeed = 120\ninside = [[200, 20], [380, 280]]",
)
WALLS: Final = """
[[walls]]
from = [130, 60]
to = [130, 150]
thickness = 6
[[walls]]
from = [230, 250]
to = [330, 180]
"""


def gas(*balls: str, seed: int = 1, more: str = "", arena: str = "", walls: str = "") -> Scene:
    groups = [*balls[:-1], f"{balls[-1]}\n{walls}"]
    return scene_of(*groups, size=f"[400, 300]\n{arena}", more=f"seed = {seed}\nseconds = 1\n{more}")


def scenes(seed: int) -> dict[str, Scene]:
    return {
        "gas": gas(EIGHT, seed=seed),
        "gravity": gas(EIGHT, seed=seed, more="gravity = [0, 900]"),
        "friction": gas(EIGHT, seed=seed, arena="friction = 0.7"),
        "inner walls": gas(EIGHT.replace("8", "6", 1), seed=seed, walls=WALLS),
        "two balls": gas(EIGHT.replace("8", "2", 1), seed=seed),
        "elasticity": gas(EIGHT + "\nelasticity = 0.9", seed=seed, arena="elasticity = 0.8"),
        "mixed": gas(*MIXED, seed=seed),
        "sideways": gas(*MIXED, seed=seed, more="gravity = [-300, 200]", walls=WALLS),
    }
