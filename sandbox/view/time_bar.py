"""The time bar: where the current step is in a run, for windows without charts."""

import pygame
from pygame import Rect, Surface

from sandbox.view.palette import FAINT, INK, RAISED


def draw_time_bar(surface: Surface, place: Rect, step: int, end: int) -> None:
    """Draw a step between the start and the latest step reached."""
    if not place.height:
        return
    knob = place.height // 2
    track = Rect(place.x + knob, place.centery - 1, place.width - 2 * knob, 3)
    x = track.x + round(track.width * step / max(end, 1))
    surface.fill(RAISED, track)
    surface.fill(FAINT, (track.x, track.y, x - track.x, track.height))
    pygame.draw.circle(surface, INK, (x, place.centery), knob)


def step_of_point(place: Rect, x: int, end: int) -> int:
    """Return the step that a bar at a place shows at x, px of the window. end: the latest step reached."""
    knob = place.height // 2
    share = (x - place.x - knob) / max(1, place.width - 2 * knob)
    return round(min(max(share, 0.0), 1.0) * end)
