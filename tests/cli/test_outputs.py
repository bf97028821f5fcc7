"""What is written is there whole or not at all, whatever ends the program; and the program ends well.

A case runs in a process that is forked from this one, so that it has everything imported.
"""

import json
import os
import pty
import random
import resource
import select
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from types import FrameType
from typing import Any, NoReturn
from warnings import catch_warnings, simplefilter

import numpy as np
import pytest
from conftest import sizes, without_notice
from numba import njit
from pygame import Surface, surfarray

import sandbox.cli.commands as command_line
from sandbox.analysis.comparison import compare
from sandbox.cli.exit import ending
from sandbox.errors import Ended, SandboxError
from sandbox.files import check_outputs, is_file, whole_file
from sandbox.report.comparison import page
from sandbox.run.inputs import Grab, Release, load_inputs, write_inputs
from sandbox.run.trajectory import simulate, write_trace
from sandbox.scene.files import load
from sandbox.scene.files import write as write_scene
from sandbox.scene.spawn import spawn
from sandbox.signals import SIGNALS
from sandbox.sweep import in_order, journal, plan, write
from sandbox.sweep.jobs import run as run_job
from sandbox.sweep.journal import journal_of
from sandbox.view.film import FILMS, Film
from sandbox.view.picture import save_picture

KILLS = sizes(8, slow=833)  # of each writer
OLD = b"the old one"
Write = Callable[[], object]


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)


def forked(act: Callable[[], object], out: int | None = None, error: int | None = None) -> int:
    """Begin an act in a process of its own, with other standard streams; return its id. It exits with 0, or as told."""
    with catch_warnings():
        simplefilter("ignore", DeprecationWarning)  # of threads, which numpy's libraries have
        process = os.fork()
    if process:
        return process
    code = 120  # as Python's own, where a stream cannot be flushed
    try:
        for number, stream in ((1, out), (2, error)):
            if stream is not None:
                os.dup2(stream, number)
        streams = open(1, "w", closefd=False), open(2, "w", buffering=1, closefd=False)  # noqa: SIM115 (until the end)
        sys.stdout, sys.stderr = streams
        signal.signal(signal.SIGINT, signal.default_int_handler)
        try:
            act()
            code = 0
        except SystemExit as end:
            code = int(end.code or 0)
        if sys.stdout:
            sys.stdout.flush()
    except BaseException:
        sys.excepthook(*sys.exc_info())
        sys.stderr.flush()
    finally:
        os._exit(code)


def ended(process: int) -> int:
    """Wait for a process, and return its exit code; of a signal, less its number."""
    return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])


def main_with(*arguments: str) -> Callable[[], None]:
    """Return what runs the command line."""

    def act() -> None:
        sys.argv[1:] = arguments
        command_line.main()

    return act


def done(*arguments: str, out: int | None = None) -> tuple[int, str]:
    """Run a command to its end; return its exit code, and what it says on standard error."""
    with Path("said").open("w+b") as error, Path(os.devnull).open("wb") as nowhere:
        code = ended(forked(main_with(*arguments), nowhere.fileno() if out is None else out, error.fileno()))
        error.seek(0)
        message = without_notice(error.read().decode())
    Path("said").unlink()
    return code, message


# Killed while it writes


def film(path: str) -> None:
    with FILMS[Path(path).suffix](path, (64, 64)) as made:
        for k in range(3):
            surface = Surface((64, 64))
            surface.fill((90 * k, 9, 9))
            made.add(surface)


def text(content: str, path: str) -> None:
    with whole_file(path) as file:
        file.write(content.encode())


