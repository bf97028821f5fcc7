"""The command line: it parses and prints, and adds nothing else.

What is slow to import is imported by the commands that need it.
"""

import json
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache, partial
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from sandbox.cli.exit import ending
from sandbox.errors import SandboxError, shown
from sandbox.files import STANDARD_OUTPUT, check_outputs, whole_file
from sandbox.signals import held
from sandbox.text import console, printable

if TYPE_CHECKING:
    from rich.progress import Progress
    from rich.status import Status

    from sandbox.analysis.comparison import Comparison
    from sandbox.run.inputs import Input
    from sandbox.scene.model import Scene
    from sandbox.sweep import Journal, Sweep

app = typer.Typer(
    help="Run a scene in several physics engines side by side, and be told how far they are apart.",
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

PATIENCE: Final = 1.0  # s, after which a run shows how far it is
NUMBA: Final = ".numba_config.yaml"  # numba's settings, which it reads from the folder one is in

SceneArgument = Annotated[str, typer.Argument(metavar="SCENE", help="A file, or the name of a bundled scene.")]
Engines = Annotated[
    str | None, typer.Option(metavar="A,B,...", help="Engines to run; Pymunk and its reference if left out.")
]
Seed = Annotated[int | None, typer.Option(help="Begin with another seed than the scene's.")]
Rate = Annotated[int | None, typer.Option(help="Steps per second, instead of the scene's.")]
Seconds = Annotated[float | None, typer.Option(help="Run for so long, instead of the scene's seconds.")]
Inputs = Annotated[Path | None, typer.Option(metavar="FILE", help="Replay a mouse recorded with --save-inputs.")]


def main() -> None:
    """Run the command line."""
    os.environ["PYTHONSAFEPATH"] = "1"  # processes started from here take no module from the folder one is in
    with ending():
        app(prog_name="sandbox")


@app.callback(invoke_without_command=True)
def _article_by_default(
    context: typer.Context,
    show_version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
) -> None:
    if show_version:
        from importlib.metadata import version

        print(version("pymunk-sandbox"))
        raise typer.Exit
    if Path(NUMBA).exists():  # a stranger's could have numba run compiled code from where it says
        raise SandboxError(f"{NUMBA}: numba would obey it; move it away, or go to another folder")
    if context.invoked_subcommand is None:
        run()


@app.command()
def run(
    scene: SceneArgument = "article",
    engines: Engines = None,
    seed: Seed = None,
    inputs: Inputs = None,
    save_inputs: Annotated[str | None, typer.Option(metavar="FILE", help="Record the mouse, as JSON lines.")] = None,
) -> None:
    """Open a scene in the window.

    Without a display: compare it, and save a picture of the end.
    """
    from sandbox.view.window import Window, has_display

    check_outputs({"--save-inputs": save_inputs}, [scene])
    chosen, replayed = _scene_and_inputs(scene, inputs, seed=seed)
    if has_display():
        window = Window(chosen, _names(engines), replayed)
        try:
            window.run()
        finally:  # what a hand has done cannot be had again
            if save_inputs:
                session = window.view.session
                _save_inputs(window.scene, session.given(), session.step, save_inputs)
    else:
        print("No display: comparing instead of opening the window.")
        _compare_and_draw(chosen, _names(engines), replayed)
        if save_inputs:
            _save_inputs(chosen, replayed, chosen.steps, save_inputs)


@app.command()
def record(
    scene: SceneArgument,
    out: Annotated[str, typer.Option(metavar="FILE", help="A .gif, .webp or .mp4 file, or .png for the end.")],
    engines: Engines = None,
    seed: Seed = None,
    rate: Rate = None,
    seconds: Seconds = None,
    inputs: Inputs = None,
    size: Annotated[str, typer.Option(metavar="WxH", help="Width and height, px.")] = "1280x720",
    show: Annotated[str, typer.Option(metavar="A,B,...", help="What the window's keys would show.")] = "charts",
) -> None:
    """Record a scene as a film, or a picture of its end, at its true pace.

    A GIF has 50 frames a second, since its delays are in 1/100 s; WebP and MP4 have 60.
    """
    from rich.progress import Progress

    from sandbox.view.record import check
    from sandbox.view.record import record as record_scene

    pixels, showing = _size(size), [name.strip() for name in show.split(",") if name.strip()]
    check_outputs({"--out": out}, [scene, inputs])
    check(out, pixels, showing)  # what cannot be is told before anything runs
    chosen, replayed = _scene_and_inputs(scene, inputs, seed=seed, rate=rate, seconds=seconds)
    terminal = console(stderr=True)
    progress = Progress(console=terminal, transient=True, disable=not terminal.is_terminal)
    with _on_screen(progress):
        watched = partial(progress.track, description="Recording")
        record_scene(chosen, _names(engines), out, pixels, showing, replayed, watched)


@app.command()
def compare(
    scene: SceneArgument,
    engines: Engines = None,
    against: Annotated[str | None, typer.Option(help="The engine that the others are measured against.")] = None,
    seconds: Seconds = None,
    seed: Seed = None,
    rate: Rate = None,
    inputs: Inputs = None,
    json_file: Annotated[str | None, typer.Option("--json", metavar="FILE", help="Write the figures as JSON.")] = None,
    csv_file: Annotated[str | None, typer.Option("--csv", metavar="FILE", help="Write the figures as CSV.")] = None,
    report: Annotated[
        str | None, typer.Option(metavar="FILE", help="Write a page to look at, in one .html file.")
    ] = None,
    max_gap: Annotated[float | None, typer.Option(min=0, metavar="PX", help="Exit with 1 if a gap is larger.")] = None,
    max_drift: Annotated[
        float | None, typer.Option(min=0, metavar="X", help="Exit with 1 if energy changes more.")
    ] = None,
    advise: Annotated[bool, typer.Option("--advise", help="Try other settings of Pymunk, and tell the gain.")] = False,
) -> None:
    """Tell how far engines are apart, since when, and why.

    FILE may be -, for standard output. Exit code 1 says that a limit was passed.
    """
    from sandbox.analysis.advice import advise as try_settings
    from sandbox.cli.tables import print_advice, print_comparison

    if report and report not in STANDARD_OUTPUT and Path(report).suffix != ".html":
        raise SandboxError(f"{report}: a report must end in .html")
    check_outputs({"--json": json_file, "--csv": csv_file, "--report": report}, [scene, inputs])
    chosen, replayed = _scene_and_inputs(scene, inputs, seed=seed, rate=rate, seconds=seconds)
    comparison = _compare(chosen, _names(engines), against, replayed)
    trials = try_settings(chosen, comparison.against, replayed) if advise else []
    if json_file:
        tried = {"advice": [vars(trial) for trial in trials]} if advise else {}
        _write(_json(comparison.as_json() | tried), json_file)
    if csv_file:
        _write(comparison.as_csv(), csv_file)
    if report:
        from sandbox.report.comparison import page

        _write(page(comparison), report)
    if not {json_file, csv_file, report} & {*STANDARD_OUTPUT}:
        print_comparison(comparison)
        print_advice(trials)
    beyond = list(comparison.beyond(max_gap, max_drift))
    for limit in beyond:
        print(limit, file=sys.stderr)
    if beyond:
        raise typer.Exit(1)


@app.command()
def trace(
    scene: SceneArgument,
    engine: Annotated[str, typer.Option(help="The engine that runs it.")],
    seconds: Seconds = None,
    steps: Annotated[int | None, typer.Option(min=0, help="Run for so many steps, instead of seconds.")] = None,
    seed: Seed = None,
    rate: Rate = None,
    inputs: Inputs = None,
    out: Annotated[str, typer.Option(metavar="FILE", help="A .npz, .csv or extended .xyz file; - prints csv.")] = "-",
) -> None:
    """Write positions and velocities at every step."""
    from sandbox.run.trajectory import simulate, trace_writer, write_trace

    if steps is not None and seconds is not None:
        raise SandboxError("--steps and --seconds both say how long; give one of them")
    check_outputs({"--out": out}, [scene, inputs])
    trace_writer(out)  # an ending that is none is told before anything runs
    chosen, replayed = _scene_and_inputs(scene, inputs, seed=seed, rate=rate, seconds=seconds)
    trajectory = simulate(chosen, engine, steps=steps, inputs=replayed)
    write_trace(trajectory, out)


@app.command()
def verify(
    scenes: Annotated[
        list[str] | None,
        typer.Argument(metavar="[SCENE...]", help="Files, or bundled scenes; all of these if left out."),
    ] = None,
    engines: Engines = None,
    json_file: Annotated[str | None, typer.Option("--json", metavar="FILE", help="Write the scores as JSON.")] = None,
) -> None:
    """Score engines by what scenes expect.

    Of each scene the table shows the error of the expectation that is missed most. Exit code 1 says that an engine
    named with --engines missed one, or where none is named, the exact engine.
    """
    from sandbox.analysis.verify import all_passed, as_json
    from sandbox.analysis.verify import verify as score_engines
    from sandbox.cli.tables import print_board
    from sandbox.engines import registry
    from sandbox.scene.files import bundled, load

    check_outputs({"--json": json_file}, scenes or ())
    _tell_of_compiling()
    named = _names(engines)
    chosen = [load(scene) for scene in scenes or (*bundled("truths"), *bundled())]
    board = score_engines(chosen, named or list(registry()))
    if not board:
        raise SandboxError(f"nothing to score: no [[expect]] in {', '.join(scenes or ())}")
    if json_file:
        _write(_json(as_json(board)), json_file)
    if json_file not in STANDARD_OUTPUT:
        print_board(board)
    if not all_passed(board, named):
        raise typer.Exit(1)


@app.command()
def sweep(
    scene: SceneArgument,
    seeds: Annotated[str | None, typer.Option(metavar="A:B", help="Seeds from A up to, and without, B.")] = None,
    rates: Annotated[str | None, typer.Option(metavar="R,R,...", help="Steps per second.")] = None,
    engines: Engines = None,
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=V,V,...", help="Run Pymunk with each value of a setting; may be repeated."),
    ] = None,
    against: Annotated[str | None, typer.Option(help="The engine that the others are measured against.")] = None,
    seconds: Seconds = None,
    out: Annotated[str, typer.Option(metavar="FILE", help="Where the table goes, as CSV; - prints it.")] = "-",
    workers: Annotated[int | None, typer.Option(min=1, help="Processes here; one a core if left out.")] = None,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Run on the cluster of a Dask scheduler.")
    ] = None,
    report: Annotated[str | None, typer.Option(metavar="FILE", help="Write charts as one HTML page.")] = None,
) -> None:
    """Run a scene many times: a row for each seed, rate, engine and setting.

    Rows are kept beside FILE as they come: a sweep that was stopped goes on from there when it is started again. Exit
    code 1 says that there are rows which could not be had.
    """
    from sandbox.engines import default_engines
    from sandbox.scene.files import load
    from sandbox.scene.spawn import spawn
    from sandbox.sweep import in_order, journal, plan, write
    from sandbox.sweep.options import cores, rates_of, seeds_of, settings_of

    if workers and scheduler:
        raise SandboxError("--workers and --scheduler both say who runs it; give one of them")
    check_outputs({"--out": out, "--report": report}, [scene])
    _tell_of_compiling()
    chosen = load(scene).changed(**({} if seconds is None else {"seconds": seconds}))
    planned = plan(
        chosen,
        seeds_of(seeds) if seeds else [chosen.seed],
        rates_of(rates) if rates else [chosen.rate],
        _names(engines) or default_engines(chosen, spawn(chosen)),
        settings_of(set_ or ()),
        against=against,
    )
    with journal(planned, out) as kept:
        failures = _run_sweep(planned, kept, workers or cores(), scheduler)
        rows = in_order(planned, kept.rows)
        if report:
            from sandbox.report.sweep import page

            _write(page(planned, rows), report)
        write(planned, rows, out)
    if failures:
        raise typer.Exit(1)


