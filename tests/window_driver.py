"""A window's keys and mouse, for the tests of the window."""

from typing import Final

import numpy as np
import pygame
from conftest import ball_at
from pygame import Rect, Surface
from pygame.event import Event

from sandbox.errors import SandboxError
from sandbox.run.inputs import Input
from sandbox.view.case_so_far import Case, CaseWorker, answer
from sandbox.view.controls import Action, Panel, Topic, tip_of
from sandbox.view.run_so_far import ComparisonSoFar, RunSoFar
from sandbox.view.widgets.fields import Slider
from sandbox.view.window import Window

THREE_BALLS: Final = (ball_at(200, 300, vx=240), ball_at(260, 310, mass=3), ball_at(600, 100, vx=60, vy=-30, radius=10))
SMALL_SCENE: Final = "[arena]\nsize = [90, 90]\n[[balls]]\nradius = 5\nposition = [9, 9]\n"
CODES: Final = {
    "Left": pygame.K_LEFT, "Right": pygame.K_RIGHT, "Up": pygame.K_UP, "Down": pygame.K_DOWN, "Home": pygame.K_HOME,
    "End": pygame.K_END, "Delete": pygame.K_DELETE,
    "Enter": pygame.K_RETURN, "Esc": pygame.K_ESCAPE, "Back": pygame.K_BACKSPACE, "Tab": pygame.K_TAB,
    "Shift": pygame.K_LSHIFT, "Space": pygame.K_SPACE, "F1": pygame.K_F1, "F7": pygame.K_F7,
    "F9": pygame.K_F9, "F10": pygame.K_F10,
    "F12": pygame.K_F12,
}  # fmt: skip
CONTROL: Final = {"undo": "Ctrl Z", "redo": "Ctrl Y", "save": "Ctrl S"}


class WorkerHere(CaseWorker):
    """Does its tasks in this process, at once."""

    def __init__(self) -> None:
        super().__init__()
        self._so_far = ComparisonSoFar()

    def ask(self, run: RunSoFar) -> None:
        self._answer = answer(self._so_far, run)

    def poll(self) -> Case | SandboxError | None:
        return self._answer


class IdleWorker(CaseWorker):
    """Compares nothing."""

    def ask(self, run: RunSoFar) -> None:
        pass


def press(window: Window, *keys: str) -> None:
    """Press keys by their names, or by what they type."""
    for key in keys:
        event = key_event(CONTROL.get(key, key))
        window.on_event(event)
        window.on_event(Event(pygame.KEYUP, event.dict))


def key_event(name: str, what: int = pygame.KEYDOWN) -> Event:
    """Return the event of a key by its name, with Ctrl or Shift before it, or by what it types."""
    held, key = name.split(" ") if " " in name.strip() else ("", name)
    code = CODES[key] if key in CODES else pygame.key.key_code(key) if held or len(key) > 1 else 0
    typed = "" if key in CODES or len(key) > 1 else chr(ord(key) & 31) if held == "Ctrl" and key.isalpha() else key
    mod = {"": 0, "Shift": pygame.KMOD_LSHIFT, "Ctrl": pygame.KMOD_LCTRL}[held]
    return Event(what, key=code, unicode=typed, mod=mod)


def mouse(window: Window, what: int, point: tuple[int, int], held: bool = True) -> None:
    window.on_event(Event(what, pos=point, button=1, buttons=(int(held), 0, 0)))


def hover(window: Window, point: tuple[int, int]) -> None:
    mouse(window, pygame.MOUSEMOTION, point, held=False)


def click(window: Window, point: tuple[int, int]) -> None:
    mouse(window, pygame.MOUSEBUTTONDOWN, point)
    mouse(window, pygame.MOUSEBUTTONUP, point)


def drag(window: Window, start: tuple[int, int], end: tuple[int, int]) -> None:
    hover(window, start)
    mouse(window, pygame.MOUSEBUTTONDOWN, start)
    mouse(window, pygame.MOUSEMOTION, end)
    mouse(window, pygame.MOUSEBUTTONUP, end)


def pull(window: Window, start: tuple[float, float], move: tuple[float, float], steps: int) -> None:
    """Pull what is at a place of the first pane, by a move in each of some steps, and let it go."""
    places = [point(window, start[0] + k * move[0], start[1] + k * move[1]) for k in range(steps + 1)]
    mouse(window, pygame.MOUSEBUTTONDOWN, places[0])
    for place in places[:-1]:
        mouse(window, pygame.MOUSEMOTION, place)
        run(window, 1)
    mouse(window, pygame.MOUSEBUTTONUP, places[-1])


def point(window: Window, x: float, y: float, pane: int = 0) -> tuple[int, int]:
    """Return the point of the screen at a place of the scene in a pane."""
    right, down = window.layout.to_screen(pane, (x, y))
    return round(right), round(down)


def button(window: Window, action: Action) -> tuple[int, int]:
    """Return the middle of an action's button; of what is shown in the panes after opening its page."""
    if action.value.topic is Topic.SEE and action is not Action.SHOW_ALL:
        window.panel.show(Panel.SHOW)
    return next(place.center for widget, place in window._placed if widget.does == tip_of(action))


def tool(window: Window, name: str) -> tuple[int, int]:
    """Return the middle of a button by its text."""
    return next(place.center for widget, place in window._placed if getattr(widget, "label", "") == name)


def slider(window: Window, name: str) -> tuple[Slider, Rect]:
    """Return a slider of the page of the scene, and its place."""
    window.panel.show(Panel.SCENE)
    return next((widget, at) for widget, at in window._placed if isinstance(widget, Slider) and widget.name == name)


def use(window: Window, name: str) -> None:
    """Choose a tool of the mouse."""
    window.mouse.choose(next(tool for tool in window.mouse.tools if tool.name == name))


def run(window: Window, steps: int) -> None:
    for _ in range(steps):
        window.playback.step()


def step(window: Window) -> int:
    return window.view.moment.step


def shown(window: Window) -> list[bytes]:
    """Return the positions and velocities in every pane."""
    return [state.tobytes() for pane in window.view.panes for state in (pane.state.position, pane.state.velocity)]


def given(window: Window) -> list[Input]:
    return window.view.session.given()


def pixels(surface: Surface) -> np.ndarray:
    return pygame.surfarray.array3d(surface)


def colours(surface: Surface) -> set[tuple[int, ...]]:
    """Return all colours of a surface."""
    return set(map(tuple, pixels(surface).reshape(-1, 3).tolist()))


def colour_at(window: Window, x: float, y: float, pane: int = 0) -> tuple[int, ...]:
    """Return the colour drawn at a place of the scene in a pane."""
    return tuple(window.screen.get_at(point(window, x, y, pane)))[:3]
