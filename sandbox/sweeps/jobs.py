"""The jobs of a sweep, and the row that each yields."""

import math
import platform
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from importlib.util import find_spec
from itertools import product
from typing import Any, Final, NamedTuple

from sandbox.analysis.comparison import compare, figure_columns
from sandbox.engines import REFERENCE, Engines, Source, create, default_engines, named
from sandbox.engines.article import pow_variant
from sandbox.engines.specs import TUNED, Value, format_settings, parse_settings, settings_in, with_settings
from sandbox.errors import EngineError, SandboxError, suggestion
from sandbox.run.edits import with_every_contact
from sandbox.scene.model import PymunkSettings, Scene
from sandbox.scene.spawn import spawn

Row = dict[str, Any]  # column -> value

LIBRARIES: Final = {"sandbox": "pymunk-sandbox", "pymunk": "pymunk", "numpy": "numpy", "numba": "numba"}
MAX_ROWS: Final = 1_000_000  # in memory
OF_CONTACTS: Final = {"elasticity": 1.0, "friction": math.inf}  # keys of every contact -> the largest value
OF_PYMUNK: Final = tuple(PymunkSettings.model_fields)


class Job(NamedTuple):
    """One run of one engine. settings: of Pymunk and of every contact, as in "elasticity=0.5, substeps=4"."""

    seed: int
    rate: int
    engine: str
    settings: str = ""

    def __str__(self) -> str:
        """Describe the job in a message."""
        return f"seed {self.seed}, rate {self.rate}, {self.engine} {self.settings}".rstrip()

    def values(self, keys: Iterable[str]) -> dict[str, Any]:
        """Return those of its settings that have some keys."""
        values = parse_settings(self.settings, self.settings) if self.settings else {}
        return {key: value for key, value in values.items() if key in keys}

    @property
    def spec(self) -> str:
        """The engine with the settings of Pymunk."""
        name, values = settings_in(self.engine)
        return with_settings(name, values | self.values(OF_PYMUNK))


COLUMNS: Final = (
    *("scene", *Job._fields, "seconds", "against", "horizon", "undecided", "unresolved", "reference_until"),
    *figure_columns(),
    *(*LIBRARIES, "python", "pow"),
)


@dataclass(frozen=True)
class Sweep:
    """A scene, its jobs in the order of the table, and the engine they are measured against."""

    scene: Scene
    against: str
    jobs: tuple[Job, ...]


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


def plan(
    scene: Scene,
    seeds: Sequence[int] | None = None,
    rates: Sequence[int] | None = None,
    engines: Engines | None = None,
    settings: Mapping[str, Sequence[Value]] | None = None,
    *,
    against: str | None = None,
) -> Sweep:
    """Plan a job for each seed, rate, engine, and combination of the settings that the engine has.

    seeds, rates: by default the scene's; engines: as in `sources_of`, by their names; settings: of Pymunk, and the
    elasticity and friction of every contact, which are those of every engine.
    Raises SandboxError for an invalid setting, rate or seed, and if an engine cannot run the scene.
    """
    seeds = [scene.seed] if seeds is None else seeds
    rates = [scene.rate] if rates is None else rates
    settings = settings or {}
    names = list(sources := sources_of(engines, scene))
    if unnamed := [name for name in names if sources[name] != name]:
        raise SandboxError(f"{unnamed[0]}: runs of a sweep find engines by name; name its file, as in mine.py:Mine")
    _check_keys(names, settings)
    tunings_of = {engine: _tunings(engine, settings) for engine in names}
    count = len(seeds) * len(rates) * sum(map(len, tunings_of.values()))
    if count > MAX_ROWS:
        raise SandboxError(f"a sweep of {count:,} rows is larger than the limit of {MAX_ROWS:,}")
    for engine, tunings in tunings_of.items():
        for rate, tuning in product(rates, tunings):
            job = Job(seeds[0], rate, engine, tuning)
            scene_of_job(scene, job).changed(pymunk=scene.pymunk.model_dump(exclude_unset=True) | job.values(OF_PYMUNK))
    first, against = scene.changed(seed=seeds[0]), against or REFERENCE
    for engine in dict.fromkeys([*names, against]):
        with suppress(EngineError):  # which costs its rows only
            create(engine, first, spawn(first))
    jobs = (
        Job(seed, rate, engine, tuning)
        for seed, rate, engine in product(seeds, rates, names)
        for tuning in tunings_of[engine]
    )
    return Sweep(scene, against, tuple(dict.fromkeys(jobs)))


def sources_of(engines: Engines | None, scene: Scene) -> dict[str, Source]:
    """Return engines by name, by default Pymunk, and the first textbook engine that can run the scene."""
    return named(default_engines(scene) if engines is None else engines)


