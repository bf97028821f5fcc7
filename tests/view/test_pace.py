"""The status line shows how fast time really passes, by a clock that the tests move."""

import math
from itertools import pairwise

import pytest
from window_driver import press

from sandbox.view.playback import Pace
from sandbox.view.window import Window

pytestmark = pytest.mark.usefixtures("memory_screen")


class Clock:
    """A clock of a machine whose frames take a given time, s."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def play(window: Window, clock: Clock, frames: int, seconds: float, share: float = 1.0) -> list[str]:
    """Show frames that last some seconds each, in a share of which time passes; return the pace in each."""
    shown = []
    for _ in range(frames):
        clock.now += seconds
        window.playback.advance(share * seconds)
        shown.append(window.status.split("    ")[1])
    return shown


@pytest.fixture
def clock(window: Window, monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr("sandbox.view.playback.FRAME_BUDGET", math.inf)  # which the machine's own clock measures
    window.playback.pace = Pace(clock)
    return clock


def test_a_slow_machine_shows_the_speed_reached_after_a_second(window: Window, clock: Clock) -> None:
    shown = play(window, clock, 100, 0.1, share=0.43)
    assert set(shown[:10]) == {"1\N{MULTIPLICATION SIGN}"}
    assert set(shown[12:]) == {"1\N{MULTIPLICATION SIGN} (0.43\N{MULTIPLICATION SIGN})"}


def test_slow_motion_is_not_mistaken_for_a_slow_machine(window: Window, clock: Clock) -> None:
    window.playback.set_speed(0.01)
    assert set(play(window, clock, 600, 1 / 60)) == {"0.01\N{MULTIPLICATION SIGN}"}


def test_the_fastest_speed_shows_what_is_reached(window: Window, clock: Clock, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sandbox.view.playback.FRAME_BUDGET", -1.0)  # one step a frame
    window.playback.set_speed(math.inf)
    assert play(window, clock, 100, 1 / 240)[0] == "fastest"
    assert play(window, clock, 300, 1 / 240)[-1] == "fastest (4\N{MULTIPLICATION SIGN})"


@pytest.mark.parametrize("interrupt", ["pp", "Home", "+", "r"])
def test_a_pause_or_a_jump_is_not_slow(window: Window, clock: Clock, interrupt: str) -> None:
    play(window, clock, 100, 1 / 60)
    for key in [interrupt] if interrupt in ("Home", "+", "r") else interrupt:
        clock.now += 5.0
        press(window, key)
    assert not any("(" in text for text in play(window, clock, 100, 1 / 60))


def test_the_number_changes_no_more_than_once_a_second(window: Window, clock: Clock) -> None:
    shown = [text for k in range(200) for text in play(window, clock, 1, 0.05, share=(k % 7) / 7)]
    assert sum(a != b for a, b in pairwise(shown)) <= 10
