"""The judge of one engine's run: each step, from the engine's own state before it, against the exact step.

Balls that do not fly as they should, and groups that do not do what the exact step does, become `StepError`s, each with
the models that leave nothing over. The ledger of a step is the exact step's own change, and the rest under its cause.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from sandbox.engines.walls import ARENA_COUNT, pieces_of
from sandbox.judge.causes import Cause
from sandbox.judge.fit import Outcome, Problem, Trial, cause_of, explain
from sandbox.judge.flight import Habit, find_habit, flown, misses
from sandbox.judge.groups import FOUND, MAX_COMPUTED, Flown, Work, balls_of, scratch_for, screen
from sandbox.judge.law import LAW, law
from sandbox.judge.one_step import Group
from sandbox.judge.thresholds import DOUBLE, LATE_STEPS, MAX_BALLS, MAX_FITS, SINGLE
from sandbox.judge.words import of_outcome
from sandbox.quantity import energy, length, nearest_on_segment, spin_energy
from sandbox.scene.model import Scene
from sandbox.state import Floats, Integers, Pushes, States

MAX_KNOWN: Final = 40  # trials that are tried first


@dataclass
class StepError:
    """What is wrong with a step of some balls.

    step: of the run, from 1; balls: of the group; contact: first and second, None without one; candidates: the outcomes
    that leave nothing over, with their causes; cause, because: why; energy (kg px²/s²), momentum (kg px/s) and
    displacement (px): what is over of the exact step; before, after, should: velocities (k, 2) px/s of the contact's
    balls; times: how many balls or contacts it stands for; numbers: how many places, velocities and spins it shows wrong; depth: px,
    of the contact when it was found.
    """

    step: int
    balls: tuple[int, ...]
    contact: tuple[int, int] | None
    cause: Cause
    because: str
    energy: float
    momentum: float
    displacement: float
    before: Floats
    after: Floats
    should: Floats
    spins: tuple[Floats, Floats, Floats]
    candidates: list[tuple[Outcome, Cause]] = field(default_factory=list)
    times: int = 1
    numbers: int = 9
    depth: float | None = None


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
        self._pending: list[StepError] = []
        self.habit: Habit | None = None
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
        if self.habit is None:
            self.habit = find_habit(before, after, dt, self._gravity, floor)
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
        errors: list[StepError] = []
        for row in groups:
            balls = member[row["begin"] : row["begin"] + row["count"]]
            grouped[row["step"], balls] = True
            errors += self._judge_group(f, int(row["step"]), balls, bool(row["ended"]), int(row["contacts"]))
        spun = np.abs(after.spin - exact.spin) * self._scene.bodies.radius * dt[:, None]
        off = np.maximum(misses(before, after, dt, (exact.position, exact.velocity)), spun) > floor
        errors += self._flights(f, off & ~grouped, strange)
        errors.sort(key=lambda e: e.step)
        self._settle(f, errors)
        self.errors += errors
        self._enter(states, f, elastic, errors)
        self._steps += len(dt)

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
            work = Work(self._order, np.empty(n), np.empty(n, np.int64), np.empty(n, bool), np.empty(n, np.int64))
            elastic[:] = 0
            rows, filled = screen(f, self._ball, self._piece, self._law, self._scratch, work, found, member, elastic)
            if rows <= room and filled <= space:
                return found[:rows], member, elastic
            room, space = max(rows, room), max(filled, space)

    def _flights(self, f: Flown, off: Floats, strange: Floats) -> list[StepError]:
        """Return the errors of balls that fly alone: one of each kind in each step."""
        assert self.habit is not None
        errors = []
        for step in np.flatnonzero(off.any(axis=1)).tolist():
            by_habit = off[step] & ~strange[step]
            if by_habit.any():
                assert self.habit.cause is not None
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
        return f"Ball {ball} was put ({dx[0]:.3g}, {dx[1]:.3g}) px from where its flight led to at {self._time(step):.3f} s."

    def _flight(self, f: Flown, step: int, balls: Integers, cause: Cause, because: str) -> StepError:
        return self._error(f, step, balls, None, cause, because, len(balls))

    def _error(
        self, f: Flown, step: int, balls: Integers, contact: tuple[int, int] | None, cause: Cause, because: str, times: int = 1
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

    def _judge_group(self, f: Flown, step: int, balls: Integers, ended: bool, contacts: int) -> list[StepError]:
        """Return what is wrong with a group's step."""
        if not ended or len(balls) > MAX_BALLS:
            if not ended:
                for mine, theirs in ((f.exact.position, f.before.position), (f.exact.velocity, f.before.velocity)):
                    mine[step, balls] = theirs[step, balls]
                f.exact.spin[step, balls] = f.before.spin[step, balls]
            because = f"{len(balls)} balls touch in one step: too many to tell what is wrong."
            return [self._error(f, step, balls, None, Cause.UNKNOWN, because)]
        group_ball = self._ball[balls]
        for a, i in enumerate(balls.tolist()):
            group_ball[a]["x"], group_ball[a]["y"] = f.before.position[step, i]
            group_ball[a]["vx"], group_ball[a]["vy"] = f.before.velocity[step, i]
            group_ball[a]["spin"] = f.before.spin[step, i]
        after = np.column_stack([f.after.position[step, balls], f.after.velocity[step, balls], f.after.spin[step, balls]])
        problem = Problem(Group(group_ball, self._piece, float(f.dt[step])), after, self._gravity, f.floor)
        known = [self._trials[name] for name, _ in self._known.most_common(MAX_KNOWN)]
        assert self.habit is not None
        full = self._fits < MAX_FITS
        fitting = explain(problem, self.habit.fields, known, rough=self._scene.is_rough, full=full)
        candidates = [(outcome, self._cause_of(outcome, problem)) for outcome in fitting]
        for outcome, _ in candidates:
            if outcome.trial.scope.get("scope") != 3:
                key = repr(outcome.trial)
                self._trials.setdefault(key, outcome.trial)
                self._known[key] += 1
        contact = self._contact(problem, candidates)
        if candidates:
            outcome, cause = candidates[0]
            because = of_outcome(outcome) or self.habit.because
            error = self._error(f, step, balls, contact, cause, because)
            error.candidates, error.numbers = candidates, problem.numbers
            error.depth = float(outcome.met[0]["depth"]) if len(outcome.met) else None
            return [error]
        self._fits += full
        return self._unexplained(f, step, balls, contact, problem)

    def _cause_of(self, outcome: Outcome, problem: Problem) -> Cause:
        assert self.habit is not None
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
        if contact is None:
            kicked = np.abs(off[:, 2:]).max(axis=1) > f.floor
            errors = []
            if kicked.any() and (kicked.sum() == 1):
                ball = balls[kicked]
                errors.append(self._flight(f, step, ball, Cause.UNTOLD, self._kicked(f, step, int(ball[0]))))
            elif kicked.any():
                errors.append(self._error(f, step, balls[kicked], None, Cause.UNKNOWN, "Velocities changed as no single error does."))
            if (put := balls[wrong & ~kicked]).size:
                errors.append(self._flight(f, step, put, Cause.PLACED, self._put(f, step, int(put[0]))))
            return errors
        return [self._error(f, step, balls, contact, Cause.UNKNOWN, "What the step did fits no single error.")]

    def _settle(self, f: Flown, errors: list[StepError]) -> None:
        """Turn contacts missed into late ones, where they follow within some steps."""
        by_step: dict[int, list[StepError]] = {}
        for error in errors:
            if error.cause == Cause.MISSED:
                by_step.setdefault(error.step, []).append(error)
        for row in range(len(f.dt)):
            step = self._steps + row + 1
            kept = []
            for error in self._pending:
                assert error.contact is not None
                if self._is_resolved(f, row, *error.contact):
                    error.cause = Cause.LATE
                    error.because = f"Found {step - error.step} step{'s' * (step - error.step > 1)} late."
                elif step - error.step < LATE_STEPS:
                    kept.append(error)
            self._pending = kept + by_step.get(step, [])

    def _is_resolved(self, f: Flown, row: int, first: int, second: int) -> bool:
        """Return whether two bodies that overlap before a step are pushed apart in it, and by nothing else."""
        x, mass = f.before.position[row], self._scene.bodies.mass
        free = f.before.velocity[row] + f.dt[row] * np.array(self._gravity)
        change = f.after.velocity[row] - free
        radius = self._scene.bodies.radius
        if second >= 0:
            away, reach = x[second] - x[first], float(radius[[first, second]].sum())
            given = mass[[first, second], None] * change[[first, second]]
            lost, relative = length(given.sum(axis=0)), change[first] - change[second]
            if lost > length(given).sum() / 2:
                return False
        else:
            start, to, thickness = self._scene.wall_line(~second)
            away = nearest_on_segment(x[first], np.array(start), np.array(to)) - x[first]
            reach = float(radius[first]) + (thickness / 2 if ~second >= ARENA_COUNT else 0.0)
            relative = change[first]
        distance = float(length(away))
        if distance == 0 or reach - distance <= -f.floor:
            return False
        pushed = -float(relative @ away) / distance
        return pushed > f.floor / float(f.dt[row]) and 2 * pushed * pushed > float(relative @ relative)

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