def _check_keys(engines: Sequence[str], settings: Mapping[str, object]) -> None:
    """Raise SandboxError if a key cannot be set: --set is not for it, or no engine has it open."""
    for key in settings:
        if option := {"rate": "--rates", "seed": "--seeds"}.get(key):
            raise SandboxError(f"--set {key}: {option} runs several of them")
        if key in OF_PYMUNK:
            tuned = [engine for engine in engines if settings_in(engine)[0] == TUNED]
            if not tuned:
                raise SandboxError(
                    f"--set {key} changes a setting of {TUNED}, which is not among the engines; add it to --engines"
                )
            if fixed := [engine for engine in tuned if key in settings_in(engine)[1]]:
                raise SandboxError(f"--set {key}: {fixed[0]} has a value of its own; name it without")
        elif key not in OF_CONTACTS:
            hint = suggestion(key, [*OF_PYMUNK, *OF_CONTACTS])
            raise SandboxError(f"--set {key}: is neither a setting of {TUNED} nor of every contact; {hint}")


def _tunings(engine: str, settings: Mapping[str, Sequence[Value]]) -> list[str]:
    """List all combinations of the settings that an engine has: those of contacts, and for Pymunk its own."""
    is_tuned = settings_in(engine)[0] == TUNED
    keys = [key for key in sorted(settings) if is_tuned or key not in OF_PYMUNK]
    choices = product(*(settings[key] for key in keys))
    return [format_settings(dict(zip(keys, choice, strict=True))) for choice in choices]


def scene_of_job(scene: Scene, job: Job) -> Scene:
    """Return the scene that a job runs. Raises SandboxError for an invalid setting, rate or seed."""
    for key, value in job.values(OF_CONTACTS).items():
        if not isinstance(value, int | float) or not 0 <= value <= OF_CONTACTS[key] or math.isinf(value):
            most = "a number from 0 to 1" if OF_CONTACTS[key] == 1 else "a number of at least 0"
            raise SandboxError(f"{key} must be {most}, got {value}")
        scene = with_every_contact(scene, key, value)
    return scene.changed(seed=job.seed, rate=job.rate)


def groups(jobs: Iterable[Job], most: int) -> Iterator[tuple[Job, ...]]:
    """Yield jobs that run together, at most so many: of one seed and rate, with the same contacts."""
    together = defaultdict[tuple[int, int, str], list[Job]](list)
    for job in jobs:
        together[job.seed, job.rate, format_settings(job.values(OF_CONTACTS))].append(job)
    for group in together.values():
        yield from (tuple(group[k : k + most]) for k in range(0, len(group), most))


def run_jobs(scene: Scene, against: str, jobs: Sequence[Job]) -> list[RowResult]:
    """Run jobs that differ in the engine and its settings only, and return the result of each.

    If one ends before the others, or raises an exception, each runs alone, so that no row depends on the others.
    """
    try:
        engines = dict.fromkeys([*(job.spec for job in jobs), against])
        comparison = compare(scene_of_job(scene, jobs[0]), list(engines), against=against)
        if len(jobs) == 1 or not comparison.ended or comparison.ended.engine == against:
            rows = {row["engine"]: row for row in comparison.rows()}
            return [_result(job, rows.get(job.spec), comparison.failed.get(job.spec)) for job in jobs]
    except Exception as error:  # whatever an engine raises costs its row, not the sweep
        if len(jobs) == 1:
            is_ours = isinstance(error, SandboxError)
            return [_result(jobs[0], None, error if is_ours else SandboxError(f"{type(error).__name__}: {error}"))]
    return [result for job in jobs for result in run_jobs(scene, against, [job])]


def _result(job: Job, figures: Row | None, error: Exception | None) -> RowResult:
    """Return the result of a job: its row, without empty values, or its error."""
    if figures is None:
        time, details = (error.time, error.details) if isinstance(error, EngineError) else (None, "")
        return RowResult(job, failure=str(error), time=time, details=details)
    row = figures | job._asdict() | versions()
    return RowResult(job, {name: row[name] for name in COLUMNS if row[name] is not None})


@cache
def versions() -> dict[str, str]:
    """Return the versions that a row records: with other libraries, or another `pow`, results may differ."""
    libraries = {name: version(package) if find_spec(name) else "" for name, package in LIBRARIES.items()}
    return libraries | {"python": platform.python_version(), "pow": pow_variant()}


def in_order(sweep: Sweep, rows: Iterable[Row]) -> list[Row]:
    """Sort rows by the order of a sweep's jobs."""
    by_job = {Job(*(row[field] for field in Job._fields)): row for row in rows}
    return [by_job[job] for job in sweep.jobs if job in by_job]
