"""Ends a program on trial that does not end by itself: a step that never returns, or no more steps.

A thread of its own sees that also while the main thread is within Chipmunk.
"""

import os
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from sandbox.space.origins import program_line
from sandbox.space.watch import Trials
from sandbox.text import printable

MAX_STEP: Final = 5.0  # s, for a step to return
MIN_PAUSE: Final = 5.0  # s without a step, even if --seconds is less
LOOK: Final = 0.25  # s, between looks
_SLEEPING: Final = (
    "A force, impulse or velocity that wakes a sleeping body within a collision callback makes Chipmunk loop for ever: "
    "set it in space.add_post_step_callback(...)."
)


@contextmanager
def watchdog(program: str, trials: Trials) -> Iterator[None]:
    """Watch the steps of a program, within a `with` block."""
    done = threading.Event()
    thread = threading.Thread(target=_look, args=(program, trials, done), daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


def _look(program: str, trials: Trials, done: threading.Event) -> None:
    while not done.wait(LOOK):
        trial, lasts = trials.stepping, time.monotonic() - trials.since
        if trial and lasts > MAX_STEP:
            line = printable(program_line(sys._current_frames().get(trials.thread)))
            stuck = f"{printable(program)}: step {trial.steps + 1} of its Space does not return. It is in {line}."
            print(stuck, _SLEEPING, file=sys.stderr, flush=True)
            os._exit(2)
        patience = MIN_PAUSE if trials.out_of_time else max(trials.seconds, MIN_PAUSE)
        if not trial and not trials.ended and lasts > patience:
            (trials.finish if trials.out_of_time else trials.interrupt)()
