"""The rows of widgets round the panes: the header, the tools, and the timeline with its track."""

from collections.abc import Callable
from functools import partial
from typing import Any, Final

import pygame
from pygame import Rect, Surface

from sandbox.view.charts import Charts
from sandbox.view.controls import Action, tip_of
from sandbox.view.instruments import INSTRUMENTS, Instrument
from sandbox.view.layout import GAP, TIME_LETTERS, Layout
from sandbox.view.mouse_tool import MouseTool, Tool
from sandbox.view.playback import Playback, speed_text
from sandbox.view.primitives import write
from sandbox.view.theme import theme
from sandbox.view.video import Recorder
from sandbox.view.widgets import TextButton, Words
from sandbox.view.widgets.group import Placed, WidgetRow

THICKNESS: Final = 4  # px, of the track
MARK: Final = 2  # px, width of a mark on it
Do = Callable[[Action], None]  # does an action


def action_button(action: Action, do: Do, **more: Any) -> TextButton:
    """Return a button that does an action, with its keys in its tip. more: as for `TextButton`."""
    return TextButton(action.value.name, partial(do, action), tip_of(action), **more)


class Toolbars:
    """The rows of widgets, and the track. do: does an action; is_on: whether what it turns on and off is on."""

    def __init__(
        self, playback: Playback, mouse: MouseTool, recorder: Recorder, do: Do, is_on: Callable[[Action], bool]
    ) -> None:
        def button(action: Action, **more: Any) -> TextButton:
            return action_button(action, do, is_on=partial(is_on, action), **more)

        def record_text() -> str:
            return "Record" if (seconds := recorder.seconds) is None else f"Stop {seconds:.1f} s"

        def title_text() -> str:
            return playback.session.start.title or playback.session.start.name

        self._playback = playback
        title = Words("", said=title_text, bold=True, scale=1.2)
        scenes = map(button, (Action.PICK_SCENE, Action.PREVIOUS_SCENE, Action.NEXT_SCENE))
        record = button(Action.RECORD, said=record_text, widest="Stop 88.8 s")
        self._header = WidgetRow([*scenes, title], [record, button(Action.HELP), button(Action.COLUMN)], title)

        def tool_button(tool: Tool) -> TextButton:
            return TextButton(tool.name, partial(mouse.choose, tool), tool.does, lambda: mouse.tool is tool)

        undo = button(Action.UNDO, refusal=lambda: "" if playback.session.can_undo else "there is nothing to undo")
        redo = button(Action.REDO, refusal=lambda: "" if playback.session.can_redo else "there is nothing to redo")
        self._tools = WidgetRow([*map(tool_button, mouse.tools), undo, redo], [button(Action.SHOW_ALL)])

        play = button(Action.PAUSE, said=lambda: "Play" if playback.paused else "Pause", widest="Pause")
        start, back, on, end = map(button, (Action.GO_TO_START, Action.STEP_BACK, Action.STEP, Action.GO_TO_END))
        speed = Words(
            "",
            said=lambda: speed_text(playback.speed),
            widest="0.01\N{MULTIPLICATION SIGN}",
            does="how fast time passes",
        )
        after = [end, button(Action.SLOWER), speed, button(Action.FASTER)]
        self._before, self._after = WidgetRow([start, back, play, on]), WidgetRow([], after)
        self._tabs = WidgetRow([self._tab(instrument) for instrument in INSTRUMENTS])

    @property
    def _charts(self) -> Charts:
        return self._playback.view.charts

    def _tab(self, instrument: Instrument) -> TextButton:
        name = instrument.name.capitalize()
        return TextButton(
            name.partition(" ")[0], lambda: self._charts.show(instrument),
            f"{name}: {instrument.meaning}", lambda: self._charts.instrument is instrument,
        )  # fmt: skip

    # Places and drawing

    def widths(self, text_height: int) -> tuple[tuple[int, ...], int, int]:
        """Return the widths of the tools, and of the buttons before the track and after it, px."""
        return self._tools.widths(text_height), self._before.width(text_height), self._after.width(text_height)

    def placed(self, layout: Layout) -> list[Placed]:
        """Return the widgets with their places."""
        rows = {
            self._header: layout.header,
            self._tools: layout.palette,
            self._before: layout.transport,
            self._after: layout.after_bar,
            self._tabs: layout.tabs,
        }
        return [widget for row, place in rows.items() for widget in row.placed(place, layout.text_height, layout.side)]

    def draw_timeline(self, surface: Surface, layout: Layout) -> None:
        """Draw the timeline's ground, and the track with its marks and its end; without the widgets and the chart."""
        place, height, grip, track = layout.timeline, layout.text_height, layout.splitter, layout.bar
        pygame.draw.rect(surface, theme.raised, place, border_radius=8)
        pygame.draw.rect(surface, theme.line, place, 1, border_radius=8)
        if grip.height:
            surface.fill(theme.line, Rect(grip.centerx - 2 * height, grip.centery - 1, 4 * height, 3))
        session, moment, end = self._playback.session, self._playback.view.moment, self._playback.track_end

        def column(step: int) -> int:
            return track.x + round((track.width - 1) * min(step / end, 1.0))

        line = Rect(track.x, track.centery - THICKNESS // 2, track.width, THICKNESS)
        ends = {end: theme.line, session.end: theme.line.lerp(theme.dim, 0.5), moment.step: theme.accent}
        for step, colour in ends.items():
            line.width = column(step) - track.x
            pygame.draw.rect(surface, colour, line, border_radius=2)
        colours = self._charts.colours
        for name, time in self._charts.marks.differences.items():
            if name in colours:
                x = column(session.step_at(time))
                surface.fill(colours[name], Rect(x - 1, track.y + 2, MARK, track.height - 4))
        knob = Rect(0, 0, round(0.9 * height), round(1.1 * height))
        knob.center = column(moment.step), track.centery
        pygame.draw.rect(surface, theme.accent, knob, border_radius=height // 4)
        room = Rect(track.right + GAP, track.y, TIME_LETTERS * height - GAP, track.height)
        write(surface, f"{session.start.clock.time(end):.4g} s", room, theme.dim, height)
        room.right = track.x
        write(surface, f"{moment.time:.2f} s", room, theme.ink, height)
