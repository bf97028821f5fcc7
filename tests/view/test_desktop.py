"""The real window on a real X server, with a real mouse and keyboard."""

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from itertools import chain
from pathlib import Path

import numpy as np
import pygame
import pytest
from conftest import require
from window_driver import WorkerHere, click, drag, point, press

from sandbox.run.edits import AddBall
from sandbox.run.inputs import End, Grab, Input, Release, load_inputs
from sandbox.run.trajectory import simulate
from sandbox.scene.fields import rgb
from sandbox.scene.files import load, parse
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.session.session import Session
from sandbox.view.case_so_far import CaseSoFar
from sandbox.view.controls import CONTROLS, Group, Panel
from sandbox.view.layout import Layout
from sandbox.view.widgets.group_header import GroupHeader
from sandbox.view.widgets.slider import Slider
from sandbox.view.window import Window

SCENE = """
[arena]
size = [800, 600]
[[balls]]
radius = 20
position = [200, 300]
colors = ["#d55e00"]
[[balls]]
radius = 20
position = [600, 500]
colors = ["#0072b2"]
"""
ENGINES = ("pymunk", "article")


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    require("Xvfb", "xdotool")
    read, write = os.pipe()
    server = ["Xvfb", "-displayfd", str(write), "-screen", "0", "1600x900x24", "-nolisten", "tcp"]
    server.append("-noreset")  # or it restarts when a client leaves, and a window that opens then finds no server
    with subprocess.Popen(server, pass_fds=[write], stderr=subprocess.DEVNULL) as xvfb:
        os.close(write)
        with os.fdopen(read) as pipe:
            yield f":{pipe.readline().strip()}"
        xvfb.terminate()


@dataclass
class Desktop:
    """A running sandbox, driven by mouse and keyboard."""

    environment: dict[str, str]
    process: subprocess.Popen[bytes]
    folder: Path
    scene: Scene
    window: str = ""
    _model: Window | None = None  # of the same scene, in this process

    def xdo(self, *arguments: object) -> str:
        command = ["xdotool", *map(str, arguments)]
        return subprocess.run(command, env=self.environment, capture_output=True, text=True, check=False).stdout.strip()

    def wait_for(self, found: Callable[[], object], seconds: float = 30) -> object:
        """Wait until a function returns something true, for as long as a slow machine may need."""
        for _ in range(round(20 * seconds)):
            result = found()
            if result:
                return result
            assert self.process.poll() is None, "the sandbox stopped"
            time.sleep(0.05)
        raise TimeoutError(f"nothing after {seconds} s")

    def open(self) -> None:
        """Wait until keys reach the window: they are lost before it is ready."""
        for _ in range(10):
            self.window = str(self.wait_for(lambda: self.xdo("search", "--onlyvisible", "--class", "^sandbox$")))
            self.xdo("windowfocus", "--sync", self.window, "key", "F12")
            with suppress(TimeoutError):
                self.wait_for(lambda: list(self.folder.glob("*.png")), seconds=3)
                return
        raise TimeoutError("no key reached the window")

    def picture(self) -> pygame.Surface:
        """Save a picture with the sandbox, and load it."""
        for old in self.folder.glob("*.png"):
            old.unlink()
        self.xdo("key", "F12")
        self.wait_for(lambda: list(self.folder.glob("*.png")))
        [file] = self.folder.glob("*.png")
        return pygame.image.load(file)

    @property
    def size(self) -> tuple[int, int]:
        geometry = dict(line.split("=") for line in self.xdo("getwindowgeometry", "--shell", self.window).splitlines())
        return int(geometry["WIDTH"]), int(geometry["HEIGHT"])

    @property
    def layout(self) -> Layout:
        if self._model is None or self._model.scene is not self.scene:
            with pytest.MonkeyPatch.context() as patch:
                patch.setenv("SDL_VIDEODRIVER", "dummy")
                self._model = Window(self.scene, None)
        return self._model.layout_in(self.size)

    def point(self, x: float, y: float, pane: int = 0) -> tuple[int, int]:
        """Turn a place of the scene into a point of the window."""
        right, down = self.layout.to_screen(pane, (x, y))
        return round(right), round(down)

    def move(self, x: float, y: float, pane: int = 0) -> None:
        self.xdo("mousemove", "--window", self.window, *self.point(x, y, pane))

    def press(self, x: float, y: float, pane: int = 0) -> None:
        self.move(x, y, pane)
        self.xdo("mousedown", 1)

    def key(self, *keys: str) -> None:
        self.xdo("key", "--delay", 30, *keys)

    def has_title(self, title: str) -> bool:
        return self.xdo("getwindowname", self.window) == title

    def save(self) -> Path:
        """Save the balls as a scene with the sandbox; return its file."""
        before = set(self.folder.glob("*.toml"))
        self.key("s")
        self.wait_for(lambda: set(self.folder.glob("*.toml")) > before)
        [file] = set(self.folder.glob("*.toml")) - before
        return file

    def slide(self, name: str, share: float) -> None:
        """Drag a slider of the toolbar to a share of its track; unfold its group if it is folded away."""
        layout, model = self.layout, self._model
        assert model
        widgets = model.toolbar.widgets
        number = next(k for k, widget in enumerate(widgets) if isinstance(widget, Slider) and widget.name == name)
        if not layout.toolbar[number].width:
            headers = [(k, each) for k, each in enumerate(widgets[:number]) if isinstance(each, GroupHeader)]
            at, header = headers[-1]
            self.xdo("mousemove", "--window", self.window, *layout.toolbar[at].center, "click", 1)
            model.toolbar.by_hand[Group[header.name.upper()]] = True
        place = self.layout.toolbar[number]
        pad = place.height // 3
        x = place.x + pad + round(share * (place.width - 2 * pad))
        self.xdo("mousemove", "--window", self.window, place.centerx, place.centery, "mousedown", 1)
        self.xdo("mousemove", "--window", self.window, x, place.centery, "mouseup", 1)

    def quit(self) -> list[Input]:
        """Close the window; return the inputs it recorded."""
        self.xdo("windowfocus", "--sync", self.window)
        self.xdo("key", "--delay", 30, "Escape", "Escape")
        assert self.process.wait(30) == 0
        return load_inputs(self.folder / "inputs.jsonl", self.scene)


