"""What a comparison comes to: a few lines for each engine, and the rows of its table."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from conftest import ball_at, scene_of

from sandbox.analysis.comparison import Comparison, compare
from sandbox.analysis.figures import Run
from sandbox.analysis.reference import Trust
from sandbox.analysis.verdict import key_figures, percent, summaries, verdict
from sandbox.judge.causes import Cause, Entry
from sandbox.judge.summary import CauseOfError
from sandbox.report.tables import comparison_rows
from sandbox.run.edits import SetVelocity
from sandbox.scene.files import load

TIED = scene_of(ball_at(100, 300, vx=200), ball_at(300, 279), ball_at(300, 321), more="seconds = 2")


def lines(comparison: Comparison, engine: str) -> tuple[str, ...]:
    """Return what is said of an engine, nothing if it is not named."""
    return summaries(comparison).get(engine, ())


def changed(comparison: Comparison, engine: str, **changes: Any) -> Comparison:
    """Return a comparison with another run of an engine."""
    run = replace(comparison.runs[engine], **changes)
    return replace(comparison, runs=comparison.runs | {engine: run})


def with_causes(*causes: tuple[Cause, float]) -> Comparison:
    """Return a comparison in which Pymunk has three contacts of each of some causes, with these shares of its error."""
    comparison = compare(load("head-on").changed(seconds=1.0), ["pymunk", "exact"])
    listed = tuple(CauseOfError(cause, 3, share, None, f"Fault {k}.") for k, (cause, share) in enumerate(causes))
    return changed(comparison, "pymunk", causes=listed)


def test_the_worst_engine_comes_first_and_each_has_its_energy_its_causes_and_until_when_it_agrees() -> None:
    comparison = compare(load("article"), ["pymunk", "article", "impulse", "exact"])
    assert list(summaries(comparison)) == ["article", "pymunk", "impulse"]
    energy, cause, *_, until = lines(comparison, "article")
    assert energy == "58.4 % of the energy is missing."
    assert cause.startswith("24 contacts: the impulse is 0.05 of what is due")
    apart = comparison.runs["article"].apart
    assert apart is not None
    assert until == f"Within a ball's radius of exact until {apart:.2f} s."
    gap = comparison.runs["article"].gap_max
    assert gap[round(apart * 60)] > 20 >= gap[round(apart * 60) - 1]
    assert lines(comparison, "pymunk")[0] == "Energy as it should be."


def test_paths_that_agree_to_the_end_are_reported() -> None:
    comparison = compare(load("oblique"), ["pymunk", "exact"])
    assert "Within a ball's radius of exact to the end." in lines(comparison, "pymunk")


def test_what_comes_after_the_horizon_is_said_once() -> None:
    comparison = compare(load("gas-100").changed(seconds=5.0), ["pymunk", "impulse", "exact"])
    assert f"From {comparison.trust.horizon:.2f} s on, compare statistics only: " in lines(comparison, "exact")[0]
    assert verdict(comparison).count("statistics only") == 1


def test_at_most_three_causes_are_said_and_only_the_first_below_a_hundredth() -> None:
    shares = (0.5, 0.3, 0.1, 0.05)
    said = lines(with_causes(*((Cause.SMALL, share) for share in shares)), "pymunk")
    assert [line for line in said if "fault" in line] == [f"3 contacts: fault {k}." for k in range(3)]
    said = lines(with_causes((Cause.SMALL, 0.009), (Cause.LARGE, 0.008)), "pymunk")
    assert [line for line in said if "fault" in line] == ["3 contacts: fault 0."]


def test_an_error_without_a_cause_is_said_with_its_share_and_flights_are_counted_in_steps() -> None:
    said = lines(with_causes((Cause.UNKNOWN, 0.6), (Cause.GRAVITY, 0.395), (Cause.SMALL, 0.005)), "pymunk")
    assert "60 % of its error fits no single cause." in said
    assert any(line.startswith("3 steps of a ball: fault 1.") for line in said)
    assert not any("fault 2" in line for line in said)


def test_several_contacts_at_once_are_not_said_to_fit_no_cause() -> None:
    comparison = compare(load("newtons-cradle").changed(seconds=3.0), ["article", "exact"])
    said = lines(comparison, "article")
    assert any(
        line.endswith("of its error is in steps with several contacts at once, which are not judged.") for line in said
    )
    assert not any("single cause" in line for line in said)


def test_an_error_in_energy_that_shrinks_is_said_to_be_the_worst() -> None:
    """Pymunk's balls of `bouncing` have most too much in the air, and little at the end."""
    comparison = compare(load("bouncing").changed(seconds=5.0), ["pymunk", "exact"])
    run = comparison.runs["pymunk"]
    assert run.figures.energy_error is not None
    worst, end = percent(run.figures.energy_error), percent(run.energy_gap[-1])
    assert lines(comparison, "pymunk")[0] == f"{worst} too much energy at worst; {end} too much energy in the end."
    assert 0 < run.energy_gap[-1] < 0.9 * run.figures.energy_error
    known = np.where(comparison.time < comparison.time[-1], run.energy_gap, np.nan)
    assert lines(changed(comparison, "pymunk", energy_gap=known), "pymunk")[0].endswith(" too much energy then.")


