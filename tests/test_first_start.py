"""The first start, when nothing is compiled yet: few balls move at once, and other processes compile."""

import hashlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from sandbox.cli.progress import _TerminalCompiler
from sandbox.compiled import NotCompiledYet, between_frames, entry
from sandbox.engines import can_run
from sandbox.jit import _Cache
from sandbox.run.trajectory import simulate
from sandbox.scene.files import load
from sandbox.scene.spawn import spawn, warnings
from sandbox.view.compilation import Compilation, Target
from sandbox.view.compiling import WindowCompiler

FEW_BALLS = ("article", "bouncing", "break-shot", "head-on", "newtons-cradle", "oblique")


class NeverWaits:
    """A compiler that fails if anything is waited for."""

    shows_frames = True

    def __init__(self) -> None:
        self.missing: set[str] = set()

    def note_missing(self, module: str) -> None:
        self.missing.add(module)

    def wait(self, module: str) -> None:
        raise AssertionError(module)


def small_runs() -> dict[str, str]:
    """Hash what small calls of kernels compute: initial states, their warnings, and runs step by step."""
    found = {}
    for name in (*FEW_BALLS, "gas-100"):
        scene = load(name)
        initial = spawn(scene)
        found[f"{name}: spawn"] = _hash(initial.position, initial.velocity, list(warnings(scene, initial)))
    for name in FEW_BALLS:
        scene = load(name)
        for engine in ("article", "impulse"):
            if can_run(engine, scene):
                trajectory = simulate(scene, engine, steps=60)
                found[f"{name}: {engine}"] = _hash(trajectory.position, trajectory.velocity)
    return found


def _hash(*values: Any) -> str:
    return hashlib.sha256(b"".join(getattr(value, "tobytes", repr(value).encode)() for value in values)).hexdigest()


def run_python(code: str, **environment: str) -> str:
    tests = str(Path(__file__).parent)
    paths = os.pathsep.join([tests, *sys.path])
    command = [sys.executable, "-c", code]
    settings = {**os.environ, "PYTHONPATH": paths, **environment}
    return subprocess.run(command, env=settings, capture_output=True, check=True, text=True).stdout


def note_loaded() -> set[tuple[str, str, str]]:
    """Return a set to which every kernel that is loaded from now on is added: its module, name and signature."""
    loaded, load_overload = set[tuple[str, str, str]](), _Cache.load_overload

    def note(cache: Any, signature: object, context: object) -> object:
        loaded.add((cache._py_func.__module__, cache._py_func.__name__, str(signature)))
        return load_overload(cache, signature, context)

    _Cache.load_overload = note  # type: ignore[assignment, method-assign]
    return loaded


@pytest.mark.wide
def test_small_calls_run_in_python_to_the_same_bits_when_nothing_is_compiled(tmp_path: Path) -> None:
    code = """
import json
from sandbox.compiled import compile_by
from test_first_start import NeverWaits, small_runs
compiler = NeverWaits()
compile_by(compiler)
runs = small_runs()
print(json.dumps([runs, sorted(compiler.missing)]))
"""
    runs, missing = json.loads(run_python(code, NUMBA_CACHE_DIR=str(tmp_path)))
    assert runs == small_runs()
    engines = ["sandbox.engines.article", "sandbox.engines.impulse"]
    assert missing == [*engines, "sandbox.quantity", "sandbox.scene.packing"]
    assert not list(tmp_path.rglob("*.nb*"))  # nothing was compiled


def test_a_short_trace_ends_without_compiling(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "sandbox", "trace", "article", "--engine", "article", "--seconds", "0.5"]
    cold = subprocess.run(
        command, env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}, capture_output=True, check=True
    )
    assert cold.stdout == subprocess.run(command, capture_output=True, check=True).stdout
    assert cold.stderr == b""
    assert not list(tmp_path.rglob("*.nb*"))


@pytest.mark.wide
def test_the_parts_call_every_kernel_that_the_bundled_scenes_need() -> None:
    code = """
import json
from sandbox.analysis.comparison import compare
from sandbox.engines import can_run
from sandbox.jit import _Cache
from sandbox.scene.files import bundled, load
from sandbox.scene.spawn import spawn, warnings
from sandbox.view.compilation import COMPUTATION, DRAWING
from test_first_start import note_loaded

loaded = note_loaded()
for part in (*COMPUTATION, DRAWING):
    before = set(loaded)
    part.compile()
    own = {module for module, *_ in loaded - before if module.startswith(part.modules)}
    assert own, part.title
by_parts = set(loaded)
for name in (*bundled(), *bundled("truths")):
    scene = load(name).changed(seconds=0.2, expect=())
    list(warnings(scene, spawn(scene)))
    names = ["pymunk", "article", "impulse", "exact"]
    compare(scene, [name for name in names if can_run(name, scene)])
compare(load("gas-100").changed(seconds=0.5), [silent_engine])
print(json.dumps(sorted(loaded - by_parts)))
"""
    silent_engine = f"{Path(__file__).parent / 'tutorials' / 'textbook.py'}:step"
    assert json.loads(run_python(f"{silent_engine = }\n{code}")) == []


def parts(*acts: Any) -> tuple[Target, ...]:
    return tuple(Target(f"part {number}", (f"module{number}.",), act) for number, act in enumerate(acts))


@pytest.fixture
def compilations() -> Iterator[list[Compilation]]:
    """Collect compilations, to be stopped at the end."""
    made: list[Compilation] = []
    yield made
    for each in made:
        each.stop()


@pytest.mark.wide
def test_the_part_that_is_waited_for_comes_first(compilations: list[Compilation], tmp_path: Path) -> None:
    files = [tmp_path / str(number) for number in range(3)]
    compilation = Compilation(parts(*(partial(file.touch) for file in files)), at_once=1)
    compilations.append(compilation)
    shown = [str(progress) for progress in compilation.until_compiled("module2.kernels")]
    assert shown
    assert set(shown) == {"Compiling part 2 (once): 1 of 3"}
    assert [file.exists() for file in files[::-1]] == [True, False, False]
    assert (compilation.done, compilation.total) == (1, 3)
    list(compilation.until_compiled("module1.kernels"))
    while compilation.is_running:
        time.sleep(0.01)
        compilation.poll()
    assert all(file.exists() for file in files)
    assert compilation.done == 3


@pytest.mark.parametrize("compiler", [WindowCompiler((640, 480)), _TerminalCompiler()])
def test_only_a_window_does_without_kernels(
    compiler: WindowCompiler | _TerminalCompiler, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Pictures of a recording do not depend on what is compiled."""
    waited: list[str] = []

    @entry
    def one() -> int:
        return 1

    monkeypatch.setattr("sandbox.jit._Cache._load", lambda *_: None)
    monkeypatch.setattr(compiler, "note_missing", lambda module: None)
    monkeypatch.setattr(compiler, "wait", waited.append)
    monkeypatch.setattr("sandbox.compiled._compiler", compiler)
    with pytest.raises(NotCompiledYet) if compiler.shows_frames else nullcontext(), between_frames():
        assert one() == 1
    assert waited == ([] if compiler.shows_frames else [__name__])
