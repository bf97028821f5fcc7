"""The column beside the panes: one page of widgets below the names of all, or nothing; the pages Scene and Show."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Final, Protocol

import pygame
from pygame import Rect, Surface

from sandbox.scene.units import PER_METRE, Dimension
from sandbox.view.controls import Action, Panel, tip_of
from sandbox.view.editor import Editor
from sandbox.view.playback import Playback
from sandbox.view.theme import theme
from sandbox.view.toolbars import Do, action_button
from sandbox.view.widgets import TextButton, Widget, Words
from sandbox.view.widgets.fields import Slider
from sandbox.view.widgets.group import Placed, draw_scroll_bar, rows_of, stacked

SCROLLED_LINES: Final = 4  # by a notch of the wheel
ELASTICITIES: Final = tuple(k / 20 for k in range(21))
GRAVITIES: Final = tuple(range(-10, 21))  # m/s², downwards
PIXELS_PER_METRE: Final = 100.0  # of scenes that do not say it
RATES: Final = (15, 30, 60, 120, 240, 480, 960, 1920, 3840)
LAYERS: Final = (Action.VELOCITY, Action.TRAILS, Action.NUMBERS, Action.GHOSTS, Action.CHARTS)
SAVES: Final = (Action.SAVE_SCENE, Action.SAVE_PICTURE, Action.SAVE_INPUTS)
LOOKS: Final = (Action.THEME, Action.SMALLER_TEXT, Action.LARGER_TEXT)


class Page(Protocol):
    """What the side panel shows. A widget that stays keeps the keyboard and what is typed into it."""

    def rows(self) -> Sequence[Sequence[Widget]]:
        """Return the rows of its widgets, from the top, as they are now."""


class SidePanel:
    """Shows one of some pages, or none; the wheel scrolls it."""

    def __init__(self, pages: Mapping[Panel, Page]) -> None:
        self._pages = pages
        self._tabs = [
            TextButton(page.value, partial(self.show, page), tip_of(Action[page.name]), partial(self._is_open, page))
            for page in pages
        ]
        self._scrolled = 0.0  # heights of the text
        self._height = 0  # of the page, px
        self.open: Panel | None = None
        self._latest = next(iter(pages))

    def _is_open(self, panel: Panel) -> bool:
        return self.open is panel

    def show(self, panel: Panel) -> None:
        """Show a page."""
        if self.open is not panel:
            self.toggle(panel)

    def toggle(self, panel: Panel | None = None) -> None:
        """Show a page, or nothing if it is shown already. By default, it is the page that was shown last."""
        panel = panel or self._latest
        self.open = None if self.open is panel else panel
        self._latest = panel
        self._scrolled = 0.0

    def scroll(self, notches: int) -> None:
        """Scroll by notches of the wheel, upwards if positive."""
        self._scrolled -= notches * SCROLLED_LINES

    def placed(self, place: Rect, text_height: int) -> list[Placed]:
        """Return its widgets with their places, of which some may be scrolled out of the panel. place: the panel's."""
        if self.open is None:
            return []
        body = _body(place, text_height)
        rows, self._height = stacked(self._pages[self.open].rows(), body.width, text_height)
        for widget, _ in rows:
            widget.seen_in = body
        lines = max(0, self._height - body.height) / text_height
        self._scrolled = min(max(self._scrolled, 0), lines)
        y = body.y - round(self._scrolled * text_height)
        head, _ = stacked([self._tabs], body.width, text_height)
        top = place.y + text_height // 3
        return [
            *((widget, where.move(body.x, top)) for widget, where in head),
            *((widget, where.move(body.x, y)) for widget, where in rows),
        ]

    def draw(self, surface: Surface, place: Rect, text_height: int) -> None:
        """Draw the ground of the page, and at its right which part of it is seen."""
        if self.open is None:
            return
        pygame.draw.rect(surface, theme.raised, place, border_radius=8)
        pygame.draw.rect(surface, theme.line, place, 1, border_radius=8)
        body = _body(place, text_height)
        surface.fill(theme.line, (body.x, body.y - text_height // 3, body.width, 1))
        draw_scroll_bar(surface, body, self._height, self._scrolled * text_height, text_height)


def _body(place: Rect, text_height: int) -> Rect:
    """Return where the rows of a page are, below its title."""
    pad, head = round(0.8 * text_height), round(2.9 * text_height)
    return Rect(place.x + pad, place.y + head, place.width - 2 * pad, max(1, place.height - head - pad))


class ScenePage:
    """Says what the scene is, and changes what applies to all balls."""

    def __init__(self, playback: Playback, editor: Editor, do: Do) -> None:
        self._playback = playback
        self._editor = editor
        self._title, self._about, self._facts = Words("", bold=True), Words(""), Words("")

        def gravity() -> float:
            return playback.scene.gravity[1] * self._playback.scene.units.factor(Dimension.ACCELERATION)

        def set_gravity(value: float) -> None:
            editor.set_gravity(value / self._playback.scene.units.factor(Dimension.ACCELERATION))

        self._gravity = Slider("gravity", GRAVITIES, gravity, set_gravity, "downwards")
        self._elasticity = Slider(
            "elasticity", ELASTICITIES, editor.elasticity, editor.set_elasticity, "of any two that meet"
        )
        self._steps = Slider("steps", RATES, lambda: playback.scene.rate, editor.set_rate, unit=" per second")
        runs, saves = (
            [action_button(action, do) for action in actions]
            for actions in ((Action.RESTART, Action.DISCARD_EDITS, Action.NEXT_SEED), SAVES)
        )
        self._buttons: list[Sequence[Widget]] = [runs, [Words("Save", bold=True)], *rows_of(saves)]

    def rows(self) -> Sequence[Sequence[Widget]]:
        """Return the rows of its widgets."""
        scene = self._playback.scene
        self._title.text, self._about.text = scene.title or scene.name, scene.about
        balls = len(scene.bodies)
        self._facts.text, self._facts.colour = f"{balls:,} ball{'s' * (balls != 1)}, seed {scene.seed}", theme.dim
        self._gravity.unit = f" {scene.units.name(Dimension.ACCELERATION)}"
        self._gravity.values = [PER_METRE.get(scene.units.length, PIXELS_PER_METRE) * value for value in GRAVITIES]
        self._elasticity.unit = "" if self._editor.has_one_elasticity else " between balls"
        texts = [self._title, *([self._about] if scene.about else []), self._facts]
        column = [*texts, self._gravity, self._elasticity, self._steps]
        return [*rows_of(column, 1), *self._buttons]


class ShowPage:
    """Buttons for what can be shown and hidden. is_on: whether an action's state is on."""

    def __init__(self, do: Do, is_on: Callable[[Action], bool]) -> None:
        def buttons(actions: Sequence[Action]) -> list[Sequence[Widget]]:
            return rows_of([action_button(action, do, is_on=partial(is_on, action)) for action in actions])

        self._rows = [
            [Words("In the panes", bold=True)],
            *buttons(LAYERS),
            [Words("The window", bold=True)],
            *buttons(LOOKS),
        ]

    def rows(self) -> Sequence[Sequence[Widget]]:
        """Return the rows of its widgets."""
        return self._rows
