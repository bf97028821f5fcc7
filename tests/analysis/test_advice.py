"""What other settings of Pymunk gain, what they cost, and which of them are advised."""

import json
import math
from typing import Any

import pytest
from conftest import scene_of

from sandbox.analysis.advice import TriedSettings, advice_rows, advised, as_json, at_rate, recommend, try_settings
from sandbox.analysis.comparison import compare
from sandbox.errors import SandboxError
from sandbox.report.comparison_page import page
from sandbox.report.tables import print_advice
from sandbox.run.edits import SetRate
from sandbox.run.inputs import Grab, Input, Move, Release
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn, warnings
from sandbox.scene.units import PIXELS
from sandbox.text import console

NONE_BETTER = "None of the settings tried is better."


def changes(scene: Scene, against: str = "exact", inputs: tuple[Input, ...] = ()) -> list[dict[str, int]]:
    return [trial.changes for trial in try_settings(scene, against, inputs)]


def settings_of(trials: list[TriedSettings], **wanted: int) -> TriedSettings:
    [trial] = [trial for trial in trials if trial.changes == wanted]
    return trial


# What is tried


def test_one_setting_is_tried_at_a_time_and_then_several() -> None:
    assert changes(load("head-on")) == [
        {},
        {"collision_persistence": 1},
        {"substeps": 4},
        {"rate": 240},
        {"iterations": 200},
        {"iterations": 200, "collision_persistence": 1},
        {"substeps": 4, "iterations": 200, "collision_persistence": 1},
    ]


def test_the_rate_that_check_names_is_tried() -> None:
    scene = load("truths/thin-wall-60-hz")
    [warning] = warnings(scene, spawn(scene))
    assert warning.endswith("a rate of 150 would do")
    assert {"rate": 150} in changes(scene)


def test_other_rates_are_tried_against_exact_alone() -> None:
    assert not any("rate" in one for one in changes(load("head-on").changed(seconds=0.1), "impulse"))


def test_a_rate_that_would_take_too_many_steps_is_not_tried() -> None:
    assert not any("rate" in one for one in changes(load("head-on").changed(rate=1_000_000, seconds=1e-5)))
    assert not any("rate" in one for one in changes(load("head-on").changed(rate=300_000, seconds=1e-5)))


def test_a_trial_has_the_figures_of_the_changed_scene() -> None:
    scene = load("article").changed(seconds=4.0)
    trial = settings_of(try_settings(scene, "exact"), rate=240)
    run = compare(scene.changed(rate=240), ["pymunk", "exact"]).runs["pymunk"]
    assert (trial.apart, trial.gap_rms) == (run.apart, run.figures.gap_rms)
    finer = settings_of(try_settings(scene, "exact"), substeps=4)
    run = compare(scene.changed(pymunk={"substeps": 4}), ["pymunk", "exact"]).runs["pymunk"]
    assert (finer.apart, finer.gap_rms) == (run.apart, run.figures.gap_rms)


def test_pymunk_cannot_be_measured_against_itself() -> None:
    with pytest.raises(SandboxError, match="advice on pymunk cannot be measured against pymunk itself"):
        try_settings(load("head-on"), "pymunk")


def test_progress_goes_from_start_to_end_over_all_rates() -> None:
    shown: list[float] = []
    try_settings(load("head-on"), "exact", progress=shown.append)
    assert shown == sorted(shown)
    assert shown[0] <= 0.5
    assert shown[-1] == 1


# Recorded inputs


def test_inputs_are_converted_to_the_steps_of_another_rate() -> None:
    inputs: list[Input] = [Grab(step=30, ball=0, at=(1, 2)), SetRate(step=60, rate=120), Release(step=180)]
    converted = at_rate(inputs, 60, 240)  # 0.5 s, 1 s, and then 120 steps at twice the rate: 2 s
    assert converted == [
        Grab(step=120, ball=0, at=(1, 2)),
        SetRate(step=240, rate=480),
        Release(step=720),
    ]
    assert at_rate(inputs, 60, 60) == inputs
    assert [one.step for one in at_rate([Move(step=k, at=(0, 0)) for k in range(5)], 60, 90)] == [0, 2, 3, 4, 6]


def test_a_recorded_drag_is_tried_at_another_rate_too() -> None:
    scene = scene_of("radius = 20\nposition = [200, 300]", more="seconds = 2")
    inputs: tuple[Input, ...] = (Grab(step=6, ball=0, at=(500, 300)), Release(step=90))
    trials = try_settings(scene, "exact", inputs)
    assert settings_of(trials, rate=240).apart is None
    assert recommend(trials) == NONE_BETTER


