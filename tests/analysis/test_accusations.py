"""Sentences that once accused an engine of what it did not do, each with a scene in which it was false."""

import math

import pytest
from conftest import ball_at, scene_of
from event_driven import EventDriven
from faults import IgnoresPair, PutsApart, SemiImplicitGravity, SteppedWallsTooSoft
from first_difference import first_difference

from sandbox.analysis.comparison import compare
from sandbox.judge.causes import Cause
from sandbox.run.edits import SetVelocity
from sandbox.scene.files import load
from sandbox.scene.model import Scene


def row(*balls: tuple[float, float], more: str = "seconds = 1") -> Scene:
    """Make a scene of balls of radius 20 in a row: their x (px) and velocities along it (px/s)."""
    return scene_of(*(f"radius = 20\nposition = [{x}, 300]\nvelocity = [{v}, 0]" for x, v in balls), more=more)


@pytest.mark.parametrize("iterations", [10, 5000])
@pytest.mark.parametrize("gap", [0.5, 2.0])
def test_more_iterations_do_not_change_what_is_found_late_between_a_wall_and_a_ball(
    iterations: int, gap: float
) -> None:
    """Within a step, a ball meets the wall and another ball, at other times. More iterations change nothing."""
    one = first_difference(row((23, -240), (63 + gap, -400), more="seconds = 0.3"), f"pymunk(iterations={iterations})")
    assert one.cause in (Cause.LATE, Cause.UNKNOWN)


TURNED_PAIR = (ball_at(300, 300, vx=100), ball_at(338, 310))


@pytest.mark.parametrize("engine", ["impulse", "pymunk"])
@pytest.mark.parametrize("gravity", [0, 900])
def test_balls_that_overlap_from_the_start_are_not_found_late(engine: str, gravity: int) -> None:
    """They overlap by 0.7 px before any engine has run; one step later, the line through their centres has turned."""
    one = first_difference(scene_of(*TURNED_PAIR, more=f"gravity = [0, {gravity}]\nseconds = 0.1"), engine)
    assert (one.first, one.second, one.cause) == (0, 1, Cause.UNKNOWN)


def touching_pair(overlap: float) -> Scene:
    """Return two balls that overlap along (0.96, 0.28), px; the first moves on into the second."""
    x, y = 300 + 0.96 * (40 - overlap), 300 + 0.28 * (40 - overlap)
    balls = ball_at(300, 300, vx=100), f"radius = 20\nposition = [{x}, {y}]"
    return scene_of(*balls, more="seconds = 1")


@pytest.mark.parametrize(
    ("engine", "cause"),
    [
        ("impulse", Cause.LATE),
        ("pymunk", Cause.LATE),
        (PutsApart, Cause.POSITION_CORRECTION),
        (IgnoresPair, Cause.MISSED),
    ],
)
def test_an_overlap_that_is_only_rounding_explains_no_more_than_that(engine: str | type, cause: Cause) -> None:
    """Places were typed to three digits. The engines that step find the two 1.6 px deep."""
    one = first_difference(touching_pair(0.001), engine)
    assert one.cause == cause


@pytest.mark.parametrize("engine", ["impulse"])
def test_a_ball_in_a_wall_from_the_start_is_not_blamed_on_gravity(engine: str) -> None:
    ball = ball_at(300, 590, elasticity=0.5)
    scene = scene_of(ball, size="[800, 600]\noverlap = 10", more="gravity = [0, 900]\nseconds = 0.1")
    one = first_difference(scene, engine)
    assert one.cause == Cause.UNKNOWN


def test_balls_that_an_edit_leaves_overlapping_are_not_found_late() -> None:
    """A slop of 1 px leaves their overlap alone until the edit lets them go."""
    balls = ball_at(300, 300), ball_at(338, 310)
    scene = scene_of(*balls, more="seconds = 0.3")
    edit = SetVelocity(step=6, ball=0, velocity=(100.0, 0.0))
    name = "pymunk(collision_slop=1)"
    one = first_difference(scene, name, inputs=[edit])
    assert one.cause == Cause.UNKNOWN


def test_an_edit_while_all_balls_are_in_their_places_is_no_difference() -> None:
    scene = row((100, 120), (600, 0), more="seconds = 2")
    edit = SetVelocity(step=60, ball=1, velocity=(0.0, 90.0))
    assert compare(scene, ["impulse", "exact"], inputs=[edit]).runs["impulse"].differences == ()


@pytest.mark.parametrize("direction", [1, -1])
def test_a_touching_row_that_is_hit_as_a_step_ends_does_not_differ(direction: int) -> None:
    """The ball needs 160 px at 240 px/s: 40 steps, but for rounding."""
    balls = [(400 + direction * x, direction * v) for x, v in ((-300, 240), (-100, 0), (-60, 0), (-20, 0))]
    run = compare(row(*balls), {"faultless": EventDriven, "exact": "exact"}).runs["faultless"]
    assert run.differences == ()
    assert Cause.UNREPORTED not in [entry.cause for entry in run.figures.ledger]


