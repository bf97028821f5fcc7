"""What each engine is, for readers of a page who do not know it."""

from typing import Final, NamedTuple

from sandbox.engines.specs import file_and_name, format_settings, settings_in


class About(NamedTuple):
    """A description of an engine, and of what it gets wrong; empty if that is unknown."""

    what: str
    wrong: str


KNOWN: Final = {
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
    known = KNOWN.get(base)
    if known is None:
        return About(f"a loop of yours, from {base}" if file_and_name(base) else "an engine that is not built in", "")
    return known._replace(what=f"{known.what}; with {format_settings(settings)}") if settings else known
