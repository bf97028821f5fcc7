"""The jobs of a sweep, and the row that each yields."""

import math
import platform
import time
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from importlib.util import find_spec
from itertools import product
from typing import Any, Final, NamedTuple

from sandbox.analysis.comparison import Reference, compare, compare_with, run_reference
from sandbox.analysis.documents import figure_columns
from sandbox.engines import REFERENCE, TEXTBOOK_ENGINES, TUNED, create, settings_in
from sandbox.engines.article import pow_variant
from sandbox.engines.specs import Value, format_settings, parse_settings
from sandbox.errors import EngineError, SandboxError, suggestion
from sandbox.run.edits import with_every_contact
from sandbox.scene.model import PymunkSettings, Scene
from sandbox.scene.spawn import spawn

Row = dict[str, Any]  # column -> value

LIBRARIES: Final = {"sandbox": "pymunk-sandbox", "pymunk": "pymunk", "numpy": "numpy", "numba": "numba"}
MAX_ROWS: Final = 1_000_000  # in memory
MAX_REFERENCE_BYTES: Final = 256_000_000  # of positions: a longer run is not shared, but run again for each row
OF_CONTACTS: Final = {"elasticity": 1.0, "friction": math.inf}  # keys of every contact -> the largest value
OF_PYMUNK: Final = tuple(PymunkSettings.model_fields)
UNTUNED: Final = (REFERENCE, *TEXTBOOK_ENGINES)  # engines that do not read Pymunk's settings


class Job(NamedTuple):
    """One run of one engine. settings: of Pymunk and keys of the scene, as in "iterations=10, substeps=4"."""

    seed: int
    rate: int
    engine: str
    settings: str = ""

    def __str__(self) -> str:
        """Describe the job in a message."""
        return f"seed {self.seed}, rate {self.rate}, {self.engine} {self.settings}".rstrip()


COLUMNS: Final = (
    *("scene", *Job._fields, "seconds", "against", "horizon", "undecided", "unresolved", "reference_until"),
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
    settings: Mapping[str, Sequence[Value]] | None = None,
    *,
    against: str | None = None,
) -> Sweep:
    """Plan a job for each seed, rate, engine, and combination of the settings that the engine has.

    settings: of Pymunk, or keys of the scene, which are those of every engine. Raises SandboxError for an invalid
    setting, rate or seed, and if an engine cannot run the scene.
    """
    settings = settings or {}
    _check_keys(engines, settings)
    tunings_of = {engine: _tunings(engine, settings) for engine in engines}
    count = len(seeds) * len(rates) * sum(map(len, tunings_of.values()))
    if count > MAX_ROWS:
        raise SandboxError(f"a sweep of {count:,} rows is larger than the limit of {MAX_ROWS:,}")
    first = scene.changed(seed=seeds[0])
    against = against or REFERENCE
    for engine, tunings in tunings_of.items():
        for rate, tuning in product(rates, tunings):
            scene_of_job(first, Job(seeds[0], rate, engine, tuning))
    for engine in dict.fromkeys([*engines, against]):
        with suppress(EngineError):  # which costs its rows only
            create(engine, first, spawn(first))
    jobs = (
        Job(seed, rate, engine, tuning)
        for seed, rate, engine in product(seeds, rates, engines)
        for tuning in tunings_of[engine]
    )
    return Sweep(scene, against, tuple(dict.fromkeys(jobs)))


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
        elif key.partition(".")[0] not in (*Scene.model_fields, *OF_CONTACTS):
            hint = suggestion(key, [*OF_PYMUNK, *Scene.model_fields, *OF_CONTACTS])
            raise SandboxError(f"--set {key}: is neither a setting of {TUNED} nor a key of the scene; {hint}")


def _tunings(engine: str, settings: Mapping[str, Sequence[Value]]) -> list[str]:
    """List all combinations of the settings that an engine has: keys of the scene, and for Pymunk its own."""
    is_tuned = settings_in(engine)[0] == TUNED
    keys = [key for key in sorted(settings) if is_tuned or key not in OF_PYMUNK]
    choices = product(*(settings[key] for key in keys))
    return [format_settings(dict(zip(keys, choice, strict=True))) for choice in choices]


def settings_of(job: Job) -> dict[str, Value]:
    """Return the settings of a job: of Pymunk and keys of the scene."""
    return parse_settings(job.settings, job.settings) if job.settings else {}


