"""Scene files: reading and writing their TOML, the bundled scenes, and the JSON Schema."""

import itertools
import os
import re
import tomllib
from collections.abc import Iterator, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

import numpy as np
import tomlkit
from pydantic import ValidationError

from sandbox.errors import SandboxError, dotted, first_errors, shown, suggestion
from sandbox.files import MAX_TEXT_FILE_BYTES, read_text, write_text
from sandbox.scene.balls import BallGroup, Filter
from sandbox.scene.fields import partial
from sandbox.scene.model import Scene
from sandbox.scene.overlaps import balls_in_walls, needed_overlap
from sandbox.scene.toml_lines import Source, last_key, line_of, lines_of_keys
from sandbox.scene.validation import Problem, problems_of
from sandbox.state import Bodies, State
from sandbox.text import printable

TRUTHS: Final = "truths"  # folder of the bundled scenes that each test a law of physics


def bundled(folder: str = "") -> dict[str, Path]:
    """Return the scenes that come with the sandbox, or those in one of their folders: name for `load` -> file."""
    package = Path(str(files("sandbox")))
    homes = (package / "scenes", package.parent / "scenes")  # in a wheel, in a checkout
    scenes = next(home for home in homes if home.is_dir())
    paths = sorted((scenes / folder).glob("*.toml"))
    return {file.relative_to(scenes).with_suffix("").as_posix(): file for file in paths}


def scenes() -> dict[str, Scene]:
    """Return the bundled scenes by name, without those of the folder truths.

    >>> [name for name, scene in scenes().items() if len(scene.bodies) == 6]
    ['billiards', 'newtons-cradle']
    """
    return {name: load(name) for name in bundled()}


def load(scene: str | os.PathLike[str]) -> Scene:
    """Read a scene from a TOML file, or a bundled scene by its name, such as "article" or "truths/corner".

    Raises SandboxError if there is no such scene, or with every error in the file: a line each, `file:line: key ...`.

    >>> load("oblique")
    <Scene oblique: 2 balls, 3 s at 60 steps a second>
    """
    if not isinstance(scene, str | os.PathLike):
        raise SandboxError(f"a scene must be the name of a bundled scene or a file, got {shown(scene)}")
    path = Path(scene)
    if path.suffix == ".py":
        raise SandboxError(
            f"{scene}: is a Python program, not a scene; sandbox watch {scene} runs a Pymunk program, and "
            f"--engines {scene}:NAME a class or a function in it as an engine"
        )
    if not path.suffix and not os.path.exists(path):  # noqa: PTH110  (Path.exists raises if the name is too long)
        name = path.as_posix()
        known = bundled(TRUTHS if path.parent == Path(TRUTHS) else "")
        if name not in known:
            raise SandboxError(f"no scene {name!r}: neither a file nor a bundled scene; {suggestion(name, known)}")
        path = known[name]
    return parse(read_text(path), str(path))


def parse(text: str, file: str) -> Scene:
    """Return the scene of a TOML text. `file` is its name in messages. Raises SandboxError as `load` does."""
    text, name = re.sub(r"(?<!\r)\r+\n", "\n", text), printable(file)  # tomllib accepts \r\r\n too
    document, problems = _document(text, name), list[Problem]()
    try:
        scene = Scene.model_validate(document, by_alias=True, by_name=False)
        scene._source = Source(file, text)
    except ValidationError as error:
        problems += problems_of(error, Scene)
        scene = partial(Scene, document)
    problems += scene.problems_of_file()
    if not problems:
        return scene
    problems += balls_in_walls(scene)
    lines = lines_of_keys(text)
    errors = sorted((line_of(path, lines) or 0, f"{dotted(path)} {message}") for path, message in problems)
    raise first_errors((f"{name}:{line}: {what}" if line else f"{name}: {what}" for line, what in errors), name)


