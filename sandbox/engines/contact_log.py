"""The contacts that an engine has resolved and not yet returned."""

import numpy as np

from sandbox.state import Contacts, no_contacts


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

    def take(self) -> Contacts:
        """Return the contacts added since the last call, and start recording."""
        parts, self._parts = self._parts, []
        self.recording, self.count = True, 0
        return np.concatenate(parts) if parts else no_contacts()
