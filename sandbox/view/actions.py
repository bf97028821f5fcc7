"""What the actions do that are about the run: time, scenes, saving, edits and tools."""

from collections.abc import Callable
from functools import partial

from sandbox.view.controls import Action
from sandbox.view.editor import Editor
from sandbox.view.mouse_tool import ZOOM_FACTOR, MouseTool
from sandbox.view.playback import Playback, Snapshots
from sandbox.view.saver import Saver
from sandbox.view.scene_loader import SceneLoader


def actions_of_run(
    playback: Playback, snapshots: Snapshots, scenes: SceneLoader, saver: Saver, editor: Editor, mouse: MouseTool
) -> dict[Action, Callable[[], None]]:
    """Return what each of them does."""
    return {
        Action.GO_TO_START: partial(playback.seek, 0),
        Action.STEP_BACK: playback.step_back,
        Action.PAUSE: playback.pause,
        Action.STEP: playback.step,
        Action.GO_TO_END: lambda: playback.seek(playback.session.end),
        Action.SECOND_BACK: partial(playback.skip, -1),
        Action.SECOND_FORWARD: partial(playback.skip, 1),
        Action.STOPWATCH: playback.toggle_stopwatch,
        Action.TAKE_SNAPSHOT: snapshots.take,
        Action.RETURN: snapshots.return_to_latest,
        Action.SLOWER: playback.slower,
        Action.FASTER: playback.faster,
        Action.PICK_SCENE: scenes.open_picker,
        Action.PREVIOUS_SCENE: partial(scenes.open_bundled, -1),
        Action.NEXT_SCENE: partial(scenes.open_bundled, 1),
        Action.NEXT_SEED: scenes.next_seed,
        Action.SAVE_SCENE: lambda: saver.save_scene(mouse.pane or 0),
        Action.SAVE_INPUTS: saver.save_inputs,
        Action.COPY_CODE: lambda: saver.copy_code(mouse.pane or 0),
        Action.UNDO: editor.undo,
        Action.REDO: editor.redo,
        Action.ADD_BALL: mouse.add_ball,
        Action.DELETE_BALL: mouse.delete_ball,
        Action.NEXT_TOOL: mouse.choose_next,
        Action.COOL: editor.cool,
        Action.HEAT: editor.heat,
        Action.SHOW_ALL: mouse.show_all,
        Action.ZOOM_IN: partial(mouse.zoom_by, ZOOM_FACTOR),
        Action.ZOOM_OUT: partial(mouse.zoom_by, 1 / ZOOM_FACTOR),
    }
