"""Comparisons, advice and scores as text: tables that fit a terminal."""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import zip_longest
from typing import Final

from rich.cells import cell_len
from rich.console import Console, JustifyMethod
from rich.table import Table

from sandbox.analysis.advice import TriedSettings, advice_rows, recommend
from sandbox.analysis.comparison import Comparison
from sandbox.analysis.difference import Difference, pair_name
from sandbox.analysis.figures import Run
from sandbox.analysis.verdict import is_heap, key_figures, summaries
from sandbox.engines import REFERENCE
from sandbox.judge.causes import Cause
from sandbox.judge.thresholds import NEGLIGIBLE
from sandbox.report.first_contacts import first_contacts
from sandbox.scene.model import Scene
from sandbox.scene.units import Dimension, Units
from sandbox.scores.verify import Board, Outcome, Result, tally
from sandbox.sweeps.convergence import Convergence
from sandbox.text import counted

COLUMN_GAP: Final = 2  # columns
MAX_NAME: Final = 24  # columns, beside which an engine's lines begin
MAX_ROWS: Final = 10  # of the table, unless all are asked for
MIN_ENERGY_SHOWN: Final = 5e-7  # fraction of the energy
NOTHING: Final = "-"  # in a cell
FEW_BALLS: Final = 5  # with no more, the motion at the first contacts is shown
FIRST_CONTACTS: Final = 2
SCORE_WIDTH: Final = len("1.2e+02 MISSED")  # columns


def print_comparison(
    comparison: Comparison,
    terminal: Console,
    *,
    all_rows: bool = False,
    first: bool = False,
    contacts: int | None = None,
) -> None:
    """Print a comparison: what is said of each engine, and its figures.

    all_rows: whether the table has more than MAX_ROWS; first: whether the first difference of each engine follows;
    contacts: of how many contacts of each engine the motion follows, by default of the reference's if balls are few.
    """
    scene = comparison.scene
    terminal.print(f"{headline(comparison)}\n")
    width = max(map(cell_len, [*comparison.runs, *comparison.failed]))
    for engine, lines in summaries(comparison).items():
        _print_beside(engine, lines, width, terminal)
    rows = list(comparison_rows(comparison))
    shown = rows if all_rows else rows[:MAX_ROWS]
    if shown or comparison.failed:
        terminal.print()
        terminal.print(_figures(comparison, shown, terminal.width))
    if any(scene.gravity) and any(label.startswith("energy") for label, *_ in shown):
        terminal.print(f"\nEnergies are in % of the largest kinetic energy in {comparison.against}.")
    if more := len(rows) - len(shown):
        terminal.print(f"\n{counted(more, 'more row')} with --all.")
    if contacts is None and len(scene.bodies) <= FEW_BALLS:
        _print_first_contacts(scene, comparison.against, comparison.runs[comparison.against], FIRST_CONTACTS, terminal)
    elif contacts:
        for name, run in comparison.runs.items():
            _print_first_contacts(scene, name, run, contacts, terminal)
    for name, run in comparison.runs.items() if first else ():
        if difference := run.figures.first_difference:
            terminal.print(f"\n{name}, {sentence(scene, difference)}")
            for line in velocities_and_spins(scene, difference):
                terminal.print(line)


def _print_beside(engine: str, lines: Sequence[str], width: int, terminal: Console) -> None:
    """Print an engine's lines to the right of its name, or below a name that is long."""
    if width > MAX_NAME:
        terminal.print(engine, soft_wrap=True)
        width, engine = 0, ""
    table = Table(box=None, pad_edge=False, show_header=False, padding=(0, 3, 0, 0))
    table.add_column(width=width)
    table.add_column(overflow="fold")
    for number, line in enumerate(lines):
        table.add_row("" if number else engine, line)
    terminal.print(table)


def _figures(comparison: Comparison, rows: Sequence[Sequence[str]], width: int) -> Table:
    """Return the table of figures for a terminal of some width."""
    table = Table(box=None, pad_edge=False)
    table.add_column("", overflow="fold")
    names = [*comparison.runs, *comparison.failed]
    columns = zip_longest(("", *names), *rows, fillvalue="")
    if sum(COLUMN_GAP + max(map(cell_len, column)) for column in columns) - COLUMN_GAP > width:
        names = [name.replace("(", "\n(") for name in names]  # rather than anywhere
    for name in names:
        table.add_column(name, justify="right", overflow="fold")
    if comparison.failed:
        failures = (f"failed at {error.time:.3f} s" for error in comparison.failed.values())
        table.add_row("", *([""] * len(comparison.runs)), *failures)
    for label, *values in rows:
        table.add_row(label, *values)
    return table


