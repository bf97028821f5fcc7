"""The functions of `import sandbox`: what they accept, and that every wrong argument is refused in plain words."""

import csv
import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import Command, scene_of

import sandbox
from sandbox.analysis import comparison
from sandbox.run.inputs import INPUT_KINDS, Grab, Input, Release, Start, write_inputs

PACKAGE = Path(__file__).parents[2] / "docs" / "examples" / "engine_package"
FREE = "radius = 5\nposition = [400, 300]\nvelocity = [60, -30]"
DRAG: list[Input] = [Grab(step=2, ball=0, at=(100, 100)), Release(step=20)]


@pytest.fixture(scope="module")
def oblique() -> sandbox.Comparison:
    return sandbox.compare("oblique", ["pymunk", "exact"])


def test_a_scene_is_an_object_a_name_or_a_path(working_folder: Path) -> None:
    Path("mine.toml").write_text(sandbox.load("oblique").source)
    for scene in (sandbox.load("oblique"), "oblique", "mine.toml", Path("mine.toml")):
        assert sandbox.simulate(scene, "exact", steps=1).position.shape == (2, 2, 2)
        assert list(sandbox.compare(scene, "exact", seconds=0.1).runs) == ["exact"]


def test_one_engine_gives_a_trajectory_and_several_give_one_each() -> None:
    one = sandbox.simulate("oblique", "exact", steps=60)
    several = sandbox.simulate("oblique", ["pymunk", "exact"], steps=60)
    assert list(several) == ["pymunk", "exact"]
    assert several["exact"].position.tobytes() == one.position.tobytes()
    assert several["pymunk"].position.tobytes() != one.position.tobytes()


def test_seconds_seed_and_rate_are_those_of_the_scene_changed() -> None:
    changes: dict[str, Any] = {"seconds": 0.5, "seed": 7, "rate": 120}
    changed = sandbox.load("article").changed(**changes)
    assert sandbox.compare("article", "exact", **changes).scene == changed
    ran, expected = sandbox.simulate("article", "exact", **changes), sandbox.simulate(changed, "exact")
    assert ran.position.tobytes() == expected.position.tobytes()
    assert ran.time[-1] == 0.5


def test_numbers_of_numpy_are_numbers() -> None:
    numbers: dict[str, Any] = {"seed": np.int64(3), "rate": np.int32(30), "seconds": np.float64(0.5)}
    compared = sandbox.compare("article", "exact", **numbers)
    assert (compared.scene.seed, compared.scene.rate, len(compared.time)) == (3, 30, 16)
    table = sandbox.sweep("article", "exact", seeds=np.arange(2), seconds=0.1)
    assert [row["seed"] for row in table] == [0, 1]
    grab = {"do": "grab", "step": np.int64(3), "ball": np.int64(0), "at": np.array([100.0, 100.0])}
    assert len(sandbox.simulate("article", "exact", steps=5, inputs=[grab]).time) == 6


def test_inputs_are_objects_dictionaries_or_a_file(tmp_path: Path) -> None:
    file = tmp_path / "mouse.jsonl"
    write_inputs(DRAG, file)
    free = sandbox.simulate(scene_of(FREE), "exact", steps=30).position
    runs = [
        sandbox.simulate(scene_of(FREE), "exact", steps=30, inputs=inputs).position.tobytes()
        for inputs in (DRAG, [json.loads(line) for line in file.read_text().splitlines()], file, str(file))
    ]
    assert len(set(runs)) == 1
    assert runs[0] != free.tobytes()


def test_inputs_bring_their_seed_and_rate_unless_others_are_given() -> None:
    inputs = [Start(scene="article", seed=4, rate=90)]
    assert sandbox.compare("article", "exact", seconds=0.1, inputs=inputs).scene.seed == 4
    assert sandbox.compare("article", "exact", seconds=0.1, inputs=inputs, seed=5).scene.seed == 5
    assert len(sandbox.simulate("article", "exact", seconds=0.1, inputs=inputs).time) == 10


