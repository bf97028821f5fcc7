"""The order of convergence of engines: how fast their error vanishes as the steps become shorter.

Where in a step a contact falls decides how late an engine finds it, so the errors of one run at several rates scatter.
Each rate is therefore run from several starts, shifted along the exact path by equal fractions of a step.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any, Final, NamedTuple

import numpy as np

from sandbox.analysis.comparison import compare
from sandbox.analysis.verdict import why_it_ends
from sandbox.engines import REFERENCE, Engines, Source, create, resolved
from sandbox.engines.engine import advance
from sandbox.engines.specs import TUNED
from sandbox.errors import SandboxError
from sandbox.judge.thresholds import DOUBLE
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.scene.units import Dimension
from sandbox.state import Contacts, Floats, State, States
from sandbox.sweeps.jobs import sources_of

RATES: Final = (60, 120, 240, 480, 960)
STARTS: Final = 8
MIN_RATES: Final = 3  # that a fit with a spread needs
MAX_SPREAD: Final = 0.25  # standard error of an order; twice as much is half the distance to the next whole order


class Law(NamedTuple):
    """The order that theory expects, and why; None of an engine of which it is not known."""

    order: int | None
    because: str


class Fit(NamedTuple):
    """An order fitted to errors, and its standard error; None of both if there is no order, and why."""

    order: float | None
    spread: float | None
    why_none: str = ""

    def __str__(self) -> str:
        """Return the order with its standard error, as in "1.07 ± 0.02"."""
        return "none" if self.order is None else f"{self.order + 0.0:.2f} ± {self.spread:.1g}"


@dataclass(frozen=True, repr=False)
class Convergence:
    """The errors of engines at several rates.

    scene: with its seconds as the runs had them; errors: by engine, (rates, starts) px, the RMS distance from the exact
    engine over balls and steps; laws: by engine; cut: why the runs were shorter than the scene, empty if they were not.
    """

    scene: Scene
    rates: Sequence[int]
    errors: Mapping[str, Floats]
    laws: Mapping[str, Law]
    cut: str

    def __repr__(self) -> str:
        return (
            f"<Convergence: {self.scene.name}, {', '.join(f'{engine} {self.fit(engine)}' for engine in self.errors)}>"
        )

    def middle(self, engine: str) -> Floats:
        """Return the median over the starts at each rate, (rates,) px."""
        return np.array([median(errors) for errors in self.errors[engine].tolist()])

    def fit(self, engine: str) -> Fit:
        """Fit a straight line to the logarithms of error and rate by least squares.

        Errors below a billionth of a radius are rounding, and left out. Errors of a radius or more are not small, so
        that they do not grow in proportion to what caused them.
        """
        errors, radius = self.middle(engine), float(self.scene.bodies.radius.min())
        kept = errors > DOUBLE * radius
        if np.count_nonzero(kept) < MIN_RATES:
            return Fit(None, None, "only rounding is left")
        if errors.max() >= radius:
            return Fit(None, None, "the errors are not small, but a ball's radius or more; try fewer seconds")
        x, y = np.log(np.array(self.rates)[kept]), np.log(errors[kept])
        slope, offset = np.polyfit(x, y, 1)
        left = y - offset - slope * x
        spread = np.sqrt(left @ left / (len(x) - 2) / np.sum((x - x.mean()) ** 2))
        if spread > MAX_SPREAD:
            return Fit(None, None, "the errors do not shrink steadily; try fewer seconds, or more starts")
        return Fit(-float(slope), float(spread))

    def table(self) -> Iterator[list[str]]:
        """Yield the rows of a table: the labels, then each engine's median errors, fitted order and law."""
        yield ["steps per second", *self.errors]
        middles = [self.middle(engine) for engine in self.errors]
        for rate, *errors in zip(self.rates, *middles, strict=True):
            shown = (self.scene.units.text(Dimension.LENGTH, "{:.3g}", error) for error in errors)
            yield [f"{rate:,}", *shown]
        yield ["order", *(str(self.fit(engine)) for engine in self.errors)]
        yield ["by theory", *("-" if law.order is None else str(law.order) for law in self.laws.values())]

    def sentences(self) -> Iterator[str]:
        """Yield why the runs were cut short, and for each engine why it has no order, and what theory expects."""
        if self.cut:
            yield f"The runs end at {self.scene.seconds:.3g} s: {self.cut}."
        for engine, law in self.laws.items():
            expected = "no order is expected" if law.order is None else f"theory expects order {law.order}"
            why_none = self.fit(engine).why_none
            yield f"{engine}: {f'no order: {why_none}; ' if why_none else ''}{expected}, because {law.because}."

    def as_json(self) -> dict[str, Any]:
        """Return what `--json` writes."""
        return {
            "scene": self.scene.name,
            "seed": self.scene.seed,
            "seconds": self.scene.seconds,
            "rates": list(self.rates),
            "engines": {
                engine: {
                    "order": fit.order,
                    "spread": fit.spread,
                    "why_none": fit.why_none,
                    "expected": self.laws[engine].order,
                    "because": self.laws[engine].because,
                    "median": self.middle(engine).tolist(),
                    "errors": errors.tolist(),
                }
                for engine, errors in self.errors.items()
                for fit in [self.fit(engine)]
            },
        }


