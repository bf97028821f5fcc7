"""The scene picker: previews of scenes by topic, found by typing."""

import tomllib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from pathlib import Path
from typing import Final

import pygame
from pygame import Rect, Surface
from pygame.event import Event

from sandbox.files import MAX_TEXT_FILE_BYTES
from sandbox.scene.files import TRUTHS, bundled
from sandbox.text import printable
from sandbox.view.offscreen import Preview, Previews
from sandbox.view.primitives import first_lines, panel, shortened, write
from sandbox.view.theme import theme
from sandbox.view.widgets import ENTER, Widget, Words
from sandbox.view.widgets.group import draw_scroll_bar, rows_of, stacked

TILE_WIDTH: Final = 12  # of a preview with its name, in heights of the text
PREVIEW_HEIGHT: Final = 0.65  # of a preview's width
ABOUT_LINES: Final = 2  # for which there is room below the previews, about the chosen scene
MAX_FILES: Final = 200  # of a folder that are listed
TRUTHS_TOPIC: Final = "Truths: each tests a law of physics"
NOTHING: Final = "No scene matches “{typed}”. Backspace deletes a letter; Esc closes."
HINT: Final = "type to search; choose with arrows and Enter, or a click; Esc closes"


@dataclass(frozen=True)
class SceneEntry:
    """A scene that can be chosen. topic: under which it is listed if the file has none."""

    name: str
    file: Path
    listed_under: str

    @cached_property
    def _text(self) -> str:
        try:
            with self.file.open("rb") as file:
                return file.read(MAX_TEXT_FILE_BYTES).decode(errors="replace")
        except OSError:
            return ""

    @cached_property
    def _head(self) -> dict[str, str]:
        """The texts that stand before all tables."""
        try:
            head = tomllib.loads(self._text.partition("\n[")[0])
        except tomllib.TOMLDecodeError:
            return {}
        return {key: printable(value) for key, value in head.items() if isinstance(value, str)}

    @cached_property
    def topic(self) -> str:
        """What the scene is listed under: its own topic, or else its folder."""
        return self._head.get("topic") or self.listed_under

    @cached_property
    def texts(self) -> tuple[str, str, str]:
        """The name; with the title; with the whole file: all in small letters."""
        name = self.name.lower()
        return name, f"{name} {self._head.get('title', '').lower()}", f"{name} {self._text.lower()}"

    def rank(self, words: Sequence[str]) -> int:
        """Return 0 if all of some words are in the name, 1 in the title too, 2 in the file; 3 if they are nowhere."""
        return next((k for k, text in enumerate(self.texts) if all(word in text for word in words)), 3)


def entries(folders: Iterable[Path]) -> list[SceneEntry]:
    """List the scenes of some folders, then the bundled ones, those of a topic together, the truths last."""
    bundles = {"Examples": bundled(), TRUTHS_TOPIC: bundled(TRUTHS)}
    examples = [SceneEntry(name, file, topic) for topic, scenes in bundles.items() for name, file in scenes.items()]
    known = {entry.file.resolve() for entry in examples}
    own: list[SceneEntry] = []
    for folder in folders:
        files = [file for file in sorted(folder.glob("*.toml")) if file.is_file() and file.resolve() not in known]
        known |= {file.resolve() for file in files}
        heading = f"In {printable(folder.resolve().name) or folder.resolve()}"
        own += [SceneEntry(printable(file.name), file, heading) for file in files[:MAX_FILES]]
    listed = [entry for entry in own if "[[balls]]" in entry.texts[-1]] + examples
    topics = list(dict.fromkeys(entry.topic for entry in listed))
    return sorted(listed, key=lambda entry: topics.index(entry.topic))


