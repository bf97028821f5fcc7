"""Opens other scenes: the bundled ones in turn, those chosen in the picker, and files, which are watched for edits."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from time import monotonic
from typing import Final

from sandbox.errors import Refused, SandboxError
from sandbox.files import MAX_TEXT_FILE_BYTES
from sandbox.scene.files import bundled, load
from sandbox.scene.model import Scene
from sandbox.view.notice import Notice, NoticeKind
from sandbox.view.offscreen import Previews
from sandbox.view.scene_picker import ScenePicker

CHECK_INTERVAL: Final = 0.2  # s between two checks of the file


class SceneLoader:
    """Opens scenes. While the next one cannot be run, the current one keeps running.

    engines: those named by the user; they run in every scene that they accept. begin: runs a scene in engines, or in
    its default ones if None; it raises SandboxError, and changes nothing, if it cannot.
    """

    def __init__(
        self,
        scene: Scene,
        engines: Sequence[str] | None,
        begin: Callable[[Scene, Sequence[str] | None], None],
        notice: Notice,
    ) -> None:
        self.engines = engines
        self._begin = begin
        self._notice = notice
        self.picker: ScenePicker | None = None  # while it is open
        self._previews = Previews()
        self._opened(scene)

    def _opened(self, scene: Scene) -> None:
        self._scene = scene
        self.error = ""  # of a file that could not be opened since
        self._content = b""  # of the file, when it was last read
        self._has_changed()

    def try_to_run(self, scene: Scene) -> None:
        """Run another scene; if that is impossible, show a notice."""
        with self._notice.reporting():
            self._run(scene)

    def open_file(self, file: Path) -> None:
        """Run the scene of a file; if that is impossible, keep the errors to be shown."""
        self.close_picker()
        try:
            self._run(load(file))
        except SandboxError as error:
            self.error = str(error)

    def _run(self, scene: Scene) -> None:
        try:
            self._begin(scene, self.engines)
        except Refused as refusal:
            self._begin(scene, None)
            self._notice.show(str(refusal), NoticeKind.ERROR)
        self._opened(scene)

    def _has_changed(self) -> bool:
        """Return whether the file's content has changed since the last call; not while the file cannot be read."""
        self._next_check, before = monotonic() + CHECK_INTERVAL, self._content
        with suppress(OSError), self._scene.file.open("rb") as file:
            self._content = file.read(MAX_TEXT_FILE_BYTES + 1)
        return self._content != before

    def reload_if_edited(self) -> bool:
        """Open the scene's file again if it has been edited. Return whether it has."""
        is_edited = monotonic() >= self._next_check and self._has_changed()
        if is_edited:
            self.open_file(self._scene.file)
        return is_edited

    def next_seed(self) -> None:
        """Restart the scene with the next seed."""
        with self._notice.reporting():  # the largest seed has no next one
            self._run(self._scene.changed(seed=self._scene.seed + 1))

    def open_bundled(self, by: int) -> None:
        """Open the bundled scene so many after the current one, or before it if negative."""
        names = list(bundled())
        here = names.index(self._scene.name) if self._scene.name in names else -1 if by > 0 else 0
        self.try_to_run(load(names[(here + by) % len(names)]))

    def open_picker(self) -> None:
        """Open the scene picker, with the scenes of this folder and of that of the current one."""
        folders = dict.fromkeys(folder.resolve() for folder in (Path(), self._scene.file.parent))
        self.picker = ScenePicker(folders, self.open_file, self.close_picker, self._previews)

    def close_picker(self) -> None:
        """Close the scene picker."""
        self.picker = None
