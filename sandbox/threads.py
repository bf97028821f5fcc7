"""Threads beside the main one: what they do ends early if nobody waits for it any longer."""

import threading
from typing import Final

_of_thread: Final = threading.local()


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
