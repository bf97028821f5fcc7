"""A user's mistakes: one message each, with what is wrong, where, and what would be right."""

import difflib
import functools
import itertools
import json
import os
import pathlib
import re
import sys
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, Final

from sandbox.plaintext import printable

if TYPE_CHECKING:  # slow to import, and every command imports this module
    from pydantic import BaseModel, ValidationError
    from pydantic_core import ErrorDetails, PydanticCustomError

Path = tuple[str | int, ...]  # of keys into a document: ("balls", 2, "radius")
Finding = tuple[Path, str]  # a path and what is wrong there, which reads on from it: "must be ..."

MAX_BYTES: Final = 2_000_000  # of a file that a person writes: room for 20,000 balls one by one
MAX_DEPTH: Final = 20  # of brackets, and of the parts of a dotted key: a scene needs five
MOST_TOLD: Final = 100  # mistakes of one file
MOST_SHOWN: Final = 40  # characters of what a file says
MOST_BITS: Final = 14_000  # of a whole number shown in decimals: Python writes no more than 4,300 digits


class Mistake(Exception):
    """Something the user can put right; its text is the whole message, one line a mistake, and printable."""

    def __init__(self, text: str) -> None:
        super().__init__("\n".join(map(printable, text.split("\n"))))


def findings(*found: tuple[Path, str | Callable[[], str]]) -> "PydanticCustomError":
    """Make the error a validator raises where it found several (path from here, message) at once.

    What takes long to say is a function that does, which is called only if it is among the first that are told.
    """
    from pydantic_core import PydanticCustomError

    return PydanticCustomError("findings", "{found}", {"found": list(found)})


def first_mistakes(found: Iterable[str], file: object) -> Mistake:
    """Make one mistake of all that were found in a file, a line each; of the first, where they are very many."""
    told = list(itertools.islice(found, MOST_TOLD + 1))
    if len(told) > MOST_TOLD:
        told[MOST_TOLD:] = [f"{file}: has more mistakes than these {MOST_TOLD}"]
    return Mistake("\n".join(told))


def shown(value: object) -> str:
    """Show a value in a message the way TOML writes it: short, on one line, printable.

    >>> shown([1.5, True]), shown(float("nan")), shown({"a": 16**5000})
    ('[1.5, true]', 'nan', '{"a": 0x1000000000000000000000000000...')
    """
    text = ""
    for piece in _pieces(value):
        text += piece
        if len(text) > MOST_SHOWN:
            return text[: MOST_SHOWN - 3] + "..."
    return text


def _pieces(value: object) -> Iterator[str]:
    """Write a value piece by piece, so that no more of it need be written than is shown."""
    if isinstance(value, dict | list | tuple):
        begin, end = "{}" if isinstance(value, dict) else "[]"
        yield begin
        for index, inner in enumerate(value):
            yield ", " if index else ""
            if isinstance(value, dict):
                yield f"{shown(inner)}: "
            yield from _pieces(value[inner] if isinstance(value, dict) else inner)
        yield end
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield hex(value) if isinstance(value, int) and value.bit_length() > MOST_BITS else str(value)
    else:
        yield json.dumps(value, default=str)


def dotted(path: Path) -> str:
    """Spell a path as the messages do.

    >>> dotted(("balls", 2, "radius"))
    'balls[2].radius'
    """
    return "".join(f"[{key}]" if isinstance(key, int) else f".{_bare_or_quoted(key)}" for key in path).lstrip(".")


def _bare_or_quoted(key: str) -> str:
    return key if re.fullmatch(rf"[\w-]{{1,{MOST_SHOWN}}}", key, re.ASCII) else shown(key)


def nearest(word: str, known: Iterable[str]) -> str:
    """Name the known word a mistyped one is nearest to, or all that are known.

    >>> nearest("radios", ["mass", "radius"]), nearest("x", ["mass", "radius"])
    ('did you mean radius?', 'known are mass, radius')
    """
    known = sorted(known)
    close = difflib.get_close_matches(word, known, n=1)
    return f"did you mean {close[0]}?" if close else f"known are {', '.join(known)}"


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


def mistake_of(error: "ValidationError", model: "type[BaseModel]") -> Mistake:
    """Make one mistake of all errors that pydantic found in a `model` that is no file's."""
    return Mistake("\n".join(f"{dotted(path)} {message}" for path, message in explain(error, model)))


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


