"""pydantic's validation errors, worded for the author of a scene."""

import functools
from collections.abc import Callable, Iterable, Iterator, Mapping
from importlib.metadata import version
from typing import Any, Final

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails, InitErrorDetails, PydanticCustomError

from sandbox.errors import KeyPath, SandboxError, dotted, shown, suggestion

Problem = tuple[KeyPath, str]  # a path, and what is wrong there: "must be ..."
NUMBER, TABLE = KINDS = ("<number>", "<table>")  # tags of values that may be either, which pydantic adds to paths


def invalid(*problems: tuple[KeyPath, str | Callable[[], str]]) -> PydanticCustomError:
    """Return an error for a validator to raise: several problems, each with its path from the validated value.

    A message that takes long to make is a function, which is called only if the message is shown.
    """
    return PydanticCustomError("problems", "{problems}", {"problems": list(problems)})


def with_problems(error: ValidationError, problems: Iterable[Problem]) -> ValidationError:
    """Return an error of pydantic's, with problems of the same table beside its own."""
    details = [
        InitErrorDetails(
            type=invalid(*detail["ctx"]["problems"]) if detail["type"] == "problems" else detail["type"],
            loc=detail["loc"],
            input=detail["input"],
            ctx=detail.get("ctx", {}),
        )
        for detail in error.errors(include_url=False)
    ]
    if more := [*problems]:
        details.append(InitErrorDetails(type=invalid(*more), input=None))
    return ValidationError.from_exception_data(error.title, details)


_MESSAGES: Final[Mapping[str, str]] = {
    "greater_than": "must be greater than {gt:g}, got {got}",
    "greater_than_equal": "must be at least {ge:g}, got {got}",
    "less_than": "must be less than {lt:g}, got {got}",
    "less_than_equal": "must be at most {le:g}, got {got}",
    "finite_number": "must be a finite number, got {got}",
    "bool_type": "must be true or false, got {got}",
    "float_type": "must be a number, got {got}",
    "int_type": "must be a whole number, got {got}",
    "string_type": "must be text in quotes, got {got}",
    "string_too_long": "must have at most {max_length} characters, got {got}",
    "string_unicode": "must not contain half of a surrogate pair, got {got}",
    "tuple_type": "must be a list in brackets{example}, got {got}",
    "literal_error": "must be {expected}, got {got}",
    "enum": "must be {expected}, got {got}",
    "union_tag_invalid": "must have {discriminator} as one of {expected_tags}, got '{tag}'",
    "union_tag_not_found": "must have {discriminator}, got {got}",
    "too_short": "must have at least {min_length} entries, got {actual_length}",
    "too_long": "must have at most {max_length} entries, got {actual_length}",
    "model_type": "must be a table of keys, got {got}",
}


def problems_of(
    error: ValidationError, model: type[BaseModel], within: KeyPath = (), *, is_toml: bool = True
) -> Iterator[Problem]:
    """Yield every problem that pydantic found in a `model`, once. within: the start of all paths, which is left out."""
    seen = set()
    for problem in _problems(error, model, len(within), is_toml):
        if problem not in seen:
            seen.add(problem)
            yield problem


def sandbox_error(error: ValidationError, model: type[BaseModel], within: KeyPath = ()) -> SandboxError:
    """Return one error with every problem of a `model` that was not read from a scene file, a line each."""
    lines = (f"{dotted(path)} {message}".lstrip() for path, message in problems_of(error, model, within, is_toml=False))
    return SandboxError("\n".join(lines))


def _problems(error: ValidationError, model: type[BaseModel], skipped: int, is_toml: bool) -> Iterator[Problem]:
    for detail in error.errors(include_url=False):
        keys = tuple(key for key in detail["loc"][skipped:] if key not in KINDS)
        path = tuple(key for key in keys if key not in _tags(model))
        if detail["type"] == "problems":
            for inner, message in detail["ctx"]["problems"]:
                yield (*path, *inner), message if isinstance(message, str) else message()
        elif detail["type"] == "extra_forbidden":
            yield path, _unknown(str(path[-1]), _keys_at(model, keys[:-1]))
        elif detail["type"] == "missing" and isinstance(path[-1], int):
            yield path[:-1], f"must be a list of two, got {shown(detail['input'])}"
        elif detail["type"] == "missing":
            meaning = _keys_at(model, keys[:-1])[str(path[-1])].get("description", "").rstrip(".")
            yield path, f"is missing ({meaning})" if meaning else "is missing"
        elif is_toml and detail["type"] == "tuple_type" and isinstance(detail["input"], dict):
            yield path, f"must be a list of tables: write [[{dotted(path)}]]"
        elif is_toml and detail["type"] == "model_type" and isinstance(detail["input"], list):
            yield path, f"must be one table: write [{dotted(path)}]"
        else:
            yield path, _message(detail)


def _unknown(key: str, known: Iterable[str]) -> str:
    """Return the message for a key that is mistyped, or from a newer version: new versions add keys."""
    here = version("pymunk-sandbox")
    return f"is not a key of sandbox {here} (perhaps of a newer one); {suggestion(key, known)}"


def _message(detail: ErrorDetails) -> str:
    template = _MESSAGES.get(detail["type"])
    if template is None:
        return detail["msg"]
    example = ", such as [0, 900]" if isinstance(detail["input"], int | float) else ""
    return template.format(got=shown(detail["input"]), example=example, **detail.get("ctx", {}))


@functools.cache
def _schema(model: type[BaseModel]) -> dict[str, Any]:
    return model.model_json_schema()


@functools.cache
def _tags(model: type[BaseModel]) -> frozenset[str]:
    """Return the names of the kinds of tables between which a key decides: pydantic adds them to paths."""

    def mappings(node: object) -> Iterator[str]:
        if isinstance(node, dict):
            yield from node.get("discriminator", {}).get("mapping", ())
        for inner in node.values() if isinstance(node, dict) else node if isinstance(node, list) else ():
            yield from mappings(inner)

    return frozenset(mappings(_schema(model)))


def _keys_at(model: type[BaseModel], path: KeyPath) -> dict[str, Any]:
    """Return the keys of the table at a path with the names of kinds, each key with its JSON Schema."""
    schema = _schema(model)
    node = schema
    for key in path:
        if reference := node.get("discriminator", {}).get("mapping", {}).get(key):
            node = schema["$defs"][reference.rsplit("/", 1)[-1]]
            continue
        node = node["items"] if isinstance(key, int) else node["properties"][key]
        kinds = [
            kind for kind in node.get("anyOf", node.get("oneOf", [])) if kind.get("type") not in ("null", "number")
        ]
        node = kinds[0] if kinds and "discriminator" not in node else node
        if "$ref" in node:
            node = schema["$defs"][node["$ref"].rsplit("/", 1)[-1]]
    properties: dict[str, Any] = node["properties"]
    return properties
