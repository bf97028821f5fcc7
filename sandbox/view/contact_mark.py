"""A contact in which an engine differs from the reference, drawn in the panes: normals, velocities and overlap.

What the engine found is in its colour, what the reference has in that of text. A velocity before the contact is a thin
arrow that ends at its ball, one after it a thick arrow that begins there.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np
import pygame
from pygame import Color, Rect, Surface

from sandbox.analysis.difference import Difference, Velocities
from sandbox.judge.thresholds import NEGLIGIBLE
from sandbox.scene.fields import Vector, rgb
from sandbox.scene.model import Scene
from sandbox.scene.units import Dimension
from sandbox.state import Floats, State
from sandbox.view.layout import Layout
from sandbox.view.overlay import Canvas
from sandbox.view.primitives import arrow, capsule, draw_walls, label, text_width
from sandbox.view.session_view import Pane
from sandbox.view.theme import palette
from sandbox.view.widgets import Widget

NORMAL: Final = 5.5  # half of a normal, in heights of the text: long enough to see angles between normals
ARROW: Final = 4.0  # the longest arrow, in units: a height of the text or, where that is less, the larger ball's radius
LEAST_UNIT: Final = 0.4  # heights of the text
DASHES: Final = 9  # of the normal at first touch
BEFORE: Final = 1.5  # width of an arrow, in widths of a line
AFTER: Final = 2.5
SHORTEST: Final = 0.25  # part of their length to which arrows shrink so that they stay in the pane
HALO: Final = 2  # px of the ground round a line, which set it off from balls
HEIGHT: Final = 13.0  # in heights of the text
RADIUS: Final = 2.0  # of the larger ball, likewise


def draw_contact(surface: Surface, layout: Layout, panes: Sequence[Pane], difference: Difference, engine: str) -> None:
    """Draw a difference between an engine and the reference in every pane, and its overlap in the engine's own."""
    for index, pane in enumerate(panes):
        inside = surface.subsurface(layout.arenas[index])
        canvas = Canvas(inside, pane.scene, pane.state, layout.scale, layout.text_height, layout.origin)
        mark = ContactMark(canvas, difference)
        colour = palette(pane.scene.arena.background).engines(one.name for one in panes)[engine]
        mark.draw(colour, overlap=pane.name == engine)


class ContactMark:
    """Draws a contact that differs on one pane's arena."""

    def __init__(self, canvas: Canvas, difference: Difference) -> None:
        self._difference = difference
        self._surface, self._scene, self._palette = canvas.surface, canvas.scene, canvas.palette
        self._state, self._scale, self._at = canvas.state, canvas.scale, canvas.at
        self._text_height = canvas.text_height
        largest = float(canvas.scene.bodies.radius[difference.balls].max()) * canvas.scale
        self._unit = min(canvas.text_height, max(largest, LEAST_UNIT * canvas.text_height))  # px
        self._width = max(1, round(self._unit / 10))  # of lines, px

    def draw(self, colour: Color, *, overlap: bool) -> None:
        """Draw everything. colour: of the engine; overlap: whether to draw how deep it is."""
        ink, found = self._palette.ink, self._difference
        self._outline_wall(self._palette.contact)
        for ball in found.balls:
            centre = self._at(self._state.position[ball]).round().astype(int).tolist()
            radius = round(self._scene.bodies.radius[ball] * self._scale)
            pygame.draw.circle(self._surface, ink, centre, radius + 3 * self._width, self._width)
        if found.should_normal:
            self._normal(found.should_normal, ink)
        if found.normal and found.should_normal:
            self._normal(found.should_normal, colour, dashed=True)
        if found.normal:
            self._normal(found.normal, colour)
        should = self._arrows(found.before, found.should_after, ink)
        self._draw_arrows([*should, *self._arrows(found.before, found.after, colour)])
        if overlap and self._has_depth:
            rim, normal = self._contact_point, np.array(found.normal)
            inner = rim - (found.depth or 0.0) * self._scale * normal
            pygame.draw.line(self._surface, self._palette.contact, inner.tolist(), rim.tolist(), 3 * self._width)

    def _outline_wall(self, colour: Color) -> None:
        """Draw the wall that the ball touches, if it does, over its whole length."""
        second = self._difference.second
        if second is not None and second < 0:
            *ends, thickness = self._scene.wall_line(~second)
            start, end = self._at(np.array(ends)).tolist()
            capsule(self._surface, colour, start, end, max(thickness / 2 * self._scale, 2 * self._width))

    # The normals

    def _normal(self, normal: Vector, colour: Color, *, dashed: bool = False) -> None:
        """Draw a line along a normal, through where the engine or else the reference has the contact."""
        half = NORMAL * self._text_height * np.array(normal)
        point = self._contact_point
        shares = np.linspace(-1, 1, 2 * DASHES) if dashed else np.array([-1.0, 1.0])
        for start, end in shares.reshape(-1, 2):
            self._line(point + start * half, point + end * half, self._width, colour)

    @property
    def _contact_point(self) -> Floats:
        """Where the first ball touches, on the surface."""
        found, first = self._difference, self._difference.first
        normal = np.array(found.normal or found.should_normal)
        return self._at(self._state.position[first] + self._scene.bodies.radius[first] * normal)

    def _line(self, start: Floats, end: Floats, width: int, colour: Color) -> None:
        for wider, ink in ((HALO, self._palette.ground), (0, colour)):
            pygame.draw.line(self._surface, ink, start.tolist(), end.tolist(), width + wider)

    # The velocities

    def _arrows(self, before: Velocities | None, after: Velocities | None, colour: Color) -> Iterator["Arrow"]:
        for velocities, is_before in ((before, True), (after, False)):
            for ball, velocity in zip(self._difference.balls, velocities or (), strict=False):
                radius, speed = float(self._scene.bodies.radius[ball]) * self._scale, math.hypot(*velocity)
                if not speed:
                    continue
                centre, along = self._at(self._state.position[ball]), np.array(velocity)
                rim = centre + (-radius if is_before else radius) * along / speed
                if is_before:  # beside the one after it, or a ball that comes back would hide it
                    rim = rim + 0.6 * self._unit * np.array([-along[1], along[0]]) / speed
                yield Arrow(rim, self._px_per_speed * along, is_before, colour)

    @property
    def _px_per_speed(self) -> float:
        """The length of an arrow for a speed of 1 px/s, px of the surface."""
        found = self._difference
        each = (found.before, found.after, found.should_after)
        fastest = max((math.hypot(*one) for velocities in each for one in velocities or ()), default=0.0)
        return ARROW * self._unit / fastest if fastest else 0.0

    def _draw_arrows(self, arrows: Sequence["Arrow"]) -> None:
        """Draw arrows, all shorter by one factor if one would leave the pane."""
        room = self._surface.get_rect().inflate(-4 * self._width, -4 * self._width)
        shrunk = max(SHORTEST, min((one.share_inside(room) for one in arrows), default=1.0))
        for one in arrows:
            tail, tip = (end.tolist() for end in one.ends(shrunk))
            width = (BEFORE if one.is_before else AFTER) * self._width
            arrow(self._surface, self._palette.ground, tail, tip, width + HALO)
            arrow(self._surface, one.colour, tail, tip, width)

    # The overlap

    @property
    def _has_depth(self) -> bool:
        """Whether the engine found the contact before or after the two touched."""
        found, radius = self._difference, float(self._scene.bodies.radius[self._difference.first])
        return found.normal is not None and found.depth is not None and abs(found.depth) > NEGLIGIBLE * radius

    def write_depth(self) -> None:
        """Write how deep the overlap is beside it, if it has one."""
        depth, radius = self._difference.depth, float(self._scene.bodies.radius[self._difference.balls].max())
        if self._has_depth and depth is not None:
            size = self._scene.units.text(Dimension.LENGTH, "{:.2g}", abs(depth))
            text = f"overlap {size}" if depth > 0 else f"apart by {size}"
            width, room, point = text_width(text, self._text_height), self._surface.get_rect(), self._contact_point
            x, y = self._difference.normal or (0.0, 0.0)
            aside = np.array([-y, x]) * (radius * self._scale + 1.5 * self._text_height + abs(y) * width / 2)
            middle = np.array(room.center)  # on its side, there is more room
            near = min((point + aside, point - aside), key=lambda place: float(np.abs(place - middle).max()))
            label(self._surface, text, near.tolist(), self._text_height, room, self._palette)


