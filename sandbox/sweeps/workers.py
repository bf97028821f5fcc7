"""The workers that run the jobs: local processes, or a Dask cluster. Each yields results as they finish, in any order.

The processes are not those of `concurrent.futures`: a ProcessPoolExecutor breaks as a whole when a worker dies.
"""

import os
import socket
import sys
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import redirect_stdout
from functools import partial
from multiprocessing.connection import Connection, wait
from typing import Any, Final, cast
from urllib.parse import urlsplit

from sandbox.errors import MissingLibrary, SandboxError
from sandbox.processes import ChildProcess, serve
from sandbox.scene.model import Scene
from sandbox.sweeps.jobs import Job, RowResult, Sweep, groups, run_jobs

MAX_GROUP: Final = 16  # jobs that share a reference in one process
CONNECT_TIMEOUT: Final = 3.0  # s, for a Dask scheduler to answer


def core_count() -> int:
    """Return how many processes can run at once."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def run_here(sweep: Sweep, jobs: Sequence[Job]) -> Iterator[RowResult]:
    """Run jobs one after another in this process."""
    for group in groups(jobs, MAX_GROUP):
        yield from run_jobs(sweep.scene, sweep.against, group)


def run_locally(sweep: Sweep, jobs: Sequence[Job], count: int) -> Iterator[RowResult]:
    """Run jobs in `count` processes. One that dies is replaced, and the jobs that it was at run again, each alone."""
    todo = deque(groups(jobs, min(MAX_GROUP, -(-len(jobs) // count))))
    idle = [ChildProcess(_serve, sweep.scene, sweep.against) for _ in range(min(count, len(todo)))]
    busy = dict[Connection, tuple[ChildProcess, tuple[Job, ...]]]()
    try:
        while todo or busy:
            while todo and idle:
                worker, group = idle.pop(), todo.popleft()
                worker.send(group)
                busy[worker.connection] = worker, group
            for ready in wait(list(busy)):
                worker, group = busy.pop(cast("Connection", ready))
                try:
                    results = worker.receive()
                except EOFError:
                    worker, results = ChildProcess(_serve, sweep.scene, sweep.against), []
                    if len(group) == 1:
                        results = [RowResult(group[0], failure="its worker process died")]
                    else:
                        todo.extendleft((job,) for job in reversed(group))
                idle.append(worker)
                yield from results
    finally:
        for worker in (*idle, *(worker for worker, _ in busy.values())):
            worker.stop()


def _serve(connection: "Connection[Any, Any]", scene: Scene, against: str) -> None:
    """Run groups of jobs. What engines print goes to standard error."""
    with redirect_stdout(sys.stderr):
        serve(connection, partial(run_jobs, scene, against))


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
    try:
        socket.create_connection((host, port), CONNECT_TIMEOUT).close()
    except (OSError, UnicodeError) as error:  # the second of a host that cannot be a name
        raise SandboxError(f"{option}: no scheduler answers: {getattr(error, 'strerror', None) or error}") from None


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
    gone = SandboxError(f"--scheduler {address}: is gone; the same command runs the sweep again")
    with client:
        submit = partial(client.submit, run_jobs, sweep.scene, sweep.against, pure=False)  # run, though it ran before
        futures: dict[Any, tuple[Job, ...]] = {submit(group): group for group in groups(jobs, MAX_GROUP)}
        completed = as_completed(futures, loop=client.loop)  # type: ignore[no-untyped-call]
        for future in completed:
            if future.status in ("lost", "pending"):  # its worker died with the rows, which another one runs again
                completed.add(future)  # type: ignore[no-untyped-call]
                continue
            try:
                results = future.result() if future.status == "finished" else None
                failure = str(future.exception()) if future.status == "error" else ""
            except OSError:  # the connection broke while rows were sent
                raise gone from None
            if results is None and not failure:
                raise gone
            yield from results or (RowResult(job, failure=failure) for job in futures[future])
            future.release()
