"""Videos: frames written one after another to a GIF or MP4 file, also by a thread while the window shows them.

Only the last frame is in memory, where Pillow's own writer of GIFs keeps all until the end. PyAV, which is an extra,
writes GIFs of five times the size.
"""
# ruff: noqa: D102 (the base class documents the methods)

import shutil
import struct
from abc import ABC, abstractmethod
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from fractions import Fraction
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, ClassVar, Final, Self

import numpy as np
import pygame
from numpy.typing import NDArray
from PIL import Image
from PIL.GifImagePlugin import getdata
from pygame import Surface

from sandbox.errors import MissingLibrary, SandboxError
from sandbox.files import whole_file, write_errors
from sandbox.view.notice import Notice, NoticeKind

TRANSPARENT: Final = 255  # index in a frame's palette of what stays as it was
EXACT: Final = 192  # the most frequent colours of a frame that has too many; the others become near ones
LEAST: Final = 4  # hundredths of a second that a frame of the window is shown; more frames would slow it down
MAX_WAITING: Final = 3  # frames of the window that wait until they are encoded


class Video(ABC):
    """A video being recorded, into a file without a name until it is saved; a video discarded leaves no file."""

    fps: ClassVar[int]  # frames a second

    def __init__(self, path: str | Path, size: tuple[int, int]) -> None:
        self.path, self.size, self.frames = path, size, 0
        with write_errors(path):
            self.file: IO[bytes] = TemporaryFile(dir=Path(path).parent)  # noqa: SIM115 (closed by save and discard)
            try:
                self.begin()
            except SandboxError:
                self.discard()
                raise

    @abstractmethod
    def begin(self) -> None:
        """Write what comes before the frames."""

    @abstractmethod
    def write(self, surface: Surface, seconds: float) -> None:
        """Write a frame."""

    @abstractmethod
    def end(self) -> None:
        """Write what comes after the frames."""

    def add(self, surface: Surface, seconds: float | None = None) -> None:
        """Add a frame, to be shown for some seconds, by default 1/fps. Raises SandboxError if it cannot be written."""
        assert surface.get_size() == self.size
        with write_errors(self.path):
            self.write(surface, seconds or 1 / self.fps)
        self.frames += 1

    def save(self) -> None:
        """End the video and move it to its path. Raises SandboxError if it cannot be written."""
        with write_errors(self.path), self.file:
            self.end()
            self.file.seek(0)
            with whole_file(self.path) as file:
                shutil.copyfileobj(self.file, file)

    def discard(self) -> None:
        """Delete the video."""
        with suppress(OSError):  # closing flushes, and the disk may be full
            self.file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self.discard() if kind else self.save()


class Gif(Video):
    """GIF89a at 50 frames a second: its delays are multiples of 1/100 s, so 60 is impossible.

    After the first, a frame is only the rectangle that changed, in which pixels that did not are transparent.
    """

    fps = 50

    def begin(self) -> None:
        self._last: NDArray[np.uint32] = np.full(self.size[::-1], 1 << 24, np.uint32)  # which is no colour
        self.file.write(b"GIF89a" + struct.pack("<HHBBB", *self.size, 0x70, 0, 0))
        self.file.write(b"\x21\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00")  # repeat for ever

    def write(self, surface: Surface, seconds: float) -> None:
        red, green, blue, _ = surface.get_shifts()
        frame = pygame.surfarray.pixels2d(surface).T & np.uint32(255 << red | 255 << green | 255 << blue)
        changed = frame != self._last
        rows, columns = np.flatnonzero(changed.any(axis=1)), np.flatnonzero(changed.any(axis=0))
        left, top = (int(columns[0]), int(rows[0])) if len(rows) else (0, 0)
        right, bottom = (int(columns[-1]) + 1, int(rows[-1]) + 1) if len(rows) else (1, 1)
        colours, numbers, counts = np.unique(frame[changed], return_inverse=True, return_counts=True)
        channels = np.stack([colours >> shift & 255 for shift in (red, green, blue)], axis=1).astype(np.uint8)
        palette, index_of = _palette(channels, counts)
        indices = np.full(frame.shape, TRANSPARENT, np.uint8)
        indices[changed] = index_of[numbers]
        picture = Image.fromarray(indices[top:bottom, left:right])
        picture.putpalette(palette.tobytes())
        more = {"transparency": TRANSPARENT, "disposal": 1}  # 1: keep the pixels that the next frame leaves out
        duration = 10 * round(100 * seconds)  # ms
        self.file.writelines(getdata(picture, (left, top), duration=duration, include_color_table=True, **more))
        self._last = frame

    def end(self) -> None:
        self.file.write(b";")


