"""Recordings: decoded frames show the balls where the trajectory has them."""

import gc
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pygame
import pytest
from conftest import Command, ball_at, sample, scene_of
from PIL import Image

from sandbox.errors import SandboxError
from sandbox.report.trajectory import simulate
from sandbox.scene.fields import rgb
from sandbox.scene.model import Scene
from sandbox.view import Layer
from sandbox.view.layout import Layout
from sandbox.view.offscreen import record, steps_of_frames
from sandbox.view.video import VIDEO_FORMATS, Gif

SIZE = (480, 300)
COLOURS = ("#d55e00", "#0072b2")
BALLS = (ball_at(200, 310, vx=180, colors=[COLOURS[0]]), ball_at(600, 300, colors=[COLOURS[1]]))
Frames = list[np.ndarray]


pytestmark = pytest.mark.usefixtures("working_folder")


@pytest.fixture
def scene() -> Scene:
    return scene_of(*BALLS, more="seconds = 10")


def frames_of(path: str) -> tuple[Frames, float]:
    """Decode a video: its frames, (height, width, 3), and its duration, s."""
    if path.endswith(".mp4"):
        av = pytest.importorskip("av")
        with av.open(path) as container:
            [stream] = container.streams.video
            frames = [frame.to_ndarray(format="rgb24") for frame in container.decode(stream)]
            return frames, float(stream.duration * stream.time_base)
    frames, lasts = [], 0.0
    with Image.open(path) as video:
        for number in range(getattr(video, "n_frames", 1)):
            video.seek(number)
            frames.append(np.asarray(video.convert("RGB")))
            lasts += video.info["duration"] / 1000
    return frames, lasts


def centre(frame: np.ndarray, place: pygame.Rect, colour: str) -> tuple[float, float]:
    """Return the centre of a colour within an arena, px of the scene."""
    arena = frame[place.y : place.bottom, place.x : place.right].astype(int)
    y, x = np.nonzero((np.abs(arena - rgb(colour)) < 40).all(axis=2))
    scale = place.width / 800
    return float(x.mean() + 0.5) / scale, float(y.mean() + 0.5) / scale


def check_frame(frame: np.ndarray, scene: Scene, step: int, off: float = 1.0) -> None:
    """Check where the balls are. off: px of the picture by which each may be elsewhere."""
    layout = Layout(SIZE, scene.arena.size, 2, has_chart=True)
    for pane, engine in enumerate(("pymunk", "article")):
        position = simulate(scene, engine, steps=step).position[-1]
        for ball, colour in enumerate(COLOURS):
            assert centre(frame, layout.arenas[pane], colour) == pytest.approx(position[ball], abs=off / layout.scale)


@pytest.mark.wide
@pytest.mark.parametrize("ending", VIDEO_FORMATS)
def test_four_seconds_play_at_the_scene_s_pace_from_its_start_to_its_end(scene: Scene, ending: str) -> None:
    if ending == ".mp4":
        pytest.importorskip("av")
    scene = scene.changed(seconds=4.0)
    record(scene, None, f"video{ending}", SIZE, [Layer.CHARTS])
    frames, lasts = frames_of(f"video{ending}")
    fps = {".gif": 50, ".mp4": 60}[ending]
    assert len(frames) == 4 * fps + 1
    assert lasts == pytest.approx(4 + 1 / fps, abs=1e-3)
    off = 2.0 if ending == ".mp4" else 1.0  # colours have half the resolution there
    for number, step in ((0, 0), (fps, 60), (-1, 240)):
        check_frame(frames[number], scene, step, off)
    assert [entry.name for entry in Path().iterdir()] == [f"video{ending}"]


def test_a_picture_is_the_end(scene: Scene) -> None:
    record(scene, None, "end.png", SIZE, [Layer.CHARTS])
    with Image.open("end.png") as picture:
        check_frame(np.asarray(picture.convert("RGB")), scene, 600)


