"""Files are written whole or not at all; `-` is standard output. Text stays text in CSV and in the terminal."""

import csv
import io
import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO, TYPE_CHECKING, Final

from sandbox.mistakes import Mistake, printable

if TYPE_CHECKING:  # slow to import
    from rich.console import Console


@contextmanager
def whole_file(path: str | Path) -> Iterator[IO[bytes]]:
    """Open a file to write that takes its place only when all of it is there.

    Raises Mistake where it cannot be written.
    """
    try:
        if str(path) == "-":
            yield sys.stdout.buffer
            sys.stdout.buffer.flush()
        else:
            with _replacing(Path(path)) as file:
                yield file
    except BrokenPipeError:
        raise
    except OSError as error:
        raise Mistake(f"{path}: cannot be written: {error.strerror}") from None


@contextmanager
def _replacing(path: Path) -> Iterator[IO[bytes]]:
    partial = path.with_name(f".{path.name}.{os.getpid()}.partial")
    with partial.open("wb") as file:
        try:
            yield file
            file.close()
            partial.replace(path)
        finally:
            partial.unlink(missing_ok=True)


FORMULA: Final = ("=", "+", "-", "@")  # begin a cell that a spreadsheet runs


def csv_text(lines: Iterable[Sequence[object]]) -> str:
    r"""Return a table as CSV; None is an empty cell. A text that a spreadsheet might run is given an apostrophe.

    >>> csv_text([["=1+1", -2.0, None]])
    "'=1+1,-2.0,\n"
    """
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([_shown_by_a_spreadsheet(cell) for cell in line] for line in lines)
    return text.getvalue()


def _shown_by_a_spreadsheet(cell: object) -> object:
    if not isinstance(cell, str):
        return cell
    return printable(f"'{cell}" if cell.startswith(FORMULA) else cell)


def console(*, stderr: bool = False) -> "Console":
    """Return the terminal for Rich, which is not to take [red] and :smile: in a text for commands."""
    from rich.console import Console  # noqa: PLC0415

    return Console(stderr=stderr, highlight=False, markup=False, emoji=False)
