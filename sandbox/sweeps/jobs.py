"""The jobs of a sweep, and the row that each yields."""

import json
import platform
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from itertools import product
from typing import Any, Final, NamedTuple

import numpy as np

from sandbox.analysis.comparison import Comparison, Reference, compare, compare_with, flatten, run_reference
from sandbox.analysis.documents import figure_columns
from sandbox.analysis.gas import speed_law
from sandbox.analysis.measurement import Run
from sandbox.analysis.reference import REFERENCE
from sandbox.engines import TEXTBOOK_ENGINES, TUNED, create
from sandbox.engines.article import pow_variant
from sandbox.errors import SandboxError
from sandbox.quantity import length
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn

Row = dict[str, Any]  # column -> value

LIBRARIES: Final = {"sandbox": "pymunk-sandbox", "pymunk": "pymunk", "numpy": "numpy", "numba": "numba"}
MAX_ROWS: Final = 1_000_000  # in memory
MAX_REFERENCE_BYTES: Final = 256_000_000  # of positions: a longer run is not shared, but run again for each row
UNTUNED: Final = (REFERENCE, *TEXTBOOK_ENGINES)  # engines that do not read Pymunk's settings
SPEED_CLASSES: Final = 20  # equally likely under the law of speeds, for counting final speeds


class Job(NamedTuple):
    """One run of one engine. settings: of Pymunk, as in "iterations=10 substeps=4"."""

    seed: int
    rate: int
    engine: str
    settings: str = ""

    def __str__(self) -> str:
        """Describe the job in a message."""
        return f"seed {self.seed}, rate {self.rate}, {self.engine} {self.settings}".rstrip()


COLUMNS: Final = (
    *("scene", *Job._fields, "seconds", "against", "horizon", "undecided", "unresolved"),
    *figure_columns(),
    *(*LIBRARIES, "python", "pow", "wall_s"),
)


@dataclass(frozen=True)
class Sweep:
    """A scene, its jobs in the order of the table, and the engine they are measured against."""

    scene: Scene
    against: str
    jobs: tuple[Job, ...]


def plan(
    scene: Scene,
    seeds: Sequence[int],
    rates: Sequence[int],
    engines: Sequence[str],
    settings: Mapping[str, Sequence[float]] | None = None,
    *,
    against: str | None = None,
) -> Sweep:
    """Plan a job for each seed, rate and engine, and for Pymunk one for each combination of its settings.

    Raises SandboxError for an invalid setting, rate or seed, and if an engine cannot run the scene.
    """
    if settings and TUNED not in engines:
        raise SandboxError(f"--set changes settings of {TUNED}, which is not among the engines; add it to --engines")
    choices = [[f"{key}={value}" for value in values] for key, values in sorted((settings or {}).items())]
    tunings = [" ".join(choice) for choice in product(*choices)]
    tunings_of = {engine: tunings if engine == TUNED else [""] for engine in engines}
    count = len(seeds) * len(rates) * sum(map(len, tunings_of.values()))
    if count > MAX_ROWS:
        raise SandboxError(f"a sweep of {count:,} rows is larger than the limit of {MAX_ROWS:,}")
    first = scene.changed(seed=seeds[0])
    against = against or REFERENCE
    for name in dict.fromkeys([*engines, against]):
        create(name, first, spawn(first))
    for rate, tuning in product(rates, tunings):
        scene_of_job(first, Job(seeds[0], rate, TUNED, tuning))
    jobs = (
        Job(seed, rate, engine, tuning)
        for seed, rate, engine in product(seeds, rates, engines)
        for tuning in tunings_of[engine]
    )
    return Sweep(scene, against, tuple(dict.fromkeys(jobs)))


