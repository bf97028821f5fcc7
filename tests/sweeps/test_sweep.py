"""Sweeps: the table has the same bytes wherever its jobs run, and whatever is killed on the way."""

import csv
import io
import json
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest
from conftest import LIBRARIES_REQUIRED, NO_KEY, Command, sample, scene_of, without_fma

from sandbox.analysis.comparison import compare
from sandbox.analysis.reference import SHIFTED_TWINS
from sandbox.cli.options import parse_setting, settings_by_key
from sandbox.engines.exact import ExactEngine
from sandbox.errors import SandboxError
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.state import State
from sandbox.sweeps import Row, Sweep, as_csv, in_order, missing, open_journal, plan, run, write
from sandbox.sweeps.jobs import (
    Job,
    reference_job,
    run_job,
    run_shared,
    scene_of_job,
)
from sandbox.sweeps.journal import journal_path
from sandbox.sweeps.workers import attempt, groups, run_locally

ARGUMENTS = ("article", "--seeds", "3:6", "--rates", "60,120", "--engines", "pymunk,article", "--seconds", "1")
TUNED = (*ARGUMENTS, "--set", "substeps=1,2")


def small() -> Sweep:
    """Return the sweep of TUNED: 3 seeds, 2 rates, and 3 engines: article, and Pymunk with 1 and 2 substeps."""
    return plan(
        load("article").changed(seconds=1.0), range(3, 6), [60, 120], ["pymunk", "article"], {"substeps": [1, 2]}
    )


def without_times(text: str) -> list[dict[str, str]]:
    """Read a table without its timings."""
    rows = list(csv.DictReader(io.StringIO(text)))
    assert all(float(row.pop("wall_s")) > 0 for row in rows)
    return rows


@pytest.fixture(scope="module")
def expected() -> list[dict[str, str]]:
    sweep = small()
    return without_times(as_csv([run_job(sweep.scene, sweep.against, job) for job in sweep.jobs]))


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
    pymunk = scene_of_job(load("article"), jobs[2]).pymunk
    assert (pymunk.collision_slop, pymunk.iterations, pymunk.substeps) == (0.25, 10, 4)


def test_keys_of_the_scene_are_set_for_every_engine_and_the_reference() -> None:
    options = ["gravity=[0, 0],[0, 900]", "balls.0.radius=15", "elasticity=0.25", "substeps=2", "arena.friction=0.5"]
    settings = settings_by_key([*map(parse_setting, options)])
    engines = ["pymunk", "pymunk(iterations=3)", "impulse"]
    jobs = plan(load("bouncing"), [0], [60], engines, settings).jobs
    of_scene = "arena.friction=0.5, balls.0.radius=15, elasticity=0.25, gravity=[0, {}]"
    assert [(job.engine, job.settings) for job in jobs] == [
        (engine, of_scene.format(g) + ("" if engine == "impulse" else ", substeps=2"))
        for engine in engines
        for g in (0, 900)
    ]
    scene = scene_of_job(load("bouncing"), jobs[1])
    assert (scene.gravity, scene.bodies.radius[0], scene.pymunk.substeps) == ((0, 900), 15, 2)
    assert (scene.arena.friction, scene.arena.elasticity, scene.bodies.elasticity[1]) == (0.5, 0.5, 0.5)
    assert reference_job("exact", jobs[1]).settings == of_scene.format(900)


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
    assert read[0]["ledger.late.energy"] == read[0]["theory.compressibility.measured"] == ""
    assert "of a later version" not in read[0]
    assert [list(read[0])[place] for place in (0, -1)] == ["scene", "wall_s"]


# What rows share


def rows_of(sweep: Sweep, *, share: bool) -> list[Row]:
    """Run a sweep's jobs here, with a reference for each group of jobs or for each job; return rows without times."""
    rows = []
    for group in groups(sweep, sweep.jobs):
        reference = run_shared(sweep.scene, reference_job(sweep.against, group[0]))
        assert reference is not None
        rows += [run_job(sweep.scene, sweep.against, job, reference if share else None) for job in group]
    return [{key: value for key, value in row.items() if key != "wall_s"} for row in rows]