def scene_of_job(scene: Scene, job: Job) -> Scene:
    """Return the scene that a job runs. Raises SandboxError for an invalid setting, rate or seed."""
    tuning: dict[str, Value] = {}
    for key, value in settings_of(job).items():
        if key in OF_PYMUNK:
            tuning[key] = value
        else:
            scene = with_value(scene, key, value)
    pymunk = scene.pymunk.model_dump(exclude_unset=True) | tuning
    return scene.changed(seed=job.seed, rate=job.rate, pymunk=pymunk)


def with_value(scene: Scene, key: str, value: object) -> Scene:
    """Return a scene with another value, and without its expectations.

    key: with dots between its parts, and numbers from 0 in lists, such as balls.0.radius or gravity.1; or elasticity or
    friction, for that of every contact. Raises SandboxError if there is no such key, or the value is not valid.
    """
    if key in OF_CONTACTS:
        if not isinstance(value, int | float) or not 0 <= value <= OF_CONTACTS[key] or math.isinf(value):
            most = "a number from 0 to 1" if OF_CONTACTS[key] == 1 else "a number of at least 0"
            raise SandboxError(f"{key} must be {most}, got {value}")
        return with_every_contact(scene, key, value)
    table, *path = key.split(".")
    if table not in (known := type(scene).model_fields):
        raise SandboxError(f"{key}: is not a key of the scene; {suggestion(table, [*known, *OF_CONTACTS])}")
    if path:
        document = scene.model_dump(
            mode="json", by_alias=True, include={table}, exclude_unset=table in scene.model_fields_set
        )
        value = _replaced(document[table], path, value, key)
    return scene.changed(**{"expect": (), table: value})


def _replaced(document: Any, path: list[str], value: object, key: str) -> Any:
    """Return a part of a document with another value at a path in it."""
    if not path:
        return value
    part, *rest = path
    if isinstance(document, list):
        if not part.isdecimal() or int(part) >= len(document):
            most = f"must be a number from 0 to {len(document) - 1}" if document else "is in an empty list"
            raise SandboxError(f"{key}: {part} {most}")
        index = int(part)
        return [*document[:index], _replaced(document[index], rest, value, key), *document[index + 1 :]]
    if not isinstance(document, dict):
        raise SandboxError(f"{key}: has no key {part}; it is a single value")
    return document | {part: _replaced(document.get(part, {}), rest, value, key)}


def reference_job(against: str, job: Job) -> Job:
    """Return the job of the reference that a job is measured against; jobs for which it is the same can share it."""
    settings = {key: value for key, value in settings_of(job).items() if key not in OF_PYMUNK}
    return job._replace(engine=against, settings=format_settings(settings) if against in UNTUNED else job.settings)


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
    """Run a job and return its row, without empty values.

    shared: what `run_shared` returns for the job's reference. Without it, or if it ran with another variant of pow, the
    reference runs along.
    """
    start = time.perf_counter()
    scene = scene_of_job(scene, job)
    if shared is None or shared.pow != pow_variant():
        comparison = compare(scene, list(dict.fromkeys([job.engine, against])), against=against)
        if job.engine in comparison.failed:
            raise comparison.failed[job.engine]
    else:
        comparison = compare_with(shared.reference, scene, job.engine)
    wall = time.perf_counter() - start
    [figures] = (row for row in comparison.rows() if row["engine"] == job.engine)
    row = figures | job._asdict() | versions() | {"wall_s": round(wall, 6)}
    return {name: row[name] for name in COLUMNS if row[name] is not None}


@cache
def versions() -> dict[str, str]:
    """Return the versions that a row records: with other libraries, or another `pow`, results may differ."""
    libraries = {name: version(package) if find_spec(name) else "" for name, package in LIBRARIES.items()}
    return libraries | {"python": platform.python_version(), "pow": pow_variant()}


def in_order(sweep: Sweep, rows: Iterable[Row]) -> list[Row]:
    """Sort rows by the order of a sweep's jobs, without rows of other jobs."""
    by_job = {job_of(row): row for row in rows}
    return [by_job[job] for job in sweep.jobs if job in by_job]


def job_of(row: Row) -> Job:
    """Return the job that yielded a row."""
    return Job(*(row[field] for field in Job._fields))


def is_row(value: object) -> bool:
    """Return whether a value read from a file is a row as `run_job` makes them."""
    if not isinstance(value, dict):
        return False
    kinds = Job.__annotations__ | {"pow": str, "wall_s": float | int}
    return all(isinstance(value.get(name), kind) for name, kind in kinds.items())
