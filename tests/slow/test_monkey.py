"""A monkey at the window, on a screen that is only in memory: whatever it does, the run equals its replay.

    pytest tests/slow/test_monkey.py --hypothesis-profile=thorough

lets it work for ten minutes.
"""

import os
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np
import pygame
import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule, run_state_machine_as_test
from pygame._sdl2.video import Window as SystemWindow
from pygame.event import Event

from sandbox.run.inputs import End, Start, load_inputs, write_inputs
from sandbox.run.trajectory import simulate
from sandbox.scene.files import load
from sandbox.view.controls import CONTROLS, Control
from sandbox.view.window import Window

SCENES: Final = ("article", "bouncing", "newtons-cradle", "oblique", "head-on", "funnel", "break-shot", "mine.toml")
ENGINES: Final = (None, ["exact"], ["impulse", "exact", "pymunk"])
MINE: Final = """
title = "Mine"
[arena]
size = [400, 300]
elasticity = 0.9
[[balls]]
radius = 20
positions = [[100, 100], [130, 140], [200, 60], [300, 200]]
velocities = [[60, 30], [-200, 90], [500, -700], [0, 0]]
[[walls]]
from = [50, 250]
to = [350, 280]
"""
FILES: Final = {
    "mine.toml": MINE.encode(),
    "rough.toml": MINE.replace("radius", "friction = 0.5\nradius").encode(),
    "broken.toml": MINE.replace("radius = 20", "radius = -20").encode(),
    "odd \U0001f600 \u0301.toml": MINE.replace("Mine", "\u200b\U0001f600\u0301\t\u05e9").encode(),
    os.fsdecode(b"\xff.toml"): MINE.encode(),
    "binary.toml": bytes(range(256)),
    "huge.toml": b"#" * 2_500_000,
    "empty.toml": b"",
}
CODES: Final = sorted({getattr(pygame, name) for name in dir(pygame) if name.startswith("K_")})
OTHERS: Final = (
    pygame.WINDOWMINIMIZED, pygame.WINDOWRESTORED, pygame.WINDOWENTER, pygame.WINDOWLEAVE, pygame.WINDOWFOCUSGAINED,
    pygame.WINDOWEXPOSED, pygame.WINDOWHIDDEN, pygame.WINDOWSHOWN, pygame.WINDOWMOVED, pygame.ACTIVEEVENT, pygame.KEYUP,
    pygame.TEXTINPUT, pygame.TEXTEDITING, pygame.DROPTEXT, pygame.DROPBEGIN, pygame.DROPCOMPLETE, pygame.FINGERDOWN,
    pygame.FINGERMOTION, pygame.JOYBUTTONDOWN, pygame.USEREVENT, pygame.CLIPBOARDUPDATE,
)  # fmt: skip

shares = st.floats(0, 1)
numbers = st.integers(0, 60)
buttons = st.sampled_from([1, 1, 1, 1, 2, 3, 6, 7])
places = st.sampled_from(["ball", "widget", "charts", "bar", "pane", "anywhere"])
texts = st.one_of(st.just(""), st.characters(), st.text(max_size=3))
sides = st.integers(1, 2000)