def _print_first_contacts(scene: Scene, engine: str, run: Run, most: int, terminal: Console) -> None:
    """Print the motion of both bodies before and after the first contacts of an engine."""
    contacts = list(first_contacts(scene, run, most))
    if contacts:
        first = f"The first {len(contacts)} of " if len(contacts) > 1 else "The first of "
        first_of = first if len(contacts) < len(run.contacts) else ""
        terminal.print(f"\n{first_of}{counted(len(run.contacts), 'contact')} in {engine}:")
    for title, rows in contacts:
        terminal.print(f"\n{title}")
        terminal.print(plain_table(*rows))


def sentence(scene: Scene, difference: Difference) -> str:
    """Return when two bodies differ from the reference, which these are, and why."""
    return f"{difference.time:.3f} s, {pair_name(scene, difference)}: {difference.because}"


def headline(comparison: Comparison) -> str:
    """Return a line on what ran: the scene, its balls, its duration and rate, seed and reference."""
    scene = comparison.scene
    edited = f" after the last edit at {comparison.since:g} s" if comparison.since else ""
    against = f"; reference: {comparison.against}" if comparison.others else ""
    return (
        f"{scene.title or scene.name}: {counted(len(scene.bodies), 'ball')}, {comparison.time[-1]:.10g} s{edited} "
        f"{scene.clock}, seed {scene.seed}{against}"
    )


def velocities_and_spins(scene: Scene, difference: Difference) -> Iterator[str]:
    """Yield the velocities before and after a step, and the spins if a ball turns."""
    yield _velocities(scene.units, difference)
    if spins := _spins(scene, difference):
        yield spins


def _velocities(units: Units, difference: Difference) -> str:
    """Return a sentence with the velocities before and after a step, and after the exact step from the same state."""
    factor, unit = units.factor(Dimension.VELOCITY), units.name(Dimension.VELOCITY)
    before, after, should = (
        " and ".join(f"({factor * x + 0.0:.4g}, {factor * y + 0.0:.4g})" for x, y in each)
        for each in (difference.before, difference.after, difference.should_after)
    )
    if after == should:
        return (
            f"Velocities, {unit}: {before} before the step, and {after} after it, as they should be. Places are wrong."
        )
    exactly = f"; exactly, {should} after it" if should else ""
    return f"Velocities, {unit}: {before} before the step, {after} after it{exactly}."


def _spins(scene: Scene, difference: Difference) -> str:
    """Return the same of the balls' spins; empty if none turns but by rounding."""
    spins = difference.spin_before, difference.spin_after, difference.should_spin_after
    velocities = difference.before, difference.after, difference.should_after
    fastest = max(math.hypot(*velocity) for each in velocities for velocity in each)
    if max(abs(spin) for each in spins for spin in each) * scene.bodies.radius.max() <= NEGLIGIBLE * fastest:
        return ""
    before, after, should = (" and ".join(f"{spin + 0.0:.4g}" for spin in each) for each in spins)
    return f"Spins, rad/s: {before} before the step, {after} after it{f'; exactly, {should}' if should else ''}."


def comparison_rows(comparison: Comparison) -> Iterator[list[str]]:
    """Yield the rows of a comparison's table: a label, and a value for each engine.

    The energies of causes come by size. Of a heap they are left out: the reference cannot account for them.
    """
    runs = comparison.runs.values()
    yield from key_figures(comparison)
    of_causes = {
        cause: [run.energy_by_cause.get(cause, 0.0) / (run.energy_scale or math.inf) for run in runs] for cause in Cause
    }
    for cause in () if is_heap(comparison) else sorted(of_causes, key=lambda cause: -max(map(abs, of_causes[cause]))):
        values = [share_text(share) for share in of_causes[cause]]
        if any(value != NOTHING for value in values):
            yield [f"energy: {cause.label}", *values]
    for number, row in enumerate(next((run.theory for run in runs if run.theory), ())):
        of_runs = [run.theory[number] if run.theory else None for run in runs]
        yield [row.figure, *(f"{figure.measured:.4g}" if figure else "-" for figure in of_runs)]
        yield [f"  expected ({row.because})", *(f"{figure.expected:.4g}" if figure else "-" for figure in of_runs)]


def share_text(share: float) -> str:
    """Return a fraction of the scale of energy in %, or NOTHING if it is small."""
    return f"{100 * share:+.3g} %" if abs(share) > MIN_ENERGY_SHOWN else NOTHING


