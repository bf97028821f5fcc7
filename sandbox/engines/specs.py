"""Engine specs: how an engine is named in text, with settings or in a file.

pymunk                              an engine
pymunk(substeps=4, iterations=30)   Pymunk with other settings than the scene's
mine.py:Mine                        a class or a function in a file
"""

import hashlib
import json
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any, Final, cast

from sandbox.errors import EngineError, SandboxError, suggestion, traceback_beyond
from sandbox.files import read_text
from sandbox.text import printable

TUNED: Final = "pymunk"  # the engine that a scene has settings for
EXAMPLE: Final = f"{TUNED}(substeps=4, iterations=30)"  # of an engine with settings, in messages
_IN_FILE: Final = re.compile(r"(.+\.py):(.*)", re.DOTALL)
_FIRST_FOLDER: Final = len(sys.path)  # place of the folder of the latest file: installed packages come first
_COMMA: Final = re.compile(r",(?![^\[]*\])")  # not within a list

Value = float | Sequence[float]


def file_and_name(spec: str) -> tuple[Path, str] | None:
    """Return the file of an engine and its name in there, None if a spec does not name a file.

    >>> file, name = file_and_name("my loops/mine.py:step")
    >>> file.name, name, file_and_name("pymunk")
    ('mine.py', 'step', None)
    """
    match = _IN_FILE.fullmatch(spec)
    return (Path(match[1]), match[2]) if match else None


def split_values(text: str) -> list[str]:
    """Split text at its commas, but not within lists: "60,[0, 900]" has two parts."""
    return [part.strip() for part in _COMMA.split(text)]


def parse_value(text: str) -> Value:
    """Parse a number, or a list of numbers such as [0, 900]. Raises ValueError."""
    if text.startswith("["):
        return [_number(str(part)) for part in json.loads(text)]
    return _number(text)


def _number(text: str) -> float:
    value = float(text)
    return int(value) if value.is_integer() else value


def settings_in(spec: str) -> tuple[str, dict[str, float]]:
    """Return an engine's name without its settings, and these. Raises SandboxError if they cannot be read.

    >>> settings_in("pymunk(substeps=4, collision_bias=0.5)")
    ('pymunk', {'substeps': 4, 'collision_bias': 0.5})
    """
    base, bracket, rest = spec.partition("(")
    if not bracket or file_and_name(spec):
        return spec, {}
    if (base := base.rstrip()) != TUNED or not rest.endswith(")"):
        wrong = "lacks a closing bracket" if base == TUNED else f"only {TUNED} takes settings"
        raise SandboxError(f"{spec}: {wrong}, as in {EXAMPLE}")
    settings = parse_settings(spec, rest[:-1])
    for key, value in settings.items():
        if not isinstance(value, int | float):
            raise SandboxError(f"{spec}: {key} must be a number, as in {EXAMPLE}")
    return base, cast("dict[str, float]", settings)


def parse_settings(spec: str, text: str) -> dict[str, Value]:
    """Parse "substeps=4, iterations=30", a part of a spec. Raises SandboxError."""
    values: dict[str, Value] = {}
    for pair in split_values(text):
        key, _, value = (part.strip() for part in pair.partition("="))
        if key in values:
            raise SandboxError(f"{spec}: has {key} twice")
        try:
            values[key] = parse_value(value)
        except (ValueError, TypeError):
            raise SandboxError(f"{spec}: {pair!r} must be a setting and its number, as in {EXAMPLE}") from None
    return values


def format_settings(settings: Mapping[str, Value]) -> str:
    """Return settings as `parse_settings` reads them."""
    return ", ".join(f"{key}={value}" for key, value in settings.items())


def with_settings(name: str, settings: Mapping[str, float]) -> str:
    """Return the spec of an engine with settings.

    >>> with_settings("pymunk", {"substeps": 4, "collision_bias": 0.5})
    'pymunk(substeps=4, collision_bias=0.5)'
    """
    return f"{name}({format_settings(settings)})" if settings else name


def load_from_file(spec: str) -> Callable[..., Any]:
    """Return the class or function of a spec such as "mine.py:Mine".

    The file runs once, and once more if it has changed. Raises SandboxError if it cannot be read or has no such class
    or function, EngineError if it raises an exception.
    """
    named = file_and_name(spec)
    assert named
    file, name = named
    try:
        module = _module(file.resolve(), read_text(file))
    except (Exception, SystemExit) as error:
        if isinstance(error, SandboxError):
            raise
        what = f"cannot be loaded: {type(error).__name__}: {error}"
        raise EngineError(spec, what, details=traceback_beyond(error, __file__)) from error
    if not callable(engine := getattr(module, name, None)):
        known = [key for key, value in vars(module).items() if getattr(value, "__module__", "") == module.__name__]
        has = suggestion(name, known) if known else "it has no class and no function"
        raise SandboxError(f"{printable(str(file))}: has no class or function {name!r}; {has}")
    return engine


@cache
def _module(file: Path, text: str) -> ModuleType:
    """Run a file, and return it as a module; text: its content."""
    name = f"{file.stem}_{hashlib.sha256(str(file).encode()).hexdigest()[:8]}"  # no other module's
    spec = spec_from_file_location(name, file)
    assert spec
    module = module_from_spec(spec)
    sys.modules[name] = module  # where dataclasses look for it
    sys.path.insert(_FIRST_FOLDER, str(file.parent))  # so that it can import others beside it
    exec(compile(text, file, "exec"), vars(module))
    return module
