"""The words of comparisons, and what each engine is, for readers who do not know them."""

import re
from collections.abc import Mapping
from typing import Final, NamedTuple

from sandbox.engines.specs import file_and_name, format_settings, settings_in
from sandbox.scene.units import Dimension, Units


class Word(NamedTuple):
    """A word: what it means, and the beginnings of words by which texts use it, as a pattern.

    The meaning has {length} and {momentum} where it names their units.
    """

    meaning: str
    used: str


GLOSSARY: Final[Mapping[str, Word]] = {
    "Apart": Word(
        "Two engines are apart from the time when a ball is more than its own radius from the reference's copy.",
        "apart|radius off",
    ),
    "Approach speed": Word("The speed at which two balls near each other along the normal, v_n.", "v_n|approach"),
    "Cause": Word("Why an engine changed energy, momentum or a position.", "cause"),
    "Contact": Word(
        "One resolved collision of two balls, or of a ball and a wall. A solver that works in time steps may report "
        "one touch of two balls as several contacts, one in each step.",
        "contact",
    ),
    "Depth": Word("How far two overlap when the contact is found, in {length}.", "deep|depth|overlap"),
    "Escape": Word("A ball's centre leaves the arena.", "escape|outside the arena"),
    "Expectation": Word("What must be true at a time by a law; `[[expect]]` in a scene.", "expectation"),
    "First difference": Word("The first step that is not as the exact step from the same state.", "first difference"),
    "Gap": Word("The distance between an engine's copy of a ball and the reference's, in {length}.", "gap"),
    "Horizon": Word("The time from which chaos makes paths meaningless.", "horizon"),
    "Impulse": Word("What a contact adds to one ball's momentum and takes from the other's, in {momentum}.", "impulse"),
    "Ledger": Word(
        "The list of all changes of energy, momentum and position, by cause. Its lines add up.",
        "ledger",
    ),
    "Normal": Word("The unit vector from the first ball of a contact to the second, or to the wall.", "normal"),
    "Reference": Word(
        "The engine that the others are measured against; `exact` wherever it can run the scene.", "reference"
    ),
    "Restitution": Word(
        "The ratio of the speed of parting to the approach speed, e. It is the elasticity of the pair.",
        "restitution|elasticit",
    ),
    "RMS": Word("The root of the mean of the squares: an average in which large values count most.", "RMS"),
    "Scale of energy": Word(
        "What 100 % of energy is: the largest kinetic energy that the reference reaches, or what the mouse has given, "
        "if that is more.",
        "of the energy|energy left|energy error|scale of energy",
    ),
    "Tunnelling": Word(
        "A ball passes through a wall or another ball between two steps, without a contact.",
        "tunnel|contact missed|passages",
    ),
    "Twin": Word(
        "A copy of the reference that starts some units in the last place elsewhere, numbers its balls in reverse "
        "order, or has half the hop, to find until when the reference means anything.",
        "twin",
    ),
    "Undecided": Word("Contacts are simultaneous, and no law says which comes first.", "undecided"),
    "Unresolved": Word("From then on, the paths depend on how the reference treats a heap.", "unresolved"),
}


def words_in(units: Units, text: str) -> dict[str, str]:
    """Return the words of the glossary that a text uses, with their meanings."""
    names = {"length": units.length, "momentum": units.name(Dimension.MOMENTUM)}
    return {
        word: meaning.format(**names)
        for word, (meaning, used) in GLOSSARY.items()
        if re.search(rf"\b(?:{used})", text, re.IGNORECASE)
    }


class About(NamedTuple):
    """A description of an engine, and of what it gets wrong; empty if that is unknown."""

    what: str
    wrong: str


BUILT_IN: Final = {
    "exact": About("event-driven hard discs, from impact to impact: the reference", "paths in a heap that still moves"),
    "pymunk": About("a pymunk.Space: circles and segment walls", "finds contacts up to a step late"),
    "article": About(
        "the article's loop, bit for bit: one radius, equal masses, no gravity",
        "energy; balls that meet stick together",
    ),
    "impulse": About("the article's loop with the textbook's impulse", "finds contacts up to a step late"),
    "box2d": About("Box2D v3 through pyb2d3", "finds contacts early; several contacts at once lose energy"),
}


def about(name: str) -> About:
    """Describe an engine in a run by its name, which may have settings.

    >>> about("pymunk(substeps=4)").what
    'a pymunk.Space: circles and segment walls; with substeps=4'
    """
    base, settings = settings_in(name)
    known = BUILT_IN.get(base)
    if known is None:
        return About(f"a loop of yours, from {base}" if file_and_name(base) else "an engine that is not built in", "")
    return known._replace(what=f"{known.what}; with {format_settings(settings)}") if settings else known
