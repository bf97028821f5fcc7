"""Watching a live Space: what is recorded is what it did, and what its program did to it is booked to the program."""

import re

import pymunk
import pytest

from sandbox.space.causes import Cause
from sandbox.space.watch import watch

RATE = 60


def box(gravity: float = 0) -> pymunk.Space:
    """Return a box of 400 x 300 px, whose four walls are on the Space's own static body."""
    space = pymunk.Space()
    space.gravity = 0, gravity
    corners = [(0, 0), (400, 0), (400, 300), (0, 300)]
    for k in range(4):
        wall = pymunk.Segment(space.static_body, corners[k - 1], corners[k], 4)
        wall.elasticity = 1
        space.add(wall)
    return space


def add_ball(space: pymunk.Space, x: float, y: float, vx: float = 0, vy: float = 0, mass: float = 1) -> pymunk.Body:
    body = pymunk.Body(mass, pymunk.moment_for_circle(mass, 0, 10))
    body.position, body.velocity = (x, y), (vx, vy)
    disc = pymunk.Circle(body, 10)
    disc.elasticity = 1
    space.add(body, disc)
    return body


def test_damping_is_recognised() -> None:
    space = box()
    space.damping = 0.5
    add_ball(space, 60, 150, 100)
    with watch(space) as watched:
        for _ in range(RATE):
            space.step(1 / RATE)
    assert watched.diagnosis.energy
    assert watched.diagnosis.energy.lines[Cause.DAMPING] == pytest.approx(-(100**2) / 2 * (1 - 0.5**2))


def test_the_space_s_own_step_comes_back_even_after_an_error() -> None:
    space = box()
    add_ball(space, 60, 150)
    with pytest.raises(ZeroDivisionError), watch(space) as watched:
        space.step(1 / RATE / int(space.step != watched.step))
    assert "step" not in vars(space)


def test_what_is_added_while_a_space_is_watched_has_the_line_that_added_it() -> None:
    space = box()
    with watch(space) as watched:
        body = pymunk.Body(1, 10)
        shape = pymunk.Circle(body, 20)
        shape.friction = 0.5
        body.position = 100, 100
        space.add(body, shape)
        space.step(1 / RATE)
    assert "add" not in vars(space)
    finding = next(finding for finding in watched.findings if finding.rule.startswith("moment"))
    assert re.fullmatch(r".*test_watch\.py:\d+", finding.bodies[0].line)
