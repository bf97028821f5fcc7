"""Cards over the panes: of a ball, of errors, and the table of keys."""

from collections.abc import Sequence
from typing import Final

from pygame import Rect, Surface

from sandbox.quantity import kinetic_energy, potential_energy, spin_energy
from sandbox.scene.units import Dimension
from sandbox.view.controls import HELP
from sandbox.view.layout import Layout, ScreenPoint
from sandbox.view.primitives import card, panel, text_width, wrapped, write
from sandbox.view.session_view import Pane
from sandbox.view.theme import theme

SHOWN: Final = {"position": Dimension.LENGTH, "velocity": Dimension.VELOCITY, "energy": Dimension.ENERGY}


def draw_ball_card(surface: Surface, layout: Layout, panes: Sequence[Pane], ball: int, point: ScreenPoint) -> None:
    """Draw the card of a ball next to a point of the screen."""
    card(surface, ball_table(panes, ball), point, layout.text_height, surface.get_rect())


def ball_table(panes: Sequence[Pane], ball: int) -> list[list[str]]:
    """Return a ball's position, velocity, spin if balls can turn, and energy in every engine, as rows of a table."""
    turns = panes[0].scene.turns
    spin_title = ["spin, rad/s"] if turns else []
    units = panes[0].scene.units
    position_title, velocity_title, energy_title = (f"{name}, {units.name(of)}" for name, of in SHOWN.items())
    places, digits = units.decimals(Dimension.LENGTH, 2), units.decimals(Dimension.VELOCITY, 2)
    rows = [[f"ball {ball}", position_title, velocity_title, *spin_title, energy_title]]
    for pane in panes:
        scene, one = pane.scene, slice(ball, ball + 1)
        position, velocity, mass = pane.state.position[one], pane.state.velocity[one], scene.bodies.mass[one]
        total = kinetic_energy(velocity, mass) + spin_energy(pane.state.spin[one], scene.bodies.moment[one])
        total += potential_energy(position, mass, scene.gravity, scene.arena.size)
        (x, y), (vx, vy) = units.scaled(Dimension.LENGTH, *position[0]), units.scaled(Dimension.VELOCITY, *velocity[0])
        (shown,) = units.scaled(Dimension.ENERGY, float(total))
        spin = [f"{pane.state.spin[ball]:.2f}"] if turns else []
        rows.append(
            [pane.name, f"{x:.{places}f}, {y:.{places}f}", f"{vx:.{digits}f}, {vy:.{digits}f}", *spin, f"{shown:.6g}"]
        )
    return rows


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


def draw_help(surface: Surface, layout: Layout) -> None:
    """Draw the table of keys in the largest text that fits into the window, in one column or two."""
    window = surface.get_rect()
    for height in range(layout.text_height, 4, -1):
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
        write(surface, keys, Rect(x, y, widths[0], round(1.5 * height)), theme.ink, height)
        write(surface, does, Rect(x + widths[0], y, widths[1], round(1.5 * height)), theme.dim, height)
