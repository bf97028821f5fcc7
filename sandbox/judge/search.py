"""The search for what explains a step: what has explained others, then rules, then models, then both together.

The search ends at the first kind of explanation that leaves nothing over and is not odd, and returns all up to there.
"""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Final

import numpy as np

from sandbox.judge.causes import NEGLIGIBLE, Cause
from sandbox.judge.explain import PUSHED_WAYS, Part
from sandbox.judge.fit import PLAIN, Outcome, Problem, Trial, laws_of
from sandbox.judge.law import UNDONE, Laws, Order, Parting, Place, Scope
from sandbox.judge.models import BY_NAME, FAULTS, FRICTION, Fault, Fields, rules, scopes
from sandbox.judge.soft_contacts import SoftMemory, cause_of_soft

MAX_WAYS: Final = 16  # rules with a fault each, of those that come to different results
MAX_VARIED: Final = 4  # faults that are tried by all rules, of those that have explained most steps
MAX_KEPT: Final = 64  # faults whose laws by all rules are kept
OFFSET: Final = BY_NAME["offset"]
EARLY: Final = (0.055, 0.11, 0.33, 0.55, 1.1)  # radii, at which contacts are looked for that are found early

Items = tuple[tuple[str, float], ...]  # of fields of LAW
Ways = tuple[list[Trial], Laws]


def as_exact(problem: Problem) -> Outcome | None:
    """Return the exact step if it leaves nothing over, with contacts at its ends or not, and ties in either order."""
    best = min(problem.outcomes(exact_trials(problem.floor)), key=lambda outcome: outcome.left)
    enough = max(3 * problem.floor, NEGLIGIBLE * float(problem.group.ball["radius"].min()))
    return best if best.left <= enough else None


def exact_trials(floor: float) -> list[Trial]:
    """Return the ways to make an exact step of which the engine's noise (px) decides."""
    ends: list[Mapping[str, float]] = [{}]
    ends += [{"offset": sign * share * floor} for share in (1.0, 0.01) for sign in (1, -1)]
    return [Trial({**end, "order": order}) for end in ends for order in (Order.WALLS_FIRST, Order.REVERSED)]


