"""A scene's run as a film, or as a picture of its end, without a window."""

from collections.abc import Callable, Collection, Iterable, Sequence
from pathlib import Path
from typing import Final

from pygame import Surface

from sandbox.errors import SandboxError, nearest
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
LEAST: Final = 64  # px of a film's sides
MOST: Final = 8192
PICTURE_FPS: Final = 60  # how often trails and charts look, for a picture


class Camera:
    """Takes pictures of a running scene, in some size, px."""

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
        self.stage = SessionView(scene, engines, inputs)
        self.surface = Surface(size)
        self.layout = Layout(size, scene.arena.size, len(self.stage.panes), charts=self.stage.chart_count(showing))

    def go_to(self, step: int) -> None:
        """Run to a step, and look at it."""
        while self.stage.session.step < step:
            self.stage.session.advance()
        self.stage.update()

    def draw(self) -> Surface:
        """Draw what is to be seen now."""
        layout, moment = self.layout, self.stage.moment
        self.surface.fill(FRAME)
        self.stage.draw(self.surface, layout, self.showing)
        caption = f"{self.scene.title or self.scene.name}    seed {self.scene.seed}    {moment.time:.2f} s"
        write(self.surface, caption, layout.status, FAINT, layout.text_height)
        return self.surface


def steps_of_frames(scene: Scene, fps: int) -> list[int]:
    """Return the step that each frame shows: the latest by then, and in the last frame the last."""
    frames = round(scene.steps * fps / scene.rate)
    return [*(k * scene.rate // fps for k in range(frames)), scene.steps]


def record(
    scene: Scene,
    engines: Sequence[str] | None,
    path: str,
    size: tuple[int, int],
    showing: Collection[str],
    inputs: Sequence[Input] = (),
    watched: Callable[[Sequence[int]], Iterable[int]] = iter,
) -> None:
    """Run a scene for its seconds, and write it as .gif, .webp or .mp4, or its end as .png, by the path's ending.

    watched: passes the frames' steps on, and may show progress. Raises SandboxError for what cannot be recorded.
    """
    camera = Camera(scene, engines, size, check(path, size, showing), inputs)
    if Path(path).suffix == ".png":
        for step in watched(steps_of_frames(scene, PICTURE_FPS)):
            camera.go_to(step)
        save_picture(camera.draw(), path)
        return
    with FILMS[Path(path).suffix](path, size) as film:
        for step in watched(steps_of_frames(scene, film.fps)):
            camera.go_to(step)
            film.add(camera.draw())


def check(path: str, size: tuple[int, int], showing: Collection[str]) -> set[Layer]:
    """Find what cannot be recorded before anything runs, and return the layers. Raises SandboxError."""
    endings = (".png", *FILMS)
    if Path(path).suffix not in endings:
        raise SandboxError(f"{path}: a recording must end in one of {', '.join(endings)}")
    if not all(LEAST <= side <= MOST for side in size):
        raise SandboxError(f"--size {size[0]}x{size[1]}: must be from {LEAST}x{LEAST} to {MOST}x{MOST}")
    for name in showing:
        if name not in SHOWN:
            raise SandboxError(f"--show {name}: nothing of that name can be shown; {nearest(name, SHOWN)}")
    return {Layer(name) for name in showing}
