"""The rows of widgets round the panes: the header, the tools, and the timeline with its track."""

from collections.abc import Callable, Mapping
from functools import partial
from operator import eq
from typing import Any, Final

import pygame
from pygame import Color, Rect, Surface

from sandbox.scene.model import Scene
from sandbox.view.charts import Charts
from sandbox.view.controls import Action, tip_of
from sandbox.view.instruments import OTHERS, TABS, Instrument
from sandbox.view.layout import GAP, TIME_LETTERS, Layout
from sandbox.view.mouse_tool import MouseTool, Tool
from sandbox.view.playback import SPEEDS, Playback, speed_text
from sandbox.view.primitives import write
from sandbox.view.theme import chart_palette, theme
from sandbox.view.widgets import Words
from sandbox.view.widgets.buttons import Menu, TextButton
from sandbox.view.widgets.group import Placed, WidgetRow

SAVES: Final = (Action.SAVE_SCENE, Action.SAVE_PICTURE, Action.SAVE_INPUTS, Action.COPY_CODE)
Do = Callable[[Action], None]  # does an action


def action_button(action: Action, do: Do, **more: Any) -> TextButton:
    """Return a button that does an action, with its keys in its tip. more: as for `TextButton`."""
    return TextButton(action.value.name, partial(do, action), tip_of(action), **more)


class Header:
    """A row with the scene's title and buttons.

    scene: returns the one that runs. is_on: whether an action's state is on. recorded: s, None while nothing is
    recorded.
    """

    def __init__(
        self, scene: Callable[[], Scene], do: Do, is_on: Callable[[Action], bool], recorded: Callable[[], float | None]
    ) -> None:
        def button(action: Action, **more: Any) -> TextButton:
            return action_button(action, do, is_on=partial(is_on, action), **more)

        def record_text() -> str:
            return "Record" if (seconds := recorded()) is None else f"Stop {seconds:.1f} s"

        saves = [action_button(action, do) for action in SAVES]
        title = Words("", said=lambda: scene().title or scene().name, bold=True, scale=1.2)
        others = map(button, (Action.PICK_SCENE, Action.PREVIOUS_SCENE, Action.NEXT_SCENE))
        right = [
            Menu(lambda: "Save", lambda: saves, "save or copy something"),
            button(Action.RECORD, said=record_text, widest="Stop 88.8 s"),
            button(Action.HELP),
            button(Action.COLUMN),
        ]
        self._row = WidgetRow([*others, title], right)

    def placed(self, layout: Layout) -> list[Placed]:
        """Return its widgets with their places; the title is as wide as there is room, after all that is pressed."""
        place, row, height = layout.header, self._row, layout.text_height
        *buttons, title = row.left
        left, right = WidgetRow(buttons).placed(place, height, layout.side), WidgetRow([], row.right)
        start = place.x + WidgetRow(buttons).width(height)
        room = Rect(start, place.y, max(0, place.right - right.width(height) - start), place.height)
        return [*left, *[(title, room)] * (room.width > 2 * height), *right.placed(place, height, layout.side)]


def tool_palette(mouse: MouseTool, playback: Playback, do: Do) -> WidgetRow:
    """Return the row of tools."""

    def button(tool: Tool) -> TextButton:
        does = f"{tool.does}  (F: next tool)"
        return TextButton(tool.name, partial(mouse.choose, tool), does, lambda: mouse.tool is tool)

    undo = action_button(
        Action.UNDO, do, refusal=lambda: "" if playback.session.can_undo else "there is nothing to undo here"
    )
    redo = action_button(
        Action.REDO, do, refusal=lambda: "" if playback.session.can_redo else "there is nothing to redo"
    )
    zoom = Words("", said=lambda: f"{100 * mouse.lens.zoom:.0f} %", widest="5000 %", colour=theme.dim)
    zooms = (action_button(action, do) for action in (Action.ZOOM_OUT, Action.SHOW_ALL, Action.ZOOM_IN))
    return WidgetRow([*map(button, mouse.tools), undo, redo], [zoom, *zooms])


WIDEST: Final = "1\N{MULTIPLICATION SIGN} (0.88\N{MULTIPLICATION SIGN})"
THICKNESS: Final = 4  # px
MARK: Final = 2  # px, half of the width of the gap round a mark


