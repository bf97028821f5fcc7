"""Static islands: heaps, or parts of them, that stand still and have no events.

CHECK_RATE times a second of the scene, at its start, soon after an island was woken and where discs jam, the discs that
are slow and lean on each other are examined. Those that `statics` finds to be carried, and to have no way to give in,
are frozen: they do not move, and at the end of each step their contacts report what they carry. What slow discs give to
an island by their hits goes on to the walls in the same step, as does the momentum that its discs still had when they
were frozen. (A contact that such a hit would open reports a small negative impulse.) An island is woken as a whole by a
fast hit, by a kick, or by hits that it cannot carry.

The forces at rest are exact: those of the walls, and those of single contacts where statics determines them. That a
heap is frozen is an approximation in two respects. Its discs are up to TOUCHING_HOPS heights of a hop apart. And with
friction, discs that roll together as slowly as hops are stopped, though no contact has a couple that could.
"""

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.compiled import entry, kernel
from sandbox.engines.contact_log import Log, log_contact
from sandbox.engines.exact.contact import JAMMED_CONTACTS
from sandbox.engines.exact.prediction import predict
from sandbox.engines.exact.records import ABSORBED, NONE, PLAN, STATIC, SUPPORT
from sandbox.engines.exact.statics import Columns, columns_of, equilibrium, loose, pushed
from sandbox.engines.exact.support import MAX_SUPPORTS
from sandbox.engines.exact.touching import MAX_TOUCHING, Touching, find_restless, groups
from sandbox.engines.exact.world import Rest, World, move_to_now, release
from sandbox.engines.laws import NEVER
from sandbox.state import CONTACT, Bools, Contacts, Floats, Integers, no_contacts

CHECK_RATE: Final = 30  # 1/s, of the scene: examinations, until which a heap that has come to rest still hops
RECHECK_HOPS: Final = 10  # hop times after an island was woken, until discs are examined; more after many
JAM_HOPS: Final = 1  # hop times from an examination of a jam to the next, or each of its contacts would ask for one
AT_REST: Final = 1e-6  # of gravity, the largest acceleration of a disc at rest; far above what `statics` leaves
MAX_PEELS: Final = 30  # times that discs which give way are left out, before nothing is frozen
SMALL_KICK: Final = 1.0  # hop speeds, by which a disc of an island can be kicked between examinations


class Heap(NamedTuple):
    """Discs that touch, as `statics` needs them.

    disc: (n,), sorted along the heap; mass: (n, 2 or 3), by coordinate; columns: of discs as numbered here; touching:
    their contacts, (c,).
    """

    disc: Integers
    mass: Floats
    columns: Columns
    touching: Touching

    def of_contacts(self, force: Floats) -> Floats:
        """Return the forces of the contacts along normals and tangents, (c, 2), from those of the columns."""
        count, contact = len(self.touching.first), self.columns.contact
        along_tangent = np.bincount(contact, self.columns.turn * force, count)
        return np.stack([np.bincount(contact, force, count), along_tangent], axis=1)

    def keys(self) -> Integers:
        """Return a number for each column, (k,), by which it is found in another heap."""
        first, second = (part[self.columns.contact] for part in self.touching[:2])
        return (first << 32) + (second << 1) + (self.columns.turn < 0)


class Island(NamedTuple):
    """A heap that is frozen. support: (c,) SUPPORT, of its contacts; a part of what the event loop reads."""

    heap: Heap
    support: NDArray[np.void]


def no_islands(count: int, has_gravity: bool) -> Rest:
    """Return the data of no islands yet. count: of discs."""
    plan = np.zeros(1, PLAN)
    plan["next_check"], plan["jams_from"] = (1 / CHECK_RATE if has_gravity else np.inf), -np.inf
    plan["collapsing"] = plan["wake_request"] = NONE
    return Rest(plan, np.zeros(count, ABSORBED), np.zeros(MAX_TOUCHING * count if has_gravity else 0, SUPPORT))


@kernel
def max_reports(world: World) -> int:
    """Return how many rows of the log the end of a step can need."""
    return MAX_SUPPORTS * len(world.disc) + len(world.rest.support)


@kernel
def plan_next_check(world: World, now: float) -> None:
    """Plan the first regular examination after now."""
    world.rest.plan[0].next_check = (math.floor(now * CHECK_RATE + 1e-6) + 1) / CHECK_RATE


