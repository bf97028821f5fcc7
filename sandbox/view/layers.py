"""The layers: what the window and a recording show or hide. Their names are the values of --show."""

from enum import StrEnum


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
