"""What has explained the steps of a run so far, which is tried first where another step is to be explained."""

from collections import Counter
from collections.abc import Hashable, Iterable, Sequence
from typing import Final

from sandbox.judge.fit import Outcome, Problem, Trial
from sandbox.judge.flight import Habit
from sandbox.judge.law import Scope
from sandbox.judge.search import Search
from sandbox.judge.soft_contacts import SoftMemory
from sandbox.judge.thresholds import MAX_BALLS, MAX_FITS, MAX_FRUITLESS, MAX_VAIN

MAX_KNOWN: Final = 40  # trials that are tried first


class Experience:
    """What has explained steps of a run so far, and the search for what explains another.

    rough: whether friction matters; habit: how the engine flies, as far as known; soft: what is known of its soft
    contacts.
    """

    def __init__(self, *, rough: bool) -> None:
        self._rough = rough
        self.habit = Habit({})
        self.soft = SoftMemory()
        self._trials: dict[str, Trial] = {}
        self._times: Counter[str] = Counter()  # how many steps each has explained
        self._fits = self._fruitless = self._vain = 0

    def __len__(self) -> int:
        return len(self._trials)

    @property
    def likely(self) -> list[Trial]:
        """What has explained most steps so far."""
        return [self._trials[key] for key, _ in self._times.most_common(MAX_KNOWN)]

    def learn(self, fitting: Sequence[Outcome]) -> None:
        """Remember what explains a step, to be tried in others: of each fault first in the step that explains most."""
        best: dict[Hashable, Trial] = {}
        for trial in (outcome.trial for outcome in fitting):
            if not trial.is_soft and trial.scope.get("scope") != Scope.ONE:
                self._trials.setdefault(trial.key, trial)
                self._times[trial.key] += 0
                model = trial.model if trial.fault else ""
                if self._times[trial.key] > self._times[best.setdefault(model, trial).key]:
                    best[model] = trial
        self.count(trial.key for trial in best.values())

    def count(self, keys: Iterable[str]) -> None:
        """Note that trials have explained one step more. keys: theirs."""
        for key in keys:
            self._times[key] += 1

    def search(self, problem: Problem) -> list[Outcome]:
        """Return what explains a step: of what has explained others or, if that does not, of all models."""
        fitting = self.search_known(problem)
        few = len(problem.group.ball) <= MAX_BALLS
        if not fitting and few and self._fits < MAX_FITS and self._fruitless < MAX_FRUITLESS:
            fitting = self._search_of(problem).all()
            self._fits += 1
            self._fruitless = 0 if fitting else self._fruitless + 1
        return fitting

    def search_known(self, problem: Problem, *, soft: bool = True) -> list[Outcome]:
        """Return what explains a step of what has explained others, if need be in steps by another rule.

        soft: also of soft contacts, which take a second for many balls.
        """
        search, likely = self._search_of(problem), self.likely
        return search.known(likely, soft=soft) or self._vary(search, likely)

    def search_rules(self, problem: Problem, *, depths: bool) -> list[Outcome]:
        """Return what explains a step of contacts one after another or, if asked, found at a depth."""
        search = self._search_of(problem)
        fitting = search.one_by_one() if self._vain >= MAX_VAIN else self._vary(search, self.likely)
        return fitting or (search.at_depth() if depths else [])

    def _vary(self, search: Search, likely: Sequence[Trial]) -> list[Outcome]:
        """Return what explains a step by any rule, also with faults that others show; not after many in vain."""
        if self._vain >= MAX_VAIN:
            return []
        fitting = search.varied([trial for trial in likely if trial.fault and not trial.is_in_time])
        self._vain = 0 if fitting else self._vain + 1
        return fitting

    def _search_of(self, problem: Problem) -> Search:
        return Search(problem, self.habit.fields, self.soft, rough=self._rough)
