"""The status line: the time, what is being recorded, and a message or the scene's title."""

from typing import Final

import pygame
from pygame import Color, Rect, Surface

from sandbox.view.notice import Kind, Notice
from sandbox.view.palette import FAINT, GREEN, INK, VERMILLION
from sandbox.view.primitives import text_width, write

RECORDING: Final = Color(VERMILLION)
SIGNS: Final = {
    Kind.HINT: "",
    Kind.DONE: "OK",
    Kind.ERROR: "!",
}  # not everybody distinguishes the colours
GROUNDS: Final = {Kind.DONE: Color(GREEN), Kind.ERROR: Color(VERMILLION)}


def draw_status_line(
    surface: Surface, place: Rect, height: int, time: str, recorded: float | None, notice: Notice, scene: str
) -> None:
    """Draw the status line. height: of the text, px; recorded: s, None while nothing is being recorded."""
    end = write(surface, time, place, FAINT, height)
    if recorded is not None:
        radius = round(0.4 * height)
        pygame.draw.circle(surface, RECORDING, (end + 2 * height, place.centery), radius)
        left = end + round(2.8 * height)
        end = write(surface, f"{recorded:.1f} s", _rest(place, left), INK, height)
    rest = _rest(place, end + 2 * height)
    if notice.text:
        _draw_notice(surface, rest, height, notice)
    else:
        write(surface, scene, rest, FAINT, height)


def _rest(place: Rect, left: int) -> Rect:
    return Rect(left, place.y, max(0, place.right - left), place.height)


def _draw_notice(surface: Surface, place: Rect, height: int, notice: Notice) -> None:
    """Write a message, after a sign on the colour of its kind."""
    sign = SIGNS[notice.kind]
    if sign:
        chip = Rect(place.x, 0, text_width(sign, height) + height, round(1.4 * height))
        chip.centery = place.centery
        pygame.draw.rect(surface, GROUNDS[notice.kind], chip.clip(place), border_radius=height // 4)
        write(surface, sign, chip.move(height // 2, 0).clip(place), INK, height)
        place = _rest(place, chip.right + height // 2)
    write(surface, notice.text, place, INK, height)
