"""Record the run of a scene as a video, or its end as a picture, without a window."""

from collections.abc import Callable, Collection, Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final

from pygame import Surface

from sandbox.errors import EngineError, SandboxError
from sandbox.report.run_so_far import ComparisonSoFar, RunSoFar
from sandbox.run.inputs import Input
from sandbox.scene.model import Scene
from sandbox.view.layers import Layer
from sandbox.view.layout import Layout
from sandbox.view.picture import save_picture
from sandbox.view.primitives import write
from sandbox.view.session_view import SessionView
from sandbox.view.theme import theme
from sandbox.view.video import VIDEO_FORMATS

MIN_SIDE: Final = 64  # px
MAX_SIDE: Final = 8192  # px
MARKED_STEPS: Final = 15  # that are compared at once, at least
MARKED_SHARE: Final = 1.02  # by which a run has grown when it is compared again, so that long ones do not take longer
PICTURE_FPS: Final = 60  # samples of trails and charts per second, for a picture


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
        self.scene = scene
        self.showing = showing
        self.view = SessionView(scene, engines, inputs)
        self._so_far, self._compared = ComparisonSoFar(), 0
        self.surface = Surface(size)
        self.layout = Layout(
            size, scene.arena.size, len(self.view.panes), has_chart=bool(self.view.chart_count(showing))
        )

    def go_to(self, step: int) -> None:
        """Run to a step and update what is drawn."""
        while self.view.session.step < step:
            self.view.session.advance()
        self.view.update()

    def draw(self) -> Surface:
        """Draw the current step, and return the surface."""
        if Layer.CHARTS in self.showing:
            self._mark()
        layout, moment = self.layout, self.view.moment
        self.surface.fill(theme.ground)
        self.view.draw(self.surface, layout, self.showing)
        caption = f"{self.scene.title or self.scene.name}    seed {self.scene.seed}    {moment.time:.2f} s"
        write(self.surface, caption, layout.status, theme.dim, layout.text_height)
        return self.surface

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
    for pane in camera.view.panes:
        if isinstance(pane.failure, EngineError):
            raise pane.failure


def check_recording(path: str, size: tuple[int, int]) -> None:
    """Check the path's ending and the size (px) before anything runs. Raises SandboxError."""
    endings = (".png", *VIDEO_FORMATS)
    if Path(path).suffix not in endings:
        raise SandboxError(f"{path}: must end in one of {', '.join(endings)}")
    if not all(MIN_SIDE <= side <= MAX_SIDE for side in size):
        raise SandboxError(f"--size {size[0]}x{size[1]}: must be from {MIN_SIDE}x{MIN_SIDE} to {MAX_SIDE}x{MAX_SIDE}")
