"""Islands: several contacts of some balls in one step; all of a run are computed at once, by the rules that it shows.

A rule is what single contacts of the run have shown: when contacts are resolved, by which law, and what becomes of
places. The exact step is the rule of contacts in time.
"""

from collections import Counter
from dataclasses import dataclass, replace
from itertools import product
from typing import Final, NamedTuple

import numpy as np

from sandbox.judge.causes import Cause
from sandbox.judge.choose import RIGHT, Key, Said
from sandbox.judge.contacts import until
from sandbox.judge.laws import BOUNCES, BY_NAME, PLACES, shifts_of, six_of
from sandbox.judge.observe import Bodies, Met, Six, When
from sandbox.judge.run import NEVER, Islands, Run, Vectors
from sandbox.judge.thresholds import DOUBTED, MAX_TOGETHER
from sandbox.state import Bools, Floats, Integers

MAX_ISLANDS: Final = 1_500  # of a block, the first ones: each takes up to 0.5 ms, all less than a second
COMMON: Final = 3  # laws, and 2 places, that single contacts show most, and that are tried on islands
Ends = tuple[Vectors, Vectors, Floats]  # how balls end the step: px, px/s and rad/s


@dataclass(frozen=True)
class Rule:
    """How the contacts of a step are resolved: in time, or where the flights end.

    law, value: see `laws`; of_pairs: which contacts have it, None for all; cause: of an island that the rule explains,
    None if only the time is wrong; wall_law: of bounces.
    """

    in_time: bool = True
    law: str = ""
    value: float | None = None
    of_pairs: bool | None = None
    cause: Cause | None = None
    wall_law: str = ""
    wall_place: str = ""
    pair_place: str = ""

    def six(self, c: Met) -> Six:
        """Return the six numbers of contacts."""
        six = six_of(c.due, c.rub)
        with np.errstate(all="ignore"):
            if self.wall_law:
                six = np.where(c.pair | (c.depth <= 0), six, BY_NAME[self.wall_law].formula(c, None).six)
            if self.law:
                those = np.full(len(c.n), True) if self.of_pairs is None else c.pair == self.of_pairs
                six = np.where(those, BY_NAME[self.law].formula(c, self.value).six, six)
        return six


EXACT: Final = Rule()


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
        self.are_heaps = np.zeros(self.count, bool)  # with more contacts in the step than are judged
        self.tol = 4 * run.floor + 1e-6 * self._most(off)

    def _most(self, values: Floats) -> Floats:
        """Return the largest value of each island. values: of nodes."""
        most = np.zeros(self.count)
        np.maximum.at(most, self.island, np.where(np.isnan(values), NEVER, values))
        return most

    def follow(self, rule: Rule, some: Bools) -> Bools:
        """Return which of some islands, (islands,), end the step as by a rule."""
        some = some & ~(self.are_heaps & rule.in_time)
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
        self.are_heaps |= going
        return x, v, w

    def _at_end(self, rule: Rule, rows: Integers) -> Ends:
        """Resolve contacts where flights end, one after another."""
        x, v, w = self.free[0].copy(), self.free[1].copy(), self.w.copy()
        for rank in range(int(self.rank[rows].max(initial=-1)) + 1):
            now = rows[self.rank[rows] == rank]
            dt, ends = self.dt[self.of[now]], np.stack([self.one[now], self.two[now]])
            c = self._met(now, x, v, w, dt, When.END)
            happens = (c.depth > 0) & c.closes
            if not happens.any():
                continue
            after, spun = c.after(np.where(happens, rule.six(c), 0.0))
            shifts = shifts_of(c, after - c.v, self.x[ends] - x[ends], dt)
            for place, those in ((rule.pair_place, c.pair), (rule.wall_place, ~c.pair)):
                if place in shifts:
                    self._set(now, x, x[ends] + np.where(happens & those, shifts[place][0], 0.0))
            self._set(now, v, after)
            self._set(now, w, spun)
        return x, v, w

    def together(self, island: int) -> bool:
        """Return whether impulses, all at once and right where the balls end the step, explain their velocities."""
        nodes, rows, run = np.flatnonzero(self.island == island), np.flatnonzero(self.of == island), self.run
        dt, ends = float(self.dt[island]), np.stack([self.one[rows], self.two[rows]])
        c = self._met(rows, *self.seen, np.full(len(rows), dt), When.END)
        deep = np.flatnonzero(c.depth > run.floor)
        turned = (self.seen[2] - self.w) * run.r[self.i]
        is_rough = bool(run.scene.is_rough and np.abs(turned[nodes]).max() * dt > run.floor)
        given = np.zeros((3, len(nodes), 1 + is_rough, len(deep)))  # what unit impulses and unit frictions change
        for rubs in range(1 + is_rough):
            for end, sign, inverse in zip(ends, (-1, 1), c.b.inverse, strict=True):
                unit = sign * inverse * c.n * 1j**rubs
                change = np.stack([unit.real, unit.imag, -2 * rubs * inverse])[:, deep]
                given[:, np.searchsorted(nodes, end[deep]), rubs, np.arange(len(deep))] += change
        matrix, change = given.reshape(3 * len(nodes), -1), self.seen[1] - self.free[1]
        got = np.concatenate([change[nodes].real, change[nodes].imag, turned[nodes]])
        solved, _, rank, _ = np.linalg.lstsq(matrix, got, rcond=None)
        impulses, most = solved[: len(deep)], float(np.abs(got).max())
        is_unique = 0 < rank == len(solved) < (2 + is_rough) * len(nodes)
        if not is_unique or np.abs(matrix @ solved - got).max() * dt > 2 * run.floor + 1e-6 * most * dt:
            return False
        least = 1e-5 * np.abs(impulses).max()
        off, tol = c.u[deep] + c.b.e[deep] * c.started[deep], 1e-3 * (most + np.abs(c.started[deep]))
        is_right = np.where(impulses > least, np.abs(off), off) <= tol
        return bool((is_right & (impulses >= -least)).all())


