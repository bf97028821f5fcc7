"""The page of a sweep: its charts, its policy, its command; its verdict."""

import base64
import csv
import hashlib
import html
import io
import re
import shlex
from pathlib import Path

import pytest
from conftest import Command, scene_of

from sandbox.report.sweep import page
from sandbox.scene.files import load
from sandbox.sweeps import Job, Row, Sweep, as_csv, plan
from sandbox.sweeps.summary import engine_of, summary
from sandbox.sweeps.workers import run_here


def charts_in(text: str) -> list[str]:
    return re.findall(r'<div id="(\w+)" class="chart"', text)


def test_the_page_has_a_chart_for_each_known_value_and_escapes_text_of_scenes() -> None:
    balls = "count = 3\nradius = 5\ninside = [[0, 0], [300, 300]]\nspeed = 200"
    scene = scene_of(balls, more='seconds = 0.5\ntitle = "</script><img src=x>"')
    sweep = plan(scene, range(2), [60, 120], ["impulse"])
    whole = [result.row for result in run_here(sweep, sweep.jobs) if result.row]
    rows = [{key: value for key, value in row.items() if not key.startswith("first_difference")} for row in whole]
    plain = page(sweep, rows)
    assert "<img src=x>" not in plain
    assert "<h1>&lt;/script&gt;&lt;img src=x&gt;: a sweep</h1>" in plain
    assert charts_in(plain) == ["gap", "energy"]
    known = page(sweep, [row | {"first_difference.time": 0.1 * k} for k, row in enumerate(rows)])
    assert charts_in(known) == ["gap", "difference", "energy"]


@pytest.fixture(scope="module")
def made() -> tuple[list[Row], str]:
    scene = load("article").changed(seconds=0.5)
    sweep = plan(scene, range(1, 3), [60, 120], ["pymunk", "article"], {"substeps": [1, 2]})
    rows = [result.row for result in run_here(sweep, sweep.jobs) if result.row]
    return rows, page(sweep, rows)


def test_the_page_lets_no_script_run_but_its_own_and_requests_nothing(made: tuple[list[Row], str]) -> None:
    _, text = made
    scripts = re.findall(r"<script>(.*?)</script>", text, re.DOTALL)
    assert len(scripts) == 2
    digests = [base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in scripts]
    [policy] = re.findall(r'Content-Security-Policy" content="(.*?)"', text)
    allowed = " ".join(f"'sha256-{digest}'" for digest in digests)
    assert html.unescape(policy).startswith(f"default-src 'none'; script-src {allowed}; ")


@pytest.mark.wide
def test_the_command_on_the_page_makes_the_same_table(
    made: tuple[list[Row], str], command: Command, working_folder: Path
) -> None:
    rows, text = made
    line, source = (html.unescape(part) for part in re.findall("<pre>(.*?)</pre>", text, re.DOTALL))
    Path("article.toml").write_text(source)
    program, *arguments = shlex.split(line)
    code, _, error = command(*arguments)
    assert (program, code) == ("sandbox", 0), error
    assert table(Path("sweep.csv").read_text()) == table(as_csv(rows))


def table(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


# The verdict


def row_of(engine: str, seed: int, **figures: object) -> Row:
    return {"engine": engine, "settings": "", "seed": seed, "rate": 60, **figures}


def summary_of(*rows: Row, missing: int = 0) -> str:
    jobs = [Job(row["seed"], row["rate"], row["engine"], row["settings"]) for row in rows]
    lost = [Job(100 + k, 60, "pymunk") for k in range(missing)]
    return summary(Sweep(load("article"), "exact", (*jobs, *lost)), rows)


def test_it_counts_missing_runs_and_those_whose_gaps_mean_nothing_from_a_time_on() -> None:
    assert summary_of(row_of("pymunk", 0), row_of("pymunk", 1)) == "2 of 2 runs finished."
    text = summary_of(row_of("pymunk", 0, horizon=0.5), row_of("pymunk", 1), missing=1)
    assert text == (
        "2 of 3 runs finished; the others failed, and are missing here. In 1 of them the paths of exact mean nothing "
        "from some time on, the earliest at 0.50 s: gaps after that say nothing of an engine."
    )


def test_settings_of_pymunk_are_part_of_its_name_and_those_of_contacts_follow() -> None:
    row = row_of("pymunk(iterations=5)", 0) | {"settings": "elasticity=0.5, substeps=4"}
    assert engine_of(row) == "pymunk(iterations=5, substeps=4), elasticity=0.5"