def stack(elasticity: float, *heights: float) -> Scene:
    """Return balls of radius 20 above each other, the lowest on the floor, or falling there."""
    balls = f"radius = 20\nelasticity = {elasticity}\npositions = {[[100, height] for height in heights]}"
    return scene_of(balls, size=f"[240, 600]\nelasticity = {elasticity}", more="seconds = 1\ngravity = [0, 900]")


# The floor bears a heavy ball through two light ones, 6 times their weight: more than what stops their own.
HEAVY_ON_LIGHT = scene_of(
    "radius = 20\nfriction = 0.5\npositions = [[20, 580], [60, 580]]",
    f"radius = 20\nmass = 10\nposition = [40, {580 - 20 * math.sqrt(3)}]",
    size="[80, 600]",
    more="gravity = [0, 900]\nseconds = 0.5",
)


@pytest.mark.parametrize(
    "scene",
    [
        *(stack(0, 580, 539), stack(0.5, 580, 530), stack(0, 580, 539, 498), HEAVY_ON_LIGHT),
        *(pytest.param(stack(e, 580, 540), marks=pytest.mark.wide) for e in (0.5, 1)),
    ],
)
def test_exact_is_not_called_wrong_where_balls_rest_on_each_other_or_come_to_rest(scene: Scene) -> None:
    """Its hops and its small contacts bear their weight, and push a ball on that is already leaving the floor."""
    run = compare(scene, ["exact"]).runs["exact"]
    rightful = {Cause.ELASTICITY, Cause.FRICTION, Cause.SPIN, Cause.ROUNDING, Cause.UNKNOWN}
    assert {entry.cause for entry in run.figures.ledger} <= rightful
    assert {each.cause for each in run.causes} <= {Cause.UNKNOWN}


def test_a_ball_that_another_leads_round_a_third_within_a_step_passes_through_none() -> None:
    """A wall turns it round within the step: the straight way from its place before to that after is not its way."""
    scene = scene_of(ball_at(300, 300, vx=200, vy=-600), ball_at(400, 320), more="rate = 1\nseconds = 1")
    assert compare(scene, ["exact"]).runs["exact"].missed == 0


def test_friction_while_a_ball_rolls_between_hits_is_no_wrong_time_of_the_next_hit() -> None:
    """Exact writes what the floor gave a ball since its last contact at the next one, which it slid to meanwhile."""
    runs = compare(load("billiards").changed(seconds=0.45), ["impulse", "exact"]).runs
    causes = {entry.cause for entry in runs["exact"].figures.ledger}
    assert not causes & {Cause.LATE, Cause.EARLY, Cause.POSITION_CORRECTION, Cause.TELEPORTED}
    assert {each.cause for each in runs["exact"].causes} <= {Cause.UNKNOWN}


def test_a_solver_has_converged_if_only_rounding_is_left_of_a_stack_at_rest() -> None:
    """Its speeds are some 1e-15 px/s, so that a millionth of them is no measure: gravity gives 15 px/s in a step."""
    ball = "radius = 20\nelasticity = 0.5\nposition = [300, {}]"
    scene = scene_of(ball.format(580), ball.format(539), more="gravity = [0, 900]\nseconds = 1")
    name = "pymunk(iterations=3000, collision_persistence=1)"
    [ledger] = (run.figures.ledger for one, run in compare(scene, [name, "exact"]).runs.items() if one != "exact")
    assert Cause.UNCONVERGED not in {entry.cause for entry in ledger}


@pytest.mark.wide
def test_bounces_that_gravity_falsifies_little_by_little_are_its_differences() -> None:
    """Each bounce is off by less than counts, and the next by a little more: together that becomes a difference."""
    one = first_difference(load("bouncing").changed(rate=4000, seconds=2.9), "impulse")
    assert one.cause == Cause.LATE


@pytest.mark.parametrize("height", [101, 150, 233])
def test_a_wall_that_returns_too_little_late_is_not_said_to_return_too_much(height: float) -> None:
    """Gravity has made the ball faster by then: 3 % less of that may be more than is right at first touch."""
    ball = f"radius = 20\nelasticity = 0.8\nposition = [100, {580 - height}]"
    scene = scene_of(ball, size="[200, 600]", more="gravity = [0, 900]\nseconds = 3")
    run = compare(scene, {"soft": SteppedWallsTooSoft, "exact": "exact"}).runs["soft"]
    causes = {entry.cause for entry in run.figures.ledger}
    assert Cause.LARGE not in causes
    assert Cause.SMALL in causes


@pytest.mark.wide
def test_a_contact_is_not_late_by_more_than_a_step_if_each_step_looks_for_it() -> None:
    """Flown in straight steps, a slow ball was traced back on a parabola to before the step."""
    ball = "radius = 20\nelasticity = 0.5\nposition = [100, {}]"
    for height in range(20, 60, 4):
        scene = scene_of(ball.format(580 - height), size="[200, 600]", more="gravity = [0, 900]\nseconds = 2")
        run = compare(scene, {"straight": SemiImplicitGravity, "exact": "exact"}).runs["straight"]
        assert not [one.because for one in run.differences if "more than a step" in one.because]
