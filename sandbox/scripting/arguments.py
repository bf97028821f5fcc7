"""Arguments of the Python interface, checked before it runs. The command line reads scenes and inputs with them."""

import math
import os
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final, TypeVar

import numpy as np

from sandbox.errors import SandboxError, UnknownName, shown, suggestion
from sandbox.files import write_text
from sandbox.run.inputs import Input, Start, check_inputs, load_inputs
from sandbox.scene.fields import Vector
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.text import printable

T = TypeVar("T")
AnyScene = Scene | str | os.PathLike[str]  # a scene, the name of a bundled one, or a file
AnyInputs = Sequence[Input | Mapping[str, object]] | str | os.PathLike[str]  # or a file of them
_WARN: Final = partial(warnings.warn, stacklevel=3)  # at the call of the function that replays


def scene_of(scene: AnyScene) -> Scene:
    """Return a scene, or load it. Raises SandboxError as `load` does."""
    return scene if isinstance(scene, Scene) else load(scene)


def replay(
    scene: AnyScene, inputs: AnyInputs | None, warn: Callable[[str], object] = _WARN, **changes: object
) -> tuple[Scene, list[Input]]:
    """Return a scene with the changes that are not None, and inputs, which bring their own seed and rate.

    warn: called with a message if the inputs were recorded on another scene. Raises SandboxError if the scene, the
    inputs or a change is invalid.
    """
    chosen = scene_of(scene)
    recorded = [] if inputs is None else _inputs_of(inputs, chosen)
    if recorded and isinstance(start := recorded[0], Start):
        if start.scene != chosen.name:
            file = printable(str(inputs)) if isinstance(inputs, str | os.PathLike) else "inputs"
            warn(f"{file}: warning: recorded on {shown(start.scene)}, not on {chosen.name}")
        chosen = start.change_scene(chosen)
    made = {key: _plain(value) for key, value in changes.items() if value is not None}
    return chosen.changed(**made), recorded


def _inputs_of(inputs: AnyInputs, scene: Scene) -> list[Input]:
    if isinstance(inputs, str | os.PathLike):
        return load_inputs(Path(inputs), scene)
    if not isinstance(inputs, Iterable) or isinstance(inputs, Mapping):
        raise SandboxError(f"inputs must be a list of inputs, or a file of them, got {shown(inputs)}")
    return check_inputs(inputs, scene)


def _plain(value: object) -> object:
    """Return NumPy's whole number as Python's, which a scene requires."""
    return int(value) if isinstance(value, np.integer) else value


def names_of(engines: str | Sequence[str] | None) -> Sequence[str] | None:
    """Return the name of one engine as a list of one, others as they are. Raises SandboxError for any other value."""
    names = [engines] if isinstance(engines, str) else engines
    if names is not None and not (isinstance(names, Sequence) and all(isinstance(name, str) for name in names)):
        raise SandboxError(f"engines must be the name of one or a list of names, got {shown(engines)}")
    return names


def reference_of(against: str | None) -> str | None:
    """Return the name of a reference, or None. Raises SandboxError if it is of another type."""
    if against is not None and not isinstance(against, str):
        raise SandboxError(f"against must be the name of an engine, got {shown(against)}")
    return against


def number(name: str, value: object) -> float:
    """Return a number. Raises SandboxError for any other value."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        raise SandboxError(f"{name} must be a number, got {shown(value)}")
    try:
        result = float(value)
    except OverflowError:  # a whole number may be larger than any float
        result = math.inf
    if not math.isfinite(result):
        raise SandboxError(f"{name} must be a finite number, got {shown(value)}")
    return int(value) if isinstance(value, int | np.integer) else result


def whole_number(name: str, value: object, least: int = 0) -> int:
    """Return a whole number. Raises SandboxError for any other value, and for one below the least."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        raise SandboxError(f"{name} must be a whole number, got {shown(value)}")
    count = int(value)
    if count < least:
        raise SandboxError(f"{name} must be at least {least}, got {shown(count)}")
    return count


def vector(name: str, value: Iterable[float]) -> Vector:
    """Return two numbers, of a tuple, an array or a vector. Raises SandboxError for any other value."""
    numbers = list(value) if isinstance(value, Iterable) else []
    if len(numbers) != 2:
        raise SandboxError(f"{name} must be two numbers, got {shown(value)}")
    x, y = (number(name, each) for each in numbers)
    return x, y


def several(name: str, values: object) -> list[Any]:
    """Return one value or several as a list. Raises SandboxError if it is empty."""
    items = list(values) if isinstance(values, Iterable) and not isinstance(values, str | bytes | Scene) else [values]
    if not items:
        raise SandboxError(f"{name} must contain at least one, got an empty list")
    return items


def save(what: str, path: str | os.PathLike[str], texts: Mapping[str, Callable[[], str]]) -> None:
    """Write the text that belongs to the ending of a path.

    Raises SandboxError if it is not a path, has another ending, or cannot be written.
    """
    if not isinstance(path, str | os.PathLike):
        raise SandboxError(f"the path of a file must be text, got {shown(path)}")
    if (ending := Path(path).suffix) not in texts:
        raise SandboxError(f"{printable(str(path))}: {what} must end in {' or '.join(texts)}")
    write_text(str(path), texts[ending]())


class ByName(dict[str, T]):
    """What there is of each scene, engine or column. what: which of these, in the message for an unknown name.

    >>> ByName("engine", {"exact": 1})["exakt"]
    Traceback (most recent call last):
    sandbox.errors.UnknownName: no engine "exakt" here; did you mean exact?
    """

    def __init__(self, what: str, items: Mapping[str, T]) -> None:
        super().__init__(items)
        self._what = what

    def __missing__(self, name: object) -> T:
        """Raise UnknownName, a SandboxError and a KeyError."""
        raise UnknownName(f"no {self._what} {shown(name)} here; {suggestion(str(name), self)}")
