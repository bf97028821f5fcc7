"""The workers that run the jobs: local processes, or a Dask cluster. Each yields outcomes as they finish, in any order.

Both are written without `concurrent.futures`. A ProcessPoolExecutor breaks as a whole when a worker dies, and waits for
ever if one dies while it sends a result; so does a future of Dask's Executor if the connection breaks while it is sent.
"""

import socket
import sys
from collections import Counter, deque
from collections.abc import Iterable, Iterator, Sequence
from contextlib import redirect_stdout, suppress
from dataclasses import dataclass
from functools import partial
from itertools import groupby
from multiprocessing.connection import Connection, wait
from threading import Thread
from typing import Any, Final, cast
from urllib.parse import urlsplit

from sandbox.errors import EngineError, MissingLibrary, SandboxError
from sandbox.processes import ChildProcess, serve
from sandbox.scene.model import Scene
from sandbox.sweeps.jobs import Job, Row, Shared, Sweep, reference_job, run_job, run_shared

MAX_WORKER_DEATHS: Final = 3  # at one job
CONNECT_TIMEOUT: Final = 3.0  # s, for a Dask scheduler to answer


@dataclass(frozen=True)
class RowResult:
    """The row of a job, or why the job failed.

    time: s, when an engine that is not built in failed, None otherwise; details: its own traceback.
    """

    job: Job
    row: Row | None = None
    failure: str = ""
    time: float | None = None
    details: str = ""


def attempt(scene: Scene, against: str, job: Job, shared: Shared | None = None) -> RowResult:
    """Run a job as `run_job` does. An exception costs its row, not the sweep."""
    try:
        return RowResult(job, run_job(scene, against, job, shared))
    except EngineError as error:
        return RowResult(job, failure=str(error), time=error.time, details=error.details)
    except SandboxError as error:
        return RowResult(job, failure=str(error))
    except Exception as error:
        return RowResult(job, failure=f"{type(error).__name__}: {error}")


def groups(sweep: Sweep, jobs: Iterable[Job]) -> Iterator[list[Job]]:
    """Yield the jobs that follow one another and share their reference."""
    for _, group in groupby(jobs, partial(reference_job, sweep.against)):
        yield list(group)


def run_here(sweep: Sweep, jobs: Sequence[Job]) -> Iterator[RowResult]:
    """Run jobs one after another in this process."""
    runner = _JobRunner(sweep.scene, sweep.against)
    for job in jobs:
        yield runner.run(job)


class _JobRunner:
    """Runs jobs one after another, and keeps the last reference for jobs that share it."""

    def __init__(self, scene: Scene, against: str) -> None:
        self._scene, self._against = scene, against
        self._last: Job | None = None
        self._shared: Shared | None = None

    def run(self, job: Job) -> RowResult:
        """Run a job as `attempt` does."""
        reference = reference_job(self._against, job)
        if reference != self._last:
            self._last, self._shared = reference, None  # one reference at a time in memory
            self._shared = run_shared(self._scene, reference)
        return attempt(self._scene, self._against, job, self._shared)


def run_locally(sweep: Sweep, jobs: Sequence[Job], count: int) -> Iterator[RowResult]:
    """Run jobs in `count` processes. A process that dies is replaced, and its job is run again."""
    todo, deaths = deque(map(deque, groups(sweep, jobs))), Counter[Job]()
    workers: list[Worker] = []
    try:
        while len(workers) < min(count, len(jobs)):
            workers.append(Worker(sweep, deque()))
        while True:
            for worker in workers:
                if worker.job is None and (job := _next_job(worker, workers, todo)):
                    worker.start(job)
            busy = {worker.connection: (worker, worker.job) for worker in workers if worker.job}
            if not busy:
                break
            for ready in wait(list(busy)):
                worker, job = busy[cast("Connection", ready)]
                outcome = worker.outcome()
                if outcome is None:
                    workers[workers.index(worker)] = Worker(sweep, worker.group)
                    deaths[job] += 1
                    if deaths[job] < MAX_WORKER_DEATHS:
                        worker.group.appendleft(job)
                        continue
                    outcome = RowResult(job, failure=f"its worker process died {MAX_WORKER_DEATHS} times")
                yield outcome
    finally:
        for worker in workers:
            worker.stop()


