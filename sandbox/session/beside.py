"""An engine beside the loop: a thread computes its steps, and nothing waits for them.

The thread is given the same steps and inputs in the same order as the other engines, so its states are the same bytes
as in a lockstep with them. Its kernels release Python's global lock, so they run on another core.
"""

import weakref
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from threading import Event

from sandbox.run.inputs import Input
from sandbox.run.lockstep import Lockstep
from sandbox.session.parts import Part, PartReader
from sandbox.signals import abandon_at


class Beside:
    """A lockstep that a thread runs. Between `wait` and the next step, it stands still and can be read."""

    def __init__(self, lockstep: Lockstep) -> None:
        self.lockstep = lockstep
        self._reader = PartReader(lockstep)
        self._abandoned = Event()
        self._thread = ThreadPoolExecutor(1, "beside", initializer=abandon_at, initargs=(self._abandoned,))
        self._tasks: list[Future[None]] = []  # since the last part was asked for
        weakref.finalize(self, _stop, self._thread, self._abandoned)

    def step(self) -> None:
        """Have a step done."""
        self._tasks.append(self._thread.submit(self.lockstep.step))

    def apply(self, given: Input) -> None:
        """Have an input of the next step applied."""
        self._tasks.append(self._thread.submit(partial(self.lockstep.apply, given)))

    def part(self) -> Callable[[float | None], Part]:
        """Have the engine read. Return a function that waits for some seconds (by default, None) for what is read.

        It raises TimeoutError if that is not there yet, and SandboxError if a step before it has failed.
        """
        part, tasks = self._thread.submit(self._reader.read), self._tasks
        self._tasks = []
        return partial(_result, part, tasks)

    def wait(self) -> None:
        """Return when all is done that was asked for. Raises SandboxError if that has failed."""
        self._thread.submit(_nothing).result()
        for task in self._tasks:
            task.result()

    def stop(self) -> None:
        """Abandon what is asked for and not done; what is being done ends soon."""
        _stop(self._thread, self._abandoned)


def _nothing() -> None:
    """Do nothing, after all that was to be done."""


def _result(part: "Future[Part]", tasks: "list[Future[None]]", seconds: float | None) -> Part:
    read = part.result(seconds)
    for task in tasks:
        task.result()
    return read


def _stop(thread: ThreadPoolExecutor, abandoned: Event) -> None:
    abandoned.set()
    thread.shutdown(wait=False, cancel_futures=True)