def test_what_the_mouse_gives_is_no_energy_error_of_a_setting() -> None:
    """Once paths are apart, the mouse gives each engine another energy."""
    scene = load("article").changed(seconds=3.0)
    round_and_round = [(400 + 300 * math.sin(k / 10), 300 + 200 * math.cos(k / 13)) for k in range(150)]
    drag: list[Input] = [Grab(step=20, ball=0, at=(400, 300))]
    drag += [Move(step=20 + k, at=at) for k, at in enumerate(round_and_round)]
    trials = try_settings(scene, "exact", drag)
    assert trials[0].astray > 0.01
    assert all(trial.energy_error is None for trial in trials)
    assert "energy" not in recommend(trials)


# What is advised


def test_more_substeps_or_a_higher_rate_end_tunnelling() -> None:
    """At 60 Hz, two balls fly through the wall."""
    trials = try_settings(load("truths/thin-wall-60-hz"), "exact")
    assert trials[0].passages == 2
    for key, value in (("substeps", 4), ("rate", 150), ("rate", 240)):
        assert settings_of(trials, **{key: value}).passages == 0
    assert recommend(trials).startswith(
        "rate=150: 0 passages without a contact instead of 2; the paths agree throughout instead of"
    )


@pytest.mark.slow
def test_a_dense_gas_is_advised_by_its_pressure_too() -> None:
    """Iterations alone keep the energy, and leave the pressure as far off as before."""
    trials = try_settings(load("gas-dense").changed(seconds=2.0), "exact")
    steady = settings_of(trials, iterations=200, collision_persistence=1)
    assert steady.energy_error is not None
    assert steady.energy_error < 1e-12
    assert steady.theory is not None
    assert steady.theory > 0.15
    best = advised(trials)
    assert best.changes == {"substeps": 4, "iterations": 200, "collision_persistence": 1}
    assert best.theory is not None
    assert best.theory < 0.1
    assert "the largest difference from theory is" in recommend(trials)


def trial(changes: dict[str, int], **figures: Any) -> TriedSettings:
    usual: dict[str, Any] = {
        "passages": 0,
        "escapes": 0,
        "apart": 1.0,
        "gap": 50.0,
        "theory": None,
        "energy_error": 1e-3,
        "astray": 1e-3,
        "gap_rms": 50.0,
    }
    return TriedSettings(changes, **(usual | figures), units=PIXELS)


def test_what_is_not_better_is_not_advised() -> None:
    now = trial({})
    assert recommend([now, trial({"substeps": 4}), trial({"rate": 240})]) == NONE_BETTER
    slightly = trial({"substeps": 4}, apart=1.04, energy_error=0.96e-3)
    assert recommend([now, slightly]) == NONE_BETTER


def test_the_simplest_of_those_that_are_about_as_good_is_advised() -> None:
    now = trial({})
    finer = trial({"substeps": 4}, apart=3.0, energy_error=1.04e-4)
    both = trial({"substeps": 4, "iterations": 200}, apart=3.1, energy_error=1e-4)
    assert recommend([now, finer, both]) == (
        "substeps=4: the paths agree until 3.00 s instead of until 1.00 s; "
        "the energy error is 0.0104 % instead of 0.1 %."
    )


RANKED = {
    "passages": {"passages": 2, "escapes": 9, "apart": 0.1, "theory": 0.9, "energy_error": 0.9},
    "escapes": {"escapes": 2, "apart": 0.1, "theory": 0.9, "energy_error": 0.9},
    "paths": {"apart": 2.0, "theory": 0.9, "energy_error": 0.9},
    "theory": {"theory": 0.2, "energy_error": 0.9},
    "energy": {"energy_error": 0.5},
}


@pytest.mark.parametrize("rank", RANKED)
def test_what_matters_more_decides(rank: str) -> None:
    """Each trial is better in one thing than the one without changes, and as bad as can be in what matters less."""
    worst = {"passages": 5, "escapes": 20, "apart": 0.05, "theory": 0.95, "energy_error": 0.95}
    keys = list(worst)
    key = "apart" if rank == "paths" else {"energy": "energy_error"}.get(rank, rank)
    alike = {one: 0 if one in ("passages", "escapes") else worst[one] for one in keys[: keys.index(key)]}
    good = trial({"substeps": 4}, **(worst | RANKED[rank] | alike))
    now = trial({}, **(worst | alike))
    assert advised([now, good]) is good


def test_what_becomes_worse_is_said() -> None:
    now = trial({}, passages=3, energy_error=1e-4)
    finer = trial({"substeps": 4}, energy_error=2e-3)
    assert recommend([now, finer]) == (
        "substeps=4: 0 passages without a contact instead of 3. But the energy error is 0.2 % instead of 0.01 %."
    )


