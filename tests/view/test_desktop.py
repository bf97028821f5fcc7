"""The real window on a real X server, with a real mouse and keyboard."""

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pygame
import pytest
from conftest import require
from desktop_driver import Desktop, Mirror, steps_of
from pygame.event import Event
from window_driver import hover, point

from sandbox.report.trajectory import simulate
from sandbox.run.edits import AddBall, AddWall, ChangeBall, SetGravity
from sandbox.run.inputs import Grab, Release, load_inputs
from sandbox.scene.fields import rgb
from sandbox.scene.files import load
from sandbox.view.theme import LIGHT
from sandbox.view.widgets.fields import Slider

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


@contextmanager
def running(display: str, folder: Path) -> Iterator[Desktop]:
    (folder / "scene.toml").write_text(SCENE)
    environment = {**os.environ, "DISPLAY": display, "BROWSER": "true"}
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


def test_a_dragged_ball_arrives_in_both_panes_and_the_replay_agrees(desktop: Desktop) -> None:
    desktop.press(200, 300)
    for x in range(200, 501, 50):
        desktop.move(x, 150)
        time.sleep(0.05)
    time.sleep(1)
    shown = desktop.picture()
    for pane in (0, 1):
        assert tuple(shown.get_at(desktop.point(486, 150, pane)))[:3] == rgb("#d55e00")
        assert tuple(shown.get_at(desktop.point(200, 300, pane)))[:3] == (255, 255, 255)
        assert tuple(shown.get_at(desktop.point(586, 500, pane)))[:3] == rgb("#0072b2")
    desktop.xdo("mouseup", 1)
    inputs = desktop.quit()
    for engine in ENGINES:
        run = simulate(desktop.scene, engine, steps=steps_of(inputs), inputs=inputs)
        assert run.position[-1, 0] == pytest.approx([500, 150], abs=3)
        assert run.position[-1, 1].tolist() == [600, 500]


@pytest.mark.wide
def test_a_drag_far_outside_the_window_keeps_the_ball_in_the_arena_and_releases_it_there(desktop: Desktop) -> None:
    desktop.press(200, 300)
    for x, y in ((300, 300), (600, 200), (700, -200)):
        desktop.move(x, y)
        time.sleep(0.1)
    desktop.xdo("mousemove", 1599, 0)  # the far corner of the screen
    corners = [desktop.point(766, 20, pane) for pane in range(2)]

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


def test_a_resized_window_shows_all_of_the_scene(desktop: Desktop) -> None:
    desktop.xdo("key", "space")
    for width, height in ((640, 700), (1500, 400)):
        desktop.xdo("windowsize", "--sync", desktop.window, width, height)
        time.sleep(0.3)
        shown = desktop.picture()
        assert shown.get_size() == (width, height)
        for pane in (0, 1):
            assert tuple(shown.get_at(desktop.point(186, 300, pane)))[:3] == rgb("#d55e00")
            left, middle = desktop.point(0, 300, pane)
            right, _ = desktop.point(800, 300, pane)  # a message of the picture before may hide the lower edge
            assert shown.get_at((left - 2, middle)) == shown.get_at((right + 1, middle)) == LIGHT.wall


CLICKS = {  # a drag, or a value that is typed, counts as one
    "drag and throw": 1,
    "pause": 1,
    "step": 1,
    "back": 1,
    "gravity there and back": 2,
    "add a ball": 2,
    "draw a wall": 2,
    "change a mass": 4,
    "other setting of Pymunk": 2,
    "other engine": 1,
    "zoom and back": 1,
    "undo": 1,
    "why": 1,
    "save": 2,
    "GIF": 4,
}


class Student(Mirror):
    """Counts what the mouse does in each task."""

    clicks = 0

    def _drag(self, start: tuple[int, int], end: tuple[int, int]) -> None:
        self.clicks += 1
        super()._drag(start, end)
        self.window.frame(0.0)

    def click_last(self, text: str) -> None:
        """Click the last widget with a text: of the timeline, if the header has one like it."""
        places = [place for widget, place in self.window._placed if getattr(widget, "label", "") == text]
        self._drag(places[-1].center, places[-1].center)

    def slide_to(self, name: str, value: float) -> None:
        """Drag a slider to a value."""
        found = ((one, at) for one, at in self.window._placed if isinstance(one, Slider) and one.name == name)
        slider, place = next(found)
        track = slider._track(place)
        x = track.x + round(track.width * list(slider.values).index(value) / (len(slider.values) - 1))
        self._drag(place.center, (x, place.centery))

    def zoom(self, notches: int) -> None:
        """Turn the wheel over the first pane."""
        at = point(self.window, 400, 300)
        self._desktop.xdo("mousemove", "--window", self._desktop.window, *at, "click", "--repeat", notches, 4)
        hover(self.window, at)
        for _ in range(notches):
            self.window.on_event(Event(pygame.MOUSEWHEEL, x=0, y=1, flipped=False))

    def done(self, task: str, results: dict[str, int]) -> None:
        """End a task: both windows show the same."""
        results[task], self.clicks = self.clicks, 0
        self.check_picture()


