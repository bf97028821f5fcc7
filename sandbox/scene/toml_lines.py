"""The line of each key in a TOML document."""

import re
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Final

from sandbox.errors import KeyPath, dotted
from sandbox.text import printable

# Brackets and line ends, which nest and end a statement; strings and comments, to be skipped whole.
_TOKEN: Final = re.compile(
    r'"""(?:\\.|[^\\])*?(?:"{3,5}|\Z)|'
    r"'{3}.*?(?:'{3,5}|\Z)|"
    r""""(?:\\.|[^"\\\n])*"|'[^'\n]*'|\#[^\n]*|[\[\]{}]|\n\s*""",
    re.DOTALL,
)
_PLAIN: Final = re.compile(r"\s*([\w-]+)[ \t]*=[ \t]*[^{\s]", re.ASCII)  # a bare key, assigned anything but a table


def _statements(text: str) -> Iterator[tuple[int, str]]:
    """Split valid TOML into its headers and assignments, each with its line number."""
    start, depth, line, first_line = 0, 0, 1, 1
    for token in _TOKEN.finditer(text + "\n"):
        depth += (token[0] in "[{") - (token[0] in "]}")
        line += token[0].count("\n")
        if token[0][0] == "\n" and depth == 0:
            yield first_line, text[start : token.start()]
            start, first_line = token.end(), line


def _keys(text: str) -> Iterator[tuple[KeyPath, int]]:
    """Yield each key and table with its line; of an inline table, only the first key."""
    lengths: dict[KeyPath, int] = {}  # of each array of tables so far
    table: KeyPath = ()
    for line, statement in _statements(text):
        plain = _PLAIN.match(statement)
        parsed = {plain[1]: None} if plain else tomllib.loads(statement)
        header = statement.lstrip().startswith("[")
        path = () if header else table
        while isinstance(parsed, dict) and parsed:
            key, parsed = next(iter(parsed.items()))
            path = (*path, key)
            if header and isinstance(parsed, list):
                parsed = parsed[0]
                lengths[path] = lengths.get(path, 0) + 1
            if path in lengths:
                path = (*path, lengths[path] - 1)
            yield path, line
        if header:
            table = path


def lines_of_keys(text: str) -> dict[KeyPath, int]:
    r"""Return the line, from 1, of each key and table in a valid TOML document.

    >>> lines_of_keys('rate = 60\n[[balls]]\nradius = 5\n[[balls]]\nx.to = 1')[("balls", 1, "x", "to")]
    5
    """
    return dict(reversed([*_keys(text)]))


def last_key(text: str) -> tuple[KeyPath, int, int]:
    """Return the last key of a document, its line, and the line where it is first given."""
    keys = [*_keys(text)]
    path, line = keys[-1]
    return path, line, dict(reversed(keys))[path]


def line_of(path: KeyPath, lines: Mapping[KeyPath, int]) -> int | None:
    """Return the line of a key, or else of the first of its tables, or of the innermost table around it."""
    while path and path not in lines and (*path, 0) not in lines:
        path = path[:-1]
    return lines.get(path, lines.get((*path, 0)))


@dataclass(frozen=True)
class Source:
    """A TOML file: its path, and its text. All are equal: where a scene was read from is no part of the scene."""

    file: str = field(default="scene", compare=False)
    text: str = field(default="", compare=False)

    @cached_property
    def _lines(self) -> Mapping[KeyPath, int]:
        return lines_of_keys(self.text)

    def at_key(self, path: KeyPath, message: str) -> str:
        """Return a message about a key: `file:line: key message`, without the line if it is unknown."""
        line, name = line_of(path, self._lines) if path else None, printable(self.file)
        place = f"{name}:{line}" if line else name
        return f"{place}: {dotted(path)} {message}" if path else f"{place}: {message}"
