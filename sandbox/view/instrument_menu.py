"""The list of instruments that opens at a chart's title."""

from collections.abc import Callable
from typing import Final

import pygame
from pygame import Rect, Surface
from pygame.event import Event

from sandbox.view.charts import Charts
from sandbox.view.instruments import MEANINGS, Instrument
from sandbox.view.layout import Layout, ScreenPoint
from sandbox.view.palette import ACCENT, FAINT, FRAME, INK
from sandbox.view.primitives import panel, text_width, write

LINE: Final = 1.5  # heights of text
KEYS: Final = {pygame.K_UP: -1, pygame.K_DOWN: 1}
CLOSES: Final = (pygame.K_RETURN, pygame.K_KP_ENTER, pygame.K_ESCAPE)


class InstrumentMenu:
    """Lets one choose what a chart shows, by mouse or by keys. open_at: the chart whose list is open.

    charts, layout: return those of the window at present.
    """

    def __init__(self, charts: Callable[[], Charts], layout: Callable[[], Layout]) -> None:
        self._charts = charts
        self._layout = layout
        self.open_at: int | None = None

    def open_or_step(self, chart: int) -> None:
        """Open the list of a chart; if it is open, choose the next instrument."""
        if self.open_at == chart:
            self._step(1)
        elif self._corner(chart):
            self.open_at = chart

    def on_event(self, event: Event) -> bool:
        """Handle an event. Return whether the menu uses it."""
        if self.open_at is not None and not self._corner(self.open_at):  # the charts were hidden meanwhile
            self.open_at = None
        if event.type == pygame.MOUSEBUTTONDOWN and event.button == 1:
            return self._press(event.pos)
        if self.open_at is None:
            return False
        if event.type == pygame.MOUSEWHEEL:
            self._step(-event.y)
            return True
        if event.type != pygame.KEYDOWN:
            return event.type == pygame.MOUSEMOTION
        if event.key in KEYS:
            self._step(KEYS[event.key])
        elif event.key in CLOSES:
            self.open_at = None
        return event.key in KEYS or event.key in CLOSES

    def _press(self, point: ScreenPoint) -> bool:
        was_open, self.open_at = self.open_at, None
        if was_open is not None:
            chosen = self._instrument_at(was_open, point)
            if chosen:
                self._charts().choose(was_open, chosen)
            return True
        self.open_at = self.corner_at(point)
        return self.open_at is not None

    def _step(self, by: int) -> None:
        if self.open_at is not None:
            instruments = list(Instrument)
            now = instruments.index(self._charts().instruments[self.open_at])
            self._charts().choose(self.open_at, instruments[(now + by) % len(instruments)])

    # Where things are

    def _corner(self, chart: int) -> Rect | None:
        layout = self._layout()
        return self._charts().corner(layout.strip, layout.text_height, chart)

    def corner_at(self, point: ScreenPoint) -> int | None:
        """Return the chart whose title is at a point of the window."""
        charts = range(len(self._charts().instruments))
        return next((k for k in charts if (corner := self._corner(k)) and corner.collidepoint(point)), None)

    def place(self, chart: int) -> Rect:
        """Return the place of the list: above the chart's title if there is room."""
        layout = self._layout()
        height, corner = layout.text_height, self._corner(chart) or layout.strip
        names, meanings = self._widths(height)
        size = names + meanings + 4 * height, round((len(Instrument) + 0.6) * LINE * height)
        return Rect(corner.x, corner.y - size[1], *size).clamp(Rect((0, 0), layout.window))

    @staticmethod
    def _widths(height: int) -> tuple[int, int]:
        """Return the widths of the names and of what they mean, px. height: of the text, px."""
        names = max(text_width(one.value, height) for one in Instrument)
        return names, max(text_width(meaning, height) for meaning in MEANINGS.values())

    def line(self, chart: int, instrument: Instrument) -> Rect:
        """Return the place of an instrument in the list of a chart."""
        place, height = self.place(chart), round(LINE * self._layout().text_height)
        top = place.y + round(0.3 * height) + list(Instrument).index(instrument) * height
        return Rect(place.x, top, place.width, height)

    def _instrument_at(self, chart: int, point: ScreenPoint) -> Instrument | None:
        return next((one for one in Instrument if self.line(chart, one).collidepoint(point)), None)

    # Drawing

    def draw(self, surface: Surface, point: ScreenPoint | None) -> None:
        """Draw the list that is open, or mark the title under the mouse. point: where the mouse is."""
        height = self._layout().text_height
        if self.open_at is None:
            over = self.corner_at(point) if point else None
            corner = self._corner(over) if over is not None else None
            if corner:
                pygame.draw.rect(surface, ACCENT, corner, max(1, height // 12), border_radius=height // 4)
            return
        panel(surface, self.place(self.open_at))
        shown, (names, _) = self._charts().instruments, self._widths(height)
        for one in Instrument:
            line = self.line(self.open_at, one)
            is_chosen = one is shown[self.open_at]
            is_hot = point is not None and line.collidepoint(point)
            if is_chosen or is_hot:
                pygame.draw.rect(surface, ACCENT, line.inflate(-height // 2, 0), 0 if is_chosen else 1, border_radius=4)
            name = line.move(height, 0)
            write(surface, one.value, name, FRAME if is_chosen else INK, height)
            write(surface, MEANINGS[one], name.move(names + height, 0), FRAME if is_chosen else FAINT, height)
