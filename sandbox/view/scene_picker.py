"""The scene picker: previews of scenes, found by typing."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Final

import pygame
from pygame import Rect, Surface
from pygame.event import Event

from sandbox.errors import SandboxError
from sandbox.files import MAX_TEXT_FILE_BYTES
from sandbox.scene.files import TRUTHS, bundled, load
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.text import printable
from sandbox.view.discs import Discs
from sandbox.view.palette import palette
from sandbox.view.pane import draw_walls
from sandbox.view.primitives import panel, text_width, wrapped, write
from sandbox.view.theme import theme

TILE_WIDTH: Final = 12  # of a preview with its name, in heights of the text
PREVIEW_HEIGHT: Final = 0.65  # of a preview's width
ABOUT_LINES: Final = 2  # for which there is room below the previews, about the chosen scene; often for more
MAX_FILES: Final = 200  # of a folder that are listed


@dataclass(frozen=True)
class SceneEntry:
    """A scene that can be chosen."""

    name: str
    file: Path

    @cached_property
    def words(self) -> str:
        """The text that is searched: the name, and the whole file."""
        try:
            with self.file.open("rb") as file:
                return f"{self.name} {file.read(MAX_TEXT_FILE_BYTES).decode(errors='replace')}".lower()
        except OSError:
            return self.name.lower()


def entries(folders: Iterable[Path]) -> list[SceneEntry]:
    """List the scenes of some folders, then the bundled ones."""
    examples = [SceneEntry(name, file) for name, file in (*bundled().items(), *bundled(TRUTHS).items())]
    known = {entry.file.resolve() for entry in examples}
    own: list[SceneEntry] = []
    for folder in folders:
        files = [file for file in sorted(folder.glob("*.toml")) if file.is_file() and file.resolve() not in known]
        known |= {file.resolve() for file in files}
        own += [SceneEntry(printable(file.name), file) for file in files[:MAX_FILES]]
    return [entry for entry in own if "[[balls]]" in entry.words] + examples


class ScenePicker:
    """A grid of scenes over the whole window, those of some folders first.

    choose: runs the scene of a file. close: closes the picker.
    """

    def __init__(self, folders: Iterable[Path], choose: Callable[[Path], None], close: Callable[[], None]) -> None:
        self._choose = choose
        self._close = close
        self._entries = entries(folders)
        self.typed = ""
        self.chosen = 0
        self._first_row = 0
        self._window = Rect(0, 0, 1, 1)
        self._text_height = 1

    @property
    def found(self) -> list[SceneEntry]:
        """The scenes that contain every typed word."""
        words = self.typed.lower().split()
        return [entry for entry in self._entries if all(word in entry.words for word in words)]

    def fit(self, window: Rect, text_height: int) -> None:
        """Set the window that the picker fills, and the height of its text, px."""
        self._window, self._text_height = window, text_height

    # Events

    def on_event(self, event: Event) -> None:
        """Handle an event."""
        if event.type == pygame.KEYDOWN:
            self._on_key(event)
        elif event.type == pygame.MOUSEWHEEL:
            self._move(-event.y * self.columns)
        elif event.type == pygame.MOUSEMOTION or (event.type == pygame.MOUSEBUTTONDOWN and event.button == 1):
            over = next((index for index, place in self.places() if place.collidepoint(event.pos)), None)
            if over is not None:
                self.chosen = over
            if event.type == pygame.MOUSEBUTTONDOWN:
                self._close() if over is None else self._choose_current()

    def _on_key(self, event: Event) -> None:
        moves = {pygame.K_LEFT: -1, pygame.K_RIGHT: 1, pygame.K_UP: -self.columns, pygame.K_DOWN: self.columns}
        pages = {pygame.K_PAGEUP: -1, pygame.K_PAGEDOWN: 1}
        if event.key == pygame.K_ESCAPE:
            self._close()
        elif event.key in (pygame.K_RETURN, pygame.K_KP_ENTER):
            self._choose_current()
        elif event.key in moves:
            self._move(moves[event.key])
        elif event.key in pages:
            self._move(pages[event.key] * self.columns * self.rows)
        elif event.key == pygame.K_BACKSPACE:
            self._type(self.typed[:-1])
        elif event.unicode and event.unicode.isprintable():
            self._type(self.typed + event.unicode)

    def _type(self, typed: str) -> None:
        self.typed, self.chosen = typed, 0

    def _move(self, by: int) -> None:
        self.chosen = max(0, min(self.chosen + by, len(self.found) - 1))

    def _choose_current(self) -> None:
        found = self.found
        if found:
            self._choose(found[self.chosen].file)

    # Layout

    @property
    def columns(self) -> int:
        """How many previews are side by side."""
        return max(1, (self._window.width - self._pad) // (TILE_WIDTH * self._text_height + self._pad))

    @property
    def rows(self) -> int:
        """How many rows of previews fit into the window."""
        return max(1, (self._window.height - self._head - self._foot - self._pad) // (self._tile_height + self._pad))

    @property
    def _pad(self) -> int:
        return self._text_height

    @property
    def _head(self) -> int:
        return 4 * self._text_height

    @property
    def _foot(self) -> int:
        return round(ABOUT_LINES * 1.4 * self._text_height) if self._window.height > 20 * self._text_height else 0

    @property
    def _tile_width(self) -> int:
        return (self._window.width - self._pad) // self.columns - self._pad

    @property
    def _tile_height(self) -> int:
        return round(TILE_WIDTH * self._text_height * PREVIEW_HEIGHT) + round(2 * 1.4 * self._text_height)

    @property
    def _picture_size(self) -> tuple[int, int]:
        return self._tile_width, self._tile_height - 2 * round(1.4 * self._text_height)

    def places(self) -> list[tuple[int, Rect]]:
        """Return the visible scenes, by their number in `found`, and their places."""
        row = self.chosen // self.columns
        self._first_row = min(max(self._first_row, row - self.rows + 1), row)
        visible = range(self._first_row * self.columns, (self._first_row + self.rows) * self.columns)
        places = []
        for index in visible[: max(0, len(self.found) - visible.start)]:
            down, across = divmod(index - visible.start, self.columns)
            x = self._window.x + self._pad + across * (self._tile_width + self._pad)
            y = self._window.y + self._head + down * (self._tile_height + self._pad)
            places.append((index, Rect(x, y, self._tile_width, self._tile_height)))
        return places

    # Drawing

    def draw(self, surface: Surface) -> None:
        """Draw the search field and the previews."""
        panel(surface, self._window)
        self._draw_search(surface)
        found = self.found
        self._draw_scroll_bar(surface)
        for index, place in self.places():
            self._draw_tile(surface, found[index], place, chosen=index == self.chosen)
            if index == self.chosen and self._foot:
                self._draw_about(
                    surface, preview(found[index].file, self._picture_size, self._text_height, dark=theme.is_dark).about
                )

    def _draw_scroll_bar(self, surface: Surface) -> None:
        """Draw which rows of all are seen."""
        rows = -(-len(self.found) // self.columns)
        if rows > self.rows:
            room = self.rows * (self._tile_height + self._pad) - self._pad
            top = self._window.y + self._head + room * self._first_row // rows
            width = max(3, self._pad // 4)
            bar = Rect(self._window.right - 2 * width, top, width, max(self._pad, room * self.rows // rows))
            pygame.draw.rect(surface, theme.dim, bar, border_radius=width // 2)

    def _draw_about(self, surface: Surface, about: str) -> None:
        height, pad = self._text_height, self._pad
        line, top = round(1.4 * height), self._window.y + self._head + self.rows * (self._tile_height + pad)
        width = self._window.width - 2 * pad
        lines = wrapped(about, width, height)[: max(ABOUT_LINES, (self._window.bottom - top) // line)]
        place = Rect(self._window.x + pad, self._window.bottom - len(lines) * line, width, line)
        for text in lines:
            write(surface, text, place, theme.ink, height)
            place.y += line

    def _draw_search(self, surface: Surface) -> None:
        """Draw the field with the typed text, and the number of scenes found."""
        height = self._text_height
        field = Rect(
            self._window.x + self._pad, self._window.y + height, self._window.width - 2 * self._pad, 2 * height
        )
        pygame.draw.rect(surface, theme.hover, field, border_radius=height // 3)
        line = field.inflate(-height, 0)
        text = self.typed or "type to search; choose with arrows and Enter, or a click; Esc closes"
        end = write(surface, text, line, theme.ink if self.typed else theme.dim, height)
        if self.typed:
            surface.fill(
                theme.ink, (end + 2, field.y + height // 3, max(1, height // 10), field.height - 2 * (height // 3))
            )
        count = f"{len(self.found)} of {len(self._entries)}"
        count_place = Rect(line.right - text_width(count, height), line.y, text_width(count, height), line.height)
        if count_place.x > end + height:
            write(surface, count, count_place, theme.dim, height)

    def _draw_tile(self, surface: Surface, entry: SceneEntry, place: Rect, *, chosen: bool) -> None:
        height = self._text_height
        text = Rect(place.x, 0, place.width, round(1.4 * height))
        picture = preview(entry.file, self._picture_size, height, dark=theme.is_dark)
        if chosen:
            pygame.draw.rect(surface, theme.hover, place.inflate(height, height // 2), border_radius=height // 3)
            pygame.draw.rect(surface, theme.accent, place.inflate(height, height // 2), 2, border_radius=height // 3)
        surface.blit(picture.surface, place)
        text.y = place.bottom - 2 * text.height
        write(surface, entry.name, text, theme.ink, height)
        text.y += text.height
        write(surface, picture.title, text, theme.dim, round(0.85 * height))


@dataclass(frozen=True)
class Preview:
    """A scene's picture and texts in the picker."""

    surface: Surface
    title: str
    about: str


