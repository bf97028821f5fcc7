"""Who runs the jobs: processes here, or a Dask cluster. Each yields outcomes as they come, in any order."""

import multiprocessing
import os
import signal
import sys
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from typing import Any, Final, cast

from sandbox.errors import SandboxError
from sandbox.scene.model import Scene
from sandbox.signals import signals_deferred
from sandbox.sweep.jobs import Job, Row, Sweep, run

PATIENCE: Final = 3  # workers that may die at a job before it is given up
REACH: Final = "10s"  # how long a scheduler may take to answer


def core_count() -> int:
    """Return how many processes can run at once."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@dataclass(frozen=True)
class Outcome:
    """What became of a job: its row, or why there is none."""

    job: Job
    row: Row | None = None
    failure: str = ""


def attempt(scene: Scene, against: str, job: Job) -> Outcome:
    """Run a job. Whatever goes wrong costs its row, not the sweep."""
    try:
        return Outcome(job, run(scene, against, job))
    except Exception as error:
        return Outcome(job, failure=f"{type(error).__name__}: {error}")


def local(sweep: Sweep, jobs: Sequence[Job], count: int) -> Iterator[Outcome]:
    """Run jobs in so many processes. A process that dies is replaced, and its job begun again."""
    todo, deaths = deque(jobs), Counter[Job]()
    workers: list[Worker] = []
    try:
        while len(workers) < min(count, len(jobs)):
            with signals_deferred():  # one that is not among them would not be stopped
                workers.append(Worker(sweep))
        while todo or any(worker.job for worker in workers):
            for worker in workers:
                if todo and worker.job is None:
                    worker.begin(todo.popleft())
            busy = {worker.connection: (worker, worker.job) for worker in workers if worker.job}
            for ready in wait(list(busy)):
                worker, job = busy[cast("Connection", ready)]
                outcome = worker.outcome()
                if outcome is None:
                    with signals_deferred():
                        workers[workers.index(worker)] = Worker(sweep)
                    deaths[job] += 1
                    if deaths[job] < PATIENCE:
                        todo.appendleft(job)
                        continue
                    outcome = Outcome(job, failure=f"{PATIENCE} workers died at it")
                yield outcome
    finally:
        for worker in workers:
            worker.stop()


class Worker:
    """A process that runs one job after another. It ends with the sweep, whatever ends that."""

    def __init__(self, sweep: Sweep) -> None:
        context = multiprocessing.get_context("spawn")  # forked, it would share locks with what is about to run
        self.connection, there = context.Pipe()
        self.process = context.Process(target=_serve, args=(there, sweep.scene, sweep.against), daemon=True)
        with _deaf():
            self.process.start()
        there.close()
        self.job: Job | None = None

    def begin(self, job: Job) -> None:
        """Give it a job. That it has died is found out when its outcome is asked for."""
        self.job = job
        with suppress(OSError):
            self.connection.send(job)

    def outcome(self) -> Outcome | None:
        """Take the outcome of its job; None where it has died."""
        self.job = None
        try:
            outcome: Outcome = self.connection.recv()
        except (EOFError, OSError):
            self.stop()
            return None
        return outcome

    def stop(self) -> None:
        """End it."""
        self.connection.close()
        self.process.terminate()
        self.process.join()


@contextmanager
def _deaf() -> Iterator[None]:
    """Start processes that never hear Ctrl-C, not while they import either: the sweep hears it, and ends them."""
    if sys.platform == "win32":
        yield
        return
    resource_tracker.ensure_running()  # as a process's start would, and hear again from then on
    heard = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, heard)


def _serve(connection: "Connection[Any, Any]", scene: Scene, against: str) -> None:
    """Run jobs until the other end is closed."""
    with suppress(EOFError, OSError):
        while True:
            connection.send(attempt(scene, against, connection.recv()))


def dask(sweep: Sweep, jobs: Sequence[Job], address: str) -> Iterator[Outcome]:
    """Run jobs on the cluster of a Dask scheduler, which gives those of a worker that dies to another.

    Raises SandboxError where there is no scheduler, or no longer one.
    """
    try:
        from distributed import Client, as_completed
    except ImportError:
        raise SandboxError("--scheduler: needs distributed; pip install 'pymunk-sandbox[dask]'") from None
    try:
        client = Client(address, timeout=REACH, set_as_default=False)  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        raise SandboxError(f"--scheduler {address}: no scheduler answers there: {error}") from None
    with client:
        # Impure: a cluster that has a row from another sweep must not say that it took no time.
        futures = {client.submit(attempt, sweep.scene, sweep.against, job, pure=False): job for job in jobs}
        for future in as_completed(futures, loop=client.loop):  # type: ignore[no-untyped-call]
            try:
                outcome = _outcome(future, futures[future])
            except OSError:  # Dask's, of a connection that ended while a row was on its way
                outcome = None
            if outcome is None:
                raise SandboxError(
                    f"--scheduler {address}: is gone; the same command goes on with the rows that are missing"
                )
            yield outcome
            future.release()


def _outcome(future: Any, job: Job) -> Outcome | None:
    """Take what came of a job on a cluster; None where the cluster is gone."""
    if future.status == "finished":
        return cast("Outcome", future.result())
    return Outcome(job, failure=str(future.exception())) if future.status == "error" else None
