"""The balls' momenta head to tail, and their kinetic energies as bars, in each engine at the step shown."""

from collections.abc import Mapping
from typing import Final

import numpy as np
import pygame
from pygame import Color, Rect, Surface

from sandbox.quantity import kinetic_energies, length
from sandbox.report.scales import round_up
from sandbox.scene.fields import rgb
from sandbox.session.history import Moment
from sandbox.state import Bodies, Floats, State
from sandbox.view.palette import Palette
from sandbox.view.primitives import arrow, shortened, text_width, write
from sandbox.view.theme import readable

MAX_BALLS: Final = 30  # with more, arrows and bars are too small to distinguish
GAP: Final = 1.2  # between two engines, in heights of the text
MOMENTUM_UNIT: Final = "kg px/s"
ENERGY_UNIT: Final = "kg px²/s²"
MIN_SIZE: Final = 1e-9  # of any unit; what is smaller is an engine's rounding error


class BallChart:
    """Draws a section for each engine. Its scales only grow, so that arrows and bars of all steps can be compared."""

    def __init__(self, colours: Mapping[str, Color], palette: Palette) -> None:
        self._colours = colours
        self._palette = palette
        self._low, self._high = np.zeros(2), np.zeros(2)  # what the arrows have reached so far, kg px/s
        self._most = 0.0  # energy of all balls so far, kg px²/s²
        self._refusal = ""

    def rows_at(self, place: Rect, point: tuple[int, int], moment: Moment) -> list[list[str]]:
        """Return each ball's momentum and energy in the engine at a point of the chart, as rows of a table."""
        if self._refusal:
            return [[self._refusal]]
        names = list(moment.states)
        name = names[min(max((point[0] - place.x) * len(names) // place.width, 0), len(names) - 1)]
        state, bodies = moment.states[name], moment.scene.bodies
        momenta, energies = state.velocity * bodies.mass[:, None], _energies(state, bodies)
        rows = [[name, MOMENTUM_UNIT, ENERGY_UNIT]]
        for ball, ((x, y), energy) in enumerate(zip(momenta.tolist(), energies.tolist(), strict=True)):
            rows.append([f"ball {ball}", f"{x:,.5g}, {y:,.5g}", f"{energy:,.6g}"])
        x, y = momenta.sum(axis=0).tolist()
        return [*rows, ["all", f"{x:,.5g}, {y:,.5g}", f"{energies.sum():,.6g}"]]

    def draw(self, surface: Surface, place: Rect, moment: Moment, height: int) -> None:
        """Draw every engine's section side by side. height: of the text, px."""
        surface.fill(self._palette.ground, place)
        count = len(moment.scene.bodies)
        self._refusal = f"{count:,} balls are too many: at most {MAX_BALLS} are drawn" if count > MAX_BALLS else ""
        if self._refusal:
            write(surface, self._refusal, place, self._palette.ink, height)
            return
        self._grow(moment)
        gap, count = round(GAP * height), len(moment.states)
        width = (place.width + gap) // count
        for k, (name, state) in enumerate(moment.states.items()):
            section = Rect(place.x + k * width, place.y, width - gap, place.height)
            self._draw_section(surface, section, name, state, moment, height)

    def _grow(self, moment: Moment) -> None:
        """Make the scales include every engine at a moment."""
        for state in moment.states.values():
            path = _path(state, moment.scene.bodies)
            self._low, self._high = np.minimum(self._low, path.min(axis=0)), np.maximum(self._high, path.max(axis=0))
            self._most = max(self._most, float(_energies(state, moment.scene.bodies).sum()))

    def _draw_section(
        self, surface: Surface, place: Rect, name: str, state: State, moment: Moment, height: int
    ) -> None:
        line = round(1.5 * height)
        write(surface, name, Rect(place.x, place.y, place.width, line), self._colours[name], height, bold=True)
        left = Rect(place.x, place.y + line, place.width // 2 - height // 2, place.height - 2 * line)
        right = Rect(left.right + height, left.y, place.right - left.right - height, left.height)
        bodies, colours = moment.scene.bodies, self._ball_colours(moment)
        path, energies = _path(state, bodies), _energies(state, bodies)
        self._draw_momenta(surface, left, path, colours, height)
        self._draw_energies(surface, right, energies, colours)
        total = 0.0 + float(length(path[-1])) * (length(path[-1]) > MIN_SIZE)
        self._caption(surface, left, "momentum", f"{total:,.5g} {MOMENTUM_UNIT}", height)
        self._caption(surface, right, "energy", f"{energies.sum():,.6g} {ENERGY_UNIT}", height)

    def _caption(self, surface: Surface, above: Rect, name: str, value: str, height: int) -> None:
        """Write a value below a drawing, after its name if there is room."""
        text = f"{name} {value}" if text_width(f"{name} {value}", height) <= above.width else value
        place = Rect(above.x, above.bottom, above.width, round(1.5 * height))
        write(surface, shortened(text, above.width, height), place, self._palette.ink, height)

    def _ball_colours(self, moment: Moment) -> list[Color]:
        return [readable(Color(*rgb(colour)), self._palette.ground) for colour in moment.scene.colors]

    def _draw_momenta(self, surface: Surface, place: Rect, path: Floats, colours: list[Color], height: int) -> None:
        """Draw the momenta head to tail, from a dot, and below them their sum."""
        reach, room = self._high - self._low, place.inflate(-height, -height)
        scale = min(room.width / max(reach[0], MIN_SIZE), room.height / max(reach[1], MIN_SIZE))
        corner = np.array(room.center) - scale * (self._low + self._high) / 2
        points = (corner + scale * path).tolist()
        width = max(2, height // 6)
        arrow(surface, self._palette.law, points[0], points[-1], 2 * width)
        for tail, tip, colour in zip(points, points[1:], colours, strict=False):
            arrow(surface, colour, tail, tip, width)
        pygame.draw.circle(surface, self._palette.ink, points[0], max(2, height // 5))

    def _draw_energies(self, surface: Surface, place: Rect, energies: Floats, colours: list[Color]) -> None:
        """Draw a bar for each ball, and last one of all, in which they stand on one another."""
        top, floor = round_up(max(self._most, MIN_SIZE)), place.bottom - 2
        step = place.width / (len(energies) + 2)
        thick = max(2, min(round(0.7 * step), place.height // 3))
        heights = (energies / top * (place.height - 4)).tolist()
        pile = float(floor)
        for k, (tall, colour) in enumerate(zip(heights, colours, strict=True)):
            bar = Rect(round(place.x + k * step), round(floor - tall), thick, 0)
            bar.height = floor - bar.y
            surface.fill(colour, bar)
            above = pile - tall
            last = Rect(place.right - thick - 1, round(above), thick, round(pile) - round(above))
            surface.fill(colour, last)
            pile = above
        pygame.draw.line(surface, self._palette.law, (place.x, floor), (place.right - 1, floor))


def _path(state: State, bodies: Bodies) -> Floats:
    """Return the points between the momenta when each begins where the one before ends, kg px/s: (n + 1, 2)."""
    momenta = state.velocity * bodies.mass[:, None]
    return np.vstack([np.zeros(2), np.cumsum(momenta, axis=0)])


def _energies(state: State, bodies: Bodies) -> Floats:
    """Return the kinetic energies of the balls, kg px²/s²: (n,)."""
    return kinetic_energies(state.velocity, state.spin, bodies.mass, bodies.moment)
