"""The baselines of the benchmarks do the same work as the engines. Speed itself is not tested."""

import os
import re
import subprocess
import sys
from collections.abc import Generator
from itertools import islice
from mmap import PAGESIZE, mmap
from pathlib import Path
from subprocess import CalledProcessError
from types import SimpleNamespace
from typing import cast
from unittest.mock import MagicMock, Mock

import numpy as np
import pytest
from conftest import Command
from plain_article import PlainArticle

from sandbox.bench import comparisons, engines, programs, window
from sandbox.bench.engines import plain_space
from sandbox.bench.figure import Figure, alternately, processor_time, repeats_in
from sandbox.bench.parts import PARTS, bench
from sandbox.engines import create
from sandbox.errors import SandboxError
from sandbox.scene.files import load
from sandbox.scene.spawn import spawn


@pytest.mark.parametrize("scene", ["article", "gas-100"])
def test_the_article_in_plain_python_is_the_engine_s_to_the_bit(scene: str) -> None:
    plain, engine = PlainArticle(load(scene)), create("article", load(scene), spawn(load(scene)))
    for _ in range(60):
        plain.step()
        engine.step()
    assert np.array_equal(engine.state().position, [(ball.x, ball.y) for ball in plain.balls])
    assert np.array_equal(engine.state().velocity, np.multiply([(ball.vx, ball.vy) for ball in plain.balls], 60))


@pytest.mark.parametrize("scene", ["article", "gas-100"])
def test_the_plain_pymunk_loop_is_the_engine_s_run(scene: str) -> None:
    """Contacts of one step may be solved in another order, so only a third of a second is compared."""
    space, engine = plain_space(load(scene)), create("pymunk", load(scene), spawn(load(scene)))
    for _ in range(20):
        space.step(1 / 60)
        engine.step()
    assert np.array([body.position for body in space.bodies]) == pytest.approx(engine.state().position, abs=1e-6)


def test_a_part_yields_figures_with_their_spread() -> None:
    environment = dict(os.environ)
    [(title, figures)] = bench(["window"])
    found = list(islice(figures, 2))
    cast("Generator[Figure]", figures).close()
    assert title == f"window: {PARTS['window'].guards}"
    assert [one.name for one in found] == ["frame n=3", "frame / plain n=3"]
    assert all(0 < one.lowest <= one.median <= one.highest for one in found)
    assert dict(os.environ) == environment


