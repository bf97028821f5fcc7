"""The contacts that an engine has resolved and not yet returned."""

import numpy as np

from sandbox.compiled import Record, kernel
from sandbox.state import Contacts, no_contacts


@kernel
def write_row(
    row: Record,
    time: float,
    first: int,
    second: int,
    nx: float,
    ny: float,
    impulse: float,
    depth: float,
    tangential: float,
    slip: float,
) -> None:
    """Write a contact, whose fields are those of CONTACT, into a row."""
    row["time"], row["first"], row["second"], row["impulse"], row["depth"] = time, first, second, impulse, depth
    row["normal"][0], row["normal"][1], row["tangential"], row["slip"] = nx, ny, tangential, slip


class ContactLog:
    """Collects contacts. Engines add them only while `recording`, so a run whose contacts are never read is no slower.

    recording: whether `take` was ever called; count: contacts added since the last `take`.
    """

    def __init__(self) -> None:
        self.recording = False
        self.count = 0
        self._parts: list[Contacts] = []

    def add(self, contacts: Contacts) -> None:
        """Append contacts."""
        self._parts.append(contacts)
        self.count += len(contacts)

    def time_of(self, number: int) -> float:
        """Return the time (s) of a contact since the last `take`, by its number in order of time."""
        times = np.concatenate([part["time"] for part in self._parts])
        return float(np.partition(times, number)[number])

    def take(self) -> Contacts:
        """Return the contacts added since the last call, and start recording."""
        parts, self._parts = self._parts, []
        self.recording, self.count = True, 0
        return np.concatenate(parts) if parts else no_contacts()
