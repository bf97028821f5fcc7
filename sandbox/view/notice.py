"""A message to the user, shown until the next click or key: what was done, and what failed."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from enum import Enum, auto
from pathlib import Path
from typing import ClassVar, Final

import pygame
from pygame import Color, Rect, Surface

from sandbox.errors import SandboxError
from sandbox.view.display import Stopped
from sandbox.view.primitives import first_lines, panel, text_width, write
from sandbox.view.theme import GREEN, VERMILLION, readable, theme

MAX_LINES: Final = 4
SIGN_INK: Final = Color("white")
LOG: Final = logging.getLogger("sandbox.view")


class NoticeKind(Enum):
    """What a message is about, which its colour and its sign show."""

    HINT = auto()
    DONE = auto()
    ERROR = auto()


class Notice:
    """The latest message to the user: what was saved, what went wrong, or what to do.

    text: nothing once something else is done. strict: whether bugs are raised, as tests want it.
    """

    strict: ClassVar[bool] = False

    def __init__(self) -> None:
        self.clear()

    def show(self, text: str, kind: NoticeKind = NoticeKind.HINT) -> None:
        """Show a message."""
        self.kind, self.text = kind, text

    def show_saved(self, file: str | Path, more: str = "") -> None:
        """Show that a file was saved, and in which folder."""
        path = Path(file).absolute()
        self.show(f"saved {path.name} in {path.parent}{more}", NoticeKind.DONE)

    def clear(self) -> None:
        """Show nothing."""
        self.kind, self.text = NoticeKind.HINT, ""

    @contextmanager
    def reporting(self) -> Iterator[None]:
        """Show the error that a block raises, and end the block."""
        try:
            yield
        except SandboxError as error:
            self.show(str(error), NoticeKind.ERROR)

    @contextmanager
    def surviving(self) -> Iterator[None]:
        """Report a bug in a block, with its traceback in the log unless it is shown already, and end the block."""
        try:
            yield
        except Exception as error:
            if self.strict or isinstance(error, Stopped):
                raise
            text = f"That failed, and the run goes on: {error}"
            if text != self.text:
                LOG.exception("a bug")
            self.show(text, NoticeKind.ERROR)


SIGNS: Final = {NoticeKind.HINT: "", NoticeKind.DONE: "OK", NoticeKind.ERROR: "!"}  # not all see the colours
COLOURS: Final = {NoticeKind.DONE: GREEN, NoticeKind.ERROR: VERMILLION}


def draw_notice(surface: Surface, place: Rect, height: int, message: str, kind: NoticeKind) -> None:
    """Write a message over the lower edge of a place, after a sign on the colour of its kind. height: of the text."""
    sign, line = SIGNS[kind], round(1.45 * height)
    chip_width = text_width(sign, height) + height if sign else 0
    lines = first_lines(message, place.width - chip_width - 3 * height, height, MAX_LINES)
    width = max(text_width(text, height) for text in lines) + chip_width + 3 * height
    card = Rect(0, 0, min(width, place.width), len(lines) * line + height)
    card.midbottom = place.midbottom
    panel(surface, card)
    left = card.x + height
    if sign:
        chip = Rect(left, card.y + height // 2, chip_width, line)
        pygame.draw.rect(surface, readable(Color(COLOURS[kind]), SIGN_INK), chip, border_radius=height // 4)
        write(surface, sign, chip.move(height // 2, 0), SIGN_INK, height, bold=True)
        left = chip.right + height // 2
    for number, text in enumerate(lines):
        row = Rect(left, card.y + height // 2 + number * line, card.right - left - height // 2, line)
        write(surface, text, row, theme.ink, height)
