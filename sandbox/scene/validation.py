"""pydantic's validation errors, worded for the author of a scene."""

import re
from collections.abc import Mapping
from functools import cache
from importlib.metadata import version
from typing import Final, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails, PydanticCustomError

from sandbox.errors import MAX_REPORTED_ERRORS, KeyPath, SandboxError, dotted, shown, suggestion

Problem = tuple[KeyPath, str]  # a path, and what is wrong there: "must be ..."
NUMBER, TABLE = KINDS = ("<number>", "<table>")  # tags of values that may be either, which pydantic adds to paths


def invalid(*problems: Problem) -> PydanticCustomError:
    """Return an error for a validator to raise: several problems, each with its path from the validated value."""
    return PydanticCustomError("problems", "several problems", {"problems": problems})


# In words of TOML; all others are pydantic's own.
_MESSAGES: Final[Mapping[str, str]] = {
    "greater_than_equal": "must be at least {ge:g}, got {got}",
    "less_than_equal": "must be at most {le:g}, got {got}",
    "bool_type": "must be true or false, got {got}",
    "float_type": "must be a number, got {got}",
    "int_type": "must be a whole number, got {got}",
    "string_type": "must be text in quotes, got {got}",
    "tuple_type": "must be a list in brackets{example}, got {got}",
    "too_short": "must have at least {min_length} entries, got {actual_length}",
    "too_long": "must have at most {max_length} entries, got {actual_length}",
    "model_type": "must be a table of keys, got {got}",
}


def problems_of(error: ValidationError, model: type[BaseModel]) -> list[Problem]:
    """Return what pydantic found in a table: its own first problems, and those of its inner tables, already worded."""
    found: dict[Problem, None] = {}  # both entries of an empty pair are one problem
    for detail in error.errors(include_url=False)[: MAX_REPORTED_ERRORS + 1]:
        path = tuple(key for key in detail["loc"] if key not in KINDS)
        if detail["type"] == "problems":
            found |= {((*path, *inner), message): None for inner, message in detail["ctx"]["problems"]}
        elif detail["type"] == "missing" and isinstance(path[-1], int):
            found[path[:-1], f"must be a list of two, got {shown(detail['input'])}"] = None
        else:
            found[path, _message(detail, path, model)] = None
    return [*found]


def sandbox_error(error: ValidationError, model: type[BaseModel], within: KeyPath = ()) -> SandboxError:
    """Return one error with every problem of a `model`, a line each. within: the start of all paths, left out."""
    problems = problems_of(error, model)
    return SandboxError("\n".join(f"{dotted(path[len(within) :])} {message}".lstrip() for path, message in problems))


def _message(detail: ErrorDetails, path: KeyPath, model: type[BaseModel]) -> str:
    fields = {str(field.validation_alias or name): field for name, field in model.model_fields.items()}
    given = detail["input"]
    if detail["type"] == "extra_forbidden":
        return _unknown(str(path[-1]), tuple(fields))
    if detail["type"] == "missing":
        meaning = (fields[str(path[-1])].description or "").rstrip(".")
        return f"is missing ({meaning})" if meaning else "is missing"
    if detail["type"] == "tuple_type" and isinstance(given, dict):
        return f"must be a list of tables, [[{dotted(path)}]] in a file"
    if detail["type"] == "model_type" and isinstance(given, list):
        return f"must be one table, [{dotted(path)}] in a file"
    if (template := _MESSAGES.get(detail["type"])) is None:
        return f"{re.sub('^.* should ', 'must ', detail['msg'])}, got {shown(given)}"
    kind = fields[str(path[-1])].annotation if path and str(path[-1]) in fields else None
    kinds = [kind] if get_origin(kind) is tuple else get_args(kind)  # of Vector | None
    is_vector = any(get_origin(kind) is tuple and ... not in get_args(kind) for kind in kinds)
    example = ", such as [0, 900]" if is_vector and isinstance(given, int | float) else ""
    return template.format(got=shown(given), example=example, **detail.get("ctx", {}))


@cache
def _unknown(key: str, known: tuple[str, ...]) -> str:
    """Return the message for a key that is mistyped, or from a newer version: new versions add keys."""
    here = version("pymunk-sandbox")
    return f"is not a key of sandbox {here} (perhaps of a newer one); {suggestion(key, known)}"
