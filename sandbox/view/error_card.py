"""What is wrong with a file, over a run that goes on without it."""

import textwrap

from pygame import Surface

from sandbox.view.layout import Layout
from sandbox.view.primitives import card, drawable, text_width

LINES = 8  # of what is wrong, that are shown at once


def draw_error_card(surface: Surface, layout: Layout, mistake: str) -> None:
    """Draw what is wrong with a file, as many lines as there is room for, above the status line."""
    height, window = layout.text_height, surface.get_rect()
    letters = max(20, int((window.width - 4 * height) / (text_width("abcdefghij klmnopqrst", height) / 21)))
    told = mistake.splitlines()
    lines = [part for line in told[:LINES] for part in textwrap.wrap(drawable(line), letters, subsequent_indent="    ")]
    count = len(lines) + len(told[LINES:])
    if count > LINES:
        lines[LINES - 1 :] = [f"and {count - LINES + 1} lines more"]
    said = ["The file cannot be run; what was open goes on (Esc closes this):", *lines]
    card(surface, [[line] for line in said], layout.status.topleft, height, window)
