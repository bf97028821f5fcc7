"""What single contacts show: six numbers each, read off the states before and after the step in which it is alone.

A ball's own flight would end the step at h with the velocity hv. With dv and dx its deviations from that, an impulse at
the time t leaves dx = (dt - t) dv: the time is read off the places, and the impulse, -m dv, off the velocities. With n
the normal and i n the tangent, each contact is six numbers, three of each body: its impulse along n, the friction along
the tangent that changes its velocity, and the friction that its spin shows, which is m r/2 for each rad/s of a disc.
"""

from collections.abc import Iterator
from enum import StrEnum
from typing import Final, Self

import numpy as np

from sandbox.judge.run import Contacts, Run, Vectors, cross, dot
from sandbox.state import Bools, Floats, Integers

Six = Floats  # (3, 2, k) kg px/s: impulses, frictions, frictions by the spins; each of the first and the second body
IN_STEP: Final = 1e-6  # of a step, by which a time that is read may lie outside
SIGN: Final = np.array([[-1.0], [1.0]])  # of what an impulse changes, of both bodies


class When(StrEnum):
    """When a contact is resolved, and so where the two bodies are then."""

    TOUCH = "touch"  # in time
    END = "end"  # after the flight of the step
    START = "start"  # before the flight
    SHOWN = "shown"  # at the time that places show
    TURNED = "turned"  # at the time whose normal the velocities show


FITTED: Final = {When.SHOWN: 1.0, When.TURNED: 1.0}  # numbers that a time takes from the contact


class Bodies:
    """Both bodies of contacts, (2, k) each: r px, inverse masses 1/kg, factors es of elasticity and mus of friction.

    m: kg, of a wall that of the ball; pair: (k,), which are of two balls; red: kg, the reduced mass; e, mu: of the
    contact.
    """

    def __init__(self, run: Run, i: Integers, j: Integers) -> None:
        self.pair = j >= 0
        both, wall = np.stack([i, np.where(self.pair, j, i)]), np.where(self.pair, 0, ~j)
        self.r, self.m, self.es, self.mus = run.r[both], run.m[both], run.e[both], run.mu[both]
        self.inverse = 1 / self.m
        for of, of_wall in ((self.inverse, 0.0), (self.es, run.wall_e[wall]), (self.mus, run.wall_mu[wall])):
            of[1] = np.where(self.pair, of[1], of_wall)
        self.red = 1 / self.inverse.sum(axis=0)
        self.e, self.mu = self.es.prod(axis=0), self.mus.prod(axis=0)

    def part(self, rows: Integers | Bools) -> Self:
        """Return some of them."""
        some = object.__new__(type(self))
        for name, values in vars(self).items():
            is_column = isinstance(values, np.ndarray)
            part = values[..., rows] if is_column else values.part(rows) if isinstance(values, Contacts) else values
            setattr(some, name, part)
        return some


class Met:
    """Contacts where they are resolved, and what is due then: (k,) each, of both bodies (2, k).

    t: s from the step's start; n: normals; depth: px; v, w: px/s and rad/s, just before; started: px/s, how fast they
    approached along the normal when the step began; slack: px/s, the error of velocities that a fitted time causes,
    negative if there is no such time; six: what the states show; u: px/s, how fast the two approach; due, rub: kg px/s,
    the right impulse, (1 + e) m u with the reduced mass m, and friction; pull: px/s², how balls fall.
    """

    def __init__(
        self, b: Bodies, when: When, t: Floats, n: Vectors, depth: Floats, v: Vectors, w: Floats, started: Vectors,
        pull: complex, slack: Floats | float = 0.0, six: Six | None = None,
    ) -> None:  # fmt: skip
        self.b, self.when, self.t, self.n, self.depth, self.v, self.w = b, when, t, n, depth, v, w
        self.pull, self.started, self.slack = pull, dot(started, n), slack + np.zeros(len(t))
        self.six: Six = np.full((3, 2, len(t)), np.nan) if six is None else six
        self.u = dot(v[0] - v[1], n)
        self.pair, self.closes, self.is_valid = b.pair, self.u > 0, self.slack >= 0
        self.due = (1 + b.e) * b.red * self.u
        self.rub = self.friction(self.due)

    @property
    def slip(self) -> Floats:
        """How fast the first's rim moves past the second's, px/s."""
        slip: Floats = dot(self.v[0] - self.v[1], 1j * self.n) + (self.b.r * self.w).sum(axis=0)
        return slip

    def friction(self, impulse: Floats, mu: Floats | None = None) -> Floats:
        """Return Coulomb's friction with an impulse: what stops the slip of two discs, at most mu times the impulse.

        The slip of two rims falls 1 + m r²/I = 3 times as fast as that of their centres.
        """
        most = (self.b.mu if mu is None else mu) * np.abs(impulse)
        rub: Floats = np.clip(self.b.red * self.slip / 3, -most, most)
        return rub

    def after(self, six: Six) -> tuple[Vectors, Floats]:
        """Return the velocities and spins after the contact, (2, k), px/s and rad/s."""
        impulse, friction, spun = six
        change = self.b.inverse * (impulse * self.n + friction * 1j * self.n)
        return self.v + SIGN * change, self.w - 2 * self.b.inverse * spun / self.b.r