def writers() -> Mapping[str, Write]:
    """Return what writes each kind of file, by the file's name."""
    scene = load("article").changed(seconds=0.5)
    run = simulate(scene, "article", steps=20)
    surface = Surface((64, 64))
    sweep = plan(scene, [0, 1], [60], ["article"])
    rows = [run_job(sweep.scene, sweep.against, job) for job in sweep.jobs]
    comparison = compare(scene, ["article"])
    films = [ending for ending in FILMS if ending != ".mp4" or find_spec("av")]
    return (
        {f"trace{ending}": partial(write_trace, run, f"trace{ending}") for ending in (".npz", ".csv", ".xyz")}
        | {f"film{ending}": partial(film, f"film{ending}") for ending in films}
        | {
            "end.png": partial(save_picture, surface, "end.png"),
            "page.html": partial(text, page(comparison), "page.html"),
            "figures.csv": partial(text, comparison.as_csv(), "figures.csv"),
            "scene.toml": partial(write_scene, scene, spawn(scene), "scene.toml"),
            "mouse.jsonl": partial(write_inputs, [Grab(step=1, ball=0, at=(1, 1)), Release(step=9)], "mouse.jsonl"),
            "table.csv": partial(write, sweep, in_order(sweep, rows), "table.csv"),
        }
    )


class Moments:
    """Counts the calls of built-in functions, as those that write are, and may kill the process at one of them."""

    def __init__(self, last: float = np.inf) -> None:
        self.count, self.last = 0, last

    def __call__(self, _frame: FrameType, event: str, _what: Any) -> None:
        if event in ("c_call", "c_return"):
            self.count += 1
            if self.count == self.last:
                os.kill(os.getpid(), signal.SIGKILL)

    def of(self, act: Write) -> None:
        sys.setprofile(self)
        try:
            act()
        finally:
            sys.setprofile(None)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[Write, bytes, int]]:
    """Return for each file what writes it, what is in it then, and how many moments that has."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("made"))
        found = {}
        for name, act in writers().items():
            act()
            moments = Moments()
            moments.of(act)
            found[name] = act, Path(name).read_bytes(), moments.count
        return found


@pytest.mark.parametrize("kills", KILLS)
def test_a_program_that_is_killed_while_it_writes_leaves_the_old_file_or_the_new_one(
    made: dict[str, tuple[Write, bytes, int]], kills: int
) -> None:
    """And what it leaves beside is in nobody's way."""
    rng, left = random.Random(0), 0
    for name, (act, new, count) in made.items():
        for moment in rng.choices(range(1, count), k=kills):
            path = Path(name)
            path.unlink(missing_ok=True)
            old = rng.choice([None, OLD])
            if old:
                path.write_bytes(old)
            code = ended(forked(partial(Moments(moment).of, act)))
            assert code in (-signal.SIGKILL, 0)  # where there is no old file, there is less to do
            whole = (path.read_bytes() if path.exists() else None) in ((old, new) if code else (new,))
            assert whole, f"{name} at {moment} of {count}"  # without showing a megabyte
            partials = [entry for entry in Path().iterdir() if entry != path]
            assert all(entry.match(f".{name}.*.partial") for entry in partials)
            left += len(partials)
            act()
            assert path.read_bytes() == new
            for entry in partials:
                entry.unlink()
        Path(name).unlink()
    assert left > len(made)  # or none was killed while it wrote


@pytest.mark.parametrize("kills", KILLS)
def test_a_sweep_that_is_killed_while_it_keeps_a_row_has_those_before(kills: int) -> None:
    sweep = plan(load("article").changed(seconds=0.1), range(6), [60], ["article"])
    rows = [json.loads(json.dumps(run_job(sweep.scene, sweep.against, job))) for job in sweep.jobs]

    def keep() -> None:
        with journal(sweep, "f.csv") as kept:
            for row in rows:
                kept.add(row)

    moments = Moments()
    moments.of(keep)
    found = set()
    for moment in random.Random(0).choices(range(1, moments.count), k=kills):
        journal_of("f.csv").unlink(missing_ok=True)
        assert ended(forked(partial(Moments(moment).of, keep))) == -signal.SIGKILL
        with journal(sweep, "f.csv") as kept:
            assert kept.rows == rows[: len(kept.rows)]
            found.add(len(kept.rows))
            for row in rows[len(kept.rows) :]:
                kept.add(row)
        with journal(sweep, "f.csv") as kept:
            assert kept.rows == rows
    assert len(found) > 2


