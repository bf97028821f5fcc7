"""Judging a run: what its steps do otherwise than exact ones, from the engine's own states, all steps at once.

Flights that touch nothing show how the engine flies. Contacts that are alone in their step are explained by formulas,
and a bounded number of islands of several by computing their step with what single contacts have shown.
"""

from collections import Counter
from typing import Final

import numpy as np

from sandbox.judge.causes import Cause
from sandbox.judge.choose import ANYWHERE, NOTHING, RIGHT, Said, choose, doubt_faults, is_fault, is_right, nothing_said
from sandbox.judge.contacts import components, due, keys_of, near_pairs, near_walls, way_of
from sandbox.judge.flight import habit_of, pull_of
from sandbox.judge.islands import MAX_ISLANDS, IslandSteps, Shown, Way, explain_islands
from sandbox.judge.laws import BY_NAME, PLACES
from sandbox.judge.ledger import NO_BODY, Errors, Ledger, pairs
from sandbox.judge.observe import Singles, When
from sandbox.judge.run import NEVER, Contacts, Islands, Run, cross, dot
from sandbox.judge.summary import Judged, Verdict, summary
from sandbox.judge.thresholds import ALIKE, MAX_TOGETHER, NEGLIGIBLE, REST
from sandbox.judge.words import of_flight
from sandbox.quantity import deepest_overlap
from sandbox.run.mouse import Pushes
from sandbox.scene.model import Scene
from sandbox.scene.walls import ARENA_COUNT
from sandbox.state import Bools, Damping, Floats, Integers, States

BLOCK: Final = 2**20  # steps of a ball that are judged at once, some 300 MB of arrays


class Steps:
    """The steps of a run, as they come: what fills a block is judged at once, and the rest when a verdict is asked for.

    damping: as the engine declares; is_soft: whether its contacts last several steps, which are then not judged.
    """

    def __init__(self, scene: Scene, damping: Damping, *, is_soft: bool) -> None:
        self._scene, self._damping, self._is_soft = scene, damping, is_soft
        self._judged: list[Judged] = []
        self._begin()

    def _begin(self) -> None:
        self._states, self._pushes, self._clock = list[States](), list[Pushes](), list[Floats]()
        self._count = 0

    def add(self, states: States, pushes: Pushes, clock: Floats) -> None:
        """Add steps. states: of steps + 1 rows, the first as the last before; pushes: see PUSH; clock: (steps,) s."""
        pushes = pushes.copy()
        pushes["row"] += self._count
        self._states.append(States(*(each[1 if self._count else 0 :].copy() for each in states)))
        self._pushes.append(pushes)
        self._clock.append(clock)
        self._count += len(clock)
        if self._count * len(self._scene.bodies) >= BLOCK:
            self._judged.append(self._judge())
            self._begin()

    def verdict(self) -> Verdict:
        """Return the verdict on the steps so far."""
        return summary(self._scene, [*self._judged, *([self._judge()] if self._count else [])])

    def _judge(self) -> Judged:
        states = States(*map(np.concatenate, zip(*self._states, strict=True)))
        pushes, clock = np.concatenate(self._pushes), np.concatenate(self._clock)
        block = _Block(Run(self._scene, states, pushes, clock), self._damping.per_second)
        if not self._is_soft:
            block.judge_contacts()
        block.judge_flights(is_soft=self._is_soft)
        errors = block.ledger.errors()
        if not self._judged and not self._is_soft:
            block.doubt_overlaps(errors)
        block.close(errors)
        overlap = block.deepest_overlap(self._damping.substeps)
        return Judged(errors, block.ledger.sums, clock, block.contacts, block.flights, not states.spin.any(), overlap)


