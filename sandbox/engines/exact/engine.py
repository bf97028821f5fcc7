"""Event-driven hard discs: from impact to impact, with no time step and no error but rounding.

Between impacts a disc flies on a parabola, so the next impact is known in closed form (`impact`). Each disc has one
event: its earliest contact as foreseen when it was last looked at, or the crossing of its cell's edge (`cells`), if
that comes first; the earliest of all is next (`agenda`). Only the discs that an event concerns are moved (delayed
states: B. D. Lubachevsky, J. Comput. Phys. 94 (1991) 255), and a contact foreseen with a disc that has since been
turned by another is noticed when it comes up, by the partner's serial number, and foreseen anew. Why no contact is
missed: of any two discs, the one that was looked at last saw the other as it still flies.

Discs are smooth: no friction. A contact exchanges momentum along the line of centres as it is, whatever rounding did
to the distance. Elasticity is the product of the two factors, with two exceptions that keep a collapse, endless
bounces in finite time, from stopping the clock:

- TC model (S. Luding and S. McNamara, Granular Matter 1 (1998) 113): a contact within CONTACT_TIME of the last contact
  of each of its two is elastic; with a wall, within that of the last two, as a corner has two walls.
- Rest under gravity. A bounce off a face that gravity would end within CONTACT_TIME is not flown: the wall carries the
  disc from then on. It lies still, slides where the wall slopes, or is held where two walls meet, without any events,
  until another disc or a kick moves it or the face ends; of each such step one contact is told. Round an end it slides
  in hops of SLIDE. Discs that lean on each other do it in hops of HOP or so: at 900 px/s² they are 1.1e-4 px high, and
  cost some 1/HOP contacts a second for each pair that touches.
- Rattling. A disc that is shut in by others which press on it has ever more, ever slower contacts. More than RATTLE of
  them within HOP hold it where it is, as if it had no end of mass, for a HOP, or until something hits it faster. So a
  heap costs some RATTLE/HOP contacts a second and disc, however tightly it is packed.

The clock is one double: after t seconds a contact is late or early by up to 1e-16 t, and 1e-16 t v px deep.
"""

import math
from typing import Final

import numpy as np

from sandbox.engines.exact.event_queue import empty_agenda
from sandbox.engines.exact.grid import along_a_curve, cell_at, empty_cells
from sandbox.engines.exact.kernel import HOP, World, advance, begin, kick, look
from sandbox.engines.exact.records import BODY, DISC, EVENT, NONE, aligned
from sandbox.engines.walls import pieces_of
from sandbox.errors import Refused, SandboxError
from sandbox.scene.model import Scene, Vector
from sandbox.state import CONTACT, Contacts, State, no_contacts

MOST_KEPT: Final = 5_000_000  # contacts that nobody has asked for yet: half a GB, and five times that in a comparison


# What comes next


# Contacts


# The loop


