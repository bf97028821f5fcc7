"""What a pane keeps of the latest steps: where the balls were, and their contacts."""

from collections import deque
from typing import Final

import numpy as np

from sandbox.state import Contacts, Floats, State

MAX_POSITIONS: Final = 90  # kept of a ball
MAX_POSITIONS_OF_ALL: Final = 20_000  # kept of all balls together
MAX_PAUSE: Final = 1.0  # s between two positions of one trail
CONTACT_SECONDS: Final = 0.4  # s of the scene that a contact is kept for
MAX_CONTACTS: Final = 200  # kept at once, the latest


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
        self._kept = np.empty(0, [("time", "f8"), ("point", "f8", (2,)), ("normal", "f8", (2,)), ("impulse", "f8")])

    def add(self, contacts: Contacts, state: State, radius: Floats) -> None:
        """Add an engine's contacts since the last call. state: of the engine now; radius: of its balls, (n,) px."""
        contacts = contacts[contacts["time"] <= state.time][-MAX_CONTACTS:]  # of many, the others are not kept anyway
        if len(contacts):
            self._kept = np.concatenate([self._kept, self._located(contacts, state, radius)])
        time = self._kept["time"]
        self._kept = self._kept[(time > state.time - CONTACT_SECONDS) & (time <= state.time)][-MAX_CONTACTS:]

    def _located(self, contacts: Contacts, state: State, radius: Floats) -> Contacts:
        """Return what is kept of some contacts."""
        new = np.empty(len(contacts), self._kept.dtype)
        first, since = contacts["first"], (state.time - contacts["time"])[:, None]
        centre = state.position[first] - since * state.velocity[first]
        new["point"] = centre + radius[first, None] * contacts["normal"]
        for name in ("time", "normal", "impulse"):
            new[name] = contacts[name]
        return new

    def latest(self) -> Contacts:
        """Return time (s), point (px), normal and impulse (kg px/s) of the contacts kept, oldest first."""
        return self._kept