def _document(text: str, name: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        what, _, place = str(error).partition(" (at line ")
        line = place.partition(",")[0] if place[:1].isdigit() else ""
        problem = f"is not valid TOML: {what}"
        if line and what.startswith(("Cannot declare", "Cannot overwrite")):
            path, last, first = last_key("\n".join(text.split("\n")[: int(line)]))
            if first < last:
                problem = f"{dotted(path)} is given twice, first in line {first}"
        raise SandboxError(f"{name}{line and ':'}{line}: {problem}") from None
    except (ValueError, RecursionError):  # int() parses at most 4,300 digits
        raise SandboxError(f"{name}: is nested too deeply, or contains a number with too many digits") from None


def dump(scene: Scene, path: str | Path, state: State | None = None) -> None:
    """Write a scene file, which `load` reads as an equal scene.

    With a state, its balls start in that state, to the bit but for their angles, and expectations are left out.
    Raises SandboxError if the path does not end in .toml, or if the file would not load again or cannot be written.
    """
    if not isinstance(scene, Scene):
        raise SandboxError(f"scene must be a sandbox.Scene, got {shown(scene)}")
    if not isinstance(path, str | Path) or Path(path).suffix != ".toml":
        raise SandboxError(f"{path}: a scene file must end in .toml")
    document = _document_of(scene, state)
    too_large = len(repr(document)) > MAX_TEXT_FILE_BYTES  # checked first: to dump it would take minutes
    text = "" if too_large else tomlkit.dumps(_plain(document))
    if too_large or len(text.encode()) > MAX_TEXT_FILE_BYTES:
        raise SandboxError(
            f"{path}: {len(scene.bodies):,} balls do not fit in the {MAX_TEXT_FILE_BYTES:,} bytes of a scene file"
        )
    parse(text, str(path))
    write_text(path, text)


def _document_of(scene: Scene, state: State | None) -> dict[str, Any]:
    """Return the keys of a scene that are not at their defaults. With a state, its balls start there."""
    document = scene.model_dump(mode="json", by_alias=True, exclude_defaults=True)
    if state:
        document.pop("expect", None)
        document["arena"]["overlap"] = needed_overlap(scene, state.position)
        if not document["arena"]["overlap"]:
            del document["arena"]["overlap"]
        document["balls"] = list(ball_groups(scene.bodies, state, scene.colors))
    return document


def ball_groups(bodies: Bodies, state: State, colors: Sequence[str] | None = None) -> Iterator[dict[str, Any]]:
    """Yield the table of a ball group for each run of balls of one kind and spin, which start in a state.

    colors: one for each ball; without them, groups have the palette's in turn.
    """
    numbers = np.column_stack([bodies.radius, bodies.mass, bodies.elasticity, bodies.friction, state.spin]).tolist()
    kinds = [*zip(numbers, bodies.filters.tolist(), strict=True)]
    for (constants, filter_), alike in itertools.groupby(range(len(bodies)), key=kinds.__getitem__):
        balls = list(alike)
        kind = BallGroup.model_construct(
            **dict(zip(("radius", "mass", "elasticity", "friction", "spin"), constants, strict=True)),
            filter=Filter.model_construct(**dict(zip(Filter.model_fields, filter_, strict=True))),
        )
        group = kind.model_dump(exclude_defaults=True)
        if colors:
            of_group = [colors[ball] for ball in balls]
            group["colors"] = of_group[:1] if len(set(of_group)) == 1 else of_group
        rows = {"position": state.position[balls].tolist(), "velocity": state.velocity[balls].tolist()}
        if len(balls) == 1:
            yield group | {key: values[0] for key, values in rows.items()}
        else:
            yield group | {"positions": rows["position"], "velocities": rows["velocity"]}


def _plain(value: Any) -> Any:
    """Prepare a document for tomlkit: whole numbers without a fraction, lists of lists with a line per list."""
    if isinstance(value, dict):
        return {key: _plain(inner) for key, inner in value.items()}
    if isinstance(value, list) and value and isinstance(value[0], list):
        # tomlkit takes quadratic time to grow an array entry by entry.
        return tomlkit.value("[\n" + "".join(f"    {_plain(inner)},\n" for inner in value) + "]")
    if isinstance(value, list):
        return [_plain(inner) for inner in value]
    if isinstance(value, float) and value.is_integer() and str(value) != "-0.0":
        return int(value)
    return value


def schema() -> dict[str, Any]:
    """Return the JSON Schema of a scene file, for editors."""
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    return head | Scene.model_json_schema() | {"description": "Balls, walls and gravity, which several engines run."}
