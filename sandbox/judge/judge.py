"""The judge of one engine's run: each step, from the engine's own state before it, against the exact step.

Balls that do not fly as they should, and groups that do not do what the exact step does, become `StepError`s, each with
the models that leave nothing over. The ledger of a step is the exact step's own change, and the rest under its cause.
"""

from collections import Counter
from collections.abc import Hashable, Mapping, Sequence
from copy import copy, deepcopy
from itertools import chain
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.judge.causes import NEGLIGIBLE, Cause
from sandbox.judge.experience import Experience
from sandbox.judge.explain import (
    BY_FLIGHT,
    BY_LAW,
    COMPRESSIVE,
    EXACT,
    LEANING,
    MAX_TRIED,
    PART,
    PULLING,
    PUSHED_WAYS,
    TOGETHER,
    UNCOMPUTED,
    UNEXPLAINED,
    Part,
    Remains,
    desk_for,
    explain,
)
from sandbox.judge.fit import MET_KEPT, Outcome, Problem, Trial, laws_of, without_idle_faults
from sandbox.judge.flight import Flights, Habit, find_habit, flown, misses, noise_of, ways_to_fall
from sandbox.judge.free_flight import balls_of
from sandbox.judge.groups import (
    FOUND,
    MAX_COMPUTED,
    Flown,
    scratch_for,
    screen,
    work_for,
)
from sandbox.judge.law import LAW, law
from sandbox.judge.models import BY_NAME, FRICTION
from sandbox.judge.one_step import MET, Group
from sandbox.judge.reference_step import reference_steps
from sandbox.judge.search import as_exact, cause_of, cause_of_law, cause_of_push, exact_trials
from sandbox.judge.soft_contacts import bounced_at_its_end
from sandbox.judge.step_errors import End, Measure, Shown, StepError
from sandbox.judge.thresholds import DEEP, FAR, MAX_BALLS, MAX_FITS, MAX_FRUITLESS, MAX_VAIN, SINGLE
from sandbox.judge.touching import (
    Missed,
    Springs,
    StartOverlaps,
    Touch,
    Touches,
    free_balls,
)
from sandbox.judge.words import NO_SINGLE_ERROR, of_depth, of_impulses, of_missed, of_push
from sandbox.quantity import deepest_overlap, energy, length, spin_energy
from sandbox.scene.model import Scene
from sandbox.scene.walls import pieces_of
from sandbox.state import NO_DAMPING, PUSH, Bools, Damping, Floats, Integers, Pushes, State, States

BLOCK_STEPS: Final = 256  # that are judged together, of few balls
BLOCK_STATES: Final = 100_000  # balls times steps, of many
MAX_CHUNK: Final = 256  # groups that are explained by the same known trials
UNKNOWN_END: Final = np.empty((0, 5))  # of an outcome of which only the law counts
SOLVED: Final = {PULLING: Cause.WARM_START, COMPRESSIVE: Cause.UNCONVERGED}  # what impulses along contacts show


class Explained(NamedTuple):
    """A part of a group, with its balls and what its errors need.

    pushes, rest: what is over, as `Measure.sums`, by pushes of what overlaps, and besides; shown: of several parts, and
    which of them is this; touch: of its contact, if it has just two balls.
    """

    part: Part
    balls: Integers
    pushes: Floats
    rest: Floats
    shown: tuple[Shown, int]
    touch: Touch | None


class Fitting(NamedTuple):
    """The known trials that explain a part; doubtful: whether its cause depends on more than them."""

    trials: list[Trial]
    has_fault: bool
    is_doubtful: bool


class Models(NamedTuple):
    """The known trials that explain a part, the first of each model, with their causes, and the keys of the faulty."""

    trials: list[tuple[Trial, Cause]]
    keys: list[str]


