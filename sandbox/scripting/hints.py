"""What to do about an exception of a program: what Pymunk changed, and a display that is missing."""

import re
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

from sandbox.space.changes import CALLS, NAMES


def hint(error: BaseException) -> str:
    """Return what to do about an exception of a program; empty if it is not one that the sandbox knows."""
    return _of_pymunk(error) or _display(error)


def _of_pymunk(error: BaseException) -> str:
    for name in _missing_names(error):
        if change := NAMES.get(name):
            return f"Pymunk has had no {name} since version {change.since}. Instead: {change.plain}."
    text = f"{_file(error)}: {error}"
    for call, change in CALLS.items():
        if re.search(change.pattern, text):
            return f"An error since version {change.since} of Pymunk: {call}. Instead: {change.plain}."
    return ""


def _missing_names(error: BaseException) -> Iterator[str]:
    """Yield what a program missed in Pymunk: a name of a module, or of each class that an object is of."""
    if isinstance(error, ImportError) and error.name:
        missing = re.match(r"cannot import name '(\w+)'", error.msg)
        yield f"{error.name}.{missing[1]}" if missing else error.name
    elif isinstance(error, AttributeError) and isinstance(error.obj, ModuleType):
        yield f"{error.obj.__name__}.{error.name}"
    elif isinstance(error, AttributeError):
        kind = error.obj if isinstance(error.obj, type) else type(error.obj)
        yield from (f"{base.__name__}.{error.name}" for base in kind.__mro__ if base.__module__.startswith("pymunk."))


def _file(error: BaseException) -> str:
    """Return the folder and the file that raised an exception, or nothing if it was not raised."""
    last = error.__traceback__
    while last and last.tb_next:
        last = last.tb_next
    return "/".join(Path(last.tb_frame.f_code.co_filename).parts[-2:]) if last else ""


def _display(error: BaseException) -> str:
    kind = type(error)
    without_video = kind.__module__.startswith("pygame") and re.search("video|(x11|wayland) not available", str(error))
    if without_video or kind.__name__ in ("NoSuchDisplayException", "NoSuchConfigException"):
        return "There is no display: sandbox watch --headless runs the program without a window."
    return ""
