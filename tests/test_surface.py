"""The Python surface: its names, its types, and what importing it costs."""

import pydoc
import re
import shutil
import subprocess
import sys
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

import pytest
from conftest import LIBRARIES_REQUIRED
from test_docs import files

import sandbox
from sandbox.engines import create
from sandbox.scene.spawn import spawn

VERBS = (
    *("advise", "compare", "converge", "dump", "engines", "from_space", "lint", "load", "load_space"),
    *("save_space", "scenes", "simulate", "sweep", "to_space", "verify", "watch"),
)
CLASSES = (
    "Advice",
    "Comparison",
    "Contacts",
    "Convergence",
    "Engine",
    "Finding",
    "Refused",
    "SandboxError",
    "Scene",
    "Scores",
    "Simulation",
    "SpaceWarning",
    "State",
    "SweepTable",
    "Traits",
    "Trajectory",
)
DOCS = Path(__file__).parents[1] / "docs"
EXAMPLES, PAGE = DOCS / "examples", DOCS / "python.md"


def test_the_surface_is_what_dir_lists() -> None:
    assert sorted(sandbox.__all__) == dir(sandbox) == sorted((*VERBS, *CLASSES, "__version__"))
    assert all(getattr(sandbox, name) is not None for name in sandbox.__all__)
    assert sandbox.__version__ == version("pymunk-sandbox")
    assert "gravity" in sandbox.engines()["pymunk"].accepts  # a module that can be called
    assert issubclass(sandbox.SandboxError, ValueError)
    assert issubclass(sandbox.Refused, sandbox.SandboxError)
    with pytest.raises(AttributeError, match=r"^module 'sandbox' has no attribute 'laod'$"):
        sandbox.laod  # type: ignore[attr-defined]  # noqa: B018


def test_help_lists_the_verbs_and_the_classes() -> None:
    text = pydoc.plain(pydoc.render_doc(sandbox))
    functions = text[text.index("\nFUNCTIONS\n") : text.index("\nDATA\n")]
    for verb in VERBS:
        # One is not shown as such: engines is a module that can be called.
        assert f"\n    {verb}" in functions or verb == "engines"
    for name in CLASSES:
        assert f"\n    class {name}(" in text or f"\n    {name} = " in text


def test_an_engine_is_shown_on_one_short_line() -> None:
    scene = sandbox.load("article")
    for name, kind in (("pymunk", "PymunkEngine"), ("impulse", "ImpulseEngine"), ("exact", "ExactEngine")):
        assert repr(create(name, scene, spawn(scene))) == f"<{kind}: 3 balls at 0 s>"


