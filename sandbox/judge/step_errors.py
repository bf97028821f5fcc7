"""Errors of steps: how far some balls end a step from where they should, and what the contact's balls did."""

from dataclasses import dataclass, field
from typing import Final, NamedTuple

import numpy as np

from sandbox.judge.causes import Cause
from sandbox.judge.fit import Outcome
from sandbox.judge.flight import Habit, flown
from sandbox.judge.free_flight import balls_of
from sandbox.judge.groups import Flown
from sandbox.judge.kicks import of_kick
from sandbox.judge.models import Fields
from sandbox.judge.thresholds import FAR
from sandbox.judge.words import NO_SINGLE_ERROR
from sandbox.quantity import kinetic_energies, length, passing
from sandbox.scene.model import Scene
from sandbox.scene.units import Dimension
from sandbox.scene.walls import wall_distance
from sandbox.state import Bools, Floats, Integers, States

PULLS: Final = ("theta", "left", "slows_first")  # fields of what gravity and damping do to a ball in flight


@dataclass
class StepError:
    """What is wrong with a step of some balls.

    step: of the run, from 1; balls: of the group; contact: first and second, None without one; candidates: the outcomes
    that leave nothing over, with their causes; cause, because: why, by default what the first candidate says; energy
    (kg px²/s²), momentum (kg px/s) and displacement (px): what is over of the exact step; speed: px/s, the sum of the
    velocities' errors; before, after, should: velocities (k, 2) px/s of the contact's balls, and their spins; times:
    how many balls or contacts it stands for; numbers: how many numbers the places, velocities and spins have that it
    shows wrong; depth: px, of the contact when it was found; gained: momentum (kg px/s) and angular momentum about the
    arena's centre (kg px²/s) that neither gravity gave nor a wall can have given; places: (k, 2) px, of the contact's
    balls before; flown: s, from there to where it is found;
    contact_places: (k, 2) px, where that is, if another step has shown it; by_rule: whether a rule of steps explains
    it, which has no parameter; is_measured: whether the exact step is known, so that it is known how much of the energy
    is this error's.
    """

    step: int
    balls: tuple[int, ...]
    contact: tuple[int, int] | None
    cause: Cause
    because: str
    energy: float
    momentum: float
    displacement: float
    speed: float
    before: Floats
    after: Floats
    should: Floats
    spins: tuple[Floats, Floats, Floats]
    places: Floats
    flown: float
    candidates: list[tuple[Outcome, Cause]] = field(default_factory=list)
    times: int = 1
    numbers: int = 9
    by_rule: bool = False
    is_measured: bool = True
    depth: float | None = None
    contact_places: Floats | None = None
    gained: Floats = field(default_factory=lambda: np.zeros(3))


class End(NamedTuple):
    """How some balls end a step: (k, 2) px and px/s, (k,) rad/s."""

    position: Floats
    velocity: Floats
    spin: Floats

    @classmethod
    def of(cls, states: States, step: int | Integers, balls: Integers) -> "End":
        """Return how some balls end steps. step: their row, or that of each."""
        return cls(states.position[step, balls], states.velocity[step, balls], states.spin[step, balls])


class Shown(NamedTuple):
    """What the balls of some contacts did: (contacts, 2, 2) px/s and px, and spins (contacts, 2) rad/s.

    The second of a contact with a wall stands for nothing. places: before.
    """

    before: Floats
    after: Floats
    should: Floats
    spins: tuple[Floats, Floats, Floats]
    places: Floats

    @classmethod
    def of(cls, f: Flown, steps: Integers, contacts: Integers) -> "Shown":
        """Return what the balls of contacts, (contacts, 2), did in their steps."""
        at = steps[:, None], np.maximum(contacts, 0)
        before, after, should = (states.velocity[at] for states in (f.before, f.after, f.exact))
        spins = f.before.spin[at], f.after.spin[at], f.exact.spin[at]
        return cls(before, after, should, spins, f.before.position[at])


