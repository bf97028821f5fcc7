"""Arguments of the Python interface, checked before it runs. The command line reads scenes and inputs with them."""

import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sandbox.errors import SandboxError, shown
from sandbox.run.inputs import Input, Start, check_inputs, load_inputs
from sandbox.scene.fields import Count, Index, Model, NotNegative
from sandbox.scene.files import load
from sandbox.scene.model import Scene

AnyScene = Scene | str | os.PathLike[str]  # a scene, the name of a bundled one, or a file
AnyInputs = Sequence[Input | Mapping[str, object]] | str | os.PathLike[str]  # or a file of them


class Arguments(Model):
    """Arguments that are not those of a scene. Raises SandboxError if one is wrong."""

    against: str | None = None
    steps: Index | None = None
    tolerance: NotNegative | None = None
    workers: Count = 1
    rates: tuple[Count, ...] = ()
    starts: Count = 1
    settings: dict[str, Any] | None = None


def scene_of(scene: AnyScene) -> Scene:
    """Return a scene, or load it. Raises SandboxError as `load` does."""
    return scene if isinstance(scene, Scene) else load(scene)


def replay(scene: AnyScene, inputs: AnyInputs | None, **changes: object) -> tuple[Scene, list[Input]]:
    """Return a scene with the changes that are not None, and inputs, which bring their own seed and rate.

    Raises SandboxError if the scene, the inputs or a change is invalid.
    """
    chosen = scene_of(scene)
    recorded = [] if inputs is None else _inputs_of(inputs, chosen)
    if recorded and isinstance(start := recorded[0], Start):
        chosen = start.change_scene(chosen)
    return chosen.changed(**{key: plain(value) for key, value in changes.items() if value is not None}), recorded


def _inputs_of(inputs: AnyInputs, scene: Scene) -> list[Input]:
    if isinstance(inputs, str | os.PathLike):
        return load_inputs(Path(inputs), scene)
    if not isinstance(inputs, Iterable) or isinstance(inputs, Mapping):
        raise SandboxError(f"inputs must be a list of inputs, or a file of them, got {shown(inputs)}")
    return check_inputs([plain(entry) if isinstance(entry, Mapping) else entry for entry in inputs], scene)


def plain(value: object) -> Any:
    """Return numbers, arrays and vectors of any library, also within tables, as Python's, which models require."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Mapping):
        return {key: plain(each) for key, each in value.items()}
    if isinstance(value, Iterable) and not isinstance(value, str):
        return [plain(each) for each in value]
    return value


def several(name: str, values: object) -> list[Any]:
    """Return one value or several as a list. Raises SandboxError if it is empty."""
    items = list(values) if isinstance(values, Iterable) and not isinstance(values, str | Scene) else [values]
    if not items:
        raise SandboxError(f"{name} must contain at least one, got an empty list")
    return items