@app.command()
def check(scenes: Annotated[list[str], typer.Argument(metavar="SCENE...", help="Files, or bundled scenes.")]) -> None:
    """Tell the mistakes in scene files.

    Warnings are what the author may not have meant: overlaps, and balls faster than a step can follow.
    """
    from sandbox.cli.tables import counted
    from sandbox.scene.files import load
    from sandbox.scene.spawn import spawn, warnings

    _tell_of_compiling()
    mistakes = []
    for name in scenes:
        try:
            scene = load(name)
            initial = spawn(scene)
        except SandboxError as mistake:
            mistakes.append(str(mistake))
            continue
        print(f"{printable(name)}: {counted(len(scene.bodies), 'ball')}, no mistakes")
        for warning in warnings(scene, initial):
            print(warning)
    if mistakes:
        raise SandboxError("\n".join(mistakes))


@app.command()
def scenes() -> None:
    """List the bundled scenes."""
    from rich.table import Table

    from sandbox.scene.files import bundled, load

    table = Table(box=None, pad_edge=False)
    for column in ("scene", "balls", "about"):
        table.add_column(column)
    for name in bundled():
        scene = load(name)
        table.add_row(name, str(len(scene.bodies)), scene.about)
    console().print(table)


@app.command()
def bench(
    only: Annotated[str | None, typer.Option(metavar="A,B,...", help="Measure some parts, instead of all.")] = None,
    json_file: Annotated[str | None, typer.Option("--json", metavar="FILE", help="Write the figures as JSON.")] = None,
) -> None:
    """Measure how fast the sandbox is on this machine, in about two minutes.

    The parts are pymunk, article, exact, compare, window and start. Where a figure has a "/", it is a ratio of two
    that are measured in turn.
    """
    from sandbox.bench import bench as measure
    from sandbox.cli.tables import print_figures

    check_outputs({"--json": json_file})
    _tell_of_compiling()
    found = []
    for title, figures in measure(only.split(",") if only else None):
        with _on_screen(console(stderr=True).status(title)):
            part = list(figures)
        found += part
        if json_file not in STANDARD_OUTPUT:
            print_figures(title, part)
    if json_file:
        _write(_json([vars(figure) for figure in found]), json_file)


