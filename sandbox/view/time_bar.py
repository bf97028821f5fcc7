"""The bar of time: where one is in a run, for windows without charts."""

import pygame
from pygame import Rect, Surface

from sandbox.view.palette import FAINT, INK, RAISED


def draw_time_bar(surface: Surface, place: Rect, step: int, end: int) -> None:
    """Draw how far a step is on the way to the furthest that was reached."""
    if not place.height:
        return
    knob = place.height // 2
    track = Rect(place.x + knob, place.centery - 1, place.width - 2 * knob, 3)
    x = track.x + round(track.width * step / max(end, 1))
    surface.fill(RAISED, track)
    surface.fill(FAINT, (track.x, track.y, x - track.x, track.height))
    pygame.draw.circle(surface, INK, (x, place.centery), knob)


def step_at(place: Rect, x: int, end: int) -> int:
    """Return the step that the bar has at x, px of the window."""
    knob = place.height // 2
    share = (x - place.x - knob) / max(1, place.width - 2 * knob)
    return round(min(max(share, 0.0), 1.0) * end)
