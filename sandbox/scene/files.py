"""Scene files: the only reader and writer of their TOML, the bundled scenes, and the schema."""

import itertools
import math
import os
import re
import tomllib
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

import numpy as np
import tomlkit
from pydantic import (
    ValidationError,
)

from sandbox.errors import MAX_REPORTED, MAX_TEXT_FILE_BYTES, SandboxError, dotted, first_errors, nearest, read_text
from sandbox.files import whole_file
from sandbox.scene.model import ROUNDING, Scene
from sandbox.scene.toml_lines import line_of, lines_of_keys, too_deep
from sandbox.scene.validation import explain
from sandbox.state import State
from sandbox.text import printable

TRUTHS: Final = "truths"  # folder of the bundled scenes that hold a law each


def bundled(folder: str = "") -> dict[str, Path]:
    """Find the scenes that come with the sandbox, or those of a folder among them: what `load` takes -> file."""
    package = Path(str(files("sandbox")))
    homes = (package / "scenes", package.parent / "scenes")  # of a wheel, of a checkout
    scenes = next(home for home in homes if home.is_dir())
    found = sorted((scenes / folder).glob("*.toml"))
    return {file.relative_to(scenes).with_suffix("").as_posix(): file for file in found}


def load(scene: str | Path) -> Scene:
    """Read a scene: a file, or the name of a bundled scene, such as "article" or "truths/corner".

    Raises SandboxError with every mistake that the file has, a line each.
    """
    path = Path(scene)
    if not path.suffix and not os.path.exists(path):  # noqa: PTH110  (Path.exists raises where a name is too long)
        name = path.as_posix()
        known = bundled(TRUTHS if path.parent == Path(TRUTHS) else "")
        if name not in known:
            raise SandboxError(f"no scene {name!r}: no such file, nor a bundled scene; {nearest(name, known)}")
        path = known[name]
    return parse(read_text(path), str(path))


def parse(text: str, file: str) -> Scene:
    """Make a scene of TOML text; `file` is what messages call it. Raises SandboxError as `load` does."""
    text, name = re.sub(r"(?<!\r)\r+\n", "\n", text), printable(file)  # \r\r\n too, which tomllib reads
    if (deep := too_deep(text)) is not None:
        raise SandboxError(f"{name}:{deep}: is nested too deeply")
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        said, _, place = str(error).partition(" (at line ")
        line = f":{place.partition(',')[0]}" if place[:1].isdigit() else ""
        raise SandboxError(f"{name}{line}: is not valid TOML: {said}") from None
    except ValueError:  # of int(), which reads no more than 4,300 digits
        raise SandboxError(f"{name}: has a number of too many digits") from None
    try:
        scene = Scene.model_validate(document)
    except ValidationError as error:
        lines = lines_of_keys(text)
        found = sorted(
            (line_of(path, lines) or 0, f"{dotted(path)} {message}")
            for path, message in itertools.islice(explain(error, Scene), MAX_REPORTED + 1)
        )
        told = (f"{name}:{line}: {what}" if line else f"{name}: {what}" for line, what in found)
        raise first_errors(told, name) from None
    scene._file, scene._source = file, text
    return scene


def write(scene: Scene, state: State, path: str | Path) -> None:
    """Write a scene whose balls begin as they are in a state, to the bit. What was expected of the scene is left out.

    Raises SandboxError where it would not load again, or cannot be written.
    """
    numbers = np.column_stack([state.position, state.velocity]).tolist()
    text = _dumped(scene, state) if len(repr(numbers)) <= MAX_TEXT_FILE_BYTES else None  # that would take minutes
    if text is None or len(text.encode()) > MAX_TEXT_FILE_BYTES:
        size = f"{MAX_TEXT_FILE_BYTES:,} bytes"
        raise SandboxError(
            f"{path}: {len(scene.bodies):,} balls are more than the {size} of a scene file have room for"
        )
    parse(text, str(path))
    with whole_file(path) as file:
        file.write(text.encode())


def _dumped(scene: Scene, state: State) -> str:
    document = scene.model_dump(mode="json", by_alias=True, exclude_defaults=True, exclude={"balls", "expect"})
    document["arena"]["overlap"] = _overlap(scene, state)
    if not document["arena"]["overlap"]:
        del document["arena"]["overlap"]
    document["balls"] = list(_groups(scene, state))
    return tomlkit.dumps(_plain(document))


def _overlap(scene: Scene, state: State) -> float:
    """Return how deep the deepest ball is in a wall of the arena, px, with some room; 0 where none is."""
    radius, size = scene.bodies.radius[:, None], np.array(scene.arena.size)
    depth = np.maximum(radius - state.position, state.position + radius - size)
    return 0.0 if (depth <= ROUNDING * size).all() else math.ceil(1000 * float(depth.max())) / 1000


def _groups(scene: Scene, state: State) -> Iterator[dict[str, Any]]:
    """Yield a ball group for each run of balls that are alike."""
    bodies = scene.bodies
    kinds = np.column_stack([bodies.radius, bodies.mass, bodies.elasticity, bodies.friction]).tolist()
    for kind, alike in itertools.groupby(range(len(bodies)), key=kinds.__getitem__):
        balls = list(alike)
        group: dict[str, Any] = dict(zip(("radius", "mass", "elasticity", "friction"), kind, strict=True))
        for key, default in (("mass", 1), ("elasticity", 1), ("friction", 0)):
            if group[key] == default:
                del group[key]
        group["colors"] = _shortest_cycle([scene.colors[ball] for ball in balls])
        rows = {"position": state.position[balls].tolist(), "velocity": state.velocity[balls].tolist()}
        if len(balls) == 1:
            yield group | {key: values[0] for key, values in rows.items()}
        else:
            yield group | {"positions": rows["position"], "velocities": rows["velocity"]}


def _shortest_cycle(colors: list[str]) -> list[str]:
    """Return the fewest colours that, taken in turn, are these."""
    for length in range(1, len(colors)):
        if colors[length:] == colors[:-length]:
            return colors[:length]
    return colors


def _plain(value: Any) -> Any:
    """Prepare a document for tomlkit: whole numbers without a fraction, lists of lists a line each."""
    if isinstance(value, dict):
        return {key: _plain(inner) for key, inner in value.items()}
    if isinstance(value, list) and value and isinstance(value[0], list):
        # An array grown entry by entry takes tomlkit time as the square of their number.
        return tomlkit.value("[\n" + "".join(f"    {_plain(inner)},\n" for inner in value) + "]")
    if isinstance(value, list):
        return [_plain(inner) for inner in value]
    if isinstance(value, float) and value.is_integer() and str(value) != "-0.0":
        return int(value)
    return value


def schema() -> dict[str, Any]:
    """Make the JSON Schema of a scene file, for editors."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **Scene.model_json_schema()}
