"""Recording what the window shows, at the pace at which it shows it."""

from pygame import Surface

from sandbox.errors import SandboxError
from sandbox.view.notice import Kind, Notice
from sandbox.view.video import Gif, Video


class Recorder:
    """Records the window as a GIF. While the window is paused, nothing is recorded."""

    def __init__(self, notice: Notice) -> None:
        self._notice = notice
        self.video: Video | None = None  # that is being recorded

    @property
    def seconds(self) -> float | None:
        """The length of what is recorded so far, s; None while nothing is being recorded."""
        return self.video.frames / self.video.fps if self.video else None

    def toggle(self, path: str, size: tuple[int, int]) -> None:
        """Start recording into a file, in a size in px; or stop."""
        if self.video:
            self.stop()
        else:
            with self._notice.reporting():
                self.video = Gif(path, size)

    def add_frame(self, screen: Surface) -> None:
        """Record the window as it is now, if it is being recorded; a change of its size ends the recording."""
        video = self.video
        if video and video.size != screen.get_size():
            self.stop()
        elif video:
            try:
                video.add(screen)
            except SandboxError as error:
                video.discard()
                self.video = None
                self._notice.show(str(error), Kind.ERROR)

    def stop(self) -> None:
        """Save the recording, if there is one."""
        video, self.video = self.video, None
        if video and not video.frames:
            video.discard()
            self._notice.show("nothing was recorded: a window that is paused is not")
        elif video:
            with self._notice.reporting():
                video.save()
                self._notice.show_saved(video.path)