def _next_job(worker: "Worker", workers: "list[Worker]", todo: deque[deque[Job]]) -> Job | None:
    """Return the next job of a worker's group; else of a group to do, else of the largest that others work on."""
    if not worker.group:
        worker.group = todo.popleft() if todo else max((busy.group for busy in workers), key=len)
    return worker.group.popleft() if worker.group else None


class Worker(ChildProcess):
    """A process that runs one job after another.

    group: the jobs to run next, which share a reference. Several workers may have the same group.
    """

    def __init__(self, sweep: Sweep, group: deque[Job]) -> None:
        super().__init__(_serve, sweep.scene, sweep.against)
        self.group = group
        self.job: Job | None = None

    def start(self, job: Job) -> None:
        """Start a job. If the process has died, `outcome` notices."""
        self.job = job
        self.send(job)

    def outcome(self) -> RowResult | None:
        """Receive the outcome of the job; None if the process has died."""
        self.job = None
        try:
            return cast("RowResult", self.receive())
        except EOFError:
            return None


def _serve(connection: "Connection[Any, Any]", scene: Scene, against: str) -> None:
    """Run jobs. What engines print goes to standard error."""
    with redirect_stdout(sys.stderr):
        serve(connection, _JobRunner(scene, against).run)


def check_scheduler(address: str) -> None:
    """Raise SandboxError if an address is not that of a Dask scheduler, or nothing listens there.

    Dask's own client tries again and again to reach a host that does not exist.
    """
    option = f"--scheduler {address!r}"
    try:
        parts = urlsplit(address if "://" in address else f"tcp://{address}")
        host, port = parts.hostname, parts.port
    except ValueError:
        host = port = None
    if not host or not port:
        raise SandboxError(f"{option}: must have a host and a port up to 65535, as in tcp://host:8786")
    refusals: list[OSError] = []
    probe = Thread(target=_connect, args=(host, port, refusals), daemon=True)  # a look-up has no timeout of its own
    probe.start()
    probe.join(CONNECT_TIMEOUT)
    if probe.is_alive() or refusals:
        why = refusals[0].strerror if refusals else f"no answer within {CONNECT_TIMEOUT:g} s"
        raise SandboxError(f"{option}: no scheduler answers: {why}")


def _connect(host: str, port: int, refusals: list[OSError]) -> None:
    """Connect to a port; on failure, add the error to a list."""
    try:
        socket.create_connection((host, port), CONNECT_TIMEOUT).close()
    except OSError as error:
        refusals.append(error)


def run_on_dask(sweep: Sweep, jobs: Sequence[Job], address: str) -> Iterator[RowResult]:
    """Run jobs on the cluster of a Dask scheduler, which reruns the jobs of a worker that dies on another one.

    Raises SandboxError if no scheduler answers, or if it stops answering.
    """
    try:
        from distributed import Client, as_completed
    except ImportError:
        raise MissingLibrary("--scheduler", "distributed") from None
    try:
        client = Client(address, timeout=CONNECT_TIMEOUT, set_as_default=False)  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        raise SandboxError(f"--scheduler {address}: no scheduler answers: {error}") from None
    except MemoryError:  # the client took the first bytes for the length of a message
        raise SandboxError(f"--scheduler {address}: what answers is not a Dask scheduler") from None
    with client:
        submit = partial(client.submit, pure=False)  # else a cluster that has run a job before would return its row
        futures: dict[Any, Job] = {}
        for group in groups(sweep, jobs):
            reference = reference_job(sweep.against, group[0])
            shared = submit(run_shared, sweep.scene, reference) if len(group) > 1 else None
            futures |= {submit(attempt, sweep.scene, sweep.against, job, shared): job for job in group}
        completed = as_completed(futures, loop=client.loop)  # type: ignore[no-untyped-call]
        for future in completed:
            if future.status in ("lost", "pending"):  # its worker died with the row, which another worker runs again
                completed.add(future)  # type: ignore[no-untyped-call]
                continue
            outcome = None
            with suppress(OSError):  # the connection broke while a row was sent
                outcome = _outcome(future, futures[future])
            if outcome is None:
                raise SandboxError(f"--scheduler {address}: is gone; the same command runs the rows that are missing")
            yield outcome
            future.release()


def _outcome(future: Any, job: Job) -> RowResult | None:
    """Return the outcome of a job on a cluster; None if the cluster is gone."""
    if future.status == "finished":
        return cast("RowResult", future.result())
    return RowResult(job, failure=str(future.exception())) if future.status == "error" else None