@kernel
def report_islands(world: World, since: float, now: float, log: Log) -> None:
    """Report what the contacts of islands gave until now, since a time (s)."""
    for k in range(world.rest.plan[0].supports):
        support = world.rest.support[k]
        dt = now - max(since, support.since)
        impulse, tangential = support.impulse + dt * support.force, support.tangential + dt * support.friction
        support.impulse = support.tangential = 0.0
        if impulse != 0 or tangential != 0:
            first, second = np.int64(support.first), np.int64(support.second)
            log_contact(log, now, first, second, support.nx, support.ny, impulse, 0.0, tangential, 0.0)


# What Python calls


@entry
def _freeze(world: World, disc: Integers, since: float, now: float) -> None:
    """Make discs part of an island, which gets their momentum, and what walls carried of them. since: start of step.

    Their spin is lost: a couple that no contact without area has.
    """
    for i in disc:
        d, body, event, absorbed = world.disc[i], world.body[i], world.event[i], world.rest.absorbed[i]
        move_to_now(world, i, now)
        start = max(since, body.last_contact, world.turn[i].reported_until if world.is_rough else since)
        carried_for = now - start if event.carrier != NONE else 0.0
        absorbed.x = body.mass * (d.vx + carried_for * (world.gravity[0] - body.ax))
        absorbed.y = body.mass * (d.vy + carried_for * (world.gravity[1] - body.ay))
        world.rest.plan[0].pending_momentum = 1
        d.vx = d.vy = body.ax = body.ay = 0.0
        d.serial += 1
        event.carrier, body.corner = STATIC, NONE
        if world.is_rough:
            turn = world.turn[i]
            turn.spin, turn.spin_rate, turn.slips_until = 0.0, 0.0, NEVER


@entry
def _thaw(world: World, disc: Integers, now: float) -> None:
    """Let discs of an island fly freely."""
    for i in disc:
        absorbed = world.rest.absorbed[i]
        absorbed.x = absorbed.y = absorbed.load_x = absorbed.load_y = 0.0
        move_to_now(world, i, now)
        release(world, i)


@entry
def _predict_each(world: World, disc: Integers, now: float) -> None:
    """Predict the next event of discs."""
    for i in disc:
        predict(world, i, now)


@entry
def _note_examination(world: World, now: float) -> None:
    """Plan the next examination, and wait before a jam has another one."""
    plan = world.rest.plan[0]
    plan.is_due, plan.jams_from = 0, now + JAM_HOPS * world.hop_time
    if now >= plan.next_check:
        plan_next_check(world, now)