def scene_of_job(scene: Scene, job: Job) -> Scene:
    """Return the scene that a job runs. Raises SandboxError for an invalid setting, rate or seed."""
    pairs = (setting.partition("=") for setting in job.settings.split())
    settings = {key: json.loads(value) for key, _, value in pairs}
    pymunk = scene.pymunk.model_dump(exclude_unset=True) | settings
    return scene.changed(seed=job.seed, rate=job.rate, pymunk=pymunk)


def reference_job(against: str, job: Job) -> Job:
    """Return the job of the reference that a job is measured against; jobs for which it is the same can share it."""
    return job._replace(engine=against, settings="" if against in UNTUNED else job.settings)


class Shared(NamedTuple):
    """A reference that jobs share. pow: the variant where it ran."""

    reference: Reference
    pow: str


def run_shared(scene: Scene, job: Job) -> Shared | None:
    """Run the job of a reference. Return None if it is too large to keep, or fails; it then runs with each job."""
    try:
        scene = scene_of_job(scene, job)
        is_small = (scene.steps + 1) * len(scene.bodies) * 2 * 8 <= MAX_REFERENCE_BYTES
        return Shared(run_reference(scene, job.engine), pow_variant()) if is_small else None
    except Exception:  # which the job itself will report
        return None


def run_job(scene: Scene, against: str, job: Job, shared: Shared | None = None) -> Row:
    """Run a job and return its row, without empty values. Its `speeds` are for the report only.

    shared: what `run_shared` returns for the job's reference. Without it, or if it ran with another variant of pow, the
    reference runs along.
    """
    start = time.perf_counter()
    scene = scene_of_job(scene, job)
    if shared is None or shared.pow != pow_variant():
        comparison = compare(scene, list(dict.fromkeys([job.engine, against])), against=against)
    else:
        comparison = compare_with(shared.reference, scene, job.engine)
    wall = time.perf_counter() - start
    job_run = comparison.runs[job.engine]
    row = {
        "scene": scene.name,
        **job._asdict(),
        "seconds": float(comparison.time[-1]),
        "against": against,
        "horizon": comparison.horizon,
        "undecided": comparison.undecided,
        "unresolved": comparison.unresolved,
        **comparison.as_json()["engines"][job.engine],
        **versions(),
        "wall_s": round(wall, 6),
        "speeds": count_speeds(comparison, job_run),
    }
    return {name: value for name, value in flatten(row).items() if value is not None}


@cache
def versions() -> Mapping[str, str]:
    """Return the versions that a row records: with other libraries, or another `pow`, results may differ."""
    libraries = {name: version(package) for name, package in LIBRARIES.items()}
    return libraries | {"python": platform.python_version(), "pow": pow_variant()}


def count_speeds(comparison: Comparison, run: Run) -> list[int]:
    """Count final speeds in classes that are equally likely under the law of speeds for the same number and energy.

    If the law holds, the counts are alike. Empty where no law applies: balls of several masses, a single ball, or rest.
    """
    mass, speed = comparison.scene.bodies.mass, length(run.final.velocity)
    whole = float(np.sqrt(np.sum(speed**2)))
    if np.ptp(mass) > 0 or len(mass) < 2 or not whole > 0:
        return []
    shares = speed_law(speed, whole, len(mass))
    counts, _ = np.histogram(shares, SPEED_CLASSES, (0, 1))
    return [int(count) for count in counts]


def in_order(sweep: Sweep, rows: Iterable[Row]) -> list[Row]:
    """Sort rows by the order of a sweep's jobs, without rows of other jobs."""
    found = {job_of(row): row for row in rows}
    return [found[job] for job in sweep.jobs if job in found]


def job_of(row: Row) -> Job:
    """Return the job that yielded a row."""
    return Job(*(row[field] for field in Job._fields))


def is_row(found: object) -> bool:
    """Return whether a value read from a file is a row as `run_job` makes them."""
    if not isinstance(found, dict):
        return False
    kinds = Job.__annotations__ | {"pow": str, "wall_s": float | int}
    return all(isinstance(found.get(name), kind) for name, kind in kinds.items())