@pytest.fixture(scope="module", autouse=True)
def _compiled() -> None:
    """Compile the engines first: the window stands still while they are compiled."""
    session = Session(parse(SCENE, "scene.toml"), ENGINES)
    for _ in range(10):
        session.advance()


@contextmanager
def running(display: str, folder: Path) -> Iterator[Desktop]:
    (folder / "scene.toml").write_text(SCENE)
    environment = {**os.environ, "DISPLAY": display}
    command = [sys.executable, "-m", "sandbox", "run", "scene.toml", "--save-inputs", "inputs.jsonl"]
    with subprocess.Popen(command, cwd=folder, env=environment) as process:
        desktop = Desktop(environment, process, folder, load(folder / "scene.toml"))
        try:
            desktop.open()
            yield desktop
        finally:
            process.kill()


@pytest.fixture
def desktop(display: str, tmp_path: Path) -> Iterator[Desktop]:
    with running(display, tmp_path) as desktop:
        yield desktop


def steps_of(inputs: list[Input]) -> int:
    assert isinstance(inputs[-1], End)
    return inputs[-1].step


def test_a_dragged_ball_arrives_in_both_panes_and_the_replay_agrees(desktop: Desktop) -> None:
    desktop.press(200, 300)
    for x in range(200, 501, 50):
        desktop.move(x, 150)
        time.sleep(0.05)
    time.sleep(1)
    shown = desktop.picture()
    for pane in (0, 1):
        assert tuple(shown.get_at(desktop.point(500, 160, pane)))[:3] == rgb("#d55e00")
        assert tuple(shown.get_at(desktop.point(200, 300, pane)))[:3] == (255, 255, 255)
        assert tuple(shown.get_at(desktop.point(600, 510, pane)))[:3] == rgb("#0072b2")
    desktop.xdo("mouseup", 1)
    inputs = desktop.quit()
    for engine in ENGINES:
        run = simulate(desktop.scene, engine, steps=steps_of(inputs), inputs=inputs)
        assert run.position[-1, 0] == pytest.approx([500, 150], abs=3)
        assert run.position[-1, 1].tolist() == [600, 500]


