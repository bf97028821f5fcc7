"""A program without a window, and without waiting: dummy drivers, and clocks that let it run through."""

import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from typing import Any, Final
from unittest.mock import patch

_DRIVERS: Final = {"SDL_VIDEODRIVER": "dummy", "SDL_AUDIODRIVER": "dummy", "PYGLET_HEADLESS": "1", "MPLBACKEND": "agg"}
DEFAULT_FRAMERATE: Final = 60  # 1/s, of a clock that is asked for none


class Clock:
    """A `pygame.time.Clock` that does not wait: each frame takes what it should. wait: counts that time, s."""

    def __init__(self, wait: Callable[[float], None]) -> None:
        self._wait = wait
        self._milliseconds, self._left_over = 0, 0.0

    def tick(self, framerate: float = 0) -> int:
        """Return the time of a frame, ms, in whole ones that add up to the right time."""
        frame = 1 / (framerate or DEFAULT_FRAMERATE)
        exact = 1000 * frame + self._left_over
        self._milliseconds = int(exact)
        self._left_over = exact - self._milliseconds
        self._wait(frame)
        return self._milliseconds

    tick_busy_loop = tick

    def get_time(self) -> int:
        """Return the time of the last frame, ms."""
        return self._milliseconds

    get_rawtime = get_time

    def get_fps(self) -> float:
        """Return frames per second."""
        return 1000 / self._milliseconds if self._milliseconds else 0.0


@contextmanager
def without_window(wait: Callable[[float], None]) -> Iterator[None]:
    """Give programs no window, and let waiting functions return at once, unless they have threads.

    wait: is called with the time before, s.
    """
    sleep, threads = time.sleep, threading.active_count()

    def pause(seconds: float) -> None:
        wait(seconds)
        has_threads = threading.active_count() > threads
        sleep(seconds if has_threads else 0)  # what other threads do in that time takes it

    def pause_milliseconds(milliseconds: int) -> int:
        pause(milliseconds / 1000)
        return milliseconds

    with ExitStack() as stack:
        stack.enter_context(patch.dict(os.environ, _DRIVERS))
        stack.enter_context(patch("time.sleep", pause))
        try:
            import pygame  # noqa: PLC0415  (slow to import)
        except ImportError:
            pass
        else:
            replaced: dict[str, Any] = {
                "Clock": partial(Clock, pause),
                "wait": pause_milliseconds,
                "delay": pause_milliseconds,
            }
            for name, substitute in replaced.items():
                stack.enter_context(patch.object(pygame.time, name, substitute))
        yield