def test_a_file_is_on_the_disk_before_its_name_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """A power cut would leave an empty file under the name of the old one."""
    done = []

    def synced(number: int) -> None:
        done.append(os.fstat(number).st_size)
        assert not Path("f.json").exists()

    monkeypatch.setattr(os, "fsync", synced)
    text("content", "f.json")
    assert done == [7]


# No room, no permission


@pytest.mark.parametrize("share", [0.0, 0.6])
def test_no_room_is_told_and_leaves_the_old_file(made: dict[str, tuple[Write, bytes, int]], share: float) -> None:
    for name, (act, new, _) in made.items():
        Path(name).write_bytes(OLD)
        limit = int(share * len(new))

        def write(act: Write = act, name: str = name, limit: int = limit) -> None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
            with pytest.raises(SandboxError, match=f"^{name}: cannot be written: File too large$"):
                act()

        assert ended(forked(write)) == 0, name
        assert Path(name).read_bytes() == OLD
        assert [entry.name for entry in Path().iterdir()] == [name]
        Path(name).unlink()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
@pytest.mark.parametrize("arguments", [("schema",), ("check", "article"), ("trace", "article", "--engine", "article")])
def test_a_standard_output_that_is_full_is_told_once(arguments: tuple[str, ...]) -> None:
    with Path("/dev/full").open("wb") as full:
        code, message = done(*arguments, out=full.fileno())
    assert (code, message.partition(": ")[2]) == (2, "cannot be written: No space left on device\n")


TOLD = {
    "no-folder": ("no/f", "No such file or directory"),
    "file-for-a-folder": ("file/f", "Not a directory"),
    "folder": ("folder", "Is a directory"),
    "name-too-long": ("x" * 300, "File name too long"),
    "link-in-a-circle": ("circle", "Too many levels of symbolic links"),
}
OPTIONS = (
    ("compare", "article", "--json"),
    ("compare", "article", "--csv"),
    ("compare", "article", "--report"),
    ("trace", "article", "--engine", "article", "--out"),
    ("record", "article", "--out"),
    ("sweep", "article", "--out"),
    ("sweep", "article", "--report"),
    ("verify", "--json"),
    ("bench", "--json"),
    ("run", "article", "--save-inputs"),
)


@pytest.mark.parametrize(
    ("arguments", "what"),
    [(OPTIONS[0], what) for what in TOLD] + [(option, "no-folder") for option in OPTIONS[1:]],
    ids=lambda value: value if isinstance(value, str) else f"{value[0]}{value[-1]}",
)
def test_what_cannot_be_written_is_told_before_anything_runs(
    arguments: tuple[str, ...], what: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, why = TOLD[what]
    path += ".html" if arguments[-1] == "--report" else ".gif" if arguments[0] == "record" else ".csv"
    Path("file").touch()
    Path("folder.csv").mkdir()
    Path("circle.csv").symlink_to("circle.csv")
    for place in ("sandbox.scene.load", "sandbox.bench.bench", "sandbox.scene.bundled"):
        monkeypatch.setattr(place, None)  # nothing that runs can do without
    assert done(*arguments, path) == (2, f"{path}: cannot be written: {why}\n")
    assert {entry.name for entry in Path().iterdir()} == {"file", "folder.csv", "circle.csv"}


def twice(x: int) -> int:
    return 2 * x


@pytest.mark.parametrize("what", ["No room", "No folder"])
def test_compiled_engines_that_cannot_be_kept_are_told(what: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """It was numba's traceback, on a full disk and for a user without a home."""
    if what == "No folder":
        monkeypatch.setattr("numba.core.caching.CompileResultCacheImpl._locator_classes", [])
    monkeypatch.setattr("numba.core.config.CACHE_DIR", str(Path.cwd()))

    def act() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
        with ending():
            njit(cache=True)(twice)(1)

    with Path("said").open("wb") as error:
        assert ended(forked(act, error=error.fileno())) == 2
    why = {"No room": "File too large", "No folder": "neither the sandbox's own folder nor the user's can be"}[what]
    expected = f"compiled engines cannot be written: {why}; NUMBA_CACHE_DIR names another folder\n"
    assert without_notice(Path("said").read_text()) == expected


@pytest.mark.parametrize("kind", FILMS.values(), ids=FILMS)
def test_a_film_for_which_there_is_no_room_is_told_once(kind: type[Film]) -> None:
    """Giving it up was a traceback: what was held back could not be written then, either."""
    if kind is FILMS[".mp4"]:
        pytest.importorskip("av")
    noise = np.random.default_rng(0).integers(0, 256, (100, 16, 16, 3))

    def make() -> None:
        surface = Surface((64, 64))
        with kind("film", (64, 64)) as made:
            for patch in noise:  # small frames, so that some are held back when there is no more room
                surface.blit(surfarray.make_surface(patch), (8, 8))
                made.add(surface)

    def act() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, 10_000))
        with pytest.raises(SandboxError, match=r"^film: cannot be written: File too large$"):
            make()

    assert ended(forked(act)) == 0
    assert list(Path().iterdir()) == []