@lru_cache(maxsize=256)
def preview(file: Path, size: tuple[int, int], text_height: int, *, dark: bool) -> Preview:
    """Draw a scene's start in a small picture, or write its first error there. dark: the theme."""
    assert dark == theme.is_dark
    surface = Surface(size, pygame.SRCALPHA)
    try:
        loaded = load(file)
        _draw_start(surface, loaded)
    except SandboxError as error:
        write(surface, str(error).splitlines()[0], surface.get_rect(), theme.dim, round(0.85 * text_height))
        return Preview(surface, "has errors", "")
    return Preview(surface, loaded.title, loaded.about)


def _draw_start(surface: Surface, scene: Scene) -> None:
    state = spawn(scene)
    scale = min(have / need for have, need in zip(surface.get_size(), scene.arena.size, strict=True))
    arena = Rect(0, 0, max(1, round(scene.arena.size[0] * scale)), max(1, round(scene.arena.size[1] * scale)))
    arena.center = surface.get_rect().center
    inside = surface.subsurface(arena.clip(surface.get_rect()))
    inside.fill(palette(scene.arena.background).ground)
    pygame.draw.rect(surface, theme.wall, arena, 1)
    draw_walls(inside, scene, scale)
    discs = Discs(scene.bodies.radius, scene.colors)
    discs.draw(inside, state.position, scale, state.angle)
