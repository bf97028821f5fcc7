"""The baselines of the benchmarks do the same work as the engines. Speed itself is not tested."""

import os

import numpy as np
import pytest

from sandbox.bench import figure
from sandbox.bench.figure import alternately, processor_time, repeats_in
from sandbox.bench.parts import PARTS, bench
from sandbox.bench.plain import PlainArticle, plain_space
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


def test_a_part_yields_figures_with_their_spread(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(figure, "ROUNDS", 3)
    environment = dict(os.environ)
    [(title, figures)] = bench(["window"])
    found = list(figures)
    assert title == PARTS["window"][0]
    assert [one.name for one in found[:2]] == ["frame n=3", "frame / plain n=3"]
    assert all(0 < one.lowest <= one.median <= one.highest for one in found)
    assert dict(os.environ) == environment


def test_the_error_for_an_unknown_part_names_the_nearest() -> None:
    with pytest.raises(SandboxError, match=r"^no benchmark 'pymnk'; did you mean pymunk\?$"):
        next(bench(["pymnk"]))


def test_two_things_are_measured_alternately(monkeypatch: pytest.MonkeyPatch) -> None:
    order: list[str] = []

    def note(what: str) -> float:
        order.append(what)
        return 1.0

    assert alternately(2, lambda: note("a"), lambda: note("b")) == [(1, 1), (1, 1)]
    assert order == ["a", "b", "a", "b"]
    assert processor_time(lambda: sum(range(10_000)), 3) > 0
    assert repeats_in(lambda: sum(range(10_000)), 1e-9) == 1