class Singles(Bodies):
    """Contacts that are alone in their steps; of a wall, the second body has no motion.

    touch: s from the step's start, when they are due, or NEVER. x, v, w: before the step; dv, dx: deviations from the
    engine's own flight; turned: rad/s, by which spins change; h, hv: where that flight ends. These are (2, k) each.
    """

    def __init__(self, run: Run, at: Contacts, touch: Floats) -> None:
        super().__init__(run, at.i, at.j)
        self.run, self.at, self.touch = run, at, touch
        k, ball = at.k, np.stack([at.i, at.other])
        self.dt = run.flown[k]
        self.x, self.v, self.h, self.hv = run.x[k, ball], run.v0[k, ball], run.hx[k, ball], run.hv[k, ball]
        self.dx, self.dv = run.x[k + 1, ball] - self.h, run.v[k + 1, ball] - self.hv
        self.w = run.w[k, ball] * run.kept
        self.turned = run.w[k + 1, ball] - self.w
        for part in (self.x, self.v, self.h, self.hv, self.dx, self.dv, self.w, self.turned):
            part[1] = np.where(self.pair, part[1], 0.0)
        size = np.abs(self.dv).max(axis=0)
        self.per_number = np.reshape([1, 1, 2], (3, 1, 1)) / self.m  # px/s for each kg px/s of the six numbers
        self.tol = 3 * run.floor / self.dt + 2e-6 * size  # px/s: rounding, and that of a near graze
        self.tol_x = 3 * run.floor + 2e-6 * (size * self.dt + np.abs(self.dx).sum(axis=0))

    def met(self, when: When) -> Met:
        """Return where contacts are if they are resolved at one of the times that no number is fitted for."""
        if when == When.TOUCH:
            return self._flown(when, self.touch)
        is_end = when == When.END
        return self._at(when, is_end * self.dt, *((self.h, self.hv) if is_end else (self.x, self.v)))

    def all_met(self) -> Iterator[Met]:
        """Yield where contacts may be resolved: where rules do, and then where the motion shows it."""
        for when in (When.TOUCH, When.END, When.START):
            yield self.met(when)
        u, dt = self.v[0] - self.v[1], self.dt
        with np.errstate(all="ignore"):
            weight = (np.abs(self.dv) ** 2).sum(axis=0)
            ago = dot(self.dx, self.dv).sum(axis=0) / weight
            bend = np.abs(u) ** 2 / (self.r[0] + self.pair * self.r[1]) + abs(self.run.pull)  # px/s², of both ways
            unsure = 4 * bend * self.run.floor / np.sqrt(weight)
            n = np.exp(1j * turn_of(self.seen(np.ones(len(dt), complex))))
            turn = np.where(self.pair, cross(self.x[1] - self.x[0], n) / cross(u, n), np.nan)
            shown, turn = (np.where(np.abs(t / dt - 0.5) < 0.5 + IN_STEP, t, np.nan) for t in (dt - ago, turn))
        yield self._flown(When.SHOWN, shown, unsure)
        yield self._flown(When.TURNED, turn, 10 * unsure)

    def _at(self, when: When, t: Floats, x: Vectors, v: Vectors, slack: Floats | float = 0.0) -> Met:
        n, depth = self.run.geometry(self.at.i, self.at.j, *x)
        v[1] = np.where(self.pair, v[1], 0.0)
        started, pull = self.v[0] - self.v[1], self.run.pull
        return Met(self, when, t, n, depth, v, self.w, started, pull, slack, self.seen(n))

    def _flown(self, when: When, t: Floats, slack: Floats | float = 0.0) -> Met:
        """Return where the balls are after a time of their own flight, which begins with the velocity `Run.u`."""
        run, there, ball = self.run, np.isfinite(t), np.stack([self.at.i, self.at.other])
        s = np.where(there, t, 0.0)
        x = run.x[self.at.k, ball] + s * (run.u[self.at.k, ball] + s * run.pull / 2)
        return self._at(when, np.where(there, t, np.nan), x, self.v + s * run.pull, np.where(there, slack, -1.0))

    def seen(self, n: Vectors) -> Six:
        """Return the six numbers along normals. Of a wall, the second's are the first's."""
        six: Six = np.stack([dot(self.dv, n), dot(self.dv, 1j * n), -self.turned * self.r / 2]) * self.m
        six[:2] *= SIGN
        six[:, 1] = np.where(self.pair, six[:, 1], six[:, 0])
        return six

    def miss(self, seen: Six, law: Six) -> Floats:
        """Return by how many px/s the six numbers differ from a law's, at most."""
        with np.errstate(all="ignore"):
            off: Floats = (np.abs(seen - law) * self.per_number).max(axis=(0, 1))
        off[~np.isfinite(off)] = np.inf
        return off


def turn_of(six: Six) -> Floats:
    """Return by which angle the normal is turned along which the first got its impulse, if its spin shows friction."""
    impulse, friction, spun = six[:, 0]
    given = impulse + 1j * friction  # in the frame of the normal
    with np.errstate(all="ignore"):
        angle: Floats = np.angle(given / (np.sqrt(np.maximum(np.abs(given) ** 2 - spun**2, 0)) + 1j * spun))
    return np.where(np.isfinite(angle), angle, 0.0)
