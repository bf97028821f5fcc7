"""The page of the balls shows and changes a ball or a wall; the tools move them and draw walls."""

import pygame
import pytest
from conftest import scene_of
from window_driver import (
    THREE_BALLS,
    button,
    click,
    colour_at,
    drag,
    given,
    hover,
    mouse,
    point,
    press,
    run,
    shown,
    slider,
    tool,
    use,
)

from sandbox.run.edits import AddWall, ChangeBall, ChangeWall, DeleteWall
from sandbox.run.inputs import Grab
from sandbox.view.controls import Action, Panel
from sandbox.view.widgets import Widget
from sandbox.view.widgets.fields import Field
from sandbox.view.window import Window

WALL = "walls = [{ from = [100, 400], to = [500, 400], thickness = 20 }]"


@pytest.fixture
def desk(memory_screen: None) -> Window:
    """Open a window with three balls and a wall, paused at step 0, with the page of the balls and the tool Move."""
    window = Window(scene_of(*THREE_BALLS, more=WALL), ["pymunk", "impulse"])
    press(window, "Space", "F3")
    use(window, "Move")
    return window


def widgets(window: Window) -> list[tuple[Widget, tuple[int, int]]]:
    """Return the panel's widgets, each with its middle."""
    layout = window.layout
    return [(widget, place.center) for widget, place in window.panel.placed(layout.panel, layout.text_height)]


def value(window: Window, name: str) -> str:
    return next(one.value() for one, _ in widgets(window) if isinstance(one, Field) and one.name == name)


def type_into(window: Window, name: str, text: str) -> None:
    click(window, next(middle for one, middle in widgets(window) if isinstance(one, Field) and one.name == name))
    press(window, *text, "Enter")


def push(window: Window, text: str) -> None:
    click(window, tool(window, text))


def position(window: Window, ball: int, pane: int = 0) -> list[float]:
    found: list[float] = window.view.panes[pane].state.position[ball].tolist()
    return found


@pytest.mark.parametrize(("key", "panel"), [("F3", Panel.BALLS), ("F4", Panel.ENGINES), ("F5", Panel.WHY)])
def test_a_key_opens_a_page_and_closes_it_and_the_tabs_change_it(window: Window, key: str, panel: Panel) -> None:
    press(window, key)
    assert window.panel.open is panel
    press(window, key)
    assert window.panel.open is None
    window.panel.show(Panel.SCENE)
    click(window, button(window, Action[panel.name]))
    assert window.panel.open is panel


def test_a_ball_is_shown_as_in_the_pane_where_it_was_clicked(desk: Window) -> None:
    run(desk, 40)  # balls 0 and 1 have met
    there = [position(desk, 0, pane)[0] for pane in (0, 1)]
    assert there[0] != there[1]
    for pane in (0, 1):
        x, y = position(desk, 0, pane)
        click(desk, point(desk, x, y, pane))
        assert float(value(desk, "x")) == pytest.approx(there[pane], abs=6e-4)
    assert value(desk, "mass") == "1"
    assert given(desk) == []


def test_what_is_typed_is_set_in_every_engine(desk: Window) -> None:
    click(desk, point(desk, 600, 100))
    for name, text in (("x", "300"), ("vy", "1e2"), ("spin", "-2"), ("radius", "12.5"), ("colour", "#ff0000")):
        type_into(desk, name, text)
    for pane in desk.view.panes:
        assert (pane.state.position[2].tolist(), pane.state.velocity[2].tolist()) == ([300, 100], [60, 100])
        assert (pane.state.spin[2], pane.scene.bodies.radius[2], pane.scene.colors[2]) == (-2, 12.5, "#ff0000")
    assert [type(one) for one in given(desk)] == [ChangeBall] * 5
    press(desk, "Esc", "undo", "undo")  # Esc leaves the field
    assert (value(desk, "radius"), value(desk, "spin")) == ("10", "-2")


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("x", "nan", "x must be a finite number, got nan"),
        ("x", "left", 'x must be a number, got "left"'),
        ("y", "1e300", "y must be at most 1e+09, got 1e+300"),
        ("colour", "blurple", 'color is not a valid colour: "blurple"; did you mean purple?'),
        ("colour", "", ""),
    ],
)
def test_a_wrong_value_is_refused_in_words_and_changes_nothing(
    desk: Window, name: str, text: str, message: str
) -> None:
    click(desk, point(desk, 600, 100))
    if name == "x":
        type_into(desk, "y", "300")
    before, edits = shown(desk), given(desk)
    type_into(desk, name, text)
    assert desk.notice.text.startswith(message)
    assert (shown(desk), given(desk)) == (before, edits)


