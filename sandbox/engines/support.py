"""What each engine supports: it is asked with a small scene for each feature, which it accepts or refuses."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any, Final

from sandbox.engines import create, refusal, registry
from sandbox.engines.engine import Traits, traits_of
from sandbox.errors import EngineError
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn


class Feature(StrEnum):
    """What a scene can have and an engine can refuse."""

    RADII = "several radii"
    MASSES = "several masses"
    GRAVITY = "gravity"
    ELASTICITY = "elasticity below 1"
    FRICTION = "friction"
    SPIN = "spin"
    FILTERS = "filters of balls"
    WALLS = "inner walls"
    OPEN = "no walls round the arena"


@dataclass(frozen=True)
class Support:
    """What an engine supports: the features of scenes that it accepts, and its traits.

    An engine of your own that refuses nothing accepts all, also what it ignores.
    """

    accepts: tuple[Feature, ...]
    traits: Traits


_TRAITS: Final = {  # in the table
    "soft": "soft contacts",
    "reports_contacts": "reports its contacts",
    "can_be_dragged": "can be dragged",
}
_ARENA: Final = {"size": (120, 100)}
_BALL: Final = {"radius": 10, "position": (40, 50)}
_OTHER: Final = {"radius": 10, "position": (80, 50)}
_PLAIN: Final = Scene(arena=_ARENA, balls=[_BALL, _OTHER])
_CHANGES: Final[Mapping[Feature, Mapping[str, Any]]] = {  # of the plain scene
    Feature.RADII: {"balls": [_BALL, _OTHER | {"radius": 5}]},
    Feature.MASSES: {"balls": [_BALL, _OTHER | {"mass": 2}]},
    Feature.GRAVITY: {"gravity": (0, 900)},
    Feature.ELASTICITY: {"arena": _ARENA | {"elasticity": 0.5}},
    Feature.FRICTION: {"arena": _ARENA | {"friction": 0.5}, "balls": [_BALL | {"friction": 0.5}, _OTHER]},
    Feature.SPIN: {"balls": [_BALL | {"spin": 1}, _OTHER]},
    Feature.FILTERS: {"balls": [_BALL | {"filter": {"group": 1}}, _OTHER]},
    Feature.WALLS: {"walls": [{"from": (20, 90), "to": (100, 90)}]},
    Feature.OPEN: {"arena": _ARENA | {"walls": False}},
}


def engines() -> dict[str, Support]:
    """Return what each engine supports, by its name: the built-in engines, then the installed ones.

    Raises SandboxError if an installed engine fails in a scene without any of the features.

    >>> support = engines()
    >>> "gravity" in support["article"].accepts, "gravity" in support["impulse"].accepts
    (False, True)
    """
    scenes = {feature: _PLAIN.changed(**changes) for feature, changes in _CHANGES.items()}
    return {
        name: Support(
            tuple(feature for feature, scene in scenes.items() if _accepts(name, scene)),
            traits_of(create(name, _PLAIN, spawn(_PLAIN))),
        )
        for name in registry()
    }


def _accepts(name: str, scene: Scene) -> bool:
    try:
        return refusal(name, scene, builds=True) is None
    except EngineError:  # it is built, but not in the state that it should be in: with spin 0, for example
        return False


def rows(supported: Mapping[str, Support]) -> Iterator[tuple[str, list[bool]]]:
    """Yield the rows of a table: each feature and trait, and whether each engine has it."""
    for feature in Feature:
        yield feature, [feature in support.accepts for support in supported.values()]
    for trait, label in _TRAITS.items():
        yield label, [getattr(support.traits, trait) for support in supported.values()]


def as_json(supported: Mapping[str, Support]) -> dict[str, Any]:
    """Return what `sandbox engines --json` writes."""
    return {name: asdict(support) for name, support in supported.items()}
