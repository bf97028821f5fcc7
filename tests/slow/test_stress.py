"""Every engine at its limits: nothing is NaN, and every ball outside the arena is reported.

`pytest -m slow -s tests/slow/test_stress.py` runs a gas for a million steps, and prints its energy and memory.
"""

import json
import math
import resource
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import scene_of, sizes

from sandbox.analysis.comparison import Comparison, compare
from sandbox.analysis.verdict import summaries
from sandbox.engines import create, refusal, registry
from sandbox.engines.machine_code import MachineCode
from sandbox.quantity import deepest_overlap, kinetic_energy
from sandbox.run.inputs import Grab, Input, Move, Release
from sandbox.run.lockstep import Lockstep
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn

ENGINES = tuple(registry())


def wedge(*balls: str, more: str) -> Scene:
    """Return a scene of two walls that meet at the bottom, and balls above them."""
    walls = "\n".join(f"[[walls]]\nfrom = [{x}, 100]\nto = [400, 580]" for x in (340, 460))
    return scene_of(*balls[:-1], f"{balls[-1]}\n{walls}", more=f"seconds = 3\n{more}")


def small_box(*balls: str, more: str = "") -> Scene:
    """Return a scene of balls in a small box."""
    return scene_of(*balls, size="[400, 400]", more=f"seconds = 1\n{more}")


SCENES = {
    "at rest in contact": small_box("radius = 20\ngrid = [4, 4]\nspacing = 40\nposition = [20, 20]"),
    "a heap": small_box(
        "radius = 20\nelasticity = 0.5\ngrid = [10, 2]\nspacing = 40\nposition = [20, 340]", more="gravity = [0, 900]"
    ),
    "radius 1e-3 beside 250": scene_of(
        "radius = 250\nposition = [300, 300]\nvelocity = [100, 37]",
        "radius = 1e-3\npositions = [[550.001, 300], [700, 500]]\nvelocities = [[-50, 20], [-200, 20]]",
        more="seconds = 2",
    ),
    "masses 1e-6 and 1e6": small_box(
        "radius = 30\nmass = 1e6\nposition = [150, 150]\nvelocity = [120, 70]",
        "count = 10\nradius = 10\nmass = 1e-6\nspeed = 300\ninside = [[200, 0], [400, 400]]",
        "count = 3\nradius = 10\nspeed = 300\ninside = [[0, 200], [200, 400]]",
    ),
    "1e6 px/s": scene_of(
        "count = 10\nradius = 20\nspeed = 1e6\ninside = [[0, 0], [500, 300]]", size="[500, 300]", more="seconds = 1"
    ),
    "a corner": small_box(
        "radius = 15\nposition = [16, 16]\nvelocity = [-30, -40]",
        "radius = 40\nmass = 1000\nposition = [120, 125]\nvelocity = [-300, -310]",
        "radius = 25\nmass = 30\nposition = [300, 330]\nvelocity = [-400, -420]",
    ),
    "a wedge": wedge(
        "radius = 12\nelasticity = 0.8\nposition = [400, 60]",
        "radius = 20\nmass = 5\nelasticity = 0.8\nposition = [396, 22]",
        more="gravity = [0, 900]",
    ),
    "on one spot": small_box(
        "radius = 20\npositions = [[200, 200], [200, 200], [200, 200], [100, 100], [100, 100]]\n"
        "velocities = [[0, 0], [0, 0], [0, 0], [50, 0], [-50, 30]]"
    ),
    "gravity 1e5": small_box(
        "radius = 20\nelasticity = 0.9\ncount = 10\nspeed = 200\ninside = [[0, 0], [400, 400]]",
        more="gravity = [3e4, 1e5]",
    ),
}
RUNS = [(stress, engine) for stress, scene in SCENES.items() for engine in ENGINES if refusal(engine, scene) is None]
MAX_OUTSIDE = {  # scene and engine -> the farthest a centre may be outside the arena, px; 0 for all others
    ("radius 1e-3 beside 250", "pymunk"): 2,
    ("1e6 px/s", "pymunk"): 20_000,
    ("1e6 px/s", "article"): 20,
    ("1e6 px/s", "impulse"): 20,
    ("1e6 px/s", "box2d"): 300,
    ("a corner", "pymunk"): 10,
    ("a corner", "impulse"): 10,
    ("gravity 1e5", "pymunk"): 200,
}


@cache
def compared(stress: str) -> Comparison:
    """Compare all engines that accept a scene."""
    return compare(SCENES[stress], [engine for name, engine in RUNS if name == stress])


def numbers(document: Any) -> Iterator[float]:
    """Yield all floats in a document."""
    if isinstance(document, dict | list | tuple):
        for one in document.values() if isinstance(document, dict) else document:
            yield from numbers(one)
    elif isinstance(document, float):
        yield document


