"""`sandbox bench --against`: what became worse, which way round, and which files are refused."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest
from conftest import Command

from sandbox.bench import parts
from sandbox.bench.figure import Figure, figure, read_figures, worse
from sandbox.bench.parts import Benchmark

pytestmark = pytest.mark.usefixtures("working_folder")


def measured(monkeypatch: pytest.MonkeyPatch, *figures: Figure) -> None:
    """Replace the benchmarks by one part that yields these figures."""
    monkeypatch.setattr(parts, "PARTS", {"made-up": Benchmark("Made up", 1, lambda _rounds: iter(figures))})


def write_earlier(*figures: Figure) -> None:
    Path("before.json").write_text(json.dumps([vars(one) for one in figures]))


TIME = figure("time", "time of a frame", [2.0, 2.5, 3.0], "ms")
RATE = figure("rate", "collisions", [200.0, 250.0, 300.0], "/s", higher_is_better=True)


@pytest.mark.parametrize(
    ("before", "now", "is_worse"),
    [
        (TIME, figure("time", "", [3.2, 3.3, 9.0]), True),
        (TIME, figure("time", "", [3.1, 3.3, 9.0]), False),  # within the noise of 5 %
        (TIME, figure("time", "", [2.9, 9.0, 9.0]), False),  # one round was as fast as one before
        (TIME, figure("time", "", [0.1, 0.2, 0.3]), False),
        (TIME, TIME, False),
        (RATE, figure("rate", "", [100, 150, 187], higher_is_better=True), True),
        (RATE, figure("rate", "", [100, 150, 188], higher_is_better=True), False),
        (RATE, figure("rate", "", [400, 500, 600], higher_is_better=True), False),
        (figure("growth", "", [-2.0, -1.0]), figure("growth", "", [-0.9]), True),
        (figure("growth", "", [0.0, 0.0], "MB"), figure("growth", "", [0.9], "MB"), False),  # within the noise of 1 MB
        (figure("growth", "", [0.0, 0.0], "MB"), figure("growth", "", [1.1], "MB"), True),
        (TIME, figure("another", "", [9.0]), False),
    ],
    ids=lambda value: f"{value.lowest:g}-{value.highest:g}" if isinstance(value, Figure) else str(value),
)
def test_a_figure_is_worse_if_every_round_is(before: Figure, now: Figure, is_worse: bool) -> None:
    assert worse([now], {before.name: before}) == ([now] if is_worse else [])


def test_what_became_worse_is_printed_and_exit_code_1(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    write_earlier(TIME, RATE, figure("gone", "", [1.0]))
    slower, fewer = figure("time", "time of a frame", [5.0]), figure("rate", "", [125], "/s", higher_is_better=True)
    measured(monkeypatch, slower, fewer, figure("new", "a figure that is new", [1.0]))
    code, out, err = command("bench", "--against", "before.json")
    assert (code, err) == (1, "")
    *_, title, columns, time, rate, _, last = out.splitlines()
    assert title.rstrip() == "Worse by more than the spread"
    assert columns.split() == ["before", "now", "ratio"]
    assert time.split() == ["time", "2.5", "5", "2"]
    assert rate.split() == ["rate", "250", "125", "0.5", "/s"]
    assert last == "2 figures compared, 2 worse"


def test_what_became_better_is_exit_code_0(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    write_earlier(TIME)
    measured(monkeypatch, figure("time", "time of a frame", [1.0], "ms"))
    code, out, err = command("bench", "--against", "before.json")
    assert (code, err) == (0, "")
    assert "Worse" not in out
    assert out.endswith("1 figure compared, 0 worse\n")


def test_a_median_of_0_has_no_ratio(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    write_earlier(figure("growth", "", [-1.0, 0.0, 1.0]))
    measured(monkeypatch, figure("growth", "", [2.5, 3.0], "MB"))
    code, out, _ = command("bench", "--against", "before.json")
    assert code == 1
    assert ["growth", "0", "2.75", "-", "MB"] in [line.split() for line in out.splitlines()]


def test_figures_that_are_written_can_be_read(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    measured(monkeypatch, TIME, RATE)
    code, out, err = command("bench", "--json", "now.json")
    assert (code, err) == (0, "")
    assert "collisions" in out
    assert read_figures(Path("now.json")) == {"time": TIME, "rate": RATE}


def test_json_on_standard_output_stays_alone(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    write_earlier(TIME)
    measured(monkeypatch, figure("time", "time of a frame", [5.0]))
    code, out, err = command("bench", "--against", "before.json", "--json", "-")
    assert (code, err) == (1, "")
    assert [one["median"] for one in json.loads(out)] == [5.0]


def test_an_older_file_knows_no_direction() -> None:
    old = vars(RATE) | {}
    del old["higher_is_better"]
    Path("old.json").write_text(json.dumps([old]))
    fewer = figure("rate", "", [1.0], higher_is_better=True)
    assert worse([fewer], read_figures(Path("old.json"))) == [fewer]


SPREAD: Final[dict[str, object]] = {"name": "a", "means": "", "unit": "", "median": 1, "lowest": 1, "highest": 1}
WRONG: Final[list[dict[str, object]]] = [
    {"median": float("nan")},
    {"highest": float("inf")},
    {"highest": 10**400},
    {"lowest": "1"},
    {"lowest": 2},
    {"name": []},
    {"name": 1},
    {"scene": "article"},
]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "1",
        "[1]",
        '{"scene": "article"}',
        '[{"name": "a"}]',
        "[" * 100_000,
        *(json.dumps([SPREAD | wrong]) for wrong in WRONG),
    ],
    ids=lambda text: text[:100],
)
def test_a_file_that_is_no_benchmark_is_refused_before_anything_runs(
    text: str, command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    def measure(_rounds: int) -> Iterator[Figure]:
        raise AssertionError

    monkeypatch.setattr(parts, "PARTS", {"made-up": Benchmark("Made up", 1, measure)})
    Path("before.json").write_text(text)
    outcome = command("bench", "--against", "before.json")
    assert outcome == (2, "", "before.json: is not a file of sandbox bench --json\n")


def test_a_file_that_is_missing_or_overwritten_is_refused(command: Command) -> None:
    missing = "before.json: cannot be read: No such file or directory\n"
    assert command("bench", "--against", "before.json") == (2, "", missing)
    write_earlier(TIME)
    taken = "--json before.json: is an input; choose another file\n"
    assert command("bench", "--against", "before.json", "--json", "before.json") == (2, "", taken)