class Search:
    """The search for what explains a problem. flight: fields of the engine's habit; rough: whether friction matters."""

    def __init__(self, problem: Problem, flight: Fields, memory: SoftMemory, *, rough: bool) -> None:
        self.problem, self.flight, self.memory, self.rough = problem, flight, memory, rough
        self.habitual = problem.outcomes([Trial(flight)])[0]

    def known(self, trials: Sequence[Trial], *, soft: bool) -> list[Outcome]:
        """Return what explains the step of the engine's habit, or of what has explained others. soft: also of these."""
        contacts = _contacts([self.problem.exact, self.habitual])
        if fitting := self.problem.fits([self.habitual]):
            return fitting
        likely = [Trial(self.flight, "missed"), *(trial for trial in trials if _applies(trial, contacts))]
        ways = [trial.rule for trial in trials if trial.fault and not trial.is_in_time]
        likely += [Trial(way) for k, way in enumerate(ways) if way not in ways[:k]]  # a fault may change nothing here
        likely += self.memory.known(self.problem, self.flight, rough=self.rough) if soft else []
        return self.problem.fits(self.problem.outcomes(likely))

    def varied(self, trials: Sequence[Trial]) -> list[Outcome]:
        """Return what explains the step of no fault, or of those that have explained others, in steps by any rule."""
        faults = {(*trial.model, *trial.scope.items()): trial for trial in reversed(trials)}
        kinds = {second >= 0 for _, second in _contacts([self.problem.exact, self.habitual])}
        parts: list[Fields] = [{"scope": Scope.PAIRS}, {"scope": Scope.WALLS}] if len(kinds) > 1 else []
        outcomes = list[Outcome]()
        for known in [PLAIN, *[*faults.values()][-MAX_VARIED:]]:
            for scope in [known.scope] if known.scope or not known.fault else [{}, *parts]:
                outcomes += self._by_rules(known._replace(scope=scope), self.problem.enough())
        return self.problem.fits(outcomes)

    def _by_rules(self, known: Trial = PLAIN, most: float = np.inf) -> list[Outcome]:
        """Try all rules with the fault of a trial. most: see `Problem.outcomes_of`."""
        flight, scope = tuple(sorted(self.flight.items())), tuple(known.scope.items())
        ways = _of_rules(self.problem.gravity, flight, known.fault, scope, known.value)
        return self.problem.outcomes_of(*ways, most)

    def all(self) -> list[Outcome]:
        """Return what explains the step of all models."""
        problem, flight = self.problem, self.flight
        met = _contacts([problem.exact])
        stepwise = self._by_rules()
        stepwise = [outcome for outcome in _distinct(problem, stepwise) if len(outcome.met)]
        plain = [fault for fault in FAULTS if not fault.span and not fault.odd]
        soft = problem.outcomes(self.memory.all(problem, flight, rough=self.rough))
        simple = problem.outcomes(self._trials([flight], plain, met))
        if fitting := problem.fits([*stepwise, *simple, *soft]):
            return fitting
        in_time = [*self._odd([flight], met), *problem.fit(self._in_time(met))]
        fitting = problem.fits(in_time)
        if not all(outcome.trial.is_odd for outcome in fitting):
            return fitting
        stepwise.sort(key=lambda outcome: (outcome.trial.rule["when"], outcome.left))
        ways = [outcome.trial.rule for outcome in stepwise]
        contacts = _contacts([problem.exact, *stepwise])
        stepped = [*problem.outcomes(self._trials(ways, plain, contacts)), *self._odd(ways, contacts)]
        fitting = problem.fits([*in_time, *stepped])
        if not all(outcome.trial.is_odd for outcome in fitting):
            return fitting
        fitted = [fault for fault in FAULTS if fault.span and fault.name not in ("offset", "apart")]
        in_steps = problem.fit(self._trials(ways[:MAX_WAYS], fitted, contacts))
        fitting = problem.fits([*in_time, *stepped, *in_steps])
        return fitting or self._put_apart(stepwise) or self._put_apart(stepped)

    def _put_apart(self, outcomes: Sequence[Outcome]) -> list[Outcome]:
        """Return what explains the step of outcomes that are wrong only in how far they put two balls apart."""
        problem, trials = self.problem, list[Trial]()
        numbers = problem.group.ball["number"].tolist()
        for trial, _, met, after in outcomes:
            if len(met) != 1 or met["second"][0] < 0 or met["closing"][0] <= 0:
                continue
            over = (problem.after - after) * problem.scale
            if trial.rule["pair_place"] == Place.LEAVE and np.abs(over[:, 2:]).max() <= problem.enough():
                first, second = numbers.index(met["first"][0]), numbers.index(met["second"][0])
                apart = (over[second, :2] - over[first, :2]) @ [met["nx"][0], met["ny"][0]] / 2
                trials.append(trial._replace(rule={**trial.rule, "apart": float(apart)}))
        return problem.fits(problem.outcomes(trials))

    def one_by_one(self) -> list[Outcome]:
        """Return what explains the step of the ways to resolve contacts one by one."""
        stepwise = [outcome for outcome in self._by_rules() if outcome.trial.rule["order"] != Order.TOGETHER]
        return self.problem.fits(_distinct(self.problem, stepwise))

    def at_depth(self) -> list[Outcome]:
        """Return what explains the step of contacts that are found at some depth."""
        trials = [Trial(self.flight, OFFSET.name, scope) for scope in scopes(_contacts([self.habitual]))]
        return self.problem.fits(self.problem.fit(trials))

    def _odd(self, ways: Sequence[Fields], contacts: Sequence[tuple[int, int]]) -> list[Outcome]:
        return self.problem.outcomes(
            self._trials(ways, [fault for fault in FAULTS if fault.odd and not fault.span], contacts)
        )

    def _in_time(self, met: Sequence[tuple[int, int]]) -> list[Trial]:
        """Return the trials of one parameter in which contacts are found when bodies touch, or at another distance."""
        flight, radius = self.flight, float(self.problem.group.ball["radius"].min())
        near = [Trial(flight, "offset", {}, gap * radius) for gap in EARLY]
        early = _contacts(self.problem.outcomes(near))
        trials = self._trials([flight], [fault for fault in FAULTS if fault.span and fault is not OFFSET], met)
        bases = [flight, *({**flight, "pair_place": place} for place in (Place.HALVES, Place.BY_MASS))]
        trials += self._trials(bases, [OFFSET], early)
        return trials + [Trial(flight, "offset", {"scope": scope}) for scope in (Scope.PAIRS, Scope.WALLS)]

    def _trials(
        self, rules: Sequence[Fields], faults: Sequence[Fault], contacts: Sequence[tuple[int, int]]
    ) -> list[Trial]:
        suited = [fault for fault in faults if _suits(fault, contacts, self.rough)]
        return [Trial(rule, fault.name, scope) for rule in rules for fault in suited for scope in scopes(contacts)]


@lru_cache(MAX_KEPT)
def _of_rules(gravity: tuple[float, float], flight: Items, fault: str, scope: Items, value: float) -> Ways:
    """Return the trials of all rules with a fault, and their laws."""
    fields = dict(flight)
    ways = [{**_not_of_rules(fields), **rule} for rule in rules(gravity=any(gravity), flight=fields)]
    trials = [Trial(way, fault, dict(scope), value) for way in ways]
    return trials, laws_of(trials, gravity)


