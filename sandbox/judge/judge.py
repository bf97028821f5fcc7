"""The judge of one engine's run: each step, from the engine's own state before it, against the exact step.

Balls that do not fly as they should, and groups that do not do what the exact step does, become `StepError`s, each with
the models that leave nothing over. The ledger of a step is the exact step's own change, and the rest under its cause.
"""

from collections import Counter
from collections.abc import Sequence
from typing import Final

import numpy as np

from sandbox.engines.walls import pieces_of
from sandbox.judge.causes import Cause
from sandbox.judge.fit import Outcome, Problem, Trial
from sandbox.judge.flight import Habit, find_habit, flown, misses
from sandbox.judge.groups import FOUND, MAX_COMPUTED, Flown, Work, balls_of, scratch_for, screen
from sandbox.judge.law import LAW, Scope, law
from sandbox.judge.one_step import Group
from sandbox.judge.search import Search, as_exact, cause_of
from sandbox.judge.thresholds import DOUBLE, FAR, MAX_BALLS, MAX_FITS, NEARLY, SINGLE
from sandbox.judge.touching import Missed, Springs, StepError, Touches
from sandbox.judge.words import of_outcome
from sandbox.quantity import energy, length, outside, segment_distance, spin_energy
from sandbox.scene.model import Scene
from sandbox.state import Bools, Floats, Integers, Pushes, States

MAX_PAIRS: Final = 2_000_000  # pairs of balls in steps that are looked through for how an engine flies
MAX_KNOWN: Final = 40  # trials that are tried first