class Monkey(RuleBasedStateMachine):
    """What a person, a desktop and an editor do to a window. Time passes by steps, never by the clock."""

    window: Window

    def __init__(self) -> None:
        super().__init__()
        self.patch = pytest.MonkeyPatch()
        self.folder = TemporaryDirectory()
        self.patch.chdir(self.folder.name)
        self.patch.setenv("SDL_VIDEODRIVER", "dummy")
        self.patch.setattr("sandbox.view.player.BUDGET", -1.0)  # a step a frame, on any machine
        for name, text in FILES.items():
            Path(name).write_bytes(text)
        self.down: set[int] = set()  # buttons of the mouse
        self.at = (0, 0)

    @initialize(scene=st.sampled_from(SCENES), engines=st.sampled_from(ENGINES), forgets=st.booleans())
    def open(self, scene: str, engines: list[str] | None, forgets: bool) -> None:
        if forgets:
            self.patch.setattr("sandbox.session.history.MAX_RECENT", 8)
            self.patch.setattr("sandbox.session.history.MAX_BYTES_KEPT", 50_000)
        self.window = Window(load(scene), engines)

    def teardown(self) -> None:
        self.window.stop_recording()
        self.the_run_equals_the_replay_of_its_recording()
        pygame.display.quit()
        self.patch.undo()
        self.folder.cleanup()

    def send(self, kind: int, **what: Any) -> None:
        self.window.on_event(Event(kind, what))
        self.window.running = True  # whatever it said

    # What a monkey does

    @rule(seconds=st.sampled_from([0.0, 1 / 60, 0.5]), frames=st.integers(1, 40))
    def wait(self, seconds: float, frames: int) -> None:
        for _ in range(frames):
            self.window.frame(seconds)

    @rule(control=st.sampled_from(CONTROLS), times=st.integers(1, 3))
    def use(self, control: Control, times: int) -> None:
        for _ in range(times):
            self.key(*(control.keys or (0,))[:1], control.typed[-1:], pygame.KMOD_LSHIFT if control.shift else 0)

    @rule(key=st.sampled_from(CODES), typed=texts, mod=st.sampled_from([0, pygame.KMOD_LSHIFT, pygame.KMOD_LCTRL]))
    def key(self, key: int, typed: str, mod: int) -> None:
        self.send(pygame.KEYDOWN, key=key, unicode=typed, mod=mod)

    @rule(what=places, which=numbers, x=shares, y=shares)
    def move(self, what: str, which: int, x: float, y: float) -> None:
        window, layout = self.window, self.window.layout
        place = pygame.Rect((0, 0), layout.window).inflate(1000, 1000)
        if what == "widget":
            place = layout.toolbar[which % len(layout.toolbar)]
        elif what == "charts":
            place = layout.strip
        elif what == "bar":
            place = layout.bar
        elif what != "anywhere":
            place = layout.arenas[which % len(window.panes)]
        if what == "ball":
            position = window.panes[which % len(window.panes)].state.position
            bx, by = (position[which % len(position)] * layout.scale).tolist()
            place = pygame.Rect(place.x + round(bx), place.y + round(by), 1, 1).inflate(10, 10)
        self.at = round(place.x + x * place.width), round(place.y + y * place.height)
        self.send(pygame.MOUSEMOTION, pos=self.at, rel=(0, 0), buttons=tuple(int(k in self.down) for k in (1, 2, 3)))

    @rule(button=buttons)
    def press(self, button: int) -> None:
        self.down.add(button)
        self.send(pygame.MOUSEBUTTONDOWN, pos=self.at, button=button)

    @rule(button=buttons)
    def let_go(self, button: int) -> None:
        self.down.discard(button)
        self.send(pygame.MOUSEBUTTONUP, pos=self.at, button=button)

    @rule(what=places, which=numbers, x=shares, y=shares, moves=st.integers(0, 4), frames=st.integers(1, 5))
    def drag(self, what: str, which: int, x: float, y: float, moves: int, frames: int) -> None:
        """Drag from somewhere to anywhere, and keep the button down."""
        self.move(what, which, x, y)
        self.press(1)
        for k in range(moves):
            self.move("pane", which + k, y, x)
            self.wait(1 / 60, frames)

    @rule(which=numbers, x=shares, y=shares, back=shares)
    def throw_and_go_back(self, which: int, x: float, y: float, back: float) -> None:
        """Throw a ball, let it fly, and go back to some time, which may be in the midst of that."""
        self.window.shelf.close_picker()
        self.window.player.paused = False
        self.drag("ball", which, x, y, 4, 5)
        self.let_go(1)
        self.wait(1 / 60, 10)
        self.window.player.seek(round(back * self.window.stage.session.end))

    @rule(y=st.integers(-3, 3))
    def turn_the_wheel(self, y: int) -> None:
        self.send(pygame.MOUSEWHEEL, x=0, y=y, flipped=False)
        for kind in (pygame.MOUSEBUTTONDOWN, pygame.MOUSEBUTTONUP):
            self.send(kind, pos=self.at, button=4 if y > 0 else 5)

    @rule()
    def look_elsewhere(self) -> None:
        self.down.clear()  # what is let go there is not told
        self.send(pygame.WINDOWFOCUSLOST)

    @rule(kind=st.sampled_from(OTHERS))
    def be_told_of_something(self, kind: int) -> None:
        self.send(kind)

    @rule(size=st.one_of(st.tuples(sides, sides), st.sampled_from([(1, 1), (5000, 20), (20, 3000)])))
    def resize(self, size: tuple[int, int]) -> None:
        SystemWindow.from_display_module().size = size
        for event in pygame.event.get():
            self.window.on_event(event)
        assert self.window.screen.get_size() == size

    @rule(name=st.sampled_from([*FILES, "missing.toml", "", "."]))
    def drop(self, name: str) -> None:
        self.send(pygame.DROPFILE, file=str(Path(name).resolve()))

    @rule(name=st.sampled_from(list(FILES)), text=st.sampled_from([MINE, MINE.replace("20", "15"), "broken", None]))
    def edit_a_file(self, name: str, text: str | None) -> None:
        Path(name).unlink(missing_ok=True)
        if text is not None:
            Path(name).write_text(text)
        self.window.shelf._looks_at = 0.0
        self.window.shelf.look_at_file()

    @rule(words=st.sampled_from(["mine", "odd", "cradle", "zzz", ""]))
    def pick(self, words: str) -> None:
        for letter in ("/", *words):
            self.key(0, letter, 0)
        self.window.frame(1 / 60)
        self.key(pygame.K_RETURN, "\r", 0)

    # What must be

    @rule()
    def the_run_equals_the_replay_of_its_recording(self) -> None:
        window, session = self.window, self.window.stage.session
        window.player.settle()
        start = Start(scene=window.scene.name, seed=window.scene.seed, rate=window.scene.rate)
        write_inputs([start, *session.given(), End(step=session.step)], Path("inputs.jsonl"))
        inputs = load_inputs(Path("inputs.jsonl"), window.scene)
        assert window.stage.moment.step == session.step
        for name, state in window.stage.moment.states.items():
            replay = simulate(window.scene, name, steps=session.step, inputs=inputs)
            assert replay.position[-1, window.stage.moment.balls].tobytes() == state.position.tobytes()
            assert replay.velocity[-1, window.stage.moment.balls].tobytes() == state.velocity.tobytes()

    @rule(charts=shares, which=numbers, keys=st.lists(st.sampled_from(CONTROLS[:5])))
    def who_only_looks_changes_nothing(self, charts: float, which: int, keys: list[Control]) -> None:
        self.let_go(1)
        before = list(self.window.stage.session.inputs)
        if not self.window.shelf.picker:
            for control in keys:
                self.window.do(control)
            self.drag("charts", 0, charts, 0.5, 0, 1)
            self.let_go(1)
        self.move("ball", which, 0.5, 0.5)
        self.send(pygame.WINDOWFOCUSLOST)
        self.wait(1 / 60, 3)
        assert self.window.stage.session.inputs == before

    @rule()
    def what_is_undone_is_done_again_as_it_was(self) -> None:
        session = self.window.stage.session
        self.let_go(1)
        self.window.player.seek(session.end)
        before = list(session.inputs)
        if session.undo():
            assert len(session.inputs) < len(before)
            assert session.redo()
        assert session.inputs == before
        self.window.player.settle()

    @invariant()
    def all_is_somewhere_and_can_be_drawn(self) -> None:
        self.window.frame(0.0)
        for state in self.window.stage.moment.states.values():
            assert np.isfinite([state.position, state.velocity]).all()

    @invariant()
    def nothing_is_held_while_the_button_is_up(self) -> None:
        if 1 not in self.down:
            assert (self.window.holds, self.window.scrubs, self.window.toolbar.held) == (False, False, None)


def test_whatever_is_done_to_the_window_the_run_equals_its_replay() -> None:
    run_state_machine_as_test(
        Monkey,
        settings=settings(
            max_examples=settings().max_examples // 12,
            deadline=None,
            suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.filter_too_much],
        ),
    )
