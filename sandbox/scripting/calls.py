"""The functions of a script, from `simulate` to `converge`. Every wrong argument raises SandboxError."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TypedDict, Unpack, overload

from sandbox.analysis import comparison
from sandbox.analysis.advice import try_settings
from sandbox.engines import REFERENCE, Engines, Source, named, registry
from sandbox.engines.specs import Value
from sandbox.errors import SandboxError
from sandbox.report import trajectory
from sandbox.report.trajectory import Trajectory
from sandbox.scene.files import bundled
from sandbox.scene.model import Scene
from sandbox.scores import verify as scoring
from sandbox.scripting.arguments import AnyInputs, AnyScene, Arguments, plain, replay, scene_of, several
from sandbox.scripting.results import Advice, Comparison, Scores, SweepTable
from sandbox.sweeps import convergence, in_order, plan
from sandbox.sweeps.convergence import Convergence
from sandbox.sweeps.workers import run_here, run_locally


def compare(
    scene: AnyScene,
    engines: Engines | None = None,
    *,
    against: str | None = None,
    seconds: float | None = None,
    seed: int | None = None,
    rate: int | None = None,
    inputs: AnyInputs = (),
) -> Comparison:
    """Run a scene in several engines, in lockstep, and measure how far they are apart, since when, and why.

    scene: a Scene, the name of a bundled scene, or a file; engines: one or several, each a name such as "pymunk", a
    class or a function, or a mapping from names to these, as `sandbox.engines.named` reads them; by default "pymunk",
    then "article" (or "impulse" if the article's rule cannot run the scene with its edits), and "exact". An engine of
    your own that fails has no run, but an EngineError in `failed`; against: the engine that the others are measured
    against, by default "exact" if it takes part, else the last; seconds, seed, rate: by default the scene's; inputs:
    recorded inputs to replay, or their file, which bring their own seed and rate. If inputs edit the scene, the
    comparison covers what follows the last edit.
    Raises SandboxError if an argument is wrong, Refused if an engine cannot run the scene.
    """
    Arguments(against=against)
    chosen, replayed = replay(scene, inputs, seconds=seconds, seed=seed, rate=rate)
    return Comparison(**vars(comparison.compare(chosen, engines, against=against, inputs=replayed)))


class _RunOptions(TypedDict, total=False):
    seconds: float | None
    steps: int | None
    seed: int | None
    rate: int | None
    inputs: AnyInputs


@overload
def simulate(scene: AnyScene, engine: Source, **options: Unpack[_RunOptions]) -> Trajectory: ...  # type: ignore[overload-overlap]
@overload
def simulate(
    scene: AnyScene, engine: Iterable[Source] | Mapping[str, Source], **options: Unpack[_RunOptions]
) -> dict[str, Trajectory]: ...
def simulate(
    scene: AnyScene,
    engine: Engines,
    *,
    seconds: float | None = None,
    steps: int | None = None,
    seed: int | None = None,
    rate: int | None = None,
    inputs: AnyInputs = (),
) -> Trajectory | dict[str, Trajectory]:
    """Run a scene in one engine and return its trajectory, or in several and return a dictionary of them by name.

    scene, engine, seed, rate, inputs: as in `compare`; seconds or steps: how long, by default the scene's seconds. Each
    state includes the edits of its step.
    Raises SandboxError if an argument is wrong or the trajectory too large, Refused if an engine cannot run the scene.
    """
    sources = named(engine)
    if seconds is not None and steps is not None:
        raise SandboxError("seconds and steps exclude each other: a run ends after either")
    checked = Arguments(steps=plain(steps))
    chosen, replayed = replay(scene, inputs, seconds=seconds, seed=seed, rate=rate)
    runs = {
        name: trajectory.simulate(chosen, {name: source}, steps=checked.steps, inputs=replayed)
        for name, source in sources.items()
    }
    return next(iter(runs.values())) if isinstance(engine, str) or callable(engine) else runs


def advise(
    scene: AnyScene,
    *,
    against: str = REFERENCE,
    seconds: float | None = None,
    seed: int | None = None,
    rate: int | None = None,
    inputs: AnyInputs = (),
) -> Advice:
    """Try other settings of Pymunk on a scene, each measured against the reference, and return which are better.

    against: the reference, which may not be "pymunk" itself; the others: as in `compare`.
    Raises SandboxError if an argument is wrong, Refused if the reference cannot run the scene.
    """
    Arguments(against=against)
    chosen, replayed = replay(scene, inputs, seconds=seconds, seed=seed, rate=rate)
    return Advice(try_settings(chosen, against, replayed))


def verify(
    scenes: AnyScene | Iterable[AnyScene] | None = None,
    engines: Engines | None = None,
    *,
    tolerance: float | None = None,
) -> Scores:
    """Score engines against what scenes expect.

    scenes: one or several, by default all bundled scenes that expect something, of which an engine of your own skips
    those for which it is too slow; engines: as in `compare`, by default all engines; tolerance: largest error that
    passes, in place of those that the scenes have.
    Raises SandboxError if an argument is wrong, or nothing is expected.
    """
    sources = named(list(registry()) if engines is None else engines)
    patience = scoring.PATIENCE if scenes is None else math.inf
    checked = Arguments(tolerance=plain(tolerance))
    return Scores(scoring.verify(scenes_to_score(scenes), sources, checked.tolerance, patience))


def scenes_to_score(scenes: AnyScene | Iterable[AnyScene] | None = None) -> list[Scene]:
    """Return the scenes that expect something, by default of all bundled ones. Raises SandboxError if none does."""
    given = [*bundled("truths"), *bundled()] if scenes is None else several("scenes", scenes)
    chosen = [scene_of(scene) for scene in given]
    if scored := [scene for scene in chosen if scene.expect]:
        return scored
    raise SandboxError(f"nothing to score: no [[expect]] in {', '.join(scene.name for scene in chosen)}")


def sweep(
    scene: AnyScene,
    engines: str | Sequence[str] | None = None,
    *,
    seeds: int | Iterable[int] | None = None,
    rates: int | Iterable[int] | None = None,
    settings: Mapping[str, Value | Iterable[Value]] | None = None,
    against: str | None = None,
    seconds: float | None = None,
    workers: int = 1,
) -> SweepTable:
    """Run a scene with many seeds, rates, engines and settings of Pymunk, and return a table with a row for each.

    engines: by default "pymunk", and "article" or else "impulse"; seeds, rates, seconds: by default the scene's;
    settings: values of each setting of Pymunk, of elasticity or of friction, such as {"substeps": [1, 4]}; against: by
    default "exact"; workers: processes. A run that fails loses its row only.
    Raises SandboxError if an argument is wrong, Refused if an engine cannot run the scene.
    """
    checked = Arguments(against=against, workers=plain(workers), settings=settings)
    chosen, _ = replay(scene, (), seconds=seconds)
    planned = plan(
        chosen,
        None if seeds is None else several("seeds", plain(seeds)),
        None if rates is None else several("rates", plain(rates)),
        engines,
        {key: several(key, plain(values)) for key, values in (checked.settings or {}).items()},
        against=against,
    )
    count = checked.workers
    outcomes = list(run_here(planned, planned.jobs) if count == 1 else run_locally(planned, planned.jobs, count))
    rows = [outcome.row for outcome in outcomes if outcome.row is not None]
    return SweepTable(planned, in_order(planned, rows), [outcome for outcome in outcomes if outcome.failure])


def converge(
    scene: AnyScene,
    engines: Engines | None = None,
    *,
    rates: Iterable[int] = convergence.RATES,
    starts: int = convergence.STARTS,
    seed: int | None = None,
    seconds: float | None = None,
) -> Convergence:
    """Run engines at several rates, from several starts each, and return how fast their errors vanish.

    engines: as in `compare`, by default as in `sweep`; starts: shifted by fractions of a step; seed, seconds: likewise.
    Raises SandboxError if an argument is wrong, Refused if an engine cannot run the scene.
    """
    chosen, _ = replay(scene, (), seconds=seconds, seed=seed)
    checked = Arguments(rates=plain(rates), starts=plain(starts))
    return convergence.converge(chosen, engines, checked.rates, checked.starts)
