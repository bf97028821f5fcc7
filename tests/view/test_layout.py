"""Everything in the window has its place."""

import pygame
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.view.layout import MIN_SIZE, TEXT_HEIGHT, Layout, Lens, natural_size
from sandbox.view.window import Window

SIZES = [(640, 480), (1024, 640), (1600, 1000), (2560, 1440)]


@given(
    window=st.tuples(st.integers(MIN_SIZE[0], 4000), st.integers(MIN_SIZE[1], 2500)),
    arena=st.tuples(st.floats(100, 5000), st.floats(100, 5000)),
    panes=st.integers(1, 6),
    has_chart=st.booleans(),
    has_controls=st.booleans(),
    has_column=st.booleans(),
    palette=st.integers(400, 900),
)
def test_nothing_in_the_window_overlaps_or_leaves_it(
    window: tuple[int, int],
    arena: tuple[float, float],
    panes: int,
    has_chart: bool,
    has_controls: bool,
    has_column: bool,
    palette: int,
) -> None:
    has_column = has_column and has_controls
    text = TEXT_HEIGHT if has_controls else 0
    layout = Layout(
        window, arena, panes, text, has_chart=has_chart, has_controls=has_controls, has_column=has_column,
        palette_widths=(palette // 10,) * 10, before_track=180, after_track=150,
    )  # fmt: skip
    room = min(arena.width for arena in layout.arenas) > 3 and min(arena.height for arena in layout.arenas) > 3
    places = [*layout.arenas, *(layout.title(pane) for pane in range(panes)), layout.header, layout.panel]
    places += [layout.timeline] if has_controls else [layout.strip, layout.status]
    places += [layout.palette] if has_controls and room else []
    places = [place for place in places if place.width and place.height]
    for index, place in enumerate(places):
        assert place.collidelist(places[index + 1 :]) == -1 or not room
        assert pygame.Rect((0, 0), window).contains(place) or not room
    for pane in range(panes):
        assert layout.pane_at(layout.arenas[pane].center) == pane
    inside = [layout.transport, layout.tabs, layout.strip, layout.bar] if has_controls else []
    assert all(layout.timeline.contains(place) for place in inside if place.height)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("has_column", [True, False])
def test_chart_panes_and_every_button_have_room(window: Window, size: tuple[int, int], has_column: bool) -> None:
    window.screen = pygame.display.set_mode(size)
    if has_column != (window.panel.open is not None):
        window.panel.toggle()
    layout = window.layout
    assert layout.strip.height > 0.12 * size[1]
    area = sum(arena.width * arena.height for arena in layout.arenas)
    assert area > 0.1 * size[0] * size[1]
    shown = {getattr(widget, "label", "") for widget, _ in window._placed}
    assert {"Open\N{HORIZONTAL ELLIPSIS}", "Help", "Hand", "Wall", "Erase", "Undo", "Redo", "Fit", "Pause"} <= shown
    screen = window.screen.get_rect()
    in_rows = [place for _, place in window.toolbars.placed(layout)]
    assert all(screen.contains(place) for place in in_rows)
    assert all(len(place.collidelistall(in_rows)) == 1 for place in in_rows)
    assert layout.status.collidelist(in_rows) == -1  # messages hide no button


def test_in_a_small_window_column_and_chart_give_way(window: Window) -> None:
    for size, is_small in ((MIN_SIZE, True), ((1024, 640), False), ((640, 400), True)):
        window.screen = pygame.display.set_mode(size)
        window.on_event(pygame.event.Event(pygame.WINDOWSIZECHANGED))
        layout = window.layout
        assert (window.panel.open is None, layout.strip.height == 0) == (is_small, is_small)
        assert layout.bar.width > 6 * TEXT_HEIGHT
        assert sum(arena.width * arena.height for arena in layout.arenas) > 0.2 * size[0] * size[1]


@pytest.mark.parametrize("size", SIZES)
def test_buttons_do_not_move_when_the_run_goes_on(window: Window, size: tuple[int, int]) -> None:
    window.screen = pygame.display.set_mode(size)

    def places() -> list[tuple[int, ...]]:
        return [tuple(place) for _, place in window.toolbars.placed(window.layout)]

    before = places()
    window.playback.pause()
    window.playback.speed = 0.5
    window.mouse.lens = Lens(30)
    for _ in range(20):
        window.playback.step()
    assert places() == before


def test_a_new_window_fits_the_desktop() -> None:
    for desktop in ((800, 600), (1400, 800), (1920, 1080), (3840, 2160)):
        size = natural_size(desktop)
        assert size[0] <= desktop[0]
        assert size[1] <= desktop[1]
    assert natural_size((3840, 2160)) == (1600, 1000)
