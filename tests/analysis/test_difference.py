"""The first difference: planted faults get the right name, at the contact where they are."""

import math

import pytest
from conftest import ball_at, numbers_in, scene_of
from event_driven import Stepped
from first_difference import first_difference

from sandbox.analysis.comparison import compare
from sandbox.analysis.difference import pair_name
from sandbox.judge.causes import Cause
from sandbox.scene.files import load
from sandbox.scene.model import Scene


class TooMuch(Stepped):
    impulse_factor = 1.02


# Balls 0 and 1 meet head-on, and then 2 is hit by 1. At 60 steps a second they touch on a step, but for rounding.
ROW = scene_of(ball_at(100, 300, vx=240), ball_at(300, 300), ball_at(502, 300), more="seconds = 3")
# One ball that a wall of 780 stops 1.4 px deep; another that never meets it.
WALL = scene_of(ball_at(302, 300, vx=480), ball_at(100, 100), more="seconds = 2")


def test_an_engine_without_a_fault_differs_in_displacements_only() -> None:
    assert compare(WALL, {"late": Stepped, "exact": "exact"}).runs["late"].differences == ()
    late = first_difference(load("oblique"), Stepped)
    assert late.cause == Cause.LATE


def test_two_per_cent_too_much_impulse() -> None:
    one = first_difference(ROW, TooMuch)
    assert (one.first, one.second, one.cause) == (0, 1, Cause.LARGE)
    assert numbers_in(one.because)[0] == 1.02
    assert one.after is not None
    assert one.after[0][0] == pytest.approx(-0.02 * 240)
    assert one.should_after == ((0.0, 0.0), (240.0, 0.0))


END = "[[walls]]\nfrom = [301, {0}]\nto = [301, 560]\nthickness = 2"  # below the ball, which grazes its round end


@pytest.mark.parametrize("off", [5.0, 20.0, 34.0, 37.0])
@pytest.mark.parametrize("end", [False, True], ids=["balls", "the end of a wall"])
@pytest.mark.parametrize("engine", ["impulse", "pymunk"])
def test_a_contact_is_late_by_the_overlap_at_the_end_of_its_step(engine: str, end: bool, off: float) -> None:
    """Also where they graze. off: px, of the centres, across the flight."""
    ball = "radius = {0}\nposition = [100, 100]\nvelocity = [200, 0]"
    if end:
        balls = [ball.format(37) + "\n" + END.format(100 + off + 1e-6)]
    else:
        balls = [ball.format(20), f"radius = 20\nposition = [301, {100 + off}]"]
    runs = compare(scene_of(*balls, more="seconds = 1.5"), [engine, "exact"]).runs
    first = runs[engine].figures.first_difference
    assert first is not None
    depth = (38 if end else 40) - math.hypot(201 - 200 * first.time, off)
    assert first.cause == Cause.LATE
    assert first.depth == pytest.approx(depth, rel=1e-3)
    assert numbers_in(first.because)[0] == pytest.approx(depth, rel=1e-2)


# The article's rule, by radius


@pytest.mark.parametrize(
    ("radius", "cause", "said"),
    [
        (20, Cause.SMALL, ("he impulse is 0.05 of what is due", "the diameter, 40 px")),
        (4, Cause.SMALL, ("he impulse is 0.25 of what is due", "the diameter, 8 px")),
        (2, Cause.SMALL, ()),
        (0.5, Cause.LARGE, ("he impulse is 2 of what is due", "the diameter, 1 px")),
    ],
)
def test_the_article_s_divisor_is_named(radius: float, cause: Cause, said: tuple[str, ...]) -> None:
    scene = meeting(radius)
    run = compare(scene, ["article", "exact"]).runs["article"]
    one = run.figures.first_difference
    assert one is not None
    assert one.cause == cause
    for words in said:
        assert words in one.because
    gained = sum(entry.energy for entry in run.figures.ledger if entry.cause == cause)
    assert (gained > 0) == (cause == Cause.LARGE)


def test_at_radius_one_the_article_is_right() -> None:
    run = compare(meeting(1), ["article", "exact"]).runs["article"]
    assert not {Cause.SMALL, Cause.LARGE} & {entry.cause for entry in run.figures.ledger}
    assert run.figures.energy_ratio == pytest.approx(1)


def meeting(radius: float) -> Scene:
    return scene_of(
        ball_at(100, 300, vx=30, radius=radius), ball_at(130.25 + 2 * radius, 300, radius=radius), more="seconds = 1.5"
    )


def test_a_contact_without_impulse_is_no_difference() -> None:
    """Along a wall that it touches, the article reverses a speed of 0 in every step."""
    scene = scene_of(ball_at(20, 300, vy=100), more="seconds = 1")
    run = compare(scene, ["article", "exact"]).runs["article"]
    assert run.figures.wall_contacts == 60
    assert run.differences == ()
    assert not {Cause.DOUBLE_BOUNCE, Cause.LARGE} & {entry.cause for entry in run.figures.ledger}


def test_the_cradle_s_contacts_one_a_step_are_late_and_not_missing() -> None:
    """Pymunk passes the velocity on by one ball in each step, and pushes each two apart in the step after."""
    run = compare(load("newtons-cradle").changed(seconds=2.0), ["pymunk", "exact"]).runs["pymunk"]
    assert run.figures.pair_contacts == 5
    assert Cause.MISSED not in [one.cause for one in run.differences]
    late = [one for one in run.differences if one.cause == Cause.LATE]
    assert [(one.first, one.second) for one in late] == [(0, 1), (1, 2), (2, 3), (3, 4), (4, 5)]


@pytest.mark.parametrize("engine", ["pymunk", "impulse"])
def test_a_depth_in_a_sentence_is_that_of_the_contact_that_the_sentence_names(engine: str) -> None:
    """In a gas, one late contact leads to many others, found late by other times at other depths."""
    scene = load("gas-100").changed(seconds=0.5)
    found = compare(scene, [engine, "exact"]).runs[engine].differences
    depths = {f"{one.time:.3f} s, {pair_name(scene, one)}": one.depth for one in found if one.depth is not None}
    named = set[str]()
    for one in found:
        here = f"{one.time:.3f} s, {pair_name(scene, one)}"
        if one.because.startswith("Found ") and here in depths:
            assert f" {depths[here]:.3g} px" in one.because
            named.add(here)
    assert len(named) > 5


def test_contacts_at_one_time_in_another_order_are_no_difference_where_the_paths_are_the_same() -> None:
    """In a corner a ball touches both walls at once: one engine tells the right one first, the other the lower one."""
    corner = scene_of(ball_at(300, 300, vx=123, vy=123), size="[600, 600]", more="seconds = 3")
    run = compare(corner.changed(arena={"size": (600, 600), "elasticity": 0.7}), ["impulse", "exact"]).runs["impulse"]
    assert run.figures.gap_max < 1e-9
    assert run.differences == ()
