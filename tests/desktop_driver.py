"""The real window on an X server, driven by a real mouse and keyboard."""

import subprocess
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pygame
import pytest
from pygame import Rect
from window_driver import WorkerHere, drag, hover, pixels, point, press

from sandbox.run.inputs import End, Input, load_inputs
from sandbox.scene.model import Scene
from sandbox.view.case_so_far import CaseSoFar
from sandbox.view.controls import Panel
from sandbox.view.layout import TEXT_HEIGHT, WIDE, Layout
from sandbox.view.window import Window


def steps_of(inputs: list[Input]) -> int:
    """Return how many steps a recording has."""
    assert isinstance(inputs[-1], End)
    return inputs[-1].step


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

    def find(self) -> None:
        """Wait until there is a window, and direct keys to it."""
        self.window = str(self.wait_for(lambda: self.xdo("search", "--onlyvisible", "--class", "^sandbox$")))
        self.xdo("windowfocus", "--sync", self.window)

    def open(self) -> None:
        """Wait until keys reach the window: they are lost before it is ready."""
        for _ in range(10):
            self.find()
            self.key("F12")
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
    def step(self) -> int:
        """The step shown, which is in the name of a picture."""
        self.picture()
        [file] = self.folder.glob("*.png")
        return int(file.stem.rpartition("-")[2])

    @property
    def size(self) -> tuple[int, int]:
        """The size of the window; 0, 0 while it is exchanged for another, as for full screen."""
        geometry = dict(line.split("=") for line in self.xdo("getwindowgeometry", "--shell", self.window).splitlines())
        return int(geometry.get("WIDTH", 0)), int(geometry.get("HEIGHT", 0))

    @property
    def layout(self) -> Layout:
        if self._model is None or self._model.scene is not self.scene:
            with pytest.MonkeyPatch.context() as patch:
                patch.setenv("SDL_VIDEODRIVER", "dummy")
                self._model = Window(self.scene, None)
        self._model.panel.open = Panel.SCENE if self.size[0] >= WIDE * TEXT_HEIGHT else None
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

    def click(self, text: str) -> None:
        """Click a button by its text, before anything has changed the window."""
        assert self.layout
        assert self._model
        self._model.screen = pygame.Surface(self.size)
        place = next(place for widget, place in self._model._placed if getattr(widget, "label", "") == text)
        self.xdo("mousemove", "--window", self.window, *place.center, "click", 1)

    def quit(self) -> list[Input]:
        """Close the window; return the inputs it recorded."""
        self.xdo("windowfocus", "--sync", self.window)
        self.xdo("key", "--delay", 30, "Escape", "Escape", "Escape")  # the tool, the hint, the window
        assert self.process.wait(30) == 0
        return load_inputs(self.folder / "inputs.jsonl", self.scene)


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
        self.window.panel.open = Panel.SCENE
        self.window.why.case = CaseSoFar(WorkerHere())
        self.window.playback.paused = True
        for _ in range(steps_of(self.inputs)):
            self.window.playback.step()
        self._desktop = desktop

    def type(self, field: str, text: str) -> None:
        """Type a value into a field, in both windows, once both show it: letters beside a field are keys."""
        self.check_picture()
        self.click(field)
        self._desktop.xdo("type", "--delay", 30, text)
        self._desktop.key("Return")
        press(self.window, *text, "Enter")

    def place_of(self, text: str) -> Rect:
        """Return the place of the widget that shows a text, or has it as its name."""
        texts = ((getattr(widget, "text", ""), getattr(widget, "name", "")) for widget, _ in self.window._placed)
        number = next(k for k, shown in enumerate(texts) if text in shown)
        return self.window._placed[number][1]

    def click(self, text: str) -> None:
        """Click a widget in both windows."""
        place = self.place_of(text).center
        self._drag(place, place)

    def click_at(self, x: float, y: float) -> None:
        """Click a place of the first pane, in both windows."""
        self.drag((x, y), (x, y))

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Drag from a place of the first pane to another, in both windows."""
        self._drag(point(self.window, *start), point(self.window, *end))

    def _drag(self, start: tuple[int, int], end: tuple[int, int]) -> None:
        xdo, window = self._desktop.xdo, self._desktop.window
        xdo("mousemove", "--window", window, *start, "mousedown", 1)
        xdo("mousemove", "--window", window, *end, "mouseup", 1)
        drag(self.window, start, end)

    def has_picture(self) -> bool:
        """Return whether both windows show the same, but for the status line and the toolbar."""
        corner = (2, 2)  # where nothing is pointed at
        self._desktop.xdo("mousemove", "--window", self._desktop.window, *corner)
        hover(self.window, corner)
        self.window.frame(1 / 60)
        layout, pictures = self.window.layout, (self._desktop.picture(), self.window.screen)
        bottom = min(layout.status.y - 100, layout.arenas[-1].bottom)  # above messages
        shown, drawn = (pixels(one)[:, layout.top : bottom] for one in pictures)
        return np.array_equal(shown, drawn)

    def check_picture(self) -> None:
        """Wait until both windows show the same."""
        self._desktop.wait_for(self.has_picture)
