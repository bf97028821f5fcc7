"""What single contacts show: six numbers each, read off the states before and after the step in which it is alone.

A ball's own flight would end the step at hx with hv. With dv and dx its deviations from that, an impulse at the time t
leaves dx = (dt - t) dv: the time is read off the places, and the impulse, -m dv, off the velocities. With n the normal
and i n the tangent, what two balls did is six numbers: the impulse along n and the friction along the tangent that each
of the two got, and the friction that each one's spin shows, which is m r/2 for each rad/s of a disc.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import Final

import numpy as np

from sandbox.judge.flight import Habit, by_gravity
from sandbox.judge.run import NEVER, Contacts, Run, Vectors, cross, dot
from sandbox.state import Bools, Floats

Six = tuple[Floats, Floats, Floats, Floats, Floats, Floats]  # kg px/s: impulses, frictions, frictions by the spins
IN_STEP: Final = 1e-6  # of a step, by which a time that is read may lie outside


class When(StrEnum):
    """When a contact is resolved, and so where the two bodies are then."""

    TOUCH = "touch"  # in time
    END = "end"  # after the flight of the step
    END_PUSHED = "end, pushed"  # after it, where an overlap of before is pushed apart
    START = "start"  # before the flight
    FIRST_MOVED = "first moved"  # balls move one by one, and the second has not yet
    SECOND_MOVED = "second moved"
    START_LATER = "start, later"  # with the normal of the step's start, at the time that places show
    SHOWN = "shown"  # at the time that places show
    TURNED = "turned"  # at the time whose normal the velocities show


FITTED: Final = {When.SHOWN: 1.0, When.TURNED: 1.0, When.START_LATER: 1.5}  # numbers that a time takes from the contact
AT_END: Final = (When.END, When.FIRST_MOVED, When.SECOND_MOVED)


@dataclass
class Met:
    """Where contacts are resolved, (k,) each: n, normals; t, s from the step's start; depth, px.

    vi, vj: px/s just before; slack: px/s, by which a fitted time leaves velocities unsure, negative if there is none.
    """

    when: When
    n: Vectors
    t: Floats
    depth: Floats
    vi: Vectors
    vj: Vectors
    slack: Floats

    @property
    def closing(self) -> Floats:
        """How fast the two approach, px/s."""
        return dot(self.vi - self.vj, self.n)

    @property
    def is_valid(self) -> Bools:
        """Which contacts have such a time."""
        valid: Bools = self.slack >= 0
        return valid


class Singles:
    """Contacts that are alone in their steps, as columns (k,); of a wall, the second body has no mass and no motion.

    touch: s from the step's start, when they are due, or NEVER; undo: what an engine multiplies velocities by after
    contacts, which is undone. x, v, w: before the step; dv, dx: deviations from the engine's own flight; turned: rad/s,
    by which spins change; h, hv: where that flight ends; red: kg, the reduced mass; e, mu: of the contact.
    """

    def __init__(self, run: Run, habit: Habit, at: Contacts, touch: Floats, undo: complex = 1.0) -> None:
        self.run, self.habit, self.at, self.touch, self.undo = run, habit, at, touch, undo
        k, i, other, self.pair = at.k, at.i, at.other, at.pair
        self.dt = run.flown[k]
        zero = np.zeros(len(k))
        wall = np.where(self.pair, 0, ~at.j)
        self.ri, self.rj = run.r[i], np.where(self.pair, run.r[other], zero)
        self.mi, self.mj = run.m[i], np.where(self.pair, run.m[other], np.inf)
        self.red = 1 / (1 / self.mi + 1 / self.mj)
        self.ei, self.ej = run.e[i], np.where(self.pair, run.e[other], run.wall_e[wall])
        self.fi, self.fj = run.mu[i], np.where(self.pair, run.mu[other], run.wall_mu[wall])
        self.e, self.mu = self.ei * self.ej, self.fi * self.fj
        (self.xi, self.vi, self.hi, self.hvi, self.dxi, self.dvi) = self._motion(at.i)
        (self.xj, self.vj, self.hj, self.hvj, self.dxj, self.dvj) = (
            np.where(self.pair, part, zero) for part in self._motion(other)
        )
        before, after = (run.kept, 1.0) if undo == 1 else (1.0, run.kept)  # when spins are slowed down, if they are
        self.wi, self.wj = run.w[k, i] * before, np.where(self.pair, run.w[k, other] * before, zero)
        self.turned_i = run.w[k + 1, i] / after - self.wi
        self.turned_j = np.where(self.pair, run.w[k + 1, other] / after - self.wj, zero)
        self.depth_before = run.geometry(i, at.j, self.xi, self.xj)[1]
        size = np.maximum(np.abs(self.dvi), np.abs(self.dvj))
        self.tol = 3 * run.floor / self.dt + 2e-6 * size  # px/s: rounding, and that of a near graze
        self.tol_x = 3 * run.floor + 2e-6 * (size * self.dt + np.abs(self.dxi) + np.abs(self.dxj))

    def _motion(self, ball: np.ndarray) -> tuple[Vectors, ...]:
        """Return of balls x, v, where the own flight ends, with what velocity, and the deviations from both."""
        run, k = self.run, self.at.k
        f = run.flights(k, ball)
        after, h, hv = run.v[k + 1, ball], run.hx[k, ball], run.hv[k, ball]
        if self.undo != 1:
            after, hv = after / self.undo, by_gravity(f)
            h = self.habit.place.place(f, hv)
        return f.x, f.v, h, hv, run.x[k + 1, ball] - h, after - hv

    def part(self, rows: np.ndarray) -> "Singles":
        """Return some of the contacts."""
        return Singles(self.run, self.habit, self.at.part(rows), self.touch[rows], self.undo)

    def met(self, when: When) -> Met:
        """Return where contacts are if they are resolved at one of the times that no number is fitted for."""
        zero, pull = np.zeros(len(self.dt)), self.run.pull
        match when:
            case When.TOUCH:
                return self._flown(when, self.touch)
            case When.END:
                return self._at(when, self.dt, self.hi, self.hj, self.hvi, self.hvj)
            case When.END_PUSHED:
                run, (k, i, _), other = self.run, self.at, self.at.other
                return self._at(when, self.dt, run.x[k + 1, i], run.x[k + 1, other], self.hvi, self.hvj)
            case When.FIRST_MOVED:
                return self._at(when, self.dt, self.hi, self.xj, self.hvi, self.vj + pull * self.dt)
            case When.SECOND_MOVED:
                return self._at(when, self.dt, self.xi, self.hj, self.vi + pull * self.dt, self.hvj)
        return self._at(When.START, zero, self.xi, self.xj, self.vi, self.vj)

    def all_met(self) -> Iterator[Met]:
        """Yield where contacts may be resolved: where rules do, and then where the motion shows it."""
        for when in (When.TOUCH, When.END, When.END_PUSHED, When.START, When.FIRST_MOVED, When.SECOND_MOVED):
            yield self.met(when)
        u, floor, dt = self.vi - self.vj, self.run.floor, self.dt
        with np.errstate(all="ignore"):
            weight = np.abs(self.dvi) ** 2 + np.abs(self.dvj) ** 2
            ago = (dot(self.dxi, self.dvi) + dot(self.dxj, self.dvj)) / weight
            bend = np.abs(u) ** 2 / (self.ri + self.rj) + abs(self.run.pull)  # px/s², of the normal and the flight
            unsure = 4 * bend * floor / np.sqrt(weight)
            shown = np.where((ago > -IN_STEP * dt) & (ago < dt * (1 + IN_STEP)), dt - ago, np.nan)
            n = self.seen_normal
            turn = np.where(self.pair, cross(self.xj - self.xi, n) / cross(u, n), np.nan)
            turn = np.where((turn > -IN_STEP * dt) & (turn < dt * (1 + IN_STEP)), turn, np.nan)
        later = self._at(When.START_LATER, shown, self.xi, self.xj, self.vi, self.vj)
        later.slack = np.where(np.isfinite(shown) & self.pair, unsure, -1.0)
        yield later
        yield self._flown(When.SHOWN, shown, unsure)
        yield self._flown(When.TURNED, turn, 10 * unsure)

    @cached_property
    def seen_normal(self) -> Vectors:
        """The normal along which the first got its impulse, if its spin shows the friction."""
        rim = -self.turned_i * self.mi * self.ri / 2
        given = -self.mi * self.dvi
        with np.errstate(all="ignore"):
            n = given / (np.sqrt(np.maximum(np.abs(given) ** 2 - rim**2, 0)) + 1j * rim)
            return np.where(np.isfinite(n), n / np.abs(n), 1.0)

    def _at(self, when: When, t: Floats, xi: Vectors, xj: Vectors, vi: Vectors, vj: Vectors) -> Met:
        n, depth = self.run.geometry(self.at.i, self.at.j, xi, xj)
        return Met(when, n, t, depth, vi, np.where(self.pair, vj, 0.0), np.zeros(len(t)))

    def _flown(self, when: When, t: Floats, slack: Floats | float = 0.0) -> Met:
        """Return where the balls are after a time of their own flight, which begins with the velocity `Run.u`."""
        run, (k, i, _), other = self.run, self.at, self.at.other
        there = np.isfinite(t)
        s = np.where(there, t, 0.0)
        xi, xj = (run.x[k, b] + s * (run.u[k, b] + s * run.pull / 2) for b in (i, other))
        met = self._at(when, np.where(there, t, np.nan), xi, xj, self.vi + s * run.pull, self.vj + s * run.pull)
        met.slack = np.where(there, slack, -1.0)
        return met

    def seen(self, n: Vectors) -> Six:
        """Return the six numbers along normals. Of a wall, the second's are the first's."""
        t, mj = 1j * n, np.where(self.pair, self.mj, 0.0)
        ji, fi = -self.mi * dot(self.dvi, n), -self.mi * dot(self.dvi, t)
        jj, fj = mj * dot(self.dvj, n), mj * dot(self.dvj, t)
        si, sj = -self.turned_i * self.mi * self.ri / 2, -self.turned_j * mj * self.rj / 2
        return ji, np.where(self.pair, jj, ji), fi, np.where(self.pair, fj, fi), si, np.where(self.pair, sj, si)

    def miss(self, seen: Six, law: Six) -> Floats:
        """Return by how many px/s the six numbers differ from a law's, at most."""
        mj = np.where(self.pair, self.mj, self.mi)
        per = (1 / self.mi, 1 / mj, 1 / self.mi, 1 / mj, 2 / self.mi, 2 / mj)
        with np.errstate(all="ignore"):
            off: Floats = np.max([np.abs(a - b) * s for a, b, s in zip(seen, law, per, strict=True)], axis=0)
        return np.where(np.isfinite(off), off, np.inf)

    def slip(self, met: Met) -> Floats:
        """Return how fast the first's rim moves past the second's, px/s."""
        slip: Floats = dot(met.vi - met.vj, 1j * met.n) + self.ri * self.wi + self.rj * self.wj
        return slip

    def friction(
        self, met: Met, impulse: Floats, mu: Floats | float | None = None, third: Floats | float = 3.0
    ) -> Floats:
        """Return Coulomb's friction with an impulse: what stops the slip of two discs, at most mu times the impulse.

        third: 1 + m r²/I of a disc, by which the slip of two rims falls faster than their centres' does.
        """
        most = (self.mu if mu is None else mu) * np.abs(impulse)
        rub: Floats = np.clip(self.red * self.slip(met) / third, -most, most)
        return rub

    def right(self, met: Met) -> tuple[Floats, Floats]:
        """Return the right impulse, (1 + e) m u_n with the reduced mass m, and friction."""
        impulse = (1 + self.e) * self.red * met.closing
        return impulse, self.friction(met, impulse)

    def near_end(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Return of the exact contact the impulse, friction, and the energy that restitution and friction take.

        Of contacts that are not due in the step, these are 0, but restitution takes what it takes where they are found.
        """
        met, end, has = self.met(When.TOUCH), self.met(When.END), self.touch < NEVER
        impulse, rub = (np.where(has, part, 0.0) for part in self.right(met))
        found = np.where(end.depth > 0, np.maximum(end.closing, 0), 0.0)
        u = np.where(has, met.closing, found)
        heat = (1 - self.e**2) * self.red * u**2 / 2
        rubbed = np.where(has, np.abs(rub * self.slip(met)) - 1.5 * rub**2 / self.red, 0.0)
        return impulse, rub, heat, rubbed