def _not_of_rules(flight: Fields) -> Fields:
    return {name: value for name, value in flight.items() if name != "theta"}


def _contacts(outcomes: Sequence[Outcome]) -> list[tuple[int, int]]:
    """Return the contacts of outcomes, each once: first and second."""
    return list(dict.fromkeys((int(m["first"]), int(m["second"])) for outcome in outcomes for m in outcome.met))


def _applies(trial: Trial, contacts: Sequence[tuple[int, int]]) -> bool:
    return trial.scope.get("scope") != Scope.ONE or (trial.scope["first"], trial.scope["second"]) in contacts


def _suits(fault: Fault, contacts: Sequence[tuple[int, int]], rough: bool) -> bool:
    """Return whether a fault can be one of some contacts."""
    kinds = {Scope.PAIRS if second >= 0 else Scope.WALLS for _, second in contacts}
    return (rough or not fault.rough) and (not kinds or fault.kind == Scope.ALL or fault.kind in kinds)


def _distinct(problem: Problem, outcomes: Sequence[Outcome]) -> list[Outcome]:
    """Return the first outcome of each group of those that come to the same, with any restitution."""
    unit = max(problem.floor, 1e-12)
    seen: dict[tuple[bytes, bool], Outcome] = {}
    for outcome in outcomes:
        mirrors = outcome.trial.rule["wall_place"] == Place.MIRROR and any(m["second"] < 0 for m in outcome.met)
        seen.setdefault((np.round(outcome.after * problem.scale / unit).tobytes(), mirrors), outcome)
    return list(seen.values())


def cause_of(outcome: Outcome, problem: Problem) -> Cause:
    """Return the cause that an outcome stands for."""
    trial, closing = outcome.trial, float(outcome.met["closing"].min(initial=np.inf))
    if not _turns_back(trial, closing):
        if trial.is_soft:
            return cause_of_soft(outcome, problem)
        if not trial.is_wrong:
            return Cause.UNREPORTED
        if trial.fault and BY_NAME[trial.fault].cause == FRICTION:
            return _friction_by_outcome(outcome, problem)
    moved = np.abs((outcome.after - problem.exact.after) * problem.scale)[:, 2:].max() > problem.enough()
    pair = any(m["second"] >= 0 for m in outcome.met)
    return cause_of_law(trial, closing, pair, moved=bool(moved))


def _turns_back(trial: Trial, closing: float) -> bool:
    """Return whether a contact that already parts is resolved again. closing: px/s, the least of its contacts."""
    partings = trial.rule.get("wall_parting"), trial.rule.get("pair_parting")
    resolves = Parting.RESOLVE in partings and not trial.is_in_time and not trial.is_odd
    return closing <= 0 and resolves and trial.gives_impulses


def cause_of_law(trial: Trial, closing: float, pair: bool, *, moved: bool) -> Cause:
    """Return the cause that a law stands for: its fault or, where it leaves velocities right, what it does to places.

    closing: px/s, the least of its contacts; pair: whether one is of two balls; moved: whether velocities are wrong.
    """
    if _turns_back(trial, closing):
        return Cause.DOUBLE_BOUNCE
    if trial.fault:
        return BY_NAME[trial.fault].cause_of(trial.value)
    if "apart" in trial.rule:
        return Cause.POSITION_CORRECTION
    if moved:
        return Cause.LATE
    if pair and trial.rule["pair_place"] != Place.LEAVE:
        return Cause.POSITION_CORRECTION
    return Cause.OVERSHOOT if not pair and trial.rule["wall_place"] in (Place.ON, *UNDONE) else Cause.LATE


def cause_of_push(part: Part) -> Cause:
    """Return the cause of a push: a ball that is put onto the wall in which it is found has its overshoot discarded."""
    onto_wall = part.pushed_second < 0 and part.pushed >= (1 - NEGLIGIBLE) * part.overlap
    return Cause.OVERSHOOT if onto_wall and part.way % PUSHED_WAYS == 1 else Cause.POSITION_CORRECTION


def _friction_by_outcome(outcome: Outcome, problem: Problem) -> Cause:
    """Return whether friction is too small or too large, from the sums of its impulses and of the exact ones."""
    trial = outcome.trial
    if trial.fault == "friction" and trial.value < 0:
        return Cause.FRICTION_SMALL
    due, got = (float(np.abs(o.met["tangential"]).sum()) for o in (problem.exact, outcome))
    if got == due:  # of a ball that slides on a wall, which is no contact
        return BY_NAME[trial.fault].cause_of(trial.value)
    return Cause.FRICTION_SMALL if got < due else Cause.FRICTION_LARGE