class ExactEngine:
    """Hard discs, event by event. `collisions` is how many contacts between balls there have been."""

    def __init__(self, scene: Scene, initial: State) -> None:
        self.check(scene)
        self._rate = scene.rate
        self._steps = 0
        self._world = _world(scene, initial)
        self._disc_of_ball = np.argsort(self._world.event["ball"])
        self._log = np.empty(64, CONTACT)
        self._found: list[Contacts] | None = None
        self._kept = 0  # contacts in it
        self.collisions = 0
        begin(self._world)

    @staticmethod
    def check(scene: Scene) -> None:
        """Refuse friction."""
        if _has_friction(scene):
            raise Refused("exact: friction is not part of smooth hard discs; use --engines pymunk")

    def step(self) -> None:
        """Play the events of one step. Nothing is computed at its end, so the rate changes no event.

        Raises SandboxError where its contacts are collected, and are more than there is room for.
        """
        self._steps += 1
        while self._world.agenda.node[0]["time"] <= self._now:
            count, collisions = advance(self._world, self._now, self._log, self._found is not None)
            self.collisions += collisions
            if self._found is not None:
                self._keep(self._log[:count].copy())
            if count == len(self._log):
                self._log = np.empty(2 * count, CONTACT)
        if self._found is not None and self._world.falls:
            self._keep(self._carried())

    def _keep(self, contacts: Contacts) -> None:
        assert self._found is not None
        self._found.append(contacts)
        self._kept += len(contacts)
        if self._kept > MOST_KEPT:
            raise SandboxError(
                f"exact: more than {MOST_KEPT:,} contacts by {self._now:.4g} s are more than are kept; a shorter run "
                "has fewer, and so have balls that are slower or of masses less far apart"
            )

    def _carried(self) -> Contacts:
        """Return a contact for each wall that carries a ball, with what it has pressed in a step, or since it does."""
        event, body = self._world.event, self._world.body
        taken = self._world.gravity - np.column_stack([body["ax"], body["ay"]])
        pull = np.hypot(*taken.T)
        lying = np.flatnonzero((event["wall"] >= 0) & (pull > 0))
        contacts = np.zeros(len(lying), CONTACT)
        contacts["time"] = self._now
        contacts["first"] = event["ball"][lying]
        contacts["second"] = ~self._world.piece["wall"][event["wall"][lying]]
        contacts["normal"] = taken[lying] / pull[lying, None]
        pressed = np.minimum(1 / self._rate, self._now - body["last"][lying])
        contacts["impulse"] = body["mass"][lying] * pull[lying] * pressed
        return contacts

    @property
    def _now(self) -> float:
        return self._steps / self._rate

    def state(self) -> State:
        """Return a snapshot: every ball flown on to now."""
        position = np.empty((len(self._disc_of_ball), 2))
        velocity = np.empty_like(position)
        look(self._world, self._now, position, velocity)
        return State(self._now, position, velocity)

    def contacts(self) -> Contacts:
        """Return the contacts since the last call."""
        found, self._found, self._kept = self._found, [], 0
        return np.concatenate(found) if found else no_contacts()

    def kick(self, ball: int, dv: Vector) -> None:
        """Add dv (px/s) to a ball's velocity."""
        kick(self._world, self._disc_of_ball[ball], self._now, float(dv[0]), float(dv[1]))


def _world(scene: Scene, initial: State) -> World:
    bodies, n = scene.bodies, len(scene.bodies)
    piece = pieces_of(scene)
    cells = empty_cells(n, 2 * float(bodies.radius.max()), scene.arena.size, piece)
    cell = cell_at(cells, initial.position)
    ball = np.argsort(along_a_curve(cells, cell), kind="stable")
    disc, event, body = aligned(n, DISC), aligned(n, EVENT), aligned(n, BODY)
    disc["x"], disc["y"] = initial.position[ball].T
    disc["vx"], disc["vy"] = initial.velocity[ball].T
    disc["radius"], disc["next"] = bodies.radius[ball], NONE
    event["cell"], event["ball"], event["wall"] = cell[ball], ball, NONE
    body["ax"], body["ay"] = scene.gravity
    body["mass"], body["elasticity"], body["last"] = bodies.mass[ball], bodies.elasticity[ball], -np.inf
    body["met"] = -np.inf
    gravity = (float(scene.gravity[0]), float(scene.gravity[1]))
    agenda, hop = empty_agenda(disc, event), math.hypot(*gravity) * HOP / 2
    return World(disc, event, body, piece, cells, agenda, gravity, gravity != (0, 0), hop)


def _has_friction(scene: Scene) -> bool:
    """Tell whether any two that can touch have friction, which is the product of their factors."""
    rough = np.count_nonzero(scene.bodies.friction)
    walls = (scene.arena.friction, *(wall.friction for wall in scene.walls))
    return bool(rough > 1 or (rough == 1 and max(walls) > 0))
