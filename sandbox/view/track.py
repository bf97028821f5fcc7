"""The track of the timeline: where the current step is in a run, and what stands out in it."""

from collections.abc import Mapping
from typing import Final

import pygame
from pygame import Color, Rect, Surface

from sandbox.session.session import Session
from sandbox.view.theme import theme

THICKNESS: Final = 4  # px
MARK: Final = 2  # px, half of the width of the gap round a mark


def track_end(session: Session) -> int:
    """Return the step at the end of the track: that of the scene's seconds, or a later one that has been reached."""
    return max(session.end, session.start.steps, 1)


def step_of_point(place: Rect, x: int, end: int) -> int:
    """Return the step that a track at a place shows at x, px of the window. end: its last step."""
    return round(min(max((x - place.x) / max(1, place.width - 1), 0.0), 1.0) * end)


def draw_track(
    surface: Surface, place: Rect, step: int, reached: int, end: int, marks: Mapping[int, Color], height: int
) -> None:
    """Draw the current step, how far the run has been, and marks at some steps. height: of the text, px."""

    def column(at: int) -> int:
        return place.x + round((place.width - 1) * min(at / end, 1.0))

    line = Rect(place.x, place.centery - THICKNESS // 2, place.width, THICKNESS)
    pygame.draw.rect(surface, theme.line, line, border_radius=2)
    line.width = column(reached) - place.x
    pygame.draw.rect(surface, theme.line.lerp(theme.dim, 0.5), line, border_radius=2)
    line.width = column(step) - place.x
    pygame.draw.rect(surface, theme.accent, line, border_radius=2)
    for at, colour in marks.items():
        surface.fill(colour, Rect(column(at) - 1, place.y + 2, MARK, place.height - 4))
    knob = Rect(0, 0, round(0.9 * height), round(1.1 * height))
    knob.center = column(step), place.centery
    pygame.draw.rect(surface, theme.accent, knob, border_radius=height // 4)