def test_a_remedy_is_said_once_and_only_of_pymunk() -> None:
    comparison = compare(load("oblique"), ["pymunk(substeps=2)", "pymunk", "impulse", "exact"])
    assert all(run.causes[0].cause == Cause.LATE for run in comparison.others.values())
    assert verdict(comparison).count("More steps a second, or substeps, find them sooner.") == 1
    assert "More steps" not in verdict(compare(load("oblique"), ["impulse", "exact"]))


def with_energies(gap: float) -> Comparison:
    """Return a comparison in which Pymunk began with 100 kg px²/s² and is `gap` per cent off after a step."""
    comparison = compare(load("head-on").changed(seconds=1 / 60), ["pymunk", "exact"])
    energy, energy_gap = np.array([100.0, 100.0 + gap]), np.array([0.0, gap / 100])
    return changed(comparison, "pymunk", energy=energy, energy_scale=100.0, energy_gap=energy_gap)


def test_an_energy_error_has_either_sign_and_float32_rounding_is_none() -> None:
    said = {gap: lines(with_energies(gap), "pymunk")[0] for gap in (0.9e-4, 1.1e-4, -3.0, 250.0)}
    assert said == {
        0.9e-4: "Energy as it should be.",
        1.1e-4: "0.00011 % too much energy.",
        -3.0: "3 % of the energy is missing.",
        250.0: "250 % too much energy.",
    }


def test_a_bounce_one_step_late_is_no_error_in_energy() -> None:
    """In `bouncing` the impulse engine bounces up to a step after exact, which has lost a third by then."""
    comparison = compare(load("bouncing"), ["impulse", "exact"])
    energy, right = (comparison.runs[name].energy for name in ("impulse", "exact"))
    assert np.abs(energy - right).max() > 0.3 * right[0]
    error = comparison.runs["impulse"].figures.energy_error
    assert error is not None
    assert error < 0.01


def test_energy_lost_to_the_scene_s_elasticity_is_no_error() -> None:
    scene = scene_of(ball_at(100, 300, vx=400, elasticity=0.5)).changed(seconds=3.0)
    run = compare(scene, ["pymunk", "exact"]).runs["pymunk"]
    assert run.figures.energy_ratio == pytest.approx(0.25)
    assert run.figures.energy_error == pytest.approx(0)


def test_a_single_engine_is_measured_against_nothing_and_its_steps_are_judged() -> None:
    alone = compare(load("head-on"), ["exact"])
    assert verdict(alone) == "exact: Only exact took part, so nothing is measured against it."
    said = lines(compare(load("head-on"), ["pymunk"]), "pymunk")
    assert said[0] == "Only pymunk took part, so nothing is measured against it; exact would be a reference."
    assert any("found late" in line for line in said)
    assert not any(line.startswith("Energy") for line in said)


def test_engines_apart_from_the_start_do_not_agree_to_the_end() -> None:
    """The edit comes when the article's balls are far from exact's."""
    inputs = [SetVelocity(step=180, ball=0, velocity=(60, 0))]
    comparison = compare(load("article").changed(seconds=6.0), ["article", "exact"], inputs=inputs)
    run = comparison.runs["article"]
    assert run.apart == 0.0
    said = lines(comparison, "article")
    assert "Begins more than a ball's radius from exact, so their paths cannot be compared." in said
    assert "Within" not in " ".join(said)


def test_from_a_tie_on_no_engine_is_accused_of_its_paths() -> None:
    comparison = compare(TIED, ["pymunk", "exact"])
    assert "Within a ball's radius of exact until 0.83 s, as long as paths can be compared." in lines(
        comparison, "pymunk"
    )
    [said] = lines(comparison, "exact")
    assert said.startswith("From 0.83 s on, compare statistics only: several contacts come at the same time")
    labels = [label for label, *_ in key_figures(comparison) if "until" in label]
    assert labels == ["RMS gap until 0.83 s", "largest gap until 0.83 s"]


