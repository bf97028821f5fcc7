"""The comparison of a Space with itself in finer steps, in words and as JSON."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

from sandbox.errors import SandboxError
from sandbox.space.evidence import Evidence
from sandbox.space.findings import BodyReport, Finding, found_by
from sandbox.space.finer import COMPARED_RULES, Compared, Finer, Tried, finer, functions
from sandbox.space.replay import Numbers
from sandbox.text import listed

ENOUGH: Final = 0.9  # of the error: what costs more and removes more is not recommended
LEAST_REMOVED: Final = 0.05  # of the error: what removes less is only named
LEAST_BY_ORDER: Final = 0.25  # of the error: rounding alone may change a tenth of it
SMALLEST_SHOWN: Final = 0.001  # px, of an error bar


@dataclass(frozen=True)
class AgainstFiner:
    """A comparison with finer steps, and the evidence that names bodies; or why it was not made."""

    evidence: Evidence
    finer: Finer | None
    why_not: str = ""

    @classmethod
    def of(cls, evidence: Evidence) -> "AgainstFiner":
        """Compare a recording, which may take half a minute."""
        try:
            return cls(evidence, finer(evidence.recording))
        except SandboxError as error:
            return cls(evidence, None, str(error))

    def findings(self, seen: Iterable[Finding]) -> list[Finding]:
        """Return what the comparison shows. seen: what else was found."""
        if self.finer is None:
            return []
        named = {finding.rule: {body.index for body in finding.bodies} for finding in seen}
        return found_by(COMPARED_RULES, Compared(self.evidence, self.finer, named))

    def paragraphs(self) -> Iterator[str]:
        """Yield it as text, a paragraph each."""
        if self.finer is None:
            yield f"Not compared with finer steps: {self.why_not}."
            return
        yield f"Compared with itself in finer steps, {self.reference}: {self._error(self.finer)}"
        if self.finer.tried:
            yield f"{_advice(self.finer.tried)}{_order(self.finer)}"
        if coverage := " ".join(self._coverage(self.finer)):
            yield coverage

    def as_json(self) -> dict[str, Any] | None:
        """Return it as a JSON document has it, None if there is no comparison."""
        if self.finer is None:
            return None
        found, (step, body) = self.finer, self.finer.worst
        return {
            "substeps": found.finest.substeps,
            "iterations": self._iterations,
            "until": found.script.steps[found.last].end,
            "error": found.largest,
            "error_bar": float(found.bar[step, body]),
            "at": found.script.steps[step].end,
            "tenth_at": found.script.steps[found.first].end,
            "body": asdict(self._report(body, step)),
            "left_out": self._from(found.left_out, found.since),
            "without_reference": self._from(found.ended, found.until),
            "rounding": bool(found.is_rounding.any()),
            "repeated_input": found.script.is_steered,
            "tried": [tried._asdict() for tried in found.tried],
            "by_order": found.by_order,
        }

    @property
    def reference(self) -> str:
        """The name of the reference."""
        assert self.finer
        return f"pymunk in {self.finer.finest.substeps} substeps, {self._iterations} iterations"

    @property
    def _iterations(self) -> int:
        assert self.finer
        return self.finer.start.settings.iterations * self.finer.finest.iterations

    def _from(self, bodies: Numbers, steps: Numbers) -> dict[str, Any] | None:
        """Return how many bodies have no reference, and from when on, s."""
        return {"bodies": len(bodies), "since": self._start(int(steps[bodies].min()))} if len(bodies) else None

    def _start(self, step: int) -> float:
        """Return when a step begins, s."""
        assert self.finer
        return self.finer.script.steps[step].time

    def _report(self, body: int, step: int, detail: str = "") -> BodyReport:
        assert self.finer
        script = self.finer.script
        return self.evidence.report((list(script.roster.bodies)[body].id,), script.steps[step], detail)

    def _error(self, found: Finer) -> str:
        """Say how far off the worst body is."""
        steps, end = found.script.steps, found.script.steps[found.last].end
        if not found.matters:
            return f"until {end:.4g} s, no body is off by more than {found.largest:.2g} px, less than 1 % of its size."
        step, body = found.worst
        error, bar = _figure(found.largest), _figure(max(float(found.bar[step, body]), SMALLEST_SHOWN))
        how = f"off by {error} ± {bar} px at {steps[step].end:.3f} s"
        report = self._report(body, step, f"{how}, the most until {end:.4g} s")
        return f"{report}. A tenth of that is reached at {steps[found.first].end:.3f} s."

    def _coverage(self, found: Finer) -> Iterator[str]:
        """Say what is not compared, and what is repeated."""
        count, recorded, bodies = len(found.error), len(self.evidence.recording), int(found.is_light.sum())
        if found.script.is_steered:
            yield "What the program did between the steps is repeated as it was."
        if count < recorded:
            yield f"The other {recorded - count:,} of {recorded:,} steps are not compared."
        if len(found.ended):
            first = self._start(int(found.until[found.ended].min()))
            is_rounding = found.is_rounding[found.ended]
            causes = ["finer steps"] * (not is_rounding.all()) + ["rounding errors"] * bool(is_rounding.any())
            why = f"{' or '.join(causes)} still change it"
            which = f"{len(found.ended)} of {bodies} bodies"
            yield f"For {which}, the reference ends earlier, first at {first:.3f} s: {why}."
        if len(found.left_out):
            body = int(found.left_out[found.since[found.left_out].argmin()])
            step = int(found.since[body])
            what = self._report(body, step, f"from {self._start(step):.3f} s on")
            yield f"Left out: {len(found.left_out)} of {bodies} bodies, first {what}."
            yield f"What moves it, and what it touches from then on, is not in the recording{functions(found.start)}."


def _figure(length: float) -> str:
    return f"{length:,.0f}" if 1000 <= length < 1e7 else f"{length:.3g}"


def _advice(tried: Sequence[Tried]) -> str:
    """Say what removes the error, the best first."""
    by_setting: dict[str, list[Tried]] = {}
    for each in tried:
        by_setting.setdefault(each.setting, []).append(each)
    best = [
        next((each for each in values if each.removed >= ENOUGH), max(values, key=lambda each: each.removed))
        for values in by_setting.values()
    ]
    helps = sorted((each for each in best if each.removed >= LEAST_REMOVED), key=lambda each: -each.removed)
    others = [each.setting for each in best if each.removed < LEAST_REMOVED]
    rest = f"No other value of {listed(others)} that was tried removes it." if others else ""
    return " ".join(filter(None, [f"{'; '.join(map(_words, helps))}." if helps else "", rest]))


def _order(found: Finer) -> str:
    """Say what the order matters, if it does."""
    if found.by_order < LEAST_BY_ORDER * found.largest:
        return ""
    return (
        f" Added in reverse order, bodies, shapes and joints would lead up to {_figure(found.by_order)} px elsewhere: "
        "Pymunk solves contacts and joints one after the other."
    )


def _words(tried: Tried) -> str:
    value = f"{tried.value:g}"
    how = f" (space.step(dt / {value}), {value} times)" if tried.setting == "substeps" else ""
    what = {"substeps": "steps", "iterations": "iterations"}.get(tried.setting)
    cost = f", for {tried.cost} times the {what}" if what else ""
    return f"{tried.setting} = {value}{how} removes {100 * tried.removed:.0f} % of that{cost}"
