"""Islands: several contacts of some balls in one step; all of a run are computed at once, by the rules that it shows.

A rule is what single contacts of the run have shown: when contacts are resolved, by which law, and what becomes of
places. The exact step is the rule of contacts in time.
"""

from collections import Counter
from itertools import product
from typing import Final, NamedTuple

import numpy as np

from sandbox.judge.causes import Cause
from sandbox.judge.choose import RIGHT, Said
from sandbox.judge.contacts import until
from sandbox.judge.laws import BY_NAME, PLACES, shifts_of, six_of
from sandbox.judge.observe import Bodies, Met, Six, When
from sandbox.judge.run import NEVER, Islands, Run, Vectors
from sandbox.judge.thresholds import ALIKE, DOUBTED, MAX_TOGETHER, NEGLIGIBLE
from sandbox.state import Bools, Floats, Integers

MAX_ISLANDS: Final = 1_500  # of a block, the first ones: each takes up to 0.5 ms, and all of them less than a second
COMMON: Final = 3  # ways that single contacts show most, and that are tried on islands
Ends = tuple[Vectors, Vectors, Floats]  # how balls end the step: px, px/s and rad/s


class Way(NamedTuple):
    """How contacts are resolved. law, value, place: see `laws`; cause: None if the law is right."""

    law: str = ""
    value: float | None = None
    place: str = ""
    cause: Cause | None = None

    def six(self, c: Met) -> Six:
        """Return the six numbers of contacts."""
        return BY_NAME[self.law].formula(c, self.value).six if self.law else six_of(c.due, c.rub)


class Rule(NamedTuple):
    """How the contacts of two balls and those with walls are resolved: in time, or where the flights end."""

    in_time: bool
    pair: Way
    wall: Way

    def six(self, c: Met) -> Six:
        """Return the six numbers of contacts."""
        with np.errstate(all="ignore"):
            return np.where(c.pair, self.pair.six(c), self.wall.six(c))

    def said(self, *, is_pair: bool) -> tuple[int, str, str, str, str, float, float]:
        """Return what is wrong with an island that it explains, SAID."""
        ways = (self.pair, self.wall) if is_pair else (self.wall,)
        for law, value, _, cause in ways:
            if cause is not None:
                return cause, "", law, "", "", np.nan if value is None else value, np.nan
        if self.in_time:
            return RIGHT, "", "", "", "", np.nan, np.nan
        place = PLACES[ways[0].place]
        cause = Cause.LATE if place.cause is None else place.cause
        return cause, "", "", place.name, "", np.nan, np.nan


Shown = Counter[tuple[bool, bool, Way]]  # how many single contacts are in time, of two balls, and resolved in a way


