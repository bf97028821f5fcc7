"""Velocities that change without a contact: what such changes have in common, and the sentences on them."""

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from sandbox.judge.causes import NEGLIGIBLE
from sandbox.judge.thresholds import ALIKE
from sandbox.scene.units import Dimension, Units
from sandbox.state import Floats


class Kind(IntEnum):
    """What a change of a velocity leaves as it should be; the likelier first."""

    STOP = 0  # nothing: the ball stands still
    SPEED = 1  # the direction
    ALONG_X = 2  # the component along y
    ALONG_Y = 3
    TURN = 4  # none of these


class Kick(NamedTuple):
    """A change of a velocity without a contact. size, end: px/s, what should be and what is, of what it changes."""

    kind: Kind
    size: float
    end: float


def kick_of(should: Floats, after: Floats) -> Kick:
    """Return what became of a velocity that should be another, (2,) px/s each."""
    speed, end = float(np.hypot(*should)), float(np.hypot(*after))
    if end == 0:
        return Kick(Kind.STOP, speed, end)
    if abs(should[0] * after[1] - should[1] * after[0]) <= NEGLIGIBLE * speed * end and should @ after > 0:
        return Kick(Kind.SPEED, speed, end)
    for kind, axis in ((Kind.ALONG_X, 0), (Kind.ALONG_Y, 1)):
        if abs(should[1 - axis] - after[1 - axis]) <= NEGLIGIBLE * speed:
            return Kick(kind, float(should[axis]), float(after[axis]))
    return Kick(Kind.TURN, speed, end)


def of_kick(units: Units, ball: int, should: Floats, after: Floats, when: str) -> str:
    """Return the sentence on one change of what a flight should make of a velocity. when: in which step."""
    kick = kick_of(should, after)
    due, end = (units.text(Dimension.VELOCITY, "{:.4g}", value) for value in (kick.size, kick.end))
    if kick.kind == Kind.TURN:
        due, end = (units.text(Dimension.VELOCITY, "({:.4g}, {:.4g})", *velocity) for velocity in (should, after))
    what = {Kind.SPEED: "speed", Kind.ALONG_X: "velocity along x", Kind.ALONG_Y: "velocity along y"}
    did = f"The {what.get(kick.kind, 'velocity')} of ball {ball} became {end}"
    if kick.kind == Kind.STOP:
        did = f"Ball {ball} was stopped"
    return f"{did}, where {due} is due, {when}, without a contact."


def of_kicks(units: Units, should: Floats, after: Floats) -> str:
    """Return the sentence on several changes that end alike, empty if they do not. should, after: (k, 2) px/s."""
    kicks = [kick_of(*each) for each in zip(should, after, strict=True)]
    ends, kinds = np.abs([kick.end for kick in kicks]), {kick.kind for kick in kicks}
    of_axes = kinds <= {Kind.ALONG_X, Kind.ALONG_Y}
    if len(kicks) < 2 or np.ptp(ends) > ALIKE * ends.max() or Kind.TURN in kinds or not (len(kinds) == 1 or of_axes):
        return ""
    if kinds == {Kind.STOP}:
        return "Balls are stopped, without a contact."
    end = units.text(Dimension.VELOCITY, "{:.4g}", float(ends.mean()))
    return f"{'Velocities along an axis' if of_axes else 'Speeds'} become {end}, without a contact."
