"""A process of our own, which answers through a pipe."""

import multiprocessing
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from types import ModuleType
from typing import Any


class ChildProcess:
    """A process that answers one message after another, until it is stopped or this process ends.

    target: what it calls, with the other end of the connection and the arguments; see `serve`. It is a function of a
    module that can be imported, as the process does not run the main program: that may be one on trial.
    """

    def __init__(self, target: Callable[..., None], *arguments: object) -> None:
        context = multiprocessing.get_context("spawn")  # a forked process would share the locks of running threads
        self.connection, remote = context.Pipe()
        self._process = context.Process(target=target, args=(remote, *arguments), daemon=True)
        if sys.platform != "win32":
            from multiprocessing import resource_tracker  # noqa: PLC0415  # most commands start no process

            resource_tracker.ensure_running()  # the start of a process would start it, which unblocks SIGINT
        main = sys.modules["__main__"]
        sys.modules["__main__"] = ModuleType("__main__")  # empty, as the process imports it
        try:
            with signals_blocked(signal.SIGINT):  # there too, also while it imports: its parent handles Ctrl-C
                self._process.start()
        finally:
            sys.modules["__main__"] = main
        remote.close()

    def send(self, message: object) -> None:
        """Send a message. If the process has died, `receive` notices."""
        with suppress(OSError):
            self.connection.send(message)

    def receive(self) -> Any:
        """Return its next answer. Raises EOFError if it has died, and stops it."""
        try:
            return self.connection.recv()
        except (EOFError, OSError) as error:
            self.stop()
            raise EOFError from error

    def stop(self) -> None:
        """Terminate it."""
        self.connection.close()
        self._process.terminate()
        self._process.join()


@contextmanager
def signals_blocked(*signals: signal.Signals) -> Iterator[None]:
    """Delay signals until the end of a block. Processes started in it keep them blocked, except on Windows.

    A handler must not run in a function that C calls, as the exception that it raises is printed there, and lost.
    A signal that another thread takes, such as one of numpy's, is handled by the main thread, though that blocks it.
    """
    arrived: list[int] = []
    handled = signals if threading.current_thread() is threading.main_thread() else ()
    handlers = [signal.signal(each, lambda number, _: arrived.append(number)) for each in handled]
    if sys.platform != "win32":
        before = signal.pthread_sigmask(signal.SIG_BLOCK, signals)
    try:
        yield
    finally:
        if sys.platform != "win32":
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        for each, handler in zip(handled, handlers, strict=True):
            signal.signal(each, handler)
        for number in arrived:
            signal.raise_signal(number)


def serve(connection: "Connection[Any, Any]", answer: Callable[[Any], object]) -> None:
    """Answer each message, until the other end of the connection is closed."""
    with suppress(EOFError, OSError):
        while True:
            connection.send(answer(connection.recv()))
