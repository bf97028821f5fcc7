"""Outputs are written whole or not at all, whatever ends the program, and checked before anything runs."""

import os
import resource
import threading
from collections.abc import Callable, Mapping
from functools import partial
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from forked import exit_code_of, forked, outcome_of, write_text
from pygame import Surface, surfarray

from sandbox.analysis.comparison import compare
from sandbox.cli.outputs import check_outputs
from sandbox.errors import SandboxError
from sandbox.files import whole_file
from sandbox.report.comparison_page import page
from sandbox.report.trajectory import simulate
from sandbox.run.inputs import Grab, Release, write_inputs
from sandbox.scene.files import dump, load
from sandbox.scene.spawn import spawn
from sandbox.sweeps import as_csv, plan
from sandbox.sweeps.workers import run_here
from sandbox.view.offscreen import save_picture
from sandbox.view.video import VIDEO_FORMATS, Video

OLD = b"the old one"
Write = Callable[[], object]


pytestmark = pytest.mark.usefixtures("working_folder", "no_display")


def write_video(path: str) -> None:
    with VIDEO_FORMATS[Path(path).suffix](path, (64, 64)) as made:
        for k in range(3):
            surface = Surface((64, 64))
            surface.fill((90 * k, 9, 9))
            made.add(surface)


def writers() -> Mapping[str, Write]:
    """Return functions that write each kind of file, by the name of the file."""
    scene = load("article").changed(seconds=0.5)
    run = simulate(scene, "article", steps=20)
    surface = Surface((64, 64))
    sweep = plan(scene, [0, 1], [60], ["article"])
    rows = [result.row for result in run_here(sweep, sweep.jobs) if result.row]
    comparison = compare(scene, ["article"])
    videos = [ending for ending in VIDEO_FORMATS if ending != ".mp4" or find_spec("av")]
    return (
        {f"trace{ending}": partial(run.save, f"trace{ending}") for ending in (".npz", ".csv")}
        | {f"video{ending}": partial(write_video, f"video{ending}") for ending in videos}
        | {
            "end.png": partial(save_picture, surface, "end.png"),
            "page.html": partial(write_text, page(comparison), "page.html"),
            "figures.csv": partial(write_text, comparison.as_csv(), "figures.csv"),
            "scene.toml": partial(dump, scene, "scene.toml", spawn(scene)),
            "mouse.jsonl": partial(write_inputs, [Grab(step=1, ball=0, at=(1, 1)), Release(step=9)], "mouse.jsonl"),
            "table.csv": partial(write_text, as_csv(rows), "table.csv"),
        }
    )


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[Write, bytes]]:
    """Write each file once; return what writes it, and its content."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("made"))
        found = {}
        for name, act in writers().items():
            act()
            found[name] = act, Path(name).read_bytes()
        return found


def test_a_file_is_synced_before_it_is_renamed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Otherwise a power failure could leave an empty file under the old one's name."""
    done = []

    def synced(number: int) -> None:
        done.append(os.fstat(number).st_size)
        assert not Path("f.json").exists()

    monkeypatch.setattr(os, "fsync", synced)
    write_text("content", "f.json")
    assert done == [7]


# No room, no permission


@pytest.mark.parametrize("share", [0.0, 0.6])
def test_a_full_disk_is_reported_and_leaves_the_old_file(made: dict[str, tuple[Write, bytes]], share: float) -> None:
    for name, (act, new) in made.items():
        Path(name).write_bytes(OLD)
        limit = int(share * len(new))

        def write(act: Write = act, name: str = name, limit: int = limit) -> None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
            with pytest.raises(SandboxError, match=f"^{name}: cannot be written: File too large$"):
                act()

        assert exit_code_of(forked(write)) == 0, name
        assert Path(name).read_bytes() == OLD
        assert [entry.name for entry in Path().iterdir()] == [name]
        Path(name).unlink()


UNWRITABLE = {
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
    ("verify", "--json"),
    ("bench", "--json"),
    ("run", "article", "--save-inputs"),
)


