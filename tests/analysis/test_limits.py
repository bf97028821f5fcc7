"""Where an engine reaches a limit: a comparison ends there, and loses nothing of what was before."""

from typing import Final

import numpy as np
import pytest
from conftest import scene_of

from sandbox.analysis.comparison import compare
from sandbox.analysis.verdict import verdict
from sandbox.errors import LimitReached
from sandbox.run.edits import SetVelocity
from sandbox.scene.model import Scene
from sandbox.scores.verify import Outcome, all_passed, verify
from sandbox.sweeps import plan
from sandbox.sweeps.workers import run_here

TO_AND_FRO: Final = "radius = 20\nelasticity = 1\nposition = [400, 300]\nvelocity = [6000, 0]"
"""A ball that touches a wall at 380/6000 s, and then every 760/6000 s."""
MOST: Final = 3  # contacts
END: Final = 26 / 60  # s: the fourth contact, at 2660/6000 s, is in step 27
WHY: Final = "nds at 0.4333 s: the next step exceeds the limit of 3 contacts"


def to_and_fro(more: str = "") -> Scene:
    return scene_of(TO_AND_FRO, more=f"seconds = 1\n{more}")


@pytest.fixture(autouse=True)
def _few_contacts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sandbox.engines.exact.engine.MAX_LOGGED_CONTACTS", MOST)


def test_a_comparison_ends_where_its_reference_does() -> None:
    comparison = compare(to_and_fro(), ["pymunk", "exact"])
    assert comparison.time[-1] == comparison.reference_until == END
    assert comparison.runs["exact"].contacts["time"] == pytest.approx([380 / 6000, 1140 / 6000, 1900 / 6000])
    assert len(comparison.runs["pymunk"].energy) == 27
    assert f"{WHY}. Every figure is up to there." in verdict(comparison)


def test_its_figures_are_those_of_a_run_that_was_asked_for_no_more() -> None:
    early, asked = (compare(scene, ["pymunk", "exact"]).as_json() for scene in (to_and_fro(), _until(END)))
    assert (early.pop("reference_until"), asked.pop("reference_until")) == (END, None)
    assert early == asked


def _until(seconds: float) -> Scene:
    return to_and_fro().changed(seconds=seconds)


def test_an_engine_that_is_not_the_reference_ends_a_comparison_likewise() -> None:
    scene = to_and_fro()
    assert compare(scene, ["exact", "pymunk"], against="pymunk").reference_until == END


def test_time_counts_from_the_last_edit() -> None:
    """The fourth contact since the edit, at which the ball is at 700 px, is 1120/6000 s after the next, at 80/6000."""
    edit = SetVelocity(step=3, ball=0, velocity=(6000, 0))
    comparison = compare(to_and_fro(), ["pymunk", "exact"], inputs=[edit])
    assert comparison.since == 3 / 60
    contacts = (80 + 760 * np.arange(4)) / 6000
    assert comparison.runs["exact"].contacts["time"] == pytest.approx(contacts[:3])
    assert comparison.time[-1] == np.floor(contacts[3] * 60) / 60


def test_a_limit_in_the_first_step_is_an_error() -> None:
    fast = scene_of(TO_AND_FRO.replace("6000", "1e6"))
    with pytest.raises(LimitReached, match=r"^exact ends at 0 s: "):
        compare(fast, ["pymunk", "exact"])


def test_expectations_after_the_end_are_skipped_with_the_reason() -> None:
    expect = "[[expect]]\nat = {}\nenergy_ratio = 1\ntolerance = 1e-6\nbecause = 'Nothing slows it down.'"
    early, late = (expect.format(at) for at in (0.2, 0.8))
    [row] = dict(verify([scene_of(f"{TO_AND_FRO}\n{early}\n{late}")], ["exact"])).values()
    assert (row["exact"].outcome, [bool(score.skipped) for score in row["exact"].scores]) == (
        Outcome.MET,
        [False, True],
    )
    board = dict(verify([scene_of(f"{TO_AND_FRO}\n{late}")], ["exact"]))
    [row] = board.values()
    assert (row["exact"].outcome, row["exact"].lines) == (Outcome.SKIPPED, [f"at 0.8 s: skipped, since exact e{WHY}"])
    assert all_passed(board, None)


def test_rows_of_a_sweep_end_there() -> None:
    sweep = plan(to_and_fro(), [0], [60], ["pymunk", "exact"])
    rows = [outcome.row for outcome in run_here(sweep, sweep.jobs)]
    assert [row and (row["engine"], row["seconds"], row["reference_until"]) for row in rows] == [
        ("pymunk", END, END),
        ("exact", END, END),
    ]
