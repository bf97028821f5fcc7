"""Errors that a user can correct, and the parts of their messages: what is wrong, where, and what would be right."""

import difflib
import itertools
import json
import re
import traceback
from collections.abc import Iterable
from typing import Final

from sandbox.text import printable

KeyPath = tuple[str | int, ...]  # keys into a document, such as ("balls", 2, "radius")

MAX_REPORTED_ERRORS: Final = 100  # of one file
MAX_VALUE_LENGTH: Final = 40  # characters of a value in a message


class SandboxError(ValueError):
    """An error that a user can correct. Its text is the whole message: printable, one line for each error."""

    def __init__(self, text: str) -> None:
        super().__init__("\n".join(map(printable, text.split("\n"))))


class Refused(SandboxError):
    """An engine cannot run a scene; the text says why, and which engine can."""


class MissingLibrary(SandboxError):
    """An optional library is not installed. what: needs it; library: its name, for pip too."""

    def __init__(self, what: str, library: str) -> None:
        super().__init__(f"{what}: needs {library}, which is not installed; pip install {library}")


class EngineError(SandboxError):
    """An engine that is not built in fails: it breaks the contract of docs/engines.md, or raises an exception.

    engine: its name; time: s, when it failed; details: the engine's own traceback, empty if the message says all.
    """

    def __init__(self, engine: str, what: str, time: float = 0.0, details: str = "") -> None:
        super().__init__(f"{engine}: {what}")
        self.engine, self.time = engine, time
        self.details = "".join(f"{printable(line)}\n" for line in details.splitlines())


class LimitReached(SandboxError):
    """An engine ends early, since it would exceed a limit; up to there it is right.

    engine: its name; time: s since the start of the run, the end of the last step within the limit; why: which limit.
    """

    def __init__(self, engine: str, time: float, why: str) -> None:
        super().__init__(f"{engine} ends at {time:.4g} s: {why}")
        self.engine, self.time, self.why = engine, time, why


class SpaceWarning(UserWarning):
    """A scene, or a recording, of a `pymunk.Space` leaves something out or differs from it."""


def traceback_beyond(error: BaseException, file: str) -> str:
    """Return the traceback of an error, starting at the first frame outside a file.

    An error without such a frame, such as a syntax error in what they read, has only its message.
    """
    rest = error.__traceback__
    while rest and rest.tb_frame.f_code.co_filename == file:
        rest = rest.tb_next
    return "".join(traceback.format_exception(type(error), error, rest))


def first_errors(messages: Iterable[str], file: str) -> SandboxError:
    """Return one error for all that were found in a file, a line each, up to MAX_REPORTED_ERRORS lines."""
    lines = list(itertools.islice(messages, MAX_REPORTED_ERRORS + 1))
    if len(lines) > MAX_REPORTED_ERRORS:
        lines[MAX_REPORTED_ERRORS:] = [f"{file}: has more than these {MAX_REPORTED_ERRORS} errors"]
    return SandboxError("\n".join(lines))


def shown(value: object) -> str:
    """Format a value for a message much as TOML would: short, on one line, printable.

    >>> shown([1.5, True]), shown(float("nan")), shown(16**5000)
    ('[1.5, true]', 'nan', '0x10000000000000000000000000000000000...')
    """
    try:
        text = json.dumps(value, default=str)
        if not isinstance(value, str):
            text = text.replace("NaN", "nan").replace("Infinity", "inf")
    except (TypeError, ValueError, RecursionError):  # keys that are not text; an integer of too many digits; too deep
        text = hex(value) if isinstance(value, int) else object.__repr__(value)
    return text if len(text) <= MAX_VALUE_LENGTH else f"{text[: MAX_VALUE_LENGTH - 3]}..."


def dotted(path: KeyPath) -> str:
    """Format a path of keys for a message.

    >>> dotted(("balls", 2, "radius"))
    'balls[2].radius'
    """
    bare = re.compile(rf"[\w-]{{1,{MAX_VALUE_LENGTH}}}", re.ASCII)
    keys = (f"[{key}]" if isinstance(key, int) else f".{key if bare.fullmatch(key) else shown(key)}" for key in path)
    return "".join(keys).lstrip(".")


def suggestion(word: str, known: Iterable[str]) -> str:
    """Return a hint for a mistyped word: the known word that is most similar, or all known words.

    >>> suggestion("radios", ["mass", "radius"]), suggestion("x", ["mass", "radius"])
    ('did you mean radius?', 'known are mass, radius')
    """
    known = sorted(known)
    close = difflib.get_close_matches(word, known, n=1)
    return f"did you mean {close[0]}?" if close else f"known are {', '.join(known)}"