def test_a_ball_is_moved_to_the_same_place_in_every_engine_and_keeps_its_velocity(desk: Window) -> None:
    run(desk, 40)
    before = [pane.state.velocity.tobytes() for pane in desk.view.panes]
    x, y = position(desk, 0, 1)
    drag(desk, point(desk, x, y, 1), point(desk, x + 100, y - 200, 1))
    [edit] = given(desk)
    assert isinstance(edit, ChangeBall)
    assert [edit.x, edit.y] == pytest.approx([x + 100, y - 200], abs=3)
    assert position(desk, 0) == position(desk, 0, 1) == [edit.x, edit.y]
    assert [pane.state.velocity.tobytes() for pane in desk.view.panes] == before
    drag(desk, point(desk, edit.x or 0, edit.y or 0), point(desk, -90, 50))
    assert position(desk, 0)[0] == 20  # its radius from the arena's wall


@pytest.mark.parametrize("name", ["Move", "Wall"])
def test_a_tool_that_needs_a_pause_pauses(desk: Window, name: str) -> None:
    push(desk, "Hand")
    press(desk, "Space")
    push(desk, name)
    assert desk.playback.paused
    press(desk, "Space")
    drag(desk, point(desk, 650, 250), point(desk, 700, 250))
    assert desk.playback.paused
    assert [type(one) for one in given(desk)] == ([AddWall] if name == "Wall" else [])


def test_while_time_passes_the_mouse_pulls_and_typing_pauses(desk: Window) -> None:
    push(desk, "Hand")
    press(desk, "Space")
    mouse(desk, pygame.MOUSEBUTTONDOWN, point(desk, 600, 100))
    assert [type(one) for one in given(desk)] == [Grab]
    assert desk.editor.selected == 2
    assert value(desk, "x") == "600"
    mouse(desk, pygame.MOUSEBUTTONUP, point(desk, 600, 100))
    assert not desk.playback.paused
    type_into(desk, "x", "300")
    assert desk.playback.paused
    assert position(desk, 2)[0] == 300


def test_a_wall_is_drawn_moved_and_deleted(desk: Window) -> None:
    push(desk, "Wall")
    drag(desk, point(desk, 600, 300), point(desk, 700, 500))
    push(desk, "Move")
    type_into(desk, "thickness", "8")
    assert value(desk, "thickness") == "8"  # of the new wall, which is selected
    drag(desk, point(desk, 650, 400), point(desk, 600, 430))
    walls = desk.view.moment.scene.walls
    assert [*walls[1].start, *walls[1].to] == pytest.approx([550, 330, 650, 530], abs=4)
    type_into(desk, "elasticity", "0.5")
    hover(desk, (1, 1))
    press(desk, "Delete")
    assert [type(one) for one in given(desk)] == [AddWall, *[ChangeWall] * 3, DeleteWall]
    assert len(desk.view.moment.scene.walls) == 1
    press(desk, *["undo"] * 5)
    assert desk.view.moment.scene.walls == desk.scene.walls
    assert desk.editor.selected_wall is None