@pytest.mark.wide
@pytest.mark.parametrize("against", ["exact", "pymunk", "article"])
def test_rows_that_share_a_reference_are_those_with_one_each(against: str) -> None:
    scene = load("article").changed(seconds=1.0)
    engines, settings = ["pymunk", "article", "exact"], {"substeps": [1, 2], "iterations": [2, 10]}
    sweep = plan(scene, [3, 4], [60, 120], engines, settings, against=against)
    assert rows_of(sweep, share=True) == rows_of(sweep, share=False)


def test_pymunk_s_settings_need_another_reference_only_if_it_has_them() -> None:
    jobs = [Job(1, 60, "pymunk", "substeps=2"), Job(1, 60, "pymunk", "substeps=4"), Job(1, 60, "article")]
    assert {reference_job("exact", job) for job in jobs} == {Job(1, 60, "exact")}
    assert [reference_job("pymunk", job).settings for job in jobs] == ["substeps=2", "substeps=4", ""]
    assert len({reference_job("exact", job) for job in (jobs[0], Job(2, 60, "article"), Job(1, 50, "article"))}) == 3


def test_a_reference_runs_once_for_all_rows_of_a_seed_and_rate(monkeypatch: pytest.MonkeyPatch) -> None:
    sweep, ran = small(), []
    built = ExactEngine.__init__

    def count(engine: ExactEngine, scene: Scene, initial: State) -> None:
        ran.append((scene.seed, scene.rate))
        built(engine, scene, initial)

    monkeypatch.setattr(ExactEngine, "__init__", count)
    rows_of(sweep, share=True)
    twins = SHIFTED_TWINS + 1  # one more is renumbered
    each = [(seed, rate) for seed in range(3, 6) for rate in (60, 120)]
    assert sorted(ran) == sorted((1 + twins) * each)


