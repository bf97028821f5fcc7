"""The plugin of pytest: it costs nothing until a test asks, and a limit exceeded comes with causes and figures."""

import os
import shutil
import subprocess
import sys
import tomllib
from importlib.metadata import entry_points
from pathlib import Path

import pytest

import sandbox
from sandbox.scripting.pytest_plugin import SandboxCompare
from sandbox.state import Floats

HEAVY = ("numpy", "numba", "pydantic", "pymunk", "pygame", "bokeh", "rich", "typer")
PACKAGE = Path(__file__).parents[2] / "docs" / "examples" / "engine_package"


def collides_without_restitution(position: Floats, velocity: Floats, dt: float, scene: sandbox.Scene) -> None:
    position += velocity * dt
    way = position[1] - position[0]
    distance = (way @ way) ** 0.5
    approach = (velocity[0] - velocity[1]) @ way / distance
    if distance < scene.bodies.radius.sum() and approach > 0:
        velocity[0] -= approach / 2 * way / distance
        velocity[1] += approach / 2 * way / distance


def test_it_is_registered_and_imports_no_library() -> None:
    [entry] = (each for each in entry_points(group="pytest11") if each.name == "sandbox")
    program = f"import sys, {entry.value}; print(*(set({HEAVY}) & set(sys.modules)))"
    assert subprocess.check_output([sys.executable, "-c", program], text=True) == "\n"


def test_within_its_limits_it_returns_the_comparison(sandbox_compare: SandboxCompare) -> None:
    comparison = sandbox_compare("oblique", "pymunk", seconds=2, max_gap=20, max_energy_error=1e-9)
    assert list(comparison) == ["pymunk", "exact"]
    assert comparison.scene.seconds == 2


def test_beyond_a_limit_the_message_has_cause_and_figures() -> None:
    with pytest.raises(pytest.fail.Exception) as failed:
        SandboxCompare()("oblique", {"mine": collides_without_restitution, "pymunk": "pymunk"}, max_energy_error=1e-6)
    first, empty, *rest = str(failed.value).splitlines()
    assert first.startswith("mine: energy error 0.")
    assert "exceeds the limit of 1e-06, first at 0.8" in first
    assert empty == ""
    text = " ".join(" ".join(rest).split())
    assert "mine 23.5 % of the energy is missing. 1 contact: " in text
    assert "energy change" in text


def test_an_engine_that_fails_shows_its_traceback() -> None:
    def breaks(position: Floats, velocity: Floats, dt: float, scene: sandbox.Scene) -> None:
        raise IndexError("no such ball")

    with pytest.raises(pytest.fail.Exception, match=r"(?s)^mine: raised IndexError: no such ball\n.*in breaks"):
        SandboxCompare()("oblique", {"mine": breaks})


def test_the_reference_is_not_held_to_the_limits() -> None:
    SandboxCompare()("oblique", "exact", against="pymunk", max_drift=1e-9)  # pymunk's own gap is 0
    with pytest.raises(pytest.fail.Exception, match=r"^exact: gap "):
        SandboxCompare()("oblique", "exact", against="pymunk", max_gap=1)


@pytest.mark.wide
def test_the_package_of_the_documents_is_found_and_passes_its_tests(tmp_path: Path) -> None:
    for file in PACKAGE.glob("*.*"):
        shutil.copy(file, tmp_path)
    project = tomllib.loads((tmp_path / "pyproject.toml").read_text())["project"]
    installed = tmp_path / f"{project['name']}-{project['version']}.dist-info"
    installed.mkdir()  # as if it were installed
    (installed / "METADATA").write_text(f"Name: {project['name']}\nVersion: {project['version']}\n")
    [(group, engines)] = project["entry-points"].items()
    points = "".join(f"{name} = {place}\n" for name, place in engines.items())
    (installed / "entry_points.txt").write_text(f"[{group}]\n{points}")
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-W", "error", str(tmp_path)]
    environment = os.environ | {"PYTHONPATH": str(tmp_path)}
    run = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
    assert "4 passed" in run.stdout
