"""What is wrong with a run: its wrong steps in order, their sums by cause, and what it suffers from most.

Where several models leave nothing over of a step, the one that explains most of the run's other steps counts, with the
same value of its parameter. If that does not decide, the sentence names them, and causes that differ are unknown.
"""

from collections import Counter
from collections.abc import Hashable, Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np

from sandbox.judge.causes import Cause
from sandbox.judge.fit import Outcome
from sandbox.judge.judge import Judge
from sandbox.judge.kicks import of_kicks
from sandbox.judge.models import BY_NAME, FAULTS
from sandbox.judge.step_errors import StepError
from sandbox.judge.words import NO_SINGLE_ERROR, found_range, of_changes, of_outcome, summed
from sandbox.state import Floats

MODELS: Final = ["", *(fault.name for fault in FAULTS)]  # the likelier first, of those that tell the same
OF_STEPS: Final = frozenset({Cause.LATE, Cause.EARLY, Cause.MISSED})  # causes that shorter steps cure


class Suffered(NamedTuple):
    """A model that is wrong with steps of a run.

    times: contacts, or balls in flight; share: of the run's error; is_fault: whether a rule is wrong, which shorter
    steps do not cure; is_example: whether `because` is of the first step, and others have other numbers.
    """

    cause: Cause
    because: str
    times: int
    share: float
    is_fault: bool = False
    is_example: bool = False