def test_a_ball_released_in_motion_keeps_flying(desktop: Desktop) -> None:
    desktop.press(200, 300, pane=1)
    start, end = desktop.point(200, 300, pane=1), desktop.point(400, 300, pane=1)
    moves = [("mousemove", "--window", desktop.window, x, start[1], "sleep", 0.02) for x in range(start[0], end[0], 8)]
    desktop.xdo(*chain.from_iterable(moves), "mouseup", 1)  # in one command, or the ball comes to rest between two
    time.sleep(0.3)
    inputs = desktop.quit()
    [released] = [given.step for given in inputs if isinstance(given, Release)]
    assert steps_of(inputs) > released + 5
    for engine in ENGINES:
        run = simulate(desktop.scene, engine, steps=steps_of(inputs), inputs=inputs)
        assert run.velocity[released, 0, 0] > 30
        assert run.velocity[-1, 0].tolist() == run.velocity[released, 0].tolist()


def test_a_drag_far_outside_the_window_keeps_the_ball_in_the_arena_and_releases_it_there(desktop: Desktop) -> None:
    desktop.press(200, 300)
    for x, y in ((300, 300), (600, 200), (700, -200)):
        desktop.move(x, y)
        time.sleep(0.1)
    desktop.xdo("mousemove", 1599, 0)  # the far corner of the screen
    corners = [desktop.point(772, 28, pane) for pane in range(2)]

    def is_there() -> bool:
        picture = desktop.picture()
        return all(picture.get_at(corner) == pygame.Color("#d55e00") for corner in corners)

    desktop.wait_for(is_there)
    time.sleep(0.3)  # in which it comes to rest
    desktop.xdo("mouseup", 1)
    time.sleep(0.3)
    inputs = desktop.quit()
    assert sum(isinstance(given, Release) for given in inputs) == 1
    for engine in ENGINES:
        run = simulate(desktop.scene, engine, steps=steps_of(inputs), inputs=inputs)
        assert (run.position[:, 0] > 19).all()
        assert (run.position[:, 0] < [781, 581]).all()
        assert run.position[-1, 0] == pytest.approx([780, 20], abs=1)


def test_losing_the_focus_releases_the_ball(desktop: Desktop) -> None:
    desktop.press(200, 300)
    desktop.move(300, 300)
    time.sleep(0.2)
    root = desktop.xdo("search", "--maxdepth", 0, "")
    desktop.xdo("windowfocus", root)
    time.sleep(0.3)
    desktop.xdo("mouseup", 1)
    inputs = desktop.quit()
    assert [given.do for given in inputs if given.do != "move"] == ["start", "grab", "release", "end"]


def test_a_resized_window_shows_all_of_the_scene(desktop: Desktop) -> None:
    desktop.xdo("key", "p")
    for width, height in ((640, 700), (1500, 400)):
        desktop.xdo("windowsize", "--sync", desktop.window, width, height)
        time.sleep(0.3)
        shown = desktop.picture()
        assert shown.get_size() == (width, height)
        for pane in (0, 1):
            assert tuple(shown.get_at(desktop.point(600, 510, pane)))[:3] == rgb("#0072b2")


