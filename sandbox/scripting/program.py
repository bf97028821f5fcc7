"""A program run as `python game.py arguments` would, with every Space that it steps on trial.

Without a window, it does not wait either: it gets dummy drivers, and clocks that let it run through.
"""

import math
import os
import re
import runpy
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any, Final, NoReturn
from unittest.mock import patch

from sandbox.errors import SandboxError
from sandbox.scripting.watchdog import watchdog
from sandbox.space.findings import CHANGES
from sandbox.space.origins import SANDBOX, is_program
from sandbox.space.watch import Trials

NAMES, CALLS = CHANGES["names"], CHANGES["calls"]
_DRIVERS: Final = {"SDL_VIDEODRIVER": "dummy", "SDL_AUDIODRIVER": "dummy", "PYGLET_HEADLESS": "1", "MPLBACKEND": "agg"}
DEFAULT_FRAMERATE: Final = 60  # 1/s, of a clock that is asked for none


@dataclass(frozen=True)
class End:
    """How a program ended. code: its exit code; details: its traceback or message; hint: what to do about that."""

    how: str
    code: int = 0
    details: str = ""
    hint: str = ""


def run_on_trial(program: Sequence[str], trials: Trials, ended: Callable[[End], int], *, headless: bool = False) -> int:
    """Run a program with its Spaces on trial; return the exit code that `ended` returns.

    program: the path of its file, and its arguments; ended: is called once, and returns the exit code.
    Raises SandboxError if none of its lines can be run.
    """
    threads = set(threading.enumerate())

    def finish(end: End = End("time is up")) -> NoReturn:
        trials.ended = True
        os._exit(ended(end))

    name = program[0]
    if Path(name).suffix == ".toml":
        raise SandboxError(f"{name}: is a scene, not a program; sandbox compare {name} compares engines")
    if not Path(name).exists():
        raise SandboxError(f"{name}: does not exist")
    trials.finish = finish

    def terminate(number: int, _: object) -> NoReturn:
        trials.out_of_time = True  # also if the program goes on
        sys.exit(128 + number)

    with ExitStack() as stack:
        stack.enter_context(trials.recorded())
        handlers = {signal.SIGINT: signal.default_int_handler, signal.SIGTERM: terminate}
        for number, handler in handlers.items():
            stack.callback(signal.signal, number, signal.signal(number, handler))
        stack.enter_context(watchdog(name, trials))
        stack.enter_context(patch.dict(os.environ))
        os.environ.pop("PYTHONSAFEPATH", None)  # for the sandbox's own processes, not for those of a program
        if headless:
            stack.enter_context(without_window(trials))
        end = _end_of(program, trials)
    if trials.out_of_time and any(not thread.daemon for thread in {*threading.enumerate()} - threads):
        finish(end)  # Python would wait for its threads
    return ended(end)


def _end_of(program: Sequence[str], trials: Trials) -> End:
    """Run a program as `__main__`, and wait for its threads, as Python does at the end; return how it ended."""
    threads, folder = set(threading.enumerate()), str(Path(program[0]).resolve().parent)
    try:
        try:
            with patch.object(sys, "argv", [*program]), patch.object(sys, "path", [folder, *sys.path]):
                runpy.run_path(program[0], run_name="__main__")
        finally:
            for thread in threading.enumerate():
                if thread not in threads and not thread.daemon:
                    thread.join()
    except KeyboardInterrupt:
        return End("time is up" if trials.out_of_time else "interrupted")
    except SystemExit as error:
        if error.code is None or isinstance(error.code, int):
            return End("exit", (error.code or 0) & 0xFF)
        return End("exit", 1, f"{error.code}\n")
    except BaseException as error:
        trace = traceback.TracebackException.from_exception(error)
        frames = [frame for frame in trace.stack if not frame.filename.startswith((SANDBOX, runpy.__file__, "<frozen"))]
        if not frames:
            raise SandboxError(f"{program[0]}: cannot be run: {error}") from error
        trace.stack = traceback.StackSummary.from_list(frames)
        return End("exception", 1, "".join(trace.format()), hint(error))
    return End("time is up" if trials.out_of_time else "end")


class Clock:
    """A `pygame.time.Clock` that does not wait: each frame takes what it should. wait: counts that time, s."""

    def __init__(self, wait: Callable[[float], None]) -> None:
        self._wait = wait
        self._milliseconds, self._left_over = 0, 0.0

    def tick(self, framerate: float = 0) -> int:
        """Return the time of a frame, ms, in whole ones that add up to the right time."""
        frame = 1 / (framerate or DEFAULT_FRAMERATE)
        self._left_over, milliseconds = math.modf(1000 * frame + self._left_over)
        self._milliseconds = int(milliseconds)
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
def without_window(trials: Trials) -> Iterator[None]:
    """Give programs no window, and let waiting functions return at once, of the thread that steps.

    Other threads wait as they would, and so does Python's library, such as for a process that has to end.
    """
    sleep_really, threads = time.sleep, threading.active_count()

    def sleep(seconds: float) -> None:
        is_alone = threading.active_count() == threads  # before the first step, any of several threads may do it
        steps_here = threading.get_ident() == trials.thread if trials.thread else is_alone
        if steps_here and is_program(sys._getframe(1).f_code.co_filename):
            trials.wait(seconds)
        else:
            sleep_really(seconds)

    def wait_milliseconds(milliseconds: int) -> int:
        trials.wait(milliseconds / 1000)
        return milliseconds

    with ExitStack() as stack:
        stack.enter_context(patch.dict(os.environ, _DRIVERS))
        stack.enter_context(patch("time.sleep", sleep))
        with suppress(ImportError):
            import pygame  # noqa: PLC0415  (slow to import)

            replaced: dict[str, Any] = {"wait": wait_milliseconds, "delay": wait_milliseconds}
            stack.enter_context(patch.multiple(pygame.time, Clock=partial(Clock, trials.wait), **replaced))
        yield


def hint(error: BaseException) -> str:
    """Return what to write instead of the old Pymunk name or call that raised the exception, or an empty string."""
    for name in _missing_names(error):
        if change := NAMES.get(name):
            return f"Pymunk has had no {name} since version {change['since']}. Instead: {change['instead']}."
    frames = traceback.extract_tb(error.__traceback__)
    text = f"{'/'.join(Path(frames[-1].filename).parts[-2:]) if frames else ''}: {error}"
    for call, change in CALLS.items():
        if re.search(change["pattern"], text):
            return f"An error since version {change['since']} of Pymunk: {call}. Instead: {change['instead']}."
    return ""


def _missing_names(error: BaseException) -> Iterator[str]:
    """Yield what a program missed in Pymunk: a name of a module, or of each class that an object is of."""
    if isinstance(error, ImportError) and error.name:
        missing = re.match(r"cannot import name '(\w+)'", error.msg)
        yield f"{error.name}.{missing[1]}" if missing else error.name
    elif isinstance(error, AttributeError) and isinstance(error.obj, ModuleType):
        yield f"{error.obj.__name__}.{error.name}"
    elif isinstance(error, AttributeError):
        kind = error.obj if isinstance(error.obj, type) else type(error.obj)
        yield from (f"{base.__name__}.{error.name}" for base in kind.__mro__ if base.__module__.startswith("pymunk."))
