"""Filters: balls that pass through each other, by the rule of `pymunk.ShapeFilter`, in each engine and to the judge."""

from typing import Any

import numpy as np
import pytest

from sandbox import compare, simulate
from sandbox.engines.exact import ExactEngine
from sandbox.engines.pymunk import PymunkEngine
from sandbox.judge.causes import Cause
from sandbox.scene.balls import Filter
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn, warnings
from sandbox.state import State

ENGINES = ["exact", "impulse", "pymunk"]
GROUP = {"group": 7}
FILTERS = {  # of two balls, and whether they meet
    "none": ({}, {}, True),
    "one group": (GROUP, GROUP, False),
    "two groups": (GROUP, {"group": 8}, True),
    "a group and none": (GROUP, {}, True),
    "the first's mask": ({"mask": 0b10}, {"categories": 0b01}, False),
    "the second's mask": ({"categories": 0b01}, {"mask": 0b10}, False),
    "one of several categories": ({"mask": 0b110}, {"categories": 0b011}, True),
    "a group goes first": (GROUP | {"mask": 0b1}, GROUP | {"categories": 0b1}, False),
}


def head_on(first: dict[str, int], second: dict[str, int], **more: Any) -> Scene:
    """Return two balls of radius 10 px that are 100 px apart and approach at 100 px/s each."""
    kind = {"radius": 10, "friction": 0.5}
    balls = [
        kind | {"position": (100, 50), "velocity": (100, 0), "filter": first},
        kind | {"position": (200, 50), "velocity": (-100, 0), "filter": second},
    ]
    return Scene(arena={"size": (300, 100)}, balls=balls, seconds=1, **more)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(("first", "second", "meet"), FILTERS.values(), ids=FILTERS)
def test_two_balls_meet_or_pass_through_each_other(
    first: dict[str, int], second: dict[str, int], meet: bool, engine: str
) -> None:
    x = simulate(head_on(first, second), engine).position[-1, :, 0]
    # Either they come 20 px closer together than their centres were, and go back, or they change places.
    assert x == pytest.approx([80, 220] if meet else [200, 100], abs=100 / 60 * 2 if meet else 1e-3)


def test_a_ball_alone_is_not_disturbed_by_those_that_it_passes_through() -> None:
    alone = head_on({}, {}, gravity=(0, 900))
    ghosts = [ball.model_copy(update={"filter": ball.filter.model_copy(update={"mask": 0})}) for ball in alone.balls]
    mean = simulate(alone, "exact"), simulate(alone.changed(balls=[*ghosts, *alone.balls, *ghosts]), "exact")
    assert mean[1].position[:, 2:4] == pytest.approx(mean[0].position, abs=1e-9)


@pytest.mark.parametrize("elasticity", [0.0, 0.9])
def test_balls_of_one_group_come_to_rest_in_each_other(elasticity: float) -> None:
    balls = {"radius": 10, "positions": [(50, 40), (50, 60), (55, 80)], "elasticity": elasticity, "filter": GROUP}
    scene = Scene(arena={"size": (100, 100)}, balls=[balls], gravity=(0, 900), seconds=10)
    engine = ExactEngine(scene, spawn(scene))
    for _ in range(scene.steps):
        engine.step()
    assert engine.collisions == 0
    assert engine.state().position == pytest.approx(np.array([(50, 90), (50, 90), (55, 90)]))
    assert not engine.state().velocity.any()


def test_an_unending_sequence_of_impacts_has_no_part_of_those_that_pass_through() -> None:
    # A light ball between a heavy one and a wall, whose impacts do not end; a third is where the light one is.
    balls = [
        {"radius": 10, "position": (110, 50), "velocity": (-100, 0), "mass": 100, "elasticity": 0.1},
        {"radius": 10, "position": (30, 50), "mass": 0.1, "elasticity": 0.1},
        {"radius": 10, "position": (15, 50), "velocity": (0, 3), "filter": {"mask": 0}},
    ]
    scene = Scene(arena={"size": (300, 100), "elasticity": 0.1}, balls=balls, seconds=2)
    both, pair = simulate(scene, "exact"), simulate(scene.changed(balls=scene.balls[:2]), "exact")
    assert both.position[:, :2] == pytest.approx(pair.position, abs=1e-9)
    assert both.position[-1, 2] == pytest.approx((15, 56))


def test_no_contact_is_reported_or_missed_between_balls_of_one_group() -> None:
    runs = compare(head_on(GROUP, GROUP), ["pymunk", "impulse", "exact"]).runs
    for run in runs.values():
        assert run.figures.pair_contacts == 0
        assert run.figures.max_overlap == 0
        assert run.figures.first_difference is None
        assert [entry for entry in run.figures.ledger if entry.cause != Cause.ROUNDING] == []


def without_filters(scene: Scene, initial: State) -> PymunkEngine:
    free = [group.model_copy(update={"filter": Filter()}) for group in scene.balls]
    return PymunkEngine(scene.changed(balls=free), initial)


def test_an_engine_that_ignores_the_filter_is_accused_of_velocities_that_change_without_a_contact() -> None:
    comparison = compare(head_on(GROUP, GROUP), {"heedless": without_filters, "exact": "exact"})
    difference = comparison.runs["heedless"].figures.first_difference
    assert difference is not None
    assert difference.time == pytest.approx(0.4, abs=2 / 60)
    assert difference.cause in (Cause.UNREPORTED, Cause.UNKNOWN)


def test_balls_that_pass_through_each_other_do_not_overlap_at_the_start() -> None:
    ball = {"radius": 10, "positions": [(50, 50)] * 300}
    scene = Scene(arena={"size": (100, 100)}, balls=[ball | {"filter": GROUP}])
    assert [*warnings(scene, spawn(scene))] == []
    apart = Scene(arena={"size": (100, 100)}, balls=[ball | {"positions": [(50, 50)] * 3}])
    assert "3 overlaps at the start" in next(warnings(apart, spawn(apart)))
