"""Untrusted text made safe to show: on one line, in a terminal, in a spreadsheet."""

import csv
import io
import json
import unicodedata
from collections.abc import Iterable, Sequence
from typing import Final

FORMULA_STARTS: Final = ("=", "+", "-", "@")  # a cell that starts so may be evaluated by a spreadsheet
JOINERS: Final = "\u200c\u200d"  # invisible, but words of many languages and emoji are spelt with them


def unprintable(letter: str) -> bool:
    """Return whether a letter is an invisible control: a control character, a line end, a mark of text direction.

    A lone surrogate counts too: it stands for a byte of a file's name that is not UTF-8.
    """
    return unicodedata.category(letter) in ("Cc", "Cf", "Cs", "Zl", "Zp") and letter not in JOINERS


def printable(text: str) -> str:
    r"""Replace the unprintable letters of untrusted text, such as a file's name, so that it can be shown on one line.

    >>> printable("\x1b[31mevil.toml") == "\N{REPLACEMENT CHARACTER}[31mevil.toml"
    True
    """
    if text.isprintable():  # the fast way: the window calls this for each line in every frame
        return text
    return "".join("\N{REPLACEMENT CHARACTER}" if unprintable(letter) else letter for letter in text)


def csv_text(lines: Iterable[Sequence[object]]) -> str:
    r"""Return a table as CSV; None is an empty cell, and a list is JSON.

    Text that a spreadsheet might evaluate gets an apostrophe.

    >>> csv_text([["=1+1", -2.0, None, [1.5]]])
    "'=1+1,-2.0,,[1.5]\n"
    """
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(map(_cell, line) for line in lines)
    return text.getvalue()


def _cell(cell: object) -> object:
    if isinstance(cell, str):
        return printable(f"'{cell}" if cell.startswith(FORMULA_STARTS) else cell)
    return json.dumps(cell) if isinstance(cell, list | tuple) else cell


def counted(count: int, noun: str) -> str:
    """Return a count with its noun: 1 ball, 2 balls."""
    return f"{count:,} {noun}" if count == 1 else f"{count:,} {noun}s"
