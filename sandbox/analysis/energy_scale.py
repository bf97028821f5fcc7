"""The scale of all shares of energy: how much energy counts as 1, without regard to where heights are measured from."""

import math
from typing import Final

import numpy as np

from sandbox.engines.exact.contact import HOP_TIME, MAX_LOAD
from sandbox.judge.thresholds import NEGLIGIBLE
from sandbox.quantity import dot, energy, length
from sandbox.scene.model import Scene
from sandbox.state import Bools, Contacts, Integers, State, States

LONGEST_HOP: Final = MAX_LOAD * HOP_TIME  # s, which discs at rest can be in the air in the exact engine


class EnergyScale:
    """The largest kinetic energy that an engine has reached so far, or what mouse and edits gave it, if that is more.

    Balls at rest under gravity have the scale of a fall through their radius.
    """

    def __init__(self, scene: Scene, start: State) -> None:
        self._scene = scene
        self._largest = float(energy(start, scene.bodies))  # without heights
        self._given = 0.0

    @property
    def value(self) -> float:
        """The scale so far, kg px²/s²; 0 if nothing has moved and nothing pulls."""
        mass, pull = self._scene.bodies.mass, math.hypot(*self._scene.gravity)
        hopping = float(mass.sum()) * (pull * LONGEST_HOP / 2) ** 2 / 2
        fall = float(pull * (mass * self._scene.bodies.radius).sum())
        return max(self._largest if self._largest > hopping else fall, self._given)

    def follow(self, scene: Scene, states: States, contacts: Contacts, before: int) -> None:
        """Enter steps and the contacts in them, by time. before: steps before the first state."""
        self._scene = scene
        if any(scene.gravity):
            at_contacts = _largest_at_contacts(scene, states, contacts, before)
            self._largest = max(self._largest, float(energy(states, scene.bodies).max()), at_contacts)

    def give(self, work: float) -> None:
        """Enter what mouse and edits have given so far, kg px²/s²."""
        self._given = max(self._given, work)


def _largest_at_contacts(scene: Scene, states: States, contacts: Contacts, before: int) -> float:
    """Return the largest kinetic energy just before the first contact of a step, where falling balls are fastest."""
    if not len(contacts):
        return 0.0
    clock = scene.clock
    step_of = np.clip(clock.steps_containing(contacts["time"]) - before, 1, len(states.spin) - 1)
    step, first = np.unique(step_of, return_index=True)
    fallen = np.clip(contacts["time"][first] - clock.times(before + step - 1), 0.0, 1 / clock.rates(before + step))
    falls = ~_carried(states, contacts, step_of)[step - 1]
    gained = fallen[:, None, None] * np.asarray(scene.gravity) * falls[..., None]
    flying = States(*(part[step - 1] for part in states))
    return float(energy(flying._replace(velocity=flying.velocity + gained), scene.bodies).max())


def _carried(states: States, contacts: Contacts, step_of: Integers) -> Bools:
    """Return which balls do not move along the normal of one of their contacts, before and after it: (steps, n)."""
    carried = np.zeros((len(states.spin) - 1, states.spin.shape[1]), bool)
    for key in ("first", "second"):
        of_ball = contacts[key] >= 0
        ball, step, normal = contacts[key][of_ball], step_of[of_ball], contacts["normal"][of_ball]
        before, after = states.velocity[step - 1, ball], states.velocity[step, ball]
        along = np.abs(dot(before, normal)) + np.abs(dot(after, normal))
        still = along <= NEGLIGIBLE * (length(before) + length(after))
        carried[step[still] - 1, ball[still]] = True
    return carried
