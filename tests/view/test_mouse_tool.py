"""The mouse pulls balls, sets velocities and selects."""

from typing import Final

import numpy as np
import pygame
import pytest
from conftest import scene_of
from pygame import Rect
from pygame.event import Event
from window_driver import (
    THREE_BALLS,
    click,
    colour_at,
    drag,
    given,
    hover,
    mouse,
    pixels,
    point,
    press,
    run,
    slider,
    step,
    tool,
)

from sandbox.run.edits import ChangeWall, SetVelocity
from sandbox.run.inputs import Grab, Input, Move, Release
from sandbox.scene.fields import rgb
from sandbox.session.samples import Quantity
from sandbox.view.cards import ball_table
from sandbox.view.controls import Panel
from sandbox.view.widgets.fields import Slider
from sandbox.view.window import Window

pytestmark = pytest.mark.usefixtures("memory_screen")


def zoom(window: Window, at: tuple[int, int], notches: int) -> None:
    hover(window, at)
    window.on_event(Event(pygame.MOUSEWHEEL, x=0, y=notches, flipped=False))


@pytest.mark.parametrize("notches", [0, 5])
@pytest.mark.parametrize("pane", [0, 1])
def test_a_drag_in_either_pane_pulls_the_ball_in_every_engine_where_it_is_seen(
    window: Window, pane: int, notches: int
) -> None:
    zoom(window, point(window, 600, 100, pane), notches)
    x, y = point(window, 600, 110, pane)
    there = point(window, 560, 60, pane)
    mouse(window, pygame.MOUSEBUTTONDOWN, (x, y + 4))  # just outside of the ball
    mouse(window, pygame.MOUSEMOTION, there)
    run(window, 60)
    window.draw()
    for drawn in (0, 1):
        assert window.view.panes[drawn].state.position[2] == pytest.approx([560, 60], abs=1 / window.layout.scale)
        assert colour_at(window, 560, 68, drawn) == rgb(window.scene.colors[2])
    mouse(window, pygame.MOUSEBUTTONUP, there)
    kinds: list[type[Input]] = [Grab, Move, Release]
    assert [type(one) for one in given(window)] == kinds


def grab(window: Window) -> tuple[int, int]:
    """Grab the third ball in the second pane; return where."""
    at = point(window, 600, 100, pane=1)
    mouse(window, pygame.MOUSEBUTTONDOWN, at)
    assert window.view.session.lockstep.mouse.ball == 2
    return at


def test_losing_the_focus_or_the_button_releases_the_ball(window: Window) -> None:
    grab(window)
    window.on_event(Event(pygame.WINDOWFOCUSLOST))
    assert window.view.session.lockstep.mouse.ball is None
    at = grab(window)
    mouse(window, pygame.MOUSEMOTION, at, held=False)  # it came back with the button up
    assert window.view.session.lockstep.mouse.ball is None
    window.mouse.release()
    assert len(given(window)) == 4


def test_a_drag_far_outside_of_a_very_large_arena_pulls_to_its_edge() -> None:
    window = Window(scene_of("radius = 1e8\nposition = [5e8, 5e8]", size="[1e9, 1e9]"), ["exact"])
    mouse(window, pygame.MOUSEBUTTONDOWN, point(window, 5e8, 5e8))
    mouse(window, pygame.MOUSEMOTION, (30_000, -30_000))
    assert given(window)[-1] == Move(step=0, at=(1e9, 0))


def test_a_drag_while_paused_sets_a_ball_s_velocity_in_every_engine(window: Window) -> None:
    press(window, "Space")
    x, y = point(window, 600, 100, pane=1)
    drag(window, (x, y), point(window, 660, 140, pane=1))
    [edit] = given(window)
    assert isinstance(edit, SetVelocity)
    assert edit.ball == 2
    assert edit.velocity == pytest.approx((300, 200), abs=5 / window.layout.scale)
    assert [pane.state.velocity[2].tolist() for pane in window.view.panes] == [list(edit.velocity)] * 2


def test_a_click_while_paused_selects_a_ball_and_moves_none(window: Window) -> None:
    press(window, "Space")
    x, y = point(window, 600, 100)
    drag(window, (x, y), (x + 2, y))
    assert given(window) == []
    assert window.editor.selected == 2
    drag(window, point(window, 400, 500), point(window, 410, 500))
    assert window.editor.selected is None


