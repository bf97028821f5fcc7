"""One colour for each engine, whatever the order: in the window, in recordings and on pages.

Okabe and Ito's colours, as far as they stand out from white and from near-black alike; the further ones were chosen for
the largest distance from these and each other, as seen with each kind of colour blindness (Machado et al. 2009).
"""

from collections.abc import Iterable, Sequence
from typing import Final
from zlib import crc32

from sandbox.engines.specs import settings_in
from sandbox.errors import SandboxError
from sandbox.scene.fields import PALETTE
from sandbox.scene.model import PymunkSettings

_BLUE, _, _GREEN, _VERMILLION, _, _PURPLE = PALETTE
_KNOWN: Final = {"pymunk": _BLUE, "article": _VERMILLION, "impulse": _GREEN, "box2d": _PURPLE}
_OTHERS: Final = ("#9130f2", "#735c2e", "#f200ca", "#3091f2", "#a6217a", "#f23051")
_SETTINGS: Final = {key: number for number, key in enumerate(PymunkSettings.model_fields)}
_INK: Final = {"exact": ("#000000", "#ffffff")}  # what is the reference wherever it runs, on light and on dark


def colours_of(names: Iterable[str], *, dark: bool = False) -> dict[str, str]:
    """Return the colours of the engines in a run, in the order of their panes. dark: what they are drawn on.

    Built-in engines have their own. Pymunk with changed settings prefers a colour by the setting that its spec has
    first, whatever its value, and any other engine one by its name. If another engine of the run has that colour, it
    has the next one that is free. So a slider does not change the colour of any pane.

    >>> colours_of(["pymunk", "pymunk(substeps=4)", "pymunk(substeps=8, damping=0.9)"])
    {'pymunk': '#0072b2', 'pymunk(substeps=4)': '#735c2e', 'pymunk(substeps=8, damping=0.9)': '#f200ca'}
    """
    names = list(dict.fromkeys(names))
    fixed = {name: ink[dark] for name, ink in _INK.items()} | _KNOWN
    further = _further([name for name in names if name not in fixed])
    return {name: fixed[name] if name in fixed else further[name] for name in names}


def _further(names: Sequence[str]) -> dict[str, str]:
    """Return the colours of engines that are not built in; they repeat if the engines are more than the colours."""
    tuned = {name: _SETTINGS[key] for name in names if (key := _first_setting(name)) in _SETTINGS}
    by_name = {name: crc32(name.encode(errors="surrogatepass")) for name in sorted(names) if name not in tuned}
    wanted = {name: number % len(_OTHERS) for name, number in (tuned | by_name).items()}
    slots: dict[str, int] = {}
    for name, slot in wanted.items():
        if slot not in slots.values():
            slots[name] = slot
    for name, slot in wanted.items():
        from_there = ((slot + k) % len(_OTHERS) for k in range(len(_OTHERS)))
        if name not in slots:
            slots[name] = next((free for free in from_there if free not in slots.values()), slot)
    return {name: _OTHERS[slot] for name, slot in slots.items()}


def _first_setting(name: str) -> str:
    try:
        return next(iter(settings_in(name)[1]), "")
    except SandboxError:  # it has its name from Python
        return ""
