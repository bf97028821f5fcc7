"""Islands: several contacts of some balls in one step, computed in plain Python by a rule, or all at once.

A rule is what single contacts of the run have shown: when contacts are resolved, by which law, and what becomes of
places. The exact step is the rule of contacts in time.
"""

import math
from collections import Counter
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, Final, NamedTuple

import numpy as np

from sandbox.judge.causes import Cause
from sandbox.judge.choose import RIGHT, Key
from sandbox.judge.laws import BOUNCES, BY_NAME, PLACES
from sandbox.judge.observe import When
from sandbox.judge.run import NEVER, OUTWARD, Contacts, Run
from sandbox.judge.thresholds import DOUBTED
from sandbox.scene.walls import ARENA_COUNT
from sandbox.state import Floats, Integers

MOST_EVENTS: Final = 40  # contacts in a step of an island, after which it is a heap
FRUITLESS: Final = 25  # islands that a rule has not explained, after which it is not tried again
RESORTED: Final = 20  # islands, after which the rules that explain most are tried first
COMMON: Final = 3  # laws that single contacts show most, and that are tried on islands
MAX_LEFT_OUT: Final = 6  # contacts of an island of which each is left out in turn
BY_SOLVER: Final = {Cause.WARM_START: "pulls", Cause.UNCONVERGED: "approach", Cause.LATE: "together"}
RUB: Final = 3.0  # 1 + m r²/I of a disc
_OUTWARD: Final = [complex(n) for n in OUTWARD]
Contact = tuple[int, int]  # numbers in the island; the second may be ~wall


@dataclass(frozen=True)
class Rule:
    """How the contacts of a step are resolved: in time, or where the flights end.

    law, value: see `laws`; of_pairs: which contacts have it, None for all; cause: of an island that the rule explains,
    None if only the time is wrong; wall_law: of bounces.
    """

    in_time: bool = True
    law: str = ""
    value: float = 1.0
    of_pairs: bool | None = None
    cause: Cause | None = None
    wall_law: str = ""
    wall_place: str = ""
    pair_place: str = ""


EXACT: Final = Rule()


class End(NamedTuple):
    """How balls end a step: px, px/s and rad/s."""

    x: list[complex]
    v: list[complex]
    w: list[float]