class Timeline:
    """What a judge has found so far. errors: in order; sums: (4, causes), of the ledger."""

    def __init__(self, judge: Judge) -> None:
        self._judge = judge = judge.so_far()
        self.touches = judge.touches
        undecided = {id(error) for error in judge.undecided}
        self.errors = [error for error in judge.errors if id(error) not in undecided]
        for error in self.errors:
            error.step = judge.measure.whole_step(error.step)
        self._decide()
        self.errors.sort(key=lambda error: (error.step, error.cause == Cause.UNKNOWN))
        self.sums = judge.rightful.copy()
        for error in self.errors:
            self.sums[1:, error.cause] += error.momentum, error.displacement, error.times
            self.sums[0, error.cause if error.is_measured else Cause.UNKNOWN] += error.energy
        self.sums[0, Cause.ROUNDING] += sum(error.energy for error in judge.undecided)
        if judge.flight.is_integrated:
            self._net(Cause.GRAVITY, Cause.LATE)

    def _net(self, first: Cause, second: Cause) -> None:
        """Take from two lines of energy what the one gives and the other takes.

        What gravity in steps gives a ball in flight, it gives back where a contact turns its velocity round: the scheme
        keeps the energy of half a step earlier or later.
        """
        of_first, of_second = self.sums[0, first], self.sums[0, second]
        if of_first * of_second < 0:
            both = np.sign(of_first) * min(abs(of_first), abs(of_second))
            self.sums[0, [first, second]] -= both, -both

    def _decide(self) -> None:
        """Choose the model of each step among those that leave nothing over."""
        scene = self._judge.scene
        support = Counter(key for error in self.errors for key in {o.trial.model for o, _ in error.candidates})
        against = self._judge.against
        refuted = {key for key, times in support.items() if against[key[0]] > times}
        ranked: dict[tuple[tuple[int, Cause], ...], list[int]] = {}  # many steps have the same candidates
        for error in self.errors:
            if not error.candidates or error.cause == Cause.LATE:
                continue
            key = tuple((id(o.trial), cause) for o, cause in error.candidates)
            if key not in ranked:
                ranked[key] = _likeliest(error.candidates, support)
            best = [error.candidates[k] for k in ranked[key]]
            causes = list(dict.fromkeys(c for _, c in best))
            outcome, cause = best[0]
            if outcome.trial.model in refuted:
                error.cause, error.because = Cause.UNKNOWN, NO_SINGLE_ERROR
            elif support[outcome.trial.model] < 2 and error.numbers <= _freedom(outcome):
                said = self.touches.said(error)
                error.cause, error.because = Cause.UNKNOWN, f"{said} Nothing else in the run confirms that."
            elif len(causes) > 1:
                names = " Or: ".join(dict.fromkeys(of_outcome(scene, o, c) for o, c in best))
                error.cause, error.because = Cause.UNKNOWN, f"Two errors explain it. {names}"
            else:
                is_passage = cause == error.cause == Cause.MISSED  # of which the sentence says how
                error.cause, error.because = cause, error.because if is_passage or not outcome.trial.is_wrong else ""
            error.candidates = [(outcome, cause)]
        self._doubt_solver()

    def _doubt_solver(self) -> None:
        """Call impulses of several contacts unknown if those of single ones are wrong by themselves in the run."""
        faulty = sum(bool(_model(error)) for error in self.errors)
        late = sum(error.cause == Cause.LATE and not _model(error) for error in self.errors)
        for error in self.errors:
            if error.cause in (Cause.WARM_START, Cause.UNCONVERGED) and faulty > late and not error.candidates:
                error.cause, error.because = Cause.UNKNOWN, NO_SINGLE_ERROR

    def gained(self, steps: int) -> Floats:
        """Return what the balls gained up to each step that nothing outside gave them, (steps, 3): see `StepError`."""
        gained = np.zeros((steps, 3))
        for error in self.errors:
            gained[error.step - 1] += error.gained
        total: Floats = np.cumsum(gained, axis=0)
        return total

    @property
    def suffered(self) -> tuple[Suffered, ...]:
        """What the run suffers from, the worst first."""
        groups: dict[tuple[Cause, str], list[StepError]] = {}
        for error in self.errors:
            groups.setdefault((error.cause, _model(error)), []).append(error)
        reach = self._judge.mean_time
        sizes = {key: sum(e.displacement + e.speed * reach for e in of) for key, of in groups.items()}
        whole = sum(sizes.values()) or 1.0
        ordered = sorted(groups, key=lambda key: -sizes[key])
        return tuple(self._suffered(key[0], groups[key], sizes[key] / whole) for key in ordered)

    def _suffered(self, cause: Cause, errors: Sequence[StepError], share: float) -> Suffered:
        outcomes = [o for error in errors for o, _ in error.candidates[:1]]
        fault = outcomes[0].trial.fault if outcomes else ""
        because, is_example = self.touches.said(errors[0]), False
        if fault and (BY_NAME[fault].span or (len(errors) > 1 and not errors[0].because)):
            because = summed(self._judge.scene, outcomes)
        elif not fault and cause in (Cause.LATE, Cause.EARLY, Cause.OVERSHOOT):
            sign = -1 if cause == Cause.EARLY else 1
            depths = [sign * error.depth for error in errors if error.depth and sign * error.depth > 0]
            because = found_range(self._judge.scene, cause, depths) if len(depths) > 1 else because
        elif not fault and cause in (Cause.UNREPORTED, Cause.TELEPORTED):
            because = self._of_changes(cause, errors)
        else:
            is_example = any(self.touches.said(error) != because for error in errors)
        is_fault = bool(fault) and OF_STEPS.isdisjoint((cause, BY_NAME[fault].cause))
        return Suffered(cause, because, sum(error.times for error in errors), share, is_fault, is_example)

    def _of_changes(self, cause: Cause, errors: Sequence[StepError]) -> str:
        """Return the sentence on changes without a contact: that of a habit, or what they have in common."""
        scene, kicks = self._judge.scene, cause == Cause.UNREPORTED
        common, times = Counter(error.because for error in errors).most_common(1)[0]
        if 2 * times > len(errors):
            return common
        should, after = (np.array([v[0] for v in vs]) for vs in ([e.should for e in errors], [e.after for e in errors]))
        sizes = [(e.speed if kicks else e.displacement) / e.times for e in errors]
        alike = of_kicks(scene.units, should, after) if kicks else ""
        return alike or of_changes(scene, cause, errors[0].because, sizes)


def _likeliest(candidates: Sequence[tuple[Outcome, Cause]], support: Mapping[tuple[str, Hashable], int]) -> list[int]:
    """Return the numbers of the likeliest of what explains a step, the best first. support: of models, in steps."""
    most = max(support[o.trial.model] for o, _ in candidates)
    best = [k for k, (o, _) in enumerate(candidates) if support[o.trial.model] == most]
    best = [k for k in best if not candidates[k][0].trial.is_fitted] or best
    best = [k for k in best if not candidates[k][0].trial.is_odd] or best
    best.sort(key=lambda k: MODELS.index(candidates[k][0].trial.fault))
    if {candidates[k][1] for k in best} == {Cause.POSITION_CORRECTION, Cause.OVERSHOOT}:
        best = [k for k in best if candidates[k][1] == Cause.OVERSHOOT]  # put where the two touch, it is both
    return best


def _model(error: StepError) -> str:
    return error.candidates[0][0].trial.fault if error.candidates else ""


def _freedom(outcome: Outcome) -> int:
    """Return how many numbers a model can meet by chance: one by its parameter, two if another is more likely."""
    return outcome.trial.is_fitted * (1 + outcome.trial.is_odd)
