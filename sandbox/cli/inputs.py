"""The scene and the recorded inputs that a command runs, and the inputs that it saves."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sandbox.run.inputs import Input
    from sandbox.scene.model import Scene


def scene_and_inputs(scene: str, inputs: Path | None, **changes: object) -> "tuple[Scene, Sequence[Input]]":
    """Load a scene and apply the changes that are not None; recorded inputs bring their own seed and rate."""
    from sandbox.scripting.arguments import replay

    chosen, recorded, warning = replay(scene, inputs, **changes)
    if warning:
        print(warning, file=sys.stderr)
    return chosen, recorded


def print_warnings(scene: "Scene") -> None:
    """Print what the author of a scene may not have meant. Raises SandboxError if its balls do not fit."""
    from sandbox.scene.spawn import spawn, warnings

    for warning in warnings(scene, spawn(scene)):
        print(warning, file=sys.stderr)
