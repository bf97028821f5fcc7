"""pandas tables of contacts and of ledgers, which are arrays and tuples and so have no such method of their own."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING

import numpy as np

from sandbox.errors import SandboxError, shown
from sandbox.judge.causes import Entry
from sandbox.run.trajectory import Trajectory, data_frame
from sandbox.scripting.comparison import Comparison
from sandbox.state import CONTACT, Contacts

if TYPE_CHECKING:
    import pandas


def to_dataframe(data: Contacts | Sequence[Entry] | Trajectory | Comparison) -> "pandas.DataFrame":
    """Return a pandas table of contacts, of a ledger, or of what has a method `to_dataframe`.

    A contact is a row, with the columns `normal_x` and `normal_y`; so is a line of a ledger, with its cause's key.
    Raises SandboxError if pandas is not installed, or for other data.
    """
    if isinstance(data, Trajectory | Comparison):
        return data.to_dataframe()
    if isinstance(data, np.ndarray) and data.dtype == CONTACT:
        columns = {name: data[name] for name in CONTACT.names or ()}
        normal_x, normal_y = columns.pop("normal").T
        return data_frame(columns | {"normal_x": normal_x, "normal_y": normal_y})
    if isinstance(data, list | tuple) and all(isinstance(entry, Entry) for entry in data):
        return data_frame([asdict(entry) | {"cause": entry.cause.key} for entry in data])
    raise SandboxError(f"only contacts, a ledger, a trajectory or a comparison can be a table, got {shown(data)}")
