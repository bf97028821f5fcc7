"""Sweeps: the table has the same bytes wherever its jobs run, and whatever is killed on the way."""

import csv
import io
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest
from conftest import LIBRARIES_REQUIRED, Command, scene_of

from sandbox.analysis.comparison import compare
from sandbox.cli.options import parse_setting, settings_by_key
from sandbox.errors import SandboxError
from sandbox.scene.files import load
from sandbox.sweeps import Row, Sweep, as_csv, in_order, plan, run
from sandbox.sweeps.jobs import groups, run_jobs, scene_of_job
from sandbox.sweeps.workers import run_here

ARGUMENTS = ("article", "--seeds", "3:6", "--rates", "60,120", "--engines", "pymunk,article", "--seconds", "1")
TUNED = (*ARGUMENTS, "--set", "substeps=1,2")


def small() -> Sweep:
    """Return the sweep of TUNED: 3 seeds, 2 rates, and 3 engines: article, and Pymunk with 1 and 2 substeps."""
    return plan(
        load("article").changed(seconds=1.0), range(3, 6), [60, 120], ["pymunk", "article"], {"substeps": [1, 2]}
    )


def table(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


@pytest.fixture(scope="module")
def expected() -> list[dict[str, str]]:
    """The table of `small`, each row of which ran alone."""
    sweep = small()
    results = [result for job in sweep.jobs for result in run_jobs(sweep.scene, sweep.against, [job])]
    return table(as_csv([result.row for result in results if result.row]))


pytestmark = pytest.mark.usefixtures("working_folder")


def started(*arguments: str, program: str = "", **environment: str) -> subprocess.Popen[str]:
    start = f"if __name__ == '__main__':\n    {program or 'pass'}\n    from sandbox.cli import main\n    main()"
    return subprocess.Popen(
        [sys.executable, "-c", start, "sweep", *arguments],
        env=os.environ | environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def ended(process: subprocess.Popen[str]) -> tuple[int, str, str]:
    try:
        out, error = process.communicate(timeout=600)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        raise
    return process.returncode, out, error


# What a row is


def test_a_row_is_what_compare_returns_for_one_engine(expected: list[dict[str, str]]) -> None:
    assert len(expected) == 3 * 2 * 3
    assert [(row["seed"], row["rate"], row["engine"], row["settings"]) for row in expected[:4]] == [
        ("3", "60", "pymunk", "substeps=1"),
        ("3", "60", "pymunk", "substeps=2"),
        ("3", "60", "article", ""),
        ("3", "120", "pymunk", "substeps=1"),
    ]
    scene = load("article").changed(seconds=1.0, seed=5, rate=120, pymunk={"substeps": 2})
    figures = compare(scene, ["pymunk", "article", "exact"]).runs["pymunk"].figures
    row = expected[-2]
    assert (row["seed"], row["rate"], row["settings"], row["against"]) == ("5", "120", "substeps=2", "exact")
    assert float(row["gap_rms"]) == figures.gap_rms > 0
    assert int(row["wall_contacts"]) == figures.wall_contacts
    assert row["python"] == sys.version.split()[0]


def test_each_combination_of_pymunk_s_settings_has_its_job() -> None:
    settings = settings_by_key([*map(parse_setting, ["substeps=1,4", "collision_slop=0.25", "iterations=10,50"])])
    jobs = plan(load("article"), [0], [60], ["article", "pymunk"], settings).jobs
    assert [job.settings for job in jobs] == [
        "",
        "collision_slop=0.25, iterations=10, substeps=1",
        "collision_slop=0.25, iterations=10, substeps=4",
        "collision_slop=0.25, iterations=50, substeps=1",
        "collision_slop=0.25, iterations=50, substeps=4",
    ]
    assert jobs[2].spec == "pymunk(collision_slop=0.25, iterations=10, substeps=4)"


def test_the_elasticity_of_contacts_is_that_of_every_engine_and_the_reference() -> None:
    settings = settings_by_key([*map(parse_setting, ["elasticity=0.25,1", "substeps=2"])])
    jobs = plan(load("bouncing"), [0], [60], ["pymunk", "pymunk(iterations=3)", "impulse"], settings).jobs
    together = {tuple(job.spec for job in group) for group in groups(jobs, 9)}
    assert together == {("pymunk(substeps=2)", "pymunk(iterations=3, substeps=2)", "impulse")}
    assert len(list(groups(jobs, 9))) == 2
    scene = scene_of_job(load("bouncing"), jobs[0])
    assert (scene.arena.elasticity, scene.bodies.elasticity[1]) == (0.5, 0.5)


def test_without_an_exact_reference_a_sweep_has_that_of_a_comparison() -> None:
    rough = scene_of("radius = 20\nfriction = 1\npositions = [[100, 300], [300, 310]]")
    assert plan(rough, [0], [60], ["pymunk"]).against == compare(rough.changed(seconds=0.1)).against


def test_a_table_always_has_the_same_columns_and_unknown_values_stay_empty() -> None:
    rows: list[Row] = [
        {"seed": 1},
        {"seed": 2, "first_difference.cause": "late", "first_difference.before": [[1.5, 2]], "of a later version": 1},
    ]
    read = list(csv.DictReader(io.StringIO(as_csv(rows))))
    assert list(read[0]) == csv.DictReader(io.StringIO(as_csv([]))).fieldnames
    assert [row["first_difference.cause"] for row in read] == ["", "late"]
    assert [row["first_difference.before"] for row in read] == ["", "[[1.5, 2]]"]
    assert read[0]["ledger.late.energy"] == read[0]["theory.contacts per second.measured"] == ""
    assert "of a later version" not in read[0]
    assert [list(read[0])[place] for place in (0, -1)] == ["scene", "pow"]


# Where it runs


def test_local_processes_make_the_table(command: Command, expected: list[dict[str, str]]) -> None:
    result = command("sweep", *TUNED, "--workers", "2", "--out", "f.csv")
    assert result == (0, "", "")
    assert table(Path("f.csv").read_text()) == expected
    assert sorted(path.name for path in Path().iterdir()) == ["f.csv"]


@pytest.mark.wide
def test_an_interrupted_sweep_writes_the_rows_that_have_finished(fragile: str) -> None:
    """The failure of seed 1 is printed once the row of seed 0 is there."""
    path = os.pathsep.join(filter(None, [fragile, os.environ.get("PYTHONPATH")]))
    arguments = ("article", "--seeds", "0:4000", "--engines", "fragile", "--seconds", "1", "--out", "f.csv")
    killed = started(*arguments, "--workers", "1", PYTHONPATH=path)
    assert killed.stderr
    assert killed.stderr.readline().startswith("Traceback")
    killed.send_signal(signal.SIGINT)
    assert ended(killed)[0] == 130
    rows = table(Path("f.csv").read_text())
    assert [row["seed"] for row in rows[:1]] == ["0"]
    assert len(rows) < 3997  # that there are of all of them


def test_rows_of_another_variant_of_pow_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    sweep = plan(load("head-on").changed(seconds=0.1), [0, 1], [60], ["impulse"])
    results = list(run_here(sweep, sweep.jobs))
    assert results[1].row
    results[1].row["pow"] = "another"
    monkeypatch.setattr("sandbox.sweeps.run_locally", lambda *_: iter(results))
    with pytest.raises(SandboxError, match=r"^seed 1, rate 60, impulse: ran where the C library's pow is the variant"):
        list(run(sweep))


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[tuple[str, list[subprocess.Popen[str]]]]:
    """Start a Dask scheduler and two workers, each a process, as on three machines."""
    if find_spec("distributed") is None:
        (pytest.fail if LIBRARIES_REQUIRED else pytest.skip)("needs distributed")
    place = tmp_path / "scheduler.json"

    def start(*arguments: str) -> subprocess.Popen[str]:
        program = [sys.executable, "-m", "dask", *arguments, "--scheduler-file", str(place), "--no-dashboard"]
        return subprocess.Popen(program, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, text=True, cwd=tmp_path)

    processes = [start("scheduler", "--host", "127.0.0.1", "--port", "0")]
    worker = ("worker", "--nthreads", "1", "--no-nanny", "--host", "127.0.0.1")
    try:
        while not (place.exists() and place.read_text()):
            assert processes[0].poll() is None
            time.sleep(0.02)
        processes += [start(*worker), start(*worker)]
        yield json.loads(place.read_text())["address"], processes
    finally:
        for process in processes:
            process.kill()
            process.wait()


@pytest.mark.wide
def test_a_cluster_makes_the_table_even_if_a_worker_is_killed_and_says_when_it_is_gone(
    cluster: tuple[str, list[subprocess.Popen[str]]], expected: list[dict[str, str]]
) -> None:
    address, [scheduler, worker, _] = cluster
    sweep = small()
    results = run(sweep, scheduler=address)
    rows = [next(results).row]
    worker.kill()
    rows += [result.row for result in results]
    assert table(as_csv(in_order(sweep, [row for row in rows if row]))) == expected
    longer = run(plan(load("article").changed(seconds=1.0), range(50), [60], ["article"]), scheduler=address)
    assert next(longer).row
    scheduler.kill()
    with pytest.raises(SandboxError, match=f"^--scheduler {address}: is gone; the same command runs the sweep again"):
        list(longer)


# What goes wrong


@pytest.fixture
def fragile(tmp_path: Path) -> str:
    """Install an engine that fails at seed 1, exits its process at seed 2, and while its row is sent at seed 3."""
    place = tmp_path / "fragile"
    info = place / "fragile-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: fragile\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[sandbox.engines]\nfragile = fragile:Fragile\n")
    (place / "fragile.py").write_text(
        "import os\nfrom multiprocessing.connection import Connection\n"
        "from sandbox.engines.impulse import ImpulseEngine\n"
        "class Fragile(ImpulseEngine):\n    def __init__(self, scene, initial):\n"
        "        super().__init__(scene, initial)\n        assert scene.seed != 1, 'no ones'\n"
        "        if scene.seed == 2: os._exit(7)\n"
        "        if scene.seed == 3: Connection._send = send_half\n"
        "def send_half(self, data):\n    os.write(self.fileno(), bytes(data)[:99])\n    os._exit(7)\n"
    )
    return str(place)


@pytest.mark.wide
def test_a_job_that_fails_or_kills_its_worker_costs_only_its_row(fragile: str) -> None:
    path = os.pathsep.join(filter(None, [fragile, os.environ.get("PYTHONPATH")]))
    arguments = ("article", "--seeds", "0:5", "--engines", "fragile,impulse", "--seconds", "0.1", "--out", "f.csv")
    code, _, error = ended(started(*arguments, "--workers", "2", PYTHONPATH=path))
    assert code == 1
    traceback, _, lines = error.partition("AssertionError: no ones\n")
    assert traceback.startswith("Traceback")
    assert sorted(lines.splitlines()) == [
        "3 of 10 rows are missing",
        "seed 1, rate 60, fragile at 0.000 s: raised AssertionError: no ones",
        "seed 2, rate 60, fragile: its worker process died",
        "seed 3, rate 60, fragile: its worker process died",
    ]
    rows = [(row["seed"], row["engine"]) for row in table(Path("f.csv").read_text())]
    assert rows == [
        (str(seed), name) for seed in range(5) for name in ("fragile", "impulse") if name == "impulse" or seed in (0, 4)
    ]
