"""Reads the engines of a lockstep, and runs a lockstep beside the loop: a thread computes its steps.

The thread is given the same steps and inputs in the same order as the other engines, so its states are the same bytes
as in a lockstep with them. Its kernels release Python's global lock, so they run on another core.
"""

import weakref
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from threading import Event

from sandbox.run.inputs import Input
from sandbox.run.lockstep import Lockstep
from sandbox.session.history import Reading
from sandbox.threads import abandon_at

Readings = dict[str, Reading]


def read(lockstep: Lockstep) -> Readings:
    """Return what the engines of a lockstep are now. Forgets their contacts, which `Session` has them record."""
    for runner in lockstep.engines.values():
        runner.contacts()
    states, standing = lockstep.states(), lockstep.standing()
    energies = lockstep.energies(states)
    return {
        name: Reading(state, energies[name], lockstep.work[name], str(standing.get(name, "")))
        for name, state in states.items()
    }


class Beside:
    """A lockstep that a thread runs. Between a reading and the next step, it stands still."""

    def __init__(self, lockstep: Lockstep) -> None:
        self.lockstep = lockstep
        self._abandoned = Event()
        self._thread = ThreadPoolExecutor(1, "beside", initializer=abandon_at, initargs=(self._abandoned,))
        self._tasks: list[Future[None]] = []  # since the last reading was asked for
        weakref.finalize(self, _stop, self._thread, self._abandoned)

    def step(self) -> None:
        """Have a step done."""
        self._tasks.append(self._thread.submit(self.lockstep.step))

    def apply(self, given: Input) -> None:
        """Have an input of the next step applied."""
        self._tasks.append(self._thread.submit(self.lockstep.apply, given))

    def read(self) -> Callable[[float | None], Readings]:
        """Have the engines read. Return a function that waits for some seconds (by default, None) for what is read.

        It raises TimeoutError if that is not there yet, and SandboxError if a step before it has failed.
        """
        reading, tasks = self._thread.submit(read, self.lockstep), self._tasks
        self._tasks = []

        def result(seconds: float | None) -> Readings:
            readings = reading.result(seconds)
            for task in tasks:
                task.result()
            return readings

        return result

    def stop(self) -> None:
        """Abandon what is asked for and not done; what is being done ends soon."""
        _stop(self._thread, self._abandoned)


def _stop(thread: ThreadPoolExecutor, abandoned: Event) -> None:
    abandoned.set()
    thread.shutdown(wait=False, cancel_futures=True)
