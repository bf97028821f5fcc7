"""The timeline: the buttons of time, the track, and below them the chart with its tabs."""

from collections.abc import Callable, Mapping
from functools import partial
from operator import eq
from typing import Final

import pygame
from pygame import Color, Rect, Surface

from sandbox.session.session import Session
from sandbox.view.controls import Action
from sandbox.view.header import action_button
from sandbox.view.instruments import MEANINGS, OF_THE_MOMENT, Instrument
from sandbox.view.layout import GAP, TIME_LETTERS, Layout
from sandbox.view.playback import SPEEDS, Playback, speed_text
from sandbox.view.primitives import write
from sandbox.view.theme import chart_palette, theme
from sandbox.view.widgets.buttons import Item, Menu, TextButton
from sandbox.view.widgets.group import Placed, WidgetRow

TABS: Final = (Instrument.ENERGY, Instrument.GAP, Instrument.MOMENTUM, Instrument.SPEEDS)  # the others are in a menu
WIDEST: Final = "1\N{MULTIPLICATION SIGN} (0.88\N{MULTIPLICATION SIGN})"
THICKNESS: Final = 4  # px
MARK: Final = 2  # px, half of the width of the gap round a mark


class Timeline:
    """The lowest part of the window. do: does an action; time: what the clock before the track says."""

    def __init__(self, playback: Playback, do: Callable[[Action], None], time: Callable[[], str]) -> None:
        self._playback = playback
        left, right = "\N{SINGLE LEFT-POINTING ANGLE QUOTATION MARK}", "\N{SINGLE RIGHT-POINTING ANGLE QUOTATION MARK}"
        play = action_button(
            "", Action.PAUSE, do, is_on=lambda: playback.paused,
            said=lambda: "Play" if playback.paused else "Pause", widest="Pause",
        )  # fmt: skip
        self._before = WidgetRow(
            [
                action_button(f"|{left}", Action.GO_TO_START, do),
                action_button(left, Action.STEP_BACK, do),
                play,
                action_button(right, Action.STEP, do),
            ],
            [],
        )
        self._clock = action_button("", Action.STOPWATCH, do, is_on=lambda: playback.stopwatch is not None, said=time)
        speeds = Menu(self._speed_text, self._speeds, "how fast time passes  (+ and -)", widest=WIDEST)
        self._after = WidgetRow([], [action_button(f"{right}|", Action.GO_TO_END, do), speeds])
        tabs = [self._tab(instrument) for instrument in TABS]
        more = Menu(self._more_text, self._others, "choose another chart  (1: the next one)", self._shows_other)
        self._scale = action_button(
            "", Action.SCALE, do, widest="logarithmic",
            said=lambda: "logarithmic" if playback.view.charts.is_logarithmic else "linear",
            refusal=lambda: playback.view.charts.why_one_scale,
        )  # fmt: skip
        self._across = Menu(
            self._across_text, self._choices_across, "over what the chart is drawn: time, or another quantity",
            lambda: playback.view.charts.across is not None,
        )  # fmt: skip
        self._tabs = WidgetRow([*tabs, more], [self._across, self._scale])

    # What its widgets do

    def _speed_text(self) -> str:
        """Return the speed asked for, and the measured one if the machine does not keep up."""
        playback = self._playback
        return speed_text(playback.speed) if playback.paused else playback.pace.text(playback.speed)

    def _speeds(self) -> list[Item]:
        playback = self._playback
        return [
            Item(speed_text(speed), partial(playback.set_speed, speed), is_on=partial(eq, speed, playback.speed))
            for speed in SPEEDS
        ]

    def _show(self, instrument: Instrument) -> None:
        self._playback.view.charts.show(instrument)

    def _is_shown(self, instrument: Instrument) -> bool:
        return self._playback.view.charts.instrument is instrument

    def _tab(self, instrument: Instrument) -> TextButton:
        name = instrument.value
        does = f"{name[0].upper()}{name[1:]}: {MEANINGS[instrument]}"
        return TextButton(name.capitalize(), partial(self._show, instrument), does, partial(self._is_shown, instrument))

    def _others(self) -> list[Item]:
        others = [instrument for instrument in Instrument if instrument not in TABS]
        return [
            Item(each.value.capitalize(), partial(self._show, each), MEANINGS[each], partial(self._is_shown, each))
            for each in others
        ]

    def _across_text(self) -> str:
        across = self._playback.view.charts.across
        return f"over {across.value if across else 'time'}"

    def _choices_across(self) -> list[Item]:
        charts = self._playback.view.charts
        quantities = [instrument for instrument in Instrument if instrument not in OF_THE_MOMENT]
        return [
            Item(
                each.value if each else "time",
                partial(charts.show_across, each),
                is_on=partial(eq, each, charts.across),
            )
            for each in (None, *quantities)
        ]

    def _shows_other(self) -> bool:
        return self._playback.view.charts.instrument not in TABS

    def _more_text(self) -> str:
        return self._playback.view.charts.instrument.value.capitalize() if self._shows_other() else "More"

    # Places and drawing

    def widths(self, text_height: int) -> tuple[int, int]:
        """Return the widths of the buttons before the track and after it, px."""
        return self._before.width(text_height), self._after.width(text_height)

    def placed(self, layout: Layout) -> list[Placed]:
        """Return its widgets with their places."""
        self._tabs.right = [self._across, self._scale] if self._playback.view.charts.has_axes else [self._scale]
        rows = ((self._before, layout.transport), (self._after, layout.transport), (self._tabs, layout.tabs))
        placed = [one for row, place in rows for one in row.placed(place, layout.text_height, layout.side)]
        width, track = TIME_LETTERS * layout.text_height, layout.bar
        return [*placed, (self._clock, Rect(track.x - GAP - width, track.y, width, track.height))]

    def draw(self, surface: Surface, layout: Layout) -> None:
        """Draw its ground, and the track with its marks and its end; without the widgets and the chart."""
        place, height = layout.timeline, layout.text_height
        surface.fill(theme.ground, place)
        pygame.draw.rect(surface, theme.raised, place, border_radius=8)
        pygame.draw.rect(surface, theme.line, place, 1, border_radius=8)
        session, track = self._playback.session, layout.bar
        end = track_end(session)
        steps = self._playback.view.moment.step, session.end, end
        draw_track(surface, track, steps, marks_of_track(self._playback), height)
        last = f"{session.start.clock.time(end):.4g} s"
        room = Rect(track.right + GAP, track.y, TIME_LETTERS * height - GAP, track.height)
        write(surface, last, room, theme.dim, height)


def marks_of_track(playback: Playback) -> dict[int, Color]:
    """Return the steps of first differences, in the colours of their engines, and where the stopwatch began."""
    session, marks = playback.session, playback.view.charts.marks
    colours = chart_palette().engines([*session.names, session.reference])
    steps = {session.step_at(time): colours[name] for name, time in marks.differences.items() if name in colours}
    return steps if playback.stopwatch is None else steps | {session.step_at(playback.stopwatch): theme.accent}


def track_end(session: Session) -> int:
    """Return the step at the end of the track: that of the scene's seconds, or a later one that has been reached."""
    return max(session.end, session.start.steps, 1)


def step_of_point(place: Rect, x: int, end: int) -> int:
    """Return the step that a track at a place shows at x, px of the window. end: its last step."""
    return round(min(max((x - place.x) / max(1, place.width - 1), 0.0), 1.0) * end)


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
