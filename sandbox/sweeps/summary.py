"""A sweep's rows in words and in a table."""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from statistics import median
from typing import Final, NamedTuple

from sandbox.analysis.verdict import NEGLIGIBLE_ENERGY
from sandbox.engines.specs import format_settings
from sandbox.scene.units import Dimension, Units
from sandbox.sweeps.jobs import OF_CONTACTS, Job, Row, Sweep
from sandbox.text import counted

LEAST_ENERGY: Final = 100 * NEGLIGIBLE_ENERGY  # %; what is less is rounding
ENDS: Final = ("horizon", "undecided", "unresolved")  # what ends the time in which the reference's paths mean anything


class Group(NamedTuple):
    """The runs of one engine at one rate, with one choice of settings: `engine` names both."""

    engine: str
    rate: int

    def __str__(self) -> str:
        """Return the group in words."""
        return f"{self.engine} at {counted(self.rate, 'step')} per second"


Groups = Mapping[Group, Sequence[Row]]


def engine_of(row: Row) -> str:
    """Return the name of a row's engine, with the settings of Pymunk as in a spec, and those of contacts after it."""
    job = Job(0, row["rate"], row["engine"], row["settings"])
    return ", ".join(filter(None, (job.spec, format_settings(job.values(OF_CONTACTS)))))


def grouped(rows: Sequence[Row]) -> Groups:
    """Return the rows of each engine and rate: engines in the order of the rows, and their rates ascending."""
    names = list(dict.fromkeys(map(engine_of, rows)))
    groups: dict[Group, list[Row]] = defaultdict(list)
    for row in sorted(rows, key=lambda row: (names.index(engine_of(row)), row["rate"])):
        groups[Group(engine_of(row), row["rate"])].append(row)
    return groups


def known(rows: Sequence[Row], figure: str) -> list[float]:
    """Return a figure of each row that has it."""
    return [row[figure] for row in rows if row.get(figure) is not None]


def lengths(units: Units, rows: Sequence[Row], figure: str) -> tuple[float, ...]:
    """Return a figure of each row that has it, a length, as it is shown."""
    return units.scaled(Dimension.LENGTH, *known(rows, figure))


def summary(sweep: Sweep, rows: Sequence[Row]) -> str:
    """Return how many runs finished, and in how many of them gaps mean nothing from a time on."""
    whole = f"{len(rows):,} of {counted(len(sweep.jobs), 'run')} finished"
    failed = "." if len(rows) == len(sweep.jobs) else "; the others failed, and are missing here."
    ends = [min(found) for row in rows if (found := [row[end] for end in ENDS if row.get(end) is not None])]
    if not ends:
        return f"{whole}{failed}"
    return (
        f"{whole}{failed} In {len(ends):,} of them the paths of {sweep.against} mean nothing from some time on, the "
        f"earliest at {min(ends):.2f} s: gaps after that say nothing of an engine."
    )


def summary_rows(sweep: Sweep, rows: Sequence[Row]) -> Iterator[list[str]]:
    """Yield the rows of a table: the labels, then the median and range of each group's figures."""
    yield ["engine", "runs", f"RMS gap, {sweep.scene.units.length}", "first difference, s", "energy error, %"]
    for group, of_group in grouped(rows).items():
        figures = (
            lengths(sweep.scene.units, of_group, "gap_rms"),
            known(of_group, "first_difference.time"),
            [max(100 * error, LEAST_ENERGY) for error in known(of_group, "energy_error")],
        )
        yield [str(group), str(len(of_group)), *map(_median_and_range, figures)]


def _median_and_range(values: Sequence[float]) -> str:
    if not values:
        return "-"
    ends = f" ({_figure(min(values))} to {_figure(max(values))})" if min(values) < max(values) else ""
    return f"{_figure(median(values))}{ends}"


def _figure(value: float) -> str:
    return f"< {LEAST_ENERGY:g}" if value == LEAST_ENERGY else f"{value:.3g}"
