"""Static islands: heaps, or parts of them, that stand still and have no events.

CHECK_RATE times a second of the scene, at its start, and where discs jam, the discs that are slow and lean on each
other are examined. Those that `statics` finds to be carried, and to have no way to give in, are frozen: they do not
move, and at the end of each step their contacts report what they carry. What slow discs give to an island by their hits
goes on to the walls in the same step, as does the momentum that its discs still had when they were frozen. (A contact
that such a hit would open reports a small negative impulse.) An island is woken as a whole by a fast hit, by a kick, or
by hits that it cannot carry.

The forces at rest are exact: those of the walls, and those of single contacts where statics determines them. That a
heap is frozen is an approximation in two respects. Its discs are up to TOUCHING_HOPS heights of a hop apart. And with
friction, discs that roll together as slowly as hops are stopped, though no contact has a couple that could.
"""

import math
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from sandbox.compiled import column
from sandbox.engines.exact.contact import JAMMED_CONTACTS
from sandbox.engines.exact.heaps.statics import Columns, columns_of, equilibrium, loose
from sandbox.engines.exact.heaps.touching import Touching, find_restless
from sandbox.engines.exact.world import STATIC, World, move_to_now, release
from sandbox.engines.grid import NONE
from sandbox.engines.laws import NEVER
from sandbox.state import CONTACT, Bools, Contacts, Floats, Integers, no_contacts

CHECK_RATE: Final = 30  # 1/s, of the scene: examinations, until which a heap that has come to rest still hops
AT_REST: Final = 1e-6  # of gravity, the largest acceleration of a disc at rest; far above what `statics` leaves
MAX_PEELS: Final = 30  # times that discs which give way are left out, before nothing is frozen


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


@dataclass
class Island:
    """A heap that is frozen.

    force: (c, 2) kg px/s², of its contacts along normals and tangents; since: s, when they began to carry it; impulse:
    (c, 2) kg px/s, of hits, not yet reported.
    """

    heap: Heap
    force: Floats
    since: float
    impulse: Floats


