"""Pymunk's settings as the window changes them: their values in force, and the specs of engines that have others."""

import math
from typing import Final

from sandbox.engines import TUNED, resolved, settings_in, with_settings
from sandbox.engines.pymunk import settings_of
from sandbox.scene.model import PymunkSettings, Scene

SCALES: Final[dict[str, tuple[float, ...]]] = {  # the values to choose from, round Pymunk's own
    "iterations": (1, 2, 3, 5, 10, 15, 20, 30, 50, 100, 200, 500),
    "substeps": (1, 2, 3, 4, 6, 8, 12, 16, 24, 32),
    "collision_slop": (0, 0.001, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5),
    "collision_bias": (0, 1e-6, 1e-5, 1e-4, 0.001797, 0.01, 0.05, 0.1, 0.2, 0.5, 0.8, 1),
    "collision_persistence": (0, 1, 2, 3, 5, 10, 20, 50),
    "damping": (0.1, 0.2, 0.5, 0.7, 0.8, 0.9, 0.95, 0.98, 0.99, 0.995, 0.999, 1),
}
UNITS: Final = {"collision_slop": " px"}
SAME: Final = 1e-4  # relative difference below which a value in force stands in place of one of a scale


def has_settings(spec: str) -> bool:
    """Return whether an engine has these settings."""
    return settings_in(spec)[0] == TUNED


def in_force(spec: str, scene: Scene) -> dict[str, float]:
    """Return every setting with which the Pymunk of a spec runs a scene. Raises SandboxError if one is not valid."""
    return settings_of(resolved(spec, scene)[1])


def normal(spec: str, scene: Scene) -> str:
    """Return the shortest spec of the same engine: without the settings that it has anyway, the others in their order.

    Raises SandboxError if a setting is not valid.

    >>> from sandbox.scene.files import load
    >>> normal("pymunk(substeps=4,  iterations=10, damping=0.9)", load("article"))
    'pymunk(substeps=4, damping=0.9)'
    """
    base, settings = settings_in(spec)
    if not settings:
        return spec
    wanted, own = in_force(spec, scene), settings_of(scene)
    return with_settings(base, {key: wanted[key] for key in settings if wanted[key] != own[key]})


def are_same(spec: str, other: str, scene: Scene) -> bool:
    """Return whether two specs are of the same engine: with the same settings, in whatever order."""
    return settings_in(normal(spec, scene)) == settings_in(normal(other, scene))


def with_setting(spec: str, scene: Scene, key: str, value: float) -> str:
    """Return the shortest spec of Pymunk with one of its settings changed; a new one is the last."""
    base, settings = settings_in(spec)
    return normal(with_settings(base, settings | {key: value}), scene)


def scale_of(key: str, *values: float) -> tuple[float, ...]:
    """Return the values of a setting to choose from, in ascending order; some values are among them to the bit."""
    others = (one for one in SCALES[key] if not any(math.isclose(one, value, rel_tol=SAME) for value in values))
    return tuple(sorted({*others, *values}))


def meaning_of(key: str) -> str:
    """Return what a setting is, as the scene's schema says it."""
    return str(PymunkSettings.model_fields[key].description).partition(";")[0].rstrip(".")