def test_a_session_of_scenes_time_travel_edits_and_saved_files(desktop: Desktop) -> None:
    desktop.key("slash")
    desktop.xdo("type", "--delay", 30, "bounci")
    desktop.key("Return", "p")
    desktop.wait_for(partial(desktop.has_title, "Bouncing under gravity - sandbox"))
    desktop.scene = load("bouncing")
    desktop.key("Home")
    for _ in range(11):
        desktop.key("minus")

    # Ten steps on and ten back are the same bytes.
    desktop.key(*["Right"] * 7)
    paused_at = desktop.save()
    desktop.key(*["Right"] * 10)
    assert desktop.save().read_bytes() != paused_at.read_bytes()
    desktop.key(*["Left"] * 10)
    assert desktop.save().read_bytes() == paused_at.read_bytes()

    # A ball is dragged and thrown, another is added, the elasticity is changed, and that is undone.
    x, y = load(paused_at).balls[0].position or (0, 0)
    desktop.key("p")
    desktop.press(x, y)
    desktop.key(*["plus"] * 11)
    desktop.move(x + 60, y - 50)
    time.sleep(0.4)
    desktop.move(x + 120, y - 30)
    time.sleep(0.05)
    desktop.xdo("mouseup", 1)
    desktop.key("p")
    desktop.move(700, 550)
    desktop.key("a")
    with_ball = desktop.save()
    desktop.slide("elasticity", 0.9)
    with_slider = desktop.save()
    desktop.key("ctrl+z")
    assert desktop.save().read_bytes() == with_ball.read_bytes()
    assert load(with_slider).arena.elasticity == pytest.approx(0.9**0.5)
    assert [len(load(file).bodies) for file in (paused_at, with_ball)] == [3, 4]

    # Start and end are unchanged; both load as they were shown, and the replay agrees.
    strip = desktop.layout.strip
    desktop.xdo("mousemove", "--window", desktop.window, strip.x + 2, strip.centery, "click", 1)
    start = load(desktop.save())
    desktop.key("End")
    end = load(desktop.save())
    assert (desktop.folder / f"{end.name}.toml").read_bytes() == with_ball.read_bytes()
    inputs = desktop.quit()
    assert [type(given) for given in inputs if isinstance(given, Grab | Release | AddBall)] == [Grab, Release, AddBall]
    for saved, steps in ((start, 0), (end, steps_of(inputs))):
        shown, replay = spawn(saved), simulate(desktop.scene, "pymunk", steps=steps, inputs=inputs)
        there = ~np.isnan(replay.position[-1, :, 0])
        assert shown.position.tobytes() == replay.position[-1, there].tobytes()
        assert shown.velocity.tobytes() == replay.velocity[-1, there].tobytes()