def test_a_reference_that_is_too_large_or_fails_is_left_to_each_job(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = load("article").changed(seconds=1.0)
    assert run_shared(load("bouncing"), Job(0, 60, "article")) is None
    assert run_shared(scene, Job(0, 60, "exact")) is not None
    monkeypatch.setattr("sandbox.sweeps.jobs.MAX_REFERENCE_BYTES", 61 * 3 * 16 - 1)
    assert run_shared(scene, Job(0, 60, "exact")) is None
    outcome = attempt(scene, "exact", Job(0, 60, "pymunk"), None)
    assert outcome.row is not None


# Where it runs


@pytest.mark.wide
@pytest.mark.parametrize("count", [1, 3])
def test_every_job_runs_once_whoever_runs_it(count: int) -> None:
    """Three processes share two groups of jobs, so one runs jobs of a group that another one has begun."""
    scene = load("article").changed(seconds=0.1)
    sweep = plan(scene, range(2), [60], ["pymunk"], {"iterations": range(1, 6)})
    done = [outcome.job for outcome in run_locally(sweep, sweep.jobs, count)]
    assert sorted(done) == sorted(sweep.jobs)


@pytest.mark.parametrize("workers", sample(["2", "1"], 2))
def test_local_processes_make_the_table(command: Command, workers: str, expected: list[dict[str, str]]) -> None:
    result = command("sweep", *TUNED, "--workers", workers, "--out", "f.csv")
    assert result == (0, "", "")
    assert without_times(Path("f.csv").read_text()) == expected
    assert not journal_path("f.csv").exists()
    assert sorted(path.name for path in Path().iterdir()) == ["f.csv"]


@pytest.mark.wide
def test_a_worker_that_is_killed_costs_nothing(expected: list[dict[str, str]]) -> None:
    sweep = small()
    with open_journal(sweep, "f.csv") as kept:
        outcomes = run(sweep, kept, workers=2)
        next(outcomes)
        worker = multiprocessing.active_children()[0].pid
        assert worker
        os.kill(worker, signal.SIGKILL)
        assert not any(outcome.failure for outcome in outcomes)
        assert len(kept.rows) == len(sweep.jobs)
        write(sweep, in_order(sweep, kept.rows), "f.csv")
    assert without_times(Path("f.csv").read_text()) == expected
    assert not multiprocessing.active_children()


@pytest.mark.wide
def test_a_sweep_that_was_killed_resumes(command: Command, expected: list[dict[str, str]]) -> None:
    killed = started(*TUNED, "--workers", "2", "--out", "f.csv")
    path = journal_path("f.csv")
    while not path.exists() or path.read_bytes().count(b"\n") < 6:
        assert killed.poll() is None
        time.sleep(0.01)
    killed.kill()
    killed.communicate()
    assert not Path("f.csv").exists()
    content = path.read_bytes()
    path.write_bytes(content[: content.rindex(b"\n") - 5])  # as if killed while the last row was written
    with open_journal(small(), "f.csv") as kept:
        assert len(missing(small(), kept)) == len(small().jobs) - content.count(b"\n") + 2
    assert path.read_bytes() == b"".join(content.splitlines(keepends=True)[:-1])
    assert command("sweep", *TUNED, "--workers", "2", "--out", "f.csv") == (0, "", "")
    assert without_times(Path("f.csv").read_text()) == expected


@pytest.mark.wide
def test_saved_rows_are_not_run_again() -> None:
    sweep = small()
    with open_journal(sweep, "f.csv") as kept:
        for outcome in zip(range(4), run(sweep, kept, workers=1), strict=False):
            assert outcome[1].row
    before = journal_path("f.csv").read_bytes()
    with open_journal(sweep, "f.csv") as kept:
        assert missing(sweep, kept) == list(sweep.jobs[4:])
        assert len(list(run(sweep, kept, workers=1))) == len(sweep.jobs) - 4
    assert journal_path("f.csv").read_bytes().startswith(before)


INVALID_ROWS = (
    *("[1]", "null", "{}", "[" * 100_000, "1" * 9_999, '{"wall_s"'),
    '{"seed": 0, "rate": 60, "engine": "article", "settings": "", "pow": "fma"}',
    '{"seed": 0, "rate": 60, "engine": "article", "settings": "", "wall_s": 1}',
    '{"seed": [0], "rate": 60, "engine": "article", "settings": "", "pow": "fma", "wall_s": 1}',
)


@pytest.mark.parametrize("line", INVALID_ROWS, ids=range(len(INVALID_ROWS)))
def test_an_invalid_line_in_a_journal_is_run_again(line: str) -> None:
    sweep = small()
    with open_journal(sweep, "f.csv") as kept:
        kept.add({**sweep.jobs[0]._asdict(), "pow": "fma", "wall_s": 0.1})
    before = journal_path("f.csv").read_bytes()
    journal_path("f.csv").write_bytes(before + line.encode() + b"\n" + before.splitlines(keepends=True)[1])
    with open_journal(sweep, "f.csv") as kept:
        assert missing(sweep, kept) == list(sweep.jobs[1:])
    assert journal_path("f.csv").read_bytes() == before


def test_a_journal_torn_in_its_first_line_starts_anew() -> None:
    with open_journal(small(), "f.csv"):
        whole = journal_path("f.csv").read_bytes()
    for length in (0, 9, len(whole) - 1):
        journal_path("f.csv").write_bytes(whole[:length])
        with open_journal(small(), "f.csv") as kept:
            assert kept.rows == []
            assert journal_path("f.csv").read_bytes() == whole


def make_one_row() -> None:
    sweep = small()
    with open_journal(sweep, "f.csv") as kept:
        kept.add(run_job(sweep.scene, sweep.against, sweep.jobs[0]))


@pytest.mark.wide
def test_rows_made_without_fma_are_not_mixed_with_rows_made_with_it(command: Command) -> None:
    """A journal is resumed on another machine, whose C library has the other pow."""
    here = Path(__file__).parent
    program = f"import sys\nsys.path[:0] = {[str(here), str(here.parent)]}\nimport test_sweep as t\nt.make_one_row()"
    subprocess.run([sys.executable, "-c", program], env=without_fma(), check=True)
    before = journal_path("f.csv").read_bytes()
    code, out, error = command("sweep", *TUNED, "--workers", "1", "--out", "f.csv")
    assert (code, out) == (2, "")
    assert error == (
        "seed 3, rate 60, pymunk substeps=2: ran where the C library's pow is the variant 'fma', the rows before "
        "where it is 'no fma', so results may differ; use processors of one kind, or another --out\n"
    )
    assert journal_path("f.csv").read_bytes() == before


def test_a_reference_that_ran_with_another_variant_of_pow_is_not_shared() -> None:
    sweep = plan(load("article").changed(seconds=1.0), [3], [60], ["pymunk"], against="article")
    other = run_shared(sweep.scene, Job(4, 60, "article"))
    assert other is not None
    elsewhere = other._replace(pow="no fma" if other.pow == "fma" else "fma")
    rows = [run_job(sweep.scene, "article", sweep.jobs[0], shared) for shared in (None, elsewhere)]
    assert rows[0]["gap_rms"] == rows[1]["gap_rms"]


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
def test_a_cluster_makes_the_table_even_if_a_worker_is_killed(
    cluster: tuple[str, list[subprocess.Popen[str]]], expected: list[dict[str, str]]
) -> None:
    address, [_, worker, _] = cluster
    assert table_of_cluster(address, worker.kill) == expected
    assert ended(started(*TUNED, "--scheduler", address))[0] == 0


@pytest.mark.wide
def test_rows_that_die_with_their_worker_before_they_are_fetched_are_run_again(
    cluster: tuple[str, list[subprocess.Popen[str]]], expected: list[dict[str, str]]
) -> None:
    from distributed import Client

    address, [_, worker, _] = cluster

    def kill_once_all_is_done() -> None:
        with Client(address, set_as_default=False) as client:  # type: ignore[no-untyped-call]
            while len([key for key in client.who_has() if key.startswith("attempt")]) < len(small().jobs) - 1:
                time.sleep(0.02)
            worker.kill()
            while len(client.nthreads()) > 1:
                time.sleep(0.02)

    assert table_of_cluster(address, kill_once_all_is_done) == expected


def table_of_cluster(address: str, after_first_row: Callable[[], object]) -> list[dict[str, str]]:
    """Run the sweep of TUNED on a cluster, with an interruption after the first row; no row may fail."""
    sweep = small()
    with open_journal(sweep, "f.csv") as kept:
        outcomes = run(sweep, kept, scheduler=address)
        next(outcomes)
        after_first_row()
        assert not any(outcome.failure for outcome in outcomes)
        write(sweep, in_order(sweep, kept.rows), "f.csv")
    return without_times(Path("f.csv").read_text())


@pytest.mark.wide
def test_a_cluster_whose_workers_have_both_variants_of_pow_is_refused(
    cluster: tuple[str, list[subprocess.Popen[str]]],
) -> None:
    from distributed import Client

    address, processes = cluster
    program = [sys.executable, "-m", "dask", "worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard"]
    silent = subprocess.DEVNULL
    processes += [subprocess.Popen(program, env=without_fma(), stdout=silent, stderr=silent, text=True)]
    with Client(address, set_as_default=False) as client:  # type: ignore[no-untyped-call]
        client.wait_for_workers(3)
    sweep = small()
    with open_journal(sweep, "f.csv") as kept:
        with pytest.raises(SandboxError, match=r"^seed \d.* ran where the C library's pow is the variant"):
            list(run(sweep, kept, scheduler=address))
        assert len({row["pow"] for row in kept.rows}) == 1


@pytest.mark.parametrize(
    ("address", "why"),
    [
        ("", "must have a host and a port up to 65535, as in tcp://host:8786"),
        ("foo:bar", "must have a host and a port up to 65535, as in tcp://host:8786"),
        ("tcp://127.0.0.1:99999", "must have a host and a port up to 65535, as in tcp://host:8786"),
        ("tcp://[::1", "must have a host and a port up to 65535, as in tcp://host:8786"),
        ("tcp://no-such-host.invalid:8786", "no scheduler answers: "),
        ("tcp://127.0.0.1:1", "no scheduler answers: Connection refused"),
    ],
)
def test_an_address_without_a_scheduler_is_one_message_and_leaves_no_journal(
    command: Command, address: str, why: str
) -> None:
    code, out, err = command("sweep", "article", "--out", "f.csv", "--scheduler", address)
    assert (code, out) == (2, "")
    assert err.startswith(f"--scheduler '{address}': {why}")
    assert err.count("\n") == 1
    assert list(Path().iterdir()) == []


def test_a_host_that_never_answers_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """A look-up of a name may hang for longer than any timeout of a connection."""
    from sandbox.sweeps import workers

    hangs, ended = threading.Event(), threading.Event()

    def connect(*_: object) -> None:
        hangs.wait()
        ended.set()
        raise TimeoutError

    monkeypatch.setattr(workers, "CONNECT_TIMEOUT", 0.01)
    monkeypatch.setattr("socket.create_connection", connect)
    with pytest.raises(SandboxError, match=r"^--scheduler 'tcp://host:8786': no scheduler answers: no answer within"):
        workers.check_scheduler("tcp://host:8786")
    hangs.set()
    ended.wait()


def test_a_sweep_that_ends_without_a_row_leaves_no_journal() -> None:
    def interrupted() -> None:
        with open_journal(small(), "f.csv"):
            raise SandboxError("the cluster is gone")

    with pytest.raises(SandboxError):
        interrupted()
    assert not journal_path("f.csv").exists()


@pytest.mark.wide
def test_a_scheduler_that_is_gone_is_reported_once(cluster: tuple[str, list[subprocess.Popen[str]]]) -> None:
    address, [scheduler, *_] = cluster
    sweep = plan(load("article").changed(seconds=1.0), range(50), [60], ["article"])
    with open_journal(sweep, "f.csv") as kept:
        outcomes = run(sweep, kept, scheduler=address)
        assert next(outcomes).row
        scheduler.kill()
        with pytest.raises(SandboxError, match=f"^--scheduler {address}: is gone; the same command runs the rows"):
            list(outcomes)
    with open_journal(sweep, "f.csv") as kept:
        assert 1 <= len(kept.rows) < 50


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
    arguments = ("article", "--seeds", "0:5", "--engines", "fragile", "--seconds", "0.1", "--out", "f.csv")
    code, _, error = ended(started(*arguments, "--workers", "2", PYTHONPATH=path))
    assert code == 1
    traceback, _, lines = error.partition("AssertionError: no ones\n")
    assert traceback.startswith("Traceback")
    assert sorted(lines.splitlines()) == [
        "3 of 5 rows are missing; the same command tries again",
        "seed 1, rate 60, fragile at 0.000 s: raised AssertionError: no ones",
        "seed 2, rate 60, fragile: its worker process died 3 times",
        "seed 3, rate 60, fragile: its worker process died 3 times",
    ]
    assert [row["seed"] for row in without_times(Path("f.csv").read_text())] == ["0", "4"]
    assert journal_path("f.csv").exists()


@pytest.mark.wide
def test_a_full_disk_is_reported_and_costs_no_saved_row() -> None:
    limit = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (4000, 4000))"
    code, _, error = ended(started(*TUNED, "--workers", "1", "--out", "f.csv", program=limit))
    assert (code, error) == (2, "f.csv.journal: cannot be written: File too large\n")
    assert not Path("f.csv").exists()
    with open_journal(small(), "f.csv") as kept:
        assert 2 <= len(kept.rows) <= 8
        assert missing(small(), kept) == list(small().jobs[len(kept.rows) :])


