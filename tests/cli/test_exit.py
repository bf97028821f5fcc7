"""Exit codes and output streams: full, closed, narrow or in another encoding."""

import os
import sys
from pathlib import Path

import pytest
from forked import exit_code_of, forked, main_with, outcome_of

from sandbox.cli.exit import CLOSED_PIPE, exit_codes

pytestmark = pytest.mark.usefixtures("working_folder", "no_display")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
@pytest.mark.parametrize("arguments", [("schema",), ("check", "article"), ("trace", "article", "--engine", "article")])
def test_a_full_standard_output_is_reported_once(arguments: tuple[str, ...]) -> None:
    with Path("/dev/full").open("wb") as full:
        code, message = outcome_of(*arguments, out=full.fileno())
    assert (code, message) == (2, "output: No space left on device\n")


@pytest.mark.parametrize(
    "arguments",
    [
        ("schema",),
        ("check", "article"),
        ("trace", "article", "--engine", "article"),
        ("compare", "oblique", "--json", "-"),
    ],
    ids=lambda arguments: arguments[0],
)
def test_a_closed_pipe_ends_a_command_quietly(arguments: tuple[str, ...]) -> None:
    read, write_end = os.pipe()
    os.close(read)
    assert outcome_of(*arguments, out=write_end) == (CLOSED_PIPE, "")
    os.close(write_end)


def test_errors_are_not_written_to_standard_output_if_standard_error_is_closed() -> None:
    def act() -> None:
        sys.stderr = None  # as Python sets it if it is closed
        main_with("check", "none.toml")()

    with Path("out").open("wb") as out:
        assert exit_code_of(forked(act, out.fileno())) == 2
    assert Path("out").read_bytes() == b""


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_an_error_that_cannot_be_printed_is_still_exit_code_2() -> None:
    with Path("/dev/full").open("wb") as full:
        assert exit_code_of(forked(main_with("check", "none.toml"), error=full.fileno())) == 2


def test_letters_outside_the_terminal_s_encoding_are_replaced(monkeypatch: pytest.MonkeyPatch) -> None:
    def act() -> None:
        sys.stdout.reconfigure(encoding="ascii")  # type: ignore[union-attr]
        with exit_codes():
            print("90°")

    with Path("out").open("wb") as out:
        assert exit_code_of(forked(act, out.fileno())) == 0
    assert Path("out").read_bytes() == b"90?\n"
