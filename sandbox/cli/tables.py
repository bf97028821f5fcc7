"""Tables of advice and benchmarks that fit the terminal."""

from collections.abc import Mapping, Sequence
from typing import Final

from rich.cells import cell_len
from rich.padding import Padding
from rich.table import Table

from sandbox.analysis.advice import Trial, advice_rows, recommend
from sandbox.bench.figure import Figure, worse
from sandbox.text import console, counted

COLUMN_GAP: Final = 2  # columns


def print_advice(trials: Sequence[Trial]) -> None:
    """Print the results of other settings of Pymunk, if some were tried."""
    if not trials:
        return
    terminal = console()
    terminal.print()
    labels, *rows = [[row[0].replace(", ", ",\n"), *row[1:]] for row in advice_rows(trials)]
    widths = [max(map(cell_len, "\n".join(column).split("\n"))) for column in zip(labels, *rows, strict=True)]
    if sum(widths) + COLUMN_GAP * (len(widths) - 1) <= terminal.width:
        table = Table(box=None, pad_edge=False)
        for number, label in enumerate(labels):
            table.add_column(label, justify="right" if number else "left")
        for row in rows:
            table.add_row(*row)
        terminal.print(table)
    else:
        for settings, *values in rows:
            terminal.print(f"{labels[0]} {' '.join(settings.split())}:")
            pairs = (f"{label} {value}" for label, value in zip(labels[1:], values, strict=True))
            terminal.print(Padding("; ".join(pairs), (0, 0, 0, 2)))
    terminal.print(f"\n{recommend(trials)}")


def print_figures(title: str, figures: Sequence[Figure]) -> None:
    """Print measured figures with their spread."""
    table = Table(title=title, title_justify="left", box=None, pad_edge=False)
    table.add_column("", width=42)
    for column in ("median", "lowest", "highest"):
        table.add_column(column, justify="right", width=9)
    table.add_column("")
    for figure in figures:
        values = (figure.median, figure.lowest, figure.highest)
        table.add_row(figure.means, *map(_rounded, values), figure.unit)
    console().print(table, "")


def print_worse(figures: Sequence[Figure], earlier: Mapping[str, Figure]) -> None:
    """Print which figures are worse than those of an earlier benchmark, and how many were compared."""
    worsened, common = worse(figures, earlier), [figure for figure in figures if figure.name in earlier]
    if worsened:
        table = Table(title="Worse by more than the spread", title_justify="left", box=None, pad_edge=False)
        table.add_column("", width=42)
        for column in ("before", "now", "ratio"):
            table.add_column(column, justify="right", width=9)
        table.add_column("")
        for figure in worsened:
            before, now = earlier[figure.name].median, figure.median
            ratio = _rounded(now / before) if before else "-"
            table.add_row(figure.name, _rounded(before), _rounded(now), ratio, figure.unit)
        console().print(table, "")
    print(f"{counted(len(common), 'figure')} compared, {len(worsened)} worse")


def _rounded(value: float) -> str:
    return f"{value:,.0f}" if abs(value) >= 100 else f"{value:.3g}"
