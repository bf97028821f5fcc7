"""A monkey test of the window, on a screen in memory: whatever the input, the run equals its replay.

`pytest -m slow tests/slow/test_monkey.py` goes on for ten minutes of the window's time with each of three seeds.
"""

from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np
import pygame
import pytest
from hypothesis import HealthCheck, seed, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule, run_state_machine_as_test
from pygame._sdl2.video import Window as SystemWindow
from pygame.event import Event
from window_driver import key_event

from sandbox.report.trajectory import simulate
from sandbox.run.inputs import End, Start, load_inputs, write_inputs
from sandbox.scene.files import load
from sandbox.view.controls import Action, Panel
from sandbox.view.layout import MIN_SIZE
from sandbox.view.window import Window

SCENES: Final = ("article", "bouncing", "newtons-cradle", "oblique", "head-on", "funnel", "break-shot", "mine.toml")
SECONDS: Final = 600.0  # of the window's time, with each seed of a long run
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
    "binary.toml": bytes(range(256)),
    "huge.toml": b"#" * 2_500_000,
}
CODES: Final = sorted({getattr(pygame, name) for name in dir(pygame) if name.startswith("K_")})
LOOKING = (Action.GO_TO_START, Action.STEP_BACK, Action.PAUSE, Action.STEP, Action.GO_TO_END)
fractions = st.floats(0, 1)
numbers = st.integers(0, 60)
buttons = st.sampled_from([1, 1, 1, 1, 2, 3, 6, 7])
places = st.sampled_from(["ball", "wall", "widget", "panel", "charts", "bar", "pane", "anywhere"])
texts = st.one_of(st.just(""), st.characters(), st.text(max_size=3))
sides = st.integers(1, 2000)
values = st.sampled_from(["0", "1", "-3", "25.5", "400", "1e300", "nan", "red", "blurple", ""])  # typed into a field


