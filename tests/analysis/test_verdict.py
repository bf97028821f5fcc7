"""What a comparison comes to."""

import re
from dataclasses import replace

import numpy as np
import pytest
from conftest import numbers_in, scene_of

from sandbox.analysis.comparison import compare
from sandbox.analysis.figures import Run
from sandbox.analysis.reference import Trust
from sandbox.analysis.verdict import key_figures, mark_words, reference_words, trust_words, verdict
from sandbox.judge.causes import Cause, Entry
from sandbox.judge.timeline import Suffered
from sandbox.run.edits import SetVelocity
from sandbox.scene.files import load


def test_it_says_how_long_each_engine_agrees_and_what_the_largest_error_is() -> None:
    comparison = compare(load("article"), ["pymunk", "article", "impulse", "exact"])
    until = {name: run.apart for name, run in comparison.runs.items()}
    gap = comparison.runs["pymunk"].gap_max
    assert until["pymunk"] is not None
    assert gap[round(until["pymunk"] * 60)] > 20 >= gap[round(until["pymunk"] * 60) - 1]
    said = verdict(comparison).split("\n\n")[1]
    assert said.startswith(
        "In impulse, every ball stays within its radius of exact until 1.42 s, in pymunk until 1.08 s, in article "
        "until 0.88 s. "
    )
    found = re.search(
        r"error is article's: at ([\d.]+) s it has 58.4 % of the energy less .*impulse too small",
        said,
    )
    assert found
    energy = comparison.runs["article"].energy
    last = float(found[1])  # of the contacts that take energy
    assert energy[round(last * 60)] == pytest.approx(energy[-1], rel=1e-6)
    assert energy[round(last * 60) - 2] > 1.000001 * energy[-1]
    assert "For pymunk, a higher rate" in said
    assert "compare statistics only" not in said


def test_beyond_the_horizon_it_recommends_statistics() -> None:
    comparison = compare(load("gas-100").changed(seconds=5.0), ["impulse", "exact"])
    assert f"After {comparison.horizon:.2f} s compare statistics only: " in verdict(comparison)


def test_paths_that_agree_to_the_end_are_reported() -> None:
    comparison = compare(load("oblique"), ["pymunk", "exact"])
    near = "In pymunk, every ball stays within its radius of exact to the end at 3 s"
    assert verdict(comparison).split("\n\n")[1].startswith(f"{near}.")
    said = verdict(compare(load("oblique"), ["pymunk", "article", "exact"])).split("\n\n")[1]
    assert said.startswith(f"{near}, in article until 1.07 s.")


@pytest.mark.parametrize("scene", ["head-on", "truths/bounce-half", "truths/cradle-touching"])
def test_the_verdict_and_the_table_have_the_same_expectations_missed(scene: str) -> None:
    """A ball may be within its radius of the reference, and further off than an expectation allows."""
    comparison = compare(load(scene), ["pymunk", "impulse", "exact"])
    said = verdict(comparison)
    missed = {
        name: (int(count), int(whole)) for count, whole, name in re.findall(r"(\d+) of (\d+) in (\w+), in ", said)
    }
    table = {name: (run.figures.met, run.figures.expected) for name, run in comparison.runs.items()}
    assert missed == {name: (whole - met, whole) for name, (met, whole) in table.items() if met < whole}
    assert missed
    assert "agree" not in said


def test_the_worst_of_the_expectations_missed_is_named() -> None:
    """Both balls meet 1 px into a step, and Pymunk lets them fly on to its end: 1/120 s at 200 px/s."""
    comparison = compare(load("head-on"), ["pymunk", "exact"])
    run = comparison.runs["pymunk"]
    assert run.apart is None
    worst = max((deviation for score in run.scores for deviation in score.deviations), key=lambda one: one.error)
    assert f"in {worst.quantity.label} by up to {worst.error:.2g} " in verdict(comparison)


def test_engines_that_agree_equally_long_are_named_together() -> None:
    said = verdict(compare(load("head-on").changed(seconds=1.6), ["article", "pymunk", "impulse", "exact"]))
    paths = said.split("\n\n")[1]
    assert paths.startswith("In pymunk and impulse, ")
    assert "to the end at 1.6 s, in article until 1.50 s." in paths


