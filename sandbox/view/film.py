"""Films: frames one after another into a GIF, WebP or MP4 file, of which only the last is in memory.

GIF and WebP are put together here from frames that Pillow encodes, since its own writers keep all of them until the
end. After a first frame, only the rectangle in which something changed is written.
"""

import io
import shutil
import struct
from abc import ABC, abstractmethod
from contextlib import suppress
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

from sandbox.errors import SandboxError
from sandbox.files import whole_file, write_errors

COLOURS: Final = 255  # that a frame of a GIF can have, beside one number for none
CLEAR: Final = 255
INSTALL: Final = "pip install 'pymunk-sandbox[video]'"


class Film(ABC):
    """A film in the making. It has no name until it is saved, so that one that is given up leaves nothing behind."""

    fps: ClassVar[int]  # frames a second

    def __init__(self, path: str | Path, size: tuple[int, int]) -> None:
        self.path = path
        self.size = size
        self.frames = 0
        self._shown: Image.Image | None = None  # the last frame
        with write_errors(path):
            self._file: IO[bytes] = TemporaryFile(dir=Path(path).parent)  # noqa: SIM115 (closed by save and discard)
            try:
                self._open(self._file)
            except SandboxError:
                self.discard()
                raise

    def add(self, surface: Surface) -> None:
        """Add a frame, which is shown for 1/fps of a second. Raises SandboxError where it cannot be written."""
        assert surface.get_size() == self.size
        frame = Image.frombuffer("RGB", self.size, pygame.image.tobytes(surface, "RGB"))
        with write_errors(self.path):
            self._write(self._file, frame)
        self.frames, self._shown = self.frames + 1, frame

    def save(self) -> None:
        """End the film, and put it in its place. Raises SandboxError where it cannot be written."""
        with write_errors(self.path), self._file:
            self._close(self._file)
            self._file.seek(0)
            with whole_file(self.path) as file:
                shutil.copyfileobj(self._file, file)

    def discard(self) -> None:
        """Leave nothing of it."""
        with suppress(OSError):  # that there is still no room for what is thrown away
            self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if kind is None:
            self.save()
        else:
            self.discard()

    def _changed(self, frame: Image.Image) -> tuple[int, int, int, int]:
        """Return the rectangle in which a frame differs from the last: left, top, right, bottom, the first two even."""
        if self._shown is None:
            return (0, 0, *self.size)
        left, top, right, bottom = ImageChops.difference(frame, self._shown).getbbox() or (0, 0, 1, 1)
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


class Gif(Film):
    """GIF89a. Its delays are in 1/100 s, so 60 frames a second cannot be had; 50 can."""

    fps = 50

    def _open(self, file: IO[bytes]) -> None:
        self._numbers = np.full(1 << 24, CLEAR, np.uint8)  # in the palette, of every colour that it has
        file.write(b"GIF89a" + struct.pack("<HHBBB", *self.size, 0x70, 0, 0))
        file.write(b"\x21\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00")  # again and again

    def _write(self, file: IO[bytes], frame: Image.Image) -> None:
        place = self._changed(frame)
        picture = self._with_palette(frame.crop(place))
        if self._shown is not None:  # long runs of one number compress well
            picture.paste(CLEAR, mask=_equal(frame.crop(place), self._shown.crop(place)))
        file.writelines(
            getdata(
                picture,
                place[:2],
                duration=1000 // self.fps,
                include_color_table=True,
                transparency=CLEAR,
                disposal=1,  # what is not drawn over stays
            )
        )

    def _close(self, file: IO[bytes]) -> None:
        file.write(b";")

    def _with_palette(self, frame: Image.Image) -> Image.Image:
        """Give a picture a palette of the colours that it has most of; the rest, of smooth edges, take near ones."""
        pixels = _packed(np.asarray(frame))
        counted = frame.getcolors(frame.width * frame.height) or []
        most = np.array([colour for _, colour in sorted(counted, reverse=True)[:COLOURS]], np.uint8)
        palette = Image.new("P", (1, 1))
        palette.putpalette(most.tobytes())
        near = frame.quantize(palette=palette, dither=Image.Dither.NONE)  # which is up to 4 off in each part
        names = _packed(most)
        self._numbers[names] = np.arange(len(names))
        exact = self._numbers[pixels]
        self._numbers[names] = CLEAR
        picture = Image.fromarray(np.where(exact == CLEAR, np.asarray(near), exact))
        picture.putpalette(most.tobytes())
        return picture


