"""The order of convergence: errors in closed form, fits of known orders, and what theory expects."""

import json
from pathlib import Path

import numpy as np
import pytest
from conftest import Command, scene_of

from sandbox.report.trajectory import simulate
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.sweeps.convergence import Convergence, Law, converge, law_of

RATES = (60, 120, 240)
GRAVITY = 900.0
EULER = f"""
def step(position, velocity, dt, scene):
    position += velocity * dt
    velocity[:, 1] += {GRAVITY} * dt
"""


def falling() -> Scene:
    return scene_of("radius = 5\nposition = [100, 50]", more=f"gravity = [0, {GRAVITY}]\nseconds = 0.2")


def of_errors(errors: np.ndarray) -> Convergence:
    return Convergence(falling(), RATES, {"mine": errors}, {"mine": Law(None, "it is a test")}, "")


@pytest.mark.parametrize("engine", ["pymunk", "euler"])
def test_the_error_of_euler_s_method_in_free_fall_is_that_of_its_closed_form(engine: str, tmp_path: Path) -> None:
    """x += v dt, then v += g dt: after n steps, the ball is g dt² n (n - 1) / 2 further and not g (n dt)² / 2."""
    (tmp_path / "euler.py").write_text(EULER)
    name = engine if engine == "pymunk" else f"{tmp_path / 'euler.py'}:step"
    measured = converge(falling(), [name], RATES, starts=2)
    for rate, errors in zip(RATES, measured.errors[name], strict=True):
        n = np.arange(1, round(0.2 * rate))
        expected = np.sqrt(np.mean((GRAVITY * n / rate / rate / 2) ** 2))
        assert errors == pytest.approx([expected] * 2, rel=1e-9)
    fit = measured.fit(name)
    assert fit.order == pytest.approx(1, abs=0.05)
    assert measured.laws[name].order == (1 if engine == "pymunk" else None)


@pytest.mark.parametrize("order", [0, 1, 2, 4])
def test_a_power_law_is_fitted_exactly(order: int) -> None:
    errors = 4.0 * (60 / np.array(RATES)[:, None]) ** float(order) * np.array([0.5, 1, 1.5])
    fit = of_errors(errors).fit("mine")
    assert fit.why_none == ""
    assert fit[:2] == pytest.approx((order, 0), abs=1e-9)


def test_the_spread_is_the_standard_error_of_the_slope() -> None:
    """Logarithms base 2 of -0, -1 + d, -2 have the slope 1 and the residuals d/3, -2d/3, d/3: (d²·6/9 / 1 / 2)^½."""
    fit = of_errors(np.array([[1.0], [0.5 * 2**0.3], [0.25]])).fit("mine")
    assert fit[:2] == pytest.approx((1, np.sqrt(0.3**2 * 6 / 9 / 2)), rel=1e-9)


@pytest.mark.parametrize(
    ("errors", "why"),
    [
        ((141.0, 112.0, 130.0), "the errors are not small, but a ball's radius or more; try fewer seconds"),
        ((0.0205, 0.03, 0.0197), "the errors do not shrink steadily; try fewer seconds, or more starts"),
    ],
)
def test_errors_that_are_large_or_scatter_have_no_order(errors: tuple[float, ...], why: str) -> None:
    measured = of_errors(np.array(errors)[:, None])
    assert measured.fit("mine") == (None, None, why)
    assert list(measured.table())[-2] == ["order", "none"]
    assert list(measured.sentences()) == [f"mine: no order: {why}; no order is expected, because it is a test."]
    assert measured.as_json()["engines"]["mine"]["why_none"] == why


def test_it_says_why_runs_were_cut_short() -> None:
    measured = converge(load("gas-100").changed(seconds=4.0), ["impulse"], (60, 120, 240), starts=1)
    assert measured.scene.seconds < 4
    first, *_ = measured.sentences()
    assert first.startswith(f"The runs end at {measured.scene.seconds:.3g} s: by then, shifting balls by some units")