class Measure:
    """Measures how far balls end the steps of a run from where they should, and makes errors of that.

    substeps: of a step; steps: substeps that are judged before those of the block.
    """

    def __init__(self, scene: Scene, substeps: int) -> None:
        self._scene, self._bodies, self._substeps = scene, scene.bodies, substeps
        self._gravity = float(scene.gravity[0]), float(scene.gravity[1])
        self._ball = balls_of(scene)
        self.steps = 0
        self._gaining: list[tuple[StepError, Integers]] = []  # errors whose `gained` is to be set, with all their balls

    def whole_step(self, substep: int) -> int:
        """Return the step that contains a substep, both counted from 1."""
        return -(-substep // self._substeps)

    def error(
        self,
        f: Flown,
        step: int,
        balls: Integers,
        contact: tuple[int, int] | None,
        cause: Cause,
        because: str,
        over: Floats | None = None,
        times: int = 1,
        shown: tuple[Shown, int] | None = None,
    ) -> StepError:
        """Return the error of some balls.

        over: as `sums`, by default of all that is over of the exact step; shown: of several contacts, and which of
        them is this.
        """
        if over is None:
            [over] = self.sums(f, End.of(f.after, step, balls), End.of(f.exact, step, balls), balls)
        if shown is None:
            first, second = contact or (int(balls[0]), -1)
            shown = Shown.of(f, np.array([step]), np.array([[first, second]])), 0
        count = 2 if contact and contact[1] >= 0 else 1
        energy, momentum, displacement, speed = over.tolist()
        done, k = shown
        return StepError(
            self.steps + step + 1,
            tuple(balls.tolist()),
            contact,
            cause,
            because,
            energy,
            momentum / count,
            displacement,
            speed,
            done.before[k, :count],
            done.after[k, :count],
            done.should[k, :count],
            (done.spins[0][k, :count], done.spins[1][k, :count], done.spins[2][k, :count]),
            done.places[k, :count],
            float(f.dt[step]),
            times=times,
        )

    def flown_in(self, f: Flown, step: int, fields: Fields) -> States:
        """Return the state after one step of free flight, as the only row. fields: of LAW."""
        row = slice(step, step + 1)
        return flown(self._ball, f.before.rows(row), f.dt[row], self._gravity, fields)

    def by_habit(
        self, f: Flown, step: int, balls: Integers, habit: Habit, ends: tuple[End, End], times: int = 1
    ) -> list[StepError]:
        """Return the errors of balls that fly as the engine does: of each habit within it by itself."""
        end, should = ends
        errors = []
        if habit.within:
            middle = End.of(self.flown_in(f, step, habit.within.fields), 0, balls)
            errors = self.by_habit(f, step, balls, habit.within, (middle, should), times)
            should = middle
        [over] = self.sums(f, end, should, balls)
        error = self.error(f, step, balls, None, habit.cause or Cause.UNKNOWN, habit.because, over, times)
        return [error, *errors]

    def flights(self, f: Flown, off: Bools, strange: Bools, habit: Habit) -> list[StepError]:
        """Return the errors of balls that fly alone: one of each kind in each step. habit: how the engine flies."""
        errors = []
        for step in np.flatnonzero(off.any(axis=1)).tolist():
            by_habit = off[step] & ~strange[step]
            if by_habit.any():
                balls = np.flatnonzero(by_habit)
                ends = End.of(f.after, step, balls), End.of(f.exact, step, balls)
                errors += self.by_habit(f, step, balls, habit, ends, times=len(balls))
            alone = np.flatnonzero(off[step] & strange[step])
            slower = length(f.after.velocity[step, alone] - f.exact.velocity[step, alone])
            spun = np.abs(f.after.spin[step, alone] - f.exact.spin[step, alone]) * self._bodies.radius[alone]
            kicked = (np.maximum(slower, spun) * f.dt[step] > f.floor) & ~self.far_off(f, step, alone)
            errors += self.alone(f, step, alone, kicked, habit)
        return errors

    def alone(self, f: Flown, step: int, balls: Integers, kicked: Bools, habit: Habit) -> list[StepError]:
        """Return the errors of balls that touch nothing. kicked: (k,), whether they are so by velocity or spin."""
        beside, errors = kicked & self._beside(f, step, balls, habit), list[StepError]()
        if (met := balls[beside]).size:
            errors.append(self._of_flights(f, step, met, Cause.UNKNOWN, NO_SINGLE_ERROR))
        if (changed := balls[kicked & ~beside]).size:
            errors.append(self._of_flights(f, step, changed, Cause.UNREPORTED, self._kicked(f, step, int(changed[0]))))
        if (put := balls[~kicked]).size:
            errors.append(self._of_flights(f, step, put, Cause.TELEPORTED, self._put(f, step, int(put[0]))))
        return errors

    def far_off(self, f: Flown, step: int, balls: Integers) -> Bools:
        """Return which of some balls are further off than any contact can put them: (k,).

        That is twice the way of a step and the sum of the two radii, in which the two pass through each other.
        """
        off = length(f.after.position[step, balls] - f.exact.position[step, balls])
        speeds = (length(states.velocity[step, balls]) for states in (f.before, f.after))
        reach = self._bodies.radius[balls] + self._bodies.radius.max()
        far: Bools = off > 2 * (reach + f.dt[step] * np.maximum(*speeds))
        return far

    def _of_flights(self, f: Flown, step: int, balls: Integers, cause: Cause, because: str) -> StepError:
        return self.error(f, step, balls, None, cause, because, times=len(balls))

    def _beside(self, f: Flown, step: int, balls: Integers, habit: Habit) -> Bools:
        """Return which of some balls may have met another that is elsewhere than its flight leads: (k,)."""
        radius, flight = self._bodies.radius, self.flown_in(f, step, habit.fields)
        x = f.after.position[step]
        off = length(x - flight.position[0]) + f.dt[step] * length(f.after.velocity[step] - flight.velocity[0])
        others = np.flatnonzero(off > f.floor)
        apart = length(x[others] - x[balls][:, None]) - radius[others] - radius[balls][:, None]
        enough = off[others] + off[balls][:, None] + FAR * radius[balls][:, None]
        meet = (others != balls[:, None]) & ~passing(self._bodies.filters, balls[:, None], others[None])
        beside: Bools = ((apart <= enough) & meet).any(axis=1)
        return beside

    def _kicked(self, f: Flown, step: int, ball: int) -> str:
        dv = f.after.velocity[step, ball] - f.exact.velocity[step, ball]
        spin = f.after.spin[step, ball] - f.exact.spin[step, ball]
        when = f"in the step to {self._time(step):.3f} s"
        if np.hypot(*dv) * f.dt[step] <= f.floor:
            return f"The spin of ball {ball} changed by {spin:.3g} rad/s {when}, without a contact."
        should, after = (states.velocity[step, ball] for states in (f.exact, f.after))
        return of_kick(self._scene.units, ball, should, after, when)

    def _put(self, f: Flown, step: int, ball: int) -> str:
        dx = f.after.position[step, ball] - self.flown_in(f, step, {}).position[0, ball]
        way = self._scene.units.text(Dimension.LENGTH, "({:.3g}, {:.3g})", *dx)
        return f"Ball {ball} was put {way} from where its flight led to in the step to {self._time(step):.3f} s."

    def _time(self, step: int) -> float:
        return self._scene.clock.time(self.whole_step(self.steps + step + 1))

    def sums(self, f: Flown, end: End, should: End, balls: Integers, begins: Integers | None = None) -> Floats:
        """Return what is over of how some balls should have ended a step, of each part of them: (parts, 4).

        Its energy (kg px²/s²), momentum (kg px/s), displacement (px) and speed (px/s). begins: of the parts in balls,
        by default of one.
        """
        off_v, off_x = length(end.velocity - should.velocity), length(end.position - should.position)
        energy = self._energies(end, balls) - self._energies(should, balls)
        of_ball = np.stack([energy, self._bodies.mass[balls] * off_v, off_x, off_v], axis=1)
        sums: Floats = np.add.reduceat(of_ball, np.zeros(1, np.int64) if begins is None else begins)
        return sums

    def gain(self, end: End, start: End, balls: Integers) -> float:
        """Return by how much the energy of some balls is larger than at another end, kg px²/s²."""
        return float(self._energies(end, balls).sum()) - float(self._energies(start, balls).sum())

    def _energies(self, end: End, balls: Integers) -> Floats:
        """Return the energy of each of some balls, kg px²/s²: (k,)."""
        mass, moment = self._bodies.mass[balls], self._bodies.moment[balls]
        return kinetic_energies(end.velocity, end.spin, mass, moment) - mass * (end.position @ self._gravity)

    def note_gain(self, error: StepError, balls: Integers) -> None:
        """Have what an error's balls gained set at the end of the block. balls: all of its group."""
        self._gaining.append((error, balls))

    def set_gained(self, f: Flown, habit: Habit) -> None:
        """Set what the balls of errors gained, see `StepError`; zeros if a wall is near enough to have given it."""
        if not self._gaining:
            return
        errors, parts = zip(*self._gaining, strict=True)
        self._gaining = []
        counts, balls = [len(part) for part in parts], np.concatenate(parts)
        begins, rows = np.cumsum([0, *counts[:-1]]), np.repeat([e.step - self.steps - 1 for e in errors], counts)
        mass, moment, radius = (
            values[balls] for values in (self._bodies.mass, self._bodies.moment, self._bodies.radius)
        )
        dt, centre = f.dt[rows], np.divide(self._scene.arena.size, 2)
        x, v, y, w = (a[rows, balls] for states in (f.before, f.after) for a in (states.position, states.velocity))
        way = dt * (np.maximum(length(v), length(w)) + dt * float(np.hypot(*self._gravity))) + length(y - x)
        by_wall = np.logical_or.reduceat(wall_distance(self._scene, x) <= radius + way, begins)
        before = States(*(a[rows, balls][:, None] for a in f.before))
        pulled = {name: habit.fields[name] for name in PULLS if name in habit.fields}
        given = flown(self._ball[:1], before, dt, self._gravity, pulled)  # whose size does not matter
        at, fallen = given.position[:, 0] - centre, given.velocity[:, 0]
        turned = mass * (_cross(y - centre, w) - _cross(at, fallen))
        spun = moment * (f.after.spin[rows, balls] - given.spin[:, 0])
        gained = np.add.reduceat(np.column_stack([mass[:, None] * (w - fallen), turned + spun]), begins)
        gained[by_wall] = 0.0
        for error, of_error in zip(errors, gained, strict=True):
            error.gained = of_error


def _cross(a: Floats, b: Floats) -> Floats:
    """Return the cross product of vectors, (k, 2) each: (k,)."""
    product: Floats = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return product