def as_nobody(act: Callable[[], object]) -> int:
    """Run an act as a person who may not do everything, as root may."""

    def other() -> None:
        if os.getuid() == 0:
            os.setuid(65534)
        act()

    return ended(forked(other))


def test_a_folder_or_a_file_that_may_not_be_written_is_told_before_anything_runs() -> None:
    Path("mine.json").write_bytes(OLD)
    Path("mine.json").chmod(0o444)

    def refused(path: str) -> None:
        with pytest.raises(SandboxError, match=f"^{path}: cannot be written: Permission denied$"):
            check_outputs({"--json": path})
        with pytest.raises(SandboxError, match=f"^{path}: cannot be written: Permission denied$"):
            text("new", path)

    folder = Path.cwd()
    folder.chmod(0o777)
    assert as_nobody(partial(refused, "mine.json")) == 0
    folder.chmod(0o555)
    try:
        assert as_nobody(partial(refused, "f.json")) == 0
    finally:
        folder.chmod(0o755)
    assert [entry.name for entry in Path().iterdir()] == ["mine.json"]
    assert Path("mine.json").read_bytes() == OLD


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("compare", "article", "--json", ""), "--json '': must be the name of a file, or - for standard output\n"),
        (("run", "--save-inputs", ""), "--save-inputs '': must be the name of a file, or - for standard output\n"),
        (("sweep", "article", "--out", ""), "--out '': must be the name of a file, or - for standard output\n"),
        (
            ("compare", "article", "--json", "x", "--csv", "./x"),
            "--json x and --csv ./x: each must be a file of its own\n",
        ),
        (("compare", "article", "--json", "x", "--csv", "l"), "--json x and --csv l: each must be a file of its own\n"),
        (("sweep", "article", "--report", "-"), "--out - and --report -: each must be a file of its own\n"),
    ],
    ids=lambda value: "-".join(value) if isinstance(value, tuple) else "",
)
def test_no_name_and_two_outputs_in_one_file_are_mistakes(arguments: tuple[str, ...], message: str) -> None:
    Path("l").symlink_to("x")
    assert done(*arguments) == (2, message)
    assert [entry.name for entry in Path().iterdir()] == ["l"]