class Island:
    """Balls of a run in step k, and the pairs and walls that may touch."""

    def __init__(self, run: Run, c: Contacts, k: int, balls: Integers, undo: complex) -> None:
        self.run, self.k, self.balls, self.undo = run, k, balls, undo
        place = {int(ball): number for number, ball in enumerate(balls)}
        self.contacts = [(place[i], place.get(j, j)) for i, j in zip(c.i.tolist(), c.j.tolist(), strict=True)]
        self.use(self.contacts)
        self.x0, self.v0 = run.x[k, balls].tolist(), run.v0[k, balls].tolist()
        self.w0 = (run.w[k, balls] * run.kept).tolist()
        self.r, self.m = run.r[balls].tolist(), run.m[balls].tolist()
        self.e, self.mu = run.e[balls].tolist(), run.mu[balls].tolist()
        self.dt, self.g = float(run.flown[k]), run.pull
        self.seen = run.x[k + 1, balls], run.v[k + 1, balls], run.w[k + 1, balls]
        hx, hv = run.hx[k, balls].tolist(), run.hv[k, balls].tolist()
        self.free = hx, (hv if undo == 1 else [v + self.g * self.dt for v in self.v0])
        off = np.abs(self.seen[0] - run.hx[k, balls]).max(), np.abs(self.seen[1] - run.hv[k, balls]).max() * self.dt
        self.tol = 4 * run.floor + 1e-6 * float(max(off))

    def use(self, contacts: list[Contact]) -> None:
        """Let some contacts happen."""
        self.pairs = [each for each in contacts if each[1] >= 0]
        self.walls = sorted((each for each in contacts if each[1] < 0), key=lambda each: (each[0], ~each[1]))

    def is_shown(self, end: End | None) -> bool:
        """Return whether an end is what is seen."""
        if end is None:
            return False
        y, z, s = self.seen
        off_w = np.abs(np.array(end.w) - s) * self.r
        off = np.abs(np.array(end.x) - y).max(), np.abs(np.array(end.v) * self.undo - z).max(), off_w.max()
        return bool(max(off[0], off[1] * self.dt, off[2] * self.dt) <= self.tol)

    def play(self, rule: Rule) -> End | None:
        """Return the end of the step by a rule; None if it has too many contacts."""
        self.x, self.v, self.w = list(self.x0), list(self.v0), list(self.w0)
        self.rule, self.events = rule, 0
        if not rule.in_time:
            self.x, self.v = map(list, self.free)
            self._resolve_all()
        elif not self._in_time():
            return None
        return End(self.x, self.v, self.w)

    def _in_time(self) -> bool:
        """Resolve contacts in time, one after another; return whether they end."""
        left, just, every = self.dt, None, [*self.walls, *self.pairs]
        while self.events < MOST_EVENTS:
            best, what = left * (1 + 1e-9), None
            for contact in every:
                t = self._until(*contact, best)
                if t < best and not (t < 1e-13 and contact == just):
                    best, what = t, contact
            self._fly(min(best, left))
            if what is None:
                return True
            left, just = max(left - best, 0.0), what
            n, depth = self._normal(*what)
            self._resolve(*what, n, depth)
        return False

    def _until(self, i: int, j: int, limit: float) -> float:
        """Return when ball i meets ball j, or wall ~j, s."""
        run, g, x, v = self.run, self.g, self.x[i], self.v[i]
        if j >= 0:
            return _touch(self.x[j] - x, v - self.v[j], self.r[i] + self.r[j])
        wall = ~j
        if wall < ARENA_COUNT:
            n = _OUTWARD[wall]
            return _close(run.face[wall] - _dot(x, n) - self.r[i], -_dot(v, n), -_dot(g, n))
        reach, along, start = self.r[i] + run.half[wall], run.along[wall], run.start[wall]
        off, v_off, g_off = ((along.conjugate() * z).imag for z in (x - start, v, g))
        side = 1 if off >= 0 else -1
        t = _close(side * off - reach, side * v_off, side * g_off)
        if t <= limit and 0 <= _dot(along, x + t * (v + t * g / 2) - start) <= run.length[wall]:
            return t
        return min(_touch(end - x, v, reach, g, limit) for end in (start, run.end[wall]))

    def _normal(self, i: int, j: int) -> tuple[complex, float]:
        """Return the normal from a ball to a body, and how deep they are in each other, px."""
        run, x = self.run, self.x[i]
        if j >= 0:
            away, reach = self.x[j] - x, self.r[i] + self.r[j]
        elif ~j < ARENA_COUNT:
            n = _OUTWARD[~j]
            return n, _dot(x, n) + self.r[i] - run.face[~j]
        else:
            start, along, length = run.start[~j], run.along[~j], run.length[~j]
            away = start + min(max(_dot(along, x - start), 0.0), length) * along - x
            reach = self.r[i] + run.half[~j]
        distance = abs(away)
        return (away / distance if distance else 1 + 0j), reach - distance

    def _fly(self, t: float) -> None:
        for ball in range(len(self.x)):
            self.x[ball] += t * (self.v[ball] + t * self.g / 2)
            self.v[ball] += t * self.g

    def _resolve_all(self) -> None:
        for i, j in [*self.walls, *self.pairs]:
            n, depth = self._normal(i, j)
            before = self.v[i]
            if depth > 0 and _dot(before - (self.v[j] if j >= 0 else 0), n) > 0:
                self._resolve(i, j, n, depth)
                self._put(self.rule.pair_place if j >= 0 else self.rule.wall_place, i, j, n, depth, before)

    def _put(self, place: str, i: int, j: int, n: complex, depth: float, before: complex) -> None:
        """Put balls where a rule does, see `laws.PLACES`."""
        match place:
            case "halves":
                self.x[i] -= depth / 2 * n
                self.x[j] += depth / 2 * n
            case "by mass":
                share = self.m[j] / (self.m[i] + self.m[j])
                self.x[i] -= share * depth * n
                self.x[j] += (1 - share) * depth * n
            case "first only" | "on":
                self.x[i] -= depth * n
            case "reflect" | "reflect with friction":
                self.x[i] -= (1 + self.e[i] * self.run.wall_e[~j]) * depth * n
                if place != "reflect":
                    late = min(depth / _dot(before, n), self.dt)
                    self.x[i] += late * _dot(self.v[i] - before, 1j * n) * 1j * n
            case "mirror":
                self.x[i] -= 2 * depth * n
            case "begin":
                for ball in (i, j) if j >= 0 else (i,):
                    self.x[ball] = self.x0[ball]
            case "begin across":
                self.x[i] -= _dot(self.x[i] - self.x0[i], n) * n

    def _resolve(self, i: int, j: int, n: complex, depth: float) -> None:
        """Resolve a contact by the rule's law."""
        self.events += 1
        rule, run, pair = self.rule, self.run, j >= 0
        law, value = (rule.law, rule.value) if rule.of_pairs in (None, pair) else ("", 1.0)
        a, b = 1 / self.m[i], 1 / self.m[j] if pair else 0.0
        if law == "turned normal":
            n *= complex(math.cos(value), math.sin(value))
        u = self.v[i] - (self.v[j] if pair else 0)
        e = self.e[i] * (self.e[j] if pair else run.wall_e[~j])
        mu = self.mu[i] * (self.mu[j] if pair else run.wall_mu[~j])
        closing = _dot(u, n)
        due = impulse = (1 + e) * closing / (a + b)
        if not pair and not law and rule.wall_law == "bounce in time" and depth > 0:
            impulse = (closing + max(0.0, e * closing - (1 + e) * _dot(self.g, n) * depth / closing)) / a
        if law == "impulse":
            impulse = value * due
        t = 1j * n
        slip = _dot(u, t) + self.r[i] * self.w[i] + (self.r[j] * self.w[j] if pair else 0)
        most = mu * abs(impulse)
        f = max(-most, min(most, slip / (a + b) / RUB))
        f = 0.0 if law == "no friction" else value * f if law == "friction" else f
        across = f + (value * due if law == "tangential" else 0.0)
        ji = value * due if law == "first share" else impulse
        jj = value * due if law == "second share" else impulse
        if pair and law == "masses swapped":
            ji, jj = due * self.m[i] / self.m[j], due * self.m[j] / self.m[i]
        elif pair and law.startswith("masses"):
            p, q = (self.r[ball] ** int(law[-1]) for ball in (i, j))
            change = (1 + e) * closing / (1 / p + 1 / q)
            ji, jj = change / p * self.m[i], change / q * self.m[j]
        spun = 0.0 if law == "no turn" else value if law == "turning" else 1.0
        self.v[i] -= a * (ji * n + across * t)
        self.w[i] -= 2 * f * spun * a / self.r[i]
        if pair:
            self.v[j] += b * (jj * n + across * t)
            self.w[j] -= 2 * f * spun * b / self.r[j]
        if law == "scaled":
            for ball in (i, j) if pair else (i,):
                self.v[ball] *= value

    def together(self) -> Cause | None:
        """Return what impulses along contacts, all at once where the balls end the step, explain of their velocities.

        LATE: each is right; UNCONVERGED: some bodies still approach, or part too fast; WARM_START: a contact pulls.
        None if such impulses do not explain the velocities, or do not tell.
        """
        y, z, spin = self.seen
        z = z / self.undo
        self.x, self.v = y.tolist(), list(self.free[1])
        spun = (spin - np.array(self.w0)) * self.r
        is_rough = any(self.mu) and np.abs(spun).max() * self.dt > self.run.floor
        met = [
            (n, i, j)
            for i, j in [*self.walls, *self.pairs]
            for n, depth in [self._normal(i, j)]
            if depth > self.run.floor
        ]
        columns = [
            self._column(way, i, j, rubs) for n, i, j in met for way, rubs in [(n, 0.0), (1j * n, 1.0)][: 1 + is_rough]
        ]
        change = z - np.array(self.v)
        got = np.column_stack([change.real, change.imag, spun]).ravel()
        if not met or len(columns) >= (3 if is_rough else 2) * len(self.x):
            return None
        matrix, weight = np.array(columns).T, np.repeat(np.sqrt(self.m), 3)
        impulses, _, rank, _ = np.linalg.lstsq(matrix * weight[:, None], got * weight, rcond=None)
        most = float(np.abs(got).max())
        if np.abs(matrix @ impulses - got).max() * self.dt > 2 * self.run.floor + 1e-6 * most * self.dt:
            return None
        is_unique, impulses = rank == len(columns), impulses[:: 1 + is_rough]
        least = 1e-5 * np.abs(impulses).max()
        if is_unique and (impulses < -least).any():
            return Cause.WARM_START if len(met) > 1 else None
        for impulse, (n, i, j) in zip(impulses, met, strict=True):
            e = self.e[i] * (self.e[j] if j >= 0 else self.run.wall_e[~j])
            before, after = (_dot(v[i] - (v[j] if j >= 0 else 0), n) for v in (self.v0, z))
            tol = 1e-3 * (most + abs(before))
            if after > tol - e * before or (is_unique and impulse > least and abs(after + e * before) > tol):
                return Cause.UNCONVERGED if len(met) > 1 else None
        return Cause.LATE if is_unique else None

    def _column(self, way: complex, i: int, j: int, rubs: float) -> Floats:
        """Return what a unit impulse of a contact changes: of each ball, both velocities and the speed of its rim."""
        column = np.zeros((len(self.x), 3))
        for ball, sign in ((i, -1), (j, 1)):
            if ball >= 0:
                column[ball] = np.array([sign * way.real, sign * way.imag, -2 * rubs]) / self.m[ball]
        return column.ravel()


