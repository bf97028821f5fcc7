"""A contact in which an engine differs from the reference, as a picture: normals, velocities and overlap.

What the engine found is in its colour, what the reference has in that of text. A velocity before the contact is a thin
arrow that ends at its ball, one after it a thick arrow that begins there.
"""

import math
from collections.abc import Sequence
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

HEIGHT: Final = 16.0  # of the picture, in heights of the text; the lengths below, likewise, fit into it
RADIUS: Final = 2.0  # of the larger ball
NORMAL: Final = 5.5  # half of a normal: long enough to see angles between normals
ARROW: Final = 3.5  # the longest arrow
DASHES: Final = 9  # of the normal at first touch
BEFORE: Final = 1.5  # width of an arrow, in widths of a line
AFTER: Final = 2.5
HALO: Final = 2  # px of the ground round a line, which set it off from balls


def ring_balls(surface: Surface, layout: Layout, panes: Sequence[Pane], balls: Sequence[int]) -> None:
    """Draw a ring round some balls in every pane."""
    width = max(1, layout.text_height // 10)
    for pane, arena in zip(panes, layout.arenas, strict=True):
        inside, ink = surface.subsurface(arena), palette(pane.scene.arena.background).ink
        for ball in balls:
            centre = layout.scale * pane.state.position[ball] + layout.origin
            radius = layout.scale * pane.scene.bodies.radius[ball] + 3 * width
            pygame.draw.circle(inside, ink, centre.round().tolist(), round(radius), width)


class ContactMark:
    """Draws a contact that differs over its bodies. colour: of the engine."""

    def __init__(self, canvas: Canvas, difference: Difference, colour: Color) -> None:
        self._difference, self._canvas, self._colour = difference, canvas, colour
        self._surface, self._state, self._at = canvas.surface, canvas.state, canvas.at
        self._radius = canvas.scale * canvas.scene.bodies.radius  # px of the surface
        self._width = max(1, round(canvas.text_height / 10))  # of lines, px

    def draw(self) -> None:
        """Draw everything."""
        ink, colour, found = self._canvas.palette.ink, self._colour, self._difference
        if found.second is not None and found.second < 0:
            walls, wall = walls_of(self._canvas.scene), ~found.second
            start, end = self._at(np.array([walls.start[wall], walls.end[wall]])).tolist()
            radius = max(float(walls.half_thickness[wall]) * self._canvas.scale, 2 * self._width)
            capsule(self._surface, self._canvas.palette.contact, start, end, radius)
        if found.should_normal:
            self._normal(found.should_normal, ink)
        if found.normal and found.should_normal:
            self._normal(found.should_normal, colour, dashed=True)
        if found.normal:
            self._normal(found.normal, colour)
        self._draw_arrows(found.before, found.should_after, ink)
        self._draw_arrows(found.before, found.after, colour)
        self._draw_depth()

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

    def _draw_arrows(self, before: Velocities, after: Velocities, colour: Color) -> None:
        """Draw velocities before the contact and after it, the fastest of all as long as ARROW."""
        found, unit = self._difference, self._canvas.text_height
        all_speeds = (math.hypot(*one) for one in (*found.before, *found.after, *found.should_after))
        scale = ARROW * unit / (max(all_speeds, default=0.0) or 1.0)  # px for 1 px/s
        for velocities, is_before in ((before, True), (after, False)):
            for ball, velocity in zip(found.balls, velocities, strict=False):
                speed, along = math.hypot(*velocity), np.array(velocity)
                if not speed:
                    continue
                rim = (-1 if is_before else 1) * self._radius[ball] * along / speed
                if is_before:  # beside the one after it, or a ball that comes back would hide it
                    rim += 0.6 * unit * np.array([-along[1], along[0]]) / speed - scale * along
                tail = self._at(self._state.position[ball]) + rim
                tip, width = tail + scale * along, (BEFORE if is_before else AFTER) * self._width
                for wider, ink in ((HALO, self._canvas.palette.ground), (0, colour)):
                    arrow(self._surface, ink, tail.tolist(), tip.tolist(), width + wider)

    def _draw_depth(self) -> None:
        """Draw how deep the overlap is, and write it beside it, if the engine found the contact too late or early."""
        found, height = self._difference, self._canvas.text_height
        radius = float(self._canvas.scene.bodies.radius[found.first])
        if found.normal is None or found.depth is None or abs(found.depth) <= NEGLIGIBLE * radius:
            return
        rim, normal = self._contact_point, np.array(found.normal)
        inner = rim - found.depth * self._canvas.scale * normal
        pygame.draw.line(self._surface, self._canvas.palette.contact, inner.tolist(), rim.tolist(), 3 * self._width)
        size = self._canvas.scene.units.text(Dimension.LENGTH, "{:.2g}", abs(found.depth))
        text = f"overlap {size}" if found.depth > 0 else f"apart by {size}"
        room, (x, y) = self._surface.get_rect(), normal
        far = float(self._radius[found.balls].max()) + 2.5 * height + abs(y) * text_width(text, height) / 2
        aside, middle = far * np.array([-y, x]), np.array(room.center)  # on its side, there is more room
        near = min((rim + aside, rim - aside), key=lambda place: float(np.abs(place - middle).max()))
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

    takes_keys = False

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
        ContactMark(canvas, self.difference, self.colour).draw()
        surface.blit(picture, place)