def test_an_exception_in_a_job_is_its_outcome() -> None:
    outcome = attempt(load("bouncing"), "article", Job(0, 60, "pymunk"))
    assert outcome.row is None
    assert outcome.failure.startswith("article: gravity and elasticity below 1 are not part of")


def test_a_journal_of_another_sweep_or_one_in_use_is_left_alone() -> None:
    make_one_row()
    with open_journal(small(), "f.csv"), pytest.raises(SandboxError, match="is in use by another sweep"):  # noqa: SIM117
        with open_journal(small(), "f.csv"):
            pass
    longer = plan(load("article").changed(seconds=2.0), [0], [60], ["article"])
    other_scene = r"\.journal: has rows of another scene"
    with pytest.raises(SandboxError, match=rf"f\.csv{other_scene}"), open_journal(longer, "f.csv"):
        pass
    for notes in ("my own notes\n", "my own notes"):
        journal_path("mine").write_text(notes)
        with pytest.raises(SandboxError, match=f"mine{other_scene}"), open_journal(longer, "mine"):
            pass
        assert journal_path("mine").read_text() == notes


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("article", "--seeds", "x"), "--seeds x: must be two numbers A:B"),
        (
            ("article", "--seeds", "0:1000000", "--engines", "pymunk,article"),
            "a sweep of 2,000,000 rows is larger",
        ),
        (
            ("article", "--set", "substeps"),
            "--set substeps: must be a setting of Pymunk or a key of the scene, and its values",
        ),
        (
            ("article", "--set", "subteps=1"),
            "--set subteps: is neither a setting of pymunk nor a key of the scene; did",
        ),
        (("article", "--set", "gravity=900"), "gravity must be a list in brackets, such as [0, 900], got 900"),
        (("article", "--set", "gravity=[0, 900"), "--set gravity=[0, 900: must be a setting of Pymunk or a key of"),
        (("article", "--set", "balls.3.radius=9"), "balls.3.radius: 3 must be a number from 0 to 0"),
        (("article", "--set", "balls.0.radios=9"), f"balls[0].radios {NO_KEY}; did you mean radius?"),
        (("article", "--set", "balls.0.radius=-9"), "balls[0].radius must be greater than 0, got -9"),
        (("article", "--set", "elasticity=2"), "elasticity must be a number from 0 to 1, got 2"),
        (("article", "--set", "rate=120"), "--set rate: --rates runs several of them"),
        (
            ("article", "--engines", "pymunk(substeps=2)", "--set", "substeps=1"),
            "--set substeps: pymunk(substeps=2) has a value of its own; name it without",
        ),
        (("article", "--set", "substeps=0"), "pymunk.substeps must be at least 1, got 0"),
        (
            ("article", "--engines", "article", "--set", "substeps=1"),
            "--set substeps changes a setting of pymunk, which is not among",
        ),
        (
            ("article", "--workers", "2", "--scheduler", "tcp://127.0.0.1:1"),
            "--workers and --scheduler exclude",
        ),
    ],
    ids=lambda value: "-".join(value) if isinstance(value, tuple) else "",
)
def test_an_error_is_one_message_before_anything_runs(
    command: Command, arguments: tuple[str, ...], message: str
) -> None:
    code, out, error = command("sweep", *arguments)
    assert (code, out) == (2, "")
    assert error.startswith(message)
    assert error.count("\n") == 1