@pytest.mark.parametrize(
    "arguments",
    [
        ("compare", "mine.toml", "--json", "./mine.toml"),
        ("compare", "mine.toml", "--inputs", "mouse.jsonl", "--csv", "mouse.jsonl"),
        ("run", "mine.toml", "--save-inputs", "link"),
        ("sweep", "mine.toml", "--out", "mine.toml"),
        ("verify", "mine.toml", "--json", "mine.toml"),
    ],
    ids="-".join,
)
def test_a_scene_is_not_written_over_by_what_is_made_of_it(arguments: tuple[str, ...]) -> None:
    Path("mine.toml").write_text(load("article").source)
    Path("mouse.jsonl").write_text('{"step": 0, "do": "start", "scene": "mine", "seed": 0, "rate": 60}\n')
    Path("link").symlink_to("mine.toml")
    assert done(*arguments) == (2, f"{' '.join(arguments[-2:])}: is what is read here; give another file\n")
    assert Path("mine.toml").read_text() == load("article").source
    assert sorted(entry.name for entry in Path().iterdir()) == ["link", "mine.toml", "mouse.jsonl"]


def test_a_file_that_is_called_as_a_bundled_scene_can_be_written_and_a_mouse_recorded_onto_itself() -> None:
    check_outputs({"--json": "article"}, ["article"])
    Path("mouse.jsonl").write_text('{"step": 0, "do": "start", "scene": "article", "seed": 0, "rate": 60}\n')
    again = ("run", "head-on", "--inputs", "mouse.jsonl", "--save-inputs", "mouse.jsonl")
    assert done(*again)[0] == 0
    assert '"scene":"head-on"' in Path("mouse.jsonl").read_text()


# What is not a plain file


def test_a_link_stays_and_the_file_behind_it_is_replaced_and_keeps_its_mode() -> None:
    Path("folder").mkdir()
    Path("folder/behind").write_bytes(OLD)
    Path("folder/behind").chmod(0o640)
    Path("link").symlink_to("folder/behind")
    Path("new").symlink_to("folder/none-yet")
    for link in ("link", "new"):
        check_outputs({"--json": link})
        text("content", link)
        assert Path(link).is_symlink()
    assert Path("folder/behind").read_text() == Path("folder/none-yet").read_text() == "content"
    assert Path("folder/behind").stat().st_mode & 0o777 == 0o640
    Path("plain").touch()
    assert Path("folder/none-yet").stat().st_mode == Path("plain").stat().st_mode


def test_a_pipe_and_a_device_are_written_to_and_not_replaced() -> None:
    """/dev/stdout was replaced by a file, for every program of the machine."""
    os.mkfifo("pipe")
    Path("null").symlink_to("/dev/null")
    read = []
    reader = threading.Thread(target=lambda: read.append(Path("pipe").read_bytes()))
    reader.start()
    check_outputs({"--json": "pipe", "--csv": "null", "--report": "null"})
    text("content", "pipe")
    text("content", "null")
    reader.join()
    assert read == [b"content"]
    assert Path("pipe").is_fifo()
    assert Path("/dev/null").is_char_device()
    assert not is_file("/dev/null")
    assert sorted(entry.name for entry in Path().iterdir()) == ["null", "pipe"]


def test_dev_stdout_is_standard_output_also_where_that_is_a_file() -> None:
    with Path("out").open("wb") as out:
        assert done("compare", "article", "--seconds", "0.1", "--json", "/dev/stdout", out=out.fileno()) == (0, "")
    with Path("expected").open("wb") as out:
        assert done("compare", "article", "--seconds", "0.1", "--json", "-", out=out.fileno()) == (0, "")
    assert Path("out").read_bytes() == Path("expected").read_bytes() != b""
    trace = ("trace", "article", "--engine", "article", "--steps", "1", "--out", "/dev/stdout")
    with Path("out").open("wb") as out:
        assert done(*trace, out=out.fileno()) == (0, "")
    assert Path("out").read_text().startswith("time,ball,x,y,vx,vy,radius,mass\n0.0,0,")
    assert Path("/dev/stdout").is_symlink()


def test_a_sweep_into_a_pipe_or_a_device_has_no_journal_beside_it() -> None:
    os.mkfifo("pipe")
    Path("null").symlink_to("/dev/null")
    sweep = plan(load("article"), [0], [60], ["article"])
    with journal(sweep, "pipe"), journal(sweep, "null"):
        assert sorted(entry.name for entry in Path().iterdir()) == ["null", "pipe"]
    assert not is_file("/dev/stdout")