class _Block:
    """Steps being judged.

    c: all contacts that may happen, with touch, s, before and deepest, px; contacts: how many do; active: (steps, n),
    which balls do not fly as the engine does; kicked: whose velocity or spin is not as in its flights; done: which are
    explained; still: which move by less than four steps of gravity; near: which may have touched something; carried:
    which rest or roll, so that they do not fly; is_odd: whether something besides contacts changes balls in most
    steps, so that contacts are not judged; ways: how single contacts are resolved; own: the line of what the scene
    takes where balls rest or several contacts follow each other.
    """

    def __init__(self, run: Run, damping: float) -> None:
        self.run = run
        self.contacts, self.flights = 0, dict[str, str]()
        takes = Cause.FRICTION if run.scene.is_rough else Cause.ELASTICITY
        self.own = Cause.ROUNDING if run.scene.keeps_energy else takes
        self.ledger = Ledger(run, self.own)
        self.ways: Shown = Counter()
        self.way = way_of(run)
        self.c = Contacts.joined(*(near(run, *run.every, self.way.ravel()) for near in (near_pairs, near_walls)))
        self.before = run.depth(self.c, run.x[:-1])
        free = np.ones(run.v0.shape, bool)
        free[self.c.ends] = False
        self.habit = habit = habit_of(run, free, damping)
        hx, hv = (part.reshape(run.v0.shape) for part in habit.end(run.flights(*run.every)))
        run.fly(hx, hv, pull_of(habit.speed, run.g), habit.kept, habit.place.clock)
        dt = run.dt[:, None]
        off_x, off_v = run.x[1:] - run.hx, run.v[1:] - run.hv
        rim = np.abs(run.w[1:] - run.w[:-1] * run.kept) * run.r * dt
        speed = np.maximum(np.maximum(np.abs(off_v.real), np.abs(off_v.imag)) * dt, rim)
        place = np.maximum(np.abs(off_x.real), np.abs(off_x.imag))
        self.kicked = speed > 1.5 * run.floor
        self.active = self.kicked | (place > 1.5 * run.floor)
        self.slows_spin = Cause.UNREPORTED if habit.speed.cause is None and habit.kept != 1 else None
        is_slowed = Cause.UNREPORTED in (habit.speed.cause, self.slows_spin)
        self.is_odd = is_slowed or bool(free.any() and self.active[free].mean() > 0.5)
        moved = (np.abs(run.x[1:] - run.x[:-1]) - run.tiny) / dt
        self.still = np.maximum(moved, np.abs(run.v[1:])) <= 4 * abs(run.g) * dt
        self.done, self.near, self.carried = np.zeros((3, *run.v0.shape), bool)

    def deepest_overlap(self, substeps: int) -> float:
        """Return the deepest overlap of two balls where every so many steps begin, px."""
        run, rows = self.run, np.flatnonzero(self.c.pair & (self.c.k % substeps == 0))
        if not len(rows):
            return 0.0
        x = run.x[self.c.k[rows[self.before[rows].argmax()]]]
        return deepest_overlap(pairs(x), run.r, run.scene.bodies.filters)[0]

    # Contacts

    def judge_contacts(self) -> None:
        """Judge single contacts, what came early, islands of several, and what did not happen."""
        run, c = self.run, self.c
        self.touch = due(run, c)
        self.deepest = np.maximum(self.before, run.depth(c, run.hx))
        self.is_due = self.touch < NEVER
        some_act, all_act = c.any_in(self.active), c.all_in(self.active)
        acts = (self.is_due & some_act) | ((self.deepest > 0) & all_act)
        waits = self.is_due & ~some_act
        keys = keys_of(c, run)
        waited = np.isin(keys - 1, keys[waits], assume_unique=True)  # in the step before
        dropped = acts & self.is_due & (self.before > run.tiny) & waited & self._has_more(c, c.part(acts), 1)
        acts &= ~dropped
        some = c.part(acts)
        self.contacts = len(some.k)
        nodes, index = np.unique(np.concatenate(some.nodes(run.n)), return_inverse=True)
        label = components(len(nodes), *np.split(index, 2))
        island = label[index[: len(some.k)]]
        alone = np.bincount(island, minlength=1)[island] == 1
        rest = self._at_rest(some)
        single = alone & ~rest
        singles, touch = some.part(single), self.touch[acts][single]
        said = choose(Singles(run, singles, touch))
        doubt_faults(said, singles.any_in(self.kicked))
        self._enter_singles(singles, touch, said)
        at_rest = some.part(alone & rest)
        self.done[at_rest.k, at_rest.i] = self.carried[at_rest.k, at_rest.i] = True
        self.ledger.rightful(self.own, run.gain(at_rest.k, at_rest.i))
        if (self.active & ~self.done).any():
            self._early(nodes)
            self._islands()
        self._missed(c.part(waits | dropped), self.touch[waits | dropped], keys[acts & c.any_in(self.kicked)])

    def _has_more(self, c: Contacts, among: Contacts, own: Bools | int) -> Bools:
        """Return which contacts have a ball with more than their own among others, of which each is `own` itself."""
        count = np.zeros(self.run.v0.shape, int)
        np.add.at(count, among.ends, 1)
        more: Bools = (count[c.k, c.i] > own) | (c.pair & (count[c.k, c.other] > own))
        return more

    def _at_rest(self, c: Contacts) -> Bools:
        """Return which contacts are of balls that gravity presses to a wall that carries them, or that lie still."""
        run, dt, fall = self.run, self.run.dt[c.k], abs(self.run.g) * self.run.dt[c.k]
        (_, before), (n, after) = (run.geometry(c.i, c.j, run.x[k, c.i], run.x[k, c.other]) for k in (c.k, c.k + 1))
        across = np.maximum(np.abs(dot(run.v0[c.k, c.i], n)), np.abs(dot(run.v[c.k + 1, c.i], n)))
        way = REST * fall * dt
        carried = (across <= REST * fall) & (np.minimum(before, after) > -way) & (np.abs(after - before) <= way)
        mu = run.mu[c.i] * run.wall_mu[np.where(c.pair, 0, ~c.j)]
        slower = np.abs(dot(run.v[c.k + 1, c.i] - run.hv[c.k, c.i], 1j * n))
        rubs = slower <= REST * mu * fall + run.floor / dt + 0.1 * fall
        still = self.still & (np.abs(run.v0) <= 4 * abs(run.g) * run.dt[:, None])
        return (c.all_in(still) | (~c.pair & carried & rubs)) & bool(run.g)

    def _enter_singles(self, c: Contacts, touch: Floats, said: Said) -> None:
        """Enter single contacts in the ledger: what is right, and what is wrong."""
        cause = said["cause"]
        if self.is_odd:
            cause[cause >= 0] = Cause.UNKNOWN
        every = self.c.part(self.c.all_in(self.active) | ~self.c.pair | (self.deepest > -self.run.tiny))
        own = np.isin(keys_of(c, self.run), keys_of(every, self.run), assume_unique=True)
        crowded = self._has_more(c, every, own)  # by another active ball, a wall, or what its balls touch
        clear, in_time = (cause != NOTHING) & ~crowded, said["when"] == When.TOUCH
        is_stepped = np.count_nonzero(clear & ~in_time) > np.count_nonzero(clear & in_time)
        usual = is_stepped & (cause == Cause.LATE) & is_right(said)
        known = (cause == RIGHT) | clear | usual  # else another contact may have done it
        self.done[c.part(known).ends] = True
        c, touch, said, in_time = c.part(known), touch[known], said[known], in_time[known]
        self.ledger.enter_islands(Islands.of_contacts(c), touch, said)
        values = (None if np.isnan(value) else value for value in said["value"].tolist())
        columns = (in_time, c.pair, said["cause"], is_fault(said), said["law"], said["place"])
        alike = Counter(zip(*(column.tolist() for column in columns), values, strict=True))
        for key, times in alike.items():  # how contacts are resolved
            is_timely, is_pair, number, is_wrong, law, place, value = key
            put = place if place in PLACES and not PLACES[place].free else ""
            fault = Cause(number) if is_wrong else None
            parameter = None if value is None else float(f"{value:.9g}")
            self.ways[is_timely, is_pair, Way(law if law in BY_NAME else "", parameter, put, fault)] += times

    def _early(self, nodes: Integers) -> None:
        """Judge balls that nothing should have touched as contacts that came early."""
        run, kicked = self.run, self.kicked & ~self.done
        kicked[nodes // run.n, nodes % run.n] = False
        k, i = np.nonzero(self.active)
        margin, way = float(run.r.max()), self.way[k, i]
        c = Contacts.joined(near_pairs(run, k, i, way, margin), near_walls(run, k, i, way, margin / 2))
        for each in (c.part(run.depth(c, run.hx) > -margin / 4), self.c.part(self.deepest > -run.tiny)):
            self.near[each.ends] = True
        c = c.part(c.all_in(kicked))
        touch = np.full(len(c.k), NEVER)
        s = Singles(run, c, touch)
        said, end = choose(s), s.met(When.END)
        named = (said["cause"] >= 0) & (said["cause"] != Cause.UNKNOWN) & (said["place"] != ANYWHERE)
        named &= end.u + dot(s.dv[0] - s.dv[1], end.n) <= s.tol  # after a contact, the two do not approach
        named &= ~self._has_more(c, c.part(named), 1)
        self._enter_singles(c.part(named), touch[named], said[named])

    # Islands

    def _islands(self) -> None:
        """Judge the balls that are left, in islands of those that may have touched, or alone."""
        run, c, left = self.run, self.c, self.active & ~self.done
        touching = c.pair & (self.deepest > -run.tiny)
        reached, t = left.copy(), c.part(touching)
        while (grow := reached[t.k, t.i] != reached[t.k, t.j]).any():  # what one of a row gets, it passes on
            reached[t.k[grow], t.i[grow]] = reached[t.k[grow], t.j[grow]] = True
        a, b = left[c.k, c.i], left[c.k, c.other] | ~c.pair
        join = np.where(c.pair, (a & b) | (self.is_due & (a | b)) | (touching & reached[c.k, c.i]), a)
        lone = np.flatnonzero(left)
        nodes, index = np.unique(np.concatenate([lone, *c.part(join).nodes(run.n)]), return_inverse=True)
        if not len(nodes):
            return
        label = components(len(nodes), *np.split(index[len(lone) :], 2))
        island = np.unique(label, return_inverse=True)[1]
        first, second = c.nodes(run.n)
        one, two = (np.searchsorted(nodes, end) % len(nodes) for end in (first, second))
        inside = (nodes[one] == first) & (nodes[two] == second) & (island[one] == island[two])
        has_due = np.isin(np.arange(island.max() + 1), island[one[inside & self.is_due]])
        is_lone = (np.bincount(island) == 1) & ~has_due
        inside &= ~is_lone[island[one]]
        k, i = np.divmod(nodes, run.n)
        islands = Islands(k, i, island, c.part(inside), one[inside], two[inside])
        said = self._said_of_islands(islands, is_lone)
        met = inside & (self.is_due | (self.deepest > -run.tiny))
        is_single = np.bincount(island[one[met]], minlength=len(said)) <= 1
        said["law"][is_single & (said["law"] == "several")] = "single"
        alone = is_lone[island]
        said[is_lone] = self._said_of_lone(k[alone], i[alone])
        self.ledger.enter_islands(islands, self.touch[inside], said)

    def _said_of_islands(self, islands: Islands, is_lone: Bools) -> Said:
        """Return what is said of islands: those at rest are right, and those with too many contacts are unknown."""
        run, k, i, count = self.run, islands.k, islands.i, len(is_lone)
        rests = ~is_lone & (np.bincount(islands.island, ~self.still[k, i]) == 0) & bool(run.g)
        self.carried[k, i] |= rests[islands.island]
        said = nothing_said(count)
        said["cause"], said["law"] = Cause.UNKNOWN, "several"
        said["cause"][rests] = RIGHT
        tried = ~rests & ~is_lone & (np.bincount(islands.of, minlength=count) <= MAX_TOGETHER)
        tried &= np.cumsum(tried) <= MAX_ISLANDS
        if tried.any() and not self.is_odd:
            explain_islands(IslandSteps(run, islands), self.ways, tried, said)
        return said

    def _said_of_lone(self, k: Integers, i: Integers) -> Said:
        """Return what is said of balls that touch nothing and do not fly as the engine does."""
        run, at = self.run, (k, i)
        off_x, off_v = np.abs(run.x[k + 1, i] - run.hx[at]), np.abs(run.v[k + 1, i] - run.hv[at])
        spun = np.abs(run.w[k + 1, i] - run.w[k, i] * run.kept) * run.r[i]
        least = NEGLIGIBLE * (1 + np.abs(run.v0[at]))
        small = (off_x < NEGLIGIBLE * run.r[i]) & (off_v < least) & (spun < least)
        may, kicked, speed = self.near[at], self.kicked[at], np.abs(run.v[k + 1, i])
        said = nothing_said(len(k))
        cause = np.where(may, Cause.UNKNOWN, np.where(kicked, Cause.UNREPORTED, Cause.TELEPORTED))
        said["cause"] = np.where(small, RIGHT, cause)
        said["law"] = np.where(may, "single", np.where(kicked, np.where(speed == 0, "stopped", "changed"), "put"))
        said["value"] = np.where(kicked & ~may, speed, np.nan)
        return said

    # What did not happen, and flights

    def _missed(self, c: Contacts, t: Floats, resolved: Integers) -> None:
        """Name contacts that were due at times t, s, and did not happen before the two were apart again.

        Of a wall, a ball must end on its other side: what it flies back from by itself is no passage. Nor is a graze of
        two balls that is less deep than the parabola is off the way of an engine that integrates gravity otherwise.
        """
        run, s = self.run, Singles(self.run, c, t)
        met, unsure = s.met(When.TOUCH), abs(run.pull) * s.dt**2 / 2 * (self.habit.place.cause is not None)
        speed = np.abs(met.v[0] - met.v[1])
        across = np.abs(cross(met.n, met.v[0] - met.v[1])) / np.where(speed > 0, speed, 1.0)
        deep = ~c.pair | (s.r.sum(axis=0) * (1 - across) > unsure)
        order = np.argsort(keys_of(c, run))
        order = order[((met.u * run.dt[c.k] > 4 * run.floor) & deep)[order]]
        c, keys = c.part(order), keys_of(c, run)[order]
        begins = np.diff(keys, prepend=-9) != 1  # of the steps in a row in which it is due
        ends = c.part(np.append(begins[1:], True)[: len(begins)])
        after, wall = np.minimum(ends.k + 1, run.steps), np.where(ends.pair, 0, ~ends.j)
        x, to = run.x[after, ends.i], run.x[after, ends.other]
        _, depth = run.geometry(ends.i, ends.j, x, to)
        is_arena = ~ends.pair & (wall < ARENA_COUNT)
        side = dot((run.start + run.end)[wall] / 2 - x, met.n[order[begins]])
        beyond = np.where(is_arena, depth > run.r[ends.i], side <= 0)
        passed = np.where(ends.pair, (depth <= 0) | (ends.k + 1 < run.steps), beyond)
        passed &= ~np.isin(keys_of(ends, run) + 1, resolved, assume_unique=True)
        rows = order[begins][passed]
        c = c.part(begins).part(passed)
        said, balls = nothing_said(len(c.k)), np.stack([c.i, c.other])
        said["cause"], said["law"] = Cause.MISSED, np.where(c.pair, "passed", "through")
        said["value"] = np.abs(run.x[c.k + 1, balls] - run.x[c.k, balls]).max(axis=0)
        self.ledger.enter_islands(Islands.of_contacts(c), t[rows], said)

    def judge_flights(self, *, is_soft: bool) -> None:
        """Enter what the engine's way to fly is wrong by; of soft contacts, the rest of the energy is theirs.

        A ball that rests or rolls does not fly: the contact takes within the step what gravity gave.
        """
        run, habit, dt = self.run, self.habit, self.run.dt[:, None]
        x, v = run.x[:-1] + run.v0 * dt + run.g * dt**2 / 2, run.v0 + run.g * dt
        flies = ~self.carried
        off_x, off_v, turning = flies * np.abs(run.hx - x), flies * np.abs(run.hv - v), run.w[:-1] != 0
        zero, kept = np.zeros_like(x), run.w[:-1] * run.kept
        lifted = run.energies(run.hx - x, zero, zero.real)
        moved = run.energies(zero, run.hv, kept) - run.energies(zero, v, run.w[:-1])
        self.ledger.rightful(self.own, (lifted + moved)[self.carried])
        lifted, moved = lifted * flies, moved * flies
        every = (
            ("speed", habit.speed.cause, off_v * dt > run.floor, 0 * off_x, off_v, moved),
            ("slows spin", self.slows_spin, turning & flies, 0 * off_x, 0 * off_v, moved),
            ("place", habit.place.cause, off_x > run.floor, off_x, 0 * off_v, lifted),
        )
        wrong = [row for row in every if row[1] is not None and row[2].any()]
        rest, gained = float((lifted + moved).sum()), [*pairs((run.m * flies * (run.hv - v)).sum()), 0.0]
        for name, cause, where, x_off, v_off, energy in wrong:
            of_all = rest if len(wrong) == 1 else float(energy.sum())
            k, i = np.argwhere(where)[0]
            law = habit.place if name == "place" else habit.speed
            self.flights[name] = of_flight(run.scene.units, law, run.kept)
            self.ledger.enter(
                *(np.array([part]) for part in (k, i, NO_BODY)), cause=cause, law=name, place="flight",
                times=int(where.sum()), energy=of_all, displacement=x_off.sum(), speed=v_off.sum(),
                momentum=(run.m * v_off).sum(), gained=gained if name == "speed" and cause != Cause.DAMPING else 0.0,
                should=pairs(v[k, i])[None, None], spin_should=run.w[k, i],
            )  # fmt: skip
            rest -= of_all
        self.ledger.rightful(Cause.ROUNDING, rest)
        if is_soft:
            self.ledger.rightful(Cause.SOFT, run.gain(*run.every))

    def doubt_overlaps(self, errors: Errors) -> None:
        """Judge no contact of balls that overlap something when the run begins: no step led them into each other."""
        run = self.run
        deep = self.c.part((self.c.k == 0) & (self.before > ALIKE * float(run.r.min())))  # less comes of three digits
        overlaps = np.isin(np.arange(run.n), deep.ends[1])
        second = np.where((errors["second"] >= 0) & (errors["second"] != NO_BODY), errors["second"], errors["first"])
        doubted = overlaps[errors["first"]] & overlaps[second] & (errors["place"] != "flight")
        errors["cause"][doubted], errors["law"][doubted], errors["place"][doubted] = Cause.UNKNOWN, "overlap", ""

    def close(self, errors: Errors) -> None:
        """Enter what the hand gave, what went into spin, and what is left of the energy."""
        run, sums = self.run, self.ledger.sums
        hand = run.m * (np.abs(run.v0) ** 2 - np.abs(run.v[:-1]) ** 2) / 2
        self.ledger.rightful(Cause.APPLIED, hand, int(np.count_nonzero(hand)))
        sums[0, Cause.SPIN] = (run.moment * (run.w[1:] ** 2 - (run.w[:-1] * run.kept) ** 2)).sum() / 2
        total = run.energies(run.x, run.v, run.w).sum(axis=1)
        entered = sums[0].sum() - sums[0, Cause.SPIN] + errors["energy"].sum()
        rest = total[-1] - total[0] - entered
        is_rounding = abs(rest) <= 1e-9 * np.abs(total).max()
        self.ledger.rightful(Cause.ROUNDING if is_rounding else Cause.UNKNOWN, rest)
