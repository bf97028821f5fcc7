"""One colour for each engine, whatever the order: in the window, in recordings and on pages.

Okabe and Ito's colours, as far as they stand out from white and from near-black alike; the further ones were chosen for
the largest distance from these and each other, as seen with each kind of colour blindness (Machado et al. 2009).
"""

from collections.abc import Iterable
from typing import Final

from sandbox.scene.fields import PALETTE

_BLUE, _, _GREEN, _VERMILLION, _, _PURPLE = PALETTE
_BUILT_IN: Final = {"pymunk": _BLUE, "article": _VERMILLION, "impulse": _GREEN, "box2d": _PURPLE}
_OTHERS: Final = ("#9130f2", "#735c2e", "#f200ca", "#3091f2", "#a6217a", "#f23051")
_INK: Final = {"exact": ("#000000", "#ffffff")}  # what is the reference wherever it runs, on light and on dark


def colours_of(names: Iterable[str], *, dark: bool = False) -> dict[str, str]:
    """Return the colours of the engines in a run. dark: what they are drawn on.

    Built-in engines have their own. Others, and engines with settings, have further ones, in alphabetical order.

    >>> colours_of(["pymunk(substeps=4)", "mine", "pymunk"])
    {'pymunk': '#0072b2', 'mine': '#9130f2', 'pymunk(substeps=4)': '#735c2e'}
    """
    names = set(names)
    own = {name: ink[dark] for name, ink in _INK.items()} | _BUILT_IN
    others = sorted(names - own.keys())
    return {name: colour for name, colour in own.items() if name in names} | {
        name: _OTHERS[index % len(_OTHERS)] for index, name in enumerate(others)
    }
