"""What the mouse holds in the panes, which ball is chosen, and what that makes of the run."""

import math
from typing import Final

import numpy as np
import pygame
from pydantic import ValidationError
from pygame import Surface

from sandbox.errors import SandboxError
from sandbox.quantity import length, segment_distance
from sandbox.run.edits import AddBall, SetVelocity
from sandbox.run.inputs import Grab, Input, Move, Release
from sandbox.scene.model import PALETTE, Vector
from sandbox.scene.validation import error_of
from sandbox.session.history import Moment
from sandbox.view.layout import Layout
from sandbox.view.overlay import ARROW, ball_at
from sandbox.view.palette import palette
from sandbox.view.primitives import arrow
from sandbox.view.session_view import SessionView

REACH: Final = 8  # px of the screen between the pointer and the edge of a ball it takes
STILL: Final = 4  # px of the screen that the mouse may move in a click
PUSH: Final = 30.0  # px/s that a key adds to a velocity
Point = tuple[int, int]


class MouseTool:
    """A ball in the hand while time passes; the tip of its velocity while it is paused; a new ball to be placed.

    Its methods return the input that is to be given, if there is one. A ball that is chosen, which keys are for,
    stays so when others come and go.
    """

    def __init__(self) -> None:
        self._chosen: int | None = None  # which of all balls that there ever were
        self.by_key = False  # the keyboard chose it
        self.adding = False  # the next click places a ball
        self.aim: Vector | None = None  # px, where the chosen ball's velocity is dragged to
        self._pressed: Point | None = None  # where the mouse went down on it
        self._pane = 0

    def ball(self, moment: Moment) -> int | None:
        """Return the chosen ball, if it is there."""
        return moment.balls.index(self._chosen) if self._chosen in moment.balls else None

    # The mouse

    def press(self, stage: SessionView, layout: Layout, point: Point, *, paused: bool) -> Input | None:
        """Take the ball nearest to a point of the screen, if it is near enough; or place a new one.

        Raises SandboxError where there is no room for that.
        """
        pane = layout.pane_at(point)
        if pane is None:
            return None
        self._pane = pane
        at = layout.to_scene(pane, point)
        if self.adding:
            return self.add(stage.moment, at)
        ball, away = ball_at(stage.panes[pane].state, stage.moment.scene.bodies.radius, at)
        near = away * layout.scale <= REACH
        if near and not paused:
            return Grab(step=stage.session.step, ball=ball, at=at)
        self._chosen, self.by_key = (stage.moment.balls[ball] if near else None), False
        self._pressed = point if near else None
        return None

    def drag(self, stage: SessionView, layout: Layout, point: Point) -> Input | None:
        """Pull what is held to a point of the screen."""
        at = layout.to_scene(self._pane, point)
        if stage.session.held is not None:
            x, y = (min(max(to, 0.0), side) for to, side in zip(at, stage.moment.scene.arena.size, strict=True))
            return Move(step=stage.session.step, at=(x, y))
        if self._pressed is not None and (self.aim or math.dist(point, self._pressed) > STILL):
            self.aim = at
        return None

    def let_go(self, stage: SessionView) -> Input | None:
        """Let go of what is held. Raises SandboxError for a velocity that may not be."""
        aim, self.aim, self._pressed = self.aim, None, None
        if stage.session.held is not None:
            return Release(step=stage.session.step)
        ball = self.ball(stage.moment)
        if aim is None or ball is None:
            return None
        vx, vy = ((aim - stage.panes[self._pane].state.position[ball]) / ARROW).tolist()
        return _throw(stage, ball, vx, vy)

    def take_back(self) -> None:
        """Leave a velocity as it was."""
        self.aim = self._pressed = None

    @property
    def holds(self) -> bool:
        """Whether the mouse has a velocity in hand."""
        return self._pressed is not None

    # The keyboard

    def choose(self, stage: SessionView, by: int) -> None:
        """Choose the ball so many further on."""
        balls, here = stage.moment.balls, self.ball(stage.moment)
        self._chosen = balls[0 if by > 0 else -1] if here is None else balls[(here + by) % len(balls)]
        self.by_key = True

    def push(self, stage: SessionView, x: int, y: int) -> Input | None:
        """Let the chosen ball go more to the right and down. Raises SandboxError for a velocity that may not be."""
        ball = self.ball(stage.moment)
        if ball is None:
            return None
        vx, vy = stage.panes[0].state.velocity[ball].tolist()
        return _throw(stage, ball, vx + PUSH * x, vy + PUSH * y)

    def add(self, moment: Moment, at: Vector | None) -> Input:
        """Add a ball like the chosen one, or else the last, at a place; or where there is room near the middle.

        Raises SandboxError where there is none.
        """
        self.adding = False
        like, bodies, size = self._like(moment), moment.scene.bodies, moment.scene.arena.size
        radius = float(bodies.radius[like])
        if at is None:
            at = _near_the_middle(moment, radius)
        else:
            x, y = (min(max(to, radius), side - radius) for to, side in zip(at, size, strict=True))
            at = x, y
            if not _has_room(moment, at, radius):
                raise SandboxError("there is no room for a ball there")
        return AddBall(
            step=moment.step,
            position=at,
            radius=radius,
            mass=float(bodies.mass[like]),
            elasticity=float(bodies.elasticity[like]),
            friction=float(bodies.friction[like]),
            color=PALETTE[len(moment.balls) % len(PALETTE)],
        )

    def _like(self, moment: Moment) -> int:
        """Return the ball that a new one is like."""
        chosen = self.ball(moment)
        return len(moment.balls) - 1 if chosen is None else chosen

    def draw(self, surface: Surface, layout: Layout, stage: SessionView, pointer: Point | None) -> None:
        """Mark the chosen ball in every pane, and draw what is held."""
        scene, scale, ball = stage.moment.scene, layout.scale, self.ball(stage.moment)
        colours = palette(scene.arena.background)
        width = max(2, round(layout.text_height / 7))
        for pane, arena in zip(stage.panes, layout.arenas, strict=True):
            inside = surface.subsurface(arena)
            if ball is not None:
                centre = (pane.state.position[ball] * scale).tolist()
                radius = scene.bodies.radius[ball] * scale + 2 * width
                pygame.draw.circle(inside, colours.ink, centre, radius, width)
                if self.aim:
                    arrow(inside, colours.ink, centre, [scale * c for c in self.aim], width)
        over = layout.pane_at(pointer) if self.adding and pointer else None
        if over is not None and pointer:
            radius = scene.bodies.radius[self._like(stage.moment)] * scale
            pygame.draw.circle(surface, colours.ink, pointer, radius, width)


def _throw(stage: SessionView, ball: int, vx: float, vy: float) -> SetVelocity:
    try:
        return SetVelocity(step=stage.session.step, ball=ball, velocity=(vx, vy))
    except ValidationError as error:
        raise error_of(error, SetVelocity) from None


def _has_room(moment: Moment, at: Vector, radius: float) -> bool:
    """Tell whether a ball would touch no other in any engine, and no wall of the scene."""
    scene, here = moment.scene, np.array(at)
    return all(
        bool((length(state.position - here) >= scene.bodies.radius + radius).all()) for state in moment.states.values()
    ) and all(float(segment_distance(here, wall.start, wall.to)) >= radius + wall.thickness / 2 for wall in scene.walls)


def _near_the_middle(moment: Moment, radius: float) -> Vector:
    width, height = moment.scene.arena.size
    columns, rows = (
        np.arange(radius, side - radius * (1 - 1e-9), max(radius, side / 100)).tolist() for side in (width, height)
    )
    places = sorted(((x, y) for x in columns for y in rows), key=lambda at: math.dist(at, (width / 2, height / 2)))
    found = next((at for at in places if _has_room(moment, at, radius)), None)
    if found is None:
        raise SandboxError("there is no room for another ball")
    return found
