"""The judge of one engine's run: each step, from the engine's own state before it, against the exact step.

Balls that do not fly as they should, and groups that do not do what the exact step does, become `StepError`s, each with
the models that leave nothing over. The ledger of a step is the exact step's own change, and the rest under its cause.
"""

from collections import Counter
from collections.abc import Hashable, Sequence
from copy import copy, deepcopy
from itertools import chain
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.judge.causes import NEGLIGIBLE, Cause
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
from sandbox.judge.flight import Flights, Habit, find_habit, flown, misses, ways_to_fall
from sandbox.judge.free_flight import balls_of
from sandbox.judge.groups import (
    FOUND,
    MAX_COMPUTED,
    NO_FRAME,
    Flown,
    frames_of,
    scratch_for,
    screen,
    work_for,
)
from sandbox.judge.kicks import of_kick
from sandbox.judge.law import LAW, Scope, law
from sandbox.judge.models import BY_NAME, FRICTION, Fields
from sandbox.judge.one_step import MET, Group
from sandbox.judge.reference_step import reference_steps
from sandbox.judge.search import Search, as_exact, cause_of, cause_of_law, cause_of_push, exact_trials
from sandbox.judge.soft_contacts import SoftMemory, bounced_at_its_end
from sandbox.judge.thresholds import DOUBLE, FAR, MAX_BALLS, MAX_FITS, MAX_FRUITLESS, MAX_VAIN, SINGLE
from sandbox.judge.touching import (
    Missed,
    Springs,
    StartOverlaps,
    StepError,
    Touch,
    Touches,
)
from sandbox.judge.words import NO_SINGLE_ERROR, of_depth, of_impulses, of_missed, of_push
from sandbox.quantity import energy, kinetic_energies, length, pass_through, passing, spin_energy
from sandbox.scene.model import Scene
from sandbox.scene.units import Dimension
from sandbox.scene.walls import wall_distance
from sandbox.state import NO_DAMPING, PUSH, Bools, Damping, Floats, Integers, Pushes, State, States

BLOCK_STEPS: Final = 256  # that are judged together, of few balls
BLOCK_STATES: Final = 100_000  # balls times steps, of many
MAX_PAIRS: Final = 400_000  # pairs of balls in steps that are looked through for how an engine flies
MAX_KNOWN: Final = 40  # trials that are tried first
MAX_CHUNK: Final = 256  # groups that are explained by the same known trials
SOLVED: Final = {PULLING: Cause.WARM_START, COMPRESSIVE: Cause.UNCONVERGED}  # what impulses along contacts show


class End(NamedTuple):
    """How some balls end a step: (k, 2) px and px/s, (k,) rad/s."""

    position: Floats
    velocity: Floats
    spin: Floats


class Sums(NamedTuple):
    """What is over of a part's step, as `Judge._sums` returns it: by pushes of what overlaps, and the rest."""

    pushes: Floats
    rest: Floats


