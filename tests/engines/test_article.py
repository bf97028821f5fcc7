"""The article's rule, bit for bit."""

from pathlib import Path

import numpy as np
import pytest
from conftest import ball_at, scene_of
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_article import PlainArticle
from recorded import recorded

from sandbox.analysis.comparison import compare
from sandbox.engines import create
from sandbox.engines.article import pow_variant
from sandbox.errors import Refused
from sandbox.report.trajectory import simulate
from sandbox.scene.files import load
from sandbox.scene.spawn import spawn

TRACES = Path(__file__).parent / "traces"
with_fma = pytest.mark.skipif(pow_variant() != "fma", reason="the traces were made with the pow of glibc with FMA")


@with_fma
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_equals_the_article_s_program(seed: int) -> None:
    expected = np.load(TRACES / f"seed{seed}_n3.npz")
    scene = load("article").changed(seed=seed)
    run = simulate(scene, "article", steps=2000)
    assert np.array_equal(run.position, expected["position"])
    assert np.array_equal(run.velocity, expected["velocity"] * 60)


@with_fma
def test_thirty_explicit_balls_equal_the_article_s_program() -> None:
    expected = np.load(TRACES / "seed3_n30.npz")
    balls = [
        f"radius = 20\nposition = {x.tolist()}\nvelocity = {(v * 60).tolist()}"
        for x, v in zip(expected["position"][0], expected["velocity"][0], strict=True)
    ]
    run = simulate(scene_of(*balls), "article", steps=len(expected["position"]) - 1)
    assert np.array_equal(run.position, expected["position"])
    assert np.array_equal(run.velocity, expected["velocity"] * 60)


@settings(max_examples=30)
@given(
    seed=st.integers(0, 10**6),
    count=st.integers(1, 25),
    radius=st.one_of(st.integers(1, 60), st.floats(0.5, 60)),
    width=st.integers(200, 1500),
    height=st.integers(200, 1500),
)
def test_equals_a_plain_python_transcription(seed: int, count: int, radius: float, width: int, height: int) -> None:
    rng = np.random.default_rng(seed)
    low, high = np.full(2, radius), np.array([width, height]) - radius
    x = rng.uniform(low, high, (count, 2))
    v = rng.normal(0, 300, (count, 2))
    groups = [f"radius = {radius}\nposition = {a.tolist()}\nvelocity = {b.tolist()}" for a, b in zip(x, v, strict=True)]
    scene = scene_of(*groups, size=f"[{width}, {height}]")
    run, plain = simulate(scene, "article", steps=120), PlainArticle(scene)
    for step in range(1, 121):
        plain.step()
        assert np.array_equal(run.position[step], [(ball.x, ball.y) for ball in plain.balls])
        assert np.array_equal(run.velocity[step], np.multiply([(ball.vx, ball.vy) for ball in plain.balls], 60))


def test_the_article_s_gas_cools_and_pymunk_s_does_not() -> None:
    scene = load("article").changed(seconds=50.0)
    runs = compare(scene, ["pymunk", "article"]).runs
    assert runs["article"].figures.energy_ratio == pytest.approx(3.2488859649910173 / 46, rel=1e-14)
    assert runs["pymunk"].figures.energy_ratio == pytest.approx(1, abs=1e-3)


@pytest.mark.parametrize(("radius", "restitution"), [(0.5, 3.0), (1, 1.0), (2, 0.0), (20, -0.9)])
def test_a_contact_has_restitution_2_over_r_less_1(radius: float, restitution: float) -> None:
    """Two balls approach at 60 px/s, one px a frame, and touch in the first."""
    apart = 2 * radius + 0.5
    scene = scene_of(ball_at(300, 300, vx=60, radius=radius), ball_at(300 + apart, 300, radius=radius))
    engine, [contact] = recorded("article", scene, 1)
    before, after = 60.0, np.diff(engine.state().velocity[:, 0])[0]
    assert after / before == pytest.approx(restitution, abs=1e-12)
    assert (contact["first"], contact["second"], contact["time"]) == (0, 1, 1 / 60)
    assert contact["normal"].tolist() == [1, 0]
    assert contact["impulse"] == pytest.approx(2 * 60 / (2 * radius))
    assert contact["depth"] == pytest.approx(0.5)


def test_a_wall_discards_the_overshoot_and_reverses_a_ball_that_already_leaves() -> None:
    scene = scene_of("radius = 20\nposition = [22, 300]\nvelocity = [-300, 0]")  # 5 px a frame, 2 px from the wall
    engine, [bounce] = recorded("article", scene, 1)
    assert engine.state().position.tolist() == [[20, 300]]
    assert engine.state().velocity.tolist() == [[300, 0]]
    engine.kick(0, (-300.0, 0.0))  # it stays where it is, on the wall
    engine.step()
    engine.kick(0, (30.0, 0.0))
    [rest] = engine.contacts()
    assert (~bounce["second"], bounce["impulse"], bounce["depth"]) == (0, 600, 3)
    assert (~rest["second"], rest["impulse"]) == (0, 0)


def test_coincident_balls_part_along_x() -> None:
    scene = scene_of("radius = 20\nposition = [300, 300]", "radius = 20\nposition = [300, 300]")
    engine = create("article", scene, spawn(scene))
    engine.step()
    assert engine.state().position.tolist() == [[320, 300], [280, 300]]


BALL = "radius = 20\nposition = [100, 100]"


@pytest.mark.parametrize(
    ("balls", "more", "named"),
    [
        ([BALL], "gravity = [0, 900]", "gravity is not"),
        ([BALL, "radius = 10\nposition = [300, 300]"], "", "a second radius is not"),
        ([BALL, "radius = 20\nmass = 2\nposition = [300, 300]"], "", "a second mass is not"),
        ([BALL + "\nelasticity = 0.9"], "", "elasticity below 1 is not"),
        ([BALL + "\nfriction = 0.5"], "", "friction is not"),
        ([BALL + "\nspin = 1"], "", "spin is not"),
        ([BALL + "\nfilter = { group = 1 }"], "", "a filter is not"),
        ([BALL], "pegs = [{ radius = 9, positions = [[200, 300]] }]", "an inner wall is not"),
        ([BALL], "walls = [{ from = [200, 300], to = [300, 300] }]", "an inner wall is not"),
        ([BALL + "\nfriction = 0.5"], "gravity = [0, 1]", "gravity and friction are not"),
        (
            [BALL, "radius = 9\nmass = 2\nposition = [300, 300]"],
            "gravity = [0, 1]",
            "gravity, a second radius and a second mass are not",
        ),
    ],
)
def test_what_the_article_does_not_model_is_refused_by_name(balls: list[str], more: str, named: str) -> None:
    scene = scene_of(*balls, more=more)
    with pytest.raises(Refused, match=f"^article: {named} part of the article's rule; use --engines impulse$"):
        create("article", scene, spawn(scene))
