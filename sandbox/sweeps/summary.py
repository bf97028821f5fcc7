"""A sweep's rows in words and in a table: which engine comes closest to the reference, and which loses energy."""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from statistics import median
from typing import Any, Final, NamedTuple

from sandbox.analysis.verdict import NEGLIGIBLE_ENERGY
from sandbox.engines import settings_in, with_settings
from sandbox.engines.specs import format_settings, parse_settings
from sandbox.scene.units import Dimension, Units
from sandbox.sweeps.jobs import OF_PYMUNK, Row, Sweep
from sandbox.text import counted, listed

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
    """Return the name of a row's engine, with the settings of Pymunk as in a spec, and keys of the scene after it."""
    name, values = settings_in(row["engine"])
    chosen: dict[str, Any] = parse_settings(row["settings"], row["settings"]) if row["settings"] else {}
    own_settings = values | {key: value for key, value in chosen.items() if key in OF_PYMUNK}
    of_scene = {key: value for key, value in chosen.items() if key not in OF_PYMUNK}
    return ", ".join([with_settings(name, own_settings)] + ([format_settings(of_scene)] if of_scene else []))


def grouped(rows: Sequence[Row]) -> Groups:
    """Return the rows of each engine and rate: engines in the order of the rows, and their rates ascending."""
    names = list(dict.fromkeys(map(engine_of, rows)))
    groups: dict[Group, list[Row]] = defaultdict(list)
    for row in sorted(rows, key=lambda row: (names.index(engine_of(row)), row["rate"])):
        groups[Group(engine_of(row), row["rate"])].append(row)
    return groups


def trusted(row: Row) -> bool:
    """Return whether the reference's paths mean something to the end of a run, so that its gap does."""
    return all(row.get(end) is None for end in ENDS)


def known(rows: Sequence[Row], figure: str) -> list[float]:
    """Return a figure of each row that has it."""
    return [row[figure] for row in rows if row.get(figure) is not None]


def lengths(units: Units, rows: Sequence[Row], figure: str) -> tuple[float, ...]:
    """Return a figure of each row that has it, a length, as it is shown."""
    return units.scaled(Dimension.LENGTH, *known(rows, figure))


def summary(sweep: Sweep, rows: Sequence[Row]) -> str:
    """Return a paragraph: what ran, until when the reference means anything, gaps, energy, escapes."""
    if not rows:
        return f"None of {counted(len(sweep.jobs), 'run')} finished."
    sentences = (part(sweep, rows) for part in (_finished, _trust, _gaps, _energy, _escapes))
    return " ".join(sentence for sentence in sentences if sentence)


def _finished(sweep: Sweep, rows: Sequence[Row]) -> str:
    if len(rows) == len(sweep.jobs):
        return f"All {counted(len(rows), 'run')} finished." if len(rows) > 1 else "The run finished."
    return f"{len(rows):,} of {counted(len(sweep.jobs), 'run')} finished; the others failed, and are missing here."


def _trust(sweep: Sweep, rows: Sequence[Row]) -> str:
    """Say in how many runs the reference's paths mean nothing from a time on."""
    ends = [min(row[end] for end in ENDS if row.get(end) is not None) for row in rows if not trusted(row)]
    if not ends:
        return ""
    when = f"the earliest at {min(ends):.2f} s" if len(ends) > 1 else f"at {ends[0]:.2f} s"
    return (
        f"In {len(ends):,} of them the paths of {sweep.against} mean nothing from some time on, {when}: gaps after "
        "that say nothing of an engine, and are left out of this comparison."
    )


def _gaps(sweep: Sweep, rows: Sequence[Row]) -> str:
    """Name the groups with the smallest and the largest median gap."""
    units = sweep.scene.units
    gaps = {
        group: lengths(units, [row for row in of_group if trusted(row)], "gap_rms")
        for group, of_group in _rivals(sweep, rows)
    }
    ranked = sorted((group for group, values in gaps.items() if values), key=lambda group: median(gaps[group]))
    if not ranked:
        return ""
    closest, furthest = ranked[0], ranked[-1]
    if furthest != closest and max(gaps[closest]) >= min(gaps[furthest]):  # then the ranking may be chance
        medians = [f"{median(gaps[group]):.3g}" for group in (closest, furthest)]
        ends = " to ".join(medians)
        alike = f"The RMS gaps to {sweep.against} are alike: their medians are {ends} {units.length}"
        return f"{alike}, and their ranges overlap."
    sentence = f"{closest} comes closest to {sweep.against}, with an RMS gap of {spread(gaps[closest], units.length)}"
    if furthest == closest:
        return f"The RMS gap of {closest} to {sweep.against} is {spread(gaps[closest], units.length)}."
    return f"{sentence}; {furthest} is furthest from it, with {spread(gaps[furthest], units.length)}."


def _energy(sweep: Sweep, rows: Sequence[Row]) -> str:
    """Name the run with the largest energy error, and say who has none."""
    errors = {group: known(of_group, "energy_error") for group, of_group in _rivals(sweep, rows)}
    largest: dict[str, float] = {}
    for group, values in errors.items():
        largest[group.engine] = max([largest.get(group.engine, 0.0), *values])
    if not any(errors.values()):
        return ""
    worst = max((group for group in errors if errors[group]), key=lambda group: max(errors[group]))
    none = [name for name, error in largest.items() if error <= NEGLIGIBLE_ENERGY]
    if max(errors[worst]) <= NEGLIGIBLE_ENERGY:
        return "No engine has an error in energy."
    sentence = f"The largest energy error is {100 * max(errors[worst]):.3g} % of the energy, in a run of {worst}"
    return f"{sentence}; {listed(none)} {'has' if len(none) == 1 else 'have'} none." if none else f"{sentence}."


def _escapes(sweep: Sweep, rows: Sequence[Row]) -> str:
    """Say in how many runs of which engine balls left the arena."""
    runs: dict[str, int] = defaultdict(int)
    for row in rows:
        runs[engine_of(row)] += bool(row.get("escaped"))
    where = ", ".join(f"in {counted(count, 'run')} of {name}" for name, count in runs.items() if count)
    return f"Balls left the arena {where}." if where else ""


def _rivals(sweep: Sweep, rows: Sequence[Row]) -> Iterator[tuple[Group, Sequence[Row]]]:
    """Yield the groups of all engines but the reference."""
    for group, of_group in grouped(rows).items():
        if of_group[0]["engine"] != sweep.against:
            yield group, of_group


def spread(values: Sequence[float], unit: str) -> str:
    """Return the median and, if there are several values, their range."""
    middle = f"{median(values):.3g} {unit}"
    return f"{middle} ({min(values):.3g} to {max(values):.3g} over {len(values)} seeds)" if len(values) > 1 else middle


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