class Monkey(RuleBasedStateMachine):
    """Actions of a user, a desktop and an editor on a window. Time passes in steps, never by the clock."""

    window: Window
    passed = 0.0  # s of the window's time, in all runs

    def __init__(self) -> None:
        super().__init__()
        self.patch = pytest.MonkeyPatch()
        self.folder = TemporaryDirectory()
        self.patch.chdir(self.folder.name)
        self.patch.setenv("SDL_VIDEODRIVER", "dummy")
        self.patch.setattr("sandbox.view.notice.Notice.strict", True)  # what fails in the drawing fails the test
        self.patch.setattr("sandbox.view.playback.FRAME_BUDGET", -1.0)  # one step per frame, on any machine
        self.patch.setattr("sandbox.view.playback.MAX_WAIT", 1e6)  # as the clock decides nothing
        for name, text in FILES.items():
            Path(name).write_bytes(text)
        self.down: set[int] = set()  # buttons of the mouse
        self.at = (0, 0)

    @initialize(scene=st.sampled_from(SCENES), engines=st.sampled_from(ENGINES), short_history=st.booleans())
    def open(self, scene: str, engines: list[str] | None, short_history: bool) -> None:
        if short_history:
            self.patch.setattr("sandbox.session.history.MAX_RECENT", 8)
            self.patch.setattr("sandbox.session.history.MAX_BYTES_KEPT", 50_000)
        self.window = Window(load(scene), engines)

    def teardown(self) -> None:
        self.window.recorder.stop()
        self.window.why.case.stop()
        self.the_run_equals_the_replay_of_its_recording()
        pygame.display.quit()
        self.patch.undo()
        self.folder.cleanup()

    def send(self, kind: int, **what: Any) -> None:
        self.window.on_event(Event(kind, what))
        self.window.running = True  # even after an event that quits

    # Actions

    @rule(seconds=st.sampled_from([0.0, 1 / 60, 0.5]), frames=st.integers(1, 40))
    def wait(self, seconds: float, frames: int) -> None:
        for _ in range(frames):
            self.window.frame(seconds)
            Monkey.passed += seconds

    @rule(action=st.sampled_from(Action), times=st.integers(1, 3))
    def use(self, action: Action, times: int) -> None:
        for _ in range(times):
            event = key_event(action.value.key)
            self.key(event.key, event.unicode, event.mod)

    @rule(key=st.sampled_from(CODES), typed=texts, mod=st.sampled_from([0, pygame.KMOD_LSHIFT, pygame.KMOD_LCTRL]))
    def key(self, key: int, typed: str, mod: int) -> None:
        self.send(pygame.KEYDOWN, key=key, unicode=typed, mod=mod)
        self.send(pygame.KEYUP, key=key, unicode=typed, mod=mod)

    @rule(action=st.sampled_from(Action), frames=st.integers(1, 40))
    def hold(self, action: Action, frames: int) -> None:
        event = key_event(action.value.key)
        self.send(pygame.KEYDOWN, **event.dict)
        self.wait(1 / 30, frames)
        self.send(pygame.KEYUP, **event.dict)

    @rule(what=places, which=numbers, x=fractions, y=fractions)
    def move(self, what: str, which: int, x: float, y: float) -> None:
        window, layout = self.window, self.window.layout
        place = pygame.Rect((0, 0), layout.window).inflate(1000, 1000)
        if what == "widget":
            placed = window._placed
            _, place = placed[which % len(placed)]
        elif what == "panel":
            placed = window.panel.placed(layout.panel, layout.text_height)
            place = placed[which % len(placed)][1] if placed else layout.panel
        elif what == "charts":
            place = layout.strip
        elif what == "bar":
            place = layout.bar
        elif what != "anywhere":
            place = layout.arenas[which % len(window.view.panes)]
        if what == "ball":
            position = window.view.panes[which % len(window.view.panes)].state.position
            bx, by = layout.to_screen(which % len(window.view.panes), position[which % len(position)].tolist())
            place = pygame.Rect(round(bx), round(by), 1, 1).inflate(10, 10)
        if what == "wall" and (walls := window.view.moment.scene.walls):
            wx, wy = layout.to_screen(0, walls[which % len(walls)].to)
            place = pygame.Rect(round(wx), round(wy), 1, 1).inflate(10, 10)
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

    @rule(what=places, which=numbers, x=fractions, y=fractions, moves=st.integers(0, 4), frames=st.integers(1, 5))
    def drag(self, what: str, which: int, x: float, y: float, moves: int, frames: int) -> None:
        """Drag from a place across panes, and keep the button down."""
        self.move(what, which, x, y)
        self.press(1)
        for k in range(moves):
            self.move("pane", which + k, y, x)
            self.wait(1 / 60, frames)

    @rule(which=numbers, x=fractions, y=fractions, back=fractions)
    def throw_and_go_back(self, which: int, x: float, y: float, back: float) -> None:
        """Throw a ball, let it fly, and seek a time, which may be during the throw."""
        self.window.scenes.close_picker()
        self.window.playback.paused = False
        self.drag("ball", which, x, y, 4, 5)
        self.let_go(1)
        self.wait(1 / 60, 10)
        self.window.playback.seek(round(back * self.window.view.session.end))

    @rule(tool=st.integers(0, 4), what=places, which=numbers, x=fractions, y=fractions, value=values)
    def inspect(self, tool: int, what: str, which: int, x: float, y: float, value: str) -> None:
        """Drag with a tool of the inspector, then type a value into a field of what that selected."""
        window = self.window
        window.scenes.close_picker()
        window.playback.paused, window.panel.open, window.mouse.tool = True, Panel.BALLS, window.mouse.tools[tool]
        self.drag(what, which, x, y, 2, 1)
        self.let_go(1)
        self.move("panel", which, 0.5, 0.5)
        self.press(1)
        for letter in value:
            self.key(0, letter, 0)
        self.key(pygame.K_RETURN, "\r", 0)
        self.let_go(1)

    @rule(y=st.integers(-3, 3))
    def turn_the_wheel(self, y: int) -> None:
        self.send(pygame.MOUSEWHEEL, x=0, y=y, flipped=False)
        for kind in (pygame.MOUSEBUTTONDOWN, pygame.MOUSEBUTTONUP):
            self.send(kind, pos=self.at, button=4 if y > 0 else 5)

    @rule()
    def lose_focus(self) -> None:
        self.down.clear()  # a release elsewhere sends no event
        self.send(pygame.WINDOWFOCUSLOST)

    @rule(size=st.one_of(st.tuples(sides, sides), st.sampled_from([(1, 1), (5000, 20), (20, 3000)])))
    def resize(self, size: tuple[int, int]) -> None:
        SystemWindow.from_display_module().size = size
        for event in pygame.event.get():
            self.window.on_event(event)
        assert self.window.screen.get_size() == tuple(map(max, size, MIN_SIZE))

    @rule(name=st.sampled_from([*FILES, "missing.toml", "", "."]))
    def drop(self, name: str) -> None:
        self.send(pygame.DROPFILE, file=str(Path(name).resolve()))

    @rule(name=st.sampled_from(list(FILES)), text=st.sampled_from([MINE, MINE.replace("20", "15"), "broken", None]))
    def edit_a_file(self, name: str, text: str | None) -> None:
        Path(name).unlink(missing_ok=True)
        if text is not None:
            Path(name).write_text(text)
        self.window.scenes._next_check = 0.0
        self.window.scenes.reload_if_edited()

    @rule(words=st.sampled_from(["mine", "cradle", "zzz", ""]))
    def pick(self, words: str) -> None:
        for letter in ("/", *words):
            self.key(0, letter, 0)
        self.window.frame(1 / 60)
        self.key(pygame.K_RETURN, "\r", 0)

    # Properties

    @rule()
    def the_run_equals_the_replay_of_its_recording(self) -> None:
        window, session = self.window, self.window.view.session
        window.playback.settle()
        start = Start(scene=window.scene.name, seed=window.scene.seed, rate=window.scene.rate)
        write_inputs([start, *session.given(), End(step=session.step)], Path("inputs.jsonl"))
        inputs = load_inputs(Path("inputs.jsonl"), window.scene)
        assert window.view.moment.step == session.step
        for name, state in window.view.moment.states.items():
            replay = simulate(window.scene, name, steps=session.step, inputs=inputs)
            assert replay.position[-1, window.view.moment.balls].tobytes() == state.position.tobytes()
            assert replay.velocity[-1, window.view.moment.balls].tobytes() == state.velocity.tobytes()

    @rule(charts=fractions, which=numbers, keys=st.lists(st.sampled_from(LOOKING)))
    def looking_records_no_inputs(self, charts: float, which: int, keys: list[Action]) -> None:
        self.let_go(1)
        before = list(self.window.view.session.inputs)
        if not self.window.scenes.picker:
            for action in keys:
                self.window.do(action)
            self.drag("charts", 0, charts, 0.5, 0, 1)
            self.let_go(1)
        self.move("ball", which, 0.5, 0.5)
        self.send(pygame.WINDOWFOCUSLOST)
        self.wait(1 / 60, 3)
        assert self.window.view.session.inputs == before

    @rule()
    def redo_restores_what_undo_removed(self) -> None:
        session = self.window.view.session
        self.let_go(1)
        self.window.playback.seek(session.end)
        before = list(session.inputs)
        if session.undo():
            assert session.inputs != before
            assert session.redo()
        assert session.inputs == before
        self.window.playback.settle()

    @invariant()
    def every_state_is_finite_and_can_be_drawn(self) -> None:
        self.window.frame(0.0)
        for state in self.window.view.moment.states.values():
            assert np.isfinite([state.position, state.velocity]).all()

    @invariant()
    def nothing_is_held_while_the_button_is_up(self) -> None:
        if 1 not in self.down:
            assert (self.window.mouse.holds, self.window.widgets.held) == (False, None)


def watch(monkey: type[Monkey], examples: int) -> None:
    run_state_machine_as_test(
        monkey,
        settings=settings(
            max_examples=examples,
            suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.filter_too_much],
        ),
    )


@pytest.mark.wide
def test_whatever_the_input_the_run_equals_its_replay() -> None:
    watch(Monkey, 3)


@pytest.mark.slow
@pytest.mark.parametrize("number", range(3))
def test_ten_minutes_of_any_input_end_in_no_exception(number: int) -> None:
    Monkey.passed = 0.0
    for start in count(1000 * number):
        watch(seed(start)(Monkey), 20)
        if Monkey.passed >= SECONDS:
            break
