"""A pane's canvas, and the layers over and under its balls: arrows, trails, contacts, numbers."""

import math
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import compress, pairwise
from typing import Final

import numpy as np
import pygame
from pygame import Color, Rect, Surface

from sandbox.quantity import length
from sandbox.report.scales import round_up
from sandbox.scene.fields import Vector, rgb
from sandbox.scene.model import Scene
from sandbox.state import Contacts, Floats, State
from sandbox.view import Layer
from sandbox.view.primitives import MIN_DASHED, SMALLEST_TEXT, arrow, lettering, ring
from sandbox.view.theme import Palette, contrast, palette, readable

ARROW_SECONDS: Final = 0.2  # a velocity's arrow ends where the ball would be after so long
MAX_WRITTEN: Final = 12  # contacts whose impulse is written next to them
MAX_NUMBERED: Final = 1_000  # balls; their numbers would hide them, and take half a second a frame
MAX_RING: Final = 200  # px; larger outlines are drawn without smooth edges
MIN_NUMBERED: Final = 1.4  # diameter of a ball that its number is written on, in heights of that
MIN_CONTRAST: Final = 3.0  # of an outline with its ground
MIN_APART: Final = 1.5  # px of the screen between a ball and its outline; closer ones would only fray it
MIN_CELL: Final = 40  # px of the screen between two lines of the grid
MAX_POSITIONS: Final = 90  # kept of a ball
MAX_POSITIONS_OF_ALL: Final = 20_000  # kept of all balls together
MAX_PAUSE: Final = 1.0  # s between two positions of one trail
CONTACT_SECONDS: Final = 0.4  # s of the scene that a contact is kept for
MAX_CONTACTS: Final = 200  # kept at once, the latest
LOCATED: Final = np.dtype([("time", "f8"), ("point", "f8", (2,)), ("normal", "f8", (2,)), ("impulse", "f8")])


@dataclass(frozen=True)
class Canvas:
    """A surface that shows a scene in some state.

    scale: px of the surface for one px of the scene; text_height: px; origin: where the scene's is on it.
    """

    surface: Surface
    scene: Scene
    state: State
    scale: float
    text_height: int
    origin: Vector = (0.0, 0.0)

    @property
    def palette(self) -> Palette:
        """The colours on the scene's background."""
        return palette(self.scene.arena.background)

    def at(self, position: Floats) -> Floats:
        """Turn positions in the scene, (..., 2) px, into places on the surface."""
        return position * self.scale + self.origin


