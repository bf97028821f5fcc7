"""Signals as exceptions, so that a terminated command cleans up first; and sections in which a signal must wait."""

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Final

from sandbox.errors import Terminated

_of_thread = threading.local()
SIGNALS: Final = (signal.SIGINT, signal.SIGTERM, *((signal.SIGHUP,) if sys.platform != "win32" else ()))
RETRY: Final = 0.01  # s after which a signal is raised again


@contextmanager
def signals_as_exceptions() -> Iterator[None]:
    """Raise Terminated at a signal, except for those that are ignored, as under nohup, or not handled by Python.

    C ignores an exception in a callback, as in those of `Space.debug_draw`. What is lost so is raised again.
    """
    handlers = {each: signal.getsignal(each) for each in SIGNALS}
    before = {each: handler for each, handler in handlers.items() if handler not in (signal.SIG_IGN, None)}
    is_active = True

    def terminate(number: int, _frame: FrameType | None) -> None:
        signal.signal(number, signal.SIG_DFL)  # a second signal ends the program at once
        raise Terminated(number, when_lost)

    def when_lost(number: int) -> None:
        if is_active:
            signal.signal(number, terminate)
            threading.Timer(RETRY, raise_again, [number]).start()  # after the callback, or in another one

    def raise_again(number: int) -> None:
        if is_active:
            signal.raise_signal(number)

    for each in before:
        signal.signal(each, terminate)
    try:
        yield
    finally:
        is_active = False
        for each, handler in before.items():
            signal.signal(each, handler)


@contextmanager
def signals_deferred() -> Iterator[None]:
    """Defer every signal handler in Python until the end of a section that must not be left half done."""
    if threading.current_thread() is not threading.main_thread():  # which alone runs handlers
        yield
        return
    arrived, defers = list[int](), True

    def defer(number: int, frame: FrameType | None) -> None:
        if defers:
            arrived.append(number)
        else:  # while they are restored below
            handlers[number](number, frame)

    handlers = {int(each): handler for each in signal.valid_signals() if callable(handler := signal.getsignal(each))}
    try:
        for each in handlers:
            signal.signal(each, defer)
        yield
    finally:
        defers = False
        for each, handler in handlers.items():
            signal.signal(each, handler)
        for number in arrived:
            signal.raise_signal(number)


@contextmanager
def sigint_blocked() -> Iterator[None]:
    """Block SIGINT in processes started here, even while they import: their parent handles Ctrl-C and stops them."""
    if sys.platform == "win32":
        yield
        return
    from multiprocessing import resource_tracker  # noqa: PLC0415  # most commands start no process

    resource_tracker.ensure_running()  # the start of a process would start it, which unblocks SIGINT
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class Abandoned(BaseException):
    """Ends what a thread does, as nobody waits for it any longer."""


def abandon_at(event: threading.Event) -> None:
    """From now on, let `checkpoint` in this thread end what it does once an event is set."""
    _of_thread.abandoned = event


def checkpoint() -> None:
    """Raise Abandoned if what this thread does is to end. Long computations call it ten times a second or more."""
    event: threading.Event | None = getattr(_of_thread, "abandoned", None)
    if event and event.is_set():
        raise Abandoned
