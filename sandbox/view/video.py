"""Videos: frames written one after another to a GIF, WebP or MP4 file, also while the window shows them.

Only the last frame is in memory. GIF and WebP are assembled here from frames that Pillow encodes; after the first, a
frame is only the rectangle that changed. Pillow's own writers keep all frames until the end. PyAV is an extra: of 2 s
of newtons-cradle its GIF, with a palette per frame, has 2.5 MB with 0.7 % of the pixels off, here 0.56 MB with 0.35 %;
its WebP 0.44 MB, here 1.1 MB.
"""

import io
import shutil
import struct
from abc import ABC, abstractmethod
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryFile
from types import TracebackType
from typing import IO, ClassVar, Final, Self

import numpy as np
import pygame
from numpy.typing import NDArray
from PIL import Image, ImageChops
from PIL.GifImagePlugin import getdata
from pygame import Surface

from sandbox.errors import MissingLibrary, SandboxError
from sandbox.files import whole_file, write_errors
from sandbox.view.notice import Notice, NoticeKind

MAX_GIF_COLOURS: Final = 255  # of a frame, besides the transparent one
TRANSPARENT: Final = 255  # index in a frame's palette


class Video(ABC):
    """A video being recorded, into a file without a name until it is saved; a video discarded leaves no file."""

    fps: ClassVar[int]  # frames a second

    def __init__(self, path: str | Path, size: tuple[int, int]) -> None:
        self.path = path
        self.size = size
        self.frames = 0
        self._last: Image.Image | None = None
        with write_errors(path):
            self._file: IO[bytes] = TemporaryFile(dir=Path(path).parent)  # noqa: SIM115 (closed by save and discard)
            try:
                self._open(self._file)
            except SandboxError:
                self.discard()
                raise

    def add(self, surface: Surface) -> None:
        """Add a frame, to be shown for 1/fps s. Raises SandboxError if it cannot be written."""
        assert surface.get_size() == self.size
        frame = Image.frombuffer("RGB", self.size, pygame.image.tobytes(surface, "RGB"))
        with write_errors(self.path):
            self._write(self._file, frame)
        self.frames, self._last = self.frames + 1, frame

    def save(self) -> None:
        """End the video and move it to its path. Raises SandboxError if it cannot be written."""
        with write_errors(self.path), self._file:
            self._close(self._file)
            self._file.seek(0)
            with whole_file(self.path) as file:
                shutil.copyfileobj(self._file, file)

    def discard(self) -> None:
        """Delete the video."""
        with suppress(OSError):  # closing flushes, and the disk may be full
            self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if kind is None:
            self.save()
        else:
            self.discard()

    def _changed(self, frame: Image.Image) -> tuple[int, int, int, int]:
        """Return the rectangle that changed since the last frame: left, top (both even, for WebP), right, bottom."""
        if self._last is None:
            return (0, 0, *self.size)
        left, top, right, bottom = ImageChops.difference(frame, self._last).getbbox() or (0, 0, 1, 1)
        return left - left % 2, top - top % 2, right, bottom

    @abstractmethod
    def _open(self, file: IO[bytes]) -> None:
        """Write what comes before the frames."""

    @abstractmethod
    def _write(self, file: IO[bytes], frame: Image.Image) -> None:
        """Write a frame."""

    @abstractmethod
    def _close(self, file: IO[bytes]) -> None:
        """Write what comes after the frames."""