def with_energies(run: Run, gap: float, **lines: float) -> Run:
    """Return a run that began with 100 kg px²/s² and is `gap` per cent off, with these lines in its ledger."""
    ledger = tuple(Entry(cause, 1, lines[cause.key], 0.0, 0.0) for cause in Cause if cause.key in lines)
    energy, energy_gap = np.array([100.0, 100.0 + gap]), np.array([0.0, gap / 100])
    return replace(run, energy=energy, energy_scale=100.0, energy_gap=energy_gap, ledger=ledger)


def said_of(**runs: tuple[float, dict[str, float]]) -> str:
    """Return the verdict on engines with some energy errors (%) and lines in their ledgers, after one step."""
    comparison = compare(load("head-on").changed(seconds=1 / 60), [*runs, "exact"])
    changed = {name: with_energies(comparison.runs[name], gap, **lines) for name, (gap, lines) in runs.items()}
    return verdict(replace(comparison, runs=comparison.runs | changed))


def test_float32_rounding_is_no_energy_error() -> None:
    assert "energy" not in said_of(pymunk=(0.9e-4, {"late": 0.9e-4}))
    assert "has 0.00011 % of the energy more than exact, mostly through" in said_of(pymunk=(1.1e-4, {"late": 1.1e-4}))


def test_the_largest_error_has_either_sign_and_its_cause_the_same_sign() -> None:
    said = said_of(pymunk=(-3.0, {"gravity": 9.0, "late": -8.0, "stale": -4.0}), impulse=(2.0, {"pushed": 2.0}))
    assert (
        "The largest energy error is pymunk's: at 0.02 s it has 3 % of the energy less than exact, mostly "
        "through “found late”."
    ) in said


def test_a_cause_is_named_only_if_the_ledger_explains_the_error() -> None:
    """Else a part of it that others cancel, or an error after the time in which the reference counts, is named."""
    assert "than exact." in said_of(pymunk=(-3.0, {"late": -8.0}))
    assert "than exact." in said_of(pymunk=(-0.025, {"gravity": 1500.0, "unconverged": -1500.025}))
    assert "than exact." in said_of(pymunk=(-3.0, {"late": -1.0, "stale": -1.0, "pushed": -1.0}))
    assert "through “found late”" in said_of(pymunk=(-3.0, {"late": -2.9}))


def test_energy_that_the_scene_takes_is_named_first() -> None:
    """A ball between two walls keeps 0.8² at every bounce."""
    scene = scene_of("radius = 20\nelasticity = 0.8\nposition = [100, 300]\nvelocity = [2000, 0]")
    comparison = compare(scene.changed(seconds=2.0), ["exact"])
    bounces = comparison.runs["exact"].figures.wall_contacts
    assert bounces == 3
    assert (
        f"By 2.00 s, {100 * (1 - 0.64**bounces):.3g} % of the energy is rightly lost: an elasticity of 0.8 leaves "
        "0.8 x 0.8 = 0.64 of the energy of approach at every bounce."
    ) in verdict(comparison)
    mixed = scene_of(
        "radius = 20\nelasticity = 0.8\nposition = [100, 300]\nvelocity = [200, 0]",
        "radius = 20\nposition = [400, 300]",
    )
    said = verdict(compare(mixed.changed(seconds=2.0), ["impulse", "exact"]))
    assert "rightly lost: through the scene's elasticity." in said


def test_more_than_all_of_the_scale_can_be_lost_where_balls_fall_again_and_again() -> None:
    said = verdict(compare(load("truths/off-an-edge"), ["exact"]))
    assert " % of the scale of energy is rightly lost" in said


def test_a_bounce_one_step_late_is_no_error_in_energy() -> None:
    """In `bouncing` the impulse engine bounces up to a step after exact, which has lost a third by then."""
    comparison = compare(load("bouncing"), ["impulse", "exact"])
    energy, right = (comparison.runs[name].energy for name in ("impulse", "exact"))
    assert np.abs(energy - right).max() > 0.3 * right[0]
    error = comparison.runs["impulse"].figures.energy_error
    assert error is not None
    assert error < 0.01


