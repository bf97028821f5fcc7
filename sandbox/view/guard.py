"""What is drawn, and what handles an event, may fail: it then switches itself off, and the run goes on."""

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final, TypeVar

from sandbox.view.events import Stopped
from sandbox.view.notice import Kind, Notice

LOG: Final = logging.getLogger("sandbox.view")
Result = TypeVar("Result")


class Guard:
    """Runs parts of the drawing; one that raises an exception is left out from then on, until `try_again`.

    strict: whether exceptions are raised, as tests want it.
    """

    strict = False

    def __init__(self, notice: Notice) -> None:
        self._notice = notice
        self._failed: list[str] = []

    @property
    def failed(self) -> tuple[str, ...]:
        """The parts that are switched off."""
        return tuple(self._failed)

    def run(self, name: str, draw: Callable[..., Result], *given: object) -> Result | None:
        """Call what draws a part, or says where it is; nothing of it if that failed before."""
        if name in self._failed:
            return None
        try:
            return draw(*given)
        except (Stopped, SystemExit, KeyboardInterrupt):
            raise
        except Exception as error:
            if self.strict:
                raise
            self._switch_off(name, error)
            return None

    @contextmanager
    def reporting(self, part: Callable[[], str]) -> Iterator[None]:
        """Report what fails while an event is handled. part: the part that did it and is switched off, or nothing."""
        try:
            yield
        except (Stopped, SystemExit, KeyboardInterrupt):
            raise
        except Exception as error:
            if self.strict:
                raise
            if name := part():
                self._switch_off(name, error)
            else:
                LOG.exception("an event failed")
                self._notice.show(f"That failed, and the run goes on: {error}", Kind.ERROR)

    def _switch_off(self, name: str, error: Exception) -> None:
        LOG.exception("%s failed", name)
        self._failed.append(name)
        text = f"{name} failed and is switched off, the run goes on; restart (R) shows it again: {error}"
        self._notice.show(f"{text[0].upper()}{text[1:]}", Kind.ERROR)

    def try_again(self) -> None:
        """Show the parts again that failed."""
        self._failed.clear()