class Mirror:
    """The window's copy in this process: it knows where the widgets are."""

    def __init__(self, desktop: Desktop, engines: list[str]) -> None:
        """Let the sandbox save what was done, and do the same here."""
        before = set(desktop.folder.glob("*.jsonl"))
        desktop.key("j")
        desktop.wait_for(lambda: set(desktop.folder.glob("*.jsonl")) > before)
        [file] = set(desktop.folder.glob("*.jsonl")) - before
        self.inputs = load_inputs(file, desktop.scene)
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("SDL_VIDEODRIVER", "dummy")
            self.window = Window(desktop.scene, engines, self.inputs)
            self.window.screen = pygame.display.set_mode(desktop.size)
        self.window.why.case = CaseSoFar(self.window.notice, WorkerHere())
        self.window.playback.paused = True
        for _ in range(steps_of(self.inputs)):
            self.window.playback.step()
        self._desktop = desktop

    def open(self, panel: Panel) -> None:
        """Open a page of the side panel, in both windows."""
        key = next(control.typed for control in CONTROLS if control.action is panel)
        self._desktop.key(key)
        self.window.panel.toggle(panel)
        for _ in range(3):
            self.window.frame(1 / 60)

    def place_of(self, text: str) -> pygame.Rect:
        """Return the place of the widget that shows a text, or has it as its name."""
        texts = ((getattr(widget, "text", ""), getattr(widget, "name", "")) for widget, _ in self.window._placed)
        number = next(k for k, shown in enumerate(texts) if text in shown)
        return self.window._placed[number][1]

    def click(self, text: str) -> None:
        """Click a widget in both windows."""
        place = self.place_of(text)
        self._desktop.xdo("mousemove", "--window", self._desktop.window, *place.center, "click", 1)
        click(self.window, place.center)

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Drag from a place of the first pane to another, in both windows."""
        first, last = (point(self.window, *place) for place in (start, end))
        xdo, window = self._desktop.xdo, self._desktop.window
        xdo("mousemove", "--window", window, *first, "mousedown", 1)
        xdo("mousemove", "--window", window, *last, "mouseup", 1)
        drag(self.window, first, last)


def open_the_article(desktop: Desktop) -> None:
    desktop.key("slash")
    desktop.xdo("type", "--delay", 30, "three balls")
    desktop.key("Return")
    desktop.wait_for(partial(desktop.has_title, "The article's three balls - sandbox"))
    desktop.scene = load("article")
    time.sleep(2)
    desktop.key("p")


def look_around(desktop: Desktop) -> None:
    """Read what the scene is about, choose an instrument, enlarge a part, and show all again."""
    desktop.key("F1", "F1", "2", "Down", "Return")
    desktop.move(400, 300)
    desktop.xdo("click", 4, "click", 4, "mousedown", 2)
    desktop.move(500, 300)
    desktop.xdo("mouseup", 2)
    desktop.key("0")


def ask_why(desktop: Desktop) -> None:
    """Go to contacts that differ, and make the page."""
    mirror = Mirror(desktop, ["pymunk", "article"])
    mirror.open(Panel.WHY)
    desktop.key("less", "less", "greater", "End")
    x, y = mirror.place_of("make the page").center

    def is_made() -> bool:
        desktop.xdo("mousemove", "--window", desktop.window, x, y, "click", 1, "sleep", 0.5)
        return bool(list(desktop.folder.glob("*.html")))

    desktop.wait_for(is_made, seconds=5)  # of waiting besides the clicks: the comparison runs in another process
    desktop.key("w")


def choose_engines(desktop: Desktop) -> list[str]:
    """Replace one by a key, and add Pymunk with another setting."""
    desktop.key("i")
    mirror = Mirror(desktop, ["pymunk", "impulse"])
    mirror.open(Panel.ENGINES)
    mirror.click("pymunk(substeps=4)")
    desktop.key("e")
    return ["pymunk", "impulse", "pymunk(substeps=4)"]


def edit(desktop: Desktop, engines: list[str]) -> None:
    """Draw a wall, move one end of it, and move a ball; type the mass of another, and push it."""
    mirror = Mirror(desktop, engines)
    mirror.open(Panel.INSPECTOR)
    mirror.click("draw wall")
    mirror.drag((60, 560), (300, 560))
    mirror.click("move")
    mirror.drag((60, 560), (60, 520))
    x, y = mirror.window.view.panes[0].state.position[0].tolist()
    mirror.drag((x, y), (x - 60, y + 60))
    desktop.key("period")
    press(mirror.window, ".")
    mirror.click("mass")
    desktop.xdo("type", "--delay", 30, "2.5")
    desktop.key("Return", "Shift+Right", "k", "p")
    time.sleep(1)
    desktop.key("p")


def test_a_session_with_every_panel_ends_in_files_that_equal_its_replay(desktop: Desktop) -> None:
    open_the_article(desktop)
    look_around(desktop)
    ask_why(desktop)
    engines = choose_engines(desktop)
    edit(desktop, engines)
    desktop.xdo("mousemove", "--window", desktop.window, 2, 2)  # off the panes, so that the first one is saved
    saved, mirror = load(desktop.save()), Mirror(desktop, engines)
    inputs = desktop.quit()
    assert [given.do for given in inputs] == ["start", "add-wall", "change-wall", "change", "change", "velocity", "end"]
    assert inputs == mirror.inputs
    assert len(saved.walls) == 1
    assert saved.bodies.mass.tolist() == [1, 2.5, 1]
    for pane in mirror.window.view.panes:
        replay = simulate(desktop.scene, pane.name, steps=steps_of(inputs), inputs=inputs)
        states = [pane.state] if pane.name != "pymunk" else [pane.state, spawn(saved)]
        for state in states:
            assert state.position.tobytes() == replay.position[-1].tobytes()
            assert state.velocity.tobytes() == replay.velocity[-1].tobytes()


def test_an_edited_file_runs_at_once_and_an_error_leaves_the_current_scene(desktop: Desktop) -> None:
    file = desktop.folder / "scene.toml"
    for k in range(8):
        broken = k % 4 == 1
        file.write_text(f'title = "Edit {k}"\n' + SCENE.replace("20", "-20" if broken else "21", 1))
        if broken:
            time.sleep(0.3)
            assert desktop.has_title(f"Edit {k - 1} - sandbox")
        else:
            desktop.wait_for(partial(desktop.has_title, f"Edit {k} - sandbox"))
    desktop.quit()
