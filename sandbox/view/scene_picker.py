"""The scene picker: previews of scenes by topic, found by typing."""

import tomllib
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from pathlib import Path
from typing import Final, NamedTuple

import pygame
from pygame import Rect, Surface
from pygame.event import Event

from sandbox.files import MAX_TEXT_FILE_BYTES
from sandbox.scene.files import TRUTHS, bundled
from sandbox.text import printable
from sandbox.view.offscreen import Previews
from sandbox.view.primitives import first_lines, panel, shortened, text_width, write
from sandbox.view.theme import theme

TILE_WIDTH: Final = 12  # of a preview with its name, in heights of the text
PREVIEW_HEIGHT: Final = 0.65  # of a preview's width
HEADING: Final = 2.0  # height of a topic's name, in heights of the text
ABOUT_LINES: Final = 2  # for which there is room below the previews, about the chosen scene
MAX_FILES: Final = 200  # of a folder that are listed
TRUTHS_TOPIC: Final = "Truths: each tests a law of physics"
TICK: Final = "truths: {}  (Tab)"
HINT: Final = "type to search; choose with arrows and Enter, or a click; Esc closes"


@dataclass(frozen=True)
class SceneEntry:
    """A scene that can be chosen. topic: under which it is listed if the file has none."""

    name: str
    file: Path
    listed_under: str
    is_truth: bool = False

    @cached_property
    def _text(self) -> str:
        try:
            with self.file.open("rb") as file:
                return file.read(MAX_TEXT_FILE_BYTES).decode(errors="replace")
        except OSError:
            return ""

    @cached_property
    def words(self) -> str:
        """The text that is searched: the name, and the whole file."""
        return f"{self.name} {self._text}".lower()

    @cached_property
    def topic(self) -> str:
        """What the scene is listed under: its own topic, which stands before all tables, or else its folder."""
        head = self._text.partition("\n[")[0]
        try:
            topic = tomllib.loads(head).get("topic", "")
        except tomllib.TOMLDecodeError:
            topic = ""
        return printable(topic) if isinstance(topic, str) and topic else self.listed_under


def entries(folders: Iterable[Path]) -> list[SceneEntry]:
    """List the scenes of some folders, then the bundled ones, those of a topic together; and the truths."""
    examples = [SceneEntry(name, file, "Examples") for name, file in bundled().items()]
    truths = [SceneEntry(name, file, TRUTHS_TOPIC, is_truth=True) for name, file in bundled(TRUTHS).items()]
    known = {entry.file.resolve() for entry in (*examples, *truths)}
    own: list[SceneEntry] = []
    for folder in folders:
        files = [file for file in sorted(folder.glob("*.toml")) if file.is_file() and file.resolve() not in known]
        known |= {file.resolve() for file in files}
        heading = f"In {printable(folder.resolve().name) or folder.resolve()}"
        own += [SceneEntry(printable(file.name), file, heading) for file in files[:MAX_FILES]]
    listed = [entry for entry in own if "[[balls]]" in entry.words] + examples
    topics = list(dict.fromkeys(entry.topic for entry in listed))
    return sorted(listed, key=lambda entry: topics.index(entry.topic)) + truths


class Row(NamedTuple):
    """Previews side by side, by their numbers in `found`, below a topic's name if they are its first."""

    heading: str
    indices: range


