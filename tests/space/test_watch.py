"""Watching a live Space: what is recorded is what it did, and what its program did to it is booked to the program."""

import re

import pymunk
import pytest
from spaces import ball, ground, world

import sandbox
from sandbox.report.trajectory import simulate
from sandbox.scene.files import load
from sandbox.space.watch import Trials, watch

RATE = 60


def test_the_space_s_own_step_comes_back_even_after_an_error() -> None:
    space, step = world(gravity=0), pymunk.Space.step
    ball(space, 60, 150)
    with pytest.raises(ZeroDivisionError), watch(space):
        space.step(1 / RATE / int(pymunk.Space.step is step))
    assert pymunk.Space.step is step


def test_other_spaces_are_not_recorded() -> None:
    space, other = world(gravity=0), world(gravity=0)
    with watch(other) as second, watch(space) as watched:
        other.step(1 / RATE)
    assert repr(watched) == "<Watched: Space 1: 0 steps, 0 s; 0 bodies, 0 shapes, 0 joints>"
    assert "1 step" in repr(second)


def test_what_is_added_while_a_space_is_watched_has_the_line_that_added_it() -> None:
    space = world(gravity=0)
    with watch(space) as watched:
        space.step(1 / RATE)
        body = pymunk.Body(1, 10)
        shape = pymunk.Circle(body, 20)
        shape.friction = 0.5
        body.position = 100, 100
        space.add(body, shape)
        space.step(1 / RATE)
    finding = next(finding for finding in watched.findings if finding.rule.startswith("moment"))
    assert re.fullmatch(r".*test_watch\.py:\d+", finding.bodies[0].line)
    assert finding.since == 1 / RATE


def test_what_has_sunk_in_before_was_not_added_so() -> None:
    space = ground(gravity=0)
    ball(space, 0, 172, velocity=(0, 840))
    for _ in range(2):
        space.step(1 / RATE)
    with watch(space) as watched:
        space.step(1 / RATE)
    assert [watched.findings, sandbox.lint(space)] == [[], []]


def test_a_watched_run_of_the_engine_pymunk_is_the_run_itself() -> None:
    """`Space.static_body` makes a body, which would be one more than the engine has balls."""
    scene = load("article")
    with Trials().recorded():
        watched = simulate(scene, "pymunk", steps=90)
    assert watched.position.tobytes() == simulate(scene, "pymunk", steps=90).position.tobytes()