@dataclass(eq=False)
class Tile(Widget):
    """A scene's preview with its title and name; it is marked while it is hot."""

    entry: SceneEntry
    previews: Previews

    def height(self, width: int, text_height: int) -> int:
        """Return the height of the preview and two lines, px."""
        return round(TILE_WIDTH * text_height * PREVIEW_HEIGHT + 2.8 * text_height)

    def preview(self, place: Rect, text_height: int) -> Preview:
        """Return its picture and texts."""
        return self.previews.of(self.entry.file, (place.width, place.height - round(2.8 * text_height)), text_height)

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw the preview over the title and the name."""
        low, preview = round(0.85 * text_height), self.preview(place, text_height)
        if hot:
            ground = place.inflate(text_height // 2, text_height // 3)
            pygame.draw.rect(surface, theme.hover, ground, border_radius=text_height // 3)
            pygame.draw.rect(surface, theme.accent, ground, 2, border_radius=text_height // 3)
        surface.blit(preview.surface, place)
        line = Rect(place.x, place.bottom - round(2.8 * text_height), place.width, round(1.4 * text_height))
        title = preview.title or self.entry.name
        write(surface, shortened(title, line.width, text_height), line, theme.ink, text_height)
        line.y += line.height
        write(surface, shortened(self.entry.name, line.width, low), line, theme.dim, low)


class ScenePicker:
    """A grid of scenes by topic over the whole window; of those that are found by typing, the best first.

    choose: runs the scene of a file. close: closes the picker. found: the scenes that it lists; chosen: the number of
    one of them.
    """

    def __init__(
        self, folders: Iterable[Path], choose: Callable[[Path], None], close: Callable[[], None], previews: Previews
    ) -> None:
        self._choose, self._close, self._previews = choose, close, previews
        self._entries = entries(folders)
        self._window, self._text_height = Rect(0, 0, 1, 1), 1
        self._type("")

    def _type(self, typed: str) -> None:
        """Find the scenes that contain every typed word."""
        self.typed, self.chosen, self._scrolled = typed, 0, 0  # px scrolled
        ranks = {entry: entry.rank(typed.lower().split()) for entry in self._entries}
        self.found = sorted((entry for entry in self._entries if ranks[entry] < 3), key=ranks.__getitem__)
        self._arrange()

    def _arrange(self) -> None:
        """Place the tiles, below the names of their topics if nothing is typed."""
        height, rows = self._text_height, list[Sequence[Widget]]()
        columns = max(1, self.view.width // ((TILE_WIDTH + 1) * height))
        for topic, group in groupby(self.found, key=lambda entry: "" if self.typed else entry.topic):
            rows += [[Words(topic, bold=True)]] if topic else []
            tiles = [Tile(entry, self._previews) for entry in group]
            rows += rows_of([*tiles, *(Words("") for _ in range(-len(tiles) % columns))], columns)
        rows += [] if rows else [[Words(NOTHING.format(typed=self.typed))]]
        self._placed, self._height = stacked(rows, self.view.width, height, gap=height)
        self._tiles = [(widget, place) for widget, place in self._placed if isinstance(widget, Tile)]  # as found

    @property
    def is_complete(self) -> bool:
        """Whether all pictures in sight are drawn."""
        return self._previews.is_complete

    def fit(self, window: Rect, text_height: int) -> None:
        """Set the window that the picker fills, and the height of its text, px."""
        if (window, text_height) != (self._window, self._text_height):
            self._window, self._text_height = window, text_height
            self._arrange()

    @property
    def view(self) -> Rect:
        """The part of the window that has the previews."""
        height, window = self._text_height, self._window
        foot = round((ABOUT_LINES * 1.4 + 0.5) * height) if window.height > 20 * height else 0
        head = round(3.5 * height)
        return Rect(height, head, max(1, window.width - 2 * height), max(1, window.height - head - foot))

    def places(self) -> list[tuple[int, Rect]]:
        """Return the scenes in sight, by their number in `found`, and their places; the last may be seen in part."""
        places = ((k, self._on_screen(place)) for k, (_, place) in enumerate(self._tiles))
        return [(index, place) for index, place in places if place.colliderect(self.view)]

    def _on_screen(self, place: Rect) -> Rect:
        return place.move(self.view.x, self.view.y - self._scrolled)

    # Events

    def on_event(self, event: Event) -> None:
        """Handle an event."""
        if event.type == pygame.KEYDOWN:
            self._on_key(event)
        elif event.type == pygame.MOUSEWHEEL:
            self._scroll_to(self._scrolled - event.y * 6 * self._text_height)
        elif event.type == pygame.MOUSEMOTION:
            self.chosen = next(self._under(event.pos), self.chosen)
        elif event.type == pygame.MOUSEBUTTONDOWN and event.button == 1:
            index = next(self._under(event.pos), None)
            if index is not None:
                self._choose(self.found[index].file)
            elif not self._field.collidepoint(event.pos):
                self._close()

    def _under(self, point: tuple[int, int]) -> Iterator[int]:
        return (k for k, place in self.places() if place.collidepoint(point) and self.view.collidepoint(point))

    def _on_key(self, event: Event) -> None:
        steps = {pygame.K_LEFT: -1, pygame.K_RIGHT: 1}
        rows = {pygame.K_UP: -1, pygame.K_DOWN: 1}
        if event.key == pygame.K_ESCAPE:
            self._close()
        elif event.key in ENTER:
            if self.found:
                self._choose(self.found[self.chosen].file)
        elif event.key in steps:
            self._select(self.chosen + steps[event.key])
        elif event.key in rows:
            self._select(self._beyond(rows[event.key]))
        elif event.key == pygame.K_BACKSPACE:
            self._type(self.typed[:-1])
        elif event.unicode and event.unicode.isprintable():
            self._type(self.typed + event.unicode)

    def _beyond(self, way: int) -> int:
        """Return the tile of the next row below the chosen one that is nearest, or of the row above it if way < 0."""
        here = self._tiles[self.chosen][1] if self._tiles else Rect(0, 0, 0, 0)
        others = [(k, place) for k, (_, place) in enumerate(self._tiles) if (place.y - here.y) * way > 0]
        distances = [(abs(place.y - here.y), abs(place.x - here.x), k) for k, place in others]
        return min(distances, default=(0, 0, self.chosen))[-1]

    def _select(self, index: int) -> None:
        """Choose a scene by its number, and scroll it into sight."""
        self.chosen = max(0, min(index, len(self.found) - 1))
        if self._tiles:
            place = self._tiles[self.chosen][1]
            below = place.bottom + self._text_height - self.view.height
            self._scroll_to(min(max(self._scrolled, below), place.y - 3 * self._text_height))

    def _scroll_to(self, y: int) -> None:
        self._scrolled = max(0, min(y, self._height - self.view.height))

    # Drawing

    @property
    def _field(self) -> Rect:
        height = self._text_height
        return Rect(height, height, max(1, self._window.width - 2 * height), 2 * height)

    def draw(self, surface: Surface) -> None:
        """Draw the search field and the previews."""
        height, view = self._text_height, self.view
        self._previews.begin_frame()
        self._scroll_to(self._scrolled)
        panel(surface, self._window)
        self._draw_search(surface)
        surface.set_clip(view.inflate(height, 0))
        chosen, chosen_place = self._tiles[self.chosen] if self._tiles else (None, None)
        for widget, where in self._placed:
            if (place := self._on_screen(where)).colliderect(view):
                widget.draw(surface, place, height, hot=widget is chosen)
        surface.set_clip(None)
        draw_scroll_bar(surface, view, self._height, self._scrolled, height)
        if chosen and chosen_place and view.bottom < self._window.bottom:
            line = Rect(view.x, view.bottom, view.width, round(1.4 * height))
            surface.fill(theme.line, (line.x, line.y, line.width, 1))
            about = chosen.preview(chosen_place, height).about
            for number, text in enumerate(first_lines(about, line.width, height, ABOUT_LINES)):
                write(surface, text, line.move(0, height // 4 + number * line.height), theme.ink, height)

    def _draw_search(self, surface: Surface) -> None:
        """Draw the field with the typed text."""
        height, field = self._text_height, self._field
        pygame.draw.rect(surface, theme.hover, field, border_radius=height // 3)
        line = field.inflate(-height, 0)
        end = write(surface, self.typed or HINT, line, theme.ink if self.typed else theme.dim, height)
        if self.typed:
            surface.fill(theme.ink, (end + 2, field.y + height // 3, max(1, height // 10), field.height * 2 // 3))