NAN = float("nan")
ANY: Any = sandbox  # so that mypy accepts wrong arguments
KINDS = ", ".join(INPUT_KINDS)
SCENE = "a scene must be the name of a bundled scene or a file, got"
NO_SCENE = "no scene 'articel': neither a file nor a bundled scene; did you mean article?"
SOURCES = "must be names, classes or functions, got"
SETTING = "must be a setting and its number, as in pymunk(substeps=4, iterations=30)"
WRONG: dict[str, Callable[[], object]] = {
    f"{SCENE} 3": lambda: ANY.compare(3),
    NO_SCENE: lambda: ANY.compare("articel"),
    f'{SCENE} ["article"]': lambda: ANY.load(["article"]),
    f"engines {SOURCES} 1": lambda: ANY.compare("oblique", [1, 2]),
    'width must be a whole number of at least 1, got "80"': lambda: ANY.verify("oblique", "exact").table("80"),
    "mine: runs of a sweep find engines by name; name its file, as in mine.py:Mine": lambda: ANY.sweep(
        "oblique", {"mine": dict}
    ),
    "no engine 'exakt'; did you mean exact?": lambda: ANY.simulate("oblique", "exakt"),
    "against must be text in quotes, got 3": lambda: ANY.compare("oblique", against=3),
    "seconds must be a finite number, got nan": lambda: ANY.compare("oblique", seconds=NAN),
    'seconds must be a number, got "2"': lambda: ANY.simulate("oblique", "exact", seconds="2"),
    "seconds must be a number, got 1000000000000000000000000000000000000...": lambda: ANY.simulate(
        "oblique", "exact", seconds=10**400
    ),
    "steps must be a whole number, got 2.5": lambda: ANY.simulate("oblique", "exact", steps=2.5),
    "seconds and steps exclude each other: a run ends after either": lambda: ANY.simulate(
        "oblique", "exact", seconds=1, steps=60
    ),
    "seed must be a whole number, got [1]": lambda: ANY.compare("oblique", seed=[1]),
    "inputs must be a list of inputs, or a file of them, got 3": lambda: ANY.compare("oblique", inputs=3),
    f'inputs[0]: must be an object with "do" as one of {KINDS}, got 3': lambda: ANY.compare("oblique", inputs=[3]),
    "inputs[0]: ball must be at most 1, got 9": lambda: ANY.compare(
        "oblique", inputs=[Grab(step=0, ball=9, at=(0, 0))]
    ),
    "scenes must contain at least one, got an empty list": lambda: ANY.verify([]),
    f"engines {SOURCES} 2": lambda: ANY.verify("oblique", [2]),
    "seeds must contain at least one, got an empty list": lambda: ANY.sweep("oblique", seeds=[]),
    f"engines {SOURCES} null": lambda: ANY.simulate("oblique", None),
    "seconds must be greater than 0, got -1": lambda: ANY.compare("oblique", seconds=-1),
    "seconds must be a number, got true": lambda: ANY.simulate("oblique", "exact", seconds=True),
    "steps must be at least 0, got -1": lambda: ANY.simulate("oblique", "exact", steps=-1),
    "seed must be at least 0, got -1": lambda: ANY.compare("oblique", seed=-1),
    "rate must be at least 1, got 0": lambda: ANY.simulate("oblique", "exact", rate=0),
    "inputs[1]: step must be at least 5, got 3": lambda: ANY.compare(
        "oblique", inputs=[Release(step=5), Release(step=3)]
    ),
    f"{SCENE} 4": lambda: ANY.verify(4),
    'seed must be a whole number, got "0:4"': lambda: ANY.sweep("oblique", seeds="0:4"),
    "settings must be a valid dictionary, got [1]": lambda: ANY.sweep("oblique", settings=[1]),
    f"substeps=four: 'substeps=four' {SETTING}": lambda: ANY.sweep("oblique", settings={"substeps": "four"}),
    "workers must be at least 1, got 0": lambda: ANY.sweep("oblique", workers=0),
}


