"""What a moment has of the engines of one lockstep, and a lockstep beside the loop: a thread computes its steps.

The thread is given the same steps and inputs in the same order as the other engines, so its states are the same bytes
as in a lockstep with them. Its kernels release Python's global lock, so they run on another core.
"""

import weakref
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from threading import Event
from typing import NamedTuple

from sandbox.analysis.gas import wall_impulse
from sandbox.run.inputs import Input
from sandbox.run.lockstep import Lockstep
from sandbox.state import Contacts, State, no_contacts
from sandbox.threads import abandon_at


class PartialMoment(NamedTuple):
    """The engines of one lockstep at a step, see `Moment`."""

    states: dict[str, State]
    contacts: dict[str, Contacts]
    counts: dict[str, int]
    energy: dict[str, float]
    work: dict[str, float]
    wall_impulse: dict[str, float]
    standing: frozenset[str]


class MomentReader:
    """Reads the engines of a lockstep step by step, and counts their contacts from its start."""

    def __init__(self, lockstep: Lockstep) -> None:
        self._lockstep = lockstep
        self._counts = dict.fromkeys(lockstep.engines, 0)
        self._wall_impulse = dict.fromkeys(lockstep.engines, 0.0)
        for runner in lockstep.engines.values():
            runner.record_contacts()

    def read(self) -> PartialMoment:
        """Return what a moment has of the engines now, with the contacts since the last call."""
        lockstep = self._lockstep
        contacts = {name: runner.contacts() for name, runner in lockstep.engines.items()}
        for name, resolved in contacts.items():
            if len(resolved):
                self._counts[name] += len(resolved)
                self._wall_impulse[name] += wall_impulse(resolved, lockstep.scene.arena.size)
        states = lockstep.states()
        return PartialMoment(
            states,
            # after an edit, the balls of these contacts may have other numbers
            dict.fromkeys(contacts, no_contacts()) if lockstep.edited else contacts,
            dict(self._counts),
            lockstep.energies(states),
            dict(lockstep.work),
            dict(self._wall_impulse),
            frozenset(lockstep.limits()),
        )


class Beside:
    """A lockstep that a thread runs. Between `wait` and the next step, it stands still and can be read."""

    def __init__(self, lockstep: Lockstep) -> None:
        self.lockstep = lockstep
        self._reader = MomentReader(lockstep)
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

    def part(self) -> Callable[[float | None], PartialMoment]:
        """Have the engine read. Return a function that waits for some seconds (by default, None) for what is read.

        It raises TimeoutError if that is not there yet, and SandboxError if a step before it has failed.
        """
        part, tasks = self._thread.submit(self._reader.read), self._tasks
        self._tasks = []
        return partial(_result, part, tasks)

    def wait(self) -> None:
        """Return when all is done that was asked for. Raises SandboxError if that has failed."""
        self._thread.submit(bool).result()  # after all else
        for task in self._tasks:
            task.result()

    def stop(self) -> None:
        """Abandon what is asked for and not done; what is being done ends soon."""
        _stop(self._thread, self._abandoned)


def _result(part: "Future[PartialMoment]", tasks: "list[Future[None]]", seconds: float | None) -> PartialMoment:
    read = part.result(seconds)
    for task in tasks:
        task.result()
    return read


def _stop(thread: ThreadPoolExecutor, abandoned: Event) -> None:
    abandoned.set()
    thread.shutdown(wait=False, cancel_futures=True)