@pytest.mark.parametrize("name", ["x" * 255, "\N{SNOWMAN}" * 85, "\N{BEACH WITH UMBRELLA}" * 63])
def test_a_name_may_be_as_long_as_the_system_has_room_for(name: str) -> None:
    check_outputs({"--json": name})
    text("content", name)
    assert [entry.name for entry in Path().iterdir()] == [name]


def test_nobody_can_lay_a_link_where_the_file_is_written_first() -> None:
    """In a folder that others may write to, that would overwrite any file."""
    names = set()
    for _ in range(20):
        with whole_file("f.json") as file:
            names.add(file.name)
            assert os.fstat(file.fileno()).st_nlink == 1
    assert len(names) == 20


# How a program ends


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
def test_a_pipe_that_nobody_reads_ends_it_quietly(arguments: tuple[str, ...]) -> None:
    read, write_end = os.pipe()
    os.close(read)
    assert done(*arguments, out=write_end) == (-signal.SIGPIPE, "")
    os.close(write_end)


def test_with_standard_error_closed_nothing_of_it_is_on_standard_output() -> None:
    def act() -> None:
        sys.stderr = None  # as Python has it where that is closed
        main_with("check", "none.toml")()

    with Path("out").open("wb") as out:
        assert ended(forked(act, out.fileno())) == 2
    assert Path("out").read_bytes() == b""


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_mistake_that_cannot_be_told_is_exit_code_2_all_the_same() -> None:
    with Path("/dev/full").open("wb") as full:
        assert ended(forked(main_with("check", "none.toml"), error=full.fileno())) == 2


def test_a_terminal_that_does_not_know_its_width_is_printed_to(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "0")
    with Path("out").open("wb") as out:
        assert done("compare", "article", "--seconds", "0.1", out=out.fileno()) == (0, "")
    assert "energy left" in Path("out").read_text()
    assert max(map(len, Path("out").read_text().splitlines())) == 80


def test_standard_output_that_is_closed_is_told_where_it_is_needed() -> None:
    def act() -> None:
        sys.stdout = None  # as Python has it where that is closed
        main_with("trace", "article", "--engine", "article", "--steps", "1")()

    with Path("said").open("wb") as error:
        assert ended(forked(act, error=error.fileno())) == 2
    assert Path("said").read_text().endswith("-: cannot be written: it is closed\n")


def test_letters_that_a_terminal_does_not_have_end_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    def act() -> None:
        sys.stdout.reconfigure(encoding="ascii")  # type: ignore[union-attr]
        with ending():
            print("90°")

    with Path("out").open("wb") as out:
        assert ended(forked(act, out.fileno())) == 0
    assert Path("out").read_bytes() == b"90?\n"


@pytest.mark.parametrize("number", SIGNALS)
def test_a_signal_while_a_file_is_written_leaves_the_old_one_and_nothing_else(number: signal.Signals) -> None:
    Path("f.csv").write_bytes(OLD)

    def act() -> None:
        with ending(), whole_file("f.csv") as file:
            file.write(b"half")
            file.flush()
            signal.raise_signal(number)

    with Path(os.devnull).open("wb") as nowhere:
        assert ended(forked(act, nowhere.fileno(), nowhere.fileno())) == -number
    assert Path("f.csv").read_bytes() == OLD
    assert [entry.name for entry in Path().iterdir()] == ["f.csv"]


def test_a_signal_that_is_to_be_ignored_is() -> None:
    def act() -> None:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGHUP, signal.SIG_IGN)
        with ending():
            signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGHUP)

    assert ended(forked(act)) == 0


HIDE, SHOW = b"\x1b[?25l", b"\x1b[?25h"


