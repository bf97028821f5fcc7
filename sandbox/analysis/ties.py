"""Ties: contacts at the same time that share a ball, where the velocities after them depend on which is resolved first.

No law says which comes first. A row of touching balls of equal mass and elasticity 1, or a ball in a corner, has
simultaneous contacts too, but their order does not matter: that is no tie.
"""

from collections.abc import Iterator
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


class _Touch(NamedTuple):
    """A contact as one of its balls has it. impulse: kg px/s on the ball."""

    other: int
    impulse: Floats


def find_tie(contacts: Contacts, renumbered: Contacts, *, together: bool) -> Tie | None:
    """Return the first tie, or None if there are no ties.

    contacts, renumbered: of an engine whose balls have some numbers, and others, in the same step, by time; together:
    whether the engine resolves all contacts of one time together, so that they are in no order.
    """
    for group, again in _simultaneous(contacts, renumbered):
        touches, touches_again = _touches(group), _touches(again)
        for ball in dict.fromkeys([*touches, *touches_again]):
            mine, theirs = touches.get(ball, []), touches_again.get(ball, [])
            if _sums_differ(mine, theirs) and (tied := _first_two(mine) if together else _reordered(mine, theirs)):
                return Tie(float(min(*group["time"], *again["time"])), *tied, ball)
    return None


def _simultaneous(contacts: Contacts, renumbered: Contacts) -> Iterator[tuple[Contacts, Contacts]]:
    """Yield the contacts of each time, of both."""
    time = np.sort(np.concatenate([contacts["time"], renumbered["time"]]))
    later = time[1:][np.diff(time) > SIMULTANEOUS]  # when each group but the first begins
    groups, again = (np.split(listed, np.searchsorted(listed["time"], later)) for listed in (contacts, renumbered))
    yield from zip(groups, again, strict=True)


def _touches(contacts: Contacts) -> dict[int, list[_Touch]]:
    """Return the contacts of each ball, in order."""
    touches: dict[int, list[_Touch]] = {}
    for contact in contacts:
        first, second = int(contact["first"]), int(contact["second"])
        impulse = contact["impulse"] * contact["normal"]
        touches.setdefault(first, []).append(_Touch(second, -impulse))
        if second >= 0:
            touches.setdefault(second, []).append(_Touch(first, impulse))
    return touches


def _sums_differ(mine: list[_Touch], theirs: list[_Touch]) -> bool:
    """Return whether a ball gets another impulse in all."""
    sums = [np.sum([touch.impulse for touch in touches], axis=0) for touches in (mine, theirs) if touches]
    scale = max(sum(float(np.hypot(*touch.impulse)) for touch in touches) for touches in (mine, theirs))
    return float(np.hypot(*(sums[0] - sums[-1]))) > ORDER_MATTERS * scale or len(sums) == 1


def _reordered(mine: list[_Touch], theirs: list[_Touch]) -> tuple[int, int] | None:
    """Return the first two bodies that a ball touches in another order, None if the order is the same."""
    others = ((one.other, other.other) for one, other in zip(mine, theirs, strict=False))
    return next((pair for pair in others if pair[0] != pair[1]), None)


def _first_two(touches: list[_Touch]) -> tuple[int, int] | None:
    """Return the first two bodies that a ball touches, None if there is only one."""
    others = list(dict.fromkeys(touch.other for touch in touches))
    return (others[0], others[1]) if len(others) > 1 else None
