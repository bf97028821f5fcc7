"""Ties: contacts at the same time that share a ball, where the velocities after them depend on which is resolved first.

No law says which comes first. A row of touching balls of equal mass and elasticity 1, or a ball in a corner, has
simultaneous contacts too, but their order does not matter: that is no tie.
"""

from typing import Final, NamedTuple

import numpy as np

from sandbox.state import Contacts, Floats

SIMULTANEOUS: Final = 1e-9  # s between contacts at the same time, far above rounding and far below a path's own delays
ORDER_MATTERS: Final = 1e-3  # share of the impulses on a ball by which their sum must differ in another order


class Tie(NamedTuple):
    """Two bodies (balls, or ~walls) that touch a ball at the same time (s)."""

    time: float
    first: int
    second: int
    ball: int


Touches = list[tuple[int, Floats]]  # of a ball, in order: the other body, and the impulse on the ball, kg px/s


def find_tie(contacts: Contacts, renumbered: Contacts, *, together: bool) -> Tie | None:
    """Return the first tie, or None if there are no ties.

    contacts, renumbered: of an engine whose balls have some numbers, and others, in the same step, by time; together:
    whether the engine resolves all contacts of one time together, so that they are in no order.
    """
    time = np.sort(np.concatenate([contacts["time"], renumbered["time"]]))
    later = time[1:][np.diff(time) > SIMULTANEOUS]  # when each group but the first begins
    groups = (np.split(each, np.searchsorted(each["time"], later)) for each in (contacts, renumbered))
    for both in zip(*groups, strict=True):
        mine, theirs = map(_touches, both)
        for ball in dict.fromkeys([*mine, *theirs]):
            if tied := _tied(mine.get(ball, []), theirs.get(ball, []), together=together):
                return Tie(float(np.concatenate(both)["time"].min()), *tied, ball)
    return None


def _touches(contacts: Contacts) -> dict[int, Touches]:
    """Return the contacts of each ball."""
    touches: dict[int, Touches] = {}
    for contact in contacts:
        first, second = int(contact["first"]), int(contact["second"])
        impulse = contact["impulse"] * contact["normal"]
        touches.setdefault(first, []).append((second, -impulse))
        if second >= 0:
            touches.setdefault(second, []).append((first, impulse))
    return touches


def _tied(mine: Touches, theirs: Touches, *, together: bool) -> tuple[int, int] | None:
    """Return two bodies that a ball touches in an order that matters: its impulse in all is another; None if none."""
    sums = [np.sum([impulse for _, impulse in touches], axis=0) for touches in (mine, theirs) if touches]
    scale = max(sum(float(np.hypot(*impulse)) for _, impulse in touches) for touches in (mine, theirs))
    if len(sums) == 2 and float(np.hypot(*(sums[0] - sums[1]))) <= ORDER_MATTERS * scale:
        return None
    others, again = ([body for body, _ in touches] for touches in (mine, theirs))
    if together:
        first, *rest = dict.fromkeys(others or again)
        return (first, rest[0]) if others and rest else None
    return next((pair for pair in zip(others, again, strict=False) if pair[0] != pair[1]), None)
