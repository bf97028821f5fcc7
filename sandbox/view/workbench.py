"""A run and what acts on it: the mouse and edits, other scenes and engines, and what saves it."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from functools import partial
from typing import Final

from sandbox.run.inputs import Input
from sandbox.scene.model import Scene
from sandbox.view.controls import Action
from sandbox.view.editor import Editor
from sandbox.view.engines_page import LineUp
from sandbox.view.layers import Layer
from sandbox.view.layout import Layout
from sandbox.view.mouse_tool import ZOOM_FACTOR, MouseTool
from sandbox.view.notice import Guard, Notice
from sandbox.view.playback import Playback, Snapshots
from sandbox.view.saver import Saver
from sandbox.view.scene_loader import SceneLoader
from sandbox.view.session_view import SessionView
from sandbox.view.video import Recorder

MOST_BALLS: Final = {  # of a scene that opens with a layer; of more balls, outlines and numbers hide them
    Layer.CHARTS: math.inf,
    Layer.GHOSTS: 300,
    Layer.NUMBERS: 30,
}


def opens_with(scene: Scene) -> set[Layer]:
    """Return the layers that a scene opens with."""
    return {layer for layer, most in MOST_BALLS.items() if len(scene.bodies) <= most}


class Workbench(ABC):
    """A run and what acts on it, without what shows it. showing: the layers. Arguments: as for `Window`."""

    def __init__(self, scene: Scene, engines: Sequence[str] | None, inputs: Sequence[Input], *, beside: bool) -> None:
        self.notice = Notice()
        self.guard = Guard(self.notice)
        self.playback = Playback(SessionView(scene, engines, inputs, beside=beside), self.notice, self.show_progress)
        self.editor = Editor(self.playback, self.notice, self._replace_engines)
        self.mouse = MouseTool(self.playback, self.editor, lambda: self.layout)
        self.scenes = SceneLoader(scene, engines, self.begin, self.notice)
        self.line_up = LineUp(self.playback, self.notice, self.use_engines)
        self.saver = Saver(self.playback, self.notice)
        self.recorder = Recorder(self.notice)
        self.snapshots = Snapshots(self.playback, self.notice)
        self.showing = opens_with(scene)

    @property
    @abstractmethod
    def layout(self) -> Layout:
        """The places of what is shown."""

    @abstractmethod
    def show_progress(self) -> None:
        """Show how far engines that run again are, while nothing else can be done. Raises Stopped to stop that."""

    @property
    def view(self) -> SessionView:
        """The session that runs, with its panes and charts."""
        return self.playback.view

    @property
    def scene(self) -> Scene:
        """The scene at the start of the run."""
        return self.view.session.start

    def begin(self, scene: Scene, engines: Sequence[str] | None) -> None:
        """Run a scene from its start. Raises SandboxError, with the old one still running, if that is impossible."""
        size, before = self.scene.arena.size, opens_with(self.scene)
        if scene != self.scene:
            self.snapshots.forget()
        self.playback.stopwatch = None
        view = SessionView(scene, engines, beside=self.view.session.beside)
        self.view.session.stop()
        self.playback.play(view)
        if scene.arena.size != size:
            self.mouse.show_all()
        self.showing ^= {  # unless it was chosen otherwise
            layer for layer in before ^ opens_with(scene) if (layer in before) == (layer in self.showing)
        }
        self.editor.select(None)
        self.editor.forget_engines()
        self.mouse.reset()
        self.notice.clear()
        self.guard.try_again()

    def use_engines(self, names: Sequence[str]) -> None:
        """Let other engines run instead, from now on in every scene; if one refuses this run, show why."""
        if self._replace_engines(names):
            self.scenes.engines = names
            self.editor.forget_engines()
            self.notice.go_stale()  # such as the error of a name typed wrongly before

    def _replace_engines(self, names: Sequence[str]) -> bool:
        """Let other engines run in this run. Return whether they do."""
        self.mouse.release()
        return self.playback.use_engines(names)

    def actions_of_run(self) -> dict[Action, Callable[[], None]]:
        """Return what the actions do that are about the run."""
        return {
            Action.GO_TO_START: partial(self.playback.seek, 0),
            Action.STEP_BACK: self.playback.step_back,
            Action.PAUSE: self.playback.pause,
            Action.STEP: self.playback.step,
            Action.GO_TO_END: lambda: self.playback.seek(self.playback.session.end),
            Action.SECOND_BACK: partial(self.playback.skip, -1),
            Action.SECOND_FORWARD: partial(self.playback.skip, 1),
            Action.RESTART: lambda: self.begin(self.scene, self.view.session.names),
            Action.STOPWATCH: self.playback.toggle_stopwatch,
            Action.TAKE_SNAPSHOT: self.snapshots.take,
            Action.RETURN: self.snapshots.return_to_latest,
            Action.SLOWER: self.playback.slower,
            Action.FASTER: self.playback.faster,
            Action.PICK_SCENE: self.scenes.open_picker,
            Action.PREVIOUS_SCENE: partial(self.scenes.open_bundled, -1),
            Action.NEXT_SCENE: partial(self.scenes.open_bundled, 1),
            Action.NEXT_SEED: self.scenes.next_seed,
            Action.SAVE_SCENE: lambda: self.saver.save_scene(self.mouse.pane or 0),
            Action.SAVE_INPUTS: self.saver.save_inputs,
            Action.COPY_CODE: lambda: self.saver.copy_code(self.mouse.pane or 0),
            Action.UNDO: self.editor.undo,
            Action.REDO: self.editor.redo,
            Action.ADD_BALL: self.mouse.add_ball,
            Action.DELETE_BALL: self.mouse.delete_ball,
            Action.NEXT_TOOL: self.mouse.choose_next,
            Action.COOL: self.editor.cool,
            Action.HEAT: self.editor.heat,
            Action.USE_IMPULSE: self.line_up.use_impulse,
            Action.SHOW_ALL: self.mouse.show_all,
            Action.ZOOM_IN: partial(self.mouse.zoom_by, ZOOM_FACTOR),
            Action.ZOOM_OUT: partial(self.mouse.zoom_by, 1 / ZOOM_FACTOR),
        }