USER = """
import warnings

import numpy as np
import pymunk

import sandbox
from sandbox import Advice, Comparison, Contacts, Engine, Refused, SandboxError, Scene, Scores, Simulation, State
from sandbox import SweepTable, Trajectory


class Mine:
    def __init__(self, scene: Scene, initial: State) -> None:
        self.initial = initial

    def step(self) -> None: ...

    def state(self) -> State:
        return self.initial


def built(scene: Scene, initial: State) -> Engine:
    return Mine(scene, initial)


def energy_left(name: str) -> float | None:
    try:
        scene: Scene = sandbox.load(name).changed(seed=3)
    except SandboxError as error:
        message: str = str(error)
        raise SystemExit(message) from None
    trajectory: Trajectory = sandbox.simulate(scene, "pymunk", seconds=1)
    comparison: Comparison = sandbox.compare(scene, ["pymunk", "article"])
    print(trajectory.position.shape, sandbox.__version__.split("."))
    print(comparison.verdict, comparison.table().splitlines(), comparison.runs["article"].energy.mean())
    comparison.save("figures.json")
    return comparison["article"].energy_ratio


def many() -> float:
    both: dict[str, Trajectory] = sandbox.simulate("article", ["pymunk", "exact"], seed=3, steps=10)
    scores: Scores = sandbox.verify(["oblique", sandbox.load("oblique")], "exact")
    table: SweepTable = sandbox.sweep("article", seeds=range(4), rates=[60, 240], settings={"substeps": [1, 4]})
    print(scores["oblique"]["exact"].lines, [row["engine"] for row in table])
    return float(both["exact"].energy[0] + max(row["gap_rms"] for row in table))


def drop(height: float) -> Scene:
    return Scene(
        arena={"size": (400, 300), "elasticity": 0.9},
        balls=[{"radius": 20, "position": (200, height)}, {"radius": 10, "grid": (4, 2), "spacing": 25}],
        walls=[{"from": (20, 150), "to": (300, 260)}],
        gravity=(0, 900),
        pymunk={"substeps": 4},
    )


def play(scene: Scene) -> Trajectory:
    simulation = Simulation(scene, "pymunk", seed=3)

    simulation.grab(0, simulation.state.position[0])
    simulation.move((100, 100))
    simulation.step()
    simulation.release()
    hits: Contacts = simulation.contacts
    for ball in hits["first"]:
        simulation.kick(ball, np.array([0, -20]))
    print(len(hits), simulation.scene.colors, [given.do for given in simulation.inputs])
    space = sandbox.to_space(scene)
    with sandbox.watch(space):
        space.step(1 / 60)
    sandbox.dump(scene, "mine.toml")
    sandbox.simulate(scene, "exact").save("run.npz")
    return sandbox.simulate(scene, "exact")


def advice() -> list[str]:
    comparison = sandbox.compare("oblique")
    ledger = comparison["pymunk"].ledger
    tables = [comparison.rows()]
    found: Advice = sandbox.advise("oblique", seconds=1)
    orders: sandbox.Convergence = sandbox.converge("oblique", "impulse", rates=(60, 120, 240), starts=2)
    print(orders.fit("impulse"))
    print(found.recommendation, found.best.gap_rms, [trial.changes for trial in found], len(tables))
    accepting = [name for name, support in sandbox.engines().items() if "gravity" in support.accepts]
    return [*accepting, *(scene.title for scene in sandbox.scenes().values()), *comparison.keys()]


def space_of(scene: Scene) -> list[sandbox.Finding]:
    space = sandbox.to_space(scene)
    print(sandbox.from_space(space, size=(400, 300)).gravity)
    return sandbox.lint(space)


class Soft(Mine):
    traits = sandbox.Traits(soft=True)


def kept(space: pymunk.Space) -> None:
    warnings.simplefilter("ignore", sandbox.SpaceWarning)
    sandbox.dump(sandbox.from_space(space), "level.toml")
    sandbox.save_space(sandbox.load_space("level.space"), "level.space")


def after_a_step(engine: Engine) -> State:
    engine.step()
    return engine.state()


def reason(error: Refused) -> str:
    return str(error)
"""
WRONG = (
    ("sandbox.laod('article')", 'Module has no attribute "laod"'),
    ("sandbox.load(3)", 'Argument 1 to "load" has incompatible type "int"'),
    ("sandbox.simulate(sandbox.load('article'))", 'No overload variant of "simulate" matches argument type "Scene"'),
    ("sandbox.compare(sandbox.load('article')).gap", '"Comparison" has no attribute "gap"'),
    ("sandbox.Simulation('article')", 'Missing positional argument "engine" in call to "Simulation"'),
    ("sandbox.engines()['exact'].gravity", '"Support" has no attribute "gravity"'),
)


def test_the_program_of_a_user_has_every_name() -> None:
    assert set(re.findall(r"\w+", USER)) >= set(sandbox.__all__)


@pytest.fixture
def programs(tmp_path: Path) -> Path:
    """Return a folder with programs of users: wrong.py has an error on each line after the first, the others none."""
    (tmp_path / "right.py").write_text(USER)
    shutil.copytree(EXAMPLES, tmp_path / "examples")
    (tmp_path / "game.py").write_text(files(PAGE)["game.py"])
    wrong = "\n".join(["import sandbox", *(line for line, _ in WRONG)])
    (tmp_path / "wrong.py").write_text(f"{wrong}\n")
    return tmp_path


@pytest.mark.wide
def test_a_user_s_mypy_sees_types(programs: Path) -> None:
    """One run of mypy for all: without a cache it takes half a minute."""
    cache = Path(__file__).parents[1] / ".pytest_cache" / "mypy"
    if find_spec("mypy") is None:
        (pytest.fail if LIBRARIES_REQUIRED else pytest.skip)("needs mypy")
    command = [sys.executable, "-m", "mypy", f"--cache-dir={cache}", "--strict", "--no-pretty", "."]
    out = subprocess.run(command, cwd=programs, capture_output=True, text=True, check=False).stdout.splitlines()
    errors = [line for line in out if " error: " in line]
    assert len(errors) == len(WRONG), errors
    for number, (error, (_, message)) in enumerate(zip(errors, WRONG, strict=True), 2):
        assert error.startswith(f"wrong.py:{number}: error: ")
        assert message in error
