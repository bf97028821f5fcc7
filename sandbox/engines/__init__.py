"""The engines: the registry that finds engines by name, and builds them.

An engine is a class built from a scene and its initial state. Another package adds one with an entry point in the
group `sandbox.engines`:

    [project.entry-points."sandbox.engines"]
    mine = "my_package:MyEngine"

`sandbox.engines.specs` describes how else an engine is named. From Python, a class or a function is one too.

This module can be called: `sandbox.engines()` is `sandbox.engines.support.engines()`.
"""

import sys
import traceback
from collections.abc import Callable, Iterable, Mapping
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec
from types import ModuleType
from typing import Any, Final, cast

from sandbox.engines.engine import RunningEngine
from sandbox.engines.specs import TUNED, file_and_name, load_from_file, settings_in
from sandbox.errors import EngineError, MissingLibrary, Refused, SandboxError, shown, suggestion
from sandbox.scene.model import Scene
from sandbox.state import State
from sandbox.text import printable

ENTRY_POINTS: Final = "sandbox.engines"
_BUILT_IN: Final = {
    name: EntryPoint(name, f"sandbox.engines.{name}:{engine}", ENTRY_POINTS)
    for name, engine in (
        ("pymunk", "PymunkEngine"),
        ("article", "ArticleEngine"),
        ("impulse", "ImpulseEngine"),
        ("exact", "ExactEngine"),
    )
}
BUILT_IN: Final = tuple(_BUILT_IN)
_EXTRAS: Final = {"box2d": "pyb2d3"}  # engine, which is an extra of the same name -> the library that it needs
REFERENCE: Final = "exact"  # what engines are measured against by default; it can take steps of different lengths
TEXTBOOK_ENGINES: Final = ("article", "impulse")  # the first that can run the scene is compared with Pymunk by default

Source = str | Callable[..., Any]
"""The source of an engine: a spec, a class or function of (scene, initial), or a function of one step."""
Engines = Source | Iterable[Source] | Mapping[str, Source]
"""One engine or several. In a mapping each has a name of its own; else a spec is its own name."""

KINDS: Final = "engines must be names, classes or functions"  # in messages


def named(engines: Engines) -> dict[str, Source]:
    """Return what each of some engines is built from, by its name.

    Raises SandboxError for an empty collection, and for an invalid name.

    >>> named(["exact", "pymunk(substeps=4)"])
    {'exact': 'exact', 'pymunk(substeps=4)': 'pymunk(substeps=4)'}
    """
    if isinstance(engines, str) or callable(engines):
        engines = [engines]
    if not isinstance(engines, Iterable):
        raise SandboxError(f"{KINDS}, got {shown(engines)}")
    by_name = dict(engines) if isinstance(engines, Mapping) else _by_name(engines)
    if not by_name:
        raise SandboxError(f"engines must contain at least one, got {shown(engines)}")
    for name, source in by_name.items():
        if not isinstance(name, str) or not name or printable(name) != name:
            raise SandboxError(f"an engine must have a printable name, got {shown(name)}")
        if not isinstance(source, str) and not callable(source):
            raise SandboxError(f"{name}: must be the name of an engine, a class or a function, got {shown(source)}")
        if settings_in(name)[0] in (*_BUILT_IN, *_EXTRAS) and source != name:
            raise SandboxError(f"{name}: is the name of a built-in engine; choose another one")
    return by_name


def _by_name(sources: Iterable[Source]) -> dict[str, Source]:
    """Return engines by the names that they have themselves. Raises SandboxError if two have the same."""
    by_name: dict[str, Source] = {}
    for source in sources:
        if not isinstance(source, str) and not callable(source):
            raise SandboxError(f"{KINDS}, got {shown(source)}")
        if by_name.setdefault(name := _name_of(source), source) != source:
            raise SandboxError(f"{name}: is the name of two engines; name them in a mapping")
    return by_name


def _name_of(source: Source) -> str:
    return source if isinstance(source, str) else getattr(source, "__name__", type(source).__name__)


def registry() -> dict[str, EntryPoint]:
    """Return every engine whose library is installed: the built-in ones, then those from entry points by name.

    Raises SandboxError if one of these has the name of a built-in engine.
    """
    installed = {entry.name: entry for entry in entry_points(group=ENTRY_POINTS) if not _lacks_library(entry.name)}
    for name in sorted(installed.keys() & _BUILT_IN.keys()):
        raise SandboxError(f"{installed[name].value}: is installed under the name of a built-in engine, {name}")
    return _BUILT_IN | {name: installed[name] for name in sorted(installed)}