class Gif(Video):
    """GIF89a at 50 frames a second: its delays are multiples of 1/100 s, so 60 is impossible."""

    fps = 50

    def _open(self, file: IO[bytes]) -> None:
        self._index_of = np.full(1 << 24, TRANSPARENT, np.uint8)  # index in the palette of each RGB colour
        file.write(b"GIF89a" + struct.pack("<HHBBB", *self.size, 0x70, 0, 0))
        file.write(b"\x21\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00")  # repeat for ever

    def _write(self, file: IO[bytes], frame: Image.Image) -> None:
        place = self._changed(frame)
        picture = self._with_palette(frame.crop(place))
        if self._last is not None:  # long runs of one index compress well
            same = (np.asarray(frame.crop(place)) == np.asarray(self._last.crop(place))).all(axis=2)
            picture.paste(TRANSPARENT, mask=Image.fromarray(same))
        more = {"transparency": TRANSPARENT, "disposal": 1}  # 1: keep the pixels that the next frame leaves out
        file.writelines(getdata(picture, place[:2], duration=1000 // self.fps, include_color_table=True, **more))

    def _close(self, file: IO[bytes]) -> None:
        file.write(b";")

    def _with_palette(self, frame: Image.Image) -> Image.Image:
        """Give a picture a palette of its most frequent colours; others, as on smooth edges, become near ones."""
        pixels = _packed(np.asarray(frame))
        counted = frame.getcolors(frame.width * frame.height) or []
        most = np.array([colour for _, colour in sorted(counted, reverse=True)[:MAX_GIF_COLOURS]], np.uint8)
        palette = Image.new("P", (1, 1))
        palette.putpalette(most.tobytes())
        near = frame.quantize(palette=palette, dither=Image.Dither.NONE)  # up to 4 off per channel even if exact
        keys = _packed(most)
        self._index_of[keys] = np.arange(len(keys))
        exact = self._index_of[pixels]
        self._index_of[keys] = TRANSPARENT
        picture = Image.fromarray(np.where(exact == TRANSPARENT, np.asarray(near), exact))
        picture.putpalette(most.tobytes())
        return picture


def _packed(colours: NDArray[np.uint8]) -> NDArray[np.int32]:
    """Pack red, green and blue into one integer: (..., 3) -> (...)."""
    wide = colours.astype(np.int32)
    return (wide[..., 0] << 16) | (wide[..., 1] << 8) | wide[..., 2]


class WebP(Video):
    """Animated WebP, lossless, at 60 frames a second.

    Chunks as in https://developers.google.com/speed/webp/docs/riff_container.
    """

    fps = 60

    def _open(self, file: IO[bytes]) -> None:
        width, height = self.size
        file.write(b"RIFF\0\0\0\0WEBP")
        file.write(_chunk(b"VP8X", b"\x02\0\0\0" + _uint24(width - 1) + _uint24(height - 1)))  # 2: animated
        file.write(_chunk(b"ANIM", b"\xff\xff\xff\xff\0\0"))  # repeat for ever

    def _write(self, file: IO[bytes], frame: Image.Image) -> None:
        left, top, right, bottom = place = self._changed(frame)
        encoded = io.BytesIO()
        frame.crop(place).save(encoded, "WEBP", lossless=True, quality=0, method=1)
        # Durations are whole ms: 17, 16, 17, ..., so that their sum is never more than half a ms off.
        since, until = (round(1000 * k / self.fps) for k in (self.frames, self.frames + 1))
        numbers = (left // 2, top // 2, right - left - 1, bottom - top - 1, until - since)
        picture = encoded.getvalue()[12:]  # without the RIFF header
        file.write(_chunk(b"ANMF", b"".join(map(_uint24, numbers)) + b"\x02" + picture))  # 2: no blending

    def _close(self, file: IO[bytes]) -> None:
        length = file.tell() - 8
        file.seek(4)
        file.write(struct.pack("<I", length))


def _chunk(name: bytes, content: bytes) -> bytes:
    return name + struct.pack("<I", len(content)) + content + b"\0" * (len(content) % 2)


def _uint24(number: int) -> bytes:
    return number.to_bytes(3, "little")


class Mp4(Video):
    """H.264 at 60 frames a second, by PyAV."""

    fps = 60

    def _open(self, file: IO[bytes]) -> None:
        try:
            self._av = import_module("av")
        except ImportError:
            raise MissingLibrary(str(self.path), "av") from None
        if self.size[0] % 2 or self.size[1] % 2:
            size = f"{self.size[0]}x{self.size[1]}"
            raise SandboxError(f"{self.path}: MP4 must have an even width and height, got {size}")
        self._container = self._av.open(file, "w", format="mp4")
        self._stream = self._container.add_stream("libx264", rate=self.fps)
        self._stream.width, self._stream.height = self.size
        self._stream.pix_fmt = "yuv420p"  # the one that every player decodes
        self._stream.options = {"crf": "16", "preset": "veryfast"}

    def _write(self, file: IO[bytes], frame: Image.Image) -> None:
        picture = self._av.VideoFrame.from_image(frame)
        picture.pts, picture.time_base = self.frames, Fraction(1, self.fps)
        self._container.mux(self._stream.encode(picture))

    def _close(self, file: IO[bytes]) -> None:
        self._container.mux(self._stream.encode(None))
        self._container.close()


VIDEO_FORMATS: Final[dict[str, type[Video]]] = {".gif": Gif, ".webp": WebP, ".mp4": Mp4}


@dataclass
class Recorder:
    """Records the window as a GIF. While the window is paused, nothing is recorded."""

    _notice: Notice
    video: Video | None = None  # that is being recorded

    @property
    def seconds(self) -> float | None:
        """The length of what is recorded so far, s; None while nothing is being recorded."""
        return self.video.frames / self.video.fps if self.video else None

    def toggle(self, path: str, size: tuple[int, int]) -> None:
        """Start recording into a file, in a size in px; or stop."""
        if self.video:
            self.stop()
        else:
            with self._notice.reporting():
                self.video = Gif(path, size)

    def add_frame(self, screen: Surface) -> None:
        """Record the window as it is now, if it is being recorded; a change of its size ends the recording."""
        video = self.video
        if video and video.size != screen.get_size():
            self.stop()
        elif video:
            try:
                video.add(screen)
            except SandboxError as error:
                video.discard()
                self.video = None
                self._notice.show(str(error), NoticeKind.ERROR)

    def stop(self) -> None:
        """Save the recording, if there is one."""
        video, self.video = self.video, None
        if video and not video.frames:
            video.discard()
            self._notice.show("nothing was recorded: a window that is paused is not")
        elif video:
            with self._notice.reporting():
                video.save()
                self._notice.show_saved(video.path)
