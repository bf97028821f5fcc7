"""A contact in which an engine differs from the reference, drawn in the panes: normals, velocities and overlap.

What the engine found is in its colour, what the reference has in that of text. A velocity before the contact is a thin
arrow that ends at its ball, one after it a thick arrow that begins there.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import pygame
from pygame import Color, Rect, Surface

from sandbox.analysis.difference import Difference, Velocities
from sandbox.judge.thresholds import NEGLIGIBLE
from sandbox.scene.fields import Vector, rgb
from sandbox.scene.model import Scene
from sandbox.scene.units import Dimension
from sandbox.scene.walls import walls_of
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
Arrow = tuple[Floats, Floats, bool, Color]  # rim of its ball, way to its other end: px; whether it is before; colour


def draw_contact(surface: Surface, layout: Layout, panes: Sequence[Pane], difference: Difference, engine: str) -> None:
    """Draw a difference between an engine and the reference in every pane, and its overlap in the engine's own."""
    for pane, arena in zip(panes, layout.arenas, strict=True):
        inside = surface.subsurface(arena)
        canvas = Canvas(inside, pane.scene, pane.state, layout.scale, layout.text_height, layout.origin)
        colour = canvas.palette.engines(each.name for each in panes)[engine]
        ContactMark(canvas, difference).draw(colour, overlap=pane.name == engine)


class ContactMark:
    """Draws a contact that differs on one pane's arena."""

    def __init__(self, canvas: Canvas, difference: Difference) -> None:
        self._difference, self._canvas = difference, canvas
        self._surface, self._state, self._at = canvas.surface, canvas.state, canvas.at
        self._radius = canvas.scale * canvas.scene.bodies.radius  # px of the surface
        largest = float(self._radius[difference.balls].max())
        self._unit = min(canvas.text_height, max(largest, LEAST_UNIT * canvas.text_height))  # px
        self._width = max(1, round(self._unit / 10))  # of lines, px

    def draw(self, colour: Color, *, overlap: bool) -> None:
        """Draw everything. colour: of the engine; overlap: whether to draw how deep it is."""
        ink, found = self._canvas.palette.ink, self._difference
        if found.second is not None and found.second < 0:
            walls, wall = walls_of(self._canvas.scene), ~found.second
            start, end = self._at(np.array([walls.start[wall], walls.end[wall]])).tolist()
            radius = max(float(walls.half_thickness[wall]) * self._canvas.scale, 2 * self._width)
            capsule(self._surface, self._canvas.palette.contact, start, end, radius)
        for ball in found.balls:
            centre = self._at(self._state.position[ball]).round().astype(int).tolist()
            pygame.draw.circle(self._surface, ink, centre, round(self._radius[ball]) + 3 * self._width, self._width)
        if found.should_normal:
            self._normal(found.should_normal, ink)
        if found.normal and found.should_normal:
            self._normal(found.should_normal, colour, dashed=True)
        if found.normal:
            self._normal(found.normal, colour)
        should = self._arrows(found.before, found.should_after, ink)
        self._draw_arrows([*should, *self._arrows(found.before, found.after, colour)])
        if overlap and self._has_depth:
            rim = self._contact_point
            inner = rim - (found.depth or 0.0) * self._canvas.scale * np.array(found.normal)
            pygame.draw.line(self._surface, self._canvas.palette.contact, inner.tolist(), rim.tolist(), 3 * self._width)

    def _normal(self, normal: Vector, colour: Color, *, dashed: bool = False) -> None:
        """Draw a line along a normal, through where the engine or else the reference has the contact."""
        half, point = NORMAL * self._canvas.text_height * np.array(normal), self._contact_point
        shares = np.linspace(-1, 1, 2 * DASHES) if dashed else np.array([-1.0, 1.0])
        for ends in shares.reshape(-1, 2):
            start, end = (point + ends[:, None] * half).tolist()
            for wider, ink in ((HALO, self._canvas.palette.ground), (0, colour)):
                pygame.draw.line(self._surface, ink, start, end, self._width + wider)

    @property
    def _contact_point(self) -> Floats:
        """Where the first ball touches, on the surface."""
        found, first = self._difference, self._difference.first
        normal = np.array(found.normal or found.should_normal)
        return self._at(self._state.position[first] + self._canvas.scene.bodies.radius[first] * normal)

    def _arrows(self, before: Velocities, after: Velocities, colour: Color) -> Iterator[Arrow]:
        found = self._difference
        all_speeds = (math.hypot(*one) for one in (*found.before, *found.after, *found.should_after))
        scale = ARROW * self._unit / (max(all_speeds, default=0.0) or 1.0)  # px for 1 px/s
        for velocities, sign in ((before, -1), (after, 1)):
            for ball, velocity in zip(found.balls, velocities, strict=False):
                speed, along = math.hypot(*velocity), np.array(velocity)
                if not speed:
                    continue
                rim = self._at(self._state.position[ball]) + sign * self._radius[ball] * along / speed
                if sign < 0:  # beside the one after it, or a ball that comes back would hide it
                    rim = rim + 0.6 * self._unit * np.array([-along[1], along[0]]) / speed
                yield rim, sign * scale * along, sign < 0, colour

    def _draw_arrows(self, arrows: Sequence[Arrow]) -> None:
        """Draw arrows, all shorter by one factor if one would leave the pane, unless its ball is elsewhere."""
        room = self._surface.get_rect().inflate(-4 * self._width, -4 * self._width)
        lines = [(rim.tolist(), (rim + away).tolist()) for rim, away, *_ in arrows]
        seen = [math.dist(*clipped) / math.dist(*line) for line in lines if (clipped := room.clipline(*line))]
        shrunk = max(SHORTEST, min(seen, default=1.0))
        for rim, away, is_before, colour in arrows:
            tail, tip = rim.tolist(), (rim + shrunk * away).tolist()
            if is_before:
                tail, tip = tip, tail
            width = (BEFORE if is_before else AFTER) * self._width
            arrow(self._surface, self._canvas.palette.ground, tail, tip, width + HALO)
            arrow(self._surface, colour, tail, tip, width)

    @property
    def _has_depth(self) -> bool:
        """Whether the engine found the contact before or after the two touched."""
        found, radius = self._difference, float(self._canvas.scene.bodies.radius[self._difference.first])
        return found.normal is not None and found.depth is not None and abs(found.depth) > NEGLIGIBLE * radius

    def write_depth(self) -> None:
        """Write how deep the overlap is beside it, if it has one."""
        found, height = self._difference, self._canvas.text_height
        if self._has_depth and found.depth is not None:
            size = self._canvas.scene.units.text(Dimension.LENGTH, "{:.2g}", abs(found.depth))
            text = f"overlap {size}" if found.depth > 0 else f"apart by {size}"
            width, room, point = text_width(text, height), self._surface.get_rect(), self._contact_point
            x, y = found.normal or (0.0, 0.0)
            far = float(self._radius[found.balls].max()) + 1.5 * height + abs(y) * width / 2
            aside, middle = far * np.array([-y, x]), np.array(room.center)  # on its side, there is more room
            near = min((point + aside, point - aside), key=lambda place: float(np.abs(place - middle).max()))
            label(self._surface, text, near.tolist(), height, room, self._canvas.palette)