def _packed(colours: NDArray[np.uint8]) -> NDArray[np.int32]:
    """Make one number of red, green and blue: (..., 3) -> (...)."""
    wide = colours.astype(np.int32)
    return (wide[..., 0] << 16) | (wide[..., 1] << 8) | wide[..., 2]


def _equal(a: Image.Image, b: Image.Image) -> Image.Image:
    """Return a mask of where two pictures are the same."""
    return Image.fromarray((np.asarray(a) == np.asarray(b)).all(axis=2))


class WebP(Film):
    """Animated WebP, lossless, of 60 frames a second.

    Chunks as in https://developers.google.com/speed/webp/docs/riff_container.
    """

    fps = 60

    def _open(self, file: IO[bytes]) -> None:
        width, height = self.size
        file.write(b"RIFF\0\0\0\0WEBP")
        file.write(_chunk(b"VP8X", b"\x02\0\0\0" + _three(width - 1) + _three(height - 1)))  # 2: animated
        file.write(_chunk(b"ANIM", b"\xff\xff\xff\xff\0\0"))  # again and again

    def _write(self, file: IO[bytes], frame: Image.Image) -> None:
        left, top, right, bottom = place = self._changed(frame)
        alone = io.BytesIO()
        frame.crop(place).save(alone, "WEBP", lossless=True, quality=0, method=1)
        # Times are in ms: 17, 17, 16, ..., so that they never add up to more than half a ms off.
        since, until = (round(1000 * k / self.fps) for k in (self.frames, self.frames + 1))
        numbers = (left // 2, top // 2, right - left - 1, bottom - top - 1, until - since)
        picture = alone.getvalue()[12:]  # without the head of a file of its own
        file.write(_chunk(b"ANMF", b"".join(map(_three, numbers)) + b"\x02" + picture))  # 2: not blended

    def _close(self, file: IO[bytes]) -> None:
        length = file.tell() - 8
        file.seek(4)
        file.write(struct.pack("<I", length))


def _chunk(name: bytes, content: bytes) -> bytes:
    return name + struct.pack("<I", len(content)) + content + b"\0" * (len(content) % 2)


def _three(number: int) -> bytes:
    return number.to_bytes(3, "little")


class Mp4(Film):
    """H.264 of 60 frames a second, by PyAV."""

    fps = 60

    def _open(self, file: IO[bytes]) -> None:
        try:
            self._av = import_module("av")
        except ImportError:
            raise SandboxError(f"{self.path}: needs av, which is not installed; {INSTALL}") from None
        if self.size[0] % 2 or self.size[1] % 2:
            raise SandboxError(
                f"{self.path}: must have an even width and height as MP4, got {self.size[0]}x{self.size[1]}"
            )
        self._container = self._av.open(file, "w", format="mp4")
        self._stream = self._container.add_stream("libx264", rate=self.fps)
        self._stream.width, self._stream.height = self.size
        self._stream.pix_fmt = "yuv420p"  # which every player knows
        self._stream.options = {"crf": "16", "preset": "veryfast"}

    def _write(self, file: IO[bytes], frame: Image.Image) -> None:
        picture = self._av.VideoFrame.from_image(frame)
        picture.pts, picture.time_base = self.frames, Fraction(1, self.fps)
        self._container.mux(self._stream.encode(picture))

    def _close(self, file: IO[bytes]) -> None:
        self._container.mux(self._stream.encode(None))
        self._container.close()


FILMS: Final[dict[str, type[Film]]] = {".gif": Gif, ".webp": WebP, ".mp4": Mp4}