def test_a_selected_ball_has_a_slider_of_its_mass_which_a_drag_hides(window: Window) -> None:
    press(window, "Space")
    window.panel.show(Panel.SCENE)
    at = point(window, 600, 100)
    click(window, at)
    _, place = slider(window, "mass")
    assert place.top > at[1]
    click(window, (place.right - 12, place.bottom - 8))
    assert window.view.moment.scene.bodies.mass[2] == 100
    there = point(window, 640, 140)
    mouse(window, pygame.MOUSEBUTTONDOWN, at)
    mouse(window, pygame.MOUSEMOTION, there)
    with pytest.raises(StopIteration):
        slider(window, "mass")
    mouse(window, pygame.MOUSEBUTTONUP, there)
    assert slider(window, "mass")


def test_a_slow_ball_that_is_selected_keeps_its_number_and_has_a_ring_apart_from_it() -> None:
    ball = 'radius = 40\nposition = [400, 300]\nvelocity = [60, 0]\ncolors = ["white"]'
    window = Window(scene_of(ball, size='[800, 600]\nbackground = "#204020"'), ["exact"])
    press(window, "Space")
    window.draw()
    inside = Rect(0, 0, 30, 30)
    inside.center = point(window, 400, 300)
    before = pixels(window.screen.subsurface(inside)).copy()
    window.editor.select(0)
    window.draw()
    assert np.array_equal(pixels(window.screen.subsurface(inside)), before)
    x, y = point(window, 400, 300)
    row = pixels(window.screen)[x : x + 80, y, 1] > 128
    assert np.count_nonzero(np.diff(row.astype(int))) == 3  # the ball's end, the ring's inner edge, and its outer


def test_a_dragged_velocity_is_drawn_from_each_copy_as_what_the_copy_gets(window: Window) -> None:
    window.view.session.lockstep.engines["pymunk"].engine.kick(2, (0.0, 900.0))
    run(window, 20)
    apart = [pane.state.position[2] for pane in window.view.panes]
    assert apart[0][1] > apart[1][1] + 150
    x, y = apart[1]
    mouse(window, pygame.MOUSEBUTTONDOWN, point(window, x, y, pane=1))
    mouse(window, pygame.MOUSEMOTION, point(window, x - 200, y, pane=1))
    window.draw()
    for pane, (x, y) in enumerate(apart):
        assert colour_at(window, x - 100, y, pane) == (0, 0, 0)
    x, y = apart[0]
    assert colour_at(window, (x - 200 + apart[1][0]) / 2, (y + apart[1][1]) / 2) == (255, 255, 255)
    aimed = window.mouse.aimed
    assert aimed == pytest.approx((-1000, 0), abs=10 / window.layout.scale)
    mouse(window, pygame.MOUSEBUTTONUP, point(window, x - 200, y, pane=1))
    assert [tuple(pane.state.velocity[2].tolist()) for pane in window.view.panes] == [aimed] * 2
    before = given(window)
    mouse(window, pygame.MOUSEBUTTONDOWN, point(window, apart[1][0], apart[1][1], pane=1))
    mouse(window, pygame.MOUSEMOTION, point(window, 700, 500, pane=1))
    assert window.mouse.aimed
    window.on_event(Event(pygame.WINDOWFOCUSLOST))
    assert (window.mouse.holds, given(window)) == (False, before)


def test_a_tip_leaves_at_a_press_and_after_4_s_and_does_not_appear_in_a_drag(
    window: Window, monkeypatch: pytest.MonkeyPatch
) -> None:
    tips: list[str] = []
    monkeypatch.setattr("sandbox.view.widgets.group.card", lambda _, lines, *__: tips.append(lines[0][0]))

    def count() -> int:
        tips.clear()
        window.draw()
        return len(tips)

    press(window, "Space")
    mouse(window, pygame.MOUSEBUTTONDOWN, point(window, 600, 100))
    mouse(window, pygame.MOUSEMOTION, tool(window, "Fit"))
    assert count() == 0
    mouse(window, pygame.MOUSEBUTTONUP, tool(window, "Fit"))
    assert count() == 0
    hover(window, tool(window, "Open\N{HORIZONTAL ELLIPSIS}"))
    window.frame(3.0)
    assert count() == 1
    window.frame(1.1)
    assert count() == 0
    hover(window, tool(window, "Fit"))
    assert count() == 1
    click(window, tool(window, "Fit"))
    assert count() == 0


