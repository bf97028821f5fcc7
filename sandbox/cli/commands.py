"""The command line: it parses and prints, and adds nothing else.

Slow imports happen inside the commands that need them.
"""

import faulthandler
import math
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer
from typer.core import TyperGroup

from sandbox import __version__
from sandbox.cli import options
from sandbox.cli.exit import exit_codes, print_error
from sandbox.cli.options import file_option, scene_and_inputs, settings_by_key
from sandbox.cli.outputs import check_outputs, has_document, printed_beside
from sandbox.cli.progress import progress_bar, sweep_with_bar
from sandbox.errors import EngineError, SandboxError
from sandbox.files import STANDARD_OUTPUT, write_text
from sandbox.report.output import console, json_text
from sandbox.text import counted, printable
from sandbox.view import Layer

if TYPE_CHECKING:
    from sandbox.analysis.advice import TriedSettings
    from sandbox.analysis.comparison import Comparison
    from sandbox.run.inputs import Input
    from sandbox.scene.model import Scene


USAGE_ERROR: Final[type[Exception]] = typer.BadParameter.__mro__[1]  # typer does not export it


@contextmanager
def _one_sentence(ctx: Any = None) -> Iterator[None]:
    """Turn errors of a command, or of the options before it, into exit codes; a wrong argument is one sentence.

    Typer itself would end with 1 at a closed pipe, and print a wrong argument as a box.
    """
    with exit_codes():
        try:
            yield
        except USAGE_ERROR as error:
            if hasattr(error, "possibilities"):
                error.possibilities = None  # options with similar names, such as --seed for --seconds
            command = " ".join(filter(None, ("sandbox", ctx and ctx.invoked_subcommand)))
            message = error.format_message()  # type: ignore[attr-defined]
            raise SandboxError(f"{message.rstrip('.')} (see {command} --help)") from None


class _Commands(TyperGroup):
    """The commands. A scene or a program in place of one is named with the commands that it is for."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the command, as typer does. Raises SandboxError for a scene or a Python program."""
        name = args[0]
        if name not in self.commands and not ctx.resilient_parsing:  # as for completion
            from sandbox.scene.files import TRUTHS, bundled

            if name.endswith(".py"):
                raise SandboxError(f"{name}: is a Python program; sandbox watch {name} runs it, if it uses Pymunk")
            if name.endswith(".toml") or name in {**bundled(), **bundled(TRUTHS)}:
                raise SandboxError(
                    f"{name}: is a scene; sandbox run {name} opens it, sandbox compare {name} compares engines"
                )
        return super().resolve_command(ctx, args)

    def make_context(self, *arguments: Any, **extra: Any) -> Any:
        """Parse the options before the command."""
        with _one_sentence():
            return super().make_context(*arguments, **extra)

    def invoke(self, ctx: Any) -> Any:
        """Run the command."""
        with _one_sentence(ctx):
            return super().invoke(ctx)


