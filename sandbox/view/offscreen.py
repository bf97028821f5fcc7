"""Pictures without a window: of a scene's start, and of a run, its end or all of it as a video."""

import io
from collections.abc import Callable, Collection, Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final, NamedTuple

import pygame
from pygame import Rect, Surface

from sandbox.errors import EngineError, SandboxError
from sandbox.files import whole_file
from sandbox.run.inputs import Input
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.view import Layer
from sandbox.view.layout import Layout
from sandbox.view.primitives import Discs, draw_walls, first_lines, write
from sandbox.view.run_so_far import ComparisonSoFar, RunSoFar
from sandbox.view.session_view import SessionView
from sandbox.view.theme import palette, theme
from sandbox.view.video import VIDEO_FORMATS

MAX_KEPT: Final = 256  # pictures
ERROR_LINES: Final = 4  # of a scene with errors
MIN_SIDE: Final = 64  # px
MAX_SIDE: Final = 8192  # px
MARKED_STEPS: Final = 15  # that are compared at once, at least
MARKED_SHARE: Final = 1.02  # by which a run has grown when it is compared again, so that long ones do not take longer
PICTURE_FPS: Final = 60  # samples of trails and charts per second, for a picture


class Preview(NamedTuple):
    """A scene's picture and texts; both are empty until they are drawn."""

    surface: Surface
    title: str = ""
    about: str = ""