@pytest.fixture
def unmeasured(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let every measurement take 1 s, and do nothing."""
    for module in (comparisons, engines, window):
        monkeypatch.setattr(module, "processor_time", lambda *_: 1.0)
        monkeypatch.setattr(module, "repeats_in", lambda *_: 1)
    for module in (engines, window):
        monkeypatch.setattr(module, "plain_space", Mock())
    for name in ("create", "spawn", "ExactEngine"):
        monkeypatch.setattr(engines, name, Mock())
    monkeypatch.setattr(engines, "Recording", lambda _: MagicMock(bytes=1, __len__=lambda _: 1))
    monkeypatch.setattr(engines, "gas", lambda n, *_: SimpleNamespace(bodies=range(n), rate=60))
    monkeypatch.setattr(engines, "_collisions_per_second", lambda _: 1.0)
    for name in ("Window", "DrawOptions", "pygame"):
        monkeypatch.setattr(window, name, Mock())
    monkeypatch.setattr(programs, "_sizes", lambda _: [1.0])
    monkeypatch.setattr(programs, "run", lambda *_, **__: [1.0, 2.0, 3.0])


@pytest.mark.usefixtures("unmeasured")
def test_no_two_figures_have_the_same_name_and_their_words_fit() -> None:
    parts = [list(figures) for _, figures in bench()]
    names = [figure.name for part in parts for figure in part]
    assert len(names) == len(set(names)) > 20
    assert max(len(figure.means) for part in parts for figure in part) <= 42  # the column's width
    assert {figure.name for part in parts for figure in part if figure.higher_is_better} == {
        "article / Space.step n=20000",
        *(f"exact n={n} eta={eta}" for n, eta in ((100, 0.5), (1_000, 0.5), (100_000, 0.2), (100_000, 0.5))),
    }


def test_the_help_and_the_documents_name_every_part(command: Command) -> None:
    _, out, _ = command("bench", "--help")
    page = (Path(__file__).parents[2] / "docs" / "engines.md").read_text()
    for name in PARTS:
        assert re.search(rf"\b{name}\b", out)
        assert f"`{name}`" in page


def test_each_first_start_has_an_empty_cache_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    noted = tmp_path / "caches"
    program = (
        f"import os; cache = os.environ['NUMBA_CACHE_DIR']; files = os.listdir(cache); "
        f"open({str(noted)!r}, 'a').write(f'{{cache}} {{files}}\\n'); open(f'{{cache}}/kernel', 'w'); print()"
    )
    monkeypatch.setattr(programs, "SANDBOX", (sys.executable, "-c", program))
    monkeypatch.setattr(programs, "MOVING_BALL", (sys.executable, "-c", program))
    monkeypatch.setattr(programs, "simulation", lambda _: (sys.executable, "-c", program))
    assert all(figure.lowest > 0 for figure in programs.cold(2))
    caches, files = zip(*(line.split() for line in noted.read_text().splitlines()), strict=True)
    assert len(caches) == len(set(caches)) == 6
    assert set(files) == {"[]"}
    assert not any(Path(cache).exists() for cache in caches)


def test_a_program_that_fails_stops_the_benchmark() -> None:
    fails = (sys.executable, "-c", "import sys; sys.exit(3)")
    for run in (programs.run, programs.run_cold):
        with pytest.raises(CalledProcessError, match="exit status 3"):
            run(fails)


@pytest.mark.wide
def test_the_window_closes_after_the_first_frame_that_shows_a_step() -> None:
    environment = os.environ | programs.ENVIRONMENT
    ran = subprocess.run(programs.MOVING_BALL, env=environment, stdout=subprocess.PIPE, check=True)
    assert 1 <= ran.stdout.count(b"\n") <= 5


@pytest.mark.usefixtures("memory_screen")
def test_a_frame_of_the_start_does_not_close_the_window() -> None:
    opened = window._UntilABallMoves(load("article"), None)
    opened.frame(0.0)
    assert opened.running
    opened.frame(1 / 60)
    assert not opened.running


def test_the_finer_gas_covers_what_the_gas_of_1000_covers() -> None:
    gas, finer = load("gas-1000"), window.finer_gas(5_000)
    area = np.sum(gas.bodies.radius**2)
    assert (len(finer.bodies), finer.arena.size) == (5_000, gas.arena.size)
    assert np.sum(finer.bodies.radius**2) == pytest.approx(area)
    speeds = [np.sqrt(np.mean(spawn(one).velocity ** 2)) / one.bodies.radius[0] for one in (gas, finer)]
    assert speeds[0] == pytest.approx(speeds[1], rel=0.05)  # drawn at random


@pytest.mark.skipif(not programs.STATUS.exists(), reason="needs /proc")
@pytest.mark.usefixtures("memory_screen")
def test_growth_is_that_of_1000_frames(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    kept = []

    def grow(_window: object, _count: int) -> None:
        pages = mmap(-1, 20_000_000)  # new ones: the heap may have room that earlier tests left
        pages[::PAGESIZE] = b"x" * len(range(0, len(pages), PAGESIZE))
        kept.append(pages)

    monkeypatch.setattr(window, "_run_frames", grow)
    window.print_growth(10, 2)
    assert [float(line) for line in capfd.readouterr().out.split()] == pytest.approx([100, 100], rel=0.1)
    assert programs.megabytes(programs.PEAK) >= programs.megabytes(programs.PRESENT) > 40


def test_the_error_for_an_unknown_part_names_the_nearest() -> None:
    with pytest.raises(SandboxError, match=r"^no benchmark 'pymnk'; did you mean pymunk\?$"):
        next(bench(["pymnk"]))


def test_two_things_are_measured_alternately() -> None:
    order: list[str] = []

    def note(what: str) -> float:
        order.append(what)
        return 1.0

    assert alternately(2, lambda: note("a"), lambda: note("b")) == [(1, 1), (1, 1)]
    assert order == ["a", "b", "a", "b"]
    assert processor_time(lambda: sum(range(10_000)), 3) > 0
    assert repeats_in(lambda: sum(range(10_000)), 1e-9) == 1