class Islands:
    """The static islands of a world. next_check: s, of the next examination; jams_from: s, before which none is due."""

    def __init__(self, world: World) -> None:
        self.world = world
        self.next_check = 1 / CHECK_RATE if world.has_gravity else NEVER
        self.jams_from = -NEVER
        self._islands: list[Island] = []

    def wake(self, disc: int, since: float, now: float) -> tuple[Integers, Contacts]:
        """Wake the island of a disc, if it is part of one; return its discs, and what must be reported."""
        woken = [island for island in self._islands if disc in island.heap.disc]
        if not woken:
            return np.empty(0, np.int64), no_contacts()
        report = self._close(woken, since, now)
        _thaw(self.world, woken[0].heap.disc, now)
        return woken[0].heap.disc, report

    def examine(self, since: float, now: float, *, is_start: bool = False) -> tuple[Integers, Contacts]:
        """Freeze what is at rest, and wake what cannot carry its load.

        Returns the discs whose events must be predicted anew, and what must be reported. since: s, start of the step.
        """
        world = self.world
        resting, touching = find_restless(world, now, is_start=is_start)
        report = self._close([island for island in self._islands if resting[island.heap.disc[0]]], since, now)
        load = np.stack([column(world.absorbed, "load_x"), column(world.absorbed, "load_y")], axis=1) * CHECK_RATE
        carried, force = self._carried(resting, touching, load)
        if np.any(load[carried]):
            carried, force = self._carried(carried, touching, np.zeros_like(load))
        was_frozen = resting & (column(world.event, "carrier") == STATIC)
        frozen = self._open(carried, touching.within(carried), force, now)
        _freeze(world, np.flatnonzero(frozen & ~was_frozen), since, now)
        _thaw(world, np.flatnonzero(was_frozen & ~frozen), now)
        for i in np.flatnonzero(resting):
            world.absorbed[i].load_x = world.absorbed[i].load_y = 0.0
        self.jams_from = now + world.hop_time  # or each contact of a jam would ask for one
        if now >= self.next_check:
            self.next_check = (math.floor(now * CHECK_RATE + 1e-6) + 1) / CHECK_RATE
        return np.flatnonzero(frozen != was_frozen), report

    def report(self, since: float, now: float) -> Contacts:
        """Return what the contacts of islands gave until now, since a time (s)."""
        return np.concatenate([no_contacts(), *(self._report_of(island, since, now) for island in self._islands)])

    def _report_of(self, island: Island, since: float, now: float) -> Contacts:
        self._pass_on(island)
        touching, report = island.heap.touching, np.zeros(len(island.force), CONTACT)
        impulse = island.impulse + (now - max(since, island.since)) * island.force
        island.impulse[:] = 0.0
        ball, wall = column(self.world.event, "ball"), column(self.world.piece, "wall")
        at_wall = touching.second < 0
        report["time"], report["normal"], report["first"] = now, touching.normal, ball[touching.first]
        report["second"][at_wall] = ~wall[~touching.second[at_wall]]
        report["second"][~at_wall] = ball[touching.second[~at_wall]]
        report["impulse"], report["tangential"] = impulse.T
        return report[(impulse != 0).any(axis=1)]

    def _carried(self, resting: Bools, touching: Touching, load: Floats) -> tuple[Bools, Floats]:
        """Return which of the resting discs carry each other and a load besides their weight, and the contacts' forces.

        resting, and those returned: (n,); load: (n, 2) kg px/s²; forces: (c, 2), along normals and tangents. Discs that
        give way are left out, until none of the others does.
        """
        resting, gravity = resting.copy(), math.hypot(*self.world.gravity)
        for _ in range(MAX_PEELS):
            heap = self._heap(resting, touching)
            if not len(heap.disc):
                break
            total = np.zeros_like(heap.mass)
            total[:, :2] = heap.mass[:, :2] * self.world.gravity + load[heap.disc]
            a, force = equilibrium(heap.columns, heap.mass, total)
            gives = np.abs(a).max(axis=1) > AT_REST * gravity
            if not gives.any():
                gives = loose(heap.columns, heap.mass, force)
            if not gives.any():
                return resting, heap.of_contacts(force)
            resting[heap.disc[gives]] = False
        return np.zeros_like(resting), np.empty((0, 2))

    def _heap(self, disc: Bools, touching: Touching) -> Heap:
        """Return some of the discs, (n,), as a heap."""
        world, touching, number = self.world, touching.within(disc), np.flatnonzero(disc)
        x, y = column(world.disc, "x")[number], column(world.disc, "y")[number]
        number = number[np.argsort(y if np.ptp(y) > np.ptp(x) else x, kind="stable")] if len(number) else number
        local = np.full(len(disc), NONE)
        local[number] = np.arange(len(number))
        second = np.where(touching.second < 0, NONE, local[touching.partner])
        columns = columns_of(local[touching.first], second, touching.normal, products(world, touching, "friction"))
        mass = np.repeat(column(world.body, "mass")[number, None], 3 if columns.turn.any() else 2, axis=1)
        mass[:, 2:] /= 2
        return Heap(number, mass, columns, touching)

    def _open(self, carried: Bools, touching: Touching, force: Floats, now: float) -> Bools:
        """Make an island of each group of discs that touch, and return which discs these are, (n,).

        carried: (n,); force: (c, 2), of the contacts.
        """
        group, frozen = touching.groups(len(carried)), carried.copy()
        for number in np.unique(group[carried]).tolist():
            members, body = carried & (group == number), self.world.body[number]
            hops = body.leans_until > now or body.slow_contacts >= JAMMED_CONTACTS
            if members.sum() == 1 and not (hops and self.world.event[number].carrier < 0):
                frozen[number] = False  # walls carry it without events anyway
                continue
            carries = force[group[touching.first] == number]
            self._islands.append(Island(self._heap(members, touching), carries, now, np.zeros_like(carries)))
        return frozen

    def _close(self, closed: list[Island], since: float, now: float) -> Contacts:
        """Remove islands, whose discs stay where they are, and return what they must report."""
        self._islands = [island for island in self._islands if not any(island is gone for gone in closed)]
        return np.concatenate([no_contacts(), *(self._report_of(island, since, now) for island in closed)])

    def _pass_on(self, island: Island) -> None:
        """Pass on what an island was given, through its contacts to the walls; for so short a time, they pull too."""
        heap, absorbed = island.heap, [self.world.absorbed[i] for i in island.heap.disc]
        given = np.array([(momentum.x, momentum.y) for momentum in absorbed])
        if given.any():
            _, impulse = equilibrium(heap.columns, heap.mass[:, :2], given, bilateral=True)
            island.impulse += heap.of_contacts(impulse)
        for momentum in absorbed:
            momentum.x = momentum.y = 0.0


def products(world: World, touching: Touching, name: str) -> Floats:
    """Return the elasticity or the friction of contacts: (c,)."""
    of_disc = column(world.turn if name == "friction" else world.body, name)
    of_piece, at_wall = column(world.piece, name), touching.second < 0
    factor = of_disc[touching.first]
    factor[at_wall] *= of_piece[~touching.second[at_wall]]
    factor[~at_wall] *= of_disc[touching.second[~at_wall]]
    return factor


def _freeze(world: World, discs: Integers, since: float, now: float) -> None:
    """Make discs part of an island, which gets their momentum, and what walls carried of them. since: start of step.

    Their spin is lost: a couple that no contact without area has.
    """
    for i in discs.tolist():
        disc, body, event, turn = world.disc[i], world.body[i], world.event[i], world.turn[i]
        absorbed = world.absorbed[i]
        move_to_now(world, i, now)
        start = max(since, body.last_contact)
        carried_for = now - start if event.carrier != NONE else 0.0
        absorbed.x = body.mass * (disc.vx + carried_for * (world.gravity[0] - body.ax))
        absorbed.y = body.mass * (disc.vy + carried_for * (world.gravity[1] - body.ay))
        disc.vx = disc.vy = body.ax = body.ay = 0.0
        disc.serial += 1
        event.carrier, body.corner = STATIC, NONE
        turn.spin, turn.spin_rate, turn.slips_until = 0.0, 0.0, NEVER


def _thaw(world: World, discs: Integers, now: float) -> None:
    """Let discs of an island fly freely."""
    for i in discs.tolist():
        absorbed = world.absorbed[i]
        absorbed.x = absorbed.y = absorbed.load_x = absorbed.load_y = 0.0
        move_to_now(world, i, now)
        release(world, i)