app = typer.Typer(
    cls=_Commands,
    help="Run one scene in several physics engines side by side, and see how far they drift apart.",
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

NUMBA_SETTINGS: Final = ".numba_config.yaml"  # numba reads it from the working directory


def main() -> None:
    """Run the command line."""
    if sys.stderr:  # as it is not after 2>&-
        faulthandler.enable()  # prints the line that a program was at when Pymunk's C code aborts it
    os.environ["PYTHONSAFEPATH"] = "1"  # child processes must not import modules from the working directory
    app(prog_name="sandbox")


@app.callback(invoke_without_command=True)
def _run_by_default(
    context: typer.Context, show_version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False
) -> None:
    if show_version:
        print(__version__)
        raise typer.Exit
    if Path(NUMBA_SETTINGS).exists():  # one from a stranger could make numba load compiled code from anywhere
        raise SandboxError(f"{NUMBA_SETTINGS}: numba would obey it; move it away, or go to another folder")
    if context.invoked_subcommand is None:
        run()


@app.command()
def run(
    scene: options.SceneArgument = "article",
    engines: options.Engines = None,
    seed: options.Seed = None,
    inputs: options.Inputs = None,
    save_inputs: Annotated[str | None, file_option("Save drags and edits as JSON lines.")] = None,
) -> None:
    """Open a scene in the window.

    Without a display: compare the engines of the scene, and save a picture of the end.
    """
    from sandbox.run.inputs import write_run
    from sandbox.view.display import has_display
    from sandbox.view.window import Window

    check_outputs({"--save-inputs": save_inputs}, [scene])
    chosen, replayed = scene_and_inputs(scene, inputs, seed=seed)
    if has_display():
        window = Window(chosen, engines, replayed, beside=True)
        try:
            window.run()
        finally:  # mouse input cannot be reproduced
            if save_inputs:
                session = window.view.session
                write_run(window.scene, session.given(), session.step, save_inputs)
    else:
        print("No display: comparing instead of opening the window.")
        if save_inputs:
            write_run(chosen, replayed, chosen.steps, save_inputs)
        _compare_and_draw(chosen, engines, replayed)


@app.command()
def record(
    scene: options.SceneArgument,
    out: Annotated[str, file_option("A .gif or .mp4 file, or .png for the end.")],
    engines: options.Engines = None,
    seconds: options.Seconds = None,
    seed: options.Seed = None,
    rate: options.Rate = None,
    inputs: options.Inputs = None,
    size: options.SizeOption = "1280x720",
    show: options.Layers = Layer.CHARTS,
) -> None:
    """Record a scene in real time as a video, or its end as a picture.

    A GIF has 50 frames a second, as its delays are in 1/100 s; MP4 has 60.
    """
    from sandbox.view.offscreen import check_recording
    from sandbox.view.offscreen import record as record_scene

    check_outputs({"--out": out}, [scene, inputs])
    check_recording(out, size)
    chosen, replayed = scene_and_inputs(scene, inputs, seconds=seconds, seed=seed, rate=rate)
    with progress_bar("Recording") as progress:

        def track(steps: Sequence[int]) -> Iterator[int]:
            for done, step in enumerate(steps):
                progress(done / len(steps))
                yield step

        record_scene(chosen, engines, out, size, show, replayed, track)


@app.command()
def compare(
    scene: options.SceneArgument,
    engines: options.EnginesToCompare = None,
    against: options.Against = None,
    seconds: options.Seconds = None,
    seed: options.Seed = None,
    rate: options.Rate = None,
    inputs: options.Inputs = None,
    json_file: options.JsonFile = None,
    csv_file: options.CsvFile = None,
    report: options.ReportFile = None,
    max_gap: options.MaxGap = None,
    max_energy_error: options.MaxEnergyError = None,
    all_rows: options.AllRows = False,
    first: options.First = False,
    contacts: options.FirstContacts = None,
    advise: Annotated[bool, typer.Option("--advise", help="Try other settings of Pymunk.")] = False,
) -> None:
    """Compare engines: how far apart they are, since when, and why.

    FILE may be -, for standard output. Exit code 1: a limit was exceeded; 2: an engine of your own failed.
    """
    from sandbox.analysis.advice import as_json as advice_as_json
    from sandbox.report.tables import print_advice, print_comparison

    if report and report not in STANDARD_OUTPUT and Path(report).suffix != ".html":
        raise SandboxError(f"{report}: a report must end in .html")
    outputs = {"--json": json_file, "--csv": csv_file, "--report": report}
    check_outputs(outputs, [scene, inputs])
    chosen, replayed = scene_and_inputs(scene, inputs, seconds=seconds, seed=seed, rate=rate)
    with printed_beside(outputs.values()):
        comparison = _compare(chosen, engines, against, replayed)
        trials: Sequence[TriedSettings] = ()
        if advise:
            from sandbox.analysis.advice import try_settings

            with progress_bar("Trying other settings") as progress:
                trials = try_settings(chosen, comparison.against, replayed, progress)
    if json_file:
        write_text(json_file, json_text(comparison.as_json() | advice_as_json(trials)))
    if csv_file:
        write_text(csv_file, comparison.as_csv())
    if report:
        from sandbox.report.comparison_page import page

        write_text(report, page(comparison, trials))
    if not has_document(outputs.values()):
        print_comparison(comparison, console(), all_rows=all_rows, first=first, contacts=contacts)
        if trials:
            print()
            print_advice(trials, console())
    exceeded = list(comparison.exceeded(max_gap, max_energy_error))
    for error in comparison.failed.values():
        print_error(error)
    if exceeded:
        print("\n".join(exceeded), file=sys.stderr)
    if comparison.failed or exceeded:
        raise typer.Exit(2 if comparison.failed else 1)


def _compare(
    scene: "Scene", names: Sequence[str] | None, against: str | None, inputs: "Sequence[Input]"
) -> "Comparison":
    from sandbox.analysis.comparison import compare as compare_engines

    with progress_bar(scene.title or scene.name) as progress:
        return compare_engines(scene, names, against=against, inputs=inputs, progress=progress)


@app.command(context_settings={"allow_interspersed_args": False, "ignore_unknown_options": False})
def watch(
    program: Annotated[str, typer.Argument(metavar="PROGRAM", help="A Python file.")],
    arguments: Annotated[
        list[str] | None, typer.Argument(metavar="ARGUMENTS", help="The program's own arguments and options.")
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option(min=0, help="End after so many seconds of a Space's time. Default with --headless: 20."),
    ] = None,
    headless: Annotated[bool, typer.Option("--headless", help="Run without a window, a display or waiting.")] = False,
    tries: Annotated[
        bool | None,
        typer.Option("--try/--no-tries", help="Run it up to 3 times more, to try cures. Default: with --headless."),
    ] = None,
    parts: Annotated[int, typer.Option(min=1, hidden=True, help="Do each step in so many parts.")] = 1,
    iterations: Annotated[int, typer.Option(min=1, hidden=True, help="Do so many times the iterations.")] = 1,
    costs: Annotated[bool, typer.Option("--costs", hidden=True, help="Write what steps cost to JSON.")] = False,
    json_file: options.JsonFile = None,
) -> None:
    """Run a Pymunk program unchanged, and print what is wrong in its Spaces and what to change.

    The options come before PROGRAM. The diagnosis follows when the program ends, on Ctrl-C, or after --seconds. Exit
    code: that of the program.
    """
    from sandbox.cli.diagnoses import HEADLESS_SECONDS, Report, warn_of_misplaced_options
    from sandbox.scripting.program import run_on_trial
    from sandbox.space.watch import Trials

    check_outputs({"--json": json_file}, [program])
    given = [program, *(arguments or ())]
    warn_of_misplaced_options(given)
    trials = Trials(HEADLESS_SECONDS if headless and seconds is None else seconds, parts, iterations)
    diagnoses = Report(given, trials, json_file, headless if tries is None else tries, costs)
    with printed_beside([json_file]):
        code = run_on_trial(given, trials, diagnoses.write, headless=headless)
    raise typer.Exit(code)


@app.command()
def trace(
    scene: options.SceneArgument,
    engine: options.EngineToTrace,
    seconds: options.Seconds = None,
    seed: options.Seed = None,
    rate: options.Rate = None,
    inputs: options.Inputs = None,
    steps: Annotated[int | None, typer.Option(min=0, help="Steps to run, instead of --seconds.")] = None,
    out: Annotated[str, file_option("A .npz or .csv file; - prints CSV.")] = "-",
) -> None:
    """Write positions and velocities at every step."""
    from sandbox.report.trajectory import simulate, trace_writer

    if steps is not None and seconds is not None:
        raise SandboxError("--steps and --seconds exclude each other")
    check_outputs({"--out": out}, [scene, inputs])
    trace_writer(out)  # rejects an unknown ending before anything runs
    chosen, replayed = scene_and_inputs(scene, inputs, seconds=seconds, seed=seed, rate=rate)
    with printed_beside([out]):
        trajectory = simulate(chosen, engine, steps=steps, inputs=replayed)
    trajectory.save(out)


@app.command()
def verify(
    scenes: Annotated[
        list[str] | None, typer.Argument(metavar="SCENE", help="Files, or bundled scenes. Default: all of these.")
    ] = None,
    engines: options.EnginesToScore = None,
    json_file: options.JsonFile = None,
    tolerance: Annotated[
        float | None, typer.Option(min=0, help="Largest error that passes, in place of the scenes' own.")
    ] = None,
) -> None:
    """Score engines against what scenes expect.

    Each row has the largest error in a scene, as soon as the scene is done; then follows what was missed. "close": no
    further off than steps allow. An engine of your own skips scenes for which it is too slow, unless they are named.
    Exit code 1: an engine named with --engines missed an expectation or broke; without --engines, the exact engine did.
    """
    from sandbox.engines import registry
    from sandbox.report.tables import Scoreboard, print_summary
    from sandbox.scores.verify import PATIENCE, all_passed, as_json
    from sandbox.scores.verify import verify as score_engines
    from sandbox.scripting.calls import scenes_to_score

    check_outputs({"--json": json_file}, scenes or ())
    scored = scenes_to_score(scenes or None)
    names = engines or list(registry())
    printed, board = not has_document([json_file]), {}
    with printed_beside([json_file]), progress_bar("") as progress:
        rows = score_engines(scored, names, tolerance, math.inf if scenes else PATIENCE, progress)
        scoreboard = Scoreboard([scene.name for scene in scored], names, console()) if printed else None
        for scene, row in rows:
            board[scene] = row
            if scoreboard:
                scoreboard.print_row(scene, row)
            for result in row.values():
                if result.details:
                    print(result.details, end="", file=sys.stderr)
    if json_file:
        write_text(json_file, json_text(as_json(board)))
    if printed:
        print_summary(board, console())
    if not all_passed(board, engines):
        raise typer.Exit(1)


@app.command()
def sweep(
    scene: options.SceneArgument,
    seeds: options.Seeds = None,
    rates: options.Rates = None,
    engines: options.Engines = None,
    set_: options.Settings = None,
    against: options.Against = None,
    seconds: options.Seconds = None,
    out: Annotated[str, file_option("Write the table as CSV; - prints it.")] = "-",
    workers: options.Workers = None,
    scheduler: options.Scheduler = None,
) -> None:
    """Run many seeds, rates, engines and settings of a scene.

    The table has a row for each; on Ctrl-C, those that have finished. Exit code 1: some rows are missing, because their
    runs failed.
    """
    from sandbox.scene.files import load
    from sandbox.sweeps import Row, as_csv, in_order, plan
    from sandbox.sweeps.workers import check_scheduler, core_count

    if workers and scheduler is not None:
        raise SandboxError("--workers and --scheduler exclude each other")
    check_outputs({"--out": out}, [scene])
    if scheduler is not None:
        check_scheduler(scheduler)
    chosen = load(scene).changed(**({} if seconds is None else {"seconds": seconds}))
    with printed_beside([out]):
        planned = plan(chosen, seeds, rates, engines, settings_by_key(set_ or ()), against=against)
    rows: list[Row] = []
    try:
        sweep_with_bar(planned, rows, workers or core_count(), scheduler)
    finally:  # also of a sweep that is interrupted
        rows = in_order(planned, rows)
        if rows:
            write_text(out, as_csv(rows))
    if len(rows) < len(planned.jobs):
        raise typer.Exit(1)


@app.command()
def converge(
    scene: options.SceneArgument,
    engines: options.Engines = None,
    rates: options.Rates = None,
    starts: Annotated[int, typer.Option(min=1, help="Starts at each rate, shifted by fractions of a step.")] = 8,
    seed: options.Seed = None,
    seconds: options.Seconds = None,
    json_file: options.JsonFile = None,
) -> None:
    """Measure how fast the errors of engines vanish as the steps become shorter.

    Prints the error at each rate (default 60,120,240,480,960), and the order fitted to them beside that of theory.
    """
    from sandbox.report.tables import print_convergence
    from sandbox.sweeps.convergence import RATES
    from sandbox.sweeps.convergence import converge as measure_order

    check_outputs({"--json": json_file}, [scene])
    chosen, _ = scene_and_inputs(scene, None, seed=seed, seconds=seconds)
    with printed_beside([json_file]), progress_bar(chosen.title or chosen.name) as progress:
        convergence = measure_order(chosen, engines, rates or RATES, starts, progress)
    if json_file:
        write_text(json_file, json_text(convergence.as_json()))
    if not has_document([json_file]):
        print_convergence(convergence, console())


@app.command()
def check(scenes: Annotated[list[str], typer.Argument(metavar="SCENE", help="Files, or bundled scenes.")]) -> None:
    """Check scene files for errors.

    Warnings point out what may be unintended: overlaps, and balls too fast for the time step.
    """
    from sandbox.scene.files import load
    from sandbox.scene.spawn import spawn, warnings

    errors = []
    for name in scenes:
        try:
            scene = load(name)
            initial = spawn(scene)
        except SandboxError as error:
            errors.append(str(error))
            continue
        print(f"{printable(name)}: {counted(len(scene.bodies), 'ball')}, no errors")
        for warning in warnings(scene, initial):
            print(warning)
    if errors:
        raise SandboxError("\n".join(errors))


@app.command()
def scenes() -> None:
    """List the bundled scenes."""
    from sandbox.report.tables import plain_table
    from sandbox.scene.files import scenes as bundled_scenes

    rows = ([name, str(len(scene.bodies)), scene.about] for name, scene in bundled_scenes().items())
    console().print(plain_table(("scene", "balls", "about"), *rows, justify="left"))


@app.command()
def engines(json_file: options.JsonFile = None) -> None:
    """List the engines, and what each supports: features of scenes, and traits."""
    from sandbox.cli.tables import print_engines
    from sandbox.engines.support import as_json
    from sandbox.engines.support import engines as supported_engines

    check_outputs({"--json": json_file})
    supported = supported_engines()
    if json_file:
        write_text(json_file, json_text(as_json(supported)))
    if json_file not in STANDARD_OUTPUT:
        print_engines(supported)


@app.command()
def bench(only: options.Parts = None, json_file: options.JsonFile = None) -> None:
    """Measure the speed of the sandbox, in about two minutes.

    The parts are pymunk, exact, compare and window. A figure with a "/" is a ratio of two measured alternately.
    """
    from sandbox.bench.parts import bench as measure
    from sandbox.cli.tables import print_figures

    check_outputs({"--json": json_file})
    measured = []
    for title, figures in measure(only):
        with console(stderr=True).status(title):
            part = list(figures)
        measured += part
        if json_file not in STANDARD_OUTPUT:
            print_figures(title, part)
    if json_file:
        write_text(json_file, json_text([vars(figure) for figure in measured]))


@app.command(name="schema")
def print_schema() -> None:
    """Print the JSON Schema of scene files."""
    from sandbox.scene.files import schema

    print(json_text(schema()), end="")


def _compare_and_draw(scene: "Scene", names: Sequence[str] | None, inputs: "Sequence[Input]") -> None:
    from sandbox.report.tables import print_comparison
    from sandbox.view.offscreen import record as record_scene

    path = f"{scene.name}-{scene.seed}-{scene.steps:06}.png"
    comparison = _compare(scene, names, None, inputs)
    print_comparison(comparison, console())
    for error in comparison.failed.values():
        print_error(error)
    with suppress(EngineError):  # which the comparison has found too
        record_scene(scene, names, path, (1280, 720), (Layer.CHARTS,), inputs)
    print(f"Picture of the end: {path}")
