"""Errors that pydantic found, in the words of a person who writes the file."""

import functools
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, Final

from sandbox.errors import KeyPath, SandboxError, dotted, nearest, shown

if TYPE_CHECKING:  # slow to import, and every command imports this module
    from pydantic import BaseModel, ValidationError
    from pydantic_core import ErrorDetails, PydanticCustomError


Finding = tuple[KeyPath, str]  # a path and what is wrong there, which reads on from it: "must be ..."


def findings(*found: tuple[KeyPath, str | Callable[[], str]]) -> "PydanticCustomError":
    """Make the error a validator raises where it found several (path from here, message) at once.

    What takes long to say is a function that does, which is called only if it is among the first that are told.
    """
    from pydantic_core import PydanticCustomError

    return PydanticCustomError("findings", "{found}", {"found": list(found)})


_SAYS: Final[Mapping[str, str]] = {
    "greater_than": "must be greater than {gt:g}, got {got}",
    "greater_than_equal": "must be at least {ge:g}, got {got}",
    "less_than": "must be less than {lt:g}, got {got}",
    "less_than_equal": "must be at most {le:g}, got {got}",
    "finite_number": "must be a finite number, got {got}",
    "float_type": "must be a number, got {got}",
    "int_type": "must be a whole number, got {got}",
    "string_type": "must be text in quotes, got {got}",
    "string_too_long": "must have at most {max_length} characters, got {got}",
    "string_unicode": "must not have half of a surrogate pair, got {got}",
    "tuple_type": "must be a list in brackets, got {got}",
    "literal_error": "must be {expected}, got {got}",
    "too_short": "must have at least {min_length} entries, got {actual_length}",
    "too_long": "must have at most {max_length} entries, got {actual_length}",
    "model_type": "must be a table of keys, got {got}",
    "union_tag_invalid": "must be one of {expected_tags}, got {got}",
    "union_tag_not_found": "needs the key {discriminator}",
}


def explain(error: "ValidationError", model: "type[BaseModel]") -> Iterator[Finding]:
    """Put each error pydantic found in a `model` in the words of a person who writes the file."""
    told = set()
    for finding in _findings(error, model):
        if finding not in told:
            told.add(finding)
            yield finding


def error_of(error: "ValidationError", model: "type[BaseModel]") -> SandboxError:
    """Make one mistake of all errors that pydantic found in a `model` that is no file's."""
    return SandboxError("\n".join(f"{dotted(path)} {message}" for path, message in explain(error, model)))


def _findings(error: "ValidationError", model: "type[BaseModel]") -> Iterator[Finding]:
    for detail in error.errors(include_url=False):
        path = detail["loc"]
        if detail["type"] == "findings":
            for inner, message in detail["ctx"]["found"]:
                yield (*path, *inner), message if isinstance(message, str) else message()
        elif detail["type"] == "extra_forbidden":
            yield path, _unknown(str(path[-1]), _keys_at(model, path[:-1]))
        elif detail["type"] == "missing" and isinstance(path[-1], int):
            yield path[:-1], f"must be a list of two, got {shown(detail['input'])}"
        elif detail["type"] == "missing":
            meaning = _keys_at(model, path[:-1])[str(path[-1])].get("description", "").rstrip(".")
            yield path, f"is missing ({meaning})" if meaning else "is missing"
        elif detail["type"] == "tuple_type" and isinstance(detail["input"], dict):
            yield path, f"must be a list of tables: write [[{dotted(path)}]]"
        elif detail["type"] == "model_type" and isinstance(detail["input"], list):
            yield path, f"must be one table: write [{dotted(path)}]"
        else:
            yield path, _message(detail)


def _unknown(key: str, known: Iterable[str]) -> str:
    """Say that a key is mistyped, or of a newer version: a format grows by keys."""
    from importlib.metadata import version

    here = version("pymunk-sandbox")
    return f"is not a key of sandbox {here} (perhaps of a newer one); {nearest(key, known)}"


def _message(detail: "ErrorDetails") -> str:
    template = _SAYS.get(detail["type"])
    if template is None:
        return detail["msg"]
    return template.format(got=shown(detail["input"]), **detail.get("ctx", {}))


@functools.cache
def _schema(model: "type[BaseModel]") -> dict[str, Any]:
    return model.model_json_schema()


def _keys_at(model: "type[BaseModel]", path: KeyPath) -> dict[str, Any]:
    """Return the keys of the table that `path` names, and the JSON Schema of each."""
    schema = _schema(model)
    node = schema
    for key in path:
        node = node["items"] if isinstance(key, int) else node["properties"][key]
        node = next((kind for kind in node.get("anyOf", []) if kind.get("type") != "null"), node)
        if "$ref" in node:
            node = schema["$defs"][node["$ref"].rsplit("/", 1)[-1]]
    properties: dict[str, Any] = node["properties"]
    return properties
