"""Kernels give the same bits as Python and as machine code, and only much work is compiled."""

import os
import random
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from unittest.mock import Mock

import pytest
from conftest import bundled_scenes, sample, sizes
from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox import compiled
from sandbox.compiled import Function
from sandbox.engines import can_run, create
from sandbox.engines.checked import build
from sandbox.engines.engine import advance
from sandbox.engines.exact import engine as exact_engine
from sandbox.engines.machine_code import KERNEL_ENGINES, MachineCode, _all, compile_engines
from sandbox.report.trajectory import simulate
from sandbox.scene.files import bundled, load, parse
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.state import States


@contextmanager
def machine_code(engine: str, *, used: bool) -> Iterator[None]:
    """Let an engine run machine code, or only Python, in this block."""
    compile_engines([engine])
    code = _all[engine]
    before = code._many, code._loading
    code._many, code._loading = (0, 0) if used else (10**9, 10**18)
    try:
        yield
    finally:
        code._many, code._loading = before


def run_of(scene: Scene, engine: str, steps: int, *, machine: bool) -> list[bytes]:
    """Return the states after each step, and the contacts, in one form or the other."""
    with machine_code(engine, used=machine):
        runner, states = create(engine, scene, spawn(scene)), States.empty(steps, len(scene.bodies))
        runner.record_contacts()
        advance(runner, states)
        assert runner._runs_python != machine  # type: ignore[attr-defined]
        return [*(part.tobytes() for part in states), runner.contacts().tobytes()]


def random_scene(seed: int) -> Scene:
    """Return a scene of 2 to 40 balls, mostly with friction, spin, gravity, loss, walls and pegs."""
    rng = random.Random(seed)
    groups = []
    for _ in range(rng.randint(1, 3)):
        factors = f"elasticity = {rng.choice([1, 0.9, 0.5, 0])}\nfriction = {rng.choice([0, 0.3, 1])}"
        groups.append(
            f"[[balls]]\ncount = {rng.randint(2, 13)}\nradius = {rng.uniform(4, 12)}\nmass = {rng.uniform(0.1, 9)}\n"
            f"{factors}\nspin = {rng.choice([0, 5])}\nspeed = {rng.choice([0, 100, 900])}\n"
            "inside = [[0, 0], [300, 200]]\n"
        )
    walls = "".join(
        f"[[walls]]\nfrom = [{x}, {y}]\nto = [{x + rng.choice([0, 60])}, {y + rng.choice([0, 30])}]\nthickness = 6\n"
        for x, y in ((rng.uniform(20, 250), rng.uniform(120, 220)) for _ in range(rng.randint(0, 3)))
    )
    gravity = rng.choice(["[0, 0]", "[0, 900]", "[150, 600]"])
    arena = f"[arena]\nsize = [300, 250]\noverlap = 12\nelasticity = {rng.choice([1, 0.7])}\n"
    return parse(f"seed = {seed}\ngravity = {gravity}\n{arena}{''.join(groups)}{walls}", "random")


@pytest.mark.parametrize("cases", sizes(20, slow=200))
def test_random_scenes_have_the_same_bits_in_both_forms(cases: int) -> None:
    @settings(max_examples=cases)
    @given(st.integers(0, 2**32))
    def run(seed: int) -> None:
        scene = random_scene(seed)
        for engine in ("exact", "impulse"):
            python, machine = (run_of(scene, engine, 15, machine=used) for used in (False, True))
            assert python == machine, engine

    run()


@pytest.mark.parametrize("name", [*sample(bundled("truths"), 3), *bundled_scenes()])
def test_bundled_scenes_have_the_same_bits_in_both_forms(name: str) -> None:
    scene = load(name)
    for engine in filter(lambda engine: can_run(engine, scene), KERNEL_ENGINES):
        python, machine = (run_of(scene, engine, min(60, scene.steps), machine=used) for used in (False, True))
        assert python == machine, engine


def test_an_engine_changes_over_in_the_middle_of_a_run(monkeypatch: pytest.MonkeyPatch) -> None:
    compile_engines(KERNEL_ENGINES)
    for engine in KERNEL_ENGINES:
        scene = load("gas-100")
        expected = run_of(scene, engine, 30, machine=False)
        with machine_code(engine, used=False):
            runner, states = create(engine, scene, spawn(scene)), States.empty(30, 100)
            runner.record_contacts()
            advance(runner, states.rows(slice(10)))
            monkeypatch.setattr(_all[engine], "_loading", 0)
            advance(runner, states.rows(slice(10, None)))
            assert not runner._runs_python  # type: ignore[attr-defined]
            assert [*(part.tobytes() for part in states), runner.contacts().tobytes()] == expected


def test_an_engine_within_one_of_the_user_s_own_runs_machine_code() -> None:
    """Its scene has arrays that cannot be written to."""
    scene = load("gas-100")
    for engine in KERNEL_ENGINES:
        with machine_code(engine, used=True):
            mine = build("mine", partial(create, engine), scene, spawn(scene))
            mine.step()
            assert mine.state().position.tobytes() == simulate(scene, engine, steps=1).position[-1].tobytes()


def test_another_process_compiles_when_python_has_done_as_much_work(monkeypatch: pytest.MonkeyPatch) -> None:
    process = Mock()

    monkeypatch.setattr("sandbox.engines.machine_code.ChildProcess", process)
    monkeypatch.setattr("sandbox.engines.machine_code._all", {})
    code = MachineCode("nothing", compiling=100, loading=10, many=5)
    assert not code.is_due(balls=5)  # it is not in the cache
    assert not code.is_due(99)
    assert not process.called
    assert not code.is_due(1)
    process.assert_called_once()
    assert not code.is_due(100)
    process.assert_called_once()
    monkeypatch.setattr(code, "_is_cached", True)
    assert code.is_due()


def test_a_full_cache_has_all_kernels_that_an_engine_calls(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    called = set[str]()

    def compiled_and_noted(kernel: Function) -> Function:
        called.add(kernel.__name__)
        return compiled.compiled(kernel)

    monkeypatch.setattr(exact_engine, "compiled", compiled_and_noted)
    monkeypatch.setattr("sandbox.engines.machine_code.cache_folder", lambda: tmp_path)
    monkeypatch.setattr(_all["exact"], "_is_cached", False)
    compile_engines(["exact"])
    in_cache = called.copy()
    run_of(load("marble-run"), "exact", 100, machine=True)
    assert called == in_cache
    assert "simulate" in in_cache


def test_numba_still_knows_the_one_private_flag() -> None:
    assert compiled._options()["_nrt"] is False


@pytest.mark.parametrize("disabled", ["0", "1"])
def test_small_comparisons_neither_import_numba_nor_have_anything_compiled(disabled: str, tmp_path: Path) -> None:
    code = """
import sys
from sandbox.engines import create
from sandbox.scene.files import load
from sandbox.scene.spawn import spawn
for scene in (load("article"), load("newtons-cradle"), load("gas-100").changed(seconds=2)):
    for name in ("article", "impulse", "exact")[scene.gravity != (0, 0):]:
        engine = create(name, scene, spawn(scene))
        for _ in range(scene.steps):
            engine.step()
print("numba" in sys.modules)
"""
    environment = os.environ | {"NUMBA_DISABLE_JIT": disabled, "NUMBA_CACHE_DIR": str(tmp_path)}
    run = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "False"