class Trail:
    """Where an engine's balls were at the steps shown, in bounded memory."""

    def __init__(self, balls: int) -> None:
        kept = max(2, min(MAX_POSITIONS, MAX_POSITIONS_OF_ALL // balls))
        self._positions: deque[tuple[float, Floats]] = deque(maxlen=kept)

    def add(self, state: State) -> None:
        """Add all balls' positions. Later ones are dropped if time has gone back, and all after a long pause."""
        while self._positions and self._positions[-1][0] >= state.time:
            self._positions.pop()
        if self._positions and state.time - self._positions[-1][0] > MAX_PAUSE:
            self._positions.clear()
        self._positions.append((state.time, state.position))

    def positions(self) -> Floats:
        """Return the positions kept, oldest first: (positions, n, 2) px."""
        return np.array([position for _, position in self._positions])


class RecentContacts:
    """An engine's latest contacts, with their positions.

    Engines do not report positions. A contact is put on the rim of its first ball, which is followed back to the time
    of the contact at its velocity since then.
    """

    def __init__(self) -> None:
        self._kept = deque[Contacts](maxlen=MAX_CONTACTS)  # those of each step that had some, oldest first
        self._time = -math.inf  # s, of the last call

    def add(self, contacts: Contacts, state: State, radius: Floats) -> None:
        """Add an engine's contacts since the last call. Later ones are dropped if time has gone back.

        state: of the engine now; radius: of its balls, (n,) px.
        """
        self._time, kept = state.time, self._kept
        while kept and kept[-1]["time"][-1] > state.time:
            kept.pop()
        if len(contacts):
            kept.append(_located(contacts[-MAX_CONTACTS:], state, radius))  # of many, the others are not kept anyway
        while kept and kept[0]["time"][-1] <= state.time - CONTACT_SECONDS:
            kept.popleft()

    def latest(self) -> Contacts:
        """Return time (s), point (px), normal and impulse (kg px/s) of the contacts kept, oldest first."""
        kept = np.concatenate([np.empty(0, LOCATED), *self._kept])
        return kept[kept["time"] > self._time - CONTACT_SECONDS][-MAX_CONTACTS:]


def _located(contacts: Contacts, state: State, radius: Floats) -> Contacts:
    """Return what is kept of some contacts."""
    new = np.empty(len(contacts), LOCATED)
    first, since = contacts["first"], (state.time - contacts["time"])[:, None]
    centre = state.position[first] - since * state.velocity[first]
    new["point"] = centre + radius[first, None] * contacts["normal"]
    for name in ("time", "normal", "impulse"):
        new[name] = contacts[name]
    return new


class Overlay:
    """Draws layers on one pane's arena. ghosts: the reference's balls."""

    def __init__(self, canvas: Canvas, trail: Trail, contacts: RecentContacts, ghosts: State | None) -> None:
        self._canvas, self._trail, self._contacts, self._ghosts = canvas, trail, contacts, ghosts
        self.surface, self.scene, self.palette = canvas.surface, canvas.scene, canvas.palette
        self._state, self._scale, self._at = canvas.state, canvas.scale, canvas.at
        self.width = max(1, round(canvas.text_height / 10))  # of lines, px

    def _visible(self, colour: str) -> tuple[int, int, int]:
        """Return a ball's colour, or the nearest that is visible as a thin line."""
        ground = self.palette.ground
        return _line_colour(rgb(colour), (ground.r, ground.g, ground.b))

    def grid(self) -> None:
        """Draw lines at round distances, with their positions in px of the scene."""
        cell = round_up(MIN_CELL / self._scale)
        (width, height), small = self.surface.get_size(), round(0.7 * self._canvas.text_height)
        for axis, size in enumerate(self.scene.arena.size):
            for k in range(1, int(size / cell) + 1):
                at = round(k * cell * self._scale + self._canvas.origin[axis])
                start, end = ((at, 0), (at, height)) if axis == 0 else ((0, at), (width, at))
                pygame.draw.line(self.surface, self.palette.faint, start, end)
                number = lettering(f"{k * cell:g}", self.palette.ground.lerp(self.palette.ink, 0.5), small)
                self.surface.blit(number, (at + 2, 1) if axis == 0 else (2, at + 1))

    def trails(self) -> None:
        """Draw where the balls were, in their colours, fainter the longer ago."""
        positions = self._trail.positions()
        lines = np.rint(self._at(positions)).astype(int).swapaxes(0, 1)
        cuts = [round(k * (len(positions) - 1) / 4) for k in range(5)]  # into four lines that meet
        for k, (start, end) in enumerate(pairwise(cuts)):
            for line, colour in zip(lines[:, start : end + 1].tolist(), self.scene.colors, strict=True):
                if end > start:
                    faded = self.palette.ground.lerp(self._visible(colour), (k + 1) / 4)
                    pygame.draw.lines(self.surface, faded, False, line, self.width)

    def velocity(self) -> None:
        """Draw an arrow from each ball to where its velocity takes it in ARROW_SECONDS."""
        position = self._state.position
        tips = self._at(position + ARROW_SECONDS * self._state.velocity)
        for tail, tip in zip(self._at(position).tolist(), tips.tolist(), strict=True):
            arrow(self.surface, self.palette.ink, tail, tip, self.width)

    def contacts(self) -> None:
        """Draw each contact as a dot, and a line along its normal as long as its impulse is large. They fade."""
        contacts = self._contacts.latest()
        if not len(contacts):
            return
        px_per_impulse = 4 * self._canvas.text_height / (contacts["impulse"].max() or 1.0)  # all impulses can be 0
        for contact in contacts:
            fresh = 1 - (self._state.time - contact["time"]) / CONTACT_SECONDS
            colour = self.palette.ground.lerp(self.palette.contact, 0.3 + 0.7 * fresh)
            x, y = self._at(contact["point"]).tolist()
            dx, dy = (contact["normal"] * max(contact["impulse"] * px_per_impulse / 2, 1.0)).tolist()
            pygame.draw.line(self.surface, colour, (x - dx, y - dy), (x + dx, y + dy), self.width)
            pygame.draw.circle(self.surface, colour, (round(x), round(y)), 2 * self.width + 1)
        self._write_impulses(contacts[: -MAX_WRITTEN - 1 : -1])

    def _write_impulses(self, contacts: Contacts) -> None:
        """Write impulses next to their contacts, where there is room, in the order given."""
        written: list[Rect] = []
        for contact in contacts:
            number = lettering(f"{contact['impulse']:.3g}", self.palette.ink, round(0.8 * self._canvas.text_height))
            x, y = self._at(contact["point"]).round().astype(int).tolist()
            place = number.get_rect(midleft=(x + 3 * self.width + 2, y)).clamp(self.surface.get_rect())
            if place.collidelist(written) < 0:
                self.surface.blit(number, place)
                written.append(place)

    def centre(self) -> None:
        """Draw the centre of mass as its usual symbol: a disc of two light and two dark quarters."""
        mass = self.scene.bodies.mass
        at = self._at(mass @ self._state.position / mass.sum()).round().astype(int).tolist()
        radius = round(0.55 * self._canvas.text_height)
        pygame.draw.circle(self.surface, self.palette.ground, at, radius)
        for quarter in ({"draw_top_right": True}, {"draw_bottom_left": True}):
            pygame.draw.circle(self.surface, self.palette.ink, at, radius, **quarter)
        pygame.draw.circle(self.surface, self.palette.ink, at, radius, self.width)

    def numbers(self) -> None:
        """Write each ball's number on it, or above it if it is small, unless there are too many to read them."""
        if len(self.scene.bodies) > MAX_NUMBERED:
            return
        centres = self._at(self._state.position).tolist()
        balls = zip(centres, self.scene.bodies.radius, self.scene.colors, strict=True)
        for number, ((x, y), radius, colour) in enumerate(balls):
            px = radius * self._scale
            height = max(SMALLEST_TEXT, min(round(px), self._canvas.text_height))
            has_room = 2 * px >= MIN_NUMBERED * height
            text = lettering(str(number), contrast(Color(*rgb(colour))) if has_room else self.palette.ink, height)
            centre = round(x), round(y if has_room else y - px - height / 2)
            if has_room:  # over the line that shows the ball's angle
                pygame.draw.circle(self.surface, rgb(colour), centre, min(0.85 * height, px - 1))
            self.surface.blit(text, text.get_rect(center=centre))

    def ghosts(self) -> None:
        """Draw the outlines of the reference's balls, except those that lie on their ball."""
        if self._ghosts is None:
            return
        centres, width, inside = self._at(self._ghosts.position), max(2, self.width), self.surface.get_rect()
        apart = length(centres - self._at(self._state.position)) > MIN_APART
        balls = zip(centres.round().astype(int).tolist(), self.scene.bodies.radius, self.scene.colors, strict=True)
        for centre, radius, colour in compress(balls, apart):
            px = max(2, round(radius * self._scale))
            visible = self._visible(colour)
            if px > MAX_RING:
                pygame.draw.circle(self.surface, visible, centre, px, width)
                continue
            picture = ring(px, visible, 1 if px < MIN_DASHED else width)
            place = picture.get_rect(center=centre)
            if place.colliderect(inside):
                self.surface.blit(picture, place)

    def pull(self, ball: int, target: Vector) -> None:
        """Draw a ring round a held ball, and the line from it to where it is pulled, px of the scene."""
        start, end = self._at(np.array([self._state.position[ball], target])).round().astype(int).tolist()
        radius = self.scene.bodies.radius[ball] * self._scale
        width = max(2, self.width)
        pygame.draw.circle(self.surface, self.palette.ground, start, radius + 2 * width, width)
        pygame.draw.circle(self.surface, self.palette.ink, start, radius + 3 * width, width)
        pygame.draw.line(self.surface, self.palette.ink, start, end, width)
        pygame.draw.circle(self.surface, self.palette.ink, end, 2 * self.width + 2)


# What draws each layer, in the order of drawing. Layer.CHARTS is not in a pane.
BELOW_BALLS: Final[Mapping[Layer, Callable[[Overlay], None]]] = {
    Layer.GRID: Overlay.grid,
    Layer.TRAILS: Overlay.trails,
}
ABOVE_BALLS: Final[Mapping[Layer, Callable[[Overlay], None]]] = {
    Layer.GHOSTS: Overlay.ghosts,
    Layer.VELOCITY: Overlay.velocity,
    Layer.NUMBERS: Overlay.numbers,
    Layer.CONTACTS: Overlay.contacts,
    Layer.CENTRE: Overlay.centre,
}


@lru_cache(maxsize=256)
def _line_colour(colour: tuple[int, int, int], ground: tuple[int, int, int]) -> tuple[int, int, int]:
    """Return a ball's colour, or the nearest that is visible as a thin line on a ground."""
    visible = readable(Color(*colour), Color(*ground), MIN_CONTRAST)
    return visible.r, visible.g, visible.b
