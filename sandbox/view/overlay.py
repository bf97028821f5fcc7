"""What can be shown over a pane's balls: arrows, trails, contacts, numbers and the like."""

from collections import deque
from itertools import pairwise
from typing import Final

import numpy as np
import pygame
from pygame import Color, Rect, Surface

from sandbox.quantity import length
from sandbox.run.mouse import Hand
from sandbox.scene.model import Scene, rgb
from sandbox.state import Contacts, Floats, State
from sandbox.view.palette import contrast, palette
from sandbox.view.primitives import arrow, lettering

ARROW: Final = 0.2  # s; a velocity's arrow ends where the ball would be after so long
TRAIL: Final = 90  # places of a ball that are kept
TRAILS: Final = 20_000  # places of all balls together
BREAK: Final = 1.0  # s without a place, over which no line is drawn
SPARK: Final = 0.4  # s of the scene that a contact is shown for
SPARKS: Final = 200  # contacts shown at once, the latest
NUMBERED: Final = 12  # so many contacts at most are shown with their impulse in figures
CELL: Final = 40  # px of the screen at least between two lines of the grid


class Trail:
    """Where an engine's balls were, at the times when they were looked at: so many places, the oldest forgotten."""

    def __init__(self, balls: int) -> None:
        self._places: deque[tuple[float, Floats]] = deque(maxlen=max(2, min(TRAIL, TRAILS // balls)))

    def add(self, state: State) -> None:
        """Note a place of every ball. Where time has been turned back, what came after is forgotten."""
        while self._places and self._places[-1][0] >= state.time:
            self._places.pop()
        if self._places and state.time - self._places[-1][0] > BREAK:
            self._places.clear()
        self._places.append((state.time, state.position))

    def places(self) -> Floats:
        """Return the places kept, oldest first: (places, n, 2) px."""
        return np.array([position for _, position in self._places])


class RecentContacts:
    """The latest contacts of an engine, with where they were.

    An engine does not say where two balls met: a contact is put where the first ball touched then, which at its speed
    since then it has left by now.
    """

    def __init__(self, radius: Floats) -> None:
        self._radius = radius
        self._kept = np.empty(0, [("time", "f8"), ("point", "f8", (2,)), ("normal", "f8", (2,)), ("impulse", "f8")])

    def add(self, contacts: Contacts, state: State) -> None:
        """Note contacts that an engine has had lately. state: of the engine now."""
        new = np.empty(len(contacts), self._kept.dtype)
        first, since = contacts["first"], (state.time - contacts["time"])[:, None]
        centre = state.position[first] - since * state.velocity[first]
        new["point"] = centre + self._radius[first, None] * contacts["normal"]
        for name in ("time", "normal", "impulse"):
            new[name] = contacts[name]
        kept = np.concatenate([self._kept, new])
        self._kept = kept[(kept["time"] > state.time - SPARK) & (kept["time"] <= state.time)][-SPARKS:]

    def latest(self) -> Contacts:
        """Return time, point (px), normal and impulse (kg px/s) of contacts, oldest first."""
        return self._kept


class Overlay:
    """Draws on one pane's arena. scale: px of the surface for one px of the scene; text_height: px."""

    def __init__(self, surface: Surface, scene: Scene, scale: float, text_height: int) -> None:
        self.surface = surface
        self.scene = scene
        self.scale = scale
        self.text_height = text_height
        self.palette = palette(scene.arena.background)
        self.width = max(1, round(text_height / 10))  # of lines, px

    def grid(self) -> None:
        """Draw lines at round distances, with their places in px of the scene."""
        cell = round_up(CELL / self.scale)
        (width, height), small = self.surface.get_size(), round(0.7 * self.text_height)
        for axis, size in enumerate(self.scene.arena.size):
            for k in range(1, int(size / cell) + 1):
                at = round(k * cell * self.scale)
                start, end = ((at, 0), (at, height)) if axis == 0 else ((0, at), (width, at))
                pygame.draw.line(self.surface, self.palette.faint, start, end)
                number = lettering(f"{k * cell:g}", self.palette.ground.lerp(self.palette.ink, 0.5), small)
                self.surface.blit(number, (at + 2, 1) if axis == 0 else (2, at + 1))

    def trails(self, places: Floats) -> None:
        """Draw where balls were, in their colours, fainter the longer ago. places: (places, n, 2) px, oldest first."""
        lines = np.rint(places * self.scale).astype(int).swapaxes(0, 1)
        for start, end, share in _quarters(len(places)):
            for line, colour in zip(lines[:, start:end].tolist(), self.scene.colors, strict=True):
                pygame.draw.lines(
                    self.surface, self.palette.ground.lerp(Color(*rgb(colour)), share), False, line, self.width
                )

    def arrows(self, position: Floats, vector: Floats, colour: Color, width: int) -> None:
        """Draw an arrow from each ball to where a velocity takes it in `ARROW` s. vector: (n, 2) px/s."""
        tips = (position + ARROW * vector) * self.scale
        for tail, tip in zip((position * self.scale).tolist(), tips.tolist(), strict=True):
            arrow(self.surface, colour, tail, tip, width)

    def velocity(self, state: State) -> None:
        """Draw velocities."""
        self.arrows(state.position, state.velocity, self.palette.ink, self.width)

    def momentum(self, state: State) -> None:
        """Draw momenta, as the velocities that a ball of mean mass would have with them."""
        mass = self.scene.bodies.mass
        momentum = state.velocity * (mass / mass.mean())[:, None]
        self.arrows(state.position, momentum, self.palette.momentum, 2 * self.width)

    def contacts(self, sparks: Contacts, time: float) -> None:
        """Draw contacts: a dot, and along its normal as long a line as the impulse is large; fading with time."""
        if not len(sparks):
            return
        longest = 4 * self.text_height / (sparks["impulse"].max() or 1.0)  # they may touch and no more
        for spark in sparks:
            fresh = 1 - (time - spark["time"]) / SPARK
            colour = self.palette.ground.lerp(self.palette.contact, 0.3 + 0.7 * fresh)
            x, y = (spark["point"] * self.scale).tolist()
            dx, dy = (spark["normal"] * max(spark["impulse"] * longest / 2, 1.0)).tolist()
            pygame.draw.line(self.surface, colour, (x - dx, y - dy), (x + dx, y + dy), self.width)
            pygame.draw.circle(self.surface, colour, (round(x), round(y)), 2 * self.width + 1)
        written: list[Rect] = []
        for spark in sparks[: -NUMBERED - 1 : -1]:
            number = lettering(f"{spark['impulse']:.3g}", self.palette.ink, round(0.8 * self.text_height))
            x, y = (spark["point"] * self.scale).round().astype(int).tolist()
            place = number.get_rect(midleft=(x + 3 * self.width + 2, y)).clamp(self.surface.get_rect())
            if place.collidelist(written) < 0:
                self.surface.blit(number, place)
                written.append(place)

    def centre(self, state: State) -> None:
        """Draw the centre of mass, as its usual sign: a disc of two light and two dark quarters."""
        mass = self.scene.bodies.mass
        at = (mass @ state.position / mass.sum() * self.scale).round().astype(int).tolist()
        radius = round(0.55 * self.text_height)
        pygame.draw.circle(self.surface, self.palette.ground, at, radius)
        for quarter in ({"draw_top_right": True}, {"draw_bottom_left": True}):
            pygame.draw.circle(self.surface, self.palette.ink, at, radius, **quarter)
        pygame.draw.circle(self.surface, self.palette.ink, at, radius, self.width)

    def numbers(self, state: State) -> None:
        """Write each ball's number on it."""
        balls = zip((state.position * self.scale).tolist(), self.scene.bodies.radius, self.scene.colors, strict=True)
        for number, ((x, y), radius, colour) in enumerate(balls):
            height = max(9, min(round(radius * self.scale), self.text_height))
            text = lettering(str(number), contrast(colour), height)
            self.surface.blit(text, text.get_rect(center=(round(x), round(y))))

    def ghosts(self, state: State) -> None:
        """Draw the outlines of another engine's balls."""
        balls = zip((state.position * self.scale).tolist(), self.scene.bodies.radius, self.scene.colors, strict=True)
        for (x, y), radius, colour in balls:
            centre = round(x), round(y)
            pygame.draw.circle(
                self.surface, rgb(colour), centre, max(2, round(radius * self.scale)), max(2, self.width)
            )

    def pull(self, state: State, hand: Hand) -> None:
        """Draw the line from the held ball to where it is pulled."""
        if hand.ball is not None:
            start, end = ([round(c * self.scale) for c in point] for point in (state.position[hand.ball], hand.target))
            pygame.draw.line(self.surface, self.palette.ink, start, end, max(2, self.width))
            pygame.draw.circle(self.surface, self.palette.ink, end, 2 * self.width + 2)


def ball_at(state: State, radius: Floats, point: tuple[float, float]) -> tuple[int, float]:
    """Find the ball whose edge is nearest to a point, and how far that is: px, negative inside of the ball."""
    away = length(state.position - point) - radius
    ball = int(away.argmin())
    return ball, float(away[ball])


def round_up(size: float) -> float:
    """Return the least of 1, 2, 5, 10, 20, 50, ... that is as large as a size."""
    power = 10.0 ** np.floor(np.log10(size))
    return float(next(power * step for step in (1, 2, 5, 10) if power * step >= size * (1 - 1e-9)))


def _quarters(count: int) -> list[tuple[int, int, float]]:
    """Cut a trail of so many places into four lines that meet: first place, end, and how strong each is."""
    cuts = [round(k * (count - 1) / 4) for k in range(5)]
    return [(a, b + 1, (k + 1) / 4) for k, (a, b) in enumerate(pairwise(cuts)) if b > a]
