"""Faults in steps of many balls that touch: shown by contacts of few, and of walls and pairs that part each its way."""

from collections import Counter

import sandbox
from sandbox.judge.causes import Cause
from sandbox.scene.files import load


def causes(scene: str, engine: str, seconds: float) -> Counter[Cause]:
    """Return how many contacts of an engine's run have each cause."""
    comparison = sandbox.compare(
        load(scene).changed(seconds=seconds, expect=()), list(dict.fromkeys([engine, "exact"]))
    )
    counts = Counter[Cause]()
    for suffered in comparison.runs[engine].suffered:
        counts[suffered.cause] += suffered.times
    return counts


def test_what_contacts_of_two_show_explains_a_whole_rack_that_came_before() -> None:
    """The break: 16 balls touch in each of the first 25 steps with a contact, of which nothing else is known yet."""
    scene = load("break-shot").changed(seconds=2.0, expect=())
    run = sandbox.compare(scene, ["article", "exact"]).runs["article"]
    assert run.figures.first_difference is not None
    assert run.figures.first_difference.cause == Cause.SMALL
    worst = run.suffered[0]
    assert worst.because.startswith(f"The impulse is {1 / 14:.4g} of what is due.")
    assert worst.share > 0.999
    assert Cause.UNKNOWN not in {suffered.cause for suffered in run.suffered}


def test_walls_that_turn_back_what_parts_beside_pairs_that_do_not() -> None:
    """The article reverses a velocity in a wall even if it leads out of it, and lets pairs that part alone.

    Some groups are joined only by what the order of pushes makes overlap: no exact step has them together.
    """
    counts = causes("gas-100", "article", 2.1)
    assert Cause.UNKNOWN not in counts
    assert counts[Cause.SMALL] > 1000
    assert counts[Cause.DOUBLE_BOUNCE] > 0


def test_groups_that_meet_between_the_ends_of_a_step_do_not_accuse_exact() -> None:
    """At 2.05 s two balls of the dense gas graze each other on their ways after other contacts of the step."""
    counts = causes("gas-dense", "exact", 3.2)
    assert counts[Cause.UNKNOWN] <= 3  # groups of more than 256 balls, at the start
