"""Colours stand out on every background, and one engine's from another's."""

import math
from itertools import chain, combinations, permutations
from typing import Final

import numpy as np
import pytest
from pygame import Color

from sandbox.engines import registry
from sandbox.report.colours import colours_of
from sandbox.scene.fields import rgb
from sandbox.state import Floats
from sandbox.view.theme import DARK, LIGHT, chart_palette, contrast_ratio, palette, theme

ENGINES: Final = ["pymunk", "article", "impulse", "exact", "box2d"]
SIGHTS: Final = {
    "usual": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.01182, 0.04294, 0.968881]],
    "tritanopia": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.3039]],
}


def test_colours_stand_out_from_light_and_dark() -> None:
    for background in ("white", "black", "#22262b", "#f5f5dc", "#14532d", "tomato"):
        colours = palette(background)
        ground = Color(*rgb(background))
        assert contrast_ratio(colours.ink, ground) > 7
        if background == "tomato":  # which no colour but black and white stands out from
            continue
        assert contrast_ratio(colours.contact, ground) > 2.6


@pytest.mark.parametrize("dark", [False, True])
def test_every_text_can_be_read_in_both_themes(dark: bool) -> None:
    theme.use(dark=dark)
    for ground in (theme.ground, theme.raised, theme.hover):
        for ink in (theme.ink, theme.dim):
            assert contrast_ratio(ink, ground) >= 4.5
    assert contrast_ratio(theme.on_accent, theme.accent) >= 4.5
    colours = chart_palette()
    for colour in colours.engines([*ENGINES, *"abcdef"]).values():
        assert contrast_ratio(colour, colours.ground) >= 4.5


def test_a_light_scene_does_not_glare_in_a_dark_window() -> None:
    assert palette("white").ground == Color("white") == LIGHT.pane
    theme.use(dark=True)
    assert palette("white").ground == DARK.pane
    assert palette("#101418").ground == Color("#101418")


def test_an_engine_has_its_colour_whatever_runs_beside_it() -> None:
    settings = "pymunk(substeps=4)"
    alone = {name: colours_of([name])[name] for name in ENGINES}
    assert len(set(alone.values())) == len(ENGINES)
    assert set(registry()) <= set(ENGINES)
    for names in (ENGINES, [*reversed(ENGINES), settings], ["mine", "exact", settings]):
        colours = colours_of(names)
        assert all(colours[name] == alone[name] for name in names if name in alone)
        assert len(set(colours.values())) == len(names)
    assert colours_of(["mine", settings]) == colours_of([settings, "mine"])


def test_an_engine_keeps_its_colour_when_others_come_go_and_move() -> None:
    """Unless two Pymunks have the same setting first."""
    names = ["pymunk(substeps=4)", "pymunk(iterations=30)", "pymunk(damping=0.9, substeps=4)", "mine", "mine.py:Mine"]
    colours = colours_of(names)
    for some in chain.from_iterable(permutations(names[:3], count) for count in (1, 2, 3)):
        assert colours_of(some).items() <= colours.items()
    assert colours_of(reversed(names)) == colours


@pytest.mark.parametrize("sight", SIGHTS.values(), ids=SIGHTS)
def test_no_two_engines_look_alike_to_the_colour_blind(sight: list[list[float]]) -> None:
    """Distances in CIELAB of 2.3 are just noticeable; the matrices are of Machado, Oliveira and Fernandes (2009)."""
    seen = [_lab(np.clip(np.array(sight) @ _linear(colour), 0, 1)) for colour in colours_of(ENGINES).values()]
    assert min(math.dist(a, b) for a, b in combinations(seen, 2)) > 6 * 2.3


def _linear(colour: str) -> Floats:
    parts = np.array(rgb(colour)) / 255
    return np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)


def _lab(linear: Floats) -> Floats:
    xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]) @ linear
    scaled = xyz / [0.9505, 1.0, 1.089]
    x, y, z = np.where(scaled > 0.008856, np.cbrt(scaled), 7.787 * scaled + 16 / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])