@app.command(name="schema")
def print_schema() -> None:
    """Print the JSON Schema of scene files."""
    from sandbox.scene.files import schema

    print(_json(schema()), end="")


@cache
def _tell_of_compiling() -> None:
    """Say a word, once in a process, where numba compiles, which it does once and then keeps on disk."""
    from numba.core import event

    class Listener(event.Listener):
        told = False

        def on_start(self, _event: event.Event) -> None:
            if not Listener.told:
                print("Compiling the engines; this happens once.", file=sys.stderr)
            Listener.told = True

        def on_end(self, _event: event.Event) -> None: ...

    event.register("numba:compile", Listener())  # type: ignore[no-untyped-call]


def _scene_and_inputs(scene: str, inputs: Path | None, **changes: Any) -> "tuple[Scene, Sequence[Input]]":
    """Load a scene with what the command line changes of it; recorded inputs bring their seed and rate."""
    from sandbox.run.inputs import Start, load_inputs
    from sandbox.scene.files import load
    from sandbox.scene.spawn import spawn, warnings

    _tell_of_compiling()
    chosen = load(scene)
    recorded = load_inputs(inputs, chosen) if inputs else []
    for given in recorded:
        if isinstance(given, Start):
            chosen = given.change_scene(chosen)
            if given.scene != chosen.name:
                there = printable(str(inputs))
                print(f"{there}: warning: recorded on {shown(given.scene)}, not on {chosen.name}", file=sys.stderr)
    chosen = chosen.changed(**{key: value for key, value in changes.items() if value is not None})
    for warning in warnings(chosen, spawn(chosen)):
        print(warning, file=sys.stderr)
    return chosen, recorded


