"""Moments of sessions: made of given speeds, and compared to the bit."""

import numpy as np
from conftest import ball_at

from sandbox.run.inputs import Grab, Input, Move, Release
from sandbox.scene.model import Scene
from sandbox.session.history import Moment, Reading
from sandbox.session.samples import Samples
from sandbox.session.session import Session
from sandbox.state import State

# They meet each other and the walls within a second.
THREE_BALLS = (ball_at(200, 300, 240), ball_at(260, 310, mass=3), ball_at(600, 100, 70, -510, 10, elasticity=0.5))
THROW: list[Input] = [Grab(step=5, ball=2, at=(600, 300)), Move(step=9, at=(640, 200)), Release(step=14)]


def moment(scene: Scene, step: int, **velocity: float) -> Moment:
    """Make a moment with an engine for each speed (px/s) of the first ball, which is also its distance from 200 px."""

    def reading(speed: float) -> Reading:
        position, moving = np.array([[200.0 + speed, 300.0], [600.0, 300.0]]), np.array([[speed, 0.0], [0.0, 0.0]])
        return Reading(State(step / 60, position, moving), speed**2 / 2, 0.0)

    engines = {name: reading(speed) for name, speed in velocity.items()}
    return Moment(step, step / 60, scene, engines, (0, 1), None, (0, 0))


def sample(samples: Samples, scene: Scene, step: int, **velocity: float) -> None:
    """Add such a moment to samples, and complete it."""
    samples.add(moment(scene, step, **velocity))
    samples.complete(moment(scene, step, **velocity))


def run(session: Session, steps: int) -> Session:
    for _ in range(steps):
        session.advance()
    return session


def perform(session: Session, inputs: list[Input], until: int) -> None:
    """Give each input at its step, as a user does."""
    for given in inputs:
        run(session, given.step - session.step)
        session.give(given)
    run(session, until - session.step)


def flat(moment: Moment) -> list[object]:
    """Return everything in a moment, bit for bit, in its order."""
    engines = [
        (name, state.time, [array.tobytes() for array in (state.position, state.velocity, state.angle, state.spin)])
        for name, state in moment.states.items()
    ]
    figures = [reading[1:] for reading in moment.engines.values()]
    return [
        *(engines, figures, moment.step, moment.time, moment.scene.model_dump_json(), moment.balls, moment.held),
        *(moment.target, moment.suspended, moment.is_complete),
    ]
