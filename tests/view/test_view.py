"""What the window shows and does, on a screen that is only in memory."""

import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pygame
import pytest
from conftest import scene_of
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image
from pygame.event import Event
from pymunk.pygame_util import DrawOptions

from sandbox.analysis.comparison import compare
from sandbox.engines.pymunk import PymunkEngine
from sandbox.errors import SandboxError
from sandbox.run.inputs import Grab, Input, Move, Release
from sandbox.run.trajectory import simulate
from sandbox.scene.files import bundled, load
from sandbox.scene.model import Scene, rgb
from sandbox.state import CONTACT, Bools, Floats
from sandbox.view.controls import CONTROLS, Control, control_of
from sandbox.view.debug_draw import turned
from sandbox.view.layout import LEAST, Layout, natural_size
from sandbox.view.palette import FAINT, FRAME
from sandbox.view.pane import facts
from sandbox.view.picture import draw_picture
from sandbox.view.playback import Playback
from sandbox.view.primitives import capsule, disc
from sandbox.view.scene_loader import SceneLoader
from sandbox.view.toolbar import Button, Slider
from sandbox.view.window import Window, has_display

RED, BLUE = "#d55e00", "#0072b2"
TWO = (
    f'radius = 20\nposition = [200, 300]\nvelocity = [60, 0]\ncolors = ["{RED}"]',
    f'radius = 20\nposition = [600, 300]\ncolors = ["{BLUE}"]',
)
BALL = "[arena]\nsize = [90, 90]\n[[balls]]\nradius = 5\nposition = [9, 9]\n"
KEYS = {"Space": (pygame.K_SPACE, " "), "Right": (pygame.K_RIGHT, ""), "Esc": (pygame.K_ESCAPE, "\x1b")}