@pytest.mark.wide
def test_fifteen_tasks_of_a_student_need_a_few_clicks_each(display: str, tmp_path: Path) -> None:  # noqa: PLR0915
    """Clicks on words, drags and typed values are enough; the window's copy in this process shows that each is done."""
    results: dict[str, int] = {}
    with running(display, tmp_path) as desktop:
        desktop.press(200, 300)
        for x in (250, 320, 400):
            desktop.move(x, 250)
            time.sleep(0.05)
        desktop.xdo("mouseup", 1)
        results["drag and throw"] = 1
        time.sleep(0.3)
        desktop.click("Pause")
        results["pause"] = 1
        student = Student(desktop, ["pymunk", "article"])
        window = student.window
        assert [type(one) for one in student.inputs if isinstance(one, Grab | Release)] == [Grab, Release]
        student.click_at(30, 30)  # where nothing is: the ball that was thrown is no longer selected
        student.clicks = 0
        student.check_picture()
        for task, text, step in (("step", "\u203a", 1), ("back", "\u2039", -1)):
            before = window.view.moment.step
            student.click_last(text)
            assert window.view.moment.step == before + step
            student.done(task, results)
        student.slide_to("gravity", 500.0)
        assert window.view.panes[1].is_suspended
        student.slide_to("gravity", 0.0)
        assert not window.view.panes[1].is_suspended
        student.done("gravity there and back", results)
        student.click("Ball")
        student.click_at(700, 80)
        student.done("add a ball", results)
        student.click("Wall")
        student.drag((100, 80), (220, 120))
        student.done("draw a wall", results)
        student.click("Hand")
        student.click_at(700, 80)
        student.click("Balls")
        student.type("mass", "3")
        assert window.view.moment.scene.bodies.mass[-1] == 3
        student.done("change a mass", results)
        student.click("Engines")
        student.type("or type one", "pymunk(iterations=25)")  # pygame confuses 0 and ) of one frame: they are one key
        student.done("other setting of Pymunk", results)
        student.click("exact")
        assert window.view.session.names == ["pymunk", "article", "pymunk(iterations=25)", "exact"]
        student.done("other engine", results)
        student.zoom(3)
        assert window.mouse.lens.zoom > 1.5
        student.click("Fit")
        assert window.mouse.lens.zoom == 1
        student.done("zoom and back", results)
        student.click("Undo")
        assert window.view.moment.scene.bodies.mass[-1] == 1
        student.done("undo", results)
        student.click("Why")
        assert student.place_of("Next \u203a")
        results["why"], student.clicks = student.clicks, 0
        student.click("Scene")
        save = student.place_of("Scene file").center
        desktop.xdo("mousemove", "--window", desktop.window, *save, "click", 1)
        desktop.wait_for(lambda: list(tmp_path.glob("scene-0-*.toml")))
        results["save"], student.clicks = 2, 0
        record = next(place for widget, place in window._placed if getattr(widget, "label", "") == "Record").center
        play = next(place for widget, place in window._placed if getattr(widget, "label", "") == "Play").center
        for place in (record, play):
            desktop.xdo("mousemove", "--window", desktop.window, *place, "click", 1)
        time.sleep(0.5)
        for place in (play, record):
            desktop.xdo("mousemove", "--window", desktop.window, *place, "click", 1)
        desktop.wait_for(lambda: list(tmp_path.glob("*.gif")))
        results["GIF"] = 4
        inputs = desktop.quit()
    kinds = [type(one) for one in inputs if isinstance(one, SetGravity | AddBall | AddWall | ChangeBall)]
    assert kinds == [SetGravity, SetGravity, AddBall, AddWall]
    assert steps_of(inputs) > steps_of(load_inputs(next(tmp_path.glob("*.jsonl")), desktop.scene)) - 1
    assert results == CLICKS