class IslandSteps:
    """The steps of islands. Contacts with walls come first, then pairs, in the order of balls."""

    def __init__(self, run: Run, islands: Islands) -> None:
        k, i, island, c, one, two = islands
        order = np.lexsort((np.where(c.pair, c.j, ~c.j), c.i, c.pair, islands.of))
        self.run, self.k, self.i, self.island = run, k, i, island
        self.c, self.one, self.two, self.of = c.part(order), one[order], two[order], islands.of[order]
        self.count = int(island.max(initial=-1)) + 1
        sizes = np.bincount(self.of, minlength=self.count)
        self.rank = np.arange(len(order)) - (np.cumsum(sizes) - sizes)[self.of]
        self.bodies = Bodies(run, self.c.i, self.c.j)
        self.x, self.v, self.w = run.x[k, i], run.v0[k, i], run.w[k, i] * run.kept
        self.seen = run.x[k + 1, i], run.v[k + 1, i], run.w[k + 1, i]
        self.dt = np.zeros(self.count)
        self.dt[island] = run.flown[k]
        self.free = run.hx[k, i], run.hv[k, i]
        off = np.maximum(np.abs(self.seen[0] - run.hx[k, i]), np.abs(self.seen[1] - run.hv[k, i]) * self.dt[island])
        self.tol = 4 * run.floor + NEGLIGIBLE * self._most(off)

    def _most(self, values: Floats) -> Floats:
        """Return the largest value of each island. values: of nodes."""
        most = np.zeros(self.count)
        np.maximum.at(most, self.island, np.where(np.isnan(values), NEVER, values))
        return most

    def follow(self, rule: Rule, some: Bools) -> Bools:
        """Return which of some islands, (islands,), end the step as by a rule."""
        rows = np.flatnonzero(some[self.of])
        x, v, w = self._in_time(rule, rows, some) if rule.in_time else self._at_end(rule, rows)
        y, z, spin = self.seen
        dt = self.dt[self.island]
        off = np.abs(x - y), np.abs(v - z) * dt, np.abs(w - spin) * self.run.r[self.i] * dt
        return some & (self._most(np.max(off, axis=0)) <= self.tol)

    def _met(self, rows: Integers, x: Vectors, v: Vectors, w: Floats, t: Floats, when: When) -> Met:
        """Return contacts where nodes are at places x, px, with velocities v, px/s, and spins w, rad/s."""
        b, ends = self.bodies.part(rows), np.stack([self.one[rows], self.two[rows]])
        n, depth = self.run.geometry(self.c.i[rows], self.c.j[rows], *x[ends])
        v, w, begun = v[ends], w[ends], self.v[ends]
        for part in (v, w, begun):
            part[1] = np.where(b.pair, part[1], 0.0)
        return Met(b, when, t, n, depth, v, w, begun[0] - begun[1], self.run.pull)

    def _set(self, rows: Integers, values: Vectors | Floats, to: Vectors | Floats) -> None:
        """Set values of the nodes of contacts, of which no two have one in common. to: (2, k)."""
        values[self.one[rows]] = to[0]
        pair = self.bodies.pair[rows]
        values[self.two[rows][pair]] = to[1][pair]

    def _in_time(self, rule: Rule, rows: Integers, some: Bools) -> Ends:
        """Resolve contacts of some islands in time, one after another."""
        x, v, w, run = self.x.copy(), self.v.copy(), self.w.copy(), self.run
        left, going, just = self.dt.copy(), some.copy(), np.full(self.count, -1)
        for _ in range(MAX_TOGETHER):
            rows = rows[going[self.of[rows]]]
            of, ends = self.of[rows], np.stack([self.one[rows], self.two[rows]])
            t = until(run, self.c.i[rows], self.c.j[rows], x[ends], v[ends], left[of])
            t[(t < 1e-13) & (just[of] == rows)] = NEVER
            best = left * (1 + 1e-9)
            np.minimum.at(best, of, t)
            first = np.flatnonzero(t == best[of])
            which, once = np.unique(of[first], return_index=True)
            hit = rows[first[once]]
            fly = np.where(going, np.minimum(best, left), 0.0)[self.island]
            x += fly * (v + fly * run.pull / 2)
            v += fly * run.pull
            left, going = np.maximum(left - best, 0.0), np.zeros(self.count, bool)
            if not len(hit):
                return x, v, w
            going[which], just[which] = True, hit
            c = self._met(hit, x, v, w, 0 * left[which], When.TOUCH)
            after, spun = c.after(rule.six(c))
            self._set(hit, v, after)
            self._set(hit, w, spun)
        x[going[self.island]] = NEVER
        return x, v, w

    def _at_end(self, rule: Rule, rows: Integers) -> Ends:
        """Resolve contacts where flights end, one after another."""
        x, v, w = self.free[0].copy(), self.free[1].copy(), self.w.copy()
        for rank in range(int(self.rank[rows].max(initial=-1)) + 1):
            now = rows[self.rank[rows] == rank]
            dt, ends = self.dt[self.of[now]], np.stack([self.one[now], self.two[now]])
            c = self._met(now, x, v, w, dt, When.END)
            happens = (c.depth > 0) & c.closes
            after, spun = c.after(np.where(happens, rule.six(c), 0.0))
            shifts = shifts_of(c, after - c.v, self.x[ends] - x[ends], dt)
            for place, those in ((rule.pair.place, c.pair), (rule.wall.place, ~c.pair)):
                if place in shifts:
                    self._set(now, x, x[ends] + np.where(happens & those, shifts[place][0], 0.0))
            self._set(now, v, after)
            self._set(now, w, spun)
        return x, v, w

    def together(self, some: Bools) -> Integers:
        """Return the causes of islands, if impulses along contacts, all at once where balls end the step, explain them.

        LATE: each impulse is right; UNCONVERGED: bodies still approach, or part too slowly or too fast; WARM_START: a
        contact pulls. UNKNOWN if no impulses explain the velocities, or others do as well. some: (islands,), which to
        explain.
        """
        run, rows, y = self.run, np.flatnonzero(some[self.of]), self.seen[0]
        depth = run.geometry(self.c.i[rows], self.c.j[rows], y[self.one[rows]], y[self.two[rows]])[1]
        rows = rows[depth > run.floor]
        c = self._met(rows, *self.seen, self.dt[self.of[rows]], When.END)
        causes = np.full(self.count, Cause.UNKNOWN, int)
        change, turned = self.seen[1] - self.free[1], (self.seen[2] - self.w) * run.r[self.i]
        seen, off = np.stack([change.real, change.imag, turned], axis=1), c.u + c.b.e * c.started
        is_rough = run.scene.is_rough & (self._most(np.abs(turned)) * self.dt > run.floor)
        for island in np.unique(self.of[rows]).tolist():
            nodes, deep = np.flatnonzero(self.island == island), np.flatnonzero(self.of[rows] == island)
            parts, dt, number = 1 + int(is_rough[island]), self.dt[island], np.arange(len(deep))
            given = np.zeros((len(nodes), 3, parts, len(deep)))  # what unit impulses and unit frictions change
            for ends, sign, inverses in zip((self.one, self.two), (-1, 1), c.b.inverse[:, deep], strict=True):
                node = np.searchsorted(nodes, ends[rows[deep]])
                for rubs in range(parts):
                    unit = sign * inverses * c.n[deep] * 1j**rubs
                    given[node, :, rubs, number] += np.stack([unit.real, unit.imag, -2 * rubs * inverses], axis=1)
            matrix, got = given.reshape(3 * len(nodes), -1), seen[nodes].ravel()
            solved, most = np.linalg.pinv(matrix) @ got, np.abs(got).max()
            is_unique = np.linalg.matrix_rank(matrix) == parts * len(deep) < len(nodes) * (1 + parts)
            if not is_unique or np.abs(matrix @ solved - got).max() * dt > 2 * run.floor + NEGLIGIBLE * most * dt:
                continue
            impulses = solved[: len(deep)]
            least, tol = 1e-5 * np.abs(impulses).max(), ALIKE * (most + np.abs(c.started[deep]))
            excess = np.where(impulses > least, np.abs(off[deep]), off[deep])
            if (impulses >= -least).all() and (excess <= tol).all():
                causes[island] = Cause.LATE
            elif len(deep) > 1:
                causes[island] = Cause.WARM_START if (impulses < -least).any() else Cause.UNCONVERGED
        return causes