class Shown(NamedTuple):
    """What single contacts show: a key, its parameter, the cause if a law is wrong; of two balls or not; how many."""

    key: Key
    value: float
    cause: Cause | None
    is_pair: bool
    times: int


class Tried:
    """The rules that are tried on islands, the likelier first: those of single contacts, alone and together.

    left_out: contacts that did not happen, by their rows.
    """

    def __init__(self, shown: list[Shown]) -> None:
        times = Counter[bool]()
        places, laws, wall_law = {True: Counter[str](), False: Counter[str]()}, Counter[Rule](), ""
        for key, value, cause, is_pair, count in shown:
            times[key.when == When.TOUCH] += count
            if key.place in PLACES and not PLACES[key.place].free:
                places[is_pair][key.place] += count
            if key.law in BOUNCES:
                wall_law = key.law
            elif cause is not None and key.law in BY_NAME:
                laws[Rule(law=key.law, value=value, of_pairs=is_pair, cause=cause)] += count
        self._faulty, self._late = laws.total(), times[False] - times[True]
        common = [law for law, _ in laws.most_common(COMMON)]
        of_all = [replace(a, of_pairs=None) for a in common if replace(a, of_pairs=not a.of_pairs) in common]
        self._rules = [EXACT, *of_all, *common]
        if times[False] > DOUBTED * times.total():
            walls, balls = ([place for place, _ in places[of].most_common(2)] for of in (False, True))
            for law in (EXACT, *of_all, *common):
                for wall, pair in product(dict.fromkeys([*walls, "reflect", ""]), dict.fromkeys([*balls, ""])):
                    self._rules.append(replace(law, in_time=False, wall_law=wall_law, wall_place=wall, pair_place=pair))
        self._wins, self._fails, self._islands = Counter[Rule](), Counter[Rule](), 0
        self.left_out: list[int] = []

    def explain(self, island: Island, near: Integers) -> dict[str, Any]:
        """Return what is wrong with an island, by the names of `ERROR`; RIGHT if nothing is, {} if none tells.

        near: the rows of its contacts.
        """
        self._islands += 1
        rule = self._rule_of(island)
        if rule is not None:
            return {"cause": RIGHT} if rule == EXACT else _said(rule, len(island.balls))
        if 1 < len(near) <= MAX_LEFT_OUT and self._fails[EXACT] < FRUITLESS * (1 + len(self.left_out)):
            every = island.contacts
            for out, row in enumerate(near.tolist()):
                island.use([*every[:out], *every[out + 1 :]])
                if island.is_shown(island.play(EXACT)):
                    self.left_out.append(row)
                    return {"cause": Cause.MISSED, "law": "left out"}
            island.use(every)
        is_trusted = self._late > self._faulty and self._wins.total() <= DOUBTED * self._islands
        cause = island.together() if is_trusted else None
        return {"cause": cause, "law": BY_SOLVER[cause]} if cause is not None else {}

    def _rule_of(self, island: Island) -> Rule | None:
        if self._islands % RESORTED == 0:
            self._rules.sort(key=lambda rule: -self._wins[rule])
        for rule in self._rules:
            if self._wins[rule] or self._fails[rule] < FRUITLESS:
                if island.is_shown(island.play(rule)):
                    self._wins[rule] += 1
                    return rule
                self._fails[rule] += 1
        return None


