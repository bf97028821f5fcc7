"""Moments of sessions: made of given speeds, and compared to the bit."""

from collections.abc import Mapping

import numpy as np

from sandbox.run.inputs import Grab, Input, Move, Release
from sandbox.scene.model import Scene
from sandbox.session.history import Moment
from sandbox.session.session import Session
from sandbox.state import State, no_contacts

ENERGY_SCALE = 1800.0  # kg px²/s², of one ball of 1 kg at 60 px/s
THROW: list[Input] = [Grab(step=5, ball=2, at=(600, 300)), Move(step=9, at=(640, 200)), Release(step=14)]


def moment(scene: Scene, step: int, energy_scale: float = ENERGY_SCALE, **velocity: float) -> Moment:
    """Make a moment with an engine for each speed (px/s) of the first ball, which is also its distance from 200 px."""
    states = {
        name: State(step / 60, np.array([[200.0 + speed, 300.0], [600.0, 300.0]]), np.array([[speed, 0.0], [0.0, 0.0]]))
        for name, speed in velocity.items()
    }
    energy = {name: speed**2 / 2 for name, speed in velocity.items()}
    none, zero = dict.fromkeys(velocity, no_contacts()), dict.fromkeys(velocity, 0)
    no = dict.fromkeys(velocity, 0.0)
    return Moment(step, step / 60, scene, states, none, zero, energy, no, (0, 1), None, (0, 0), no, energy_scale)


def run(session: Session, steps: int) -> Session:
    for _ in range(steps):
        session.advance()
    return session


def flat(moment: Moment) -> list[object]:
    """Return everything in a moment, bit for bit, in its order."""
    states = [array.tobytes() for s in moment.states.values() for array in (s.position, s.velocity, s.angle, s.spin)]
    contacts = [contacts.tobytes() for contacts in moment.contacts.values()]
    figures: list[Mapping[str, float]] = [moment.energy, moment.work, moment.counts, moment.wall_impulse]
    return [
        *(list(moment.states), [state.time for state in moment.states.values()], states, contacts),
        *[list(figure.items()) for figure in figures],
        *(moment.step, moment.time, moment.scene.model_dump_json(), moment.balls, moment.held, moment.target),
        *(moment.energy_scale, moment.standing, moment.is_complete),
    ]