def test_no_tip_and_no_card_of_a_ball_covers_a_title_or_a_slider(
    window: Window, monkeypatch: pytest.MonkeyPatch
) -> None:
    places: list[pygame.Rect] = []
    monkeypatch.setattr("sandbox.view.primitives.panel", lambda _, place: places.append(place))
    press(window, "Space")
    window.editor.select(0)  # beside which there is a slider
    for size in ((1440, 900), (1024, 640)):
        window.screen = pygame.display.set_mode(size)
        window.panel.show(Panel.SCENE)
        kept = [window.layout.title(pane) for pane in (0, 1)]
        kept += [place for widget, place in window._placed if isinstance(widget, Slider)]
        shown = [(at.center, bool(widget.tip)) for widget, at in window._placed]
        balls = [(point(window, *at), True) for at in window.view.panes[0].state.position.tolist()]
        for at, has_card in (*shown, *balls):
            hover(window, at)
            places.clear()
            window.draw()
            assert len(places) == has_card
            assert all(place.collidelist(kept) < 0 for place in places), at


def test_a_held_ball_is_released_before_the_step_changes(window: Window) -> None:
    run(window, 10)
    window.playback.paused = False
    x, y = window.view.panes[0].state.position[2]
    mouse(window, pygame.MOUSEBUTTONDOWN, point(window, x, y))
    run(window, 3)
    press(window, "Left")
    window.playback.paused = False
    press(window, "End")
    assert window.view.moment.held is None
    assert [one.do for one in given(window)] == ["grab", "release"]


@pytest.mark.parametrize("lost", [Event(pygame.MOUSEBUTTONUP, button=1, pos=(5, 5)), Event(pygame.WINDOWFOCUSLOST)])
def test_what_the_mouse_holds_is_released_while_the_picker_is_open(window: Window, lost: Event) -> None:
    mouse(window, pygame.MOUSEBUTTONDOWN, point(window, 600, 100))
    assert window.view.session.held == 2
    press(window, "/")
    window.on_event(lost)
    assert window.view.session.held is None
    press(window, "Esc")


def test_the_card_of_a_ball_shows_its_spin_if_it_turns_and_the_energy_that_the_chart_has_of_it() -> None:
    ball = "radius = 10\nposition = [50, 60]\nmass = 4\nspin = -3"
    window = Window(scene_of(ball, more="gravity = [0, 7]"), ["pymunk", "exact"])
    energy = 0.5 * (4 * 10**2 / 2) * 3**2 + 4 * 7 * (600 - 10 - 60)  # I = m r²/2; at rest on the floor, it has none
    titles, *rows = ball_table(window.view.panes, 0)
    assert titles[3] == "spin, rad/s"
    assert rows == [[name, "50.00, 60.00", "0.00, 0.00", "-3.00", f"{energy:,g}"] for name in ("pymunk", "exact")]
    assert window.view.session.samples.of(Quantity.ENERGY)[-1] == pytest.approx(energy)


