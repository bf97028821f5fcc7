"""The contacts that an engine has resolved and not yet returned."""

import numpy as np

from sandbox.state import Contacts, no_contacts


class ContactLog:
    """Collects contacts from the first `take` on, so that a run whose contacts are never read does not pay for them."""

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
