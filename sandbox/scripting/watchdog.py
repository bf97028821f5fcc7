"""Ends a program on trial that does not end by itself: a step that never returns, no more steps, SIGTERM.

A thread of its own sees that also while the main thread is within Chipmunk, where Python handles no signal.
"""

import os
import select
import signal
import socket
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from sandbox.space.origins import program_line
from sandbox.space.watch import Trials, interrupt_main_thread
from sandbox.text import printable

MAX_STEP: Final = 5.0  # s, for a step to return
MIN_PAUSE: Final = 5.0  # s without a step, even if --seconds is less
GRACE: Final = 3.0  # s, for a program to end
LOOK: Final = 0.25  # s, between looks
_SLEEPING: Final = (
    "A force, impulse or velocity that wakes a sleeping body within a collision callback makes Chipmunk loop for ever: "
    "set it in space.add_post_step_callback(...)."
)


@contextmanager
def watchdog(program: str, trials: Trials) -> Iterator[None]:
    """Watch the steps and the signals of a program, within a `with` block of the main thread."""
    done, main, (here, there) = threading.Event(), threading.get_ident(), socket.socketpair()
    there.setblocking(False)
    before = signal.set_wakeup_fd(there.fileno(), warn_on_full_buffer=False)
    thread = threading.Thread(target=_look, args=(program, trials, main, here, done), daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        signal.set_wakeup_fd(before)
        thread.join()
        here.close()
        there.close()


def _look(program: str, trials: Trials, main: int, signals: socket.socket, done: threading.Event) -> None:
    until = None  # when a program that SIGTERM should end is killed
    interrupted = 0.0
    while not done.is_set():
        if select.select([signals], [], [], LOOK)[0] and signal.SIGTERM in signals.recv(64):
            until = time.monotonic() + GRACE
        now = time.monotonic()
        if until and now > until and not trials.ended:
            os._exit(128 + signal.SIGTERM)
        if trials.ended:
            continue
        if trials.stepping and now - trials.since > MAX_STEP:
            trial, frame = trials.stepping, sys._current_frames().get(trials.thread or main)
            print(
                f"{printable(program)}: step {trial.steps + 1} of its Space does not return. It is in "
                f"{printable(program_line(frame))}. {_SLEEPING}",
                file=sys.stderr,
                flush=True,
            )
            os._exit(2)
        if not trials.stepping and now - trials.since > max(trials.seconds, MIN_PAUSE):
            trials.out_of_time = True
            if not interrupted:
                interrupted = now
                interrupt_main_thread()
            elif now - interrupted > GRACE:
                trials.finish()
