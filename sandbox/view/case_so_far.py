"""Follows a run and keeps what is to be said of it, as far as it has been compared."""

import webbrowser
from pathlib import Path
from time import monotonic
from typing import Final

from sandbox.errors import SandboxError
from sandbox.report.case import Case
from sandbox.report.run_so_far import RunSoFar
from sandbox.session.session import Session
from sandbox.view.case_worker import CaseWorker
from sandbox.view.notice import Kind, Notice

MAX_REST: Final = 2.0  # s; until then, the worker is busy for half of the time at most


class CaseSoFar:
    """What a worker finds out about the run of a session, again and again while the run goes on.

    case: the latest, None until there is one; compared: the run that it is about. error: why there is no newer one.
    """

    def __init__(self, notice: Notice, worker: CaseWorker | None = None) -> None:
        self._notice = notice
        self._worker = worker or CaseWorker()
        self._asked: RunSoFar | None = None  # what the worker compares
        self._page = ""  # the file that it writes meanwhile
        self._page_wanted = ""  # the file to be written next
        self._asked_at = self._rests_until = 0.0  # s
        self.forget()

    def forget(self) -> None:
        """Forget what was found."""
        self.case: Case | None = None
        self.compared: RunSoFar | None = None
        self.error = ""

    def of(self, session: Session) -> Case | None:
        """Return the latest case, unless it is about another run than a session's, which an event can replace."""
        return self.case if self.compared and self.compared.is_part_of(session) else None

    @property
    def is_making_page(self) -> bool:
        """Whether a page is being made."""
        return bool(self._page or self._page_wanted)

    def make_page(self, file: str) -> None:
        """Write the page of the run so far into a file, once the worker is free."""
        self._page_wanted = file

    def update(self, session: Session) -> bool:
        """Note what the worker has found, and let it go on. Return whether that is news."""
        before, now = (self.case, self.error, self.is_making_page), RunSoFar.of(session)
        if self._asked and (answer := self._worker.poll()):
            self._note(self._asked, answer)
        if self.compared and not self.compared.is_beginning_of(now):
            self.forget()
        if self._asked and not self._page and not self._asked.is_beginning_of(now):
            self.stop()
        if self._asked is None and now.steps and not session.lacks_reference:
            self._ask(now)
        return before != (self.case, self.error, self.is_making_page)

    def _note(self, run: RunSoFar, answer: Case | SandboxError) -> None:
        now = monotonic()
        self._rests_until = now + min(now - self._asked_at, MAX_REST)
        self._asked = None
        self.compared = run
        if isinstance(answer, SandboxError):
            self.error = str(answer)
        else:
            self.case, self.error = answer, ""
        if self._page:
            if self.error:
                self._notice.show(self.error, Kind.ERROR)
            else:
                self._notice.show_saved(self._page)
                webbrowser.open(Path(self._page).absolute().as_uri())
            self._page = ""

    def _ask(self, run: RunSoFar) -> None:
        """Let the worker compare a run, unless it has just done so."""
        if self._page_wanted or (run != self.compared and monotonic() >= self._rests_until):
            self._page, self._page_wanted = self._page_wanted, ""
            self._asked, self._asked_at = run, monotonic()
            self._worker.ask(run, self._page or None)

    def stop(self) -> None:
        """End what the worker does."""
        self._worker.stop()
        self._asked, self._page = None, ""
