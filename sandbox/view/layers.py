"""The layers: what the window and a recording show or hide. Their names are the values of --show."""

import math
from enum import StrEnum
from typing import Final


class Layer(StrEnum):
    """Something that can be shown of a run in addition to its balls and walls."""

    VELOCITY = "velocity"
    MOMENTUM = "momentum"
    TRAILS = "trails"
    CONTACTS = "contacts"
    CENTRE = "centre"
    NUMBERS = "numbers"
    GHOSTS = "ghosts"
    GRID = "grid"
    CHARTS = "charts"


MOST_BALLS: Final = {  # of a scene that opens with a layer; of more balls, outlines and numbers hide them
    Layer.CHARTS: math.inf,
    Layer.GHOSTS: 300,
    Layer.NUMBERS: 30,
}


def opens_with(balls: int) -> set[Layer]:
    """Return the layers that a scene of so many balls opens with."""
    return {layer for layer, most in MOST_BALLS.items() if balls <= most}