def test_no_sentence_has_more_energy_lost_or_gained_than_there_is_a_difference() -> None:
    """A ball at rest on the floor: in the ledger, gravity's work and what the floor takes may come to any number."""
    scene = scene_of("radius = 20\nelasticity = 0.5\nposition = [100, 550]", more="gravity = [0, 900]\nseconds = 10")
    comparison = compare(scene, ["pymunk", "impulse", "exact"])
    said = verdict(comparison)
    worst = max(run.figures.energy_error or 0.0 for run in comparison.runs.values())
    named = [float(share) for share in re.findall(r"it has ([\d.e-]+) % of the energy", said)]
    assert named == [pytest.approx(100 * worst, rel=0.01)]


def test_a_single_engine_is_measured_against_nothing() -> None:
    alone = compare(load("head-on"), ["exact"])
    assert verdict(alone) == "Only exact took part, so nothing is measured against it."
    assert reference_words(alone) == "no chaos within the run"
    assert (
        verdict(compare(load("head-on"), ["pymunk"]))
        .split("\n\n")[1]
        .startswith(
            "Only pymunk took part, so nothing is measured against it; --engines pymunk,exact has a reference. "
            "Expectations missed: 2 of 2 in pymunk, "
        )
    )


def test_engines_apart_from_the_start_do_not_agree_to_the_end() -> None:
    """The edit comes when the article's balls are far from exact's."""
    inputs = [SetVelocity(step=180, ball=0, velocity=(60, 0))]
    comparison = compare(load("article").changed(seconds=6.0), ["article", "exact"], inputs=inputs)
    run = comparison.runs["article"]
    assert run.apart == 0.0
    said = verdict(comparison).split("\n\n")[1]
    assert said.startswith(
        f"At the start, balls are elsewhere than in exact: in article up to {run.gap_max[0]:.4g} px. "
    )
    assert "within its radius" not in said


TIED = scene_of(
    "radius = 20\nposition = [100, 300]\nvelocity = [200, 0]",
    "radius = 20\nposition = [300, 279]",
    "radius = 20\nposition = [300, 321]",
    more="seconds = 2",
)


def test_from_a_tie_on_no_engine_is_accused_of_its_paths() -> None:
    comparison = compare(TIED, ["pymunk", "exact"])
    assert trust_words(comparison) == "undecided from 0.83 s"
    step, paths = verdict(comparison).split("\n\n")
    assert numbers_in(step)[-3:] == [3.55, 0.603, 0.54]
    assert "up to 0.83 s, where exact is undecided. exact is undecided from 0.83 s: balls 1 and 2 touch ball 0" in paths
    assert "From then on compare statistics only." in paths
    assert numbers_in(mark_words(comparison)) == [0.83]
    assert [label for label, *_ in key_figures(comparison) if label.endswith("*")] == ["RMS gap *", "largest gap *"]


def test_balls_that_fly_through_each_other_within_a_step_have_a_remedy() -> None:
    """They overlap for 2 √(8² - 1²) / 2400 s = 6.6 ms, and a step, in which each flies 20 px, has 16.7 ms."""
    balls = (
        "radius = 4\nposition = [50, 150]\nvelocity = [1200, 0]",
        "radius = 4\nposition = [350, 151]\nvelocity = [-1200, 0]",
    )
    comparison = compare(scene_of(*balls, size="[400, 300]", more="seconds = 0.25"), ["pymunk", "exact"])
    first = comparison.runs["pymunk"].figures.first_difference
    assert first is not None
    assert first.cause == Cause.MISSED
    assert numbers_in(first.because) == [6.61, 20]
    assert "For pymunk, a higher rate" in verdict(comparison)


def test_remedies_are_named_for_each_pymunk_with_its_settings() -> None:
    scene = load("oblique")
    comparison = compare(scene, ["pymunk(substeps=2)", "pymunk", "exact"])
    assert (
        "For pymunk(substeps=2) and pymunk, a higher rate, or more substeps, finds contacts sooner. --advise tries "
        "that and more."
    ) in verdict(comparison)
    alone = compare(scene, ["pymunk(substeps=2)", "exact"])
    assert "For pymunk(substeps=2), a higher rate" in verdict(alone)