def _save_inputs(scene: "Scene", given: "Sequence[Input]", steps: int, file: str) -> None:
    """Write what was done to a scene until it had gone so many steps."""
    from sandbox.run.inputs import End, Start, write_inputs

    start = Start(scene=scene.name, seed=scene.seed, rate=scene.rate)
    write_inputs([start, *(one for one in given if not isinstance(one, Start | End)), End(step=steps)], file)


def _names(engines: str | None) -> list[str] | None:
    if engines is None:
        return None
    names = [name.strip() for name in engines.split(",")]
    if not all(names):
        raise SandboxError(f"--engines {engines}: has a comma without a name")
    if len(set(names)) < len(names):
        raise SandboxError(f"--engines {engines}: names an engine twice")
    return names


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.partition("x")
    if not (width.isdecimal() and height.isdecimal()):
        raise SandboxError(f"--size {text}: write width x height in px, as in 1280x720")
    return int(width), int(height)


def _json(value: object) -> str:
    return json.dumps(value, indent=2, allow_nan=False) + "\n"


def _write(text: str, file: str) -> None:
    with whole_file(file) as opened:
        opened.write(text.encode())


def _compare(scene: "Scene", names: list[str] | None, against: str | None, inputs: "Sequence[Input]") -> "Comparison":
    """Compare engines; on a terminal, show how far it is where that takes long."""
    from sandbox.analysis.comparison import compare as compare_engines

    with _progress(scene.title or scene.name) as done:
        return compare_engines(scene, names, against=against, inputs=inputs, progress=done)