def _palette(colours: NDArray[np.uint8], counts: NDArray[np.int64]) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Return a palette, (at most 255, 3), and the index in it of each of some colours, (n, 3): a near one of many."""
    if len(colours) <= TRANSPARENT:
        return colours, np.arange(len(colours), dtype=np.uint8)
    order = np.argsort(-counts, kind="stable")
    frequent, rest = order[:EXACT], order[EXACT:]
    near = Image.fromarray(colours[None, rest]).quantize(TRANSPARENT - EXACT, dither=Image.Dither.NONE)
    index_of = np.empty(len(colours), np.uint8)
    index_of[frequent], index_of[rest] = np.arange(EXACT), EXACT + np.asarray(near)[0]
    return np.vstack([colours[frequent], np.reshape(near.getpalette() or (), (-1, 3))]).astype(np.uint8), index_of


class Mp4(Video):
    """H.264 at 60 frames a second, by PyAV."""

    fps = 60

    def begin(self) -> None:
        try:
            self._av = import_module("av")
        except ImportError:
            raise MissingLibrary(str(self.path), "av") from None
        if self.size[0] % 2 or self.size[1] % 2:
            size = f"{self.size[0]}x{self.size[1]}"
            raise SandboxError(f"{self.path}: MP4 must have an even width and height, got {size}")
        self._container = self._av.open(self.file, "w", format="mp4")
        self._stream = self._container.add_stream("libx264", rate=self.fps)
        self._stream.width, self._stream.height = self.size
        self._stream.pix_fmt = "yuv420p"  # the one that every player decodes
        self._stream.options = {"crf": "16", "preset": "veryfast"}

    def write(self, surface: Surface, seconds: float) -> None:
        frame = Image.frombuffer("RGB", self.size, pygame.image.tobytes(surface, "RGB"))
        picture = self._av.VideoFrame.from_image(frame)
        picture.pts, picture.time_base = self.frames, Fraction(1, self.fps)
        self._container.mux(self._stream.encode(picture))

    def end(self) -> None:
        self._container.mux(self._stream.encode(None))
        self._container.close()


VIDEO_FORMATS: Final[dict[str, type[Video]]] = {".gif": Gif, ".mp4": Mp4}


class Recorder:
    """Records the window as a GIF while it is not paused: a thread encodes the frames, and leaves out what is too much.

    seconds: that have been recorded so far; None while nothing is being recorded.
    """

    def __init__(self, notice: Notice) -> None:
        self._notice = notice
        self.seconds: float | None = None

    def toggle(self, path: str, size: tuple[int, int]) -> None:
        """Start recording into a file, in a size in px; or stop."""
        if self.seconds is not None:
            self.stop()
            return
        with self._notice.reporting():
            self._video, self._thread, self._frames = Gif(path, size), ThreadPoolExecutor(1), list[Future[None]]()
            self.seconds, self._unseen = 0.0, 0.0  # s that have passed since the last frame

    def add_frame(self, screen: Surface, seconds: float) -> None:
        """Record the window as it is now, some seconds after the last call; a change of its size ends the recording."""
        if self.seconds is None:
            return
        self.seconds, self._unseen = self.seconds + seconds, self._unseen + seconds
        hundredths = int(100 * self._unseen + 1e-9)
        waiting = [frame for frame in self._frames if not frame.done()]
        has_failed = any(frame.done() and frame.exception() for frame in self._frames)
        if has_failed or self._video.size != screen.get_size():
            self.stop()
        elif hundredths >= LEAST and len(waiting) <= MAX_WAITING:
            self._frames = [*waiting, self._thread.submit(self._video.add, screen.copy(), hundredths / 100)]
            self._unseen -= hundredths / 100

    def stop(self) -> None:
        """Save the recording, if there is one."""
        if self.seconds is None:
            return
        self.seconds = None
        self._thread.shutdown()
        try:
            for frame in self._frames:
                frame.result()
            if self._video.frames:
                self._video.save()
                self._notice.show_saved(self._video.path)
            else:
                self._notice.show("nothing was recorded: a window that is paused is not")
        except SandboxError as error:
            self._notice.show(str(error), NoticeKind.ERROR)
        finally:
            self._video.discard()
