"""A user's mistakes: one message each, with what is wrong, where, and what would be right."""

import difflib
import itertools
import json
import os
import re
import signal
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Final

from sandbox.text import printable

KeyPath = tuple[str | int, ...]  # of keys into a document: ("balls", 2, "radius")

MAX_BYTES: Final = 2_000_000  # of a file that a person writes: room for 20,000 balls one by one
MAX_REPORTED: Final = 100  # mistakes of one file
MOST_SHOWN: Final = 40  # characters of what a file says
MOST_BITS: Final = 14_000  # of a whole number shown in decimals: Python writes no more than 4,300 digits


class SandboxError(ValueError):
    """Something the user can put right; its text is the whole message, one line a mistake, and printable."""

    def __init__(self, text: str) -> None:
        super().__init__("\n".join(map(printable, text.split("\n"))))


def first_errors(found: Iterable[str], file: object) -> SandboxError:
    """Make one mistake of all that were found in a file, a line each; of the first, where they are very many."""
    told = list(itertools.islice(found, MAX_REPORTED + 1))
    if len(told) > MAX_REPORTED:
        told[MAX_REPORTED:] = [f"{file}: has more mistakes than these {MAX_REPORTED}"]
    return SandboxError("\n".join(told))


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


def dotted(path: KeyPath) -> str:
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


def _without_waiting(path: str, flags: int) -> int:
    """Open a file to read; of a pipe that nobody writes to, there is nothing to read. Windows has no such files."""
    if sys.platform == "win32":
        return os.open(path, flags)
    descriptor = os.open(path, flags | os.O_NONBLOCK)
    os.set_blocking(descriptor, True)
    return descriptor


def read_text(file: Path, most: int = MAX_BYTES) -> str:
    """Read a file that a person names, of so many bytes at most, with one message for all that can be wrong with it."""
    name = printable(str(file))
    try:
        with open(file, "rb", opener=_without_waiting) as opened:
            raw = opened.read(most + 1)
        if len(raw) > most:
            raise SandboxError(f"{name}: is larger than {most:,} bytes")
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise SandboxError(f"{name}:{line}: is not UTF-8 text: byte {raw[error.start]:#04x}") from None
    except OSError as error:
        raise SandboxError(f"{name}: cannot be read: {error.strerror}") from None


NOBODY_READS: Final = getattr(signal, "SIGPIPE", signal.SIGTERM)  # Windows has no SIGPIPE


class Ended(BaseException):
    """A signal ends the program; or nobody reads what it writes, as SIGPIPE has it."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


class Refused(SandboxError):
    """An engine cannot honour a scene; the text says why, and what can."""