@pytest.mark.wide
@pytest.mark.parametrize(("stress", "engine"), RUNS)
def test_nothing_is_nan(stress: str, engine: str) -> None:
    run = compared(stress).runs[engine]
    for values in (run.energy, run.momentum, run.gap_max, run.path, run.final.position, run.final.velocity):
        assert np.isfinite(values).all()
    for key in ("time", "normal", "impulse", "depth"):
        assert np.isfinite(run.contacts[key]).all()
    figures = compared(stress).as_json()["engines"][engine]
    assert np.isfinite(list(numbers(figures))).all()
    json.dumps(figures, allow_nan=False)
    change = run.energy[-1] - run.energy[0]
    lines = sum(entry.energy for entry in run.figures.ledger if entry.cause.key != "spin")
    assert lines == pytest.approx(change, abs=1e-9 * run.energy.max())


@pytest.mark.wide
@pytest.mark.parametrize(("stress", "engine"), RUNS)
def test_every_ball_outside_the_arena_is_reported(stress: str, engine: str) -> None:
    run = compared(stress).runs[engine]
    furthest = run.escape.furthest if run.escape else 0.0
    assert furthest <= MAX_OUTSIDE.get((stress, engine), 0.0)
    assert bool(run.escape) == bool(run.figures.escaped)
    said = summaries(compared(stress)).get(engine, ())
    assert any(" left the arena, first ball " in line for line in said) == bool(run.escape)


@pytest.mark.parametrize("steps", sizes(500, slow=10_000))
def test_a_ball_shaken_against_a_wall_stays_in_the_arena(steps: int) -> None:
    """Another ball lies at the wall, and one flies."""
    scene = scene_of(
        "radius = 20\npositions = [[200, 150], [60, 150], [300, 250]]\nvelocities = [[0, 0], [0, 0], [100, 50]]",
        size="[400, 300]",
    )
    moves = [
        Move(step=step, at=(-100 if step // 7 % 2 else 300, 150 + 40 * math.sin(step / 50))) for step in range(steps)
    ]
    inputs: list[Input] = [Grab(step=0, ball=0, at=(200, 150)), *moves, Release(step=steps)]
    lockstep = Lockstep(scene, ENGINES, inputs)
    deepest = dict.fromkeys(ENGINES, 0.0)
    for _ in range(steps):
        lockstep.step()
        for name, state in lockstep.states().items():
            assert np.isfinite(state.position).all()
            assert np.isfinite(state.velocity).all()
            outside = np.maximum(20 - state.position, state.position + 20 - scene.arena.size)
            deepest[name] = max(deepest[name], float(outside.max()))
    print("deepest in a wall, px:", deepest)
    allowed = {"pymunk": 26.0, "exact": 1e-9}  # Pymunk lets balls overlap between the mouse and the wall
    for name, depth in deepest.items():
        assert depth < allowed.get(name, 20.0)


@pytest.mark.parametrize("steps", sizes(2_000, slow=1_000_000))
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.wide if name in ("impulse", "article") else ()) for name in ENGINES]
)
def test_a_gas_stays_in_its_box_and_memory_does_not_grow(
    name: str, steps: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    if steps < 10_000:  # then all as Python: machine code that is loaded on the way takes memory, once
        monkeypatch.setattr(MachineCode, "is_due", lambda *_: False)
    scene = load("gas-100")
    bodies, size = scene.bodies, np.array(scene.arena.size)
    engine = create(name, scene, spawn(scene))
    engine.record_contacts()
    before = kinetic_energy(spawn(scene).velocity, bodies.mass)
    deepest, outside, contacts = 0.0, -np.inf, 0
    memory = []
    for step in range(steps):
        engine.step()
        if step % 20 == 0:
            state = engine.state()
            contacts += len(engine.contacts())
            assert np.isfinite(state.position).all()
            assert np.isfinite(state.velocity).all()
            outside = max(outside, float(np.maximum(-state.position, state.position - size).max()))
            deepest = max(deepest, deepest_overlap(state.position, bodies.radius)[0])
        if sys.platform == "linux" and step % (steps // 10) == 0:
            memory.append(resident())
    left = float(kinetic_energy(engine.state().velocity, bodies.mass) / before)
    print(f"{name}: {steps:,} steps, {contacts:,} contacts, {left:.6%} of the energy left, deepest {deepest:.3g} px")
    print("resident, MB:", *(f"{one / 1e6:.1f}" for one in memory))
    assert outside < 0
    assert deepest < 17.5
    assert max(memory[1:], default=0) - min(memory[1:], default=0) < 10e6


def resident() -> int:
    """Return the resident memory of the process, bytes."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()


@pytest.mark.parametrize("engine", ENGINES)
def test_balls_that_start_outside_the_arena_come_back(engine: str) -> None:
    """A scene saved during a run of Pymunk may have such balls."""
    scene = scene_of(
        "radius = 20\npositions = [[-10, 300], [430, -30], [200, 425]]\nvelocities = [[-50, 30], [90, -60], [70, 80]]",
        size="[400, 400]\noverlap = 60",
        more="seconds = 3",
    )
    run = compare(scene, [engine]).runs[engine]
    assert run.figures.energy_ratio == pytest.approx(1, rel=1e-5)
    assert run.figures.escaped == 3
    assert run.escape is not None
    assert (run.escape.time, run.escape.ball, run.escape.balls) == (0, 0, 3)
    assert ((run.final.position >= 0) & (run.final.position <= scene.arena.size)).all()