@pytest.mark.parametrize("ending", [".gif", ".png"])
def test_the_same_run_gives_the_same_bytes(scene: Scene, ending: str) -> None:
    short = scene.changed(seconds=0.2)
    for name in ("a", "b"):
        record(short, ["pymunk"], f"{name}{ending}", SIZE, [Layer.TRAILS, Layer.VELOCITY])
    assert Path(f"a{ending}").read_bytes() == Path(f"b{ending}").read_bytes()


@pytest.mark.parametrize(("rate", "fps"), [(60, 60), (60, 50), (240, 60), (30, 60), (1000, 50), (7, 60)])
def test_a_frame_shows_the_latest_step_and_the_last_one_the_end(rate: int, fps: int) -> None:
    scene = scene_of(*BALLS, more=f"rate = {rate}\nseconds = 3")
    steps = steps_of_frames(scene, fps)
    assert len(steps) == 3 * fps + 1
    assert steps[0] == 0
    assert steps[-1] == scene.steps
    assert all(step / rate <= k / fps < (step + 1) / rate for k, step in enumerate(steps))


def surfaces(count: int) -> Iterator[pygame.Surface]:
    """Draw a square that moves over a background of many colours."""
    ground = pygame.surfarray.make_surface(np.random.default_rng(0).integers(0, 8, (97, 61, 3)) * 32)
    for k in range(count):
        surface = ground.copy()
        surface.fill("white", (0, 0, 97, 30))
        surface.fill(COLOURS[0], (k + 1, 3, 5, 5))
        yield surface


def test_gif_keeps_the_most_frequent_colours_of_a_frame_exactly() -> None:
    drawn = [*surfaces(9)]
    drawn.append(drawn[-1])
    with Gif("f.gif", (97, 61)) as video:
        for surface in drawn:
            video.add(surface)
    with Image.open("f.gif") as gif:
        assert gif.info["loop"] == 0
        assert getattr(gif, "n_frames", 0) == 10
        for number, surface in enumerate(drawn):
            gif.seek(number)
            frame, true = np.asarray(gif.convert("RGB")), pygame.surfarray.array3d(surface).swapaxes(0, 1)
            assert np.array_equal(frame[:30], true[:30])
            assert np.abs(frame[30:].astype(int) - true[30:]).mean() < 30  # half of 512 colours, the nearest


def test_an_unchanged_frame_takes_few_bytes() -> None:
    sizes = []
    for again in (0, 10):
        with Gif("f.gif", (97, 61)) as video:
            surface = next(surfaces(1))
            for _ in range(1 + again):
                video.add(surface)
        sizes.append(Path("f.gif").stat().st_size)
    assert sizes[1] - sizes[0] < 10 * 64


@pytest.mark.parametrize("ending", [".png", ".gif"])
def test_an_engine_that_fails_in_a_recording_is_reported_once_the_file_is_written(
    ending: str, command: Command
) -> None:
    Path("mine.py").write_text("def step(position, velocity, dt, scene):\n    raise KeyError('lost')\n")
    arguments = ("oblique", "--engines", "pymunk,mine.py:step", "--seconds", "0.1", "--out", f"out{ending}")
    code, out, err = command("record", *arguments)
    assert (code, out, err.splitlines()[-1]) == (2, "", "mine.py:step: raised KeyError: 'lost'")
    assert Path(f"out{ending}").stat().st_size > 0