@pytest.fixture(autouse=True)
def _memory_screen(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def scene() -> Scene:
    return scene_of(*TWO)


@pytest.fixture
def window(scene: Scene) -> Window:
    return Window(scene, None)


def press(window: Window, character: str) -> None:
    key, typed = KEYS.get(character, (0, character))
    if character.startswith("F") and len(character) > 1:
        key, typed = getattr(pygame, f"K_{character}"), ""
    window.on_event(Event(pygame.KEYDOWN, key=key, unicode=typed))


def mouse(window: Window, what: int, point: tuple[int, int], held: bool = True) -> None:
    window.on_event(Event(what, pos=point, button=1, buttons=(int(held), 0, 0)))


def colour_at(surface: pygame.Surface, layout: Layout, pane: int, x: float, y: float) -> tuple[int, ...]:
    """Return the colour shown at a place of a pane's scene."""
    arena = layout.arenas[pane]
    return tuple(surface.get_at((round(arena.x + x * layout.scale), round(arena.y + y * layout.scale))))[:3]


def test_discs_in_sizes_that_the_window_had_before_are_not_kept(window: Window) -> None:
    for width in range(700, 1000, 20):
        window.screen = pygame.display.set_mode((width, width))
        window.draw()
        assert disc.cache_info().currsize == turned.cache_info().currsize == 2


def test_each_pane_shows_its_engine_s_balls_where_they_are(window: Window) -> None:
    window.advance(1.0)  # but no more than the frame has time for
    while window.lockstep.steps < 60:
        window.player.one_step()
    window.draw()
    for pane in (0, 1):
        assert colour_at(window.screen, window.layout, pane, 260, 306) == rgb(RED)
        assert colour_at(window.screen, window.layout, pane, 600, 306) == rgb(BLUE)
        assert colour_at(window.screen, window.layout, pane, 200, 300) == (255, 255, 255)
    assert [pane.title for pane in window.panes] == [
        "pymunk    energy 100.0%    contacts 0",
        "article    energy 100.0%    contacts 0",
    ]


@pytest.mark.parametrize("quarter", [0, 1, 2, 3, 5])
def test_debug_draw_s_discs_show_how_they_are_turned(quarter: int) -> None:
    window = Window(scene_of(f'radius = 30\nposition = [200, 300]\ncolors = ["{RED}"]'), ["pymunk"])
    engine = window.lockstep.engines["pymunk"].engine
    assert isinstance(engine, PymunkEngine)
    [ball] = [body for body in engine.space.bodies if body.body_type == body.DYNAMIC]
    ball.angle = quarter * math.pi / 2
    window.draw()
    line = tuple(DrawOptions(window.screen).shape_outline_color.as_int())[:3]
    seen = [
        colour_at(window.screen, window.layout, 0, 200 + 18 * x, 300 + 18 * y) == line
        for x, y in ((1, 0), (0, 1), (-1, 0), (0, -1))  # clockwise, as y goes down
    ]
    assert seen == [quarter % 4 == k for k in range(4)]


def test_what_is_no_disc_is_pymunk_s_to_draw(window: Window) -> None:
    """Collision points are drawn by its own callbacks."""
    engine = window.lockstep.engines["pymunk"].engine
    assert isinstance(engine, PymunkEngine)
    red, blue = (body for body in engine.space.bodies if body.body_type == body.DYNAMIC)
    red.position = 565, 300
    window.player.one_step()
    window.draw()
    red_of_points = tuple(DrawOptions(window.screen).collision_point_color.as_int())[:3]
    arena = window.layout.arenas[0]
    inside = pygame.surfarray.array3d(window.screen.subsurface(arena))
    x = np.nonzero((inside == red_of_points).all(axis=2))[0]
    assert len(x)
    between = (red.position.x + blue.position.x) / 2
    assert x.mean() / window.layout.scale == pytest.approx(between, abs=6)


def test_a_picture_without_a_window_shows_the_end_of_each_run() -> None:
    scene = load("head-on")
    comparison = compare(scene)
    picture = draw_picture(comparison)
    layout = Layout(picture.get_size(), scene.arena.size, len(comparison.runs))
    for pane, run in enumerate(comparison.runs.values()):
        for ball, (x, y) in enumerate(run.final.position):
            assert colour_at(picture, layout, pane, x, y + 8) == rgb(scene.colors[ball])


def test_ghosts_are_the_outlines_of_the_other_pane_s_balls(window: Window) -> None:
    window.lockstep.engines["pymunk"].kick(0, (0.0, 600.0))
    for _ in range(6):
        window.player.one_step()  # 60 px apart now
    window.draw()
    place = (0, 206 + 20, 300)  # the right edge of the article's ball, in Pymunk's pane
    assert colour_at(window.screen, window.layout, *place) == (255, 255, 255)
    press(window, "g")
    window.draw()
    ring = {colour_at(window.screen, window.layout, 0, x, 300) for x in (224, 225, 226, 227)}
    assert rgb(RED) in ring
    assert colour_at(window.screen, window.layout, 0, 206, 310) == (255, 255, 255)  # but not filled


@pytest.mark.parametrize("ends", [((300, 150), (500, 150)), ((300, 100), (500, 200)), ((300, 200), (500, 100))])
def test_inner_walls_are_as_thick_as_they_are_at_any_slope_in_every_pane(
    ends: tuple[tuple[float, float], tuple[float, float]],
) -> None:
    (x0, y0), (x1, y1) = ends
    scene = scene_of(*TWO, more=f"walls = [{{ from = [{x0}, {y0}], to = [{x1}, {y1}], thickness = 20 }}]")
    window = Window(scene, ["pymunk", "impulse"])
    window.draw()
    inks = (149, 165, 166), (0, 0, 0)  # debug-draw's static shapes; black on white
    length = math.dist(*ends)
    for pane, ink in enumerate(inks):
        for across, colour in ((-13, (255, 255, 255)), (-8, ink), (8, ink), (13, (255, 255, 255))):
            x, y = 400 - (y1 - y0) / length * across, 150 + (x1 - x0) / length * across
            assert colour_at(window.screen, window.layout, pane, x, y) == colour


def test_pause_stops_time_and_a_single_step_is_one(window: Window) -> None:
    press(window, "p")
    assert window.player.paused
    press(window, "o")
    press(window, "Right")
    assert window.lockstep.steps == 2
    assert window.panes[0].state.position[0].tolist() == [202, 300]
    press(window, "Space")
    assert not window.player.paused


def test_time_passes_at_the_scene_s_rate_and_speed_doubles_and_halves_it(window: Window) -> None:
    for _ in range(30):
        window.advance(1 / 60)
    assert window.lockstep.steps == pytest.approx(30, abs=1)
    press(window, "+")
    before = window.lockstep.steps
    for _ in range(30):
        window.advance(1 / 60)
    assert window.lockstep.steps - before == pytest.approx(60, abs=1)
    for _ in range(20):
        press(window, "-")
    assert window.player.speed == 0.01


def test_at_the_fastest_a_single_step_is_one_too_and_time_goes_on(window: Window) -> None:
    press(window, "p")
    window.player.set_speed(math.inf)
    press(window, "o")
    window.advance(0.0)
    assert window.lockstep.steps == 1
    window.advance(1 / 60)
    assert window.lockstep.steps > 1


@pytest.mark.parametrize("size", [(1, 1), (1400, 20), (20, 900), (479, 319)])
def test_a_window_too_small_for_everything_shows_the_upper_left(size: tuple[int, int]) -> None:
    window = Window(load("article"), None)
    window.player.paused = True
    window.screen = pygame.display.set_mode([max(sides) for sides in zip(size, LEAST, strict=True)])
    window.draw()
    whole = pygame.surfarray.array3d(window.screen)
    window.screen = pygame.display.set_mode(size)
    for key in ("F1", "/"):
        window.draw()
        press(window, key)
        window.draw()
    press(window, "Esc")
    press(window, "F1")
    window.draw()
    assert np.array_equal(pygame.surfarray.array3d(window.screen), whole[: size[0], : size[1]])


@pytest.mark.parametrize(
    "title",
    ["\u200d", "\ufe0f", "\U000e0f20", "\U0001f600\u0301", "wide " * 20],
    ids=["joiner", "variation", "selector", "odd", "long"],
)
def test_a_scene_may_be_called_anything(title: str, tmp_path: Path) -> None:
    """Also by letters that have no width, which pygame refuses to draw."""
    file = tmp_path / "mine.toml"
    file.write_text(f"title = {json.dumps(title, ensure_ascii=False)}\n{BALL}", encoding="utf-8")
    window = Window(load(file), None)
    window.draw()
    assert pygame.display.get_caption()[0].endswith(" - sandbox")
    for key in ("/", *"mine.toml"):
        press(window, key)
        window.draw()
    assert window.shelf.picker
    assert len(window.shelf.picker.found) == 1


def test_of_many_mistakes_the_first_are_shown_and_how_many_more(
    window: Window, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown: list[str] = []
    monkeypatch.setattr("sandbox.view.error_card.card", lambda _, lines, *__: shown.extend(line for [line] in lines))
    window.shelf.mistake = "\n".join(f"mine.toml:{k}: {'k' * 500_000 if k == 3 else 'is wrong'}" for k in range(100))
    window.draw()
    assert len(shown) == 9
    assert shown[1:4] == [f"mine.toml:{k}: is wrong" for k in range(3)]
    assert 92 < int(shown[-1].removeprefix("and ").removesuffix(" lines more")) < 110


@pytest.mark.parametrize(
    ("ends", "thickness", "seen"),
    [
        (((0, 0), (1e9, 1e9)), 20, lambda x, y: abs(x - y) < 10 * 2**0.5),
        (((-1e9, 300), (1e9, 300)), 20, lambda x, y: abs(y - 300) < 10),
        (((400, 5e8 + 300), (400, 1e9)), 1e9, lambda x, y: y > 300),
        (((-1e9, 300), (400, 300)), 200, lambda x, y: np.hypot(np.maximum(x - 400, 0), y - 300) < 100),
    ],
    ids=["along the diagonal", "across", "thick", "with a round end"],
)  # fmt: skip
def test_walls_that_reach_far_out_of_the_arena_are_drawn_where_they_are_seen(
    ends: tuple[tuple[float, float], tuple[float, float]], thickness: float, seen: Callable[[Floats, Floats], Bools]
) -> None:
    """pygame's own drawing of such a figure takes half a minute."""
    surface = pygame.Surface((800, 600))
    capsule(surface, (255, 255, 255), *ends, thickness / 2)
    x, y = np.mgrid[0:800, 0:600].astype(float)
    drawn = pygame.surfarray.array3d(surface)[..., 0] > 0
    assert (drawn != seen(x, y)).sum() < 2500  # at the edges


def test_a_slow_frame_slows_time_and_never_enlarges_a_step(window: Window, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sandbox.view.playback.BUDGET", -1.0)  # every frame is too slow
    window.advance(10.0)
    assert window.lockstep.steps == 1
    window.advance(0.0)
    assert window.lockstep.steps == 2
    window.advance(0.0)
    assert window.lockstep.steps == 2
    expected = simulate(window.scene, "pymunk", steps=2)
    assert np.array_equal(window.panes[0].state.position, expected.position[2])


def test_restart_and_next_seed(scene: Scene) -> None:
    window = Window(load("article"), None)
    for _ in range(10):
        window.player.one_step()
    press(window, "r")
    assert window.lockstep.steps == 0
    assert np.array_equal(window.panes[0].state.position, simulate(load("article"), "article", steps=0).position[0])
    press(window, "n")
    assert window.scene.seed == 1
    second = load("article").changed(seed=1)
    assert np.array_equal(window.panes[0].state.position, simulate(second, "article", steps=0).position[0])


def test_brackets_turn_the_pages_of_the_bundled_scenes(scene: Scene) -> None:
    names = list(bundled())
    window = Window(load(names[0]), None)
    seen = []
    for _ in names:
        press(window, "]")
        seen.append(window.scene.name)
        window.draw()
    assert seen == [*names[1:], names[0]]
    press(window, "[")
    assert window.scene.name == names[-1]


def test_an_engine_that_refuses_the_next_scene_says_so_and_the_scene_s_own_run() -> None:
    names = list(bundled())
    window = Window(load("article"), ["article"])
    while window.scene.name != "bouncing":
        press(window, "]")
    assert list(window.lockstep.engines) == ["pymunk", "impulse"]
    assert window.status.startswith("article: gravity and elasticity below 1 are not part of the article's rule")
    press(window, "]")
    assert window.scene.name == names[names.index("bouncing") + 1]
    assert list(window.lockstep.engines) == ["article"]


def test_a_seed_whose_balls_do_not_fit_is_told_while_the_old_one_runs_on(window: Window) -> None:
    tight = "radius = 99\ncount = 4\ninside = [[0, 0], [400, 400]]"  # a lattice at best, and that is too wide
    with pytest.raises(SandboxError, match="is more than fit"):
        Window(scene_of(tight), None)
    window.player.one_step()
    window.shelf.try_to_begin(scene_of(tight))
    assert window.lockstep.steps == 1
    assert "is more than fit" in window.status


def test_help_lists_every_key(window: Window) -> None:
    window.draw()
    before = pygame.surfarray.array3d(window.screen)
    press(window, "F1")
    window.draw()
    panel = (pygame.surfarray.array3d(window.screen) != before).any(axis=2)
    assert panel.sum() > 20_000
    assert (pygame.surfarray.array3d(window.screen)[panel] == np.array(FRAME[:3])).all(axis=1).mean() > 0.5
    press(window, "F1")
    window.draw()
    assert np.array_equal(pygame.surfarray.array3d(window.screen), before)


def test_a_picture_is_what_the_window_shows(window: Window, tmp_path: Path) -> None:
    window.player.one_step()
    window.draw()
    press(window, "F12")
    [file] = tmp_path.glob("*.png")
    assert file.name == "test-0-000001.png"
    shown = pygame.surfarray.array3d(window.screen)
    assert np.array_equal(pygame.surfarray.array3d(pygame.image.load(file)), shown)
    assert window.status == f"saved {file.name}"


def test_escape_and_the_close_button_quit(window: Window) -> None:
    press(window, "Esc")
    assert not window.running
    window.running = True
    window.on_event(Event(pygame.QUIT))
    assert not window.running


def test_every_control_is_a_method_with_a_key() -> None:
    for control in CONTROLS:
        assert any(callable(getattr(part, control.action, None)) for part in (Window, Playback, SceneLoader))
        for key in control.keys:
            mod = pygame.KMOD_LSHIFT if control.shift else 0
            assert control_of(Event(pygame.KEYDOWN, key=key, unicode="", mod=mod)) == control
        for character in control.typed:
            assert control_of(Event(pygame.KEYDOWN, key=0, unicode=character.upper())) == control


@pytest.mark.parametrize("pane", [0, 1])
def test_a_drag_in_either_pane_pulls_the_ball_in_every_engine(window: Window, pane: int) -> None:
    arena, scale = window.layout.arenas[pane], window.layout.scale
    edge = (round(arena.x + 600 * scale), round(arena.y + (300 + 20) * scale + 4))  # just off the ball
    there = (round(arena.x + 500 * scale), round(arena.y + 100 * scale))
    mouse(window, pygame.MOUSEBUTTONDOWN, edge)
    mouse(window, pygame.MOUSEMOTION, there)
    for _ in range(60):
        window.player.one_step()
    window.draw()
    for drawn in (0, 1):
        assert window.panes[drawn].state.position[1] == pytest.approx([500, 100], abs=1 / scale)
        assert colour_at(window.screen, window.layout, drawn, 500, 112) == rgb(BLUE)
    mouse(window, pygame.MOUSEBUTTONUP, there)
    kinds: list[type[Input]] = [Grab, Move, Release]
    assert [type(given) for given in window.lockstep.given] == kinds


def test_a_click_on_nothing_grabs_nothing(window: Window) -> None:
    arena, scale = window.layout.arenas[0], window.layout.scale
    mouse(window, pygame.MOUSEBUTTONDOWN, (round(arena.x + 400 * scale), round(arena.y + 300 * scale)))
    mouse(window, pygame.MOUSEBUTTONDOWN, (1, 1))
    assert window.lockstep.hand.ball is None
    assert window.lockstep.given == []


def grabbed(window: Window) -> tuple[int, int]:
    arena, scale = window.layout.arenas[1], window.layout.scale
    point = (round(arena.x + 600 * scale), round(arena.y + 300 * scale))
    mouse(window, pygame.MOUSEBUTTONDOWN, point)
    assert window.lockstep.hand.ball == 1
    return point


def test_losing_the_focus_or_the_button_lets_go(window: Window) -> None:
    grabbed(window)
    window.on_event(Event(pygame.WINDOWFOCUSLOST))
    assert window.lockstep.hand.ball is None
    point = grabbed(window)
    mouse(window, pygame.MOUSEMOTION, point, held=False)  # it came back with the button up
    assert window.lockstep.hand.ball is None
    window.release()
    assert len(window.lockstep.given) == 4


def test_the_line_to_the_pointer_is_drawn_in_every_pane(window: Window) -> None:
    x, y = grabbed(window)
    mouse(window, pygame.MOUSEMOTION, (x, y - round(150 * window.layout.scale)))
    window.draw()
    for pane in (0, 1):
        assert colour_at(window.screen, window.layout, pane, 600, 220) == (0, 0, 0)


def test_the_run_equals_the_replay_of_its_inputs(window: Window) -> None:
    x, y = grabbed(window)
    for k in range(40):
        mouse(window, pygame.MOUSEMOTION, (x - 5 * k, y - 2 * k))
        window.player.one_step()
    window.release()
    window.player.one_step()
    for pane in window.panes:
        replay = simulate(window.scene, pane.name, steps=41, inputs=window.lockstep.given)
        assert np.array_equal(replay.position[-1], pane.state.position)


@given(
    window=st.tuples(st.integers(LEAST[0], 4000), st.integers(LEAST[1], 2500)),
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


@pytest.mark.parametrize("arena", [(800.0, 600.0), (1000.0, 500.0), (300.0, 900.0)])
def test_a_new_window_has_two_panes_side_by_side_and_fits_the_desktop(arena: tuple[float, float]) -> None:
    for desktop in ((1400, 800), (1920, 1080)):
        size = natural_size(arena, 2, desktop)
        left, right = Layout(size, arena, 2).arenas
        assert left.y == right.y
        assert left.right < right.x
        assert size[0] <= desktop[0]
        assert size[1] <= desktop[1]


def button(window: Window, action: str, shows: str = "") -> tuple[int, int]:
    """Return the middle of a control's button."""
    for widget, place in zip(window.toolbar.widgets, window.layout.toolbar, strict=True):
        if isinstance(widget, Button) and (widget.control.action, widget.control.shows) == (action, shows):
            return place.center
    raise AssertionError(action)


def click(window: Window, point: tuple[int, int]) -> None:
    mouse(window, pygame.MOUSEBUTTONDOWN, point)
    mouse(window, pygame.MOUSEBUTTONUP, point)


@pytest.mark.parametrize("control", [c for c in CONTROLS if c.group == "see"], ids=lambda control: control.shows)
def test_key_and_button_show_and_hide_the_same(window: Window, control: Control) -> None:
    for _ in range(30):
        window.player.one_step()
    window.lockstep.engines["pymunk"].kick(0, (30.0, 90.0))
    window.player.one_step()
    window.panes[0].sparks.add(
        np.array([(window.panes[0].state.time, 0, 1, (1, 0), 5, 0)], CONTACT), window.panes[0].state
    )

    def shown() -> np.ndarray:
        window.draw()
        below = window.layout.toolbar[-1].bottom
        return pygame.surfarray.array3d(window.screen)[:, below:]

    window.pointer = None
    before = shown()
    press(window, control.typed)
    by_key = shown()
    assert (by_key != before).any()
    press(window, control.typed)
    assert np.array_equal(shown(), before)
    click(window, button(window, "show", control.shows))
    assert np.array_equal(shown(), by_key)


def test_the_toolbar_does_not_pull_balls_nor_its_keys_the_window_s(window: Window) -> None:
    click(window, button(window, "pause"))
    assert window.player.paused
    assert window.lockstep.given == []
    tab = Event(pygame.KEYDOWN, key=pygame.K_TAB, unicode="\t", mod=0)
    window.on_event(tab)
    press(window, "Esc")
    assert window.running  # it has left the toolbar
    press(window, "Esc")
    assert not window.running


def test_the_slider_of_speed_is_the_speed(window: Window) -> None:
    [(slider, place)] = [
        (widget, place)
        for widget, place in zip(window.toolbar.widgets, window.layout.toolbar, strict=True)
        if isinstance(widget, Slider) and widget.name == "speed"
    ]
    click(window, (place.right - 1, place.centery))
    assert window.player.speed == slider.value() == math.inf
    click(window, (place.x, place.centery))
    assert window.player.speed == 0.01


@pytest.mark.parametrize("x", [200, 600, 790])
def test_a_ball_under_the_mouse_tells_where_it_is_in_every_engine(x: int) -> None:
    scene = scene_of(*TWO, f"radius = 10\nposition = [{min(x, 790)}, 590]\nvelocity = [0, -5]\nmass = 4")
    window = Window(scene, ["pymunk", "impulse"])
    assert facts(window.panes, 2)[1:] == [
        [name, f"{x:.2f}, 590.00", "0.00, -5.00", "50"] for name in ("pymunk", "impulse")
    ]
    window.draw()
    before = pygame.surfarray.array3d(window.screen)
    arena, scale = window.layout.arenas[1], window.layout.scale
    point = round(arena.x + x * scale), round(arena.y + 590 * scale)
    mouse(window, pygame.MOUSEMOTION, point, held=False)
    window.draw()
    changed = (pygame.surfarray.array3d(window.screen) != before).any(axis=2)
    columns, rows = np.nonzero(changed)
    card = pygame.Rect(int(columns.min()), int(rows.min()), int(np.ptp(columns)) + 1, int(np.ptp(rows)) + 1)
    assert card.width > 200
    assert window.screen.get_rect().inflate(-1, -1).contains(card.inflate(-2, -2))
    assert window.screen.get_at((card.x, card.y + card.height // 2))[:3] == FAINT[:3]  # its edge, all there
    assert window.screen.get_at((card.right - 1, card.y + card.height // 2))[:3] == FAINT[:3]
    window.on_event(Event(pygame.WINDOWLEAVE))
    window.draw()
    assert np.array_equal(pygame.surfarray.array3d(window.screen), before)


def test_nothing_is_drawn_while_nothing_changes(window: Window, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[int] = []
    whole = window.draw

    def draw() -> None:
        drawn.append(window.lockstep.steps)
        whole()

    monkeypatch.setattr(window, "draw", draw)
    press(window, "p")
    for _ in range(5):
        window.frame(1 / 60)
    assert drawn == [0]
    window.tell("a notice")
    window.frame(1 / 60)
    press(window, "o")
    window.frame(1 / 60)
    window.frame(1 / 60)
    assert drawn == [0, 0, 1]
    press(window, "p")
    for _ in range(30):  # a notice stands still, and time goes on
        window.frame(1 / 60)
    assert drawn[-1] == window.lockstep.steps > 20


def test_charts_follow_the_run_and_begin_anew_with_it(window: Window) -> None:
    for _ in range(20):
        window.player.one_step()
    assert window.charts.history.series.steps.tolist() == list(range(21))
    press(window, "r")
    assert window.charts.history.series.steps.tolist() == [0]


def test_a_recording_is_what_the_window_shows_at_the_scene_s_pace(window: Window, tmp_path: Path) -> None:
    window.frame(1 / 60)
    press(window, "F9")
    assert window.is_on(next(control for control in CONTROLS if control.action == "record"))
    for _ in range(25):  # half a second of it, however long it takes
        window.frame(3.0)
    press(window, "p")
    window.frame(1 / 60)  # is not recorded
    last = pygame.surfarray.array3d(window.screen)
    press(window, "p")
    press(window, "F9")
    [file] = tmp_path.iterdir()
    with Image.open(file) as film:
        assert (file.suffix, getattr(film, "n_frames", 0)) == (".gif", 25)
        film.seek(24)
        shown = np.asarray(film.convert("RGB")).swapaxes(0, 1)
    assert window.lockstep.steps == pytest.approx(30, abs=1)
    panes = slice(window.layout.top, window.layout.strip.y)
    assert (shown[:, panes] != last[:, panes]).any(axis=2).mean() < 0.01
    assert window.status == f"saved {file.name}"


def test_a_window_of_another_size_ends_a_recording(window: Window, tmp_path: Path) -> None:
    press(window, "F9")
    window.frame(1 / 60)
    window.screen = pygame.display.set_mode((700, 500))
    window.frame(1 / 60)
    assert window.film is None
    [file] = tmp_path.iterdir()
    with Image.open(file) as film:
        assert film.size != (700, 500)


def test_without_a_display_there_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    assert not has_display()
    monkeypatch.setenv("DISPLAY", ":0")
    assert not has_display()  # SDL has the dummy driver
