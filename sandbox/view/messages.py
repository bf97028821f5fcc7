"""What the window says below the panes: a notice, how far engines that run again are, and what is compiled."""

from typing import Final

from pygame import Surface

from sandbox.view.compilation import Compilation
from sandbox.view.compiling import draw_status, status_width
from sandbox.view.layout import Layout
from sandbox.view.notice import Kind, Notice, draw_notice
from sandbox.view.playback import Playback

MIN_MESSAGE: Final = 20  # width of a message beside what is compiled, in heights of the text


class Messages:
    """The messages of a window. waits: something is to be done as soon as engines have run again."""

    def __init__(self, playback: Playback, notice: Notice, compilation: Compilation | None) -> None:
        self._playback = playback
        self._notice = notice
        self._compilation = compilation
        self.waits = False

    def follow_compilation(self) -> bool:
        """Let the compilation go on. Return whether something is still compiled."""
        if self._compilation is None or not self._compilation.is_running:
            return False
        self._compilation.poll()
        return True

    def status(self, recorded: float | None) -> str:
        """Return all that the window says of time and of what was done last. recorded: s, or None."""
        playback = self._playback
        speed = "paused" if playback.paused else playback.pace.text(playback.speed)
        video = "" if recorded is None else f"    {recorded:.1f} s"
        return f"{self._time}    {speed}{video}    {playback.view.charts.note}    {self._progress or self._notice.text}"

    @property
    def _time(self) -> str:
        return f"{self._playback.view.moment.time:.2f} s"

    @property
    def clock(self) -> str:
        """What the stopwatch says, or else the time."""
        zero = self._playback.stopwatch
        return self._time if zero is None else f"{self._playback.view.moment.time - zero:+.3f} s"

    @property
    def _progress(self) -> str:
        """How far engines that run again still are from the current step, or nothing."""
        playback, session = self._playback, self._playback.session
        if session.steps_behind and not (playback.paused and playback.shows_current_step):
            return f"catching up: {session.steps_behind:,} steps to go{', Esc stops' if self.waits else ''}"
        if session.lag and self.waits:
            return f"{session.reference} is catching up: {session.lag:.1f} s to go, Esc stops"
        return ""

    def draw(self, surface: Surface, layout: Layout) -> None:
        """Draw a message, and what is compiled beside it; the message alone if there is no room for both."""
        text, place, height = self._progress or self._notice.text, layout.status.copy(), layout.text_height
        if self._compilation and self._compilation.is_running:
            room = place.width - status_width(self._compilation, height) - height
            if text and room < MIN_MESSAGE * height:
                room = place.width
            else:
                draw_status(surface, place, self._compilation, height)
            place.width = room
        if text:
            draw_notice(surface, place, height, text, Kind.HINT if self._progress else self._notice.kind)