def explain_islands(islands: IslandSteps, shown: Shown, tried: Bools, said: Said) -> None:
    """Set what is said of the islands that are tried, (islands,), if a rule explains it: RIGHT if nothing is wrong."""
    unsaid, is_pair = tried.copy(), np.bincount(islands.island, minlength=islands.count) > 1
    for rule in _rules(shown):
        if unsaid.any():
            won = islands.follow(rule, unsaid)
            unsaid &= ~won
            said[won & is_pair], said[won & ~is_pair] = rule.said(is_pair=True), rule.said(is_pair=False)
    late = sum(-times if in_time else times for (in_time, *_), times in shown.items())
    if late > sum(times for (_, _, way), times in shown.items() if way.cause is not None):
        causes = islands.together(unsaid)
        for cause, law in ((Cause.WARM_START, "pulls"), (Cause.UNCONVERGED, "approach"), (Cause.LATE, "")):
            said["cause"][causes == cause], said["law"][causes == cause] = cause, law
    x, c, of = islands.free[0], islands.c, islands.of
    depth = islands.run.geometry(c.i, c.j, x[islands.one], x[islands.two])[1]
    np.fmax.at(said["depth"], of, np.where(said["cause"][of] == Cause.LATE, depth, np.nan))


def _rules(shown: Shown) -> list[Rule]:
    """Return the rules that are tried on islands, the likelier first, of what single contacts show most."""
    late = sum(times for (in_time, *_), times in shown.items() if not in_time)
    rules = []
    for in_time in (True, False)[: 1 + (late > DOUBTED * shown.total())]:
        ways = [[way for (*of, way), _ in shown.most_common() if of == [in_time, pair]] for pair in (True, False)]
        rules += [Rule(in_time, *both) for both in product(*(dict.fromkeys([Way(), *some[:COMMON]]) for some in ways))]
    return rules