def test_a_tie_names_the_ball_with_two_contacts() -> None:
    """Ball 0 hits a row of touching balls: ball 1 is hit, and hits ball 2, at the same time."""
    row = "radius = 10\nelasticity = 0.7\npositions = [[100, 150], [200, 150], [220, 150], [240, 150]]"
    scene = scene_of(f"{row}\nvelocities = [[150, 0], [0, 0], [0, 0], [0, 0]]", more="seconds = 1")
    assert "balls 0 and 2 touch ball 1 at the same time" in verdict(compare(scene, ["pymunk", "exact"]))


def test_a_stepped_reference_whose_answer_depends_on_numbers_is_undecided() -> None:
    said = verdict(compare(TIED, ["exact", "impulse"], against="impulse"))
    assert (
        "impulse is undecided from 0.83 s: balls 1 and 2 touch ball 0 in the same step, and the result depends on "
        "which has the lower number."
    ) in said


def test_a_heap_is_said_to_be_unresolved_and_the_reference_s_own_errors_are_named() -> None:
    comparison = compare(load("head-on"), ["pymunk", "exact"])
    line = (Entry(Cause.UNREPORTED, 1, -0.02 * float(comparison.runs["exact"].energy[0]), 0.0, 0.0),)
    exact = comparison.runs["exact"]
    heap = replace(
        comparison,
        trust=Trust(horizon=1.5, unresolved=1.2),
        runs=comparison.runs | {"exact": replace(exact, ledger=line)},
    )
    assert trust_words(heap) == "unresolved from 1.20 s"
    said = verdict(heap)
    assert "exact is not exact in this heap after 1.20 s: " in said
    assert (
        "exact is not free of errors: its own ledger has -2 % of the energy in error, mostly through “velocity changed "
        "without a contact”."
    ) in said


def test_lines_that_cancel_each_other_prove_no_error_of_the_reference() -> None:
    comparison = compare(load("head-on"), ["pymunk", "exact"])
    exact = comparison.runs["exact"]
    start = float(exact.energy[0])
    lines = (Entry(Cause.ELASTICITY, 1, -9 * start, 0.0, 0.0), Entry(Cause.SMALL, 1, 9 * start, 0.0, 0.0))
    runs = comparison.runs | {"exact": replace(exact, ledger=lines)}
    assert "not free of errors" not in verdict(replace(comparison, runs=runs))


def test_figures_of_energy_are_marked_too_if_the_scene_does_not_keep_it() -> None:
    comparison = compare(load("bouncing").changed(seconds=1.0), ["pymunk", "exact"])
    unresolved = replace(comparison, trust=Trust(unresolved=0.5))
    marked = [label for label, *_ in key_figures(unresolved) if label.endswith("*")]
    assert marked == ["energy left *", "largest energy change *", "RMS gap *", "largest gap *"]
    assert not any(label.endswith("*") for label, *_ in key_figures(comparison))
    assert mark_words(comparison) == ""


ROUGH = scene_of(
    "radius = 20\nfriction = 0.5\nposition = [100, 300]\nvelocity = [300, 40]",
    "radius = 20\nfriction = 0.5\nposition = [400, 310]",
    more="seconds = 2",
)


def test_an_engine_alone_is_said_to_have_exact_as_a_reference() -> None:
    assert "--engines pymunk,exact has a reference" in verdict(compare(ROUGH, ["pymunk"]))


def test_friction_and_elasticity_are_rightful() -> None:
    """A ball of 1 kg meets the top wall at 100 px/s, elasticity 0.5, and slides at 300 px/s with 0.2: friction is 30.

    Lost: (1 - 0.25) 100²/2 + 30 x 300 - 3 x 30²/2 = 11,400 of 50,000 kg px²/s².
    """
    scene = scene_of(
        "radius = 20\nfriction = 0.2\nelasticity = 0.5\nposition = [100, 100]\nvelocity = [300, -100]",
        size="[800, 600]\nfriction = 1",
        more="seconds = 1",
    )
    said = verdict(compare(scene, ["pymunk", "exact"]))
    assert "22.8 %" in said
    assert "the scene's elasticity and friction." in said


