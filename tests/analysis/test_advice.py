"""What other settings of Pymunk gain, what they cost, and which of them are advised."""

import json
import math
from typing import Any

import pytest

from sandbox.analysis.advice import TriedSettings, advice_rows, advised, as_json, recommend, try_settings
from sandbox.analysis.comparison import compare
from sandbox.errors import SandboxError
from sandbox.report.output import console
from sandbox.report.tables import print_advice
from sandbox.run.inputs import Grab, Input, Move
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.scene.units import PIXELS

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
        {"iterations": 200},
        {"iterations": 200, "collision_persistence": 1},
        {"substeps": 4, "iterations": 200, "collision_persistence": 1},
    ]


def test_pymunk_cannot_be_measured_against_itself() -> None:
    with pytest.raises(SandboxError, match="advice on pymunk cannot be measured against pymunk itself"):
        try_settings(load("head-on"), "pymunk")


def test_what_the_mouse_gives_is_no_energy_error_of_a_setting() -> None:
    """Once paths are apart, the mouse gives each engine another energy."""
    scene = load("article").changed(seconds=3.0)
    round_and_round = [(400 + 300 * math.sin(k / 10), 300 + 200 * math.cos(k / 13)) for k in range(150)]
    drag: list[Input] = [Grab(step=20, ball=0, at=(400, 300))]
    drag += [Move(step=20 + k, at=at) for k, at in enumerate(round_and_round)]
    trials = try_settings(scene, "exact", drag)
    given = compare(scene, ["pymunk", "exact"], inputs=drag).runs["pymunk"].figures.energy_error
    assert given is not None
    assert given > 0.01
    assert all(trial.energy_error is None for trial in trials)
    assert "energy" not in recommend(trials)


# What is advised


def test_more_substeps_end_tunnelling() -> None:
    """At 60 Hz, two balls fly through the wall."""
    trials = try_settings(load("truths/thin-wall-60-hz"), "exact")
    assert trials[0].passages == 2
    assert settings_of(trials, substeps=4).passages == 0
    assert recommend(trials).startswith("substeps=4: passages 0 instead of 2")


def trial(changes: dict[str, int], **figures: Any) -> TriedSettings:
    usual: dict[str, Any] = {"passages": 0, "escapes": 0, "apart": 1.0, "gap_rms": 50.0, "energy_error": 1e-3}
    return TriedSettings(changes, **(usual | figures), units=PIXELS)


def test_what_is_not_better_is_not_advised() -> None:
    now = trial({})
    assert recommend([now, trial({"substeps": 4}), trial({"iterations": 200})]) == NONE_BETTER
    slightly = trial({"substeps": 4}, apart=1.04, energy_error=0.96e-3)
    assert recommend([now, slightly]) == NONE_BETTER


def test_the_simplest_of_those_that_are_about_as_good_is_advised() -> None:
    now = trial({})
    finer = trial({"substeps": 4}, apart=3.0, energy_error=1.04e-4)
    both = trial({"substeps": 4, "iterations": 200}, apart=3.1, energy_error=1e-4)
    assert recommend([now, finer, both]) == (
        "substeps=4: paths agree until 3.00 s instead of until 1.00 s; energy error 0.0104 % instead of 0.1 %."
    )


WORST: dict[str, float] = {"passages": 5, "escapes": 20, "apart": 0.05, "energy_error": 0.95}


@pytest.mark.parametrize(
    ("key", "better"), [("passages", 2), ("escapes", 2), ("apart", 2.0), ("apart", None), ("energy_error", 0.0)]
)
def test_what_matters_more_decides(key: str, better: float | None) -> None:
    """A trial is better in one thing than the one without changes, alike in what matters more, and bad in the rest."""
    keys = list(WORST)
    alike = {one: 0 if one in ("passages", "escapes") else WORST[one] for one in keys[: keys.index(key)]}
    good = trial({"substeps": 4}, **(WORST | alike | {key: better}))
    now = trial({}, **(dict.fromkeys(WORST, 0) | {key: WORST[key]} | alike))
    assert advised([now, good]) is good


def test_what_becomes_worse_is_said() -> None:
    now = trial({}, passages=3, energy_error=1e-4)
    finer = trial({"substeps": 4}, energy_error=2e-3)
    assert recommend([now, finer]) == ("substeps=4: passages 0 instead of 3. But energy error 0.2 % instead of 0.01 %.")


def test_differences_below_what_counts_are_none() -> None:
    now = trial({}, apart=None, gap_rms=0.009, energy_error=5e-7)
    assert recommend([now, trial({"substeps": 4}, apart=None, gap_rms=1e-5, energy_error=0.0)]) == (NONE_BETTER)


def test_paths_that_agree_are_ranked_by_their_gap() -> None:
    agreeing = [trial({"substeps": n}, apart=None, gap_rms=gap) for n, gap in ((1, 5.0), (2, 3.0), (4, 1.0), (3, 2.0))]
    assert recommend(agreeing) == "substeps=4: RMS gap 1 px instead of 5 px."


@pytest.mark.wide
def test_gaps_count_only_while_the_reference_means_anything() -> None:
    scene = load("gas-100").changed(seconds=5.0)
    comparison = compare(scene, ["pymunk", "exact"])
    now = try_settings(scene, "exact")[0]
    until = comparison.trusted_until
    assert until is not None
    trusted = comparison.runs["pymunk"].gap_rms[comparison.time < until]
    assert now.gap_rms == pytest.approx((trusted**2).mean() ** 0.5)
    assert now.gap_rms < 0.9 * comparison.runs["pymunk"].figures.gap_rms


# Where it stands


def test_the_table_leaves_out_what_no_trial_has() -> None:
    labels, *_ = advice_rows([trial({})])
    assert labels == ["pymunk with", "paths agree", "energy error"]
    labels, row = advice_rows([trial({}, apart=None, passages=1, escapes=2)])
    assert labels == ["pymunk with", "passages", "escapes", "RMS gap", "energy error"]
    assert row == ["no change", "1", "2", "50 px", "0.1 %"]


def test_the_json_has_the_documented_keys() -> None:
    document = json.loads(json.dumps(as_json([trial({}, apart=0.1), trial({"substeps": 4})])))
    assert document["recommendation"].startswith("substeps=4: ")
    assert [one["advised"] for one in document["advice"]] == [False, True]
    assert document["advice"][1] == {
        "changes": {"substeps": 4},
        "passages": 0,
        "escapes": 0,
        "apart": 1.0,
        "gap_rms": 50.0,
        "energy_error": 1e-3,
        "advised": True,
    }
    assert as_json([]) == {}


def test_the_table_has_a_row_for_each_trial(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    trials = [trial({}), trial({"substeps": 4, "iterations": 200}, passages=1)]
    monkeypatch.setenv("COLUMNS", "80")
    print_advice(trials, console())
    printed = [line.rstrip() for line in capsys.readouterr().out.splitlines()]
    assert printed[:4] == [
        "pymunk with     passages   paths agree  energy error",
        "no change              0  until 1.00 s         0.1 %",
        "substeps=4,            1  until 1.00 s         0.1 %",
        "iterations=200",
    ]
