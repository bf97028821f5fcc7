"""A live `pymunk.Space` in a file: a pickle, of which only classes of Pymunk are read, so that it can run no code."""

import io
import pickle
from pathlib import Path
from typing import Any

import pymunk

from sandbox.errors import SandboxError
from sandbox.files import whole_file
from sandbox.space.contents import checked
from sandbox.text import printable


class _Reader(pickle.Unpickler):
    def find_class(self, module: str, name: str) -> Any:
        found = super().find_class(module, name) if module.startswith("pymunk.") and name.isidentifier() else None
        if not isinstance(found, type) or found.__module__ != module:
            raise pickle.UnpicklingError(f"{module}.{name} is not a class of Pymunk")
        return found


def save_space(space: pymunk.Space, path: str | Path) -> None:
    """Write a Space to a file, without the impulses of its last step.

    Raises SandboxError if the space is not a Space or has functions of the program, or if it cannot be written.
    """
    try:
        _Reader(io.BytesIO(content := pickle.dumps(checked(space)))).load()
    except (pickle.PickleError, AttributeError, TypeError) as error:
        raise SandboxError(f"the Space has what a file cannot have: {error}") from None
    with whole_file(path) as file:
        file.write(content)


def load_space(path: str | Path) -> pymunk.Space:
    """Return the Space in a file that `save_space` wrote. Raises SandboxError if it cannot be read."""
    try:
        return checked(_Reader(io.BytesIO(Path(path).read_bytes())).load())
    except Exception as error:  # a damaged pickle may raise any
        raise SandboxError(f"{printable(str(path))}: cannot be read as a Space: {error}") from None