def test_box2d_is_named_with_half_of_the_friction_of_an_elastic_bounce() -> None:
    """A ball of 2 kg, with 200 kg px/s towards the wall: 2 x 0.2 of it are 80. Half of it costs less than all."""
    pytest.importorskip("pyb2d3")
    scene = scene_of(
        "radius = 20\nmass = 2\nfriction = 0.2\nposition = [100, 100]\nvelocity = [300, -100]",
        size="[800, 600]\nfriction = 1",
        more="seconds = 1",
    )
    comparison = compare(scene, ["box2d", "pymunk", "impulse", "exact"])
    one = comparison.runs["box2d"].figures.first_difference
    assert one is not None
    assert one.cause == Cause.FRICTION_SMALL
    assert one.because.startswith("Friction is limited by the impulse without restitution.")
    assert one.spin_after == pytest.approx([-40 / 20], rel=0.05)
    assert one.should_spin_after == pytest.approx([-80 / 20])
    said = verdict(comparison)
    assert "19.2 %" in said
    assert "error is box2d's" in said
    assert "“friction too small”" in said


@pytest.mark.wide
def test_statistics_name_the_worst_figure_of_theory() -> None:
    """Pymunk at 60 steps a second passes over a quarter of the contacts of a dense gas, and of its pressure."""
    comparison = compare(load("gas-dense").changed(seconds=2.5), ["pymunk", "exact"])
    rows = {row.figure: row for row in comparison.runs["pymunk"].theory}
    low = 100 * (1 - rows["contacts per second"].measured / rows["contacts per second"].expected)
    assert low > 20
    said = verdict(comparison)
    assert f"In statistics, pymunk's contacts per second are {low:.2g} % too low (Enskog); exact agrees" in said


def test_a_small_sample_accuses_no_engine() -> None:
    comparison = compare(load("gas-100").changed(seconds=4.0), ["pymunk", "impulse", "exact"])
    assert comparison.horizon is not None
    assert "pymunk and impulse and exact agree with theory" in verdict(comparison)


def test_energy_lost_to_the_scene_s_elasticity_is_no_error() -> None:
    scene = scene_of("radius = 20\nelasticity = 0.5\nposition = [100, 300]\nvelocity = [400, 0]").changed(seconds=3.0)
    run = compare(scene, ["pymunk", "exact"]).runs["pymunk"]
    assert run.figures.energy_ratio == pytest.approx(0.25)
    assert run.figures.energy_error == pytest.approx(0)


def test_what_else_is_wrong_with_a_fifth_of_an_error_is_said_and_the_worst_wrong_rule() -> None:
    comparison = compare(load("head-on"), ["pymunk", "exact"])
    shares = {"Deep.": 0.5, "Slow.": 0.2, "Late.": 0.199, "Small.": 0.0601, "Large.": 0.03, "Soft.": 0.0109}
    suffered = tuple(
        Suffered(Cause.LATE, because, 3, share, is_fault=because in ("Small.", "Large."))
        for because, share in shares.items()
    )
    run = replace(comparison.runs["pymunk"], suffered=suffered)
    said = verdict(replace(comparison, runs={**comparison.runs, "pymunk": run})).split("\n\n")[0]
    assert said.startswith(
        "pymunk, 3 times, 50 % of its error: deep. Also, 3 times, 20 % of its error: slow. "
        "Also, 3 times, 6.01 % of its error: small. pymunk is"
    )
    assert not any(f"{word}." in said for word in ("late", "large", "soft"))


def test_a_wrong_rule_that_is_behind_a_hundredth_of_an_error_is_not_said() -> None:
    comparison = compare(load("head-on"), ["pymunk", "exact"])
    suffered = Suffered(Cause.LATE, "Deep.", 3, 0.99), Suffered(Cause.SMALL, "Small.", 3, 0.01, is_fault=True)
    run = replace(comparison.runs["pymunk"], suffered=suffered)
    said = verdict(replace(comparison, runs={**comparison.runs, "pymunk": run})).split("\n\n")[0]
    assert said.startswith("pymunk, 3 times, 99 % of its error: deep. pymunk is")
