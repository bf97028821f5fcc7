"""A Space as a file: the JSON of its description, a line for each body, shape and constraint."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import pymunk
from pydantic import ValidationError

from sandbox.errors import SandboxError, first_errors
from sandbox.files import read_text, write_text
from sandbox.run.inputs import json_document
from sandbox.scene.validation import sandbox_error
from sandbox.space.description import SpaceDescription, describe, rebuild
from sandbox.text import printable

MAX_BYTES: Final = 100_000_000  # of a file: room for 200,000 bodies


def save_space(space: pymunk.Space, path: str | Path) -> None:
    """Write a Space to a JSON file, between two steps; docs/formats.md explains it.

    Raises SandboxError if the file cannot be written, or a number in the Space is not finite.
    """
    write_description(describe(space), path)


def load_space(path: str | Path) -> pymunk.Space:
    """Return the Space in a JSON file that `save_space` wrote, as it was then, but without functions of a program.

    Raises SandboxError with every error in the file: `file: path.in.the.document what is wrong`.

    >>> import tempfile
    >>> space = pymunk.Space()
    >>> space.gravity = 0, 900
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save_space(space, f"{folder}/level.json")
    ...     again = load_space(f"{folder}/level.json")
    >>> again.gravity
    Vec2d(0.0, 900.0)
    """
    return rebuild(read_description(path)).space


@dataclass
class StartFile:
    """A file for a Space as it is before its first step. error: why it could not be written, if so."""

    path: str
    is_written: bool = False
    error: str = ""

    def write(self, space: pymunk.Space, dt: float) -> None:
        """Write the file. dt: the length of the step that follows, s."""
        try:
            write_description(describe(space).model_copy(update={"current_time_step": dt}), self.path)
            self.is_written = True
        except SandboxError as error:
            self.error = f"{self.path}: cannot have the Space: {error}"


def write_description(description: SpaceDescription, path: str | Path) -> None:
    """Write a description to a file. Raises SandboxError if it cannot be written."""
    write_text(path, text_of(description))


def read_description(path: str | Path) -> SpaceDescription:
    """Read a description from a file. Raises SandboxError with every error in it."""
    name = printable(str(path))
    text = read_text(Path(path), MAX_BYTES)
    try:
        return SpaceDescription.model_validate(json_document(text))
    except ValidationError as error:
        raise first_errors(
            (f"{name}: {line}" for line in str(sandbox_error(error, SpaceDescription)).split("\n")), name
        ) from None
    except SandboxError as error:
        raise SandboxError(f"{name}: {error}") from None


def text_of(description: SpaceDescription) -> str:
    """Return the JSON of a description: a line for each entry."""
    document = description.model_dump(mode="json")
    return "{\n" + ",\n".join(f"  {json.dumps(key)}: {_entries(value)}" for key, value in document.items()) + "\n}\n"


def _entries(value: Any) -> str:
    if not isinstance(value, list):
        return json.dumps(value, allow_nan=False)
    return "[\n" + ",\n".join(f"    {json.dumps(entry, allow_nan=False)}" for entry in value) + "\n  ]"


def schema() -> dict[str, Any]:
    """Return the JSON Schema of the file of a Space."""
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    content: dict[str, Any] = json.loads(json.dumps(SpaceDescription.model_json_schema()), parse_constant=str)
    return head | content