def test_a_stepped_reference_whose_answer_depends_on_numbers_is_undecided() -> None:
    said = lines(compare(TIED, ["exact", "impulse"], against="impulse"), "impulse")
    assert any("several contacts fall into one step, and no law says which comes first" in line for line in said)


def test_an_engine_that_is_right_where_the_reference_is_wrong_is_not_accused() -> None:
    said = lines(compare(load("article").changed(seconds=2.0), ["exact", "article"], against="article"), "exact")
    assert any(line.startswith("No step of it is wrong: ") for line in said)


def heap(comparison: Comparison) -> Comparison:
    """Return a comparison whose reference is unresolved from half a second on."""
    return replace(comparison, trust=Trust(unresolved=0.5))


def test_figures_of_energy_stop_where_a_heap_makes_them_meaningless() -> None:
    comparison = compare(load("bouncing").changed(seconds=1.0), ["pymunk", "exact"])
    rows = {label: values for label, *values in comparison_rows(heap(comparison))}
    change = 100 * float(comparison.runs["pymunk"].energy_change[30])
    assert rows["energy change until 0.50 s"][0] == f"{change:+.3g} %"
    assert not any(label.startswith("energy: ") for label in rows)
    assert any(label.startswith("energy: ") for label, *_ in comparison_rows(comparison))


def test_rows_of_zeros_are_left_out() -> None:
    labels = [label for label, *_ in comparison_rows(compare(load("head-on"), ["pymunk", "exact"]))]
    assert "escaped balls" not in labels
    assert "energy change" not in labels
    assert {"RMS gap", "ball contacts", "first difference"} <= set(labels)


def test_balls_that_fly_through_each_other_within_a_step_are_counted() -> None:
    """They overlap for 2 √(8² - 1²) / 2400 s = 6.6 ms, and a step, in which each flies 20 px, has 16.7 ms."""
    balls = ball_at(50, 150, vx=1200, radius=4), ball_at(350, 151, vx=-1200, radius=4)
    comparison = compare(scene_of(*balls, size="[400, 300]", more="seconds = 0.25"), ["pymunk", "exact"])
    first = comparison.runs["pymunk"].figures.first_difference
    assert first is not None
    assert first.cause == Cause.MISSED
    assert ["missed contacts", "1", "0"] in list(key_figures(comparison))


def test_soft_contacts_are_not_judged_and_one_sentence_says_so() -> None:
    comparison = compare(load("head-on").changed(seconds=1.0), ["pymunk", "exact"])
    soft = changed(comparison, "pymunk", ledger=(Entry(Cause.SOFT, 1, 1.0, 0.0, 0.0),))
    assert "Its contacts are soft and last several steps, so they are not judged." in lines(soft, "pymunk")


def test_an_engine_without_spins_in_a_scene_with_friction_has_one_sentence_on_it() -> None:
    scene = scene_of(
        ball_at(100, 300, vx=300, vy=140, friction=0.5), size="[800, 600]\nfriction = 1", more="seconds = 4"
    )

    def step(position: np.ndarray, velocity: np.ndarray, dt: float, scene: Any) -> None:
        position += velocity * dt
        velocity[(position > [780, 580]) | (position < 20)] *= -1

    said = lines(compare(scene, {"mine": step, "exact": "exact"}), "mine")
    assert len([line for line in said if "reports no spins" in line]) == 1
    assert "no spins" not in verdict(compare(scene, ["pymunk", "exact"]))


def test_causes_are_in_json_and_in_python_with_their_shares() -> None:
    comparison = compare(load("article"), ["pymunk", "article", "exact"])
    run: Run = comparison.runs["article"]
    causes = comparison.as_json()["engines"]["article"]["causes"]
    assert [set(each) for each in causes] == [{"cause", "contacts", "share", "parameter", "sentence"}] * len(causes)
    assert [each["cause"] for each in causes] == [each.cause.key for each in run.figures.causes]
    assert causes[0]["cause"] == "small"
    assert causes[0]["parameter"] == pytest.approx(1 / 20)
    assert sum(each["share"] for each in causes) == pytest.approx(1)
    assert not any("causes" in column for column in comparison.rows()[0])
