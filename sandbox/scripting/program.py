"""A program run as `python game.py arguments` would, with every Space that it steps on trial.

Without a window, it does not wait either: it gets dummy drivers, and clocks that let it run through.
"""

import os
import re
import runpy
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import FrameType, ModuleType
from typing import Any, Final, NoReturn
from unittest.mock import patch

from sandbox.errors import SandboxError
from sandbox.scripting.watchdog import watchdog
from sandbox.space.changes import CALLS, NAMES
from sandbox.space.origins import SANDBOX
from sandbox.space.watch import Trials

_DRIVERS: Final = {"SDL_VIDEODRIVER": "dummy", "SDL_AUDIODRIVER": "dummy", "PYGLET_HEADLESS": "1", "MPLBACKEND": "agg"}
DEFAULT_FRAMERATE: Final = 60  # 1/s, of a clock that is asked for none
SAFE_PATH: Final = "PYTHONSAFEPATH"  # for the sandbox's own processes, not for those of a program


@dataclass(frozen=True)
class Program:
    """A program: the path of a file, or the name of a module, and its arguments."""

    name: str
    arguments: Sequence[str] = ()
    is_module: bool = False

    def check(self) -> None:
        """Raise SandboxError if there is no such file."""
        path = Path(self.name)
        if self.is_module:
            return
        if path.suffix == ".toml":
            raise SandboxError(f"{self.name}: is a scene, not a program; sandbox compare {self.name} compares engines")
        if not path.exists():
            raise SandboxError(f"{self.name}: does not exist; for a module, write -m {path.stem}")
        if path.is_dir() and not (path / "__main__.py").exists():
            raise SandboxError(f"{self.name}: is a folder without __main__.py")

    def run(self) -> None:
        """Run it as `__main__`."""
        path = str(Path.cwd()) if self.is_module else str(Path(self.name).resolve().parent)
        with patch.object(sys, "argv", [self.name, *self.arguments]), patch.object(sys, "path", [path, *sys.path]):
            if self.is_module:
                runpy.run_module(self.name, run_name="__main__", alter_sys=True)
            else:
                runpy.run_path(self.name, run_name="__main__")


@dataclass(frozen=True)
class End:
    """How a program ended. code: its exit code; details: its traceback or message; hint: what to do about that."""

    how: str
    code: int = 0
    details: str = ""
    hint: str = ""


def run_on_trial(program: Program, trials: Trials, ended: Callable[[End], int], *, headless: bool = False) -> int:
    """Run a program with its Spaces on trial; return the exit code that `ended` returns.

    ended: is called once, and returns the exit code.
    """

    def finish() -> NoReturn:
        trials.end()
        code = ended(End("time is up"))
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        os._exit(code)

    program.check()
    trials.finish = finish
    environment = {key: value for key, value in os.environ.items() if key != SAFE_PATH}
    with ExitStack() as stack:
        stack.enter_context(trials)
        stack.enter_context(_signals())
        stack.enter_context(watchdog(program.name, trials))
        stack.enter_context(patch.dict(os.environ, environment, clear=True))
        if headless:
            stack.enter_context(without_window(trials.wait))
        end = _end_of(program, trials)
    return ended(end)


def _end_of(program: Program, trials: Trials) -> End:
    threads = set(threading.enumerate())
    try:
        try:
            program.run()
        finally:
            if not trials.out_of_time:
                _join(threads)
    except KeyboardInterrupt:
        return End("time is up" if trials.out_of_time else "interrupted")
    except SystemExit as error:
        if error.code is None or isinstance(error.code, int):
            return End("exit", (error.code or 0) & 0xFF)
        return End("exit", 1, f"{error.code}\n")
    except SandboxError:
        raise
    except BaseException as error:
        trace = _traceback_of(error)
        if not any(link.stack for link in _linked(trace)):
            raise SandboxError(f"{program.name}: cannot be run: {_why(error)}") from error
        return End("exception", 1, "".join(trace.format()), hint(error))
    return End("time is up" if trials.out_of_time else "end")


def _traceback_of(error: BaseException) -> traceback.TracebackException:
    """Return the traceback that the program would have without the sandbox."""
    whole = traceback.TracebackException.from_exception(error)
    for link in _linked(whole):
        frames = [frame for frame in link.stack if not frame.filename.startswith((SANDBOX, runpy.__file__, "<frozen"))]
        link.stack = traceback.StackSummary.from_list(frames)
    return whole


def _linked(trace: traceback.TracebackException) -> Iterator[traceback.TracebackException]:
    """Yield a traceback and those of its causes."""
    link: traceback.TracebackException | None = trace
    while link:
        yield link
        link = link.__cause__ or link.__context__


def _why(error: BaseException) -> str:
    """Say why no line of a program was run."""
    if isinstance(error, SyntaxError):
        return f"{error.msg}, in line {error.lineno}" if error.lineno else error.msg
    return (error.strerror if isinstance(error, OSError) else None) or str(error)


def _join(before: set[threading.Thread]) -> None:
    """Wait for threads that the program began, as Python does at its end."""
    for thread in threading.enumerate():
        if thread not in before and not thread.daemon:
            thread.join()


@contextmanager
def _signals() -> Iterator[None]:
    """Let Ctrl-C raise KeyboardInterrupt, as in any program, and SIGTERM exit; a second one kills."""

    def leave(number: int, _frame: FrameType | None) -> NoReturn:
        signal.signal(number, signal.SIG_DFL)
        sys.exit(128 + number)

    before = {
        number: signal.signal(number, handler)
        for number, handler in ((signal.SIGINT, signal.default_int_handler), (signal.SIGTERM, leave))
    }
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


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


def hint(error: BaseException) -> str:
    """Return what to do about an exception of a program; empty if it is not one that the sandbox knows."""
    return _of_pymunk(error) or _display(error)


def _of_pymunk(error: BaseException) -> str:
    for name in _missing_names(error):
        if change := NAMES.get(name):
            return f"Pymunk has had no {name} since version {change.since}. Instead: {change.instead}."
    text = f"{_file(error)}: {error}"
    for call, change in CALLS.items():
        if re.search(change.pattern, text):
            return f"An error since version {change.since} of Pymunk: {call}. Instead: {change.instead}."
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


def _file(error: BaseException) -> str:
    """Return the folder and the file that raised an exception, or nothing if it was not raised."""
    last = error.__traceback__
    while last and last.tb_next:
        last = last.tb_next
    return "/".join(Path(last.tb_frame.f_code.co_filename).parts[-2:]) if last else ""


def _display(error: BaseException) -> str:
    kind = type(error)
    without_video = kind.__module__.startswith("pygame") and re.search("video|(x11|wayland) not available", str(error))
    if without_video or kind.__name__ in ("NoSuchDisplayException", "NoSuchConfigException"):
        return "There is no display: sandbox watch --headless runs the program without a window."
    return ""