def test_a_wall_that_is_undone_while_it_is_held_is_not_moved(window: Window) -> None:
    use(window, "Wall")
    drag(window, point(window, 100, 500), point(window, 300, 500))
    use(window, "Move")
    mouse(window, pygame.MOUSEBUTTONDOWN, point(window, 200, 500))
    mouse(window, pygame.MOUSEMOTION, point(window, 200, 450))
    press(window, "undo")
    window.draw()
    mouse(window, pygame.MOUSEBUTTONUP, point(window, 200, 450))
    assert (given(window), window.view.moment.scene.walls) == ([], ())


def test_what_a_drag_would_do_is_shown_in_every_pane(desk: Window) -> None:
    desk.draw()
    ground = colour_at(desk, 700, 100)
    push(desk, "Wall")
    mouse(desk, pygame.MOUSEBUTTONDOWN, point(desk, 650, 100))
    mouse(desk, pygame.MOUSEMOTION, point(desk, 750, 100))
    desk.draw()
    assert [colour_at(desk, 700, 100, pane) == ground for pane in (0, 1)] == [False, False]


def typed_into(window: Window, name: str, text: str) -> None:
    field = next(one for one, _ in widgets(window) if isinstance(one, Field) and one.name == name)
    field.choose(text)


def test_fields_and_gravity_show_and_take_the_units_of_the_scene(desk: Window) -> None:
    desk.begin(scene_of(*THREE_BALLS, more=f"{WALL}\nunits = {{ length = 'm', pixels_per_metre = 100 }}"), ["exact"])
    desk.editor.select(0)
    typed_into(desk, "x", "1.505")
    typed_into(desk, "vx", "0.07")
    ball = desk.view.panes[0].state
    assert ball.position[0, 0] == pytest.approx(150.5)
    assert ball.velocity[0, 0] == pytest.approx(7)
    assert (value(desk, "x"), value(desk, "vx")) == ("1.505", "0.07")
    units = {one.name: one.unit for one, _ in widgets(desk) if isinstance(one, Field)}
    assert (units["x"], units["vx"], units["radius"], units["mass"]) == ("m", "m/s", "m", "kg")
    desk.editor.select(wall=0)
    typed_into(desk, "thickness", "0.3")
    assert desk.view.moment.scene.walls[0].thickness == 30
    gravity, _ = slider(desk, "gravity")
    gravity.choose(9.81)
    assert desk.view.moment.scene.gravity == pytest.approx((0, 981))
    assert gravity.value() == pytest.approx(9.81)


def test_a_refused_value_is_quoted_in_px_with_their_scale(desk: Window) -> None:
    desk.begin(
        scene_of("radius = 20\nposition = [200, 300]", more="units = { length = 'cm', pixels_per_metre = 1000 }"), None
    )
    desk.editor.select(0)
    for name, typed, said in (
        ("x", "-5", "x must be from 20 to 780, got -50 (1 cm is 10 px)"),
        ("vx", "1e9", "vx must be at most 1e+09, got 10000000000.0 (1 cm/s is 10 px/s)"),
        ("mass", "-2", "mass must be greater than 0, got -2.0"),
    ):
        typed_into(desk, name, typed)
        assert desk.notice.text.endswith(said)


def test_a_click_that_trembles_moves_nothing(desk: Window) -> None:
    x, y = point(desk, 600, 100)
    drag(desk, (x, y), (x + 2, y + 2))
    assert given(desk) == []
    assert desk.editor.selected == 2


@pytest.mark.parametrize("pane", [0, 1])
def test_a_wall_is_not_there_before_it_was_drawn(desk: Window, pane: int) -> None:
    desk.draw()
    before = colour_at(desk, 700, 400, pane)
    run(desk, 10)
    push(desk, "Wall")
    drag(desk, point(desk, 700, 300), point(desk, 700, 500))
    desk.draw()
    assert colour_at(desk, 700, 400, pane) != before
    press(desk, "Left", "Left")
    desk.draw()
    assert colour_at(desk, 700, 400, pane) == before
