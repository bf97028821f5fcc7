"""Tables of engines and benchmarks that fit the terminal."""

from collections.abc import Mapping, Sequence

from rich.table import Table

from sandbox.bench.figure import Figure
from sandbox.compiled import has_numba
from sandbox.engines import check_name, known
from sandbox.engines.support import Support, rows
from sandbox.errors import SandboxError
from sandbox.report.numbers import rounded
from sandbox.report.output import console
from sandbox.report.tables import plain_table


def print_engines(supported: Mapping[str, Support]) -> None:
    """Print what each engine supports, and the engines that are not installed."""
    terminal, words = console(), ("no", "yes")
    lines = ([label, *(words[value] for value in values)] for label, values in rows(supported))
    terminal.print(plain_table(["", *supported], *lines, justify="left"))
    if not has_numba():
        terminal.print("\nnumba is not installed, or may not compile: engines run as Python, slowly with many balls")
    for name in known():
        if name not in supported:
            try:
                check_name(name)
            except SandboxError as error:
                terminal.print(f"\n{error}")


def print_figures(title: str, figures: Sequence[Figure]) -> None:
    """Print measured figures with their spread."""
    table = Table(title=title, title_justify="left", box=None, pad_edge=False)
    table.add_column("", width=42)
    for column in ("median", "lowest", "highest"):
        table.add_column(column, justify="right", width=9)
    table.add_column("")
    for figure in figures:
        values = (figure.median, figure.lowest, figure.highest)
        table.add_row(figure.means, *map(rounded, values), figure.unit)
    console().print(table, "")