class Judge:
    """Judges an engine's run block by block, each substep as a step.

    scene: that the engine runs; errors: in order of their substeps; rightful: (4, causes), what is right.
    """

    def __init__(self, scene: Scene, damping: Damping = NO_DAMPING) -> None:
        self._damping = damping
        self.scene, self._gravity = scene, (float(scene.gravity[0]), float(scene.gravity[1]))
        self._bodies, n = scene.bodies, len(scene.bodies)
        self._ball, self._frames = balls_of(scene, MAX_COMPUTED), frames_of(scene)
        self._own_ball = self._ball[:n]  # without the room that steps of groups work in
        self._begun = 0.0  # s, of the steps that are judged
        self._scratch = scratch_for(n + MAX_COMPUTED)
        self._law = np.array([law(self._gravity)], LAW)
        self._work = work_for(n)
        self._steps = 0  # substeps that are judged
        self._fits = self._fruitless = self._opinions = self._unlike_reference = 0
        self._vain_variations = self._vain_joins = 0
        self._known_before = 0  # trials, when what was unexplained was last looked at
        self._known: Counter[Hashable] = Counter()
        self._trials: dict[Hashable, Trial] = {}
        self._tried: list[Trial] = []
        self._models: dict[Hashable, list[tuple[Trial, Cause]]] = {}  # of these, that explain a part
        self._bases: list[Habit] = []
        self._falls: Counter[int] = Counter()  # of the ways to fall, how many steps each has explained
        self.against: Counter[str] = Counter()
        self._desk = desk_for(n)
        self._soft_memory = SoftMemory()
        self.touches = Touches(scene, self._frames)
        self._missed, self._springs = Missed(self.touches), Springs()
        self.contacts = np.zeros(1, np.int64)
        self.habit, self._knows_flight = Habit({}), False
        self._block = max(1, min(BLOCK_STEPS, BLOCK_STATES // n))
        self._held = States.empty(self._block + 1, n)
        self._held_pushes, self._held_dt = np.empty(0, PUSH), np.empty(0)
        self._unexplained: list[tuple[StepError, Problem]] = []
        self._gaining: list[tuple[StepError, Integers]] = []  # errors whose `gained` is to be set, with all their balls
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

    def whole_step(self, substep: int) -> int:
        """Return the step that contains a substep, both counted from 1."""
        return -(-substep // self._damping.substeps)

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
        floor, times = self._floor(states, dt), self._begun + np.cumsum(dt) - dt
        if not self._knows_flight:
            flies = self._free_balls((before, times), (after, times + dt))
            moves = np.maximum(length(before.velocity), length(after.velocity)) * dt[:, None] > floor
            if (flies & moves).any() or not any(self._gravity):  # what stays where it is may be held there
                flies &= moves
            flights = Flights(self.scene.units, self._own_ball, self._gravity, before, after, dt, floor, flies)
            habit = find_habit(flights, self._damping.per_second)
            self.habit, self._knows_flight = habit or Habit({}), habit is not None
        exact = self._flown(before, dt, {})
        strange = self._strays(after, self._flown(before, dt, self.habit.fields), dt, floor)
        frame = np.zeros(strange.shape, np.int64)
        f = Flown(before, after, exact, dt, strange, floor, times, frame, self._frames.of(0), self._frames.velocity[0])
        groups, member, elastic = self._screen(f)
        grouped = np.zeros(strange.shape, bool)
        errors: dict[int, list[StepError]] = {}
        views = [f.seen_from(self._frames, k) for k in range(len(self._frames.velocity))]
        for k, seen in enumerate(views):
            self._judge_groups(seen, *_of_frame(groups, member, k), elastic, grouped, errors)
            if seen is not f:
                steps, balls = np.nonzero(frame == k)
                end = _in_lab(seen, _end(seen.exact, steps, balls), (f.time + dt)[steps, None])
                _set_exact(f, steps, balls, end)
        off = self._strays(after, exact, dt, floor) & ~grouped
        if self.habit.cause is None:  # those that fly as they should met nothing
            for rows, flown_rows in zip(f.exact, f.after, strict=True):
                rows[off & ~strange] = flown_rows[off & ~strange]
            off &= strange
        for error in self._flights(f, off, strange):
            self._gaining.append((error, np.array(error.balls)))
            errors.setdefault(error.step - self._steps - 1, []).append(error)
        for step, of_step in errors.items():
            errors[step] = self._judge_joined(f, step, of_step, elastic)
        self._set_gained(f)
        of_block = []
        if not self._steps:
            self._start_overlaps = StartOverlaps(self.scene, states.position[0], self.touches)
        for step in range(len(dt)):
            of_step = self._missed.follow(views, step, self._steps + step + 1, errors.get(step, []))
            self._start_overlaps.follow(views, step, of_step)
            of_block += of_step
        self.errors += of_block
        self._explain_again()
        self._enter(states, f, elastic, of_block)
        self._steps += len(dt)
        self._begun += float(dt.sum())

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
            for part, balls, sums in self._explain(f, chunk, member, elastic, remains):
                step = part.step
                grouped[step, balls] = True
                wrong = self._judge_part(f, part, balls, sums, elastic, remains)
                if wrong:
                    self._gaining.append((wrong[0], balls))
                errors.setdefault(step, []).extend(wrong)
            begin, size = begin + size, min(2 * size, MAX_CHUNK)

    def _judge_joined(self, f: Flown, step: int, errors: list[StepError], elastic: Floats) -> list[StepError]:
        """Return the errors of a step, of which those that nothing explains are judged together where balls may meet.

        In the step, two may touch that neither the exact steps of their groups nor the engine leave in touch.
        """
        unknown = [k for k, error in enumerate(errors) if error.because == NO_SINGLE_ERROR]
        unknown = [k for k in unknown if not f.frame[step, list(errors[k].balls)].any()]  # by no wall that moves
        kept, again = set(range(len(errors))), list[StepError]()
        for joined in self._that_may_meet(f, step, [np.array(errors[k].balls) for k in unknown]):
            balls = np.unique(np.concatenate([errors[unknown[k]].balls for k in joined]))
            if len(balls) > MAX_COMPUTED or self._vain_joins >= MAX_VAIN:
                continue
            problem = self._problem(f, step, balls)
            ends = np.isfinite(problem.exact.left)
            is_exact = ends and as_exact(problem) is not None
            known = self._search_known(problem) if ends and not is_exact else []
            if not is_exact and not known:
                self._vain_joins += 1
                continue
            self._vain_joins = 0
            self._take(f, step, balls, elastic, _end_of(problem.exact))
            kept -= {unknown[k] for k in joined}
            together = self._judge_group(f, step, balls, elastic, [outcome.trial for outcome in known], ended=True)
            self._gaining += [(error, balls) for error in together[:1]]
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

    def _judge_part(
        self, f: Flown, part: Part, balls: Integers, sums: Sums, elastic: Floats, remains: Remains
    ) -> list[StepError]:
        """Return what is wrong with a part of a group, and note what pushes in it as a spring may."""
        step, touches = part.step, list[Touch]()
        doubtful = self._is_doubtful(f, part) or self._flies_through(f, part, balls)
        if part.kind in (UNCOMPUTED, UNEXPLAINED) or doubtful:
            tried = self._fitting(part) if part.kind == BY_LAW else []
            wrong = self._judge_group(f, step, balls, elastic, tried, ended=part.kind != UNCOMPUTED)
        else:
            wrong = self._second_opinion(f, part, balls, elastic) or self._of_part(
                f, part, balls, sums, elastic, remains
            )
        if any(error.by_rule for error in wrong):
            return wrong
        if wrong and len(balls) <= MAX_BALLS and part.kind == UNEXPLAINED:
            touches = self.touches.among(f, step, balls.tolist())
        elif len(balls) <= 2:
            contacts = dict.fromkeys(error.contact for error in wrong if error.contact)
            contacts |= dict.fromkeys(self._springs.before(self._steps + step + 1, balls.tolist()))
            touches = [self.touches.of(f, step, contact) for contact in contacts]
        self._springs.follow(touches, self._steps + step + 1, wrong)
        return wrong

    def _explain(
        self, f: Flown, groups: np.ndarray, member: Integers, elastic: Floats, remains: Remains
    ) -> list[tuple[Part, Integers, Sums]]:
        """Return the parts of some groups with what explains them, their balls, and their sums."""
        self._tried, self._models = self._likely, {}
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
        first, begins, counts = int(parts["begin"][0]), parts["begin"], parts["size"]
        rows, balls = np.repeat(parts["step"], counts), member[first : first + int(counts.sum())]
        end, exact = _end(f.after, rows, balls), _end(f.exact, rows, balls)
        without = end._replace(position=end.position - remains.shift[rows, balls])
        pushes, rest = (self._sums(f, *ends, balls, begins - first) for ends in ((end, without), (without, exact)))
        each = zip((Part(*row) for row in parts.tolist()), pushes, rest, strict=True)
        return [(part, member[part.begin : part.begin + part.size], Sums(*of_part)) for part, *of_part in each]

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
        faulty = [trial for trial in self._fitting(part) if trial.fault]
        return any(
            part.pushed
            or trial.is_soft
            or BY_NAME[trial.fault].cause in (FRICTION, Cause.MISSED)
            or not self._believes(f, trial)
            for trial in faulty
        )

    def _flies_through(self, f: Flown, part: Part, balls: Integers) -> bool:
        """Return whether balls that fly as the engine does pass through what the exact step has them bounce off."""
        if part.kind != BY_FLIGHT:
            return False
        step = part.step
        off = np.abs(f.after.velocity[step, balls] - f.exact.velocity[step, balls]).max() * f.dt[step]
        if off <= f.floor:
            return False
        return any(self.touches.passes(f, step, pair) for pair in _pairs(self._problem(f, step, balls).exact))

    def _fitting(self, part: Part) -> list[Trial]:
        """Return the known trials that leave nothing over of a part."""
        bits = part.fits
        return [trial for k, trial in enumerate(self._tried) if bits >> k & 1]

    def _of_part(
        self, f: Flown, part: Part, balls: Integers, sums: Sums, elastic: Floats, remains: Remains
    ) -> list[StepError]:
        """Return the errors of a part that is explained: of places, of impulses, and of contacts found late."""
        step, kind, errors = part.step, part.kind, list[StepError]()
        if kind in (EXACT, LEANING) and not part.pushed:
            return errors
        if part.pushed:
            pair, cause = (part.pushed_first, part.pushed_second), cause_of_push(part)
            errors.append(self._error(f, step, balls, pair, cause, of_push(self.scene, part, cause), sums.pushes))
        if kind in (EXACT, LEANING):
            return errors
        end, exact = _end(f.after, step, balls), _end(f.exact, step, balls)
        end, over = end._replace(position=end.position - remains.shift[step, balls]), sums.rest
        if kind == BY_FLIGHT:
            return [*self._by_habit(f, step, balls, self._bases[part.base], (end, exact)), *errors]
        contact = part.first, part.second
        if kind in (COMPRESSIVE, PULLING):
            solved = remains.solved[step, balls]
            solution = end._replace(velocity=solved[:, :2], spin=solved[:, 2])
            cause, [over] = SOLVED[kind], self._sums(f, end, solution, balls)
            errors.append(self._error(f, step, balls, contact, cause, of_impulses(self.scene, part, cause), over))
            end, [over] = solution, self._sums(f, solution, exact, balls)
        fitting = self._fitting(part) if kind == BY_LAW else []
        right = not any(trial.fault for trial in fitting)
        if right and self._is_in_time(f, part):  # all at once, of which the law says nothing
            self._take(f, step, balls, elastic, end)
            return errors
        if fitting:
            return [*self._of_law(f, part, balls, fitting, over, exact.position), *errors]
        late = self._error(f, step, balls, contact, Cause.LATE, of_depth(self.scene, part.depth, part.closing), over)
        late.depth, late.by_rule = part.depth, kind == TOGETHER
        return [late, *errors] if self._shows(f, late) else errors

    def _of_law(
        self, f: Flown, part: Part, balls: Integers, fitting: Sequence[Trial], over: Floats, should: Floats
    ) -> list[StepError]:
        """Return the error of a part that known laws explain. over: as `_sums`; should: (k, 2) px, where balls end."""
        models = self._models_of(part, fitting)
        late, in_time = _met(part, part.depth), _met(part, 0.0)
        candidates = [
            (Outcome(trial, 0.0, in_time if trial.is_in_time else late, should), cause) for trial, cause in models
        ]
        (outcome, cause), contact = candidates[0], (part.first, part.second)
        error = self._error(f, part.step, balls, contact, cause, "", over)
        error.depth, error.candidates = float(outcome.met["depth"][0]), candidates
        error.by_rule = not any(trial.fault for trial, _ in models)
        self._known.update(trial.key for trial, _ in models if trial.fault)
        return [error] if self._shows(f, error) else []

    def _models_of(self, part: Part, fitting: Sequence[Trial]) -> list[tuple[Trial, Cause]]:
        """Return the known trials that explain a part, the first of each model, with their causes."""
        seen = part.fits, part.second >= 0, part.least <= 0, part.moved
        if seen not in self._models:
            models: dict[Hashable, tuple[Trial, Cause]] = {}
            for trial in without_idle_faults(fitting):
                cause = cause_of_law(trial, part.least, part.second >= 0, moved=bool(part.moved))
                models.setdefault((trial.model, cause), (trial, cause))
            several = any(trial.fault for trial, _ in models.values())
            self._models[seen] = [*models.values()][: None if several else 1]
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
        if f.frame[step, balls[0]] != NO_FRAME:  # else the walls may have given it
            elastic[step] += self._energy(end, balls) - self._energy(_end(f.exact, step, balls), balls)
        _set_exact(f, step, balls, end)

    def _free_balls(self, *ends: tuple[States, Floats]) -> Bools:
        """Return which balls touch nothing before a step and after it: (steps, n); of many balls, in some steps.

        ends: the states there, and their times, (steps,) s.
        """
        n, radius, filters = len(self._bodies), self._bodies.radius, self._bodies.filters
        steps = len(ends[0][1])
        rows = min(steps, max(1, MAX_PAIRS // (n * n)))
        free = np.zeros((steps, n), bool)
        free[:rows] = True
        for states, times in ends:
            x = states.position[:rows]
            free[:rows] &= wall_distance(self.scene, x, times[:rows, None]) > (1 + FAR) * radius
            for i in range(n - 1):
                apart = length(x[:, i + 1 :] - x[:, i : i + 1]) > (1 + FAR) * (radius[i + 1 :] + radius[i])
                apart |= pass_through(filters[i], filters[i + 1 :].T)
                free[:rows, i] &= apart.all(axis=1)
                free[:rows, i + 1 :] &= apart
        return free

    @property
    def undecided(self) -> list[StepError]:
        """The contacts among the errors that may still follow."""
        return self._missed.undecided(self._steps)

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
        seconds, n = self.scene.clock.time(self.whole_step(self._steps)), len(self._bodies)
        return seconds * n / (n + 2 * int(self.contacts[0]))

    def _floor(self, states: States, dt: Floats) -> float:
        """Return the noise of a step, px, from the precision of the engine's numbers."""
        position, velocity = states.position[1:], states.velocity[1:]
        single = all(np.array_equal(a, a.astype(np.float32)) for a in (position, velocity))
        fractional = bool((position != np.round(position)).any())
        precision = SINGLE if single and fractional else DOUBLE
        reach = float(np.abs(states.position).max())
        return precision * (reach + float(np.abs(velocity).max() * dt.max()))

    def _flown(self, before: States, dt: Floats, fields: Fields) -> States:
        """Return the states after steps of free flight. fields: of LAW, that are not exact."""
        return flown(self._own_ball, before, dt, self._gravity, fields)

    def _flown_in(self, f: Flown, step: int, fields: Fields) -> States:
        """Return the state after one step of free flight, as the only row. fields: as for `_flown`."""
        row = slice(step, step + 1)
        return self._flown(f.before.rows(row), f.dt[row], fields)

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
        args = f, self._ball, self._frames, self._law, self._scratch, work, found, member, elastic, contacts
        return found[: screen(*args)], member, elastic

    def _flights(self, f: Flown, off: Bools, strange: Bools) -> list[StepError]:
        """Return the errors of balls that fly alone: one of each kind in each step."""
        errors = []
        for step in np.flatnonzero(off.any(axis=1)).tolist():
            by_habit = off[step] & ~strange[step]
            if by_habit.any():
                balls = np.flatnonzero(by_habit)
                ends = _end(f.after, step, balls), _end(f.exact, step, balls)
                errors += self._by_habit(f, step, balls, self.habit, ends, times=len(balls))
            alone = np.flatnonzero(off[step] & strange[step])
            slower = length(f.after.velocity[step, alone] - f.exact.velocity[step, alone])
            spun = np.abs(f.after.spin[step, alone] - f.exact.spin[step, alone]) * self._bodies.radius[alone]
            errors += self._alone(f, step, alone, np.maximum(slower, spun) * f.dt[step] > f.floor)
        return errors

    def _alone(self, f: Flown, step: int, balls: Integers, kicked: Bools) -> list[StepError]:
        """Return the errors of balls that touch nothing. kicked: (k,), whether a velocity or spin is wrong."""
        beside, errors = kicked & self._beside(f, step, balls), list[StepError]()
        if (met := balls[beside]).size:
            errors.append(self._flight(f, step, met, Cause.UNKNOWN, NO_SINGLE_ERROR))
        if (changed := balls[kicked & ~beside]).size:
            errors.append(self._flight(f, step, changed, Cause.UNREPORTED, self._kicked(f, step, int(changed[0]))))
        if (put := balls[~kicked]).size:
            errors.append(self._flight(f, step, put, Cause.TELEPORTED, self._put(f, step, int(put[0]))))
        return errors

    def _beside(self, f: Flown, step: int, balls: Integers) -> Bools:
        """Return which of some balls may have met another that is elsewhere than its flight leads: (k,)."""
        radius, flown = self._bodies.radius, self._flown_in(f, step, self.habit.fields)
        x = f.after.position[step]
        off = length(x - flown.position[0]) + f.dt[step] * length(f.after.velocity[step] - flown.velocity[0])
        others = np.flatnonzero(off > f.floor)
        apart = length(x[others] - x[balls][:, None]) - radius[others] - radius[balls][:, None]
        enough = off[others] + off[balls][:, None] + FAR * radius[balls][:, None]
        meet = (others != balls[:, None]) & ~passing(self._bodies.filters, balls[:, None], others[None])
        beside: Bools = ((apart <= enough) & meet).any(axis=1)
        return beside

    def _time(self, step: int) -> float:
        return self.scene.clock.time(self.whole_step(self._steps + step + 1))

    def _kicked(self, f: Flown, step: int, ball: int) -> str:
        dv = f.after.velocity[step, ball] - f.exact.velocity[step, ball]
        spin = f.after.spin[step, ball] - f.exact.spin[step, ball]
        when = f"in the step to {self._time(step):.3f} s"
        if np.hypot(*dv) * f.dt[step] <= f.floor:
            return f"The spin of ball {ball} changed by {spin:.3g} rad/s {when}, without a contact."
        should, after = (states.velocity[step, ball] + f.velocity for states in (f.exact, f.after))
        return of_kick(self.scene.units, ball, should, after, when)

    def _put(self, f: Flown, step: int, ball: int) -> str:
        dx = f.after.position[step, ball] - f.exact.position[step, ball]
        way = self.scene.units.text(Dimension.LENGTH, "({:.3g}, {:.3g})", *dx)
        return f"Ball {ball} was put {way} from where its flight led to in the step to {self._time(step):.3f} s."

    def _by_habit(
        self, f: Flown, step: int, balls: Integers, habit: Habit, ends: tuple[End, End], times: int = 1
    ) -> list[StepError]:
        """Return the errors of balls that fly as the engine does: of each habit within it by itself."""
        end, should = ends
        errors = []
        if habit.within:
            middle = _end(self._flown_in(f, step, habit.within.fields), 0, balls)
            errors = self._by_habit(f, step, balls, habit.within, (middle, should), times)
            should = middle
        [over] = self._sums(f, end, should, balls)
        error = self._error(f, step, balls, None, habit.cause or Cause.UNKNOWN, habit.because, over, times)
        return [error, *errors]

    def _flight(self, f: Flown, step: int, balls: Integers, cause: Cause, because: str) -> StepError:
        return self._error(f, step, balls, None, cause, because, times=len(balls))

    def _error(
        self,
        f: Flown,
        step: int,
        balls: Integers,
        contact: tuple[int, int] | None,
        cause: Cause,
        because: str,
        over: Floats | None = None,
        times: int = 1,
    ) -> StepError:
        """Return the error of some balls. over: as `_sums`, by default of all that is over of the exact step."""
        if over is None:
            [over] = self._sums(f, _end(f.after, step, balls), _end(f.exact, step, balls), balls)
        shown = [b for b in contact if b >= 0] if contact else [int(balls[0])]
        energy, momentum, displacement, speed = over.tolist()
        before, after, exact = (
            (rows.velocity[step, shown] + f.velocity, rows.spin[step, shown]) for rows in (f.before, f.after, f.exact)
        )
        return StepError(
            self._steps + step + 1,
            tuple(balls.tolist()),
            contact,
            cause,
            because,
            energy,
            momentum / len(shown),
            displacement,
            speed,
            before[0],
            after[0],
            exact[0],
            (before[1], after[1], exact[1]),
            f.before.position[step, shown],
            f.velocity,
            float(f.dt[step]),
            times=times,
        )

    def _sums(self, f: Flown, end: End, should: End, balls: Integers, begins: Integers | None = None) -> Floats:
        """Return what is over of how some balls should have ended a step, of each part of them: (parts, 4).

        Its energy (kg px²/s²), momentum (kg px/s), displacement (px) and speed (px/s). begins: of the parts in balls,
        by default of one.
        """
        off_v, off_x = length(end.velocity - should.velocity), length(end.position - should.position)
        energy = self._energies(_in_lab(f, end), balls) - self._energies(_in_lab(f, should), balls)
        of_ball = np.stack([energy, self._bodies.mass[balls] * off_v, off_x, off_v], axis=1)
        sums: Floats = np.add.reduceat(of_ball, np.zeros(1, np.int64) if begins is None else begins)
        return sums

    def _set_gained(self, f: Flown) -> None:
        """Set what the balls of errors gained, see `StepError`; zeros if a wall is near enough to have given it."""
        if not self._gaining:
            return
        errors, parts = zip(*self._gaining, strict=True)
        self._gaining = []
        counts, balls = [len(part) for part in parts], np.concatenate(parts)
        begins, rows = np.cumsum([0, *counts[:-1]]), np.repeat([e.step - self._steps - 1 for e in errors], counts)
        mass, moment, radius = (
            values[balls] for values in (self._bodies.mass, self._bodies.moment, self._bodies.radius)
        )
        dt, centre = f.dt[rows], np.divide(self.scene.arena.size, 2)
        x, v, y, w = (a[rows, balls] for states in (f.before, f.after) for a in (states.position, states.velocity))
        way = dt * (np.maximum(length(v), length(w)) + dt * float(np.hypot(*self._gravity))) + length(y - x)
        way += dt * max((float(np.hypot(*wall.velocity)) for wall in self.scene.walls), default=0.0)
        by_wall = np.logical_or.reduceat(wall_distance(self.scene, x, f.time[rows]) <= radius + way, begins)
        before = States(*(a[rows, balls][:, None] for a in f.before))
        given = flown(self._ball[:1], before, dt, self._gravity, self._given)  # whose size does not matter
        at, fallen = given.position[:, 0] - centre, given.velocity[:, 0]
        turned = mass * (_cross(y - centre, w) - _cross(at, fallen))
        spun = moment * (f.after.spin[rows, balls] - given.spin[:, 0])
        gained = np.add.reduceat(np.column_stack([mass[:, None] * (w - fallen), turned + spun]), begins)
        gained[by_wall] = 0.0
        for error, of_error in zip(errors, gained, strict=True):
            error.gained = of_error

    @property
    def _given(self) -> Fields:
        """What gravity and damping do to a ball in flight, as the engine integrates them."""
        return {name: self.habit.fields[name] for name in ("theta", "left", "slows_first") if name in self.habit.fields}

    def _energy(self, end: End, balls: Integers) -> float:
        """Return the energy of some balls, kg px²/s²."""
        return float(self._energies(end, balls).sum())

    def _energies(self, end: End, balls: Integers) -> Floats:
        """Return the energy of each of some balls, kg px²/s²: (k,)."""
        mass, moment = self._bodies.mass[balls], self._bodies.moment[balls]
        return kinetic_energies(end.velocity, end.spin, mass, moment) - mass * (end.position @ self._gravity)

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
            fitting = [o for o in self._search(problem) if self._believes(f, o.trial)]
        if not fitting:
            end, is_right = self._by_reference(f, step, balls)
            if end and is_right:
                self._take(f, step, balls, elastic, end)
                return []
        self._learn(fitting)
        self._soft_memory.follow(problem, fitting)
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
        search = self._search_of(problem)
        fitting = self._vary(search, self._likely) or search.one_by_one(depths=bool(pushed))
        self._learn(fitting)
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
        error = self._error(f, step, balls, contact, cause, because)
        if cause == Cause.MISSED:  # what restitution takes, it takes when the contact happens, if it does
            self._accept(f, step, balls, elastic, outcome, problem)
            ends = (_in_lab(f, _end(states, step, balls)) for states in (f.after, f.exact))
            end, should = (self._energy(end, balls) for end in ends)
            error.energy = end - should
            error.because = self._passed(f, step, contact) if contact else because
        _name(error, candidates, problem)
        return [error]

    def _explain_again(self) -> None:
        """Explain steps that nothing had explained by what has explained others since."""
        known, still = len(self._trials), list[tuple[StepError, Problem]]()
        if known == self._known_before:
            return
        self._known_before = known
        for error, problem in self._unexplained:
            if error.cause != Cause.UNKNOWN:
                continue  # it has been found to be a spring, or an overlap
            fitting = [o for o in self._search_known(problem) if o.trial.is_wrong]
            candidates = [(o, self._cause_of(o, problem)) for o in fitting]
            if not candidates or candidates[0][1] == Cause.MISSED:
                still.append((error, problem))
                continue
            self._learn(fitting)
            error.contact, error.because, error.cause = self._contact(problem, candidates), "", candidates[0][1]
            _name(error, candidates, problem)
        self._unexplained = still

    @property
    def _likely(self) -> list[Trial]:
        """What has explained most steps so far."""
        return [self._trials[name] for name, _ in self._known.most_common(MAX_KNOWN)]

    def _search_of(self, problem: Problem) -> Search:
        return Search(problem, self.habit.fields, self._soft_memory, rough=self.scene.is_rough)

    def _search(self, problem: Problem) -> list[Outcome]:
        """Return what explains a step: of what has explained others or, if that does not, of all models."""
        fitting = self._search_known(problem)
        few = len(problem.group.ball) <= MAX_BALLS
        if not fitting and few and self._fits < MAX_FITS and self._fruitless < MAX_FRUITLESS:
            fitting = self._search_of(problem).all()
            self._fits += 1
            self._fruitless = 0 if fitting else self._fruitless + 1
        return fitting

    def _search_known(self, problem: Problem) -> list[Outcome]:
        """Return what explains a step of what has explained others, if need be in steps by another rule."""
        search, likely = self._search_of(problem), self._likely
        fitting = search.known(likely)
        return fitting or self._vary(search, likely)

    def _vary(self, search: Search, likely: Sequence[Trial]) -> list[Outcome]:
        """Return what explains a step by any rule, also with faults that others show; not after many in vain."""
        if self._vain_variations >= MAX_VAIN:
            return []
        fitting = search.varied([trial for trial in likely if trial.fault and not trial.is_in_time])
        self._vain_variations = 0 if fitting else self._vain_variations + 1
        return fitting

    def _passed(self, f: Flown, step: int, contact: tuple[int, int]) -> str:
        """Return how two bodies passed each other without a contact."""
        balls = [ball for ball in contact if ball >= 0]
        way = f.after.position[step, balls] - f.before.position[step, balls]
        is_through = self.touches.is_through(f, step, contact)
        return of_missed(self.scene, contact, way, self.touches.overlap_time(f, step, contact), is_through=is_through)

    def _problem(self, f: Flown, step: int, balls: Integers, exact: Floats | None = None) -> Problem:
        """Return a group's step as a problem. exact: as for that."""
        ball = self._ball[balls]
        ball["x"], ball["y"] = f.before.position[step, balls].T
        ball["vx"], ball["vy"] = f.before.velocity[step, balls].T
        ball["spin"] = f.before.spin[step, balls]
        after = np.column_stack(
            [f.after.position[step, balls], f.after.velocity[step, balls], f.after.spin[step, balls]]
        )
        warm = self._soft_memory.before(self._steps + step + 1, balls)
        group = Group(ball, f.piece, float(f.dt[step]))
        return Problem(group, after, self._gravity, f.floor, self._scratch, warm, exact)

    def _accept(
        self, f: Flown, step: int, balls: Integers, elastic: Floats, outcome: Outcome, problem: Problem
    ) -> None:
        """Take an outcome for what is right."""
        end = _end_of(outcome)
        if max(len(outcome.met), len(problem.exact.met)) < MET_KEPT:
            elastic[step] += outcome.met["elastic"].sum() - problem.exact.met["elastic"].sum()
        else:
            elastic[step] += self._energy(end, balls) - self._energy(_end(f.exact, step, balls), balls)
        _set_exact(f, step, balls, end)

    def _learn(self, fitting: Sequence[Outcome]) -> None:
        """Remember what explains a step, to be tried in others: of each fault first in the step that explains most."""
        best: dict[Hashable, Trial] = {}
        for trial in (outcome.trial for outcome in fitting):
            if not trial.is_soft and trial.scope.get("scope") != Scope.ONE:
                self._trials.setdefault(trial.key, trial)
                self._known[trial.key] += 0
                model = trial.model if trial.fault else ""
                if self._known[trial.key] > self._known[best.setdefault(model, trial).key]:
                    best[model] = trial
        self._known.update(trial.key for trial in best.values())

    def _rests(self, f: Flown, step: int, balls: Integers) -> bool:
        """Return whether balls that lie on each other stay where they are."""
        moved = np.abs(f.after.position[step, balls] - f.before.position[step, balls]).max()
        return bool(moved + np.abs(f.after.velocity[step, balls]).max() * f.dt[step] <= f.floor)

    def _by_reference(self, f: Flown, step: int, balls: Integers) -> tuple[End | None, bool]:
        """Return how some balls should end a step by the reference, if they are few, and whether they do.

        Near walls that do not move alike, nothing else knows that; elsewhere, it ends after too many steps unlike the
        reference.
        """
        only_way = bool(f.frame[step, balls[0]] == NO_FRAME)
        if len(balls) > MAX_TRIED or (self._unlike_reference >= MAX_FRUITLESS and not only_way):
            return None, False
        time, dt, end = float(f.time[step]), float(f.dt[step]), None
        x, v, spin = _in_lab(f, _end(f.before, step, balls), time)
        start = State(time, x, v, f.before.angle[step, balls], spin)
        after, enough = _end(f.after, step, balls), self._negligible(f)
        for exact in reference_steps(self.scene, balls, start, dt):
            end = End(exact.position - (time + dt) * f.velocity, exact.velocity - f.velocity, exact.spin)
            off_x, off_v, spun = (np.abs(mine - due).max(initial=0.0) for mine, due in zip(after, end, strict=True))
            if max(off_x, off_v * dt, spun * float(self._bodies.radius[balls].max()) * dt) <= enough:
                self._unlike_reference = 0
                return after, True
        self._unlike_reference += not only_way
        return end, False

    def _uncomputed(self, f: Flown, step: int, balls: Integers, elastic: Floats) -> list[StepError]:
        """Return the error of a group whose exact step is not known from contact to contact; none if it is right."""
        if self._rests(f, step, balls):
            _set_exact(f, step, balls, _end(f.after, step, balls))
            return []
        _set_exact(f, step, balls, _end(self._flown_in(f, step, {}), 0, balls))  # the contacts are not known
        end, is_right = self._by_reference(f, step, balls)
        if end:
            self._take(f, step, balls, elastic, end)
            return [] if is_right else self._of_known(f, step, balls, elastic, end)
        because = (
            "A ball leans on others, goes round an edge, or is near walls that move: such a step is not computed."
            if len(balls) <= MAX_BALLS
            else f"{len(balls)} balls touch in one step: too many to tell what is wrong."
        )
        return [self._error(f, step, balls, None, Cause.UNKNOWN, because)]

    def _of_known(self, f: Flown, step: int, balls: Integers, elastic: Floats, end: End) -> list[StepError]:
        """Return the error of balls whose exact step only the reference knows, by what has explained others' steps."""
        exact = np.column_stack([end.position, end.velocity, end.spin])
        problem = self._problem(f, step, balls, exact)
        fitting = [o for o in self._search_known(problem) if not o.trial.is_in_time and not o.trial.is_soft]
        if fitting:
            self._unlike_reference = 0
        self._learn(fitting)
        return self._of_fitting(f, step, balls, elastic, problem, fitting)

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
        if contact or self.touches.among(f, step, balls.tolist()):
            error = self._error(f, step, balls, contact, Cause.UNKNOWN, NO_SINGLE_ERROR)
            if len(self._unexplained) < MAX_FITS:
                self._unexplained.append((error, problem))
            return [error]
        wrong, kicked = off.any(axis=1), np.asarray(off[:, 2:].any(axis=1))
        return self._alone(f, step, balls[wrong], kicked[wrong])

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
        work = self._work_of_walls(f)
        sums[Cause.MOVING_WALLS] += work
        rest = float((exact - pushed).sum() - elastic.sum() - work)
        smooth = self.habit.cause or Cause.ROUNDING  # what is taken for right may have the engine's flight in it
        sums[Cause.FRICTION if scene.is_rough else smooth] += rest
        sums[Cause.ROUNDING] += float((end - exact).sum()) - sum(error.energy for error in errors)
        if scene.is_rough:
            turning = spin_energy(states.spin[[0, -1]], bodies.moment)
            sums[Cause.SPIN] += turning[1] - turning[0]

    def _work_of_walls(self, f: Flown) -> float:
        """Return what walls that move give in the exact steps of a block, kg px²/s²: their velocity times the impulse.

        All that balls get near walls that do not move alike counts as theirs.
        """
        (steps, balls), (rows, at) = np.nonzero(f.frame > 0), np.nonzero(f.frame == NO_FRAME)
        given = f.exact.velocity[steps, balls] - f.before.velocity[steps, balls] - np.outer(f.dt[steps], self._gravity)
        power = (self._frames.velocity[f.frame[steps, balls]] * given).sum(axis=1) * self._bodies.mass[balls]
        end, start = (self._energy(_end(states, rows, at), at) for states in (f.exact, f.before))
        return float(power.sum()) + end - start


def _cross(a: Floats, b: Floats) -> Floats:
    """Return the cross product of vectors, (k, 2) each: (k,)."""
    product: Floats = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return product


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
    met["first"], met["second"], met["depth"], met["closing"] = part.first, part.second, depth, part.closing
    return met


def _of_frame(groups: np.ndarray, member: Integers, k: int) -> tuple[np.ndarray, Integers]:
    """Return the groups that are judged in a frame, and their members."""
    chosen = groups[np.maximum(groups["frame"], 0) == k]
    members = [member[begin : begin + count] for begin, count in zip(chosen["begin"], chosen["count"], strict=True)]
    chosen["begin"] = np.cumsum(chosen["count"]) - chosen["count"]
    return chosen, np.concatenate([member[:0], *members])


def _in_lab(f: Flown, end: End, time: float | Floats = 0.0) -> End:
    """Return how balls end a step as it is outside the frame of a block. time: s, for where they are."""
    return end._replace(position=end.position + time * f.velocity, velocity=end.velocity + f.velocity)


def _end(states: States, step: int | Integers, balls: Integers) -> End:
    return End(states.position[step, balls], states.velocity[step, balls], states.spin[step, balls])


def _end_of(outcome: Outcome) -> End:
    return End(outcome.after[:, :2], outcome.after[:, 2:4], outcome.after[:, 4])


def _set_exact(f: Flown, step: int | Integers, balls: Integers, end: End) -> None:
    """Take an end of a step for the exact one."""
    for rows, values in zip((f.exact.position, f.exact.velocity, f.exact.spin), end, strict=True):
        rows[step, balls] = values