class Judge:
    """Judges an engine's run block by block. errors: in order of their steps; sums: (4, causes), as the ledger's."""

    def __init__(self, scene: Scene) -> None:
        self._scene, self._gravity = scene, (float(scene.gravity[0]), float(scene.gravity[1]))
        n = len(scene.bodies)
        self._ball, self._piece = balls_of(scene, MAX_COMPUTED), pieces_of(scene)
        self._scratch = scratch_for(n + MAX_COMPUTED)
        self._law = np.array([law(self._gravity)], LAW)
        self._order = np.arange(n)
        self._steps = 0
        self._fits = 0
        self._known: Counter[str] = Counter()
        self._trials: dict[str, Trial] = {}
        self._touches = Touches(scene)
        self._missed, self._springs = Missed(self._touches), Springs()
        self.contacts = np.zeros(1, np.int64)
        self.habit, self._knows_flight = Habit({}), False
        self.precision = DOUBLE
        self.errors: list[StepError] = []
        self.rightful = np.zeros((4, len(Cause)))

    def add(self, states: States, pushes: Pushes, dt: Floats) -> None:
        """Judge a block of steps. states: of steps + 1 rows; pushes: by a hand, by row; dt: (steps,) s."""
        before, after = states.rows(slice(-1)), states.rows(slice(1, None))
        velocity = before.velocity.copy()
        np.add.at(velocity, (pushes["row"] - 1, pushes["ball"]), pushes["dv"])
        before = before._replace(velocity=velocity)
        floor = self._floor(states, dt)
        if not self._knows_flight:
            habit = find_habit(before, after, dt, self._gravity, floor, self._free_balls(before, after))
            self.habit, self._knows_flight = habit or Habit({}), habit is not None
        exact = self._free(before, dt)
        spun = np.abs(after.spin - before.spin) * self._scene.bodies.radius * dt[:, None]
        off = np.maximum(misses(before, after, dt, (exact.position, exact.velocity)), spun) > floor
        if self.habit.cause is not None:
            habitual = misses(before, after, dt, flown(before, dt, self.habit.fields, self._gravity))
            strange = np.maximum(habitual, spun) > floor
        else:
            strange = off
        f = Flown(before, after, exact, dt, strange, floor)
        groups, member, elastic = self._screen(f)
        grouped = np.zeros(off.shape, bool)
        errors: dict[int, list[StepError]] = {}
        for row in groups:
            step, balls = int(row["step"]), member[row["begin"] : row["begin"] + row["count"]]
            grouped[step, balls] = True
            wrong = self._judge_group(f, step, balls, elastic, ended=bool(row["ended"]))
            if wrong and len(balls) <= MAX_COMPUTED:
                touches = self._touches.among(f, step, balls.tolist())
                self._springs.follow(touches, self._steps + step + 1, wrong)
            errors.setdefault(step, []).extend(wrong)
        spun = np.abs(after.spin - exact.spin) * self._scene.bodies.radius * dt[:, None]
        off = np.maximum(misses(before, after, dt, (exact.position, exact.velocity)), spun) > floor
        for error in self._flights(f, off & ~grouped, strange):
            errors.setdefault(error.step - self._steps - 1, []).append(error)
        found = []
        for step in range(len(dt)):
            found += self._missed.follow(f, step, self._steps + step + 1, errors.get(step, []))
        self.errors += found
        self._enter(states, f, elastic, found)
        self._steps += len(dt)

    def _free_balls(self, before: States, after: States) -> Bools:
        """Return which balls touch nothing before a step and after it: (steps, n); of many balls, in some steps."""
        n, radius = len(self._order), self._scene.bodies.radius
        rows = min(len(before.position), max(1, MAX_PAIRS // (n * n)))
        free = np.zeros((len(before.position), n), bool)
        free[:rows] = True
        for states in (before, after):
            x = states.position[:rows]
            if self._scene.arena.walls:
                free[:rows] &= -outside(x, self._scene.arena.size) > (1 + FAR) * radius
            for wall in self._scene.walls:
                free[:rows] &= segment_distance(x, wall.start, wall.to) - wall.thickness / 2 > (1 + FAR) * radius
            for i in range(n - 1):
                apart = length(x[:, i + 1 :] - x[:, i : i + 1]) > (1 + FAR) * (radius[i + 1 :] + radius[i])
                free[:rows, i] &= apart.all(axis=1)
                free[:rows, i + 1 :] &= apart
        return free

    @property
    def mean_time(self) -> float:
        """The time between two contacts of a ball, on average, s: so long does an error of a velocity act."""
        seconds, n = self._scene.clock.time(self._steps), len(self._order)
        return seconds * n / (n + 2 * int(self.contacts[0]))

    def _floor(self, states: States, dt: Floats) -> float:
        """Return the noise of a step, px, from the precision of the engine's numbers."""
        position, velocity = states.position[1:], states.velocity[1:]
        single = all(np.array_equal(a, a.astype(np.float32)) for a in (position, velocity))
        fractional = bool((position != np.round(position)).any())
        self.precision = SINGLE if single and fractional else DOUBLE
        reach = max(float(np.abs(states.position).max()), *self._scene.arena.size)
        return self.precision * (reach + float(np.abs(velocity).max() * dt.max()))

    def _free(self, before: States, dt: Floats) -> States:
        x, v = flown(before, dt, {}, self._gravity)
        return States(x, v, before.angle.copy(), before.spin.copy())

    def _screen(self, f: Flown) -> tuple[np.ndarray, Integers, Floats]:
        n, elastic = len(self._order), np.zeros(len(f.dt))
        room, space = 256, 1024
        while True:
            found, member = np.zeros(room, FOUND), np.zeros(space, np.int64)
            whole = (np.empty(n, np.int64) for _ in range(3))
            root, members, count = whole
            work = Work(
                self._order, np.empty(n), root, np.empty(n, bool), members, np.empty(n, bool), np.empty(n), count
            )
            elastic[:] = 0
            counted = np.zeros(1, np.int64)
            rows, filled = screen(
                f, self._ball, self._piece, self._law, self._scratch, work, found, member, elastic, counted
            )
            if rows <= room and filled <= space:
                self.contacts += counted
                return found[:rows], member, elastic
            room, space = max(rows, room), max(filled, space)

    def _flights(self, f: Flown, off: Bools, strange: Bools) -> list[StepError]:
        """Return the errors of balls that fly alone: one of each kind in each step."""
        errors = []
        for step in np.flatnonzero(off.any(axis=1)).tolist():
            by_habit = off[step] & ~strange[step]
            if by_habit.any() and self.habit.cause is not None:
                errors.append(self._flight(f, step, np.flatnonzero(by_habit), self.habit.cause, self.habit.because))
            alone = np.flatnonzero(off[step] & strange[step])
            slower = length(f.after.velocity[step, alone] - f.exact.velocity[step, alone])
            spun = np.abs(f.after.spin[step, alone] - f.exact.spin[step, alone])
            changed = slower * f.dt[step] > f.floor
            turned = spun * self._scene.bodies.radius[alone] * f.dt[step] > f.floor
            if (kicked := alone[changed | turned]).size:
                worst = int(kicked[0])
                errors.append(self._flight(f, step, kicked, Cause.UNTOLD, self._kicked(f, step, worst)))
            if (put := alone[~(changed | turned)]).size:
                errors.append(self._flight(f, step, put, Cause.PLACED, self._put(f, step, int(put[0]))))
        return errors

    def _time(self, step: int) -> float:
        return self._scene.clock.time(self._steps + step + 1)

    def _kicked(self, f: Flown, step: int, ball: int) -> str:
        dv = f.after.velocity[step, ball] - f.exact.velocity[step, ball]
        spin = f.after.spin[step, ball] - f.exact.spin[step, ball]
        when = f"in the step to {self._time(step):.3f} s, without a contact"
        if np.hypot(*dv) * f.dt[step] <= f.floor:
            return f"The spin of ball {ball} changed by {spin:.3g} rad/s {when}."
        return f"The velocity of ball {ball} changed by ({dv[0]:.4g}, {dv[1]:.4g}) px/s {when}."

    def _put(self, f: Flown, step: int, ball: int) -> str:
        dx = f.after.position[step, ball] - f.exact.position[step, ball]
        where = f"({dx[0]:.3g}, {dx[1]:.3g}) px from where its flight led to"
        return f"Ball {ball} was put {where} at {self._time(step):.3f} s."

    def _flight(self, f: Flown, step: int, balls: Integers, cause: Cause, because: str) -> StepError:
        return self._error(f, step, balls, None, cause, because, len(balls))

    def _error(
        self,
        f: Flown,
        step: int,
        balls: Integers,
        contact: tuple[int, int] | None,
        cause: Cause,
        because: str,
        times: int = 1,
    ) -> StepError:
        bodies = self._scene.bodies
        shown = [b for b in contact if b >= 0] if contact else [int(balls[0])]
        energies = [self._energy(s, step, balls) for s in (f.after, f.exact)]
        off_v = length(f.after.velocity[step, balls] - f.exact.velocity[step, balls])
        off_x = length(f.after.position[step, balls] - f.exact.position[step, balls])
        return StepError(
            self._steps + step + 1,
            tuple(balls.tolist()),
            contact,
            cause,
            because,
            energies[0] - energies[1],
            float((bodies.mass[balls] * off_v).sum()),
            float(off_x.sum()),
            float(off_v.sum()),
            f.before.velocity[step, shown].copy(),
            f.after.velocity[step, shown].copy(),
            f.exact.velocity[step, shown].copy(),
            (f.before.spin[step, shown].copy(), f.after.spin[step, shown].copy(), f.exact.spin[step, shown].copy()),
            times=times,
        )

    def _energy(self, states: States, step: int, balls: Integers) -> float:
        """Return the energy of some balls, kg px²/s²."""
        b, v, x = self._scene.bodies, states.velocity[step, balls], states.position[step, balls]
        moving = 0.5 * b.mass[balls] * (v**2).sum(axis=1) + 0.5 * b.moment[balls] * states.spin[step, balls] ** 2
        return float((moving - b.mass[balls] * (x @ self._gravity)).sum())

    def _judge_group(self, f: Flown, step: int, balls: Integers, elastic: Floats, *, ended: bool) -> list[StepError]:
        """Return what is wrong with a group's step."""
        if not ended:
            return self._uncomputed(f, step, balls)
        if any(self._gravity) and len(balls) > 1 and self._rests(f, step, balls):
            return self._uncomputed(f, step, balls)
        problem = self._problem(f, step, balls)
        if exact := as_exact(problem):
            self._accept(f, step, balls, elastic, exact, problem)
            return []
        known = [self._trials[name] for name, _ in self._known.most_common(MAX_KNOWN)]
        search = Search(problem, self.habit.fields, rough=self._scene.is_rough)
        fitting = search.known(known)
        if not fitting and len(balls) <= MAX_BALLS and self._fits < MAX_FITS:
            fitting = search.all()
            self._fits += 1
        candidates = [(outcome, self._cause_of(outcome, problem)) for outcome in fitting]
        self._learn(fitting)
        contact = self._contact(problem, candidates)
        if not candidates:
            return self._unexplained(f, step, balls, contact, problem)
        outcome, cause = candidates[0]
        error = self._error(f, step, balls, contact, cause, of_outcome(outcome) or self.habit.because)
        if cause == Cause.MISSED:  # what restitution takes, it takes when the contact happens, if it does
            self._accept(f, step, balls, elastic, outcome, problem)
            error.energy = self._energy(f.after, step, balls) - self._energy(f.exact, step, balls)
        error.candidates, error.numbers = candidates, problem.numbers
        error.depth = float(outcome.met[0]["depth"]) if len(outcome.met) else None
        return [error]

    def _problem(self, f: Flown, step: int, balls: Integers) -> Problem:
        """Return a group's step as a problem."""
        ball = self._ball[balls]
        ball["x"], ball["y"] = f.before.position[step, balls].T
        ball["vx"], ball["vy"] = f.before.velocity[step, balls].T
        ball["spin"] = f.before.spin[step, balls]
        after = np.column_stack(
            [f.after.position[step, balls], f.after.velocity[step, balls], f.after.spin[step, balls]]
        )
        return Problem(Group(ball, self._piece, float(f.dt[step])), after, self._gravity, f.floor)

    def _accept(
        self, f: Flown, step: int, balls: Integers, elastic: Floats, outcome: Outcome, problem: Problem
    ) -> None:
        """Take an outcome for what is right."""
        elastic[step] += outcome.met["elastic"].sum() - problem.exact.met["elastic"].sum()
        for rows, columns in ((f.exact.position, slice(2)), (f.exact.velocity, slice(2, 4)), (f.exact.spin, 4)):
            rows[step, balls] = outcome.after[:, columns]

    def _learn(self, fitting: Sequence[Outcome]) -> None:
        """Remember what explains a step, to be tried first in others."""
        for outcome in fitting:
            if outcome.trial.scope.get("scope") != Scope.ONE:
                key = repr(outcome.trial)
                self._trials.setdefault(key, outcome.trial)
                self._known[key] += 1

    def _rests(self, f: Flown, step: int, balls: Integers) -> bool:
        """Return whether balls that lie on each other stay where they are."""
        moved = np.abs(f.after.position[step, balls] - f.before.position[step, balls]).max()
        return bool(moved + np.abs(f.after.velocity[step, balls]).max() * f.dt[step] <= f.floor)

    def _uncomputed(self, f: Flown, step: int, balls: Integers) -> list[StepError]:
        """Return the error of a group whose exact step is not known; none if it rests, as it did."""
        still = self._rests(f, step, balls)
        source = f.after if still else f.before
        for mine, theirs in zip(f.exact[:2], source[:2], strict=True):
            mine[step, balls] = theirs[step, balls]
        f.exact.spin[step, balls] = source.spin[step, balls]
        if still:
            return []
        because = (
            "A ball leans on others, or goes round an edge: such a step is not computed."
            if len(balls) <= MAX_BALLS
            else f"{len(balls)} balls touch in one step: too many to tell what is wrong."
        )
        return [self._error(f, step, balls, None, Cause.UNKNOWN, because)]

    def _cause_of(self, outcome: Outcome, problem: Problem) -> Cause:
        if outcome.trial.is_in_time and not outcome.trial.fault:
            return self.habit.cause or Cause.UNKNOWN
        return cause_of(outcome, problem)

    def _contact(self, problem: Problem, candidates: Sequence[tuple[Outcome, Cause]]) -> tuple[int, int] | None:
        met = problem.exact.met
        if candidates and len(candidates[0][0].met):
            met = candidates[0][0].met
        return (int(met[0]["first"]), int(met[0]["second"])) if len(met) else None

    def _unexplained(
        self, f: Flown, step: int, balls: Integers, contact: tuple[int, int] | None, problem: Problem
    ) -> list[StepError]:
        """Return the errors of a group that no model explains: of each ball alone, if it can have had no contact."""
        off = (problem.after - problem.exact.after) * problem.scale
        wrong = np.abs(off).max(axis=1) > f.floor
        nearly = NEARLY * float(self._scene.bodies.radius.min())
        touches = self._touches.among(f, step, balls.tolist(), nearly)
        if contact is None and not touches:
            return self._apart(f, step, balls, problem, wrong)
        return [self._error(f, step, balls, contact, Cause.UNKNOWN, "What the step did fits no single error.")]

    def _apart(self, f: Flown, step: int, balls: Integers, problem: Problem, wrong: Bools) -> list[StepError]:
        """Return the errors of balls that are near each other, but touch nothing."""
        off = np.abs((problem.after - problem.exact.after) * problem.scale)
        kicked, errors = off[:, 2:].max(axis=1) > f.floor, []
        if _is_exchange(problem, kicked):
            because = "Velocities changed as in a contact, though nothing touches, and as no single error explains."
            return [self._error(f, step, balls[kicked], None, Cause.UNKNOWN, because)]
        if (changed := balls[kicked]).size:
            errors.append(self._flight(f, step, changed, Cause.UNTOLD, self._kicked(f, step, int(changed[0]))))
        if (put := balls[wrong & ~kicked]).size:
            errors.append(self._flight(f, step, put, Cause.PLACED, self._put(f, step, int(put[0]))))
        return errors

    def _enter(self, states: States, f: Flown, elastic: Floats, errors: Sequence[StepError]) -> None:
        """Enter what is right about a block."""
        scene, bodies = self._scene, self._scene.bodies
        sums = self.rightful[0]
        size, gravity = scene.arena.size, scene.gravity
        start = energy(states.rows(slice(-1)), bodies, gravity, size)
        pushed, exact = (energy(s, bodies, gravity, size) for s in (f.before, f.exact))
        end = energy(f.after, bodies, gravity, size)
        sums[Cause.HAND] += float((pushed - start).sum())
        sums[Cause.ELASTICITY] += float(elastic.sum())
        rest = float((exact - pushed).sum() - elastic.sum())
        sums[Cause.FRICTION if scene.is_rough else Cause.ROUNDING] += rest
        sums[Cause.ROUNDING] += float((end - exact).sum()) - sum(error.energy for error in errors)
        if scene.is_rough:
            turning = spin_energy(states.spin[[0, -1]], bodies.moment)
            sums[Cause.SPIN] += turning[1] - turning[0]


def _is_exchange(problem: Problem, kicked: Bools) -> bool:
    """Return whether balls exchange momentum: those of two or more that changed add up to less than their half."""
    given = problem.group.ball["mass"][:, None] * (problem.after - problem.exact.after)[:, 2:4]
    return bool(kicked.sum() > 1 and length(given.sum(axis=0)) < length(given).sum() / 2)
