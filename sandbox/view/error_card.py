"""Cards with errors: of a file that cannot be run, of an engine that failed."""

from typing import Final

from pygame import Rect, Surface

from sandbox.errors import EngineError, LimitReached
from sandbox.view.layout import Layout
from sandbox.view.primitives import card, wrapped

MAX_LINES: Final = 8  # of errors, shown at once


def draw_error_card(surface: Surface, layout: Layout, error: str) -> None:
    """Draw the errors of a file above the status line, as many lines as are shown at once."""
    height, window = layout.text_height, surface.get_rect()
    errors = error.splitlines()
    lines = [part for one in errors[:MAX_LINES] for part in wrapped(one, window.width - 4 * height, height, "    ")]
    count = len(lines) + len(errors[MAX_LINES:])
    if count > MAX_LINES:
        lines[MAX_LINES - 1 :] = [f"and {count - MAX_LINES + 1} more lines"]
    head = "This file has errors, so the current scene keeps running (Esc closes this):"
    card(surface, [[line] for line in (head, *lines)], layout.status.topleft, height, window)


def draw_failure_card(surface: Surface, layout: Layout, place: Rect, error: EngineError | LimitReached) -> None:
    """Draw in the place of an arena why its engine failed or reached a limit, and when."""
    height = layout.text_height
    how = f"failed at {error.time:.3f} s, and stands still" if isinstance(error, EngineError) else "stands still"
    text = f"{how}: {error}"
    lines = wrapped(text, place.width - 4 * height, height, "    ")[:MAX_LINES]
    card(surface, [[line] for line in lines], place.topleft, height, place)
