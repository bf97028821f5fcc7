"""What lies over the panes: cards of a ball and of errors, the table of keys, and messages."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby, product
from operator import itemgetter
from typing import Final

from pygame import Rect, Surface

from sandbox.quantity import kinetic_energy, potential_energy, spin_energy
from sandbox.scene.units import Dimension
from sandbox.session.samples import fall
from sandbox.view.controls import HELP
from sandbox.view.editor import Editor
from sandbox.view.layout import Layout
from sandbox.view.mouse_tool import MouseTool
from sandbox.view.notice import Notice, NoticeKind, draw_notice
from sandbox.view.playback import Playback
from sandbox.view.primitives import SMALLEST_TEXT, card, panel, shortened, text_width, wrapped, write
from sandbox.view.scene_loader import SceneLoader
from sandbox.view.session_view import Pane
from sandbox.view.theme import theme
from sandbox.view.widgets.fields import Slider
from sandbox.view.widgets.group import Placed, WidgetGroup


@dataclass
class Messages:
    """The messages of a window.

    speeds: of the run, the window, and the engines.
    """

    _playback: Playback
    _notice: Notice
    speeds: str = ""
    _measured: int = 0  # steps that had been played then

    @property
    def text(self) -> str:
        """What the window says: how far engines are that run again, the latest message, or how fast all are."""
        return self._progress or self._notice.text or self.speeds

    @property
    def _progress(self) -> str:
        """How far engines that run again still are from the current step, or nothing."""
        steps = self._playback.session.steps_behind
        return f"catching up: {steps:,} step{'s' * (steps != 1)} to go" if steps and not self._playback.rests else ""

    def draw(self, surface: Surface, layout: Layout) -> None:
        """Draw what the window says, a message on a card."""
        if self._progress or self._notice.text:
            kind = NoticeKind.HINT if self._progress else self._notice.kind
            draw_notice(surface, layout.status, layout.text_height, self.text, kind)
        else:
            speeds = shortened(self.speeds, layout.status.width, layout.text_height)
            write(surface, speeds, layout.status, theme.dim, layout.text_height)

    def measure(self, frames: int, seconds: float) -> None:
        """Note how fast the run, the window and the engines have been in some frames, which took some seconds."""
        runners, played = self._playback.session.runners.items(), self._playback.steps_played
        passed, self._measured = (played - self._measured) / self._playback.scene.rate / seconds, played
        texts = [f"{passed:.2g}\N{MULTIPLICATION SIGN} real time"] if passed > 0 else []
        steps = (f"{name} {1000 * run.step_seconds:.2g} ms" for name, run in runners if run.step_seconds is not None)
        self.speeds = "    ".join((*texts, f"{frames / seconds:.0f} frames a second", *steps))


@dataclass
class Cards:
    """What lies over the panes: cards, messages, the help, the picker of scenes, and what widgets say."""

    _playback: Playback
    _mouse: MouseTool
    _scenes: SceneLoader
    _widgets: WidgetGroup
    _messages: Messages
    help_open: bool = False

    def toggle_help(self) -> None:
        """Show the help, or hide it."""
        self.help_open = not self.help_open

    def close(self) -> bool:
        """Close the help and the errors of a file. Return whether they were open."""
        were_open = self.help_open or bool(self._scenes.error)
        self.help_open, self._scenes.error = False, ""
        return were_open

    def draw(self, surface: Surface, layout: Layout, placed: Sequence[Placed]) -> None:
        """Draw everything. placed: the widgets."""
        titles = [layout.title(pane) for pane in range(len(layout.arenas))]
        kept_free = [*titles, *(place for widget, place in placed if isinstance(widget, Slider))]
        self._draw_ball(surface, layout, [*kept_free, layout.status])
        self._messages.draw(surface, layout)
        if self._scenes.error:
            draw_error_card(surface, layout, self._scenes.error)
        if self.help_open:
            draw_help(surface, layout)
        if self._scenes.picker:
            self._scenes.picker.fit(surface.get_rect(), layout.text_height)
            self._scenes.picker.draw(surface)
        elif not self._mouse.holds and not self.help_open:
            self._widgets.draw_tip(surface, placed, kept_free, layout.text_height)

    def _draw_ball(self, surface: Surface, layout: Layout, kept_free: Sequence[Rect]) -> None:
        """Draw the card of the ball under the mouse."""
        ball, point = self._mouse.ball, self._mouse.point
        if ball is not None and point and not self._mouse.holds and not self._widgets.over:
            table = ball_table(self._playback.view.panes, ball)
            card(surface, table, point, layout.text_height, surface.get_rect(), kept_free)


SHOWN: Final = {"position": Dimension.LENGTH, "velocity": Dimension.VELOCITY, "energy": Dimension.ENERGY}


def ball_table(panes: Sequence[Pane], ball: int) -> list[list[str]]:
    """Return a ball's position, velocity, spin if balls can turn, and energy in every engine, as rows of a table.

    Potential energy is counted from the lowest place that the ball can reach, as in the chart.
    """
    turns = panes[0].scene.turns
    spin_title = ["spin, rad/s"] if turns else []
    units = panes[0].scene.units
    position_title, velocity_title, energy_title = (f"{name}, {units.name(of)}" for name, of in SHOWN.items())
    places, digits = units.decimals(Dimension.LENGTH, 2), units.decimals(Dimension.VELOCITY, 2)
    rows = [[f"ball {ball}", position_title, velocity_title, *spin_title, energy_title]]
    for pane in (pane for pane in panes if not pane.is_suspended):
        scene, one = pane.scene, slice(ball, ball + 1)
        position, velocity, mass = pane.state.position[one], pane.state.velocity[one], scene.bodies.mass[one]
        total = kinetic_energy(velocity, mass) + spin_energy(pane.state.spin[one], scene.bodies.moment[one])
        total += potential_energy(position, mass, scene.gravity, scene.arena.size) - fall(scene)[ball]
        (x, y), (vx, vy) = units.scaled(Dimension.LENGTH, *position[0]), units.scaled(Dimension.VELOCITY, *velocity[0])
        (shown,) = units.scaled(Dimension.ENERGY, float(total))
        spin = [f"{pane.state.spin[ball]:.2f}"] if turns else []
        rows.append(
            [pane.name, f"{x:.{places}f}, {y:.{places}f}", f"{vx:.{digits}f}, {vy:.{digits}f}", *spin, f"{shown:,.6g}"]
        )
    return rows


MAX_LINES: Final = 8  # of errors, shown at once
MASSES: Final = (0.1, 0.2, 0.5, 1, 2, 3, 5, 10, 20, 50, 100)  # kg


def draw_error_card(surface: Surface, layout: Layout, error: str) -> None:
    """Draw the errors of a file below the titles, as many lines as are shown at once."""
    height, window = layout.text_height, surface.get_rect()
    errors = error.splitlines()
    lines = [part for line in errors[:MAX_LINES] for part in wrapped(line, window.width - 4 * height, height, "    ")]
    count = len(lines) + len(errors[MAX_LINES:])
    if count > MAX_LINES:
        lines[MAX_LINES - 1 :] = [f"and {count - MAX_LINES + 1} more lines"]
    head = "This file has errors, so the current scene keeps running (Esc closes this):"
    card(surface, [[line] for line in (head, *lines)], layout.title(0), height, window)


def draw_help(surface: Surface, layout: Layout) -> None:
    """Draw the table of keys by topics, in the largest text that fits into the window, in up to three columns.

    In a small window, only as many topics are there as have room.
    """
    window = surface.get_rect()
    topics = [[(topic, ""), *(row[1:] for row in rows)] for topic, rows in groupby(HELP, key=itemgetter(0))]
    heights = range(layout.text_height, SMALLEST_TEXT - 1, -1)
    for count, height, columns in product(range(len(topics), 0, -1), heights, (1, 2, 3)):
        rows = [row for topic in topics[:count] for row in topic]
        keys, does = (max(text_width(row[k], height) for row in rows if row[1]) + height for k in (0, 1))
        per_column, step = -(-len(rows) // columns), round(1.45 * height)
        place = Rect(0, 0, columns * (keys + does) + height, (per_column + 1) * step)
        if place.width <= window.width and place.height <= window.height:
            break
    else:
        return
    place.center = window.center
    panel(surface, place)
    for number, (key, text) in enumerate(rows):
        column, row = divmod(number, per_column)
        cell = Rect(place.x + height + column * (keys + does), place.y + step // 2 + row * step, keys + does, step)
        write(surface, key, cell, theme.ink if text else theme.accent, height, bold=not text)
        write(surface, text, cell.move(keys, 0), theme.dim, height)


class MassSlider(Slider):
    """Changes the mass of the selected ball, beside it, while the run is paused."""

    def __init__(self, playback: Playback, editor: Editor, notice: Notice) -> None:
        def mass() -> float:
            return float(playback.scene.bodies.mass[editor.selected or 0])

        choose = notice.reporting()(lambda mass: editor.change(mass=mass))
        super().__init__("mass", MASSES, mass, choose, "", " kg")
        self._playback, self._editor = playback, editor

    def placed(self, layout: Layout) -> list[Placed]:
        """Return it with its place below the ball, or else above it; nothing if it is not shown."""
        ball, view, height = self._editor.selected, self._playback.view, layout.text_height
        if ball is None or not self._playback.paused:
            return []
        pane, radius = self._editor.pane, float(view.moment.scene.bodies.radius[ball]) * layout.scale
        x, y = layout.to_screen(pane, view.panes[pane].state.position[ball].tolist())
        arena, place = layout.arenas[pane], Rect(0, 0, 11 * height, self.height(0, height))
        place.midtop = round(x), round(y + radius + height)
        if place.bottom > arena.bottom:
            place.bottom = round(y - radius - height)
        seen = arena.collidepoint(x, y) and place.width < arena.width and place.top > arena.top
        return [(self, place.clamp(arena))] if seen else []

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw it on a ground of its own."""
        panel(surface, place)
        super().draw(surface, place, text_height, hot=hot)