@pytest.mark.parametrize(("message", "call"), WRONG.items(), ids=WRONG)
def test_a_wrong_argument_is_refused_in_plain_words(call: Callable[[], object], message: str) -> None:
    with pytest.raises(sandbox.SandboxError, match=f"^{re.escape(message)}$"):
        call()


def without_padding(printed: str) -> str:
    return "".join(f"{line.rstrip()}\n" for line in printed.splitlines())


def test_the_text_is_that_of_the_command(oblique: sandbox.Comparison, command: Command) -> None:
    _, out, _ = command("compare", "oblique", "--engines", "pymunk,exact")
    assert oblique.table() == without_padding(out)
    _, out, _ = command("compare", "oblique", "--engines", "pymunk,exact", "--all", "--first", "--contacts", "1")
    assert oblique.table(all_rows=True, first=True, contacts=1) == without_padding(out)
    name, _, words = oblique.verdict.partition(": ")
    assert f"{name} {words}" in " ".join(out.split())
    _, out, _ = command("verify", "oblique", "--engines", "article,exact")
    assert sandbox.verify("oblique", ["article", "exact"]).table() == without_padding(out)


def test_a_narrow_table_breaks_the_name_of_an_engine_before_its_settings() -> None:
    tuned = sandbox.compare("oblique", ["pymunk", "pymunk(substeps=4)", "exact"])
    words = [line.split() for line in tuned.table(48).splitlines()]
    assert words[words.index(["pymunk", "(substeps=4)", "exact"]) - 1] == ["pymunk"]
    assert ["pymunk", "pymunk(substeps=4)", "exact"] in [line.split() for line in tuned.table(100).splitlines()]


@pytest.mark.wide
def test_the_files_are_those_of_the_command(
    oblique: sandbox.Comparison, working_folder: Path, command: Command
) -> None:
    options = ["--json", "a.json", "--csv", "a.csv", "--report", "a.html"]
    command("compare", "oblique", "--engines", "pymunk,exact", *options)
    for ending in ("json", "csv", "html"):
        oblique.save(f"b.{ending}")
        assert Path(f"b.{ending}").read_text() == Path(f"a.{ending}").read_text()


def test_scores_and_their_files_are_those_of_the_command(working_folder: Path, command: Command) -> None:
    scores = sandbox.verify("oblique", ["article", "exact"])
    command("verify", "oblique", "--engines", "article,exact", "--json", "a.json")
    scores.save("b.json")
    assert Path("b.json").read_text() == Path("a.json").read_text()
    assert not scores.passed()
    assert sandbox.verify("oblique", "exact").passed()
    assert not scores["oblique"]["article"].scores[0].passed


@pytest.mark.wide
def test_rows_of_a_sweep_are_those_of_the_command(working_folder: Path, command: Command) -> None:
    options = ["--seeds", "0:2", "--engines", "pymunk,exact", "--set", "substeps=1,2", "--seconds", "0.5"]
    command("sweep", "article", *options, "--out", "a.csv", "--workers", 1)
    settings = {"substeps": [1, 2]}
    table = sandbox.sweep("article", ["pymunk", "exact"], seeds=range(2), settings=settings, seconds=0.5)
    table.save("b.csv")
    written, expected = ([*csv.DictReader(Path(f"{name}.csv").read_text().splitlines())] for name in "ba")
    assert written == expected
    assert len(written) == len(table) == 6
    assert [row["energy_ratio"] for row in table] == [float(row["energy_ratio"]) for row in written]


WRONG_FILES: dict[str, tuple[str, str]] = {
    "another ending": ("figures.txt", "figures.txt: must end in .json or .csv or .html"),
    "no folder": ("no/figures.json", "no/figures.json: cannot be written: No such file or directory"),
}


