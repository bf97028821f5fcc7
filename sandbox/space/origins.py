"""The lines of a program that added the bodies, shapes and joints of its Spaces."""

import os
import sys
from pathlib import Path
from types import FrameType
from typing import Any, Final
from weakref import WeakKeyDictionary

import pymunk

_SANDBOX: Final = str(Path(__file__).parents[1])
_PYMUNK: Final = str(Path(pymunk.__file__).parent)
_EXAMPLES: Final = str(Path(_PYMUNK) / "examples")
_STANDARD: Final = str(Path(os.__file__).parent)  # Python's library, which may hold that of packages


class Origins:
    """Remembers which line of the program added an object to a Space."""

    def __init__(self) -> None:
        self._lines: WeakKeyDictionary[Any, str] = WeakKeyDictionary()

    def remember(self, objects: tuple[Any, ...]) -> None:
        """Remember the line of the program that is being run as that of some objects, unless they have one."""
        line = ""
        for each in objects:
            if each not in self._lines:
                line = line or program_line()
                self._lines[each] = line

    def line_of(self, thing: Any) -> str:
        """Return the line that added an object, as file:line; empty if unknown."""
        return self._lines.get(thing, "")


def program_line() -> str:
    """Return the innermost line of the program, as file:line, outside Pymunk, the sandbox and Python's library."""
    frame: FrameType | None = sys._getframe(1)
    while frame and not _is_program(frame.f_code.co_filename):
        frame = frame.f_back
    return f"{_short(frame.f_code.co_filename)}:{frame.f_lineno}" if frame else ""


def _is_program(file: str) -> bool:
    if file.startswith(_EXAMPLES):
        return True
    standard = file.startswith(_STANDARD) and "site-packages" not in file
    return not standard and not file.startswith((_SANDBOX, _PYMUNK, "<frozen"))


def _short(file: str) -> str:
    """Return the path of a file from the working directory if it is below, otherwise its name."""
    path, here = Path(file).absolute(), Path.cwd()
    return str(path.relative_to(here)) if path.is_relative_to(here) else path.name