def test_the_command_records_without_a_display_and_prints_nothing(command: Command) -> None:
    arguments = ("head-on", "--seconds", 0.5, "--size", "320x200", "--seed", 3, "--out", "video.gif")
    assert command("record", *arguments) == (0, "", "")
    with Image.open("video.gif") as video:
        assert (video.size, getattr(video, "n_frames", 0)) == ((320, 200), 26)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("article", "--out", "f.avi"), "f.avi: must end in one of .png, .gif, .mp4"),
        (
            ("article", "--out", "f.gif", "--size", "big"),
            "Invalid value for '--size': 'big' must be width x height in px",
        ),
        (("article", "--out", "f.gif", "--size", "10x9999"), "--size 10x9999: must be from 64x64 to 8192x8192"),
        (
            ("article", "--out", "f.gif", "--show", "trail"),
            "Invalid value for '--show': 'trail' is not something to show; did",
        ),
    ],
    ids=lambda value: "-".join(value[1:]) if isinstance(value, tuple) else "",
)
def test_an_error_is_one_message_and_leaves_no_file(command: Command, arguments: tuple[str, ...], message: str) -> None:
    code, out, err = command("record", *arguments)
    assert (code, out) == (2, "")
    assert err.startswith(message)
    assert err.count("\n") == 1
    assert list(Path().iterdir()) == []


def test_mp4_needs_even_sides_and_av(monkeypatch: pytest.MonkeyPatch) -> None:
    if find_spec("av"):
        with pytest.raises(SandboxError, match=r"f\.mp4: MP4 must have an even width and height, got 321x200"):
            VIDEO_FORMATS[".mp4"]("f.mp4", (321, 200))
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(SandboxError, match=r"f\.mp4: needs av, which is not installed; pip install av$"):
        VIDEO_FORMATS[".mp4"]("f.mp4", (320, 200))
    assert list(Path().iterdir()) == []


def is_writing(process: int) -> bool:
    """Return whether a process has an unnamed file open in this folder."""
    for entry in Path(f"/proc/{process}/fd").iterdir():
        with suppress(FileNotFoundError):  # it was closed since
            if str(Path.cwd()) in str(entry.readlink()):
                return True
    return False


@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="needs /proc")
@pytest.mark.parametrize("how", sample([signal.SIGTERM, signal.SIGKILL], 2))
def test_a_recording_that_is_killed_leaves_no_file(how: signal.Signals) -> None:
    command = [sys.executable, "-m", "sandbox", "record", "gas-100", "--seconds", "600", "--out", "video.gif"]
    with subprocess.Popen(command, stderr=subprocess.DEVNULL) as process:
        try:
            while process.poll() is None and not is_writing(process.pid):
                time.sleep(0.02)
            time.sleep(0.1)  # some frames
            assert process.poll() is None
            process.send_signal(how)
            process.wait(30)
        finally:
            process.kill()
    assert list(Path().iterdir()) == []


def test_each_choice_of_layers_gives_another_picture(scene: Scene) -> None:
    pictures = {}
    shown: tuple[tuple[Layer, ...], ...] = ((), (Layer.CHARTS,), (Layer.VELOCITY,), (Layer.GHOSTS, Layer.NUMBERS))
    for show in shown:
        record(scene.changed(seconds=0.1), None, "p.png", (640, 480), show)
        pictures[Path("p.png").read_bytes()] = show
    assert len(pictures) == 4


def test_a_gif_s_frame_uses_nothing_of_the_palette_before() -> None:
    first, second = pygame.Surface((64, 64)), pygame.Surface((64, 64))
    first.fill("#808080")
    first.fill("black", (0, 40, 1, 1))
    for k in range(256):  # of each shade more than of the grey, so that this is not in the palette
        second.fill((130 + k % 2, k, 128), (k % 64, k // 64 * 8, 1, 8))
    second.fill("#808080", (0, 40, 1, 1))
    with Gif("f.gif", (64, 64)) as video:
        video.add(first)
        video.add(second)
    with Image.open("f.gif") as gif:
        gif.seek(1)
        assert gif.convert("RGB").getpixel((0, 40)) == pytest.approx((128, 128, 128), abs=8)


def test_frames_are_not_kept_in_memory() -> None:
    def pictures() -> int:
        gc.collect()
        return sum(
            issubclass(type(thing), Image.Image) for thing in gc.get_objects()
        )  # not of what weak proxies refer to

    before = pictures()
    with Gif("f.gif", (97, 61)) as video:
        for surface in surfaces(40):
            video.add(surface)
        assert pictures() - before <= 2
