"""What is wrong with a run: its wrong steps in order, their sums by cause, and what it suffers from most.

Where several models leave nothing over of a step, the one that explains most of the run's other steps counts, with the
same value of its parameter. If that does not decide, the sentence names them, and causes that differ are unknown.
"""

from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sandbox.judge.causes import Cause
from sandbox.judge.fit import Outcome
from sandbox.judge.judge import Judge
from sandbox.judge.models import BY_NAME
from sandbox.judge.touching import StepError
from sandbox.judge.words import late_range, of_outcome, summed


class Suffered(NamedTuple):
    """A model that is wrong with steps of a run. times: contacts, or balls in flight; share: of the run's error."""

    cause: Cause
    because: str
    times: int
    share: float


class Timeline:
    """What a judge has found, once all steps are judged. errors: in order; sums: (4, causes), of the ledger."""

    def __init__(self, judge: Judge) -> None:
        self._judge = judge
        self.errors = judge.errors
        self._decide()
        self.errors.sort(key=lambda error: (error.step, error.cause == Cause.UNKNOWN))
        self.sums = judge.rightful.copy()
        for error in self.errors:
            self.sums[:, error.cause] += error.energy, error.momentum, error.displacement, error.times
        if judge.rightful[0, Cause.ROUNDING]:
            self.sums[0, Cause.ROUNDING] = judge.rightful[0, Cause.ROUNDING]

    def _decide(self) -> None:
        """Choose the model of each step among those that leave nothing over."""
        support = Counter(key for error in self.errors for key in {_key(o) for o, _ in error.candidates})
        for error in self.errors:
            if not error.candidates or error.cause == Cause.LATE:
                continue
            most = max(support[_key(o)] for o, _ in error.candidates)
            best = [(o, c) for o, c in error.candidates if support[_key(o)] == most]
            plain = [(o, c) for o, c in best if not _is_odd(o)]
            best = plain or best
            causes = list(dict.fromkeys(c for _, c in best))
            outcome, cause = best[0]
            if most < 2 and error.numbers <= _freedom(outcome):
                error.cause, error.because = Cause.UNKNOWN, f"{error.because} Nothing else in the run confirms that."
            elif len(causes) > 1:
                names = " Or: ".join(dict.fromkeys(of_outcome(o) for o, _ in best))
                error.cause, error.because = Cause.UNKNOWN, f"Two errors explain it. {names}"
            else:
                error.cause, error.because = cause, of_outcome(outcome) or error.because
            error.candidates = [(outcome, cause)]

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
        return tuple(_suffered(key[0], groups[key], sizes[key] / whole) for key in ordered)


def _suffered(cause: Cause, errors: Sequence[StepError], share: float) -> Suffered:
    outcomes = [o for error in errors for o, _ in error.candidates[:1]]
    fault = outcomes[0].trial.fault if outcomes else ""
    because = errors[0].because
    if fault and BY_NAME[fault].of:
        because = summed(BY_NAME[fault], np.array([o.trial.value for o in outcomes]))
    elif not fault and cause == Cause.LATE and any(error.depth for error in errors):
        because = late_range([error.depth for error in errors if error.depth])
    return Suffered(cause, because, sum(error.times for error in errors), share)


def _model(error: StepError) -> str:
    return error.candidates[0][0].trial.fault if error.candidates else ""


def _key(outcome: Outcome) -> tuple[str, float]:
    """Return what makes two outcomes the same model: its name, and its value to three digits."""
    trial = outcome.trial
    return trial.fault or repr(sorted(trial.rule.items())), float(f"{trial.value:.3g}") if trial.fault else 0.0


def _is_odd(outcome: Outcome) -> bool:
    return bool(outcome.trial.fault) and BY_NAME[outcome.trial.fault].odd


def _freedom(outcome: Outcome) -> int:
    """Return how many numbers a model can meet by chance: one by its parameter, and one by its rule besides."""
    trial = outcome.trial
    if not trial.fault or not BY_NAME[trial.fault].of:
        return 0
    return 1 if trial.is_in_time else 2
