"""Saving what the window shows: the balls as a scene, the window as a picture."""

import os
from itertools import count

from pygame import Surface

from sandbox.scene.files import write
from sandbox.view.notice import Notice
from sandbox.view.picture import save_picture
from sandbox.view.playback import Playback


class Saver:
    """Writes files into the folder that the window was opened from."""

    def __init__(self, playback: Playback, notice: Notice) -> None:
        self._playback = playback
        self._notice = notice

    def file_name(self, ending: str) -> str:
        """Return a file's name made of the scene, its seed and the step shown."""
        view = self._playback.view
        return f"{view.session.start.name}-{view.session.start.seed}-{view.moment.step:06}{ending}"

    def save_scene(self, pane: int) -> None:
        """Save the balls as they are in a pane as a scene, under a name that is free."""
        self._playback.settle()
        view = self._playback.view
        names = (self.file_name(".toml" if k == 1 else f"-{k}.toml") for k in count(1))
        name = next(name for name in names if not os.path.exists(name))  # noqa: PTH110  (Path's raises if it is too long)
        with self._notice.reporting():
            write(view.moment.scene, view.panes[pane].state, name)
            self._notice.show_saved(name, f": the balls as in {view.panes[pane].name}")

    def save_picture(self, screen: Surface) -> None:
        """Save the window as a picture."""
        name = self.file_name(".png")
        with self._notice.reporting():
            save_picture(screen, name)
            self._notice.show_saved(name)