def _said(rule: Rule, balls: int) -> dict[str, Any]:
    """Return what a rule says is wrong with an island, by the names of `ERROR`."""
    if rule.cause is not None:
        return {"cause": rule.cause, "law": rule.law, "value": rule.value}
    place = PLACES[rule.pair_place if balls > 1 else rule.wall_place]
    is_late = place.cause in (None, Cause.LATE)
    return {"cause": Cause.LATE if is_late else place.cause, "law": "together" * is_late, "place": place.name}


def _dot(a: complex, b: complex) -> float:
    return a.real * b.real + a.imag * b.imag


def _touch(r: complex, u: complex, reach: float, g: complex = 0j, limit: float = NEVER) -> float:
    """Return `contacts.to_touch` of one contact."""
    b, c = _dot(r, u), abs(r) ** 2 - reach * reach
    square = b * b - abs(u) ** 2 * c
    t = max(c, 0.0) / (b + math.sqrt(square)) if b > 0 and square >= 0 else NEVER
    if not g:
        return t
    if c <= 0:
        return 0.0 if b > 0 else NEVER
    t = t if math.isfinite(t) else min(max(b / (abs(u) ** 2 or 1.0), 0.0), limit)
    for _ in range(8):
        d = r - u * t - g * t * t / 2
        slope = -2 * _dot(d, u + g * t)
        t = t - (abs(d) ** 2 - reach * reach) / slope if slope else NEVER
        if not abs(t) < 1e9:
            return NEVER
    d = r - u * t - g * t * t / 2
    is_met = abs(abs(d) - reach) < 1e-9 * reach and t > -1e-12 and _dot(d, u + g * t) > 0
    return max(t, 0.0) if is_met else NEVER


def _close(gap: float, v: float, a: float) -> float:
    """Return `contacts.to_close` of one gap."""
    square = v * v - 2 * a * gap
    if v > 0:
        return (v + math.sqrt(max(0.0, square))) / -a if a < 0 else NEVER
    if gap <= 0:
        return 0.0 if v < 0 or a < 0 else NEVER
    if square < 0 or (v == 0 and a >= 0):
        return NEVER
    return 2 * gap / (-v + math.sqrt(square))