@contextmanager
def _progress(what: str) -> Iterator[Callable[[float], object] | None]:
    """Yield what takes the share that is done, and shows it once a second is over; None if nobody sees it."""
    if not sys.stderr.isatty():
        yield None
        return

    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TimeRemainingColumn())
    bar = Progress(*columns, console=console(stderr=True), transient=True)
    task, since = bar.add_task(what, total=1.0), monotonic()

    def show(done: float) -> None:
        bar.update(task, completed=done)
        if monotonic() - since > PATIENCE:
            with held():
                bar.start()

    try:
        yield show
    finally:
        bar.stop()


@contextmanager
def _on_screen(bar: "Progress | Status") -> Iterator[None]:
    """Show what hides the cursor, and whatever happens, show that again."""
    try:
        with held():
            bar.start()
        yield
    finally:
        bar.stop()


def _compare_and_draw(scene: "Scene", names: list[str] | None, inputs: "Sequence[Input]") -> None:
    from sandbox.cli.tables import print_comparison
    from sandbox.view.picture import draw_picture, save_picture

    path = f"{scene.name}-{scene.seed}-{scene.steps:06}.png"
    check_outputs({"Picture": path})
    comparison = _compare(scene, names, None, inputs)
    print_comparison(comparison)
    save_picture(draw_picture(comparison), path)
    print(f"Picture of the end: {path}")


def _run_sweep(sweep: "Sweep", kept: "Journal", workers: int, scheduler: str | None) -> int:
    """Run what a sweep lacks, with a bar on a terminal. Tell what failed; return how many did."""
    from rich.progress import MofNCompleteColumn, Progress, TimeElapsedColumn, TimeRemainingColumn

    from sandbox.sweep import missing, run

    terminal = console(stderr=True)
    columns = (*Progress.get_default_columns()[:2], MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn())
    failures = 0
    progress = Progress(*columns, console=terminal, disable=not terminal.is_terminal)
    with _on_screen(progress):
        runs = progress.add_task("runs", total=len(sweep.jobs), completed=len(sweep.jobs) - len(missing(sweep, kept)))
        for outcome in run(sweep, kept, workers=workers, scheduler=scheduler):
            progress.advance(runs)
            if outcome.failure:
                failures += 1
                print(f"{outcome.job}: {outcome.failure}", file=sys.stderr)
    if failures:
        print(f"{failures} of {len(sweep.jobs)} rows are missing; the same command tries again", file=sys.stderr)
    return failures
