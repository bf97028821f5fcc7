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
)
def test_nothing_in_the_window_overlaps_or_leaves_it(
    window: tuple[int, int], arena: tuple[float, float], panes: int, tools: tuple[tuple[float, ...], ...], charts: int
) -> None:
    layout = Layout(window, arena, panes, tools, charts)
    places = [*layout.arenas, *(layout.title(pane) for pane in range(panes)), layout.status, *layout.toolbar]
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
    assert len({place.y for place in layout.toolbar}) <= 2  # rows
    assert layout.text_height == max(13, min(size[1] // 40, 48))


def test_rows_of_the_toolbar_hold_whole_groups_and_reach_the_right_edge(window: Window) -> None:
    layout = Layout((1024, 640), (800, 600), 2, window.toolbar.widths, 3)
    ends = [0]
    for widths in window.toolbar.widths:
        rows = {place.y for place in layout.toolbar[ends[-1] : ends[-1] + len(widths)]}
        assert len(rows) == 1
        ends.append(ends[-1] + len(widths))
    for row in {place.y for place in layout.toolbar}:
        assert max(place.right for place in layout.toolbar if place.y == row) > 0.75 * 1024


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