class Previews:
    """Pictures of scenes, which are kept; in each frame, at most one new one is drawn.

    is_complete: whether all that were asked for since `begin_frame` are there.
    """

    def __init__(self) -> None:
        self._kept: dict[object, Preview] = {}
        self.begin_frame()

    def begin_frame(self) -> None:
        """Let another picture be drawn."""
        self._drawn, self.is_complete = 0, True

    def of(self, file: Path, size: tuple[int, int], text_height: int) -> Preview:
        """Return the picture of a file's scene, or an empty one if this frame has drawn another."""
        changed = 0
        with suppress(OSError):
            changed = file.stat().st_mtime_ns
        key = file, changed, size, text_height, theme.is_dark
        if key not in self._kept and self._drawn:
            self.is_complete = False
            empty = Surface(size, pygame.SRCALPHA)
            pygame.draw.rect(empty, theme.hover, empty.get_rect(), border_radius=text_height // 3)
            return Preview(empty)
        if key not in self._kept:
            if len(self._kept) >= MAX_KEPT:
                del self._kept[next(iter(self._kept))]
            self._kept[key], self._drawn = _preview(file, size, text_height), 1
        return self._kept[key]


def _preview(file: Path, size: tuple[int, int], text_height: int) -> Preview:
    """Draw a scene's start as large as there is room, at the left, or write its first error."""
    surface = Surface(size, pygame.SRCALPHA)
    try:
        scene = load(file)
        state = spawn(scene)
    except SandboxError as error:
        height = round(0.85 * text_height)
        line = Rect(0, 0, size[0], round(1.3 * height))
        for text in first_lines(str(error).splitlines()[0], size[0], height, ERROR_LINES):
            write(surface, text, line, theme.dim, height)
            line.y += line.height
        return Preview(surface, "has errors")
    scale = min(have / need for have, need in zip(size, scene.arena.size, strict=True))
    arena = Rect(0, 0, *(max(1, round(side * scale)) for side in scene.arena.size))
    arena.midleft = surface.get_rect().midleft
    inside = surface.subsurface(arena.clip(surface.get_rect()))
    inside.fill(palette(scene.arena.background).ground)
    draw_walls(inside, scene, scale)
    Discs(scene.bodies.radius, scene.colors).draw(inside, scale * state.position, scale, state.angle)
    pygame.draw.rect(surface, theme.wall, arena, 1)
    return Preview(surface, scene.title, scene.about)


class Camera:
    """Runs a scene and draws it on a surface of a given size (px)."""

    def __init__(
        self,
        scene: Scene,
        engines: Sequence[str] | None,
        size: tuple[int, int],
        showing: Collection[Layer],
        inputs: Sequence[Input] = (),
    ) -> None:
        self._scene, self._showing = scene, showing
        self.view = SessionView(scene, engines, inputs)
        self._so_far, self._compared = ComparisonSoFar(), 0
        self._surface, self._layout = (
            Surface(size),
            Layout(size, scene.arena.size, len(self.view.panes), has_chart=Layer.CHARTS in showing),
        )

    def go_to(self, step: int) -> None:
        """Run to a step and update what is drawn."""
        while self.view.session.step < step:
            self.view.session.advance()
        self.view.update()

    def draw(self) -> Surface:
        """Draw the current step, and return the surface."""
        if Layer.CHARTS in self._showing:
            self._mark()
        layout, moment = self._layout, self.view.moment
        self._surface.fill(theme.ground)
        self.view.draw_panes(self._surface, layout, self._showing)
        self.view.draw_chart(self._surface, layout, None)
        caption = f"{self._scene.title or self._scene.name}    seed {self._scene.seed}    {moment.time:.2f} s"
        write(self._surface, caption, layout.status, theme.dim, layout.text_height)
        return self._surface

    def _mark(self) -> None:
        """Mark what stands out, if enough new steps are there for a comparison, and something can still be found."""
        run, marks = RunSoFar.of(self.view.session), self._so_far.marks
        is_complete = marks.trust.until is not None and {*run.engines} == {run.against, *marks.differences}
        if run.steps >= max(self._compared + MARKED_STEPS, MARKED_SHARE * self._compared) and not is_complete:
            self._compared = run.steps
            with suppress(SandboxError):  # of which a pane says why
                self._so_far.of(run)
        self.view.mark(self._so_far.marks)


def steps_of_frames(scene: Scene, fps: int) -> list[int]:
    """Return the step that each frame shows: the latest by its time, and the last step in the last frame."""
    frames = round(scene.steps * fps / scene.rate)
    return [*(k * scene.rate // fps for k in range(frames)), scene.steps]


def record(
    scene: Scene,
    engines: Sequence[str] | None,
    path: str,
    size: tuple[int, int],
    showing: Collection[Layer],
    inputs: Sequence[Input] = (),
    track: Callable[[Sequence[int]], Iterable[int]] = iter,
) -> None:
    """Run a scene for its seconds and write a video, or for .png its end, in the format of the path's ending.

    track: yields the frames' steps, and may show progress. Raises SandboxError if the path or the size is not valid,
    and EngineError, once the file is written, if an engine that is not built in has failed.
    """
    check_recording(path, size)
    camera = Camera(scene, engines, size, showing, inputs)
    if Path(path).suffix == ".png":
        for step in track(steps_of_frames(scene, PICTURE_FPS)):
            camera.go_to(step)
        save_picture(camera.draw(), path)
    else:
        with VIDEO_FORMATS[Path(path).suffix](path, size) as video:
            for step in track(steps_of_frames(scene, video.fps)):
                camera.go_to(step)
                video.add(camera.draw())
    for error in camera.view.session.lockstep.standing().values():
        if isinstance(error, EngineError):
            raise error


def check_recording(path: str, size: tuple[int, int]) -> None:
    """Check the path's ending and the size (px) before anything runs. Raises SandboxError."""
    endings = (".png", *VIDEO_FORMATS)
    if Path(path).suffix not in endings:
        raise SandboxError(f"{path}: must end in one of {', '.join(endings)}")
    if not all(MIN_SIDE <= side <= MAX_SIDE for side in size):
        raise SandboxError(f"--size {size[0]}x{size[1]}: must be from {MIN_SIDE}x{MIN_SIDE} to {MAX_SIDE}x{MAX_SIDE}")


def save_picture(surface: Surface, path: str) -> None:
    """Write a surface as PNG. Raises SandboxError if the file cannot be written."""
    png = io.BytesIO()
    pygame.image.save(surface, png, "picture.png")
    with whole_file(path) as file:
        file.write(png.getvalue())
