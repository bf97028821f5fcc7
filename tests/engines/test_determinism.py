"""The same scene gives the same bytes: in every process, after whatever ran before, in the window and without it."""

import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from conftest import bundled_scenes, without_fma
from numba import njit

from sandbox.engines import can_run, create, registry
from sandbox.engines.article import POW_PROBES, SQUARE, pow_variant
from sandbox.engines.engine import advance
from sandbox.engines.machine_code import compile_engines
from sandbox.errors import Refused
from sandbox.report.trajectory import simulate
from sandbox.scene.files import bundled, load
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.state import Floats, States
from sandbox.view import Layer
from sandbox.view.window import Window

SCENES = (*bundled(), *bundled("truths"))
SHORT = 90  # steps
DEAREST = "truths/pyramid-falls"
OWN = ("article", "impulse", "exact")
HERE = Path(__file__).parent
IMPORT = f"import json, sys; sys.path[:0] = {[str(HERE), str(HERE.parent)]}; import test_determinism as t"
GOLDEN = json.loads(Path(__file__).with_name("golden.json").read_text())


def digest(position: Floats, velocity: Floats) -> str:
    return hashlib.sha256(position.tobytes() + velocity.tobytes()).hexdigest()[:16]


def end_with_contacts(scene: Scene, engine: str, steps: int) -> str:
    run = simulate(scene, engine, steps=steps)
    return digest(run.position[-1], run.velocity[-1])


def end_without_contacts(scene: Scene, engine: str, steps: int) -> str:
    """Run an engine that nobody asks for contacts; box2d needs two thirds of its time to compute them."""
    states = States.empty(steps, len(scene.bodies))
    advance(create(engine, scene, spawn(scene)), states)
    return digest(states.position[-1], states.velocity[-1])


def start_and_ends(
    scene: Scene, engines: Iterable[str], steps: int, end: Callable[[Scene, str, int], str] = end_with_contacts
) -> dict[str, str]:
    """Hash a scene's initial state, and the end of each engine that can run it."""
    initial = spawn(scene)
    found = {"start": digest(initial.position, initial.velocity)}
    for engine in engines:
        with suppress(Refused):
            found[engine] = end(scene, engine, steps)
    return found


def all_ends(names: Iterable[str], engines: Iterable[str]) -> dict[str, dict[str, str]]:
    return {name: start_and_ends(load(name), list(engines), SHORT, end_without_contacts) for name in names}


@pytest.fixture(scope="module")
def here() -> dict[str, dict[str, str]]:
    return {name: start_and_ends(load(name), registry(), SHORT) for name in SCENES}


@pytest.mark.wide
def test_other_processes_give_the_same_bytes(here: dict[str, dict[str, str]]) -> None:
    """This one has another hash seed, runs the scenes and the engines in reverse order, and reads no contacts."""
    program = f"{IMPORT}; print(json.dumps(t.all_ends(t.SCENES[::-1], [*t.registry()][::-1])))"
    seed = "0" if os.environ.get("PYTHONHASHSEED") != "0" else "1"
    other = subprocess.run(
        [sys.executable, "-c", program], env=os.environ | {"PYTHONHASHSEED": seed}, stdout=subprocess.PIPE, check=True
    )
    assert json.loads(other.stdout) == here


@pytest.mark.wide
def test_only_the_article_depends_on_the_variant_of_the_c_library_s_pow(here: dict[str, dict[str, str]]) -> None:
    """Without FMA, glibc has another pow, and other sines, cosines and logarithms, which differ in the last bit."""
    program = f"{IMPORT}; print(json.dumps([t.pow_variant(), t.squares(), t.all_ends(t.SCENES, t.registry())]))"
    other = subprocess.run([sys.executable, "-c", program], env=without_fma(), stdout=subprocess.PIPE, check=True)
    variant, squared, ends = json.loads(other.stdout)
    assert (variant, pow_variant()) == ("no fma", "fma")
    assert [one != two for one, two in zip(squared, squares(), strict=True)] == [True] * len(squared)
    differ = {name: {key for key in here[name] if here[name][key] != ends[name][key]} for name in SCENES}
    assert differ["gas-1000"] == {"article"}
    assert set().union(*differ.values()) == {"article"}


def squares() -> list[float]:
    """Square the numbers that distinguish the variants of pow, compiled and in Python."""
    power = njit(lambda number, exponent: number**exponent)
    probes = [probe for some in POW_PROBES.values() for probe in some]
    compiled = [power(probe, SQUARE) for probe in probes]
    assert compiled == [probe**SQUARE for probe in probes]
    return compiled


@pytest.mark.parametrize(
    "name",
    [
        *(pytest.param(name, marks=pytest.mark.wide if name == DEAREST else ()) for name in bundled("truths")),
        *bundled_scenes(),
    ],
)
def test_the_results_of_our_own_engines_have_not_changed(name: str) -> None:
    """A changed hash means that users' runs change: if that is intended, the changelog must say so.

    The article's hashes are those of glibc's pow on processors with FMA. The funnel and the pile have none of exact:
    LAPACK solves their heaps, with other rounding on each kind of processor.
    """
    compile_engines(OWN)
    scene, golden = load(name), GOLDEN[name]
    own = [engine for engine in OWN if engine in golden and (engine != "article" or pow_variant() == "fma")]
    assert start_and_ends(scene, own, scene.steps) == {key: golden[key] for key in ("start", *own)}


@pytest.mark.wide
@pytest.mark.parametrize("name", bundled())
def test_a_window_shows_the_same_bytes_as_a_run_without_one(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    scene = load(name)
    engines = [engine for engine in registry() if can_run(engine, scene)]
    window = Window(scene, engines)
    window.showing |= {Layer.GHOSTS, Layer.TRAILS}
    for _ in range(10):
        window.playback.step()
        window.draw()
    for engine in engines:
        run, shown = simulate(scene, engine, steps=10), window.view.moment.states[engine]
        assert np.array_equal(shown.position, run.position[-1])
        assert np.array_equal(shown.velocity, run.velocity[-1])
