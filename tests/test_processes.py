"""Processes of our own, which answer through a pipe."""

import sys
from pathlib import Path
from types import ModuleType

import pytest

from sandbox.processes import ChildProcess, serve


def test_a_process_does_not_run_the_main_program(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    program = tmp_path / "program.py"  # such as one on trial, that does not ask for its __name__
    program.write_text("print('runs once more', flush=True)\n")
    main = ModuleType("__main__")
    main.__file__ = str(program)
    monkeypatch.setitem(sys.modules, "__main__", main)
    process = ChildProcess(serve, len)
    try:
        process.send("three")
        assert process.receive() == len("three")
    finally:
        process.stop()
    assert sys.modules["__main__"] is main
    assert capfd.readouterr() == ("", "")
