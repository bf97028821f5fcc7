"""Processes of our own, which answer through a pipe."""

import signal
import sys
import threading
from pathlib import Path
from types import ModuleType

import pytest

from sandbox.processes import ChildProcess, serve, signals_blocked


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


@pytest.mark.skipif(sys.platform == "win32", reason="needs signals for one thread")
@pytest.mark.parametrize("taken_by", [threading.get_ident(), None], ids=["main thread", "another thread"])
def test_a_signal_waits_until_the_end_of_the_block(taken_by: int | None) -> None:
    """Also one that the system gives to another thread of the process: Python's handlers run in the main thread."""
    waiting = threading.Event()
    thread = threading.Thread(target=waiting.wait)
    thread.start()
    done = []
    with pytest.raises(KeyboardInterrupt), signals_blocked(signal.SIGINT):  # noqa: PT012
        signal.pthread_kill(taken_by or thread.ident or 0, signal.SIGINT)
        waiting.wait(0.05)
        done.append("all of it")
    waiting.set()
    thread.join()
    assert done == ["all of it"]