@dataclass(eq=False)
class ContactPicture(Widget):
    """Draws a contact that differs as `ContactMark` does, with its balls as an engine found them.

    state: of the engine, at the end of the contact's step; colour: the engine's.
    """

    scene: Scene
    state: State
    difference: Difference
    colour: Color

    def height(self, width: int, text_height: int) -> int:
        """Return its height, px."""
        return round(HEIGHT * text_height)

    @property
    def _as_found(self) -> State:
        """The state with the second ball where the engine found it."""
        found, radius, position = self.difference, self.scene.bodies.radius, self.state.position.copy()
        normal, second = found.normal or found.should_normal, found.second
        if normal and second is not None and second >= 0:
            reach = radius[found.first] + radius[second] - (found.depth or 0.0)
            position[second] = position[found.first] + reach * np.array(normal)
        return replace(self.state, position=position)

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw the bodies, and the contact over them, unless a part of the place is not seen."""
        if not surface.get_clip().contains(place):
            return
        scene, balls, state, picture = self.scene, self.difference.balls, self._as_found, Surface(place.size)
        picture.fill(palette(scene.arena.background).ground)
        scale = RADIUS * text_height / float(scene.bodies.radius[balls].max())
        x, y = (np.divide(place.size, 2) - scale * state.position[balls].mean(axis=0)).tolist()
        canvas = Canvas(picture, scene, state, scale, text_height, (x, y))
        draw_walls(picture, scene, scale, canvas.origin)
        for ball in balls:
            centre = scale * state.position[ball] + canvas.origin
            pygame.draw.circle(picture, rgb(scene.colors[ball]), centre, scale * scene.bodies.radius[ball])
        mark = ContactMark(canvas, self.difference)
        mark.draw(self.colour, overlap=True)
        mark.write_depth()
        surface.blit(picture, place)
