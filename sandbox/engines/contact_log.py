"""The contacts that an engine has resolved and not yet returned."""

from typing import NamedTuple

import numpy as np

from sandbox.compiled import kernel
from sandbox.state import CONTACT, Contacts, Integers, no_contacts


class Log(NamedTuple):
    """Contacts in the order in which a kernel resolves them.

    row: (capacity,) CONTACT; filled: (1,), their number so far, which may exceed the capacity; collects: whether
    contacts are recorded at all.
    """

    row: Contacts
    filled: Integers
    collects: bool


def empty_log(rows: int) -> Log:
    """Return a log with room for so many contacts."""
    return Log(np.zeros(rows, CONTACT), np.zeros(1, np.int64), collects=False)


@kernel
def log_contact(
    log: Log,
    time: float,
    first: int,
    second: int,
    nx: float,
    ny: float,
    impulse: float,
    depth: float,
    tangential: float = 0.0,
    slip: float = 0.0,
) -> None:
    """Add a contact, whose fields are those of CONTACT, if contacts are recorded; count it even if there is no room."""
    if not log.collects:
        return
    count = log.filled[0]
    if count < len(log.row):
        row = log.row[count]
        row["time"], row["first"], row["second"], row["impulse"], row["depth"] = time, first, second, impulse, depth
        row["normal"][0], row["normal"][1], row["tangential"], row["slip"] = nx, ny, tangential, slip
    log.filled[0] = count + 1


class ContactLog:
    """Collects contacts. Engines add them only while `recording`, so a run whose contacts are never read is no slower.

    recording: whether contacts are to be added; count: of contacts added since the last `take`.
    """

    def __init__(self) -> None:
        self.recording = False
        self.count = 0
        self._parts: list[Contacts] = []

    def add(self, contacts: Contacts) -> None:
        """Append contacts."""
        self._parts.append(contacts)
        self.count += len(contacts)

    def take(self) -> Contacts:
        """Return the contacts added since the last call."""
        assert self.recording, "record_contacts() must be called before contacts()"
        parts, self._parts = self._parts, []
        self.count = 0
        return np.concatenate(parts) if parts else no_contacts()