class Arrow(NamedTuple):
    """A velocity at a ball: it ends at the ball's rim if it is the one before the contact, else it begins there."""

    rim: Floats  # px of the surface, as is the velocity
    velocity: Floats
    is_before: bool
    colour: Color

    def ends(self, share: float) -> tuple[Floats, Floats]:
        """Return tail and tip of an arrow of a share of its length."""
        along = share * self.velocity
        return (self.rim - along, self.rim) if self.is_before else (self.rim, self.rim + along)

    def share_inside(self, room: Rect) -> float:
        """Return the share of its length that stays in a place; 1 if none of it does, as its ball is elsewhere."""
        tail, tip = (end.tolist() for end in self.ends(1.0))
        clipped = room.clipline(tail, tip)
        return math.dist(*clipped) / math.dist(tail, tip) if clipped else 1.0


@dataclass(eq=False)
class ContactPicture(Widget):
    """Draws a contact that differs as `ContactMark` does, with its balls as an engine found them.

    state: of the engine, at the end of the contact's step; colour: the engine's.
    """

    scene: Scene
    state: State
    difference: Difference
    colour: Color

    takes_keys = False

    def __post_init__(self) -> None:
        found, bodies = self.difference, self.scene.bodies
        normal = found.normal or found.should_normal
        second = found.second
        if normal and second is not None and second >= 0:
            position = self.state.position.copy()
            reach = bodies.radius[found.first] + bodies.radius[second] - (found.depth or 0.0)
            position[second] = position[found.first] + reach * np.array(normal)
            self.state = replace(self.state, position=position)

    def height(self, width: int, text_height: int) -> int:
        """Return its height, px."""
        return round(HEIGHT * text_height)

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw the bodies, and the contact over them, unless a part of the place is not seen."""
        if not surface.get_clip().contains(place):
            return
        scene, balls = self.scene, self.difference.balls
        picture = Surface(place.size)
        picture.fill(palette(scene.arena.background).ground)
        scale = RADIUS * text_height / float(scene.bodies.radius[balls].max())
        middle = self.state.position[balls].mean(axis=0)
        x, y = np.divide(place.size, 2) - scale * middle
        draw_walls(picture, scene, scale, (float(x), float(y)))
        for ball in balls:
            centre = scale * self.state.position[ball] + (x, y)
            pygame.draw.circle(picture, rgb(scene.colors[ball]), centre, scale * scene.bodies.radius[ball])
        canvas = Canvas(picture, scene, self.state, scale, text_height, (float(x), float(y)))
        mark = ContactMark(canvas, self.difference)
        mark.draw(self.colour, overlap=True)
        mark.write_depth()
        surface.blit(picture, place)
