"""Colours stand out on every background."""

from pygame import Color

from sandbox.scene.fields import rgb
from sandbox.view.palette import chart_background, palette


def test_colours_stand_out_from_light_and_dark_and_no_two_engines_share_a_dash() -> None:
    def luminance(colour: Color) -> float:
        parts = [part / 255 for part in (colour.r, colour.g, colour.b)]
        red, green, blue = (p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts)
        return 0.2126 * red + 0.7152 * green + 0.0722 * blue

    def against(a: Color, b: Color) -> float:
        low, high = sorted((luminance(a), luminance(b)))
        return (high + 0.05) / (low + 0.05)

    for background in ("white", "black", "#22262b", "#f5f5dc", "#14532d", "tomato"):
        on_paper = palette(chart_background(background))
        for line in on_paper.lines:
            assert against(line.colour, on_paper.ground) > 2.6
        colours = palette(background)
        ground = Color(*rgb(background))
        assert against(colours.ink, ground) > 7
        if background == "tomato":  # which no colour but black and white stands out from
            continue
        for colour in (colours.momentum, colours.contact):
            assert against(colour, ground) > 2.6
        assert len({line.dash for line in colours.lines}) == len({tuple(line.colour) for line in colours.lines}) == 5
        assert colours.line(7) == colours.line(2)