def converge(
    scene: Scene,
    engines: Engines | None = None,
    rates: Sequence[int] = RATES,
    starts: int = STARTS,
    progress: Callable[[float], object] | None = None,
) -> Convergence:
    """Run engines at several rates, from several starts each, and measure how far they are from the exact engine.

    The runs last for the scene's seconds, or up to the step in which the paths of `exact` lose their meaning. progress:
    called now and then with the fraction that is done. Raises SandboxError for fewer than three different rates, and if
    too little of the run means anything; Refused if an engine cannot run the scene.
    """
    rates = sorted(set(rates))
    if len(rates) < MIN_RATES:
        raise SandboxError(f"rates: an order needs at least {MIN_RATES} rates, such as 60,120,240, got {len(rates)}")
    scene = scene.changed(expect=())
    sources = sources_of(engines, scene)
    for engine, source in sources.items():
        create(source, scene, spawn(scene), engine)
    reference = compare(scene, [REFERENCE])
    end = np.inf if reference.trusted_until is None else reference.trusted_until - 1 / scene.rate  # the step before
    until = min(float(reference.time[-1]), end)
    if until < 2 / rates[0]:
        raise SandboxError(
            f"{scene.name}: the paths of {REFERENCE} mean something for {until:.3g} s only, which is less than two "
            f"steps at {rates[0]} per second"
        )
    cut = why_it_ends(reference) if until < scene.seconds else ""
    laws = {engine: law_of(engine, scene, reference.runs[REFERENCE].contacts) for engine in sources}
    scene, errors = scene.changed(seconds=until), {engine: np.empty((len(rates), starts)) for engine in sources}
    done, work = 0, starts * sum(rates) * (1 + len(sources))
    for row, rate in enumerate(rates):
        at_rate = scene.changed(rate=rate)
        steps = at_rate.steps - 1  # the last start is almost a step later
        for column, start in enumerate(_shifted_starts(at_rate, starts)):
            exact = _positions(REFERENCE, REFERENCE, at_rate, start, steps)
            for engine, source in sources.items():
                away = _positions(engine, source, at_rate, start, steps) - exact
                errors[engine][row, column] = np.sqrt(np.mean(np.sum(away**2, axis=-1)))
            done += rate * (1 + len(sources))
            if progress:
                progress(done / work)
    return Convergence(scene, rates, errors, laws, cut)


def _shifted_starts(scene: Scene, count: int) -> Iterator[State]:
    """Yield states of the exact path, from the start on, equal fractions of a step apart."""
    engine = create(REFERENCE, scene.changed(rate=scene.rate * count), spawn(scene))
    for _ in range(count):
        now = engine.state()
        yield State(0.0, now.position, now.velocity, now.angle, now.spin)
        engine.step()


def _positions(engine: str, source: Source, scene: Scene, start: State, steps: int) -> Floats:
    """Run an engine, and return the positions after each step: (steps, n, 2) px."""
    states = States.empty(steps, len(scene.bodies))
    advance(create(source, scene, start, engine), states)
    return states.position


def law_of(engine: str, scene: Scene, contacts: Contacts) -> Law:
    """Return the order that theory expects of an engine in a run with some contacts of the exact engine.

    Sources: docs/method.md, "The order of convergence".
    """
    name, with_settings = resolved(engine, scene)
    meet, touch = bool((contacts["second"] >= 0).any()), len(contacts) > 0
    late = "a contact is found at the end of its step, up to a step late"
    flight = "positions and velocities change in turn under gravity"
    reasons = [reason for reason, holds in ((late, touch), (flight, any(scene.gravity))) if holds]
    laws = (  # the first that holds
        (name == REFERENCE, Law(None, "it takes no steps: only rounding is left")),
        (name == "impulse" and meet, Law(1, late)),
        (name == "impulse" and scene.walls, Law(None, "bounces off the sides of walls give 2, and off their ends 1")),
        (name == "impulse", Law(2, "flight is exact, and a bounce off a straight wall is corrected for its delay")),
        (name == "article" and meet, Law(0, "the impulse is wrong at every rate")),
        (name == "article", Law(1, late)),
        (name == TUNED and with_settings.pymunk.damping not in (None, 1), Law(0, "it damps velocities at every rate")),
        (name == TUNED and not reasons, Law(None, "nothing acts, so only rounding is left")),
        (name == TUNED, Law(1, "; ".join(reasons))),
        (True, Law(None, "the sandbox does not know how this engine works")),
    )
    return next(law for holds, law in laws if holds)
