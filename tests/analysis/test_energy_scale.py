"""Shares of energy are of one scale: closed forms, and no part in it of the view, the blocks or the order of steps."""

import json
from collections.abc import Iterator
from typing import Any

import pymunk
import pytest
from conftest import ball_at, sample, scene_of

from sandbox.analysis.comparison import compare, flatten
from sandbox.judge.causes import Cause
from sandbox.run.inputs import Grab, Input, Move, Release
from sandbox.scene.model import Scene
from sandbox.scores.verify import Outcome, verify
from sandbox.space.from_pymunk import from_space

GRAVITY = "gravity = [0, 900]\n"


def space_of(e: float, shift: float = 0.0) -> pymunk.Space:
    """Return a Space in which one ball falls 300 px on a floor, and another is thrown. shift: of all, px down."""
    space = pymunk.Space()
    space.gravity = 0, 900
    floor = pymunk.Segment(space.static_body, (0, 500 + shift), (700, 500 + shift), 1)
    floor.elasticity = 1
    space.add(floor)
    for x, velocity in ((200, (0, 0)), (400, (60, -90))):
        body = pymunk.Body(1, pymunk.moment_for_circle(1, 0, 20))
        body.position, body.velocity = (x, 179 + shift), velocity
        shape = pymunk.Circle(body, 20)
        shape.elasticity = e
        space.add(body, shape)
    return space


def numbers(document: Any) -> Iterator[tuple[str, float]]:
    """Yield the numbers of a document by their dotted keys."""
    for key, value in flatten(document).items():
        if isinstance(value, int | float):
            yield key, value


def dropped(seconds: float = 2.0, size: str = "[800, 600]", e: float = 0.5, more: str = "") -> Scene:
    """Return a ball of 2 kg that falls 300 px to the floor, of which the arena has no part but its view."""
    ball = f"radius = 20\nmass = 2\nelasticity = {e}\nposition = [400, 260]"
    text = f"{GRAVITY}seconds = {seconds}\n{more}"
    wall = "[[walls]]\nfrom = [0, 580]\nto = [800, 580]\nthickness = 1e-9\n"
    return scene_of(ball, size=f"{size}\nwalls = false", more=text + wall)


@pytest.mark.parametrize("e", sample([0.5, 1.0], 2))
def test_a_space_has_the_same_figures_in_every_view(e: float) -> None:
    views = [from_space(space_of(e), size=size) for size in ((800, 600), (800, 2000), (3000, 20000))]
    first, *others = (
        dict(numbers(compare(view.changed(seconds=3.0), ["pymunk", "exact"]).as_json())) for view in views
    )
    assert first["engines.pymunk.energy_error"] > 0.01
    for other in others:
        for key in first | other:  # a line of rounding is there only if it is not 0
            whole = first["energy_scale"] if key.endswith(".energy") else 1.0
            value, expected = other.get(key, 0.0), first.get(key, 0.0)
            assert value == pytest.approx(expected, rel=1e-9, abs=1e-12 * whole), key


def test_the_scale_of_a_dropped_ball_is_m_g_h_at_the_floor_though_no_step_ends_there() -> None:
    for rate in (60, 61, 7):
        comparison = compare(dropped().changed(rate=rate), ["pymunk", "exact"])
        assert comparison.energy_scale == pytest.approx(2 * 900 * 300, rel=1e-9)
    assert compare(dropped(0.95), ["exact"]).runs["exact"].figures.energy_ratio == pytest.approx(0.25)  # e², one bounce
    falling = compare(dropped(0.5), ["exact"])  # 112.5 px, and no floor yet
    assert falling.energy_scale == pytest.approx(2 * 900 * 112.5)


def test_the_scale_of_a_thrown_ball_is_its_energy_above_the_lowest_point_that_it_reaches() -> None:
    ball = ball_at(100, 300, vx=200, vy=-300, radius=10, mass=3, spin=8)
    comparison = compare(scene_of(ball, more=GRAVITY + "seconds = 1", size="[900, 3000]"), ["exact"])
    spin = 3 * 10**2 / 2 * 8**2 / 2
    assert comparison.energy_scale == pytest.approx(3 * (200**2 + (900 - 300) ** 2) / 2 + spin)