class ScenePicker:
    """A grid of scenes by topic over the whole window.

    choose: runs the scene of a file. close: closes the picker. with_truths: whether it lists the truths. found: the
    scenes that it lists; truths: how many contain what is typed.
    """

    def __init__(
        self,
        folders: Iterable[Path],
        choose: Callable[[Path], None],
        close: Callable[[], None],
        previews: Previews,
        *,
        with_truths: bool = False,
    ) -> None:
        self._choose = choose
        self._close = close
        self._entries = entries(folders)
        self._previews = previews
        self.with_truths = with_truths
        self.typed = ""
        self.chosen = 0
        self._first_row = 0
        self._drags_bar = False
        self.fit(Rect(0, 0, 1, 1), 1)
        self._search()

    def _search(self) -> None:
        """Find the scenes that contain every typed word; truths only if they are listed."""
        words = self.typed.lower().split()
        matching = [entry for entry in self._entries if all(word in entry.words for word in words)]
        self.truths = sum(entry.is_truth for entry in matching)
        self.found = [entry for entry in matching if self.with_truths or not entry.is_truth]
        self._rows = list[Row]()
        self._columns = 0  # of those rows

    @property
    def is_complete(self) -> bool:
        """Whether all pictures in sight are drawn."""
        return self._previews.is_complete

    def fit(self, window: Rect, text_height: int) -> None:
        """Set the window that the picker fills, and the height of its text, px.

        columns: how many previews are side by side; view: the part of the window that has them.
        """
        self._window, self._text_height, self._pad = window, text_height, text_height
        self.columns = max(1, (window.width - text_height) // (TILE_WIDTH * text_height + text_height))
        head, foot = round(3.5 * text_height), round((ABOUT_LINES * 1.4 + 0.5) * text_height)
        foot = foot if window.height > 20 * text_height else 0
        self.view = Rect(window.x, window.y + head, window.width, window.height - head - foot)
        self._tile_width = (window.width - text_height) // self.columns - text_height
        preview = round(TILE_WIDTH * text_height * PREVIEW_HEIGHT)
        self._tile_height = preview + round(2 * 1.4 * text_height)
        self._picture_size = self._tile_width, self._tile_height - 2 * round(1.4 * text_height)

    # Events

    def on_event(self, event: Event) -> None:
        """Handle an event."""
        if event.type == pygame.KEYDOWN:
            self._on_key(event)
        elif event.type == pygame.MOUSEWHEEL:
            self._scroll_to(self._first_row - event.y)
        elif event.type == pygame.MOUSEMOTION:
            self._drags_bar = self._drags_bar and bool(event.buttons[0])
            over = self._tile_at(event.pos)
            if self._drags_bar:
                self._scroll_by_bar(event.pos[1])
            elif over is not None:
                self.chosen = over
        elif event.type == pygame.MOUSEBUTTONDOWN and event.button == 1:
            self._on_click(event.pos)

    def _on_click(self, point: tuple[int, int]) -> None:
        over = self._tile_at(point)
        if self.tick.collidepoint(point):
            self._toggle_truths()
        elif self.bar and self.bar.inflate(self._pad, 0).collidepoint(point):
            self._drags_bar = True
            self._scroll_by_bar(point[1])
        elif over is not None:
            self.chosen = over
            self._choose_current()
        elif not self._field.collidepoint(point):
            self._close()

    def _tile_at(self, point: tuple[int, int]) -> int | None:
        if not self.view.collidepoint(point):
            return None
        return next((index for index, place in self.places() if place.collidepoint(point)), None)

    def _on_key(self, event: Event) -> None:
        page = max(1, self.view.height // (self._tile_height + self._pad))  # rows that fit into the window
        moves = {pygame.K_LEFT: -1, pygame.K_RIGHT: 1}
        rows = {pygame.K_UP: -1, pygame.K_DOWN: 1, pygame.K_PAGEUP: -page, pygame.K_PAGEDOWN: page}
        if event.key == pygame.K_ESCAPE:
            self._close()
        elif event.key in (pygame.K_RETURN, pygame.K_KP_ENTER):
            self._choose_current()
        elif event.key == pygame.K_TAB:
            self._toggle_truths()
        elif event.key in moves:
            self._select(self.chosen + moves[event.key])
        elif event.key in rows and self.rows:
            row = self._row_of(self.chosen)
            across = self.chosen - self.rows[row].indices.start
            to = self.rows[max(0, min(row + rows[event.key], len(self.rows) - 1))].indices
            self._select(min(to.start + across, to.stop - 1))
        elif event.key == pygame.K_BACKSPACE:
            self._type(self.typed[:-1])
        elif event.unicode and event.unicode.isprintable():
            self._type(self.typed + event.unicode)

    def _type(self, typed: str) -> None:
        self.typed, self.chosen, self._first_row = typed, 0, 0
        self._search()

    def _toggle_truths(self) -> None:
        self.with_truths = not self.with_truths
        self._search()
        truths = [k for k, entry in enumerate(self.found) if entry.is_truth]
        self._select(truths[0] if truths else 0)

    def _select(self, index: int) -> None:
        """Choose a scene by its number, and scroll it into sight."""
        self.chosen = max(0, min(index, len(self.found) - 1))
        row = self._row_of(self.chosen)
        while self._first_row < row and self._top(row + 1) - self._top(self._first_row) > self.view.height:
            self._first_row += 1
        self._first_row = min(self._first_row, row)

    def _choose_current(self) -> None:
        if self.found:
            self._choose(self.found[self.chosen].file)

    # Scrolling

    @property
    def rows(self) -> list[Row]:
        """All rows."""
        if self._columns == self.columns:
            return self._rows
        rows, start = list[Row](), 0
        for topic, group in groupby(self.found, key=lambda entry: entry.topic):
            stop = start + len(list(group))
            firsts = range(start, stop, self.columns)
            rows += [Row("" if k else topic, range(at, min(at + self.columns, stop))) for k, at in enumerate(firsts)]
            start = stop
        self._rows, self._columns = rows, self.columns
        return rows

    def _row_of(self, index: int) -> int:
        return next((k for k, row in enumerate(self.rows) if index in row.indices), 0)

    def _height(self, row: Row) -> int:
        return self._tile_height + self._pad + (round(HEADING * self._text_height) if row.heading else 0)

    def _top(self, count: int) -> int:
        """Return the height of the first rows, px."""
        return sum(self._height(row) for row in self.rows[:count])

    @property
    def _last_first_row(self) -> int:
        """The first row that is seen when the last one is."""
        count = len(self.rows)
        whole = self._top(count)
        return next((row for row in range(count) if whole - self._top(row) <= self.view.height), max(0, count - 1))

    def _scroll_to(self, row: int) -> None:
        self._first_row = max(0, min(row, self._last_first_row))

    def _scroll_by_bar(self, y: int) -> None:
        """Scroll so that the middle of the bar is at a height of the window."""
        whole = self._top(len(self.rows))
        top = (y - self.view.y) * whole / self.view.height - self.view.height / 2
        self._scroll_to(sum(self._top(k + 1) <= top for k in range(len(self.rows))))

    # Layout

    @property
    def _field(self) -> Rect:
        left = self._window.x + self._pad
        return Rect(left, self.tick.y, self.tick.x - self._pad - left, 2 * self._text_height)

    @property
    def tick(self) -> Rect:
        """The place of the tick that lists the truths, and of its words."""
        width = text_width(TICK.format(self.truths), self._text_height) + 2 * self._text_height
        right = self._window.right - self._pad
        return Rect(right - width, self._window.y + self._text_height, width, 2 * self._text_height)

    @property
    def bar(self) -> Rect | None:
        """The place of the scroll bar's handle; None if all is seen."""
        whole, view = self._top(len(self.rows)), self.view
        if whole <= view.height:
            return None
        width = max(4, self._pad // 2)
        height = max(2 * self._pad, view.height * view.height // whole)
        room, last = view.height - height, max(1, self._last_first_row)
        return Rect(view.right - width - 2, view.y + room * min(self._first_row, last) // last, width, height)

    def places(self) -> list[tuple[int, Rect]]:
        """Return the scenes in sight, by their number in `found`, and their places; the last may be seen in part."""
        tiles = (tile for *_, row in self._placed_rows() for tile in row)
        return [(index, place) for index, place in tiles if place.colliderect(self.view)]

    def _placed_rows(self) -> list[tuple[str, Rect, list[tuple[int, Rect]]]]:
        """Return the rows in sight: heading, its place, and the tiles with their places."""
        self._first_row = min(self._first_row, self._last_first_row)
        placed, y = [], self.view.y
        for row in self.rows[self._first_row :]:
            if y >= self.view.bottom:
                break
            heading = Rect(self._window.x + self._pad, y, self._window.width - 2 * self._pad, self._height(row))
            heading.height -= self._tile_height + self._pad
            tile = Rect(heading.bottomleft, (self._tile_width, self._tile_height))
            tiles = [(index, tile.move(k * (tile.width + self._pad), 0)) for k, index in enumerate(row.indices)]
            placed.append((row.heading, heading, tiles))
            y += self._height(row)
        return placed

    # Drawing

    def draw(self, surface: Surface) -> None:
        """Draw the search field and the previews."""
        self._previews.begin_frame()
        panel(surface, self._window)
        self._draw_search(surface)
        self._draw_tick(surface)
        surface.set_clip(self.view)
        for heading, place, tiles in self._placed_rows():
            write(surface, heading, place, theme.ink, self._text_height, bold=True)
            for index, where in tiles:
                self._draw_tile(surface, self.found[index], where, chosen=index == self.chosen)
        surface.set_clip(None)
        if self.bar:
            pygame.draw.rect(surface, theme.dim, self.bar, border_radius=self.bar.width // 2)
        if self.found and self.view.bottom < self._window.bottom:
            self._draw_about(surface, self.found[self.chosen])

    def _draw_about(self, surface: Surface, entry: SceneEntry) -> None:
        height, pad = self._text_height, self._pad
        about = self._previews.of(entry.file, self._picture_size, height).about
        line = Rect(self._window.x + pad, self.view.bottom, self._window.width - 2 * pad, round(1.4 * height))
        surface.fill(theme.line, (line.x, line.y, line.width, 1))
        line.y += height // 4
        for text in first_lines(about, line.width, height, ABOUT_LINES):
            write(surface, text, line, theme.ink, height)
            line.y += line.height

    def _draw_search(self, surface: Surface) -> None:
        """Draw the field with the typed text, and the number of scenes found."""
        height, field = self._text_height, self._field
        pygame.draw.rect(surface, theme.hover, field, border_radius=height // 3)
        line = field.inflate(-height, 0)
        text = self.typed or HINT
        end = write(surface, text, line, theme.ink if self.typed else theme.dim, height)
        if self.typed:
            top = height // 3
            surface.fill(theme.ink, (end + 2, field.y + top, max(1, height // 10), field.height - 2 * top))
        listed = sum(self.with_truths or not entry.is_truth for entry in self._entries)
        count = f"{len(self.found)} of {listed}"
        left = line.right - text_width(count, height)
        if left > end + height:
            write(surface, count, Rect(left, line.y, line.right - left, line.height), theme.dim, height)

    def _draw_tick(self, surface: Surface) -> None:
        height, place = self._text_height, self.tick
        box = Rect(place.x, 0, height, height)
        box.centery = place.centery
        pygame.draw.rect(surface, theme.accent if self.with_truths else theme.raised, box, border_radius=3)
        pygame.draw.rect(surface, theme.accent if self.with_truths else theme.dim, box, 1, border_radius=3)
        if self.with_truths:
            corners = [(0.22, 0.52), (0.42, 0.72), (0.78, 0.28)]
            points = [(box.x + x * height, box.y + y * height) for x, y in corners]
            pygame.draw.lines(surface, theme.on_accent, False, points, max(2, height // 7))
        left = box.right + height // 2
        write(
            surface, TICK.format(self.truths), Rect(left, place.y, place.right - left, place.height), theme.ink, height
        )

    def _draw_tile(self, surface: Surface, entry: SceneEntry, place: Rect, *, chosen: bool) -> None:
        height, low = self._text_height, round(0.85 * self._text_height)
        picture = self._previews.of(entry.file, self._picture_size, height)
        if chosen:
            ground = place.inflate(height, height // 2)
            pygame.draw.rect(surface, theme.hover, ground, border_radius=height // 3)
            pygame.draw.rect(surface, theme.accent, ground, 2, border_radius=height // 3)
        surface.blit(picture.surface, place)
        text = Rect(place.x, 0, place.width, round(1.4 * height))
        text.y = place.bottom - 2 * text.height
        write(surface, shortened(picture.title or entry.name, text.width, height), text, theme.ink, height)
        text.y += text.height
        write(surface, shortened(entry.name, text.width, low), text, theme.dim, low)
