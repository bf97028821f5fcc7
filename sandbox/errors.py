"""Errors that a user can put right: one message each, with what is wrong, where, and what would be right."""

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

KeyPath = tuple[str | int, ...]  # keys into a document, such as ("balls", 2, "radius")

MAX_TEXT_FILE_BYTES: Final = 2_000_000  # room for 20,000 balls, each in a group of its own
MAX_REPORTED: Final = 100  # errors of one file
MAX_VALUE_LENGTH: Final = 40  # characters of a value in a message
MAX_DECIMAL_BITS: Final = 14_000  # larger integers are shown in hexadecimal: Python limits decimals to 4,300 digits


class SandboxError(ValueError):
    """An error that the user can put right. Its text is the whole message: printable, one line for each error."""

    def __init__(self, text: str) -> None:
        super().__init__("\n".join(map(printable, text.split("\n"))))


def first_errors(found: Iterable[str], file: object) -> SandboxError:
    """Return one exception for all errors found in a file, a line each, up to MAX_REPORTED lines."""
    lines = list(itertools.islice(found, MAX_REPORTED + 1))
    if len(lines) > MAX_REPORTED:
        lines[MAX_REPORTED:] = [f"{file}: has more than these {MAX_REPORTED} errors"]
    return SandboxError("\n".join(lines))


def shown(value: object) -> str:
    """Format a value for a message much as TOML would: short, on one line, printable.

    >>> shown([1.5, True]), shown(float("nan")), shown({"a": 16**5000})
    ('[1.5, true]', 'nan', '{"a": 0x1000000000000000000000000000...')
    """
    text = ""
    for piece in _pieces(value):
        text += piece
        if len(text) > MAX_VALUE_LENGTH:
            return text[: MAX_VALUE_LENGTH - 3] + "..."
    return text


def _pieces(value: object) -> Iterator[str]:
    """Yield the text of a value in pieces, so that a long value is not formatted beyond what is shown."""
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
        yield hex(value) if isinstance(value, int) and value.bit_length() > MAX_DECIMAL_BITS else str(value)
    else:
        yield json.dumps(value, default=str)


def dotted(path: KeyPath) -> str:
    """Format a path of keys for a message.

    >>> dotted(("balls", 2, "radius"))
    'balls[2].radius'
    """
    return "".join(f"[{key}]" if isinstance(key, int) else f".{_bare_or_quoted(key)}" for key in path).lstrip(".")


def _bare_or_quoted(key: str) -> str:
    return key if re.fullmatch(rf"[\w-]{{1,{MAX_VALUE_LENGTH}}}", key, re.ASCII) else shown(key)


def nearest(word: str, known: Iterable[str]) -> str:
    """Suggest the known word nearest to a mistyped one, or list all known words.

    >>> nearest("radios", ["mass", "radius"]), nearest("x", ["mass", "radius"])
    ('did you mean radius?', 'known are mass, radius')
    """
    known = sorted(known)
    close = difflib.get_close_matches(word, known, n=1)
    return f"did you mean {close[0]}?" if close else f"known are {', '.join(known)}"


def _open_without_blocking(path: str, flags: int) -> int:
    """Open a file for reading; a named pipe without a writer reads as empty. Windows has no named pipes in folders."""
    if sys.platform == "win32":
        return os.open(path, flags)
    descriptor = os.open(path, flags | os.O_NONBLOCK)
    os.set_blocking(descriptor, True)
    return descriptor


def read_text(file: Path, max_bytes: int = MAX_TEXT_FILE_BYTES) -> str:
    """Read a UTF-8 file that the user named. Raises SandboxError if it is unreadable, too large or not UTF-8."""
    name = printable(str(file))
    try:
        with open(file, "rb", opener=_open_without_blocking) as opened:
            raw = opened.read(max_bytes + 1)
        if len(raw) > max_bytes:
            raise SandboxError(f"{name}: is larger than {max_bytes:,} bytes")
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise SandboxError(f"{name}:{line}: is not UTF-8 text: byte {raw[error.start]:#04x}") from None
    except OSError as error:
        raise SandboxError(f"{name}: cannot be read: {error.strerror}") from None


CLOSED_PIPE: Final = getattr(signal, "SIGPIPE", signal.SIGTERM)  # Windows has no SIGPIPE


class Terminated(BaseException):
    """A signal ends the program. A write to a closed pipe counts as SIGPIPE, which Python itself ignores."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


class Refused(SandboxError):
    """An engine cannot run a scene; the text says why, and which engine can."""
