"""The tables of docs/formats.md, made from the models of the files: heading -> the lines of its table.

A key's meaning is the docstring below it in a model of pydantic, or the comment behind it elsewhere.
"""

import inspect
import re
from collections.abc import Iterator, Mapping
from typing import Any, Final

import sandbox.state
from sandbox.analysis.comparison import Conditions
from sandbox.analysis.difference import Difference
from sandbox.analysis.figures import Figures
from sandbox.judge.causes import Cause, Entry
from sandbox.judge.summary import CauseOfError
from sandbox.run.inputs import INPUT_KINDS
from sandbox.scene.model import Scene
from sandbox.scores.verify import Judged

SCENE: Final = Scene.model_json_schema()
MODELS: Final = {  # heading -> the model of its keys
    "At the top": SCENE,
    "In `[arena]`": SCENE["$defs"]["Arena"],
    "In each `[[balls]]`": SCENE["$defs"]["BallGroup"],
    "In each `[[walls]]`": SCENE["$defs"]["Wall"],
    "In `[pymunk]`": SCENE["$defs"]["PymunkSettings"],
    "In each `[[expect]]`": SCENE["$defs"]["Expect"],
}
COMMENTED: Final[dict[str, Any]] = {  # heading -> what has a comment behind each key, and its lines
    "A comparison": Conditions,
    "Each engine": Figures,
    "Each of `causes`": CauseOfError,
    "Each line of `ledger`": Entry,
    "A `first_difference`": Difference,
    "Scores": Judged,
    "Contacts": sandbox.state,
}
FIELD: Final = r"^    (\w+): [^#\n]*(?:  # (.*))?$"  # of a dataclass
ENTRY: Final = r'^        \("(\w+)", "[if]8".*\),  # (.*)$'  # of a dtype


def tables() -> dict[str, list[str]]:
    """Return the lines of each table by the heading that it follows."""
    made = {title: _table(("key", "meaning"), _keys(model)) for title, model in MODELS.items()}
    for title, of in COMMENTED.items():
        source = inspect.getsource(of)
        rows = re.findall(ENTRY if of is sandbox.state else FIELD, source, re.MULTILINE)
        made[title] = _table(("key", "meaning"), ((f"`{key}`", _of_json(comment)) for key, comment in rows))
    made["Causes"] = _table(("key", "label"), ((f"`{cause.key}`", cause.label) for cause in Cause))
    made["Inputs"] = _table(("`do`", "keys", "meaning"), _inputs())
    return made


def _table(head: tuple[str, ...], rows: Iterator[tuple[str, ...]]) -> list[str]:
    """Return the lines of a table: its head, and a line for each row."""
    return [" | ".join(head), "|".join(["---"] * len(head)), *(" | ".join(row) for row in rows)]


def _keys(model: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield name and meaning of each key that is no table of its own, with its default."""
    for key, schema in model["properties"].items():
        if "description" in schema and key != "pegs":
            default = schema.get("default")
            shown = f" ({str(default).lower()})" if isinstance(default, str | int | float | list) else ""
            required = " (required)" if key in model.get("required", ()) else ""
            yield f"`{key}`", f"{schema['description'].rstrip('.')}{required}{shown if default != '' else ''}"


def _of_json(comment: str) -> str:
    """Return a comment in the words of JSON."""
    return comment.replace("None", "`null`")


def _inputs() -> Iterator[tuple[str, str, str]]:
    """Yield name, keys and meaning of each kind of input; keys that may be left out are in brackets."""
    for do, kind in INPUT_KINDS.items():
        names = {field.serialization_alias or name: field for name, field in kind.model_fields.items()}
        keys = [f"{name}" if field.is_required() else f"[{name}]" for name, field in names.items()]
        shown = ", ".join(key for key in keys if key not in ("step", "[do]", "[step]"))
        yield f"`{do}`", shown, re.split(r"[.;\n]", kind.__doc__ or "")[0]
