"""The page of the side panel that says why engines differ: the ledger, the words of `compare`, and contacts."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache, partial
from typing import Final

from pygame import Color

from sandbox.analysis.difference import MAX_DIFFERENCES, Difference
from sandbox.judge.causes import Cause
from sandbox.scene.fields import rgb
from sandbox.view.case_so_far import Case, CaseSoFar, LedgerLine, OtherContact
from sandbox.view.contact_mark import ContactPicture
from sandbox.view.controls import Action
from sandbox.view.playback import Playback
from sandbox.view.run_so_far import Marks
from sandbox.view.session_view import energy_in_words
from sandbox.view.theme import palette, theme
from sandbox.view.toolbars import action_button
from sandbox.view.widgets import Bar, TextButton, Widget, Words
from sandbox.view.widgets.group import rows_of

BUTTONS_IN_ROW: Final = 3
NOTHING_YET: Final = "Nothing has happened yet."
COMPARING: Final = "Comparing …"
LEGEND: Final = (
    "{engine} in its colour, {against} in {ink}. Lines are the normal, dashed ones that of first touch. Thin arrows, "
    "which end at their ball, are velocities before the contact, thick ones those after it."
)
OF_ALL: Final = "in % of the largest kinetic energy of all that is compared"
OF_SCENE: Final = "What the scene and the mouse took or gave, rightly:"
SCENES_OWN: Final = tuple(  # labels of the causes that no engine is blamed for
    cause.label for cause in (Cause.ELASTICITY, Cause.FRICTION, Cause.SPIN, Cause.APPLIED)
)

Row = Sequence[Widget]


class WhyPage:
    """Says why an engine differs from the reference, in the words of `compare`, and draws its contacts, one at a time.

    do: does an action.
    """

    def __init__(self, playback: Playback, case: CaseSoFar, do: Callable[[Action], None]) -> None:
        self.case = case
        self._playback = playback
        self._chosen = ""  # engine
        self._gone_to: OtherContact | None = None
        self._button = cache(self._make_button)
        self._headline = Words("", bold=True, scale=1.3)
        self._buttons = [action_button(action, do) for action in (Action.PREVIOUS_CONTACT, Action.NEXT_CONTACT)]

    @property
    def engine(self) -> str:
        """The engine that the page speaks of: the one chosen, or that whose energy is most wrong."""
        engines = self._case.engines if self._case else {}
        if self._chosen in engines:
            return self._chosen
        errors = self._playback.view.energy_errors
        return max(engines, key=lambda name: (abs(errors.get(name, 0.0)), bool(engines[name].contacts)), default="")

    @property
    def contact(self) -> OtherContact | None:
        """The contact that is drawn: the one that was gone to, while its step is shown."""
        contact = self._gone_to
        is_shown = contact and contact.step == self._playback.view.moment.step and contact in self._contacts
        return contact if is_shown else None

    @property
    def marks(self) -> Marks:
        """What has stood out in the run, as far as it has been compared."""
        return self._case.marks if self._case else Marks()

    @property
    def _case(self) -> Case | None:
        return self.case.of(self._playback.session)

    @property
    def _contacts(self) -> tuple[OtherContact, ...]:
        return self._case.engines[self.engine].contacts if self._case and self.engine else ()

    def update(self) -> bool:
        """Let the comparison go on. Return whether it has news."""
        return self.case.update(self._playback.session)

    # What it does

    def choose(self, engine: str) -> None:
        """Speak of another engine."""
        self._chosen, self._gone_to = engine, None

    def show(self, contact: OtherContact) -> None:
        """Pause, go to a contact, and draw it."""
        self._gone_to = contact
        self._playback.paused = True
        self._playback.seek(contact.step)

    def show_next(self, by: int) -> bool:
        """Show the next contact that differs, from the one shown or from this step; the previous if by < 0.

        Return whether there is one.
        """
        contacts, here = self._contacts, self._playback.session.step
        if self.contact:
            at = contacts.index(self.contact) + by
        else:
            at = sum(contact.step <= here if by > 0 else contact.step < here for contact in contacts) - (by < 0)
        is_there = 0 <= at < len(contacts)
        if is_there:
            self.show(contacts[at])
        return is_there

    # What it says

    def rows(self) -> Sequence[Row]:
        """Return the rows of its widgets."""
        case, engine, shown = self._case, self.engine, self.contact
        status = self._say(self._status, theme.dim)
        besides = [self._say(line) for line in case.besides] if case else []
        if not case or not engine:  # the reference alone has nothing that differs from it
            return [status, self._buttons, *besides]
        of_engine = case.engines[engine]
        error = self._playback.view.energy_errors.get(engine, 0.0)
        self._headline.text = f"{engine}: {energy_in_words(error, self._playback.view.beside)}"
        rows: list[Row] = [*self._choices(case.engines), [self._headline], status, self._buttons]
        rows += [self._say(self._count(of_engine.contacts), theme.dim)] if of_engine.contacts else []
        if shown:
            rows += [self._sentence(shown), [self._picture(shown.difference)]]
            rows += [self._say(line, theme.dim) for line in (*shown.speeds.splitlines(), self._legend)]
        rows += self._ledger_rows(of_engine.ledger)
        return [*rows, *map(self._say, of_engine.lines), *besides]

    def _say(self, text: str, colour: Color | None = None) -> Row:
        return [Words(text, colour=colour)]

    def _sentence(self, contact: OtherContact) -> Row:
        """Return the sentence of a contact, after the colours of its balls."""
        colours = self._playback.scene.colors
        balls = (ball for ball in contact.difference.balls if ball < len(colours))  # that are still there
        return [Words(contact.sentence, dots=tuple(Color(*rgb(colours[ball])) for ball in balls))]

    def _count(self, contacts: Sequence[OtherContact]) -> str:
        """How many contacts differ, and which of them is shown."""
        count, reference = len(contacts), self._playback.session.reference
        until = f" up to {contacts[-1].time:.3f} s" if count == MAX_DIFFERENCES else ""
        if self.contact:
            return f"Contact {contacts.index(self.contact) + 1} of {count} unlike {reference}'s{until}"
        return f"{count} contact{'s differ' if count > 1 else ' differs'} from {reference}{until}"

    @property
    def _legend(self) -> str:
        ink = palette(self._playback.scene.arena.background).ink
        colour = "white" if ink == Color("white") else "black"
        return LEGEND.format(engine=self.engine, against=self._playback.session.reference, ink=colour)

    def _ledger_rows(self, lines: Sequence[LedgerLine]) -> Iterator[Row]:
        """Yield the engine's own errors as bars, and then what the scene takes and gives."""
        largest = max((abs(line.share) for line in lines), default=0.0) or 1.0
        titles = {False: f"What {self.engine} lost or made, {OF_ALL}:", True: OF_SCENE}
        for is_of_scene, title in titles.items():
            some = [line for line in lines if (line.cause in SCENES_OWN) == is_of_scene]
            yield from ([self._say(title, theme.dim)] if some else [])
            for line in some:
                colour = self._playback.view.charts.colours[self.engine]
                yield [Bar(line.cause, line.text, line.share / largest, colour)]

    @property
    def _status(self) -> str:
        """How far the comparison has got, in words."""
        session, case, compared = self._playback.session, self._case, self.case.compared
        if self.case.error:
            return self.case.error
        if case is None or compared is None:
            return COMPARING if session.end else NOTHING_YET
        edited = f" Times count from the last edit, at {case.since:.2f} s." if case.since else ""
        so_far = "" if self.case.is_current else " so far"
        return f"Compared with {compared.against} up to {compared.clock.time(compared.steps):.2f} s{so_far}.{edited}"

    def _choices(self, engines: Iterable[str]) -> list[Row]:
        buttons = [self._button(name) for name in engines]
        for button in buttons:
            button.colour = self._playback.view.charts.colours[button.text]
        return rows_of(buttons, BUTTONS_IN_ROW)

    def _make_button(self, engine: str) -> TextButton:
        does = f"what differs in {engine}"
        return TextButton(engine, partial(self.choose, engine), does, lambda: engine == self.engine)

    def _picture(self, difference: Difference) -> ContactPicture:
        moment = self._playback.view.moment
        colour = palette(moment.scene.arena.background).engines(self._playback.view.charts.colours)[self.engine]
        return ContactPicture(moment.scene, moment.states[self.engine], difference, colour)
