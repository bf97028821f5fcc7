"""Saving what the window shows: as a scene, a picture, or the inputs of the run."""

import os
import shlex
from dataclasses import dataclass
from itertools import count

from pygame import Surface

from sandbox.run.inputs import write_run
from sandbox.scene.files import TRUTHS, bundled, dump
from sandbox.scene.model import Scene
from sandbox.view.notice import Notice
from sandbox.view.offscreen import save_picture
from sandbox.view.playback import Playback


@dataclass
class Saver:
    """Writes files into the folder that the window was opened from."""

    _playback: Playback
    _notice: Notice

    def save_scene(self, pane: int) -> None:
        """Save the balls as they are in a pane as a scene, under a name that is free."""
        self._playback.settle()
        view, name = self._playback.view, self.free_name(".toml")
        with self._notice.reporting():
            dump(view.moment.scene, name, view.panes[pane].state)
            self._notice.show_saved(name, f": the balls as in {view.panes[pane].name}")

    def save_inputs(self) -> None:
        """Save what was done up to the step shown, and show the command that replays it."""
        session, name = self._playback.session, self.free_name(".jsonl")
        with self._notice.reporting():
            write_run(session.start, session.given(), session.step, name)
            engines = shlex.quote(",".join(session.names))
            command = f"sandbox run {_argument(session.start)} --engines {engines} --inputs {shlex.quote(name)}"
            self._notice.show_saved(name, f": {command}")

    def free_name(self, ending: str) -> str:
        """Return a name made of the scene, its seed and the step shown, with a number if such a file exists."""
        view = self._playback.view
        name = f"{view.session.start.name}-{view.session.start.seed}-{view.moment.step:06}"
        names = (f"{name}{ending}" if k == 1 else f"{name}-{k}{ending}" for k in count(1))
        return next(name for name in names if not os.path.exists(name))  # noqa: PTH110  (Path's raises if it is too long)

    def save_picture(self, screen: Surface) -> None:
        """Save the window as a picture, under a name that is free."""
        name = self.free_name(".png")
        with self._notice.reporting():
            save_picture(screen, name)
            self._notice.show_saved(name)


def _argument(scene: Scene) -> str:
    """Return how a command names a scene."""
    examples = {file: name for folder in ("", TRUTHS) for name, file in bundled(folder).items()}
    return shlex.quote(examples.get(scene.file, str(scene.file)))