class Timeline:
    """The lowest part of the window."""

    def __init__(self, playback: Playback, do: Do) -> None:
        self._playback = playback
        play = action_button(
            Action.PAUSE, do, is_on=lambda: playback.paused,
            said=lambda: "Play" if playback.paused else "Pause", widest="Pause",
        )  # fmt: skip
        start, back, on, end = (
            action_button(action, do)
            for action in (Action.GO_TO_START, Action.STEP_BACK, Action.STEP, Action.GO_TO_END)
        )
        self._before = WidgetRow([start, back, play, on])
        speeds = Menu(lambda: playback.speed_text, self._speeds, "how fast time passes  (+ and -)", widest=WIDEST)
        self._after = WidgetRow([], [end, speeds])
        tabs = [self._tab(instrument) for instrument in TABS]
        more = Menu(self._more_text, self._others, "choose another chart  (1: the next one)", self._shows_other)
        self._scale = action_button(
            Action.SCALE, do, widest="logarithmic",
            said=lambda: "logarithmic" if self._charts.is_logarithmic else "linear",
            refusal=lambda: self._charts.why_one_scale,
        )  # fmt: skip
        self._tabs = WidgetRow([*tabs, more], [self._scale])

    # What its widgets do

    @property
    def _charts(self) -> Charts:
        return self._playback.view.charts

    def _speeds(self) -> list[TextButton]:
        playback = self._playback
        return [
            TextButton(speed_text(speed), partial(playback.set_speed, speed), is_on=partial(eq, speed, playback.speed))
            for speed in SPEEDS
        ]

    def _item(self, instrument: Instrument) -> TextButton:
        def show() -> None:
            self._charts.show(instrument)

        return TextButton(
            instrument.name.capitalize(), show, instrument.meaning, lambda: self._charts.instrument is instrument
        )

    def _tab(self, instrument: Instrument) -> TextButton:
        item = self._item(instrument)
        item.does = f"{item.text}: {item.does}"
        return item

    def _others(self) -> list[TextButton]:
        return [self._item(instrument) for instrument in OTHERS]

    def _shows_other(self) -> bool:
        return self._charts.instrument in OTHERS

    def _more_text(self) -> str:
        return self._charts.instrument.name.capitalize() if self._shows_other() else "More"

    # Places and drawing

    def widths(self, text_height: int) -> tuple[int, int]:
        """Return the widths of the buttons before the track and after it, px."""
        return self._before.width(text_height), self._after.width(text_height)

    def placed(self, layout: Layout) -> list[Placed]:
        """Return its widgets with their places."""
        rows = ((self._before, layout.transport), (self._after, layout.transport), (self._tabs, layout.tabs))
        return [placed for row, place in rows for placed in row.placed(place, layout.text_height, layout.side)]

    def draw(self, surface: Surface, layout: Layout) -> None:
        """Draw its ground, and the track with its marks and its end; without the widgets and the chart."""
        place, height, grip = layout.timeline, layout.text_height, layout.splitter
        pygame.draw.rect(surface, theme.raised, place, border_radius=8)
        pygame.draw.rect(surface, theme.line, place, 1, border_radius=8)
        if grip.height:
            surface.fill(theme.line, Rect(grip.centerx - 2 * height, grip.centery - 1, 4 * height, 3))
        session, track = self._playback.session, layout.bar
        end = self._playback.track_end
        steps = self._playback.view.moment.step, session.end, end
        draw_track(surface, track, steps, marks_of_track(self._playback), height)
        room = Rect(track.right + GAP, track.y, TIME_LETTERS * height - GAP, track.height)
        write(surface, f"{session.start.clock.time(end):.4g} s", room, theme.dim, height)
        room.right = track.x
        write(surface, f"{self._playback.view.moment.time:.2f} s", room, theme.ink, height)


def marks_of_track(playback: Playback) -> dict[int, Color]:
    """Return the steps of first differences, in the colours of their engines."""
    session, marks = playback.session, playback.view.charts.marks
    colours = chart_palette().engines([*session.names, session.reference])
    return {session.step_at(time): colours[name] for name, time in marks.differences.items() if name in colours}


def draw_track(
    surface: Surface, place: Rect, steps: tuple[int, int, int], marks: Mapping[int, Color], height: int
) -> None:
    """Draw a track with marks at some steps. steps: the current one, the latest, and the track's last."""
    step, reached, end = steps

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