class Islands:
    """The static islands of a world."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._islands: list[Island] = []
        self._wakes = 0  # less one for each regular examination since
        self._last_keys, self._last_force = np.array([NONE]), np.zeros(1)  # of columns, sorted

    def begin_reports(self) -> None:
        """Forget what islands were given while nothing was reported."""
        self._world.rest.support["impulse"] = self._world.rest.support["tangential"] = 0.0
        self._world.rest.absorbed["x"] = self._world.rest.absorbed["y"] = 0.0
        self._world.rest.plan["pending_momentum"] = 0

    def do_planned(self, since: float) -> Contacts:
        """Do what the event loop has planned, and return what must be reported first. since: s, start of the step."""
        plan = self._world.rest.plan[0]
        now = float(plan["time"])
        if plan["is_due"]:
            return self._examine(since, now)
        if plan["wake_request"] != NONE:
            return self.wake(int(plan["wake_request"]), since, now)
        if plan["pending_momentum"]:
            for island in self._islands:
                self._pass_on(island)
            plan["pending_momentum"] = 0
        return no_contacts()

    def absorb(self, disc: int, x: float, y: float) -> bool:
        """Give a kick (px/s) to a disc of an island and return True, unless it is not part of one, or wakes it."""
        absorbed, mass = self._world.rest.absorbed[disc], self._world.body["mass"][disc]
        load = math.hypot(absorbed["load_x"] + mass * x, absorbed["load_y"] + mass * y)
        if self._world.event["carrier"][disc] != STATIC or load > SMALL_KICK * mass * self._world.hop_speed:
            return False
        for key, momentum in (("x", mass * x), ("y", mass * y)):
            absorbed[key] += momentum
            absorbed[f"load_{key}"] += momentum
        self._world.rest.plan["pending_momentum"] = 1
        return True

    def wake(self, disc: int, since: float, now: float) -> Contacts:
        """Wake the island of a disc, if it is part of one, and return what must be reported."""
        plan = self._world.rest.plan[0]
        plan["wake_request"] = NONE
        woken = [island for island in self._islands if disc in island.heap.disc]
        if not woken:
            return no_contacts()
        report = self._close(woken, since, now)
        _thaw(self._world, woken[0].heap.disc, now)
        _predict_each(self._world, woken[0].heap.disc, now)
        plan["next_check"] = min(plan["next_check"], now + RECHECK_HOPS * self._world.hop_time * (1 + self._wakes))
        self._wakes += 1
        return report

    def begin(self) -> None:
        """Freeze what is at rest at the start."""
        if self._world.has_gravity:
            self._examine(0.0, 0.0, is_start=True)

    def _examine(self, since: float, now: float, *, is_start: bool = False) -> Contacts:
        """Freeze what is at rest, and wake what cannot carry its load. Returns what must be reported."""
        world = self._world
        resting, touching = find_restless(world, now, is_start=is_start)
        concerned = [island for island in self._islands if resting[island.heap.disc[0]]]
        report = self._close(concerned, since, now)
        absorbed = world.rest.absorbed
        load = np.stack([absorbed["load_x"], absorbed["load_y"]], axis=1) * CHECK_RATE
        carried, force = self._carried(resting, touching, load)
        if np.any(load[carried]):
            carried, force = self._carried(carried, touching, np.zeros_like(load))
        was_frozen = resting & (world.event["carrier"] == STATIC)
        frozen = self._open(carried, touching.within(carried), force, now)
        _freeze(world, np.flatnonzero(frozen & ~was_frozen), since, now)
        _thaw(world, np.flatnonzero(was_frozen & ~frozen), now)
        _predict_each(world, np.flatnonzero(frozen != was_frozen), now)
        absorbed["load_x"][resting] = absorbed["load_y"][resting] = 0.0
        self._wakes = max(0, self._wakes - (now >= world.rest.plan[0]["next_check"]))
        _note_examination(world, now)
        return report

    def _carried(self, resting: Bools, touching: Touching, load: Floats) -> tuple[Bools, Floats]:
        """Return which of the resting discs carry each other and a load besides their weight, and the contacts' forces.

        resting, and those returned: (n,); load: (n, 2) kg px/s²; forces: (c, 2), along normals and tangents. Discs that
        give way are left out, until none of the others does.
        """
        resting, gravity = resting.copy(), math.hypot(*self._world.gravity)
        for _ in range(MAX_PEELS):
            heap = self._heap(resting, touching)
            if not len(heap.disc):
                break
            a, force = self._solve(heap, load)
            gives = np.abs(a).max(axis=1) > AT_REST * gravity
            if not gives.any():
                gives = loose(heap.columns, heap.mass, force)
            if not gives.any():
                return resting, heap.of_contacts(force)
            resting[heap.disc[gives]] = False
        return np.zeros_like(resting), np.empty((0, 2))

    def _heap(self, disc: Bools, touching: Touching) -> Heap:
        """Return some of the discs, (n,), as a heap."""
        world, touching = self._world, touching.within(disc)
        number = np.flatnonzero(disc)
        x, y = world.disc["x"][number], world.disc["y"][number]
        number = number[np.argsort(y if np.ptp(y) > np.ptp(x) else x, kind="stable")] if len(number) else number
        local = np.full(len(disc), NONE)
        local[number] = np.arange(len(number))
        at_wall = touching.second < 0
        friction = world.turn["friction"][touching.first]
        friction[at_wall] *= world.piece["friction"][~touching.second[at_wall]]
        friction[~at_wall] *= world.turn["friction"][touching.second[~at_wall]]
        second = np.where(at_wall, NONE, local[np.maximum(touching.second, 0)])
        columns = columns_of(local[touching.first], second, touching.normal, friction)
        mass = np.repeat(world.body["mass"][number, None], 3 if friction.any() else 2, axis=1)
        mass[:, 2:] /= 2
        return Heap(number, mass, columns, touching)

    def _solve(self, heap: Heap, load: Floats) -> tuple[Floats, Floats]:
        """Return accelerations and forces of a heap under its weight and a load, (n, 2) kg px/s².

        The search starts from the forces of the last time, which are those of nearly the same heap.
        """
        total = np.zeros_like(heap.mass)
        total[:, :2] = heap.mass[:, :2] * self._world.gravity + load[heap.disc]
        key, bilateral = heap.keys(), np.zeros(len(heap.columns.x), bool)
        last = np.searchsorted(self._last_keys, key, "right") - 1
        start = np.where(self._last_keys[last] == key, self._last_force[last], 0.0)
        a, force = equilibrium(heap.columns, heap.mass, total, start, bilateral)
        order = np.argsort(key)
        self._last_keys, self._last_force = np.append(NONE, key[order]), np.append(0.0, force[order])
        return a, force

    def _open(self, carried: Bools, touching: Touching, force: Floats, now: float) -> Bools:
        """Make an island of each group of discs that touch, and return which discs these are, (n,).

        carried: (n,); force: (c, 2), of the contacts.
        """
        group, frozen, islands = groups(touching, len(carried)), carried.copy(), list(self._islands)
        for number in np.unique(group[carried]):
            members = carried & (group == number)
            body = self._world.body[number]
            hops = body["leans_until"] > now or body["slow_contacts"] >= JAMMED_CONTACTS
            if members.sum() == 1 and not (hops and self._world.event["carrier"][number] < 0):
                frozen[number] = False  # walls carry it without events anyway
                continue
            heap = self._heap(members, touching)
            support = self._supports(heap.touching, force[group[touching.first] == number], now)
            islands.append(Island(heap, support))
        self._keep(islands)
        return frozen

    def _close(self, closed: list[Island], since: float, now: float) -> Contacts:
        """Remove islands, whose discs stay where they are, and return what they must report."""
        for island in closed:
            self._pass_on(island)
        reports = [_report(island.support, since, now) for island in closed]
        self._keep([island for island in self._islands if not any(island is gone for gone in closed)])
        return np.concatenate([no_contacts(), *reports])

    def _pass_on(self, island: Island) -> None:
        """Pass on what an island was given, through its contacts to the walls: pulling only as far as pushing fails."""
        absorbed, heap = self._world.rest.absorbed, island.heap
        given = np.stack([absorbed["x"][heap.disc], absorbed["y"][heap.disc]], axis=1)
        nothing = np.zeros(len(heap.columns.x))
        for pulls in (nothing > 0, nothing == 0):
            if given.any():
                _, impulse = equilibrium(heap.columns, heap.mass[:, :2], given, nothing, pulls)
                along_normal, along_tangent = heap.of_contacts(impulse).T
                island.support["impulse"] += along_normal
                island.support["tangential"] += along_tangent
                given += pushed(heap.columns, impulse, len(given))
        absorbed["x"][heap.disc] = absorbed["y"][heap.disc] = 0.0

    def _supports(self, touching: Touching, force: Floats, now: float) -> NDArray[np.void]:
        """Return contacts, (c,) SUPPORT, with forces, (c, 2), that they carry from now on."""
        world = self._world
        support = np.zeros(len(force), SUPPORT)
        support["first"] = world.event["ball"][touching.first]
        at_wall = touching.second < 0
        support["second"][~at_wall] = world.event["ball"][touching.second[~at_wall]]
        support["second"][at_wall] = ~world.piece["wall"][~touching.second[at_wall]]
        support["nx"], support["ny"] = touching.normal.T
        support["force"], support["friction"] = force.T
        support["since"] = now
        return support

    def _keep(self, islands: list[Island]) -> None:
        """Keep some islands, and write what they carry to where the event loop reads it."""
        rest = self._world.rest
        support = np.concatenate([np.empty(0, SUPPORT), *(island.support for island in islands)])
        rest.support[: len(support)] = support
        rest.plan["supports"] = len(support)
        ends = np.cumsum([len(island.support) for island in islands], dtype=int)
        parts = np.split(rest.support[: len(support)], ends[:-1])
        self._islands = [Island(island.heap, part) for island, part in zip(islands, parts, strict=False)]


def _report(support: NDArray[np.void], since: float, now: float) -> Contacts:
    """Return what contacts have given until now and not reported, as contacts. since: s, start of the step."""
    dt = now - np.maximum(since, support["since"])
    report = np.zeros(len(support), CONTACT)
    for key in ("first", "second"):
        report[key] = support[key]
    report["time"], report["normal"] = now, np.stack([support["nx"], support["ny"]], axis=1)
    report["impulse"] = support["impulse"] + dt * support["force"]
    report["tangential"] = support["tangential"] + dt * support["friction"]
    return report[(report["impulse"] != 0) | (report["tangential"] != 0)]