def _keys_at(model: "type[BaseModel]", path: Path) -> dict[str, Any]:
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


def _without_waiting(path: str, flags: int) -> int:
    """Open a file to read; of a pipe that nobody writes to, there is nothing to read. Windows has no such files."""
    if sys.platform == "win32":
        return os.open(path, flags)
    descriptor = os.open(path, flags | os.O_NONBLOCK)
    os.set_blocking(descriptor, True)
    return descriptor


def read_text(file: pathlib.Path, most: int = MAX_BYTES) -> str:
    """Read a file that a person names, of so many bytes at most, with one message for all that can be wrong with it."""
    name = printable(str(file))
    try:
        with open(file, "rb", opener=_without_waiting) as opened:
            raw = opened.read(most + 1)
        if len(raw) > most:
            raise Mistake(f"{name}: is larger than {most:,} bytes")
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise Mistake(f"{name}:{line}: is not UTF-8 text: byte {raw[error.start]:#04x}") from None
    except OSError as error:
        raise Mistake(f"{name}: cannot be read: {error.strerror}") from None


_STRING: Final = r"""(?:"(?:\\.|[^"\\\n])*"|'[^'\n]*')"""  # on one line

# What ends or nests a TOML statement: strings, comments and blank lines are passed over whole.
_TOKEN: Final = re.compile(
    r'"""(?:\\.|[^\\])*?(?:"{3,5}|\Z)|'
    r"'{3}.*?(?:'{3,5}|\Z)|"
    rf"{_STRING}|\#[^\n]*|[\[\]{{}}]|\n\s*|"
    rf"(?P<deep>(?:\.[ \t]*(?:[\w-]+|{_STRING})[ \t]*){{{MAX_DEPTH}}})",
    re.DOTALL,
)
_PLAIN: Final = re.compile(r"\s*([\w-]+)[ \t]*=[ \t]*[^{\s]", re.ASCII)  # an assignment of no table to a bare key


def too_deep(text: str) -> int | None:
    """Return the line on which a TOML document nests too deeply to be read, None where it does not.

    Each part of a dotted key takes a parser time and memory as the length of the whole key.
    """
    for token, depth, line in _tokens(text):
        if depth > MAX_DEPTH or token["deep"]:
            return line
    return None


def _tokens(text: str) -> Iterator[tuple[re.Match[str], int, int]]:
    """Find what ends or nests a statement, each with the depth and the number of the line after it."""
    depth, line = 0, 1
    for token in _TOKEN.finditer(text):
        depth += (token[0] in "[{") - (token[0] in "]}")
        line += token[0].count("\n")
        yield token, depth, line


def _statements(text: str) -> Iterator[tuple[int, str]]:
    """Split valid TOML into its headers and assignments, each with the number of its line."""
    start, first_line = 0, 1
    for token, depth, line in _tokens(text + "\n"):
        if token[0][0] == "\n" and depth == 0:
            yield first_line, text[start : token.start()]
            start, first_line = token.end(), line


def lines_of_keys(text: str) -> dict[Path, int]:
    r"""Map each key and table that a valid TOML document writes to its line (from 1).

    >>> lines_of_keys('rate = 60\n[[balls]]\nradius = 5\n[[balls]]\nx.to = 1')[("balls", 1, "x", "to")]
    5
    """
    lines: dict[Path, int] = {}
    lengths: dict[Path, int] = {}  # of the arrays of tables so far
    table: Path = ()
    for line, statement in _statements(text):
        plain = _PLAIN.match(statement)
        parsed = {plain[1]: None} if plain else tomllib.loads(statement)
        header = statement.lstrip().startswith("[")
        path = () if header else table
        while isinstance(parsed, dict) and parsed and len(path) <= 2 * MAX_DEPTH:
            key, parsed = next(iter(parsed.items()))
            path = (*path, key)
            if header and isinstance(parsed, list):
                parsed = parsed[0]
                lengths[path] = lengths.get(path, 0) + 1
            if path in lengths:
                path = (*path, lengths[path] - 1)
            lines.setdefault(path, line)
        if header:
            table = path
    return lines


def line_of(path: Path, lines: Mapping[Path, int]) -> int | None:
    """Return the line of a key, or of the first of its tables, or of the nearest table round it."""
    while path and path not in lines and (*path, 0) not in lines:
        path = path[:-1]
    return lines.get(path, lines.get((*path, 0)))
