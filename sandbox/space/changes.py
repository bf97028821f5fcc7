"""What is an error since a version of Pymunk, and what to write instead: the tables of changes.toml."""

import tomllib
from importlib.resources import files
from typing import Final, NamedTuple


class Change(NamedTuple):
    """A row of changes.toml."""

    since: int
    instead: str
    pattern: str = ""


_TABLES: Final = tomllib.loads(files("sandbox.space").joinpath("changes.toml").read_text("utf-8"))
NAMES, CALLS = ({what: Change(**row) for what, row in _TABLES[kind].items()} for kind in ("names", "calls"))
