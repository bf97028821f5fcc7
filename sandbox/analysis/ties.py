"""Ties: contacts at the same time that share a ball, where the velocities after them depend on which is resolved first.

No law says which comes first. A row of touching balls of equal mass and elasticity 1, or a ball in a corner, has
simultaneous contacts too, but their order does not matter: that is no tie.
"""

from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np

from sandbox.state import Contacts, Floats

SIMULTANEOUS: Final = 1e-9  # s between contacts at the same time; rounding makes less, even at 1 px/s
ORDER_MATTERS: Final = 1e-3  # share of the impulses on a ball by which their sum must differ in another order


class Tie(NamedTuple):
    """Two bodies (balls, or ~walls) that touch a third at the same time (s)."""

    time: float
    first: int
    second: int


def find_tie(contacts: Contacts, otherwise: Contacts) -> Tie | None:
    """Return the first tie among an engine's contacts, None if they have none.

    contacts, otherwise: of the same steps, by time, with the balls numbered one way and another.
    """
    for group in _simultaneous(contacts):
        time = group["time"]
        near = np.abs(otherwise["time"] - (time[0] + time[-1]) / 2) <= SIMULTANEOUS + (time[-1] - time[0]) / 2
        one, other = _of_balls(group), _of_balls(otherwise[near])
        matters = [ball for ball in one if _sums_differ(one[ball], other.get(ball, []))]
        for ball in matters:
            if tied := _first_tied(one[ball], other.get(ball, [])):
                return Tie(float(time[0]), *tied)
    return None


class _Touch(NamedTuple):
    """A contact as one of its balls has it. impulse: kg px/s on the ball."""

    other: int
    impulse: Floats


def _simultaneous(contacts: Contacts) -> Iterator[Contacts]:
    """Yield the groups of more than one contact at the same time."""
    bounds = np.flatnonzero(np.diff(contacts["time"]) > SIMULTANEOUS) + 1
    yield from (group for group in np.split(contacts, bounds) if len(group) > 1)


def _of_balls(contacts: Contacts) -> dict[int, list[_Touch]]:
    """Return the contacts of each ball, in order."""
    found: dict[int, list[_Touch]] = {}
    for contact in contacts:
        first, second = int(contact["first"]), int(contact["second"])
        impulse = contact["impulse"] * contact["normal"]
        found.setdefault(first, []).append(_Touch(second, -impulse))
        if second >= 0:
            found.setdefault(second, []).append(_Touch(first, impulse))
    return found


def _sums_differ(one: list[_Touch], other: list[_Touch]) -> bool:
    """Return whether a ball gets another impulse in all."""
    difference = sum((touch.impulse for touch in one), np.zeros(2)) - sum((t.impulse for t in other), np.zeros(2))
    scale = max(sum(float(np.hypot(*touch.impulse)) for touch in touches) for touches in (one, other))
    return float(np.hypot(*difference)) > ORDER_MATTERS * scale


def _first_tied(one: list[_Touch], other: list[_Touch]) -> tuple[int, int] | None:
    """Return the first two bodies that a ball touches in another order; if there are none, the first two it touches."""
    for mine, theirs in zip(one, other, strict=False):
        if mine.other != theirs.other:
            return mine.other, theirs.other
    others = list(dict.fromkeys(touch.other for touch in one))
    return (others[0], others[1]) if len(others) > 1 else None
