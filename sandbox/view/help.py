"""The help: the table of keys over everything else."""

from pygame import Rect, Surface

from sandbox.view.controls import HELP
from sandbox.view.layout import Layout
from sandbox.view.palette import FAINT, INK
from sandbox.view.primitives import panel, text_width, write


def draw_help(surface: Surface, layout: Layout) -> None:
    """Draw the table of keys in the largest text that fits into the window, in one column or two."""
    window = surface.get_rect()
    for height in range(layout.text_height, 6, -1):
        for columns in (1, 2):
            place, widths = _size(height, columns)
            if place.width <= window.width and place.height <= window.height:
                place.center = window.center
                _draw(surface, place, widths, height, columns)
                return


def _size(height: int, columns: int) -> tuple[Rect, tuple[int, int]]:
    """Return the table's size, and the widths of the keys and of what they do, px."""
    keys, does = (max(text_width(row[k], height) for row in HELP) + height for k in (0, 1))
    rows = -(-len(HELP) // columns)
    return Rect(0, 0, columns * (keys + does) + height, round((rows + 1) * 1.5 * height)), (keys, does)


def _draw(surface: Surface, place: Rect, widths: tuple[int, int], height: int, columns: int) -> None:
    panel(surface, place)
    rows = -(-len(HELP) // columns)
    for number, (keys, does) in enumerate(HELP):
        column, row = divmod(number, rows)
        x = place.x + height + column * sum(widths)
        y = place.y + round((row + 0.5) * 1.5 * height)
        write(surface, keys, Rect(x, y, widths[0], round(1.5 * height)), INK, height)
        write(surface, does, Rect(x + widths[0], y, widths[1], round(1.5 * height)), FAINT, height)
