"""Everything in the window has its place."""

import numpy as np
import pygame
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pygame import Rect

from sandbox.view.layout import MIN_SIZE, Layout, natural_size
from sandbox.view.window import Window


@given(
    window=st.tuples(st.integers(MIN_SIZE[0], 4000), st.integers(MIN_SIZE[1], 2500)),
    arena=st.tuples(st.floats(100, 5000), st.floats(100, 5000)),
    panes=st.integers(1, 6),
    tools=st.sampled_from([(), ((1.0,) * 5 + (5.0,), (1.0,) * 3, (1.0,) * 9, (1.0,) * 3)]),
    charts=st.integers(0, 3),
    unfolded=st.sampled_from([True, False, None]),
)
def test_nothing_in_the_window_overlaps_or_leaves_it(
    window: tuple[int, int],
    arena: tuple[float, float],
    panes: int,
    tools: tuple[tuple[float, ...], ...],
    charts: int,
    unfolded: bool | None,
) -> None:
    layout = Layout(window, arena, panes, tools, charts, by_hand=(unfolded,) * len(tools))
    tool_places = [place for place in layout.toolbar if place.width]
    places = [*layout.arenas, *(layout.title(pane) for pane in range(panes)), layout.status, *tool_places]
    places += [layout.strip] if layout.strip.height else []
    assert layout.strip.height == 0 or layout.strip.height - layout.line_height >= 2.2 * charts * layout.text_height
    assert len(layout.toolbar) == sum(map(len, tools))
    for index, place in enumerate(places):
        assert place.collidelist(places[index + 1 :]) == -1
        assert pygame.Rect((0, 0), window).contains(place)
    for pane in range(panes):
        assert layout.pane_at(layout.arenas[pane].center) == pane


@pytest.mark.parametrize("size", [(1024, 640), (1280, 800), (3840, 2160)])
@pytest.mark.parametrize("panes", [1, 2, 3])
def test_there_is_room_for_all_charts_and_a_large_arena(window: Window, size: tuple[int, int], panes: int) -> None:
    layout = Layout(size, (800, 600), panes, window.toolbar.widths, 3)
    assert layout.strip.height > 0.2 * size[1]
    assert layout.arenas[0].width > 0.9 * size[0] / max(panes, 2) or layout.arenas[0].height > 0.4 * size[1]
    assert len({place.y for place in layout.toolbar if place.width}) == 1  # row
    assert layout.text_height == max(13, min(size[1] // 40, 48))


@pytest.mark.parametrize("size", [(480, 320), (640, 480), (1024, 640), (1440, 900), (2560, 1440)])
def test_the_toolbar_is_one_full_row_in_which_every_group_is_named(window: Window, size: tuple[int, int]) -> None:
    layout = Layout(size, (800, 600), 2, window.toolbar.widths, 3)
    shown = [place for place in layout.toolbar if place.width]
    assert len({place.y for place in shown}) == 1
    assert max(place.right for place in shown) > 0.75 * size[0]
    headers = np.cumsum([0, *map(len, window.toolbar.widths)])[:-1]
    assert all(layout.toolbar[number].width for number in headers)


def test_groups_unfolded_by_hand_get_further_rows_and_folded_ones_leave_room_for_others(window: Window) -> None:
    widths = window.toolbar.widths
    unfolded = Layout((1024, 640), (800, 600), 2, widths, 3, by_hand=(True,) * len(widths))
    assert all(place.width for place in unfolded.toolbar)
    rows = sorted({place.y for place in unfolded.toolbar})
    assert len(rows) == 2
    for row in rows:
        assert max(place.right for place in unfolded.toolbar if place.y == row) > 0.75 * 1024

    def layout_with(first: bool | None) -> Layout:
        return Layout((1024, 640), (800, 600), 2, widths, 3, by_hand=(first, *(None,) * (len(widths) - 1)))

    seen, seen_without_first = (
        {k for k, place in enumerate(layout_with(first).toolbar) if place.width} for first in (None, False)
    )
    assert seen_without_first - seen
    assert seen_without_first & set(range(len(widths[0]))) == {0}


@pytest.mark.parametrize("arena", [(800.0, 600.0), (1000.0, 500.0), (300.0, 900.0)])
def test_a_new_window_has_two_panes_side_by_side_and_fits_the_desktop(arena: tuple[float, float]) -> None:
    for desktop in ((1400, 800), (1920, 1080)):
        size = natural_size(arena, 2, desktop)
        left, right = Layout(size, arena, 2).arenas
        assert left.y == right.y
        assert left.right < right.x
        assert size[0] <= desktop[0]
        assert size[1] <= desktop[1]


@pytest.mark.parametrize("size", [(480, 320), (800, 600), (1680, 1010), (700, 1400)])
@pytest.mark.parametrize("panes", [1, 2, 3, 4])
@pytest.mark.parametrize("charts", [0, 3])
def test_the_frame_is_what_toolbar_arenas_and_charts_leave_of_the_window(
    size: tuple[int, int], panes: int, charts: int
) -> None:
    layout = Layout(size, (800.0, 600.0), panes, ((1.0, 5.0),), charts)
    covered = np.zeros(size, int)
    for place in (Rect(0, 0, size[0], layout.top), *layout.frame, *layout.arenas, layout.strip):
        covered[place.left : place.right, place.top : place.bottom] += 1
    assert (covered == 1).all()
