"""The side panel shows a page of widgets beside the panes, by mouse alone and by keyboard alone."""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
import pygame
import pytest
from numpy.typing import NDArray
from pygame import Rect, Surface
from pygame.event import Event

from sandbox.view.controls import Panel
from sandbox.view.layout import Layout
from sandbox.view.primitives import SMALLEST_TEXT, text_width
from sandbox.view.side_panel import SidePanel
from sandbox.view.theme import theme
from sandbox.view.widgets import Bar, TextButton, Widget
from sandbox.view.widgets.fields import Field
from sandbox.view.widgets.group import WidgetGroup

PLACE = Rect(600, 40, 320, 300)
TEXT_HEIGHT = 16


class Notes:
    """A page with a field, a button, a bar, and as many paragraphs as wanted."""

    title = "notes"

    def __init__(self, paragraphs: int) -> None:
        self.mass, self.done = "1.5", list[str]()
        self.field = Field("mass", lambda: self.mass, self.set_mass, "of the ball", "kg")
        self.button = TextButton("double", lambda: self.done.append("double"), refusal=lambda: self.refusal)
        self.bar = Bar("friction", "-20 %", -0.5, theme.accent)
        self.words = [TextButton(f"button {k}", partial(self.done.append, f"{k}")) for k in range(paragraphs)]
        self.refusal = ""

    def set_mass(self, text: str) -> None:
        self.mass = text

    def rows(self) -> Sequence[Sequence[Widget]]:
        return [[self.field, self.button], [self.bar], *([words] for words in self.words)]


class Desk:
    """A panel that shows a page."""

    def __init__(self, paragraphs: int = 3) -> None:
        self.page = Notes(paragraphs)
        self.group = WidgetGroup()
        self.panel = SidePanel({Panel.WHY: self.page})
        self.panel.toggle(Panel.WHY)

    def place_of(self, widget: Widget) -> Rect:
        return next(place for one, place in self.panel.placed(PLACE, TEXT_HEIGHT) if one is widget)

    def send(self, event: Event) -> bool:
        return self.group.on_event(event, self.panel.placed(PLACE, TEXT_HEIGHT))

    def click(self, widget: Widget) -> None:
        for what in (pygame.MOUSEBUTTONDOWN, pygame.MOUSEBUTTONUP):
            self.send(Event(what, pos=self.place_of(widget).center, button=1))

    def type(self, text: str) -> None:
        codes = {"\r": pygame.K_RETURN, "\t": pygame.K_TAB, "\x1b": pygame.K_ESCAPE, "\b": pygame.K_BACKSPACE}
        for letter in text:
            self.send(Event(pygame.KEYDOWN, key=codes.get(letter, ord(letter)), unicode=letter, mod=0))

    def drawn(self) -> Surface:
        surface = Surface((960, 400))
        self.panel.draw(surface, PLACE, TEXT_HEIGHT)
        self.group.draw(surface, self.panel.placed(PLACE, TEXT_HEIGHT), TEXT_HEIGHT)
        return surface


def test_an_open_panel_takes_its_place_from_panes_and_charts_and_nothing_else() -> None:
    closed, opened = (
        Layout((1024, 640), (800, 600), 2, 14, has_chart=True, has_controls=True, has_column=is_open)
        for is_open in (False, True)
    )
    assert not closed.panel.width
    assert opened.header == closed.header
    for place in (*opened.arenas, *(opened.title(pane) for pane in range(2)), opened.palette, opened.timeline):
        assert place.right <= opened.panel.x
    assert opened.panel.bottom == opened.timeline.bottom == closed.timeline.bottom


def test_widgets_stand_in_their_rows_inside_the_panel_and_do_not_overlap() -> None:
    desk = Desk()
    field, button, bar = map(desk.place_of, (desk.page.field, desk.page.button, desk.page.bar))
    assert (field.y, field.height) == (button.y, button.height)
    assert field.width == pytest.approx(button.width, abs=1)
    places = [place for _, place in desk.panel.placed(PLACE, TEXT_HEIGHT)]
    assert all(PLACE.contains(place) for place in places)
    assert all(len(place.collidelistall(places)) == 1 for place in places)
    assert bar.width == button.right - field.x


def test_a_field_is_typed_into_and_enter_or_tab_chooses() -> None:
    desk = Desk()
    desk.click(desk.page.field)
    desk.type("2.5p")  # and the window does not pause
    assert desk.page.mass == "1.5"
    desk.type("\b\r")
    assert desk.page.mass == "2.5"
    assert not desk.send(Event(pygame.KEYDOWN, key=pygame.K_SPACE, unicode=" ", mod=0))  # which pauses the window again
    assert not desk.send(Event(pygame.KEYDOWN, key=pygame.K_p, unicode="p", mod=0))
    desk.click(desk.page.field)
    desk.type("\r")
    assert desk.page.mass == "2.5"
    desk.click(desk.page.field)
    desk.type("7\t")
    assert desk.page.mass == "7"