@pytest.mark.parametrize("x", [200, 600, 790])
def test_the_card_of_a_ball_under_the_mouse_shows_its_values_in_every_engine(
    x: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = scene_of(*THREE_BALLS, f"radius = 10\nposition = [{x}, 590]\nvelocity = [0, -5]\nmass = 4")
    window = Window(scene, ["pymunk", "impulse"])
    assert ball_table(window.view.panes, 3)[1:] == [
        [name, f"{x:.2f}, 590.00", "0.00, -5.00", "50"] for name in ("pymunk", "impulse")
    ]
    places: list[pygame.Rect] = []
    monkeypatch.setattr("sandbox.view.primitives.panel", lambda _, place: places.append(place))
    hover(window, point(window, x, 590, pane=1))
    window.draw()
    [card] = places
    assert card.width > 200
    assert window.screen.get_rect().contains(card)
    window.on_event(Event(pygame.WINDOWLEAVE))
    window.draw()
    assert places == [card]


def test_the_wheel_zooms_all_panes_about_the_pointer_and_a_key_shows_all(window: Window) -> None:
    run(window, 1)
    whole = window.layout
    x, y = window.view.panes[0].state.position[2].tolist()
    at = point(window, x, y)
    zoom(window, at, 6)
    assert window.layout.scale == pytest.approx(whole.scale * 1.25**6)
    assert window.layout.arenas == whole.arenas
    assert point(window, x, y) == pytest.approx(at, abs=3)  # a pixel at first
    window.draw()
    radius = 10 * window.layout.scale
    for pane in (0, 1):
        ox, oy = point(window, x, y, pane)
        for far, colour in ((0.8, rgb(window.scene.colors[2])), (1.2, (255, 255, 255))):
            assert tuple(window.screen.get_at((ox, oy + round(far * radius))))[:3] == colour
    press(window, "0")
    assert window.layout == whole
    zoom(window, at, -3)
    assert window.layout == whole


def test_a_drag_of_empty_ground_moves_what_is_shown_within_the_arena(window: Window) -> None:
    at = point(window, 400, 450)
    zoom(window, at, 4)
    drag(window, at, (at[0] - 40, at[1] + 10))
    assert point(window, 400, 450) == pytest.approx((at[0] - 40, at[1] + 10), abs=1)
    drag(window, at, (at[0] - 9000, at[1]))
    hover(window, at)
    assert point(window, 800, 300)[0] == pytest.approx(window.layout.arenas[0].right, abs=1)
    assert given(window) == []


def test_the_splitter_shares_the_height_between_panes_and_chart(window: Window) -> None:
    window.screen = pygame.display.set_mode((1400, 900))
    chart, pane, at = window.layout.strip.height, window.layout.arenas[0].height, window.layout.splitter.center
    drag(window, at, (at[0], at[1] - 150))
    assert window.layout.strip.height == pytest.approx(chart + 150, abs=3)
    assert window.layout.arenas[0].height < pane - 100
    drag(window, window.layout.splitter.center, (at[0], 890))
    assert window.layout.arenas[0].height > pane
    assert 0 < window.layout.strip.height < chart  # a chart that is dragged away would not come back


WALL: Final = "walls = [{ from = [300, 200], to = [300, 400], thickness = 10 }]"


def walled(*balls: str) -> Window:
    return Window(scene_of(*balls, more=WALL), ["pymunk", "impulse", "exact"])


def drag_wall(window: Window, to: tuple[int, int], frames: int) -> None:
    """Drag the wall by its middle while time passes."""
    mouse(window, pygame.MOUSEBUTTONDOWN, point(window, 300, 300))
    mouse(window, pygame.MOUSEMOTION, point(window, *to))
    for _ in range(frames):
        window.frame(1 / 60)
    mouse(window, pygame.MOUSEBUTTONUP, point(window, *to))


def test_a_wall_is_moved_by_the_hand_to_where_the_button_is_released() -> None:
    window = walled("radius = 20\nposition = [100, 300]\nvelocity = [120, 0]")
    drag_wall(window, (500, 350), 12)
    [edit] = given(window)
    assert isinstance(edit, ChangeWall)
    assert edit.start == pytest.approx((500, 250), abs=1 / window.layout.scale)
    assert edit.step == step(window)
    press(window, "undo")
    assert (given(window), window.view.moment.scene.walls) == ([], window.scene.walls)
    press(window, "redo")
    assert given(window) == [edit]


def test_the_line_to_the_pointer_is_drawn_in_every_pane(window: Window) -> None:
    x, y = grab(window)
    mouse(window, pygame.MOUSEMOTION, (x, y + round(150 * window.layout.scale)))
    window.draw()
    for pane in (0, 1):
        assert colour_at(window, 600, 180, pane) == (0, 0, 0)


def test_an_arrow_that_leaves_its_pane_is_not_clipped(window: Window) -> None:
    press(window, "Space")
    x, y = point(window, 600, 100)
    mouse(window, pygame.MOUSEBUTTONDOWN, (x, y))
    beyond = point(window, 900, 100)
    mouse(window, pygame.MOUSEMOTION, beyond)
    window.draw()
    assert window.layout.pane_at((beyond[0] - 12, y)) == 1
    assert tuple(window.screen.get_at((beyond[0] - 12, y)))[:3] == (0, 0, 0)
