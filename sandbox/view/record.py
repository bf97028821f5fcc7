"""Record the run of a scene as a film, or its end as a picture, without a window."""

from collections.abc import Callable, Collection, Iterable, Sequence
from pathlib import Path
from typing import Final

from pygame import Surface

from sandbox.errors import SandboxError, suggestion
from sandbox.run.inputs import Input
from sandbox.scene.model import Scene
from sandbox.view.film import FILMS
from sandbox.view.layers import Layer
from sandbox.view.layout import Layout
from sandbox.view.palette import FAINT, FRAME
from sandbox.view.picture import save_picture
from sandbox.view.primitives import write
from sandbox.view.session_view import SessionView

SHOWN: Final = tuple(Layer)
MIN_SIDE: Final = 64  # px
MAX_SIDE: Final = 8192  # px
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
        self.surface = Surface(size)
        self.layout = Layout(size, scene.arena.size, len(self.view.panes), charts=self.view.chart_count(showing))

    def go_to(self, step: int) -> None:
        """Run to a step and update what is drawn."""
        while self.view.session.step < step:
            self.view.session.advance()
        self.view.update()

    def draw(self) -> Surface:
        """Draw the current step, and return the surface."""
        layout, moment = self.layout, self.view.moment
        self.surface.fill(FRAME)
        self.view.draw(self.surface, layout, self.showing)
        caption = f"{self.scene.title or self.scene.name}    seed {self.scene.seed}    {moment.time:.2f} s"
        write(self.surface, caption, layout.status, FAINT, layout.text_height)
        return self.surface


def steps_of_frames(scene: Scene, fps: int) -> list[int]:
    """Return the step that each frame shows: the latest by its time, and the last step in the last frame."""
    frames = round(scene.steps * fps / scene.rate)
    return [*(k * scene.rate // fps for k in range(frames)), scene.steps]


def record(
    scene: Scene,
    engines: Sequence[str] | None,
    path: str,
    size: tuple[int, int],
    showing: Collection[str],
    inputs: Sequence[Input] = (),
    track: Callable[[Sequence[int]], Iterable[int]] = iter,
) -> None:
    """Run a scene for its seconds and write a film, or for .png its end, in the format of the path's ending.

    track: yields the frames' steps, and may show progress. Raises SandboxError for what cannot be recorded.
    """
    camera = Camera(scene, engines, size, check(path, size, showing), inputs)
    if Path(path).suffix == ".png":
        for step in track(steps_of_frames(scene, PICTURE_FPS)):
            camera.go_to(step)
        save_picture(camera.draw(), path)
        return
    with FILMS[Path(path).suffix](path, size) as film:
        for step in track(steps_of_frames(scene, film.fps)):
            camera.go_to(step)
            film.add(camera.draw())


def check(path: str, size: tuple[int, int], showing: Collection[str]) -> set[Layer]:
    """Check path, size and layers before anything runs, and return the layers. Raises SandboxError."""
    endings = (".png", *FILMS)
    if Path(path).suffix not in endings:
        raise SandboxError(f"{path}: must end in one of {', '.join(endings)}")
    if not all(MIN_SIDE <= side <= MAX_SIDE for side in size):
        raise SandboxError(f"--size {size[0]}x{size[1]}: must be from {MIN_SIDE}x{MIN_SIDE} to {MAX_SIDE}x{MAX_SIDE}")
    for name in showing:
        if name not in SHOWN:
            raise SandboxError(f"--show {name}: is not something to show; {suggestion(name, SHOWN)}")
    return {Layer(name) for name in showing}