def known() -> list[str]:
    """Return the names of all engines: the registry's, and those whose library is not installed."""
    return list(dict.fromkeys([*registry(), *_EXTRAS]))


def _lacks_library(engine: str) -> bool:
    return engine in _EXTRAS and find_spec(_EXTRAS[engine]) is None


def resolved(spec: str, scene: Scene) -> tuple[str, Scene]:
    """Return an engine's name without its settings, and the scene with them. Raises SandboxError if one is wrong."""
    base, settings = settings_in(spec)
    if not settings:
        return base, scene
    known = type(scene.pymunk).model_fields
    for key in settings:
        if key not in known:
            raise SandboxError(f"{spec}: {key} is not a setting of {TUNED}; {suggestion(key, known)}")
    try:
        return base, scene.changed(pymunk=scene.pymunk.model_dump(exclude_unset=True) | settings)
    except SandboxError as error:
        raise SandboxError(f"{spec}: {error}") from error


def check_name(spec: str) -> None:
    """Raise SandboxError if there is no engine of this name, or its library is not installed."""
    base, _ = settings_in(spec)
    if base in _BUILT_IN:
        return
    if file_and_name(base):
        load_from_file(base)
        return
    if _lacks_library(base):
        raise MissingLibrary(base, _EXTRAS[base])
    if base.endswith(".py"):
        raise SandboxError(f"{base}: must name a class or a function in the file, as in {base}:Mine")
    if base not in (engines := registry()):
        raise SandboxError(f"no engine {base!r}; {suggestion(base, engines)}")


def _load(name: str) -> Callable[..., Any]:
    """Return the class or function of a name without settings. Raises SandboxError if no engine has that name."""
    check_name(name)
    if file_and_name(name):
        return load_from_file(name)
    engines = _BUILT_IN if name in _BUILT_IN else registry()  # registry() takes 6 ms, and edits rebuild every engine
    try:
        return cast("Callable[..., Any]", engines[name].load())
    except Exception as error:
        if name in _BUILT_IN:
            raise
        what = f"{engines[name].value} cannot be loaded: {type(error).__name__}: {error}"
        raise EngineError(name, what, details=traceback.format_exc()) from error


def create(source: Source, scene: Scene, initial: State, name: str | None = None) -> RunningEngine:
    """Build an engine. name: of one that is not built in, in messages; by default that of the source.

    Raises SandboxError if a spec is unknown or invalid, Refused if the engine cannot run the scene. An engine that is
    not built in raises EngineError where it breaks the contract, now or later.
    """
    name = name or _name_of(source)
    if isinstance(source, str):
        base, scene = resolved(source, scene)
        if base in _BUILT_IN:
            return cast("RunningEngine", _load(base)(scene, initial))
        source = _load(base)
    from sandbox.engines.checked import build  # noqa: PLC0415 (only engines that are not built in need it)

    return build(name, source, scene, initial)


def can_run(name: str, *scenes: Scene) -> bool:
    """Return whether the named engine can run all scenes: by its `check` or, without one, by building it."""
    return all(refusal(name, scene, builds=True) is None for scene in scenes)


def refusal(name: str, scene: Scene, *, builds: bool = False) -> str | None:
    """Return why the named engine's `check` refuses a scene, None if it accepts the scene.

    builds: whether to build an engine that has no `check`, which may refuse the scene too.
    """
    base, _ = settings_in(name)
    engine: Any = _load(base)
    try:
        if hasattr(engine, "check"):
            engine.check(scene)
        elif builds:
            from sandbox.scene.spawn import spawn  # noqa: PLC0415 (it takes longer than `check`)

            create(name, scene, spawn(scene))
    except Refused as refused:
        return str(refused)
    return None


def default_engines(*scenes: Scene) -> list[str]:
    """Return the engines to run by default: Pymunk, and the first textbook engine that can run all scenes."""
    return ["pymunk", *[name for name in TEXTBOOK_ENGINES if can_run(name, *scenes)][:1]]


class _Callable(ModuleType):
    """This module: importing it hides a function of its name in the package, which it therefore is itself."""

    def __call__(self) -> dict[str, Any]:
        supported: dict[str, Any] = import_module(f"{__name__}.support").engines()  # which imports this module
        return supported


sys.modules[__name__].__class__ = _Callable