@pytest.mark.parametrize(
    ("arguments", "what"),
    [(OPTIONS[0], what) for what in UNWRITABLE] + [(option, "no-folder") for option in OPTIONS[1:]],
    ids=lambda value: value if isinstance(value, str) else f"{value[0]}{value[-1]}",
)
def test_an_unwritable_output_is_reported_before_anything_runs(
    arguments: tuple[str, ...], what: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, why = UNWRITABLE[what]
    path += {"--report": ".html"}.get(arguments[-1], ".gif" if arguments[0] == "record" else ".csv")
    Path("file").touch()
    Path("folder.csv").mkdir()
    Path("circle.csv").symlink_to("circle.csv")
    for place in ("sandbox.scene.load", "sandbox.bench.parts.bench", "sandbox.scene.bundled"):
        monkeypatch.setattr(place, None)  # every command needs one of them
    assert outcome_of(*arguments, path) == (2, f"{path}: cannot be written: {why}\n")
    assert {entry.name for entry in Path().iterdir()} == {"file", "folder.csv", "circle.csv"}


@pytest.mark.parametrize("kind", VIDEO_FORMATS.values(), ids=VIDEO_FORMATS)
def test_a_video_on_a_full_disk_is_reported_once(kind: type[Video]) -> None:
    """Discarding it flushes what is buffered, which fails again."""
    if kind is VIDEO_FORMATS[".mp4"]:
        pytest.importorskip("av")
    noise = np.random.default_rng(0).integers(0, 256, (100, 16, 16, 3))

    def make() -> None:
        surface = Surface((64, 64))
        with kind("video", (64, 64)) as made:
            for patch in noise:  # small frames, so that some are buffered when the disk is full
                surface.blit(surfarray.make_surface(patch), (8, 8))
                made.add(surface)

    def act() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, 10_000))
        with pytest.raises(SandboxError, match=r"^video: cannot be written: File too large$"):
            make()

    assert exit_code_of(forked(act)) == 0
    assert list(Path().iterdir()) == []


def as_user(act: Callable[[], object]) -> int:
    """Run an act as a user without the permissions of root."""

    def other() -> None:
        if os.getuid() == 0:
            os.setuid(65534)
        act()

    return exit_code_of(forked(other))


def test_missing_permission_is_reported_before_anything_runs() -> None:
    Path("mine.json").write_bytes(OLD)
    Path("mine.json").chmod(0o444)

    def denied(path: str) -> None:
        with pytest.raises(SandboxError, match=f"^{path}: cannot be written: Permission denied$"):
            check_outputs({"--json": path})
        with pytest.raises(SandboxError, match=f"^{path}: cannot be written: Permission denied$"):
            write_text("new", path)

    folder = Path.cwd()
    folder.chmod(0o777)
    assert as_user(partial(denied, "mine.json")) == 0
    folder.chmod(0o555)
    try:
        assert as_user(partial(denied, "f.json")) == 0
    finally:
        folder.chmod(0o755)
    assert [entry.name for entry in Path().iterdir()] == ["mine.json"]
    assert Path("mine.json").read_bytes() == OLD


@pytest.mark.parametrize(
    "arguments",
    [
        ("compare", "mine.toml", "--json", "./mine.toml"),
        ("compare", "mine.toml", "--inputs", "mouse.jsonl", "--csv", "mouse.jsonl"),
        ("run", "mine.toml", "--save-inputs", "link"),
        ("sweep", "mine.toml", "--out", "mine.toml"),
        ("verify", "mine.toml", "--json", "mine.toml"),
        ("compare", "mine.toml", "--json", "x", "--csv", "./x"),
    ],
    ids="-".join,
)
def test_an_output_must_not_overwrite_an_input_or_another_output(arguments: tuple[str, ...]) -> None:
    Path("mine.toml").write_text(load("article").source)
    Path("mouse.jsonl").write_text('{"step": 0, "do": "start", "scene": "mine", "seed": 0, "rate": 60}\n')
    Path("link").symlink_to("mine.toml")
    message = f"{' '.join(arguments[-2:])}: is an input, or another output; choose another file\n"
    assert outcome_of(*arguments) == (2, message)
    assert Path("mine.toml").read_text() == load("article").source
    assert sorted(entry.name for entry in Path().iterdir()) == ["link", "mine.toml", "mouse.jsonl"]