def test_runs_end_before_the_step_whose_contacts_no_law_decides() -> None:
    """Two balls are hit at once: up to there, `impulse` flies as `exact` does; from there on, it decides otherwise."""
    target = "radius = 20\nposition = [300, {}]".format
    thrown = "radius = 20\nposition = [100, 300]\nvelocity = [200, 0]"
    measured = converge(scene_of(thrown, target(279), target(321), more="seconds = 2"), ["impulse"], (60, 240, 960), 1)
    assert measured.errors["impulse"].max() < 1e-9


def test_rounding_has_no_order() -> None:
    alone = scene_of("radius = 5\nposition = [100, 100]\nvelocity = [20, 30]", more="seconds = 0.2")
    measured = converge(alone, ["impulse"], RATES, starts=2)
    assert measured.fit("impulse").why_none == "only rounding is left"
    assert list(measured.table())[-2:] == [["order", "none"], ["by theory", "2"]]


@pytest.mark.parametrize(("engine", "order"), [("pymunk", 1), ("impulse", 2)])
def test_a_wall_whose_delay_is_corrected_gives_order_two(engine: str, order: int) -> None:
    measured = converge(load("bouncing").changed(seconds=1.2), [engine], (60, 120, 240, 480), starts=3)
    fit = measured.fit(engine)
    assert measured.laws[engine].order == order
    assert fit.order == pytest.approx(order, abs=0.15)


def test_shifted_starts_average_out_the_phase_of_the_contact() -> None:
    """Head on against a wall at v, a contact found s late puts the ball 2 v s off: over the phases, 0 to 2 v dt."""
    scene = scene_of("radius = 5\nposition = [100, 100]\nvelocity = [-400, 0]", more="seconds = 0.4")
    measured = converge(scene, ["pymunk"], (60, 120, 240, 480), starts=8)
    fit = measured.fit("pymunk")
    assert fit.order == pytest.approx(1, abs=0.1)
    largest = measured.errors["pymunk"].max(axis=1)
    assert (largest < 2 * 400 / np.array(measured.rates)).all()
    assert np.ptp(measured.errors["pymunk"], axis=1).min() > 0.4 * largest.min()


def test_theory_expects_no_convergence_where_an_engine_has_another_limit() -> None:
    cradle = converge(load("newtons-cradle").changed(seconds=1.0), ["article"], (30, 60, 120), starts=1)
    assert cradle.laws["article"].order == 0


def test_the_law_depends_on_what_the_balls_touch() -> None:
    """A ball that meets the straight side of a wall, and one that meets its round end."""
    ball = "radius = 5\nposition = [{}, 100]\nvelocity = [0, 200]"
    wall = "\n[[walls]]\nfrom = [50, 150]\nto = [150, 150]"
    for x, order in ((100, None), (153, None)):
        scene = scene_of(ball.format(x) + wall, more="seconds = 0.4")
        contacts = simulate(scene, "exact").contacts
        assert len(contacts)
        assert law_of("impulse", scene, contacts).order == order
        assert law_of("pymunk", scene, contacts).order == 1
        assert law_of("pymunk(damping=0.5)", scene, contacts).order == 0


def test_the_command_prints_or_writes(command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("fall.toml").write_text(falling().source)
    code, out, _ = command("converge", "fall.toml", "--rates", "60,120,240", "--starts", "2", "--json", "-")
    figures = json.loads(out)
    assert (code, figures["rates"], list(figures["engines"])) == (0, [60, 120, 240], ["pymunk", "impulse"])
    assert figures["engines"]["pymunk"]["expected"] == 1
    assert np.shape(figures["engines"]["pymunk"]["errors"]) == (3, 2)
    code, out, err = command("converge", "fall.toml", "--rates", "60,120", "--json", "figures.json")
    assert (code, out) == (2, "")
    assert err == "rates: an order needs at least 3 rates, such as 60,120,240, got 2\n"
    assert not Path("figures.json").exists()
