"""How a command ends: at a mistake, a signal, a pipe that nobody reads. What it has begun is undone first."""

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Final

from sandbox.errors import Ended

SIGNALS: Final = (signal.SIGINT, signal.SIGTERM, *((signal.SIGHUP,) if sys.platform != "win32" else ()))
SOON: Final = 0.001  # s

_holding: Final[list[None]] = []  # one for each `held` that one is in
_waiting: Final[list[int]] = []  # signals that came there


@contextmanager
def _signals() -> Iterator[None]:
    """Raise Ended at a signal, but for those that are ignored, as nohup has it, or that are not Python's to handle."""
    handlers = {each: signal.getsignal(each) for each in SIGNALS}
    before = {each: handler for each, handler in handlers.items() if handler not in (signal.SIG_IGN, None)}
    hook = sys.unraisablehook
    for each in before:
        signal.signal(each, _end)
    sys.unraisablehook = _raise_again
    try:
        yield
    finally:
        sys.unraisablehook = hook
        for each, handler in before.items():
            signal.signal(each, handler)


@contextmanager
def held() -> Iterator[None]:
    """Let a signal wait until something is done that must not be done by half."""
    _holding.append(None)
    try:
        yield
    finally:
        _holding.pop()
        if _waiting and not _holding:
            _end(_waiting.pop())


def _end(number: int, _frame: FrameType | None = None) -> None:
    if _holding:
        _waiting.append(number)
        return
    signal.signal(number, signal.SIG_DFL)  # who asks twice does not want to wait
    raise Ended(number)


def _raise_again(lost: "sys.UnraisableHookArgs") -> None:
    """Raise again, a little later, what was raised where nothing can be: in what C calls back, or as an object goes."""
    end = lost.exc_value
    if sys.platform == "win32" or not isinstance(end, Ended):  # Windows has no such timer
        sys.__unraisablehook__(lost)
        return
    number = end.number
    signal.signal(signal.SIGALRM, lambda *_: _end(number))
    signal.setitimer(signal.ITIMER_REAL, SOON)
