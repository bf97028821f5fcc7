"""Recording what the window shows, at the pace at which it shows it."""

from pygame import Surface

from sandbox.errors import SandboxError
from sandbox.view.film import Film, Gif
from sandbox.view.notice import Notice


class Recorder:
    """Records the window as a GIF. While the window is paused, nothing is recorded."""

    def __init__(self, notice: Notice) -> None:
        self._notice = notice
        self.film: Film | None = None  # that is being recorded

    def toggle(self, path: str, size: tuple[int, int]) -> None:
        """Start recording into a file, in a size in px; or stop."""
        if self.film:
            self.stop()
        else:
            with self._notice.reporting():
                self.film = Gif(path, size)

    def add_frame(self, screen: Surface) -> None:
        """Record the window as it is now, if it is being recorded; a change of its size ends the recording."""
        film = self.film
        if film and film.size != screen.get_size():
            self.stop()
        elif film:
            try:
                film.add(screen)
            except SandboxError as error:
                film.discard()
                self.film = None
                self._notice.show(str(error))

    def stop(self) -> None:
        """Save the recording, if there is one."""
        film, self.film = self.film, None
        if film:
            with self._notice.reporting():
                film.save()
                self._notice.show(f"saved {film.path}")