def test_a_file_named_like_a_bundled_scene_can_be_written_and_inputs_saved_over_themselves() -> None:
    check_outputs({"--json": "article"}, ["article"])
    Path("mouse.jsonl").write_text('{"step": 0, "do": "start", "scene": "article", "seed": 0, "rate": 60}\n')
    again = ("run", "head-on", "--inputs", "mouse.jsonl", "--save-inputs", "mouse.jsonl")
    assert outcome_of(*again)[0] == 0
    assert '"scene":"head-on"' in Path("mouse.jsonl").read_text()


# What is not a plain file


def test_a_link_stays_and_its_target_is_replaced_with_its_mode_kept() -> None:
    Path("folder").mkdir()
    Path("folder/behind").write_bytes(OLD)
    Path("folder/behind").chmod(0o640)
    Path("link").symlink_to("folder/behind")
    Path("new").symlink_to("folder/none-yet")
    for link in ("link", "new"):
        check_outputs({"--json": link})
        write_text("content", link)
        assert Path(link).is_symlink()
    assert Path("folder/behind").read_text() == Path("folder/none-yet").read_text() == "content"
    assert Path("folder/behind").stat().st_mode & 0o777 == 0o640
    Path("plain").touch()
    assert Path("folder/none-yet").stat().st_mode == Path("plain").stat().st_mode


def test_a_pipe_and_a_device_are_written_to_directly() -> None:
    os.mkfifo("pipe")
    Path("null").symlink_to("/dev/null")
    read = []
    reader = threading.Thread(target=lambda: read.append(Path("pipe").read_bytes()))
    reader.start()
    check_outputs({"--json": "pipe", "--csv": "null", "--report": "null"})
    write_text("content", "pipe")
    write_text("content", "null")
    reader.join()
    assert read == [b"content"]
    assert Path("pipe").is_fifo()
    assert Path("/dev/null").is_char_device()
    assert sorted(entry.name for entry in Path().iterdir()) == ["null", "pipe"]


def test_dev_stdout_is_standard_output_even_if_that_is_a_file() -> None:
    written = []
    for name in ("/dev/stdout", "-"):
        with Path("out").open("wb") as out:
            assert outcome_of("compare", "article", "--seconds", "0.1", "--json", name, out=out.fileno()) == (0, "")
        written.append(Path("out").read_bytes())
    assert written[0] == written[1] != b""
    trace = ("trace", "article", "--engine", "article", "--steps", "1", "--out", "/dev/stdout")
    with Path("out").open("wb") as out:
        assert outcome_of(*trace, out=out.fileno()) == (0, "")
    assert Path("out").read_text().startswith("time,ball,x,y,vx,vy,radius,mass,angle,spin,energy\n0.0,0,")
    assert Path("/dev/stdout").is_symlink()


@pytest.mark.parametrize("name", ["x" * 255, "\N{SNOWMAN}" * 85, "\N{BEACH WITH UMBRELLA}" * 63])
def test_a_name_may_be_as_long_as_the_system_allows(name: str) -> None:
    check_outputs({"--json": name})
    write_text("content", name)
    assert [entry.name for entry in Path().iterdir()] == [name]


def test_temporary_names_are_unpredictable() -> None:
    """Otherwise, in a shared folder, another user's link of that name would redirect the write."""
    names = set()
    for _ in range(20):
        with whole_file("f.json") as file:
            names.add(file.name)
            assert os.fstat(file.fileno()).st_nlink == 1
    assert len(names) == 20