class Judge:
    """Judges an engine's run block by block, each substep as a step.

    scene: that the engine runs; errors: in order of their substeps; rightful: (4, causes), what is right.
    """

    def __init__(self, scene: Scene, damping: Damping = NO_DAMPING) -> None:
        self._damping = damping
        self.scene, self._gravity = scene, (float(scene.gravity[0]), float(scene.gravity[1]))
        self._bodies, n = scene.bodies, len(scene.bodies)
        self._ball, self._piece = balls_of(scene, MAX_COMPUTED), pieces_of(scene)
        self._own_ball = self._ball[:n]  # without the room that steps of groups work in
        self._scratch = scratch_for(n + MAX_COMPUTED)
        self._law = np.array([law(self._gravity)], LAW)
        self._work = work_for(n)
        self.measure = Measure(scene, damping.substeps)
        self._experience = Experience(rough=scene.is_rough)
        self._unlike_reference = self._vain_joins = self._opinions = 0
        self._known_before = 0  # trials, when what was unexplained was last looked at
        self._tried: list[Trial] = []
        self._fitting: dict[int, Fitting] = {}  # of these, that explain parts, by `Part.fits`
        self._models: dict[Hashable, Models] = {}
        self._bases: list[Habit] = []
        self._falls: Counter[int] = Counter()  # of the ways to fall, how many steps each has explained
        self.against: Counter[str] = Counter()
        self._desk = desk_for(n)
        self.touches = Touches(scene)
        self._missed, self._springs = Missed(self.touches), Springs()
        self.contacts = np.zeros(1, np.int64)
        self._knows_flight = False
        self._block = max(1, min(BLOCK_STEPS, BLOCK_STATES // n))
        self._held = States.empty(self._block + 1, n)
        self._held_pushes, self._held_dt = np.empty(0, PUSH), np.empty(0)
        self._unexplained: list[tuple[StepError, Problem]] = []
        self.errors: list[StepError] = []
        self.rightful = np.zeros((4, len(Cause)))

    def add(self, states: States, pushes: Pushes, dt: Floats) -> None:
        """Add substeps. states: of substeps + 1 rows; pushes: by a hand, by row, in their order; dt: (substeps,) s.

        They are judged in blocks of one length, so that the verdict does not depend on how many are added at once.
        """
        done = 0
        while done < len(dt):
            held = len(self._held_dt)
            steps = min(self._block - held, len(dt) - done)
            for rows, added in zip(self._held, states, strict=True):
                rows[held : held + steps + 1] = added[done : done + steps + 1]
            of_these = pushes[(pushes["row"] > done) & (pushes["row"] <= done + steps)].copy()
            of_these["row"] += held - done
            self._held_pushes = np.concatenate([self._held_pushes, of_these])
            self._held_dt = np.concatenate([self._held_dt, dt[done : done + steps]])
            done += steps
            if held + steps == self._block:
                self.finish()

    def so_far(self) -> "Judge":
        """Return a copy that has judged all steps, while this one goes on to fill its block."""
        shared: dict[int, object] = {id(self.scene): self.scene, id(self._bodies): self._bodies}
        shared |= {id(problem): problem for _, problem in self._unexplained}
        judge = deepcopy(self, shared | {id(error): copy(error) for error in self.errors})
        judge.finish()
        return judge

    def finish(self) -> None:
        """Judge the steps that wait for a block to be full."""
        steps = len(self._held_dt)
        if steps:
            self._judge_block(self._held.rows(slice(steps + 1)), self._held_pushes, self._held_dt)
            self._held_pushes, self._held_dt = self._held_pushes[:0], self._held_dt[:0]

    def _judge_block(self, states: States, pushes: Pushes, dt: Floats) -> None:
        before, after = states.after_pushes(pushes).rows(slice(-1)), states.rows(slice(1, None))
        floor = noise_of(states, dt)
        if not self._knows_flight:
            self._find_habit(before, after, dt, floor)
        exact, usual = (flown(self._own_ball, before, dt, self._gravity, fields) for fields in ({}, self.habit.fields))
        strange = self._strays(after, usual, dt, floor)
        f = Flown(before, after, exact, dt, strange, floor, self._piece)
        groups, member, elastic = self._screen(f)
        grouped = np.zeros(strange.shape, bool)
        errors: dict[int, list[StepError]] = {}
        self._judge_groups(f, groups, member, elastic, grouped, errors)
        off = self._strays(after, exact, dt, floor) & ~grouped
        if self.habit.cause is None:  # those that fly as they should met nothing
            for rows, flown_rows in zip(f.exact, f.after, strict=True):
                rows[off & ~strange] = flown_rows[off & ~strange]
            off &= strange
        for error in self.measure.flights(f, off, strange, self.habit):
            self.measure.note_gain(error, np.array(error.balls))
            errors.setdefault(error.step - self.measure.steps - 1, []).append(error)
        for step, of_step in errors.items():
            errors[step] = self._judge_joined(f, step, of_step, elastic)
        self.measure.set_gained(f, self.habit)
        of_block = self._follow(f, errors)
        self.errors += of_block
        self._explain_again()
        self._enter(states, f, elastic, of_block)
        self.measure.steps += len(dt)

    def _follow(self, f: Flown, errors: Mapping[int, list[StepError]]) -> list[StepError]:
        """Return the errors of a block in order, also of contacts that are missed, and of overlaps from the start.

        errors: of each of its steps.
        """
        of_block = list[StepError]()
        if not self.measure.steps:
            self._start_overlaps = StartOverlaps(self.scene, f.before.position[0], self.touches)
        for step in range(len(f.dt)):
            of_step = self._missed.follow(f, step, self.measure.steps + step + 1, errors.get(step, []))
            self._start_overlaps.follow(f, step, of_step)
            of_block += of_step
        return of_block

    def _find_habit(self, before: States, after: States, dt: Floats, floor: float) -> None:
        """Find how the engine flies, from balls that touch nothing."""
        flies = free_balls(self.scene, before, after)
        moves = np.maximum(length(before.velocity), length(after.velocity)) * dt[:, None] > floor
        if (flies & moves).any() or not any(self._gravity):  # what stays where it is may be held there
            flies &= moves
        flights = Flights(self.scene.units, self._own_ball, self._gravity, before, after, dt, floor, flies)
        habit = find_habit(flights, self._damping.per_second)
        self._experience.habit, self._knows_flight = habit or Habit({}), habit is not None

    def _judge_groups(
        self,
        f: Flown,
        groups: np.ndarray,
        member: Integers,
        elastic: Floats,
        grouped: Bools,
        errors: dict[int, list[StepError]],
    ) -> None:
        """Add the errors of groups, by their steps. grouped: (steps, n), written: whether a ball is in one."""
        remains = Remains(*(np.zeros((*f.before.spin.shape, width)) for width in (2, 3, 5)))
        begin, size = 0, 1
        while begin < len(groups):
            chunk = groups[begin : begin + size]
            for explained in self._explain(f, chunk, member, elastic, remains):
                step, balls = explained.part.step, explained.balls
                grouped[step, balls] = True
                wrong = self._judge_part(f, explained, elastic, remains)
                if wrong:
                    self.measure.note_gain(wrong[0], balls)
                errors.setdefault(step, []).extend(wrong)
            begin, size = begin + size, min(2 * size, MAX_CHUNK)

    def _judge_joined(self, f: Flown, step: int, errors: list[StepError], elastic: Floats) -> list[StepError]:
        """Return the errors of a step, of which those that nothing explains are judged together where balls may meet.

        In the step, two may touch that neither the exact steps of their groups nor the engine leave in touch.
        """
        unknown = [k for k, error in enumerate(errors) if error.because == NO_SINGLE_ERROR]
        kept, again = set(range(len(errors))), list[StepError]()
        for joined in self._that_may_meet(f, step, [np.array(errors[k].balls) for k in unknown]):
            balls = np.unique(np.concatenate([errors[unknown[k]].balls for k in joined]))
            if len(balls) > MAX_COMPUTED or self._vain_joins >= MAX_VAIN:
                continue
            problem = self._problem(f, step, balls)
            ends = np.isfinite(problem.exact.left)
            is_exact = ends and as_exact(problem) is not None
            known = self._experience.search_known(problem) if ends and not is_exact else []
            if not is_exact and not known:
                self._vain_joins += 1
                continue
            self._vain_joins = 0
            self._take(f, step, balls, elastic, _end_of(problem.exact))
            kept -= {unknown[k] for k in joined}
            together = self._judge_group(f, step, balls, elastic, [outcome.trial for outcome in known], ended=True)
            for error in together[:1]:
                self.measure.note_gain(error, balls)
            again += together
        return [*(errors[k] for k in sorted(kept)), *again]

    def _that_may_meet(self, f: Flown, step: int, groups: Sequence[Integers]) -> list[list[int]]:
        """Return the numbers of those of some groups whose balls may meet others' in a step, put together."""
        if len(groups) < 2:
            return []
        ways = [self._way_of(f, step, balls) for balls in groups]
        low = np.array([(x - way).min(axis=0) for x, way in ways])
        high = np.array([(x + way).max(axis=0) for x, way in ways])
        meet = np.asarray(((low[:, None] <= high) & (low <= high[:, None])).all(axis=2))
        for i, j in np.argwhere(np.triu(meet, 1)).tolist():
            (x, way), (y, others_way) = ways[i], ways[j]
            meet[j, i] = (length(x[:, None] - y) <= way + others_way.T).any()
        joined: list[list[int]] = []
        for k in range(len(groups)):
            near = [numbers for numbers in joined if meet[k, numbers].any()]
            joined = [*(numbers for numbers in joined if numbers not in near), [*chain(*near), k]]
        return [numbers for numbers in joined if len(numbers) > 1]

    def _way_of(self, f: Flown, step: int, balls: Integers) -> tuple[Floats, Floats]:
        """Return where some balls begin a step, (k, 2) px, and how far from there they may touch, (k, 1) px."""
        speed = np.maximum(length(f.before.velocity[step, balls]), length(f.after.velocity[step, balls]))
        way = (1 + FAR) * self._bodies.radius[balls] + f.dt[step] * speed
        return f.before.position[step, balls], way[:, None]

    def _judge_part(self, f: Flown, explained: Explained, elastic: Floats, remains: Remains) -> list[StepError]:
        """Return what is wrong with a part of a group, and note what pushes in it as a spring may."""
        part, balls, touches = explained.part, explained.balls, list[Touch]()
        step, now = part.step, self.measure.steps + part.step + 1
        if part.kind in (EXACT, LEANING) and not part.pushed:
            wrong = list[StepError]()
        elif (
            part.kind in (UNCOMPUTED, UNEXPLAINED) or self._is_doubtful(f, part) or self._flies_through(f, part, balls)
        ):
            tried = self._fitting_of(f, part).trials if part.kind == BY_LAW else []
            wrong = self._judge_group(f, step, balls, elastic, tried, ended=part.kind != UNCOMPUTED)
        else:
            wrong = self._second_opinion(f, part, balls, elastic) or self._of_part(f, explained, elastic, remains)
        if any(error.by_rule for error in wrong):
            return wrong
        if wrong and len(balls) <= MAX_BALLS and part.kind == UNEXPLAINED:
            touches = self.touches.among(f, step, balls.tolist())
        elif len(balls) <= 2:
            contacts = dict.fromkeys(error.contact for error in wrong if error.contact)
            contacts |= dict.fromkeys(self._springs.before(now, balls.tolist()))
            done = explained.touch
            touches = [done if done and done.pair == pair else self.touches.of(f, step, pair) for pair in contacts]
        self._springs.follow(touches, now, wrong)
        return wrong

    def _explain(
        self, f: Flown, groups: np.ndarray, member: Integers, elastic: Floats, remains: Remains
    ) -> list[Explained]:
        """Return the parts of some groups with what explains them."""
        self._tried, self._fitting, self._models = self._experience.likely, {}, {}
        self._bases = self._ways_to_fly(float(f.dt[0]))
        flights = [Trial(habit.fields) for habit in self._bases]
        laws = laws_of([*exact_trials(f.floor), *flights, *self._tried], self._gravity)
        parts = np.zeros(int(groups["count"].sum()), PART)
        ball = self._own_ball
        count = explain(f, ball, laws, len(flights), self._desk, self._scratch, remains, groups, member, parts, elastic)
        parts = parts[:count]
        if not self._knows_flight:
            ways = ways_to_fall(self.scene.units, self._gravity, float(f.dt[0]))
            shown = (parts["pushed"] == 0) & np.isin(parts["kind"], (BY_FLIGHT, TOGETHER, COMPRESSIVE))
            self._falls.update(ways.index(self._bases[int(base)]) for base in parts["base"][shown])
        self._contradict(parts["fits"][parts["kind"] == BY_LAW])
        first = int(parts["begin"][0])
        return self._with_sums(f, parts, member[first : first + int(parts["size"].sum())], remains)

    def _with_sums(self, f: Flown, parts: np.ndarray, balls: Integers, remains: Remains) -> list[Explained]:
        """Return parts with what their errors need. balls: of one part after another."""
        steps, sizes, contacts = parts["step"], parts["size"], np.stack([parts["first"], parts["second"]], axis=1)
        begins, rows = np.cumsum(sizes) - sizes, np.repeat(steps, sizes)
        end, exact = End.of(f.after, rows, balls), End.of(f.exact, rows, balls)
        without = end._replace(position=end.position - remains.shift[rows, balls])
        pushes, rest = (self.measure.sums(f, *ends, balls, begins) for ends in ((end, without), (without, exact)))
        shown = Shown.of(f, steps, contacts)
        pairs = np.flatnonzero((sizes == 2) & (contacts[:, 0] != contacts[:, 1]) & (contacts[:, 1] >= 0))
        touch = dict(zip(pairs.tolist(), self.touches.of_pairs(f, steps[pairs], contacts[pairs]), strict=True))
        members = np.split(balls, begins[1:])
        return [
            Explained(Part(*row), members[k], pushes[k], rest[k], (shown, k), touch.get(k))
            for k, row in enumerate(parts.tolist())
        ]

    def _contradict(self, fits: Integers) -> None:
        """Count the parts that are explained without a fault which an engine that has it has in every contact."""
        bits: dict[str, int] = {}
        for k, trial in enumerate(self._tried):
            if trial.fault and BY_NAME[trial.fault].always:
                bits[trial.fault] = bits.get(trial.fault, 0) | 1 << k
        for fault, mask in bits.items():
            self.against[fault] += int((fits & mask == 0).sum())

    def _is_doubtful(self, f: Flown, part: Part) -> bool:
        """Return whether a law explains a part whose cause depends on more than the law and its deepest contact."""
        if part.kind != BY_LAW:
            return False
        fitting = self._fitting_of(f, part)
        return fitting.is_doubtful or (part.pushed > 0 and fitting.has_fault)

    def _flies_through(self, f: Flown, part: Part, balls: Integers) -> bool:
        """Return whether balls that fly as the engine does pass through what the exact step has them bounce off."""
        if part.kind != BY_FLIGHT:
            return False
        step = part.step
        off = np.abs(f.after.velocity[step, balls] - f.exact.velocity[step, balls]).max() * f.dt[step]
        if off <= f.floor:
            return False
        return any(self.touches.passes(f, step, pair) for pair in _pairs(self._problem(f, step, balls).exact))

    def _fitting_of(self, f: Flown, part: Part) -> Fitting:
        """Return the known trials that leave nothing over of a part."""
        if (bits := part.fits) not in self._fitting:
            trials = [trial for k, trial in enumerate(self._tried) if bits >> k & 1]
            faulty = [trial for trial in trials if trial.fault]
            beyond = [trial for trial in faulty if BY_NAME[trial.fault].cause in (FRICTION, Cause.MISSED)]
            doubtful = bool(beyond) or any(trial.is_soft or not self._believes(f, trial) for trial in faulty)
            self._fitting[bits] = Fitting(trials, bool(faulty), doubtful)
        return self._fitting[bits]

    def _of_part(self, f: Flown, explained: Explained, elastic: Floats, remains: Remains) -> list[StepError]:
        """Return the errors of a part that is explained: of places, of impulses, and of contacts found late."""
        part, balls, over, shown, scene = explained.part, explained.balls, explained.rest, explained.shown, self.scene
        step, kind, contact, errors = part.step, part.kind, (part.first, part.second), list[StepError]()
        if part.pushed:
            pair, cause = (part.pushed_first, part.pushed_second), cause_of_push(part)
            said = of_push(scene, part, cause)
            errors.append(self.measure.error(f, step, balls, pair, cause, said, explained.pushes))
        if kind in (EXACT, LEANING):
            return errors
        fitting = self._fitting_of(f, part) if kind == BY_LAW else Fitting([], has_fault=False, is_doubtful=False)
        if fitting.has_fault:
            return [*self._of_law(f, explained, fitting), *errors]
        end, exact = End.of(f.after, step, balls), End.of(f.exact, step, balls)
        end = end._replace(position=end.position - remains.shift[step, balls])
        if kind == BY_FLIGHT:
            return [*self.measure.by_habit(f, step, balls, self._bases[part.base], (end, exact)), *errors]
        if kind in (COMPRESSIVE, PULLING):
            solved = remains.solved[step, balls]
            solution = end._replace(velocity=solved[:, :2], spin=solved[:, 2])
            cause, [over] = SOLVED[kind], self.measure.sums(f, end, solution, balls)
            said = of_impulses(scene, part, cause)
            errors.append(self.measure.error(f, step, balls, contact, cause, said, over, shown=shown))
            end, [over] = solution, self.measure.sums(f, solution, exact, balls)
        if self._is_in_time(f, part):  # all at once, of which the law says nothing
            self._take(f, step, balls, elastic, end)
            return errors
        if fitting.trials:
            return [*self._of_law(f, explained, fitting), *errors]
        said = of_depth(scene, part.depth, part.late)
        late = self.measure.error(f, step, balls, contact, Cause.LATE, said, over, shown=shown)
        late.depth, late.by_rule = part.depth, kind == TOGETHER
        return [late, *errors] if self._shows(f, late) else errors

    def _of_law(self, f: Flown, explained: Explained, fitting: Fitting) -> list[StepError]:
        """Return the error of a part that known laws explain."""
        part, models = explained.part, self._models_of(explained.part, fitting)
        late, in_time = _met(part, part.depth), _met(part, 0.0)
        candidates = [
            (Outcome(trial, 0.0, in_time if trial.is_in_time else late, UNKNOWN_END), cause)
            for trial, cause in models.trials
        ]
        (outcome, cause), contact, over = candidates[0], (part.first, part.second), explained.rest
        error = self.measure.error(f, part.step, explained.balls, contact, cause, "", over, shown=explained.shown)
        error.depth, error.candidates = float(outcome.met["depth"][0]), candidates
        error.by_rule = not models.keys
        self._experience.count(models.keys)
        return [error] if self._shows(f, error) else []

    def _models_of(self, part: Part, fitting: Fitting) -> Models:
        """Return the known trials that explain a part, the first of each model."""
        seen = part.fits, part.second >= 0, part.least <= 0, part.moved
        if seen not in self._models:
            models: dict[Hashable, tuple[Trial, Cause]] = {}
            for trial in without_idle_faults(fitting.trials):
                cause = cause_of_law(trial, part.least, part.second >= 0, moved=bool(part.moved))
                models.setdefault((trial.model, cause), (trial, cause))
            keys = [trial.key for trial, _ in models.values() if trial.fault]
            self._models[seen] = Models([*models.values()][: None if keys else 1], keys)
        return self._models[seen]

    def _shows(self, f: Flown, error: StepError) -> bool:
        """Return whether an error is more than noise."""
        return error.speed * error.flown + error.displacement > f.floor

    def _is_in_time(self, f: Flown, part: Part) -> bool:
        """Return whether the contacts of a part were found where the bodies touch."""
        return part.depth <= self._negligible(f)

    def _negligible(self, f: Flown) -> float:
        """Return how far two places may be apart that count as one, px."""
        return 3 * f.floor + NEGLIGIBLE * float(self._bodies.radius.min())

    def _take(self, f: Flown, step: int, balls: Integers, elastic: Floats, end: End) -> None:
        """Take what some balls do for what is right."""
        elastic[step] += self.measure.gain(end, End.of(f.exact, step, balls), balls)
        _set_exact(f, step, balls, end)

    @property
    def habit(self) -> Habit:
        """How the engine flies, as it was seen to."""
        return self._experience.habit

    @property
    def undecided(self) -> list[StepError]:
        """The contacts among the errors that may still follow."""
        return self._missed.undecided(self.measure.steps)

    @property
    def flight(self) -> Habit:
        """How the engine flies, as far as it shows."""
        return self._ways_to_fly(1 / self.scene.rate)[0]

    def _ways_to_fly(self, dt: float) -> list[Habit]:
        """Return how the engine may fly: as it was seen to or, before, as explains most steps of balls that touch."""
        if self._knows_flight:
            return [self.habit]
        ways = ways_to_fall(self.scene.units, self._gravity, dt)
        return [ways[k] for k, _ in self._falls.most_common(1)] or ways

    @property
    def mean_time(self) -> float:
        """The time between two contacts of a ball, on average, s: so long does an error of a velocity act."""
        seconds, n = self.scene.clock.time(self.measure.whole_step(self.measure.steps)), len(self._bodies)
        return seconds * n / (n + 2 * int(self.contacts[0]))

    def _strays(self, after: States, at: States, dt: Floats, floor: float) -> Bools:
        """Return which balls are elsewhere than in other states, or turn otherwise: (steps, n)."""
        spun = np.abs(after.spin - at.spin) * self._bodies.radius * dt[:, None]
        strays: Bools = np.maximum(misses(after, dt, at), spun) > floor
        return strays

    def _screen(self, f: Flown) -> tuple[np.ndarray, Integers, Floats]:
        """Return the groups that the engine has otherwise than exactly, their balls, and what restitution takes."""
        most, elastic = f.before.spin.size, np.zeros(len(f.dt))
        found, member = np.zeros(most, FOUND), np.zeros(most, np.int64)
        work, contacts = self._work, self.contacts
        args = f, self._ball, self._law, self._scratch, work, found, member, elastic, contacts
        return found[: screen(*args)], member, elastic

    def _judge_group(
        self, f: Flown, step: int, balls: Integers, elastic: Floats, tried: Sequence[Trial], *, ended: bool
    ) -> list[StepError]:
        """Return what is wrong with a group's step. tried: known trials that leave nothing over of it."""
        if not ended or (any(self._gravity) and len(balls) > 1 and self._rests(f, step, balls)):
            return self._uncomputed(f, step, balls, elastic)
        problem = self._problem(f, step, balls)
        fitting = [o for o in problem.fits(problem.outcomes(tried)) if self._believes(f, o.trial)]
        if not fitting:
            if exact := as_exact(problem):
                self._accept(f, step, balls, elastic, exact, problem)
                return []
            fitting = [o for o in self._experience.search(problem) if self._believes(f, o.trial)]
        if not fitting:
            end, is_right = self._by_reference(f, step, balls)
            if end and is_right:
                self._take(f, step, balls, elastic, end)
                return []
        self._experience.learn(fitting)
        self._experience.soft.follow(problem, fitting)
        return self._of_fitting(f, step, balls, elastic, problem, fitting)

    def _believes(self, f: Flown, trial: Trial) -> bool:
        """Return whether a trial that leaves nothing over counts.

        If it is unknown how the engine flies, a fault of contacts with a parameter does not: what is wrong with the
        flight would be left over, unless the parameter is that. Nor does a limit of speeds that a ball exceeds.
        """
        if not trial.is_fitted:
            return True
        if trial.fault == "cap":
            return trial.value >= (1 - SINGLE) * float(length(f.after.velocity).max())
        return self.habit.is_known

    def _second_opinion(self, f: Flown, part: Part, balls: Integers, elastic: Floats) -> list[StepError]:
        """Return the errors of a part that may be explained by contacts one after another, or found at some depth.

        What impulses along several contacts explain, contacts that are resolved one by one may explain too, and a push
        in the step of a contact may be the way that a ball has flown since.
        """
        at_once, pushed = part.kind in (COMPRESSIVE, PULLING), part.pushed > 0 and part.way % PUSHED_WAYS != 0
        if part.leans or not (at_once or pushed) or len(balls) > MAX_BALLS or self._opinions >= MAX_FITS:
            return []
        self._opinions += 1
        step = part.step
        problem = self._problem(f, step, balls)
        fitting = self._experience.search_rules(problem, depths=bool(pushed))
        self._experience.learn(fitting)
        return self._of_fitting(f, step, balls, elastic, problem, fitting) if fitting else []

    def _of_fitting(
        self,
        f: Flown,
        step: int,
        balls: Integers,
        elastic: Floats,
        problem: Problem,
        fitting: Sequence[Outcome],
    ) -> list[StepError]:
        """Return the errors of a group, of which some outcomes leave nothing over."""
        if fitting and fitting[0].trial.is_soft and (due := bounced_at_its_end(problem, fitting[0])):
            if problem.fits([due]) and due.trial.value > self._negligible(f):  # they part before they touch
                fitting = [due]
            else:
                self._accept(f, step, balls, elastic, due, problem)
                problem.exact = due
        candidates = [(outcome, self._cause_of(outcome, problem)) for outcome in fitting]
        contact = self._contact(problem, candidates)
        if not candidates:
            return self._of_unknown(f, step, balls, contact, problem)
        outcome, cause = candidates[0]
        because = "" if outcome.trial.is_wrong else self.habit.because
        error = self.measure.error(f, step, balls, contact, cause, because)
        if cause == Cause.MISSED:  # what restitution takes, it takes when the contact happens, if it does
            self._accept(f, step, balls, elastic, outcome, problem)
            end, should = (End.of(states, step, balls) for states in (f.after, f.exact))
            error.energy = self.measure.gain(end, should, balls)
            if outcome.trial.is_in_time:  # they fly on, and are not put apart
                error.because = self._passed(f, step, contact) if contact else because
        _name(error, candidates, problem)
        return [error]

    def _explain_again(self) -> None:
        """Explain steps that nothing had explained by what has explained others since."""
        known, still = len(self._experience), list[tuple[StepError, Problem]]()
        if known == self._known_before:
            return
        self._known_before = known
        for error, problem in self._unexplained:
            if error.cause != Cause.UNKNOWN:
                continue  # it has been found to be a spring, or an overlap
            fitting = [o for o in self._experience.search_known(problem) if o.trial.is_wrong]
            candidates = [(o, self._cause_of(o, problem)) for o in fitting]
            if not candidates or candidates[0][1] == Cause.MISSED:
                still.append((error, problem))
                continue
            self._experience.learn(fitting)
            error.contact, error.because, error.cause = self._contact(problem, candidates), "", candidates[0][1]
            _name(error, candidates, problem)
        self._unexplained = still

    def _passed(self, f: Flown, step: int, contact: tuple[int, int]) -> str:
        """Return how two bodies passed each other without a contact."""
        balls = [ball for ball in contact if ball >= 0]
        way = f.after.position[step, balls] - f.before.position[step, balls]
        is_through = self.touches.is_through(f, step, contact)
        return of_missed(self.scene, contact, way, self.touches.overlap_time(f, step, contact), is_through=is_through)

    def _problem(self, f: Flown, step: int, balls: Integers, end: End | None = None) -> Problem:
        """Return a group's step as a problem. end: how it should end, by default as it is computed."""
        ball = self._ball[balls]
        ball["x"], ball["y"] = f.before.position[step, balls].T
        ball["vx"], ball["vy"] = f.before.velocity[step, balls].T
        ball["spin"] = f.before.spin[step, balls]
        after = np.column_stack(
            [f.after.position[step, balls], f.after.velocity[step, balls], f.after.spin[step, balls]]
        )
        warm = self._experience.soft.before(self.measure.steps + step + 1, balls)
        group = Group(ball, f.piece, float(f.dt[step]))
        exact = np.column_stack(end) if end else None
        return Problem(group, after, self._gravity, f.floor, self._scratch, warm, exact)

    def _accept(
        self, f: Flown, step: int, balls: Integers, elastic: Floats, outcome: Outcome, problem: Problem
    ) -> None:
        """Take an outcome for what is right."""
        end = _end_of(outcome)
        if max(len(outcome.met), len(problem.exact.met)) < MET_KEPT:
            elastic[step] += outcome.met["elastic"].sum() - problem.exact.met["elastic"].sum()
        else:
            elastic[step] += self.measure.gain(end, End.of(f.exact, step, balls), balls)
        _set_exact(f, step, balls, end)

    def _rests(self, f: Flown, step: int, balls: Integers) -> bool:
        """Return whether balls that lie on each other stay where they are."""
        moved = np.abs(f.after.position[step, balls] - f.before.position[step, balls]).max()
        return bool(moved + np.abs(f.after.velocity[step, balls]).max() * f.dt[step] <= f.floor)

    def _by_reference(self, f: Flown, step: int, balls: Integers) -> tuple[End | None, bool]:
        """Return how some balls should end a step by the reference, if it can tell soon, and whether they do.

        It is not asked after too many steps unlike the reference.
        """
        if len(balls) > MAX_COMPUTED or self._unlike_reference >= MAX_FRUITLESS:
            return None, False
        if len(balls) > MAX_TRIED and self._are_deep(f, step, balls):
            return None, False
        dt, end = float(f.dt[step]), None
        x, v, spin = End.of(f.before, step, balls)
        start = State(0.0, x, v, f.before.angle[step, balls], spin)
        after, enough = End.of(f.after, step, balls), self._negligible(f)
        for exact in reference_steps(self.scene, balls, start, dt):
            end = End(exact.position, exact.velocity, exact.spin)
            off_x, off_v, spun = (np.abs(mine - due).max(initial=0.0) for mine, due in zip(after, end, strict=True))
            if max(off_x, off_v * dt, spun * float(self._bodies.radius[balls].max()) * dt) <= enough:
                self._unlike_reference = 0
                return after, True
        self._unlike_reference += 1
        return end, False

    def _are_deep(self, f: Flown, step: int, balls: Integers) -> bool:
        """Return whether some balls are so far in each other that the reference takes long to part them."""
        radius, filters = self._bodies.radius[balls], self._bodies.filters[balls]
        deepest, _, _ = deepest_overlap(f.before.position[step, balls], radius, filters)
        return deepest > DEEP * float(radius.min())

    def _uncomputed(self, f: Flown, step: int, balls: Integers, elastic: Floats) -> list[StepError]:
        """Return the error of a group whose exact step is not known from contact to contact; none if it is right."""
        if self._rests(f, step, balls):
            _set_exact(f, step, balls, End.of(f.after, step, balls))
            return []
        flight = End.of(self.measure.flown_in(f, step, {}), 0, balls)
        _set_exact(f, step, balls, flight)  # the contacts are not known
        end, is_right = self._by_reference(f, step, balls)
        if end:
            self._take(f, step, balls, elastic, end)
        if is_right:
            return []
        problem = self._problem(f, step, balls, end or flight)
        fitting = [o for o in self._experience.search_known(problem, soft=False) if not o.trial.is_in_time]
        if fitting:
            self._unlike_reference = 0
        elif end is None:
            return [self.measure.error(f, step, balls, None, Cause.UNKNOWN, _why_uncomputed(len(balls)))]
        self._experience.learn(fitting)
        wrong = self._of_fitting(f, step, balls, elastic, problem, fitting)
        for error in wrong:
            error.is_measured = end is not None
        return wrong

    def _cause_of(self, outcome: Outcome, problem: Problem) -> Cause:
        if not outcome.trial.is_wrong:
            return self.habit.cause or Cause.UNKNOWN
        return cause_of(outcome, problem)

    def _contact(self, problem: Problem, candidates: Sequence[tuple[Outcome, Cause]]) -> tuple[int, int] | None:
        """Return the contact that an error is named by: the first of what explains it, or the first that is missed."""
        due = _pairs(problem.exact)
        done = _pairs(candidates[0][0]) if candidates else []
        if candidates and candidates[0][1] == Cause.MISSED:
            done = [pair for pair in due if pair not in done]
        return next(iter([*done, *due]), None)

    def _of_unknown(
        self, f: Flown, step: int, balls: Integers, contact: tuple[int, int] | None, problem: Problem
    ) -> list[StepError]:
        """Return the errors of a group that no model explains: of each ball alone, if it can have had no contact."""
        off = np.abs((problem.after - problem.exact.after) * problem.scale) > f.floor
        if (far := self.measure.far_off(f, step, balls)).any():
            errors = self.measure.alone(f, step, balls[far], ~far[far], self.habit)
            if (others := balls[off.any(axis=1) & ~far]).size:
                errors.append(self.measure.error(f, step, others, None, Cause.UNKNOWN, NO_SINGLE_ERROR))
            return errors
        if contact or self.touches.among(f, step, balls.tolist()):
            error = self.measure.error(f, step, balls, contact, Cause.UNKNOWN, NO_SINGLE_ERROR)
            if len(self._unexplained) < MAX_FITS:
                self._unexplained.append((error, problem))
            return [error]
        wrong, kicked = off.any(axis=1), np.asarray(off[:, 2:].any(axis=1))
        return self.measure.alone(f, step, balls[wrong], kicked[wrong], self.habit)

    def _enter(self, states: States, f: Flown, elastic: Floats, errors: Sequence[StepError]) -> None:
        """Enter what is right about a block."""
        scene, bodies = self.scene, self.scene.bodies
        sums = self.rightful[0]
        size, gravity = scene.arena.size, scene.gravity
        start = energy(states.rows(slice(-1)), bodies, gravity, size)
        pushed, exact = (energy(s, bodies, gravity, size) for s in (f.before, f.exact))
        end = energy(f.after, bodies, gravity, size)
        sums[Cause.APPLIED] += float((pushed - start).sum())
        sums[Cause.ELASTICITY] += float(elastic.sum())
        rest = float((exact - pushed).sum() - elastic.sum())
        smooth = self.habit.cause or Cause.ROUNDING  # what is taken for right may have the engine's flight in it
        sums[Cause.FRICTION if scene.is_rough else smooth] += rest
        sums[Cause.ROUNDING] += float((end - exact).sum()) - sum(error.energy for error in errors)
        if scene.is_rough:
            turning = spin_energy(states.spin[[0, -1]], bodies.moment)
            sums[Cause.SPIN] += turning[1] - turning[0]


def _why_uncomputed(count: int) -> str:
    """Return why the exact step of some balls is not known."""
    if count > MAX_BALLS:
        return f"{count} balls touch in one step: too many to tell what is wrong."
    return "A ball leans on others, or goes round an edge: such a step is not computed."


def _pairs(outcome: Outcome) -> list[tuple[int, int]]:
    """Return the contacts of an outcome: first and second."""
    return [(int(m["first"]), int(m["second"])) for m in outcome.met]


def _name(error: StepError, candidates: list[tuple[Outcome, Cause]], problem: Problem) -> None:
    """Set what outcomes that leave nothing over say of an error, but for its cause."""
    met = candidates[0][0].met
    error.candidates, error.numbers = candidates, problem.numbers
    error.depth = float(met["depth"].max()) if len(met) else None


def _met(part: Part, depth: float) -> NDArray[np.void]:
    """Return the contact that shows how late a part's were found. depth: px."""
    met = np.zeros(1, MET)
    met["first"], met["second"], met["depth"], met["late"] = part.first, part.second, depth, part.late
    met["closing"] = part.closing
    return met


def _end_of(outcome: Outcome) -> End:
    return End(outcome.after[:, :2], outcome.after[:, 2:4], outcome.after[:, 4])


def _set_exact(f: Flown, step: int | Integers, balls: Integers, end: End) -> None:
    """Take an end of a step for the exact one."""
    for rows, values in zip((f.exact.position, f.exact.velocity, f.exact.spin), end, strict=True):
        rows[step, balls] = values
