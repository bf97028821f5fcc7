"""The scene and the recorded inputs that a command runs, and the inputs that it saves."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sandbox.errors import shown
from sandbox.text import printable

if TYPE_CHECKING:
    from sandbox.run.inputs import Input
    from sandbox.scene.model import Scene


def scene_and_inputs(scene: str, inputs: Path | None, **changes: Any) -> "tuple[Scene, Sequence[Input]]":
    """Load a scene and apply the changes that are not None; recorded inputs bring their own seed and rate."""
    from sandbox.run.inputs import Start, load_inputs
    from sandbox.scene.files import load

    chosen = load(scene)
    recorded = load_inputs(inputs, chosen) if inputs else []
    for given in recorded:
        if isinstance(given, Start):
            chosen = given.change_scene(chosen)
            if given.scene != chosen.name:
                file = printable(str(inputs))
                print(f"{file}: warning: recorded on {shown(given.scene)}, not on {chosen.name}", file=sys.stderr)
    return chosen.changed(**{key: value for key, value in changes.items() if value is not None}), recorded


def print_warnings(scene: "Scene") -> None:
    """Print what the author of a scene may not have meant. Raises SandboxError if its balls do not fit."""
    from sandbox.scene.spawn import spawn, warnings

    for warning in warnings(scene, spawn(scene)):
        print(warning, file=sys.stderr)