def test_differences_below_what_counts_are_none() -> None:
    now = trial({}, apart=None, gap=0.009, energy_error=5e-7)
    assert recommend([now, trial({"substeps": 4}, apart=None, gap=1e-5, energy_error=0.0)]) == (NONE_BETTER)
    noisy = trial({}, theory=0.08)
    assert recommend([noisy, trial({"substeps": 4}, theory=0.04)]) == NONE_BETTER


def test_paths_that_agree_are_ranked_by_their_gap() -> None:
    agreeing = [trial({"substeps": n}, apart=None, gap=gap) for n, gap in ((1, 5.0), (2, 3.0), (4, 1.0), (3, 2.0))]
    assert recommend(agreeing) == "substeps=4: the RMS gap is 1 px instead of 5 px."
    assert agreeing[0].agrees == "throughout"


def test_paths_that_are_apart_at_once_are_the_worst() -> None:
    now, finer = trial({}, apart=0.0), trial({"substeps": 4}, apart=0.1)
    assert advised([now, finer]) is finer


@pytest.mark.wide
def test_gaps_count_only_while_the_reference_means_anything() -> None:
    scene = load("gas-100").changed(seconds=5.0)
    comparison = compare(scene, ["pymunk", "exact"])
    now = try_settings(scene, "exact")[0]
    until = comparison.trusted_until
    assert until is not None
    trusted = comparison.runs["pymunk"].gap_rms[comparison.time < until]
    assert now.gap == pytest.approx((trusted**2).mean() ** 0.5)
    assert now.gap < 0.9 * now.gap_rms


# Where it stands


def test_the_table_leaves_out_what_no_trial_has() -> None:
    labels, *_ = advice_rows([trial({})])
    assert labels == ["pymunk with", "paths agree", "RMS gap", "energy error"]
    labels, row = advice_rows([trial({}, passages=1, escapes=2, theory=0.1)])
    assert labels == ["pymunk with", "passages", "escapes", "paths agree", "RMS gap", "off theory", "energy error"]
    assert row == ["no change", "1", "2", "until 1.00 s", "50 px", "10 %", "0.1 %"]


def test_the_json_has_the_documented_keys() -> None:
    document = json.loads(json.dumps(as_json([trial({}, apart=0.1), trial({"substeps": 4})])))
    assert document["recommendation"].startswith("substeps=4: ")
    assert [one["advised"] for one in document["advice"]] == [False, True]
    assert document["advice"][1] == {
        "changes": {"substeps": 4},
        "passages": 0,
        "escapes": 0,
        "apart": 1.0,
        "gap": 50.0,
        "theory": None,
        "energy_error": 1e-3,
        "astray": 1e-3,
        "gap_rms": 50.0,
        "advised": True,
    }
    assert as_json([]) == {}


def test_the_report_has_the_advice() -> None:
    comparison = compare(load("head-on").changed(seconds=0.5), ["pymunk", "exact"])
    trials = [trial({}), trial({"substeps": 4}, apart=3.0)]
    text = page(comparison, trials)
    assert "<p>substeps=4: the paths agree until 3.00 s instead of until 1.00 s.</p>" in text
    assert '<tr><th scope="row">substeps=4</th><td data-label="paths agree">until 3.00 s</td>' in text
    assert "No other settings were tried." in page(comparison)
    assert "No other settings were tried." not in text


def test_the_table_fits_the_terminal_or_becomes_lines(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    trials = [trial({}), trial({"substeps": 4, "iterations": 200}, passages=1)]
    monkeypatch.setenv("COLUMNS", "80")
    print_advice(trials, console())
    wide = [line.rstrip() for line in capsys.readouterr().out.splitlines()]
    assert wide[:4] == [
        "pymunk with     passages   paths agree  RMS gap  energy error",
        "no change              0  until 1.00 s    50 px         0.1 %",
        "substeps=4,            1  until 1.00 s    50 px         0.1 %",
        "iterations=200",
    ]
    monkeypatch.setenv("COLUMNS", "50")
    print_advice(trials, console())
    narrow = [line.rstrip() for line in capsys.readouterr().out.splitlines()]
    assert narrow[:6] == [
        "pymunk with no change:",
        "  passages 0; paths agree until 1.00 s; RMS gap 50",
        "  px; energy error 0.1 %",
        "pymunk with substeps=4, iterations=200:",
        "  passages 1; paths agree until 1.00 s; RMS gap 50",
        "  px; energy error 0.1 %",
    ]
