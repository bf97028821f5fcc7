"""Text that stays text, whoever wrote it: on a line, in a terminal, in a spreadsheet."""

import csv
import io
import unicodedata
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:  # slow to import
    from rich.console import Console

UNKNOWN_WIDTH: Final = 80  # columns of a terminal that does not say
JOINERS: Final = "\u200c\u200d"  # invisible, but words of many languages and emoji are spelt with them


def unprintable(letter: str) -> bool:
    """Tell whether a letter is not seen but does something: a control, the end of a line, a mark that turns text round.

    So is half of a surrogate pair, which stands for a byte that is no UTF-8 in the name of a file.
    """
    return unicodedata.category(letter) in ("Cc", "Cf", "Cs", "Zl", "Zp") and letter not in JOINERS


def printable(text: str) -> str:
    r"""Return what a stranger may have written, such as a file's name, so that it can be shown anywhere, on one line.

    >>> printable("\x1b[31mevil.toml") == "\N{REPLACEMENT CHARACTER}[31mevil.toml"
    True
    """
    if text.isprintable():  # as almost all is, a window's lines in every frame
        return text
    return "".join("\N{REPLACEMENT CHARACTER}" if unprintable(letter) else letter for letter in text)


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

    terminal = Console(stderr=stderr, highlight=False, markup=False, emoji=False)
    if terminal.width == 0:  # as COLUMNS=0 has it, and Rich would print nothing
        terminal.width = UNKNOWN_WIDTH
    return terminal