def print_convergence(convergence: Convergence, terminal: Console) -> None:
    """Print the errors of engines at each rate, the orders fitted to them, and what theory expects."""
    scene, (errors, *_) = convergence.scene, convergence.errors.values()
    terminal.print(
        f"{scene.title or scene.name}: seed {scene.seed}, {scene.seconds:.4g} s, RMS distance from {REFERENCE}, the "
        f"median of {counted(errors.shape[1], 'start')}\n"
    )
    terminal.print(plain_table(*convergence.table()))
    for sentence in convergence.sentences():
        terminal.print(f"\n{sentence}")


def plain_table(labels: Sequence[str], *rows: Sequence[str], justify: JustifyMethod = "right") -> Table:
    """Return a table whose first column is text; justify: how the others are, by default as figures."""
    table = Table(box=None, pad_edge=False)
    for number, label in enumerate(labels):
        table.add_column(label, justify=justify if number else "left", overflow="fold")
    for row in rows:
        table.add_row(*row)
    return table


class Scoreboard:
    """Prints scores as they come: a row for each scene, a column for each engine; on a narrow terminal, a line each."""

    def __init__(self, scenes: Sequence[str], engines: Sequence[str], terminal: Console) -> None:
        self._terminal = terminal
        self._widths = {engine: max(SCORE_WIDTH, cell_len(engine)) for engine in engines}
        self._name_width = max(map(cell_len, ("scene", *scenes)))
        columns = sum(COLUMN_GAP + width for width in self._widths.values())
        self._is_wide = self._name_width + columns <= self._terminal.width
        if self._is_wide:
            self._print("scene", {engine: engine for engine in engines})

    def print_row(self, scene: str, row: Mapping[str, Result]) -> None:
        """Print the scores of one scene, unless no engine runs any more."""
        if any(result.outcome is not Outcome.NOT_RUN for result in row.values()):
            self._print(scene, {engine: _cell(result) for engine, result in row.items()})

    def _print(self, scene: str, cells: Mapping[str, str]) -> None:
        if self._is_wide:
            gaps = {name: " " * (COLUMN_GAP + self._widths[name] - cell_len(cell)) for name, cell in cells.items()}
            padded = "".join(gaps[name] + cell for name, cell in cells.items())
            lines = [scene + " " * (self._name_width - cell_len(scene)) + padded]
        else:
            labels = max(map(cell_len, cells))
            lines = [scene, *(f"  {name}{' ' * (labels - cell_len(name))}  {cell}" for name, cell in cells.items())]
        for line in lines:
            self._terminal.print(line, soft_wrap=True)


def print_advice(trials: Sequence[TriedSettings], terminal: Console) -> None:
    """Print the results of other settings of Pymunk, and what to change."""
    terminal.print(plain_table(*([row[0].replace(", ", ",\n"), *row[1:]] for row in advice_rows(trials))))
    terminal.print(f"\n{recommend(trials)}")


def print_scores(board: Board, terminal: Console) -> None:
    """Print all scores, and what they come to."""
    scoreboard = Scoreboard(list(board), list(next(iter(board.values()))), terminal)
    for scene, row in board.items():
        scoreboard.print_row(scene, row)
    print_summary(board, terminal)


def _cell(result: Result) -> str:
    if result.outcome in (Outcome.MET, Outcome.CLOSE, Outcome.MISSED):
        return f"{result.worst.error:.1e} {result.outcome.value}"
    word: str = result.outcome.value
    return word


def print_summary(board: Board, terminal: Console) -> None:
    """Print what each engine missed most in each scene, what could not be judged, what broke, and the tally."""
    for scene, row in board.items():
        for engine, result in row.items():
            if result.outcome in (Outcome.MET, Outcome.REFUSED, Outcome.NOT_RUN) and not any(
                score.skipped for score in result.scores
            ):
                continue
            first, *others = result.lines
            more = f" ({len(others)} more)" if others else ""
            when = "" if result.time is None else f" at {result.time:.3f} s"
            terminal.print(f"\n{scene}, {engine}{more}{when}: {first.removeprefix(f'{engine}: ')}")
    terminal.print("", *tally_lines(board), sep="\n")


def tally_lines(board: Board) -> Iterator[str]:
    """Yield a line for each engine: in how many scenes it met all expectations, missed one and so on."""
    for engine, count in tally(board).items():
        met = count.pop(Outcome.MET, 0)
        others = "".join(f", {number} {outcome.name.lower().replace('_', ' ')}" for outcome, number in count.items())
        yield f"{engine}: {met} of {counted(len(board), 'scene')} met{others}"