class Shown(NamedTuple):
    """What single contacts show: a key, its parameter, the cause if a law is wrong; of two balls or not; how many."""

    key: Key
    value: float | None
    cause: Cause | None
    is_pair: bool
    times: int


def explain_islands(islands: IslandSteps, shown: list[Shown], tried: Bools, said: Said) -> None:
    """Set what is said of the islands that are tried, (islands,), if a rule explains it: RIGHT if nothing is wrong."""
    unsaid, is_pair = tried.copy(), np.bincount(islands.island, minlength=islands.count) > 1
    for rule in _rules(shown):
        if unsaid.any():
            won = islands.follow(rule, unsaid)
            unsaid &= ~won
            for of, some in enumerate((won & ~is_pair, won & is_pair)):
                said[some] = _said(rule, is_pair=bool(of))
    late = sum(each.times if each.key.when != When.TOUCH else -each.times for each in shown)
    faulty = sum(each.times for each in shown if each.cause is not None and _is_fault(each.key))
    if late > faulty and np.count_nonzero(unsaid) >= (1 - DOUBTED) * np.count_nonzero(tried):
        for island in np.flatnonzero(unsaid).tolist():
            if islands.together(island):
                said["cause"][island], said["law"][island] = Cause.LATE, "together"


def _is_fault(key: Key) -> bool:
    return key.law in BY_NAME and key.law not in BOUNCES


def _rules(shown: list[Shown]) -> list[Rule]:
    """Return the rules that are tried on islands, the likelier first: those of single contacts, alone and together."""
    times = Counter[bool]()
    places, laws, wall_law = {True: Counter[str](), False: Counter[str]()}, Counter[Rule](), ""
    for key, value, cause, is_pair, count in shown:
        times[key.when == When.TOUCH] += count
        if key.place in PLACES and not PLACES[key.place].free:
            places[is_pair][key.place] += count
        if key.law in BOUNCES:
            wall_law = key.law
        elif cause is not None and _is_fault(key):
            laws[Rule(law=key.law, value=value, of_pairs=is_pair, cause=cause)] += count
    common = [law for law, _ in laws.most_common(COMMON)]
    of_all = [replace(a, of_pairs=None) for a in common if replace(a, of_pairs=not a.of_pairs) in common]
    rules = [EXACT, *of_all, *common]
    if times[False] > DOUBTED * times.total():
        walls, balls = ([place for place, _ in places[of].most_common(2)] for of in (False, True))
        for law, *put in product(rules[:], dict.fromkeys([*walls, "reflect", ""]), dict.fromkeys([*balls, ""])):
            wall, pair = put
            rules.append(replace(law, in_time=False, wall_law=wall_law, wall_place=wall, pair_place=pair))
    return rules


def _said(rule: Rule, *, is_pair: bool) -> tuple[int, str, str, str, float, float]:
    """Return what a rule says is wrong with an island, by the names of `SAID`."""
    if rule == EXACT:
        return RIGHT, "", "", "", np.nan, np.nan
    if rule.cause is not None:
        return rule.cause, rule.law, "", "", np.nan if rule.value is None else rule.value, np.nan
    place = PLACES[rule.pair_place if is_pair else rule.wall_place]
    cause = Cause.LATE if place.cause is None else place.cause
    return cause, "together" if cause == Cause.LATE else "", place.name, "", np.nan, np.nan
