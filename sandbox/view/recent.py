"""What a pane keeps of the latest steps: where the balls were, and their contacts."""

import math
from collections import deque
from typing import Final

import numpy as np

from sandbox.state import Contacts, Floats, State

MAX_POSITIONS: Final = 90  # kept of a ball
MAX_POSITIONS_OF_ALL: Final = 20_000  # kept of all balls together
MAX_PAUSE: Final = 1.0  # s between two positions of one trail
CONTACT_SECONDS: Final = 0.4  # s of the scene that a contact is kept for
MAX_CONTACTS: Final = 200  # kept at once, the latest
LOCATED: Final = np.dtype([("time", "f8"), ("point", "f8", (2,)), ("normal", "f8", (2,)), ("impulse", "f8")])


class Trail:
    """Where an engine's balls were at the steps shown, in bounded memory."""

    def __init__(self, balls: int) -> None:
        kept = max(2, min(MAX_POSITIONS, MAX_POSITIONS_OF_ALL // balls))
        self._positions: deque[tuple[float, Floats]] = deque(maxlen=kept)

    def add(self, state: State) -> None:
        """Add all balls' positions. Later ones are dropped if time has gone back, and all after a long pause."""
        while self._positions and self._positions[-1][0] >= state.time:
            self._positions.pop()
        if self._positions and state.time - self._positions[-1][0] > MAX_PAUSE:
            self._positions.clear()
        self._positions.append((state.time, state.position))

    def positions(self) -> Floats:
        """Return the positions kept, oldest first: (positions, n, 2) px."""
        return np.array([position for _, position in self._positions])


class RecentContacts:
    """An engine's latest contacts, with their positions.

    Engines do not report positions. A contact is put on the rim of its first ball, which is followed back to the time
    of the contact at its velocity since then.
    """

    def __init__(self) -> None:
        self._kept = deque[Contacts](maxlen=MAX_CONTACTS)  # those of each step that had some, oldest first
        self._time = -math.inf  # s, of the last call

    def add(self, contacts: Contacts, state: State, radius: Floats) -> None:
        """Add an engine's contacts since the last call. Later ones are dropped if time has gone back.

        state: of the engine now; radius: of its balls, (n,) px.
        """
        self._time, kept = state.time, self._kept
        while kept and kept[-1]["time"][-1] > state.time:
            kept.pop()
        if len(contacts):
            kept.append(_located(contacts[-MAX_CONTACTS:], state, radius))  # of many, the others are not kept anyway
        while kept and kept[0]["time"][-1] <= state.time - CONTACT_SECONDS:
            kept.popleft()

    def latest(self) -> Contacts:
        """Return time (s), point (px), normal and impulse (kg px/s) of the contacts kept, oldest first."""
        kept = np.concatenate([np.empty(0, LOCATED), *self._kept])
        return kept[kept["time"] > self._time - CONTACT_SECONDS][-MAX_CONTACTS:]


def _located(contacts: Contacts, state: State, radius: Floats) -> Contacts:
    """Return what is kept of some contacts."""
    new = np.empty(len(contacts), LOCATED)
    first, since = contacts["first"], (state.time - contacts["time"])[:, None]
    centre = state.position[first] - since * state.velocity[first]
    new["point"] = centre + radius[first, None] * contacts["normal"]
    for name in ("time", "normal", "impulse"):
        new[name] = contacts[name]
    return new
