"""The scenes that can be opened: the bundled ones page by page, those of the picker, and files, which are watched."""

from collections.abc import Callable, Sequence
from pathlib import Path
from time import monotonic

from sandbox.errors import Refused, SandboxError
from sandbox.scene.files import bundled, load
from sandbox.scene.model import Scene
from sandbox.view.file_watcher import EVERY, FileWatcher
from sandbox.view.scene_picker import ScenePicker


class SceneLoader:
    """Opens scenes.

    named: the engines that a person asked for, which run every scene that they can honour. begin: runs a scene in
    engines, or its own; it raises SandboxError, with the old one still running, if it cannot. tell: shows a message.
    """

    def __init__(
        self,
        scene: Scene,
        named: Sequence[str] | None,
        begin: Callable[[Scene, Sequence[str] | None], None],
        tell: Callable[[str], None],
    ) -> None:
        self._named = named
        self._begin = begin
        self._tell = tell
        self.picker: ScenePicker | None = None  # while it is open
        self._opened(scene)

    def _opened(self, scene: Scene) -> None:
        self._scene = scene
        self.mistake = ""  # in a file that was to be opened
        self._watch = FileWatcher(scene.file)
        self._looks_at = monotonic() + EVERY  # s, when the file is looked at next

    def try_to_begin(self, scene: Scene) -> None:
        """Run another scene; where the named engines cannot, run its own, and say why."""
        try:
            self._run(scene)
        except SandboxError as mistake:
            self._tell(str(mistake))

    def open(self, file: Path) -> None:
        """Run the scene of a file; what is wrong with it is kept to be shown, while the old one runs on."""
        self.close_picker()
        try:
            self._run(load(file))
        except SandboxError as mistake:
            self.mistake = str(mistake)

    def _run(self, scene: Scene) -> None:
        try:
            self._begin(scene, self._named)
        except Refused as refusal:
            self._begin(scene, None)
            self._tell(str(refusal))
        self._opened(scene)

    def look_at_file(self) -> bool:
        """Open the scene's file again where it has been edited; tell whether it has."""
        if monotonic() < self._looks_at:
            return False
        self._looks_at = monotonic() + EVERY
        changed = self._watch.changed()
        if changed:
            self.open(self._watch.file)
        return changed

    # What keys and buttons ask for

    def next_seed(self) -> None:
        """Start the scene again with the next seed."""
        try:
            self._run(self._scene.changed(seed=self._scene.seed + 1))
        except SandboxError as mistake:  # there is a largest seed
            self._tell(str(mistake))

    def next_scene(self) -> None:
        """Go on to the next bundled scene."""
        self._turn_to(1)

    def previous_scene(self) -> None:
        """Go back to the bundled scene before."""
        self._turn_to(-1)

    def _turn_to(self, by: int) -> None:
        names = list(bundled())
        here = names.index(self._scene.name) if self._scene.name in names else -1 if by > 0 else 0
        self.try_to_begin(load(names[(here + by) % len(names)]))

    def pick(self) -> None:
        """Open the picker of scenes."""
        self.picker = ScenePicker(self.open, self.close_picker)

    def close_picker(self) -> None:
        """Close the picker of scenes."""
        self.picker = None
