"""The Python surface: its names, its types, and what importing it costs."""

import pydoc
import subprocess
import sys
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

import pytest
from conftest import LIBRARIES_REQUIRED
from test_example_notebook import CODE

import sandbox

VERBS = ("compare", "from_space", "lint", "load", "simulate", "sweep", "verify", "watch", "write")
CLASSES = (
    "Comparison",
    "Contacts",
    "Engine",
    "Finding",
    "Refused",
    "SandboxError",
    "Scene",
    "Scores",
    "SpaceWarning",
    "State",
    "SweepTable",
    "Traits",
    "Trajectory",
)
HEAVY = ("numpy", "numba", "pydantic", "pymunk", "pygame", "bokeh", "rich", "typer")


def test_the_surface_is_what_dir_lists() -> None:
    assert sandbox.__all__ == dir(sandbox) == sorted((*VERBS, *CLASSES, "__version__"))
    assert all(getattr(sandbox, name) is not None for name in sandbox.__all__)
    assert sandbox.__version__ == version("pymunk-sandbox")
    assert issubclass(sandbox.SandboxError, ValueError)
    assert issubclass(sandbox.Refused, sandbox.SandboxError)
    with pytest.raises(AttributeError, match=r"^module 'sandbox' has no attribute 'laod'$"):
        sandbox.laod  # type: ignore[attr-defined]  # noqa: B018


def test_help_lists_the_verbs_and_the_classes() -> None:
    text = pydoc.plain(pydoc.render_doc(sandbox))
    functions = text[text.index("\nFUNCTIONS\n") : text.index("\nDATA\n")]
    for verb in VERBS:
        assert f"\n    {verb}(" in functions
        assert f"    {verb} " in text[: text.index("\nPACKAGE CONTENTS\n")]
    for name in CLASSES:
        assert f"\n    class {name}(" in text or f"\n    {name} = " in text


def test_importing_the_sandbox_imports_no_library() -> None:
    program = f"import sys, sandbox; print(*(set({HEAVY}) & set(sys.modules)))"
    assert subprocess.check_output([sys.executable, "-c", program], text=True) == "\n"


USER = """
import sandbox
from sandbox import Comparison, Contacts, Engine, Refused, SandboxError, Scene, Scores, State, SweepTable, Trajectory


class Mine:
    def __init__(self, scene: Scene, initial: State) -> None:
        self.initial = initial

    def step(self) -> None: ...

    def state(self) -> State:
        return self.initial


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
    return float(both["exact"].energy[0] + table.column("gap_rms").max())


def drop(height: float) -> Scene:
    return Scene(
        arena={"size": (400, 300), "elasticity": 0.9},
        balls=[{"radius": 20, "position": (200, height)}, {"radius": 10, "grid": (4, 2), "spacing": 25}],
        walls=[{"from": (20, 150), "to": (300, 260)}],
        gravity=(0, 900),
        pymunk={"substeps": 4},
    )


def impulses(engine: Engine) -> Contacts:
    engine.step()
    return engine.contacts()


def reason(error: Refused) -> str:
    return str(error)
"""
WRONG = (
    ("sandbox.laod('article')", 'Module has no attribute "laod"'),
    ("sandbox.load(3)", 'Argument 1 to "load" has incompatible type "int"'),
    ("sandbox.simulate(sandbox.load('article'))", 'No overload variant of "simulate" matches argument type "Scene"'),
    ("sandbox.compare(sandbox.load('article')).gap", '"Comparison" has no attribute "gap"'),
    ("sandbox.Scene(arena=3, balls=[])", 'Argument "arena" to "Scene" has incompatible type "int"'),
    ("sandbox.Scene(arena={}, balls=[], sped=3)", 'Unexpected keyword argument "sped" for "Scene"'),
)


def test_a_user_s_mypy_sees_types(tmp_path: Path) -> None:
    """One run of mypy for all: without a cache it takes half a minute."""
    if find_spec("mypy") is None:
        (pytest.fail if LIBRARIES_REQUIRED else pytest.skip)("needs mypy")
    (tmp_path / "right.py").write_text(USER)
    (tmp_path / "notebook.py").write_text("\n".join(CODE))
    wrong = "\n".join(["import sandbox", *(line for line, _ in WRONG)])
    (tmp_path / "wrong.py").write_text(f"{wrong}\n")
    cache = Path(__file__).parents[1] / ".pytest_cache" / "mypy"
    command = [sys.executable, "-m", "mypy", f"--cache-dir={cache}", "--strict", "--no-pretty", "."]
    out = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False).stdout.splitlines()
    errors = [line for line in out if ": error: " in line]
    assert len(errors) == len(WRONG), out
    for number, (error, (_, message)) in enumerate(zip(errors, WRONG, strict=True), 2):
        assert error.startswith(f"wrong.py:{number}: error: ")
        assert message in error