def until(told: bytes, terminal: int, words: bytes) -> bytes:
    """Read what a program tells a terminal until it says some words, or ends."""
    while words not in told:
        assert select.select([terminal], [], [], 60)[0]
        try:
            told += os.read(terminal, 65536)
        except OSError:  # the other end is closed
            return told
    return told


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
    monkeypatch.setattr(command_line, "PATIENCE", 0)
    monkeypatch.setenv("TERM", "xterm")
    ours, terminal = pty.openpty()
    process = forked(main_with(*arguments), terminal, terminal)
    told = until(b"", ours, HIDE)
    os.kill(process, signal.SIGINT)
    assert ended(process) == -signal.SIGINT
    os.close(terminal)
    told = until(told, ours, b"never")
    os.close(ours)
    assert told.rindex(SHOW) > told.rindex(HIDE)
    assert b"Traceback" not in told
    assert list(Path().iterdir()) == []


def test_a_signal_while_a_bar_begins_waits_until_it_can_be_taken_away() -> None:
    class Bar:
        def start(self) -> None:
            signal.raise_signal(signal.SIGINT)
            print("begun")

        def stop(self) -> None:
            print("gone")

    def act() -> None:
        with ending(), command_line._on_screen(Bar()):  # type: ignore[arg-type]
            print("not reached")

    with Path("out").open("wb") as out:
        assert ended(forked(act, out.fileno())) == -signal.SIGINT
    assert Path("out").read_text() == "begun\ngone\n"


def processes_of(session: int) -> set[int]:
    """Return the processes of a session but its first."""
    found = set()
    for entry in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = entry.read_text().rpartition(")")[2].split()
        except OSError:  # it has ended since
            continue
        if int(fields[3]) == session and fields[0] != "Z":
            found.add(int(entry.parent.name))
    return found - {session}


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc")
def test_ctrl_c_while_a_sweep_s_processes_start_is_told_by_none_of_them_and_ends_all() -> None:
    arguments = ["sweep", "article", "--seeds", "0:50", "--workers", "2", "--out", "f.csv"]
    program = subprocess.Popen(
        [sys.executable, "-m", "sandbox", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
        text=True,
    )
    while len(processes_of(program.pid)) < 3:  # two, and what multiprocessing has beside
        assert program.poll() is None
        time.sleep(0.01)
    os.killpg(program.pid, signal.SIGINT)
    told, _ = program.communicate(timeout=60)
    assert (program.returncode, without_notice(told)) == (-signal.SIGINT, "")
    deadline = time.monotonic() + 30
    while processes_of(program.pid):
        assert time.monotonic() < deadline
        time.sleep(0.01)
    assert [entry.name for entry in Path().iterdir()] == ["f.csv.journal"]


def test_what_a_hand_has_done_is_saved_though_the_window_is_stopped_from_outside(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setattr("sandbox.view.window.has_display", lambda: True)
    grab = Grab(step=0, ball=0, at=(100, 100))

    def run(window: Any) -> NoReturn:
        window.playback.give(grab)
        for _ in range(3):
            window.view.session.advance()
        raise Ended(signal.SIGTERM)

    monkeypatch.setattr("sandbox.view.window.Window.run", run)
    with pytest.raises(Ended):
        command_line.run(scene="article", save_inputs="mouse.jsonl")
    _, given, end = load_inputs(Path("mouse.jsonl"), load("article"))
    assert (given, end.step) == (grab, 3)


def test_a_signal_where_nothing_can_be_raised_ends_it_all_the_same() -> None:
    """Ctrl-C was lost, or was a traceback, where it came while Pymunk's or numba's own code called back or returned."""

    class Last:
        def __del__(self) -> None:
            signal.raise_signal(signal.SIGINT)

    def callback() -> None:
        with ending():
            Last()
            deadline = time.monotonic() + 30
            while time.monotonic() < deadline:
                pass

    def kernel() -> None:
        with ending():
            raise SystemError("returned a result with an exception set") from Ended(signal.SIGINT)

    with Path("said").open("wb") as error:
        for act in (callback, kernel):
            assert ended(forked(act, error=error.fileno())) == -signal.SIGINT
    assert Path("said").read_bytes() == b""
