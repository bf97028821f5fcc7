"""A signal ends a command as a shell expects, and leaves nothing half done."""

import os
import pty
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path

import pytest
from conftest import sample
from forked import exit_code_of, forked

from sandbox.cli import commands
from sandbox.cli.exit import CTRL_C, exit_codes
from sandbox.files import whole_file
from sandbox.run.inputs import Grab, load_inputs
from sandbox.scene.files import load
from sandbox.sweeps import plan
from sandbox.sweeps.workers import run_here
from sandbox.view.window import Window

pytestmark = pytest.mark.usefixtures("working_folder", "no_display")


@pytest.fixture(autouse=True)
def _no_ignored_signals() -> Iterator[None]:
    """Restore signals that nohup or a shell's background ignores: the programs started here would ignore them too."""
    ignored = [each for each in (signal.SIGINT, signal.SIGTERM) if signal.getsignal(each) == signal.SIG_IGN]
    for each in ignored:
        signal.signal(each, signal.SIG_DFL)
    yield
    for each in ignored:
        signal.signal(each, signal.SIG_IGN)


def test_ctrl_c_during_a_write_leaves_the_old_file_and_nothing_else() -> None:
    Path("f.csv").write_text("old")

    def act() -> None:
        with exit_codes(), whole_file("f.csv") as file:
            file.write(b"half")
            file.flush()
            signal.raise_signal(signal.SIGINT)

    with Path(os.devnull).open("wb") as nowhere:
        assert exit_code_of(forked(act, nowhere.fileno(), nowhere.fileno())) == CTRL_C
    assert Path("f.csv").read_text() == "old"
    assert [entry.name for entry in Path().iterdir()] == ["f.csv"]


HIDE, SHOW = b"\x1b[?25l", b"\x1b[?25h"


def read_until(words: bytes, terminal: int, output: bytes = b"") -> bytes:
    """Read a terminal until some words appear, or its program ends."""
    while words not in output:
        assert select.select([terminal], [], [], 60)[0]
        try:
            output += os.read(terminal, 65536)
        except OSError:  # the other end is closed
            return output
    return output


@pytest.mark.parametrize(
    "arguments",
    [
        ("compare", "article", "--seconds", "600", "--json", "f.json"),
        ("record", "article", "--seconds", "600", "--size", "64x64", "--out", "f.gif"),
    ],
    ids=lambda arguments: arguments[0],
)
def test_ctrl_c_leaves_no_bar_no_hidden_cursor_and_no_file(
    arguments: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TERM", "xterm")
    ours, terminal = pty.openpty()
    listens = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)  # also where a shell in the background does not
    command = [sys.executable, "-m", "sandbox", *arguments]
    process = subprocess.Popen(command, stdin=terminal, stdout=terminal, stderr=terminal, preexec_fn=listens)  # noqa: PLW1509
    output = read_until(HIDE, ours)
    time.sleep(0.5)  # until rich has begun to draw
    process.send_signal(signal.SIGINT)
    assert process.wait(60) == CTRL_C
    os.close(terminal)
    output = read_until(b"never", ours, output)
    os.close(ours)
    assert output.rindex(SHOW) > output.rindex(HIDE)
    assert b"Traceback" not in output
    assert list(Path().iterdir()) == []


def processes_of(session: int) -> set[int]:
    """Return the processes of a session except its leader."""
    found = set()
    for entry in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = entry.read_text().rpartition(")")[2].split()
        except OSError:  # it has ended since
            continue
        if int(fields[3]) == session and fields[0] != "Z":
            found.add(int(entry.parent.name))
    return found - {session}


@pytest.fixture
def sweeping() -> Iterator[subprocess.Popen[str]]:
    """Start a sweep in a session of its own, until its workers have started; check at the end that all have ended."""
    if not Path("/proc/self/stat").exists():
        pytest.skip("needs /proc")
    one = plan(load("article"), [0], [60], ["pymunk", "article"])
    list(run_here(one, one.jobs))  # a worker that compiles ends only after that
    arguments = ["sweep", "article", "--seeds", "0:50", "--workers", "2", "--out", "f.csv"]
    program = subprocess.Popen(
        [sys.executable, "-m", "sandbox", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
        text=True,
    )
    while len(processes_of(program.pid)) < 3:  # two workers, and multiprocessing's resource tracker
        assert program.poll() is None
        time.sleep(0.01)
    yield program
    deadline = time.monotonic() + 30
    while processes_of(program.pid):
        assert time.monotonic() < deadline
        time.sleep(0.01)
    assert [entry.name for entry in Path().iterdir()] in ([], ["f.csv"])  # which has the rows that finished


def test_ctrl_c_while_the_workers_of_a_sweep_start_ends_all_of_them_silently(sweeping: subprocess.Popen[str]) -> None:
    os.killpg(sweeping.pid, signal.SIGINT)
    output, _ = sweeping.communicate(timeout=60)
    assert (sweeping.returncode, output) == (CTRL_C, "")


@pytest.mark.parametrize("number", sample([signal.SIGKILL, signal.SIGTERM], 2))
def test_workers_end_when_their_sweep_is_killed(sweeping: subprocess.Popen[str], number: signal.Signals) -> None:
    sweeping.send_signal(number)
    sweeping.communicate(timeout=60)
    assert sweeping.returncode == -number


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_mouse_input_is_saved_when_a_signal_ends_the_window(number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setattr("sandbox.view.display.has_display", lambda: True)
    grab, frame = Grab(step=0, ball=0, at=(100, 100)), Window.frame

    def first_frame(window: Window, _seconds: float) -> None:
        monkeypatch.setattr(Window, "frame", frame)
        window.playback.give(grab)
        for _ in range(3):
            window.view.session.advance()
        window.playback.paused = True
        signal.raise_signal(number)

    monkeypatch.setattr(Window, "frame", first_frame)
    with suppress(KeyboardInterrupt):
        commands.run(scene="article", save_inputs="mouse.jsonl")
    _, given, end = load_inputs(Path("mouse.jsonl"), load("article"))
    assert (given, end.step) == (grab, 3)
