"""pydantic's validation errors, worded for the author of a scene."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from importlib.metadata import version
from typing import Final, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails, PydanticCustomError

from sandbox.errors import KeyPath, SandboxError, dotted, shown, suggestion

Message = str | Callable[[], str]  # one that takes long to make is a function, called only if it is shown
Problem = tuple[KeyPath, Message]  # a path, and what is wrong there: "must be ..."
NUMBER, TABLE = KINDS = ("<number>", "<table>")  # tags of values that may be either, which pydantic adds to paths


def invalid(*problems: Problem) -> PydanticCustomError:
    """Return an error for a validator to raise: several problems, each with its path from the validated value."""
    return PydanticCustomError("problems", "several problems", {"problems": problems})


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


def problems_of(error: ValidationError, model: type[BaseModel]) -> list[Problem]:
    """Return what pydantic found in a table: its own problems, and those of its inner tables, which are worded."""
    found: dict[Problem, None] = {}  # both entries of an empty pair are one problem
    for detail in error.errors(include_url=False):
        path = tuple(key for key in detail["loc"] if key not in KINDS)
        if detail["type"] == "problems":
            found |= {((*path, *inner), message): None for inner, message in detail["ctx"]["problems"]}
        elif detail["type"] == "missing" and isinstance(path[-1], int):
            found[path[:-1], f"must be a list of two, got {shown(detail['input'])}"] = None
        else:
            found[path, _message(detail, path, model)] = None
    return [*found]


def shown_problems(problems: Iterable[Problem]) -> Iterator[tuple[KeyPath, str]]:
    """Yield each problem with its message as text."""
    return ((path, message if isinstance(message, str) else message()) for path, message in problems)


def sandbox_error(error: ValidationError, model: type[BaseModel], within: KeyPath = ()) -> SandboxError:
    """Return one error with every problem of a `model`, a line each. within: the start of all paths, left out."""
    problems = shown_problems(problems_of(error, model))
    return SandboxError("\n".join(f"{dotted(path[len(within) :])} {message}".lstrip() for path, message in problems))


def _message(detail: ErrorDetails, path: KeyPath, model: type[BaseModel]) -> Message:
    fields = {str(field.validation_alias or name): field for name, field in model.model_fields.items()}
    given = detail["input"]
    if detail["type"] == "extra_forbidden":
        return lambda: _unknown(str(path[-1]), fields)  # pydantic formats what it is given: a lambda is short
    if detail["type"] == "missing":
        meaning = (fields[str(path[-1])].description or "").rstrip(".")
        return f"is missing ({meaning})" if meaning else "is missing"
    if detail["type"] == "tuple_type" and isinstance(given, dict):
        return f"must be a list of tables, [[{dotted(path)}]] in a file"
    if detail["type"] == "model_type" and isinstance(given, list):
        return f"must be one table, [{dotted(path)}] in a file"
    if (template := _MESSAGES.get(detail["type"])) is None:
        return detail["msg"]
    kind = fields[str(path[-1])].annotation if path and str(path[-1]) in fields else None
    kinds = [kind] if get_origin(kind) is tuple else get_args(kind)  # of Vector | None
    is_vector = any(get_origin(kind) is tuple and ... not in get_args(kind) for kind in kinds)
    example = ", such as [0, 900]" if is_vector and isinstance(given, int | float) else ""
    return template.format(got=shown(given), example=example, **detail.get("ctx", {}))


def _unknown(key: str, known: Iterable[str]) -> str:
    """Return the message for a key that is mistyped, or from a newer version: new versions add keys."""
    here = version("pymunk-sandbox")
    return f"is not a key of sandbox {here} (perhaps of a newer one); {suggestion(key, known)}"