@pytest.mark.parametrize(("path", "message"), WRONG_FILES.values(), ids=WRONG_FILES)
def test_a_wrong_file_is_refused(oblique: sandbox.Comparison, path: str, message: str, working_folder: Path) -> None:
    with pytest.raises(sandbox.SandboxError, match=f"^{re.escape(message)}$"):
        oblique.save(path)
    assert list(working_folder.iterdir()) == []


def test_what_is_returned_shows_as_a_short_line(oblique: sandbox.Comparison) -> None:
    for shown in (oblique, oblique.runs["pymunk"], sandbox.simulate("oblique", "exact")):
        assert len(repr(shown)) < 120
        assert "array" not in repr(shown)


def test_a_run_that_fails_loses_its_row_only(monkeypatch: pytest.MonkeyPatch) -> None:
    def break_at_seed_1(scene: sandbox.Scene, *arguments: Any, **keywords: Any) -> Any:
        if scene.seed == 1:
            raise RuntimeError("broken")
        return comparison.compare(scene, *arguments, **keywords)

    monkeypatch.setattr("sandbox.sweeps.jobs.compare", break_at_seed_1)
    table = sandbox.sweep("article", "exact", seeds=range(3), seconds=0.1)
    assert [row["seed"] for row in table] == [0, 2]
    assert [(failed.job.seed, failed.failure) for failed in table.failures] == [(1, "RuntimeError: broken")]
    assert repr(table) == "<SweepTable: article, 2 rows, 1 failed>"


def test_a_comparison_is_a_mapping(oblique: sandbox.Comparison) -> None:
    assert [*oblique.items()] == [(name, run.figures) for name, run in oblique.runs.items()]
    assert oblique.get("article") is None
    assert "pymunk" in oblique


@pytest.mark.parametrize("name", ["break-shot", "marble-run"])
def test_the_space_of_a_scene_moves_as_the_engine_does(name: str) -> None:
    scene = sandbox.load(name)
    space, seconds = sandbox.to_space(name), 1
    for _ in range(seconds * scene.rate * scene.pymunk.substeps):
        space.step(1 / scene.rate / scene.pymunk.substeps)
    balls = [body for body in space.bodies if body.body_type == body.DYNAMIC]
    position = np.array([body.position for body in balls])
    assert position.tobytes() == sandbox.simulate(scene, "pymunk", seconds=seconds).position[-1].tobytes()
    assert [body.mass for body in balls] == scene.bodies.mass.tolist()


def test_orders_of_convergence_are_those_of_the_command(command: Command) -> None:
    options = ("--engines", "impulse", "--rates", "60,120,240", "--starts", 2, "--seconds", 0.5)
    _, out, _ = command("converge", "oblique", *options, "--json", "-")
    found = sandbox.converge("oblique", "impulse", rates=np.array([60, 120, 240]), starts=2, seconds=0.5)
    assert found.as_json() == json.loads(out)


CALLS = sandbox.compare, sandbox.verify, sandbox.sweep, sandbox.converge, sandbox.simulate


@pytest.mark.parametrize("call", CALLS, ids=lambda call: call.__name__)
def test_no_engine_at_all_is_an_error(call: Callable[..., object]) -> None:
    with pytest.raises(sandbox.SandboxError, match=r"^engines must contain at least one, got \[\]$"):
        call("oblique", [])


@pytest.mark.wide
def test_advice_is_that_of_the_command(command: Command) -> None:
    _, out, _ = command("compare", "head-on", "--engines", "pymunk,exact", "--advise", "--json", "-")
    document = json.loads(out)
    advice = sandbox.advise("head-on")
    assert [trial.changes for trial in advice] == [trial["changes"] for trial in document["advice"]]
    assert advice.best is next(trial for trial, row in zip(advice, document["advice"], strict=True) if row["advised"])
    assert advice.recommendation == document["recommendation"]


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