@pytest.mark.parametrize("how", ["Esc", "a click elsewhere"])
def test_what_was_typed_is_given_up(how: str) -> None:
    desk = Desk()
    desk.click(desk.page.field)
    desk.type("99")
    if how == "Esc":
        desk.type("\x1b")
    else:
        desk.send(Event(pygame.MOUSEBUTTONDOWN, pos=(10, 10), button=1))
    assert (desk.page.mass, desk.page.field.typed) == ("1.5", None)


LABELLED: list[Callable[[str], Widget]] = [
    lambda text: TextButton(text, print),
    lambda text: TextButton(text, print, colour=theme.accent),
    lambda text: Field("mass", lambda: text, print),
    lambda text: Field(text, lambda: "1.5", print, unit="kg"),
]


@pytest.mark.parametrize("labelled", LABELLED, ids=["button", "marked button", "value", "name of a value"])
def test_the_end_of_a_text_is_seen_in_a_narrow_widget(labelled: Callable[[str], Widget]) -> None:
    """At its usual height the text would not fit, and two that differ in their ends only would look the same."""
    for width in range(text_width("collision_persist", TEXT_HEIGHT), text_width("collision_persist 8", TEXT_HEIGHT)):
        seen = [picture(labelled(f"collision_persist {end}"), width) for end in "08"]  # as wide as each other
        assert (seen[0] != seen[1]).any()


def picture(widget: Widget, width: int, text_height: int = TEXT_HEIGHT) -> NDArray[np.uint8]:
    """Draw a widget of a width, px. Return its pixels: (width, height, 3)."""
    surface = Surface((width, 2 * TEXT_HEIGHT))
    widget.draw(surface, surface.get_rect(), text_height, hot=False)
    return pygame.surfarray.array3d(surface)


def test_a_button_that_is_refused_does_nothing_and_says_why() -> None:
    desk = Desk()
    desk.click(desk.page.button)
    desk.page.refusal = "nothing to double"
    desk.click(desk.page.button)
    assert desk.page.done == ["double"]
    assert desk.page.button.tip == "nothing to double"


def test_the_wheel_scrolls_no_further_than_the_page() -> None:
    desk = Desk(paragraphs=30)
    first = desk.place_of(desk.page.field)
    for notches, last_bottom in ((1, None), (-1000, PLACE.bottom)):
        desk.panel.scroll(notches)
        if last_bottom:
            assert desk.place_of(desk.page.words[-1]).bottom == pytest.approx(last_bottom, abs=1.5 * TEXT_HEIGHT)
        else:
            assert desk.place_of(desk.page.field) == first
    desk.panel.scroll(1000)
    assert desk.place_of(desk.page.field) == first


def test_a_loss_is_a_bar_to_the_left_of_the_middle() -> None:
    desk = Desk()
    pixels = pygame.surfarray.array3d(desk.drawn())
    seen = (pixels == theme.accent[:3]).all(axis=2)
    seen[:, : desk.place_of(desk.page.field).y] = False  # the tab
    columns = np.nonzero(seen)[0]
    bar = desk.place_of(desk.page.bar)
    width = bar.width - TEXT_HEIGHT
    assert columns.max() == pytest.approx(bar.centerx, abs=2)
    assert np.ptp(columns) == pytest.approx(width / 4, abs=2)


@pytest.mark.parametrize("widgets", [3, 6, 7])
def test_a_row_of_many_widgets_ends_where_the_panel_s_text_does(widgets: int) -> None:
    desk = Desk()
    row = [TextButton("x", lambda: None) for _ in range(widgets)]
    desk.page.rows = lambda: [[desk.page.bar], row]  # type: ignore[method-assign]
    for width in range(300, 320):
        place = Rect(0, 0, width, 300)
        placed = dict(desk.panel.placed(place, TEXT_HEIGHT)[1:])
        assert placed[row[-1]].right == placed[desk.page.bar].right


def test_a_text_too_long_for_its_button_can_still_be_read() -> None:
    """It is as high as the smallest text, and its end is cut off."""
    heights = []
    for width, text_height in ((4 * TEXT_HEIGHT, TEXT_HEIGHT), (800, SMALLEST_TEXT)):
        plain, lettered = (picture(TextButton(text, print), width, text_height) for text in ("", 20 * "H"))
        _, rows = np.nonzero((plain != lettered).any(axis=2))
        heights.append(np.ptp(rows))
    assert heights[0] == heights[1]


def test_what_is_scrolled_away_is_neither_drawn_nor_pressed_over_the_title_or_below() -> None:
    desk = Desk(paragraphs=30)
    desk.click(desk.page.words[-1])
    desk.panel.scroll(-3)
    desk.click(desk.page.button)
    desk.drawn()
    above = [(w, p) for w, p in desk.panel.placed(PLACE, TEXT_HEIGHT) if p.bottom < PLACE.y + 2 * TEXT_HEIGHT][2:]
    assert above
    assert not pygame.surfarray.array3d(desk.drawn())[:, : PLACE.y].any()
    desk.send(Event(pygame.MOUSEBUTTONDOWN, pos=(PLACE.x + 20, PLACE.y + 10), button=1))
    assert desk.page.done == []