def test_a_ball_that_rolls_has_the_scale_of_its_start() -> None:
    """Nothing falls, though every step has a contact that carries the ball."""
    rolling = ball_at(100, 580, vx=80, friction=1, spin=4)
    scene = scene_of(rolling, more=GRAVITY + "seconds = 1")
    assert compare(scene, ["exact"]).energy_scale == pytest.approx(80**2 / 2 + (20**2 / 2) * 4**2 / 2, rel=1e-12)


@pytest.mark.parametrize("gravity", ["", GRAVITY])
def test_the_mouse_is_the_scale_if_it_gives_more_than_there_is(gravity: str) -> None:
    """A ball at rest is thrown: without walls near, all of its energy is the mouse's."""
    scene = scene_of(ball_at(100, 300, mass=2), size="[4000, 4000]", more=f"{gravity}seconds = 0.5")
    inputs: list[Input] = [Grab(step=0, ball=0, at=(100, 300)), Move(step=1, at=(2000, 300)), Release(step=20)]
    comparison = compare(scene, ["impulse", "exact"], inputs=inputs)
    run = comparison.runs["exact"]
    [given] = [entry.energy for entry in run.figures.ledger if entry.cause is Cause.APPLIED]
    assert given > 0.5 * 2 * 500**2
    if gravity:  # against which the mouse also lifts the ball
        assert comparison.energy_scale >= given
    else:  # the pull first speeds the ball up, and then takes part of that again
        assert comparison.energy_scale == pytest.approx(run.energy.max(), rel=1e-12)
        assert run.figures.energy_ratio == pytest.approx(1 + given / run.energy.max(), rel=1e-12)


def test_balls_at_rest_under_gravity_have_the_scale_of_a_fall_through_their_radius() -> None:
    scene = scene_of("radius = 20\nmass = 3\npositions = [[100, 580], [300, 580]]", more=GRAVITY + "seconds = 1")
    comparison = compare(scene, ["pymunk", "exact"])
    assert comparison.energy_scale == pytest.approx(2 * 3 * 900 * 20)
    assert comparison.runs["pymunk"].figures.energy_ratio == pytest.approx(1, abs=1e-2)


def test_without_anything_that_moves_there_is_no_share_of_energy() -> None:
    scene = scene_of("radius = 20\npositions = [[100, 100], [200, 200]]", more="seconds = 0.1")
    comparison = compare(scene, ["pymunk", "exact"])
    assert comparison.energy_scale == 0
    for run in comparison.runs.values():
        figures = run.figures
        assert (figures.energy_ratio, figures.energy_drift, figures.energy_error) == (None, None, None)
    assert "nan" not in json.dumps(comparison.as_json(), allow_nan=False)


# Expectations


@pytest.mark.parametrize("size", ["[800, 600]", "[800, 20000]"])
def test_an_energy_that_a_scene_expects_is_of_the_same_scale(size: str) -> None:
    """After the first bounce, a ball has e² of m g h, and in flight it has all of it."""
    expect = "[[expect]]\nat = {}\nenergy_ratio = {}\ntolerance = 1e-9\nbecause = 'e² of the energy of fall'\n"
    scene = dropped(0.95, size, more=expect.format(0.5, 1) + expect.format(0.95, 0.25))
    [(_, row)] = verify([scene], ["exact"])
    assert row["exact"].outcome is Outcome.MET
    figures = compare(scene, ["pymunk", "exact"]).runs
    assert [run.figures.met for run in figures.values()] == [0, 2]  # Pymunk integrates gravity in steps


def test_an_energy_is_not_expected_of_what_does_not_move() -> None:
    expect = "[[expect]]\nat = 0.1\nenergy_ratio = 1\ntolerance = 1\nbecause = 'x'\n"
    [(_, row)] = verify([scene_of(ball_at(100, 100), more=expect)], ["exact"])
    assert row["exact"].scores[0].skipped == "nothing moves, so the energy has no ratio"
