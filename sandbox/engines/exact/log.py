"""The log of contacts that the event loop fills."""

from typing import NamedTuple

from sandbox.compiled import kernel
from sandbox.engines.contact_log import write_row
from sandbox.state import Contacts, Integers


class Log(NamedTuple):
    """Contacts in the order in which they are resolved.

    row: (capacity,) CONTACT; filled: (1,), the number of rows so far; collects: whether contacts are recorded at all.
    """

    row: Contacts
    filled: Integers
    collects: bool


@kernel
def write(
    log: Log,
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
    """Add a contact, whose fields are those of CONTACT, if contacts are recorded."""
    if log.collects:
        write_row(log.row[log.filled[0]], time, first, second, nx, ny, impulse, depth, tangential, slip)
        log.filled[0] += 1
