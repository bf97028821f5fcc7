"""The page of the side panel that says why engines differ: the verdict, contacts and the ledger."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Final

from pygame import Color, Surface

from sandbox.analysis.difference import MAX_DIFFERENCES, Difference
from sandbox.report.case import Case, EngineCase, LedgerLine, OtherContact
from sandbox.view.case_so_far import CaseSoFar
from sandbox.view.contact_mark import draw_contact
from sandbox.view.layout import Layout
from sandbox.view.palette import DARK_BACKGROUND, FAINT, palette
from sandbox.view.playback import Playback
from sandbox.view.saver import Saver
from sandbox.view.widgets.bar import Bar
from sandbox.view.widgets.contact_picture import ContactPicture
from sandbox.view.widgets.text_button import TextButton
from sandbox.view.widgets.widget import Widget
from sandbox.view.widgets.words import Words

LISTED: Final = 12  # contacts at once: the newest, or those around the one that is shown
BUTTONS_IN_ROW: Final = 3
NOTHING_YET: Final = "Nothing has happened yet."
LEGEND: Final = (
    "{colours}. Lines are the normal, dashed ones that of first touch. Thin arrows, which end at their ball, are "
    "velocities before the contact, thick ones those after it."
)

Row = Sequence[Widget]


class WhyPage:
    """Says why an engine differs from the reference, in the words of `compare`, and shows its contacts in the panes."""

    title = "Why engines differ"

    def __init__(self, playback: Playback, saver: Saver, case: CaseSoFar) -> None:
        self.case = case
        self._playback = playback
        self._saver = saver
        self._chosen = ""  # engine
        self._gone_to: OtherContact | None = None
        self._is_whole = False  # whether all of the verdict is shown
        self._rows: list[Row] = []
        self._made_of: object = None  # what the rows were made of
        self._words: dict[str, Words] = {}  # in the rows, by their text: those that stay keep the keyboard
        self._buttons: dict[str, TextButton] = {}  # by engine
        self._page_button = TextButton(
            "", self.make_page, "write this comparison as a page", refusal=self._why_no_page, width=3.0
        )

    @property
    def engine(self) -> str:
        """The engine that the page speaks of: the one chosen, or the first that has contacts to show, or any."""
        engines = self._case.engines if self._case else {}
        if self._chosen in engines:
            return self._chosen
        return next((name for name, one in engines.items() if one.contacts), next(iter(engines), ""))

    @property
    def contact(self) -> OtherContact | None:
        """The contact that is drawn in the panes: the one that was gone to, while its step is shown."""
        contact = self._gone_to
        is_shown = contact in self._contacts and contact and contact.step == self._playback.view.moment.step
        return contact if is_shown else None

    @property
    def _case(self) -> Case | None:
        return self.case.of(self._playback.session)

    @property
    def _of_engine(self) -> EngineCase | None:
        return self._case.engines.get(self.engine) if self._case else None

    @property
    def _contacts(self) -> tuple[OtherContact, ...]:
        return self._of_engine.contacts if self._of_engine else ()

    def update(self) -> bool:
        """Let the comparison go on. Return whether it has news."""
        return self.case.update(self._playback.session)

    # What it does

    def choose(self, engine: str) -> None:
        """Speak of another engine."""
        self._chosen, self._gone_to = engine, None

    def show(self, contact: OtherContact) -> None:
        """Pause, go to a contact, and draw it in the panes."""
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
        elif by > 0:
            at = sum(contact.step <= here for contact in contacts)
        else:
            at = sum(contact.step < here for contact in contacts) - 1
        is_there = 0 <= at < len(contacts)
        if is_there:
            self.show(contacts[at])
        return is_there

    def make_page(self) -> None:
        """Write the report of the run so far."""
        self.case.make_page(self._saver.free_name(".html"))

    def _why_no_page(self) -> str:
        if self.case.is_making_page:
            return "it is being made"
        return "" if self._playback.session.end else NOTHING_YET

    # What it says

    def rows(self) -> Sequence[Row]:
        """Return the rows of its widgets, which are made again only if there is something else to say."""
        case = self._case, self.case.is_making_page, self._status
        made_of = *case, self.engine, self._gone_to, self.contact, self._is_whole
        if made_of != self._made_of:
            self._made_of, self._rows = made_of, self._make_rows()
        return self._rows

    def _make_rows(self) -> list[Row]:
        before, self._words = self._words, {}

        def words(text: str, colour: Color | None = None, do: Callable[[], None] | None = None) -> list[Words]:
            one = self._words[text] = before.get(text) or Words(text)
            one.colour, one.do, one.marked = colour, do, False
            return [one]

        rows: list[Row] = []
        case, of_engine = self._case, self._of_engine
        if case:
            rows.append(words(self._verdict(case.verdict), do=self._toggle_verdict))
        self._page_button.text = "making it …" if self.case.is_making_page else "make the page"
        rows.append([*words(self._status, FAINT), self._page_button])
        if case:
            rows += self._choices(list(case.engines))
        if self.contact:
            rows += [words(self.contact.sentence), [self._picture(self.contact.difference)]]
            rows += [words(line, FAINT) for line in self._details(self.contact)]
        if of_engine and of_engine.ledger:
            rows.append(words(f"What {self.engine} lost or made, in % of the energy:", FAINT))
            rows += self._bars(of_engine.ledger)
        if of_engine and of_engine.agrees:
            rows.append(words(of_engine.agrees))
        if self._listed:
            rows.append(words(self._list_title, FAINT))
        for contact in self._listed:
            if contact != self.contact:
                rows.append(words(contact.sentence, do=partial(self.show, contact)))
        if left := len(self._contacts) - len(self._listed):
            rows.append(words(f"and {left} more, which < and > go to", FAINT))
        return rows

    @property
    def _list_title(self) -> str:
        count = len(self._contacts)
        others = f"{count} contacts differ" if count > 1 else "1 contact differs"
        most = ", and more" if count == MAX_DIFFERENCES else ""
        return f"{others} from {self._playback.session.reference}{most}; the newest first:"

    def _verdict(self, parts: Sequence[str]) -> str:
        return " ".join(parts) if self._is_whole or len(parts) < 2 else f"{parts[0]} …"

    def _toggle_verdict(self) -> None:
        self._is_whole = not self._is_whole

    @property
    def _status(self) -> str:
        """How far the comparison has got, in words."""
        session, case, compared = self._playback.session, self._case, self.case.compared
        if self.case.error:
            return self.case.error
        if session.lacks_reference:
            return f"{session.reference} is being compiled."
        if case is None or compared is None:
            return "Comparing …" if session.end else NOTHING_YET
        edited = f" Times count from the last edit, at {case.since:g} s." if case.since else ""
        return f"Compared with {compared.against} up to {compared.clock.time(compared.steps):.2f} s.{edited}"

    def _choices(self, engines: Sequence[str]) -> Iterator[Row]:
        """Yield the engines as buttons, in their colours."""
        colours = self._colours
        self._buttons = {
            name: self._buttons.get(name)
            or TextButton(
                name,
                partial(self.choose, name),
                f"what differs in {name}",
                partial(self._is_chosen, name),
                colour=colour,
            )
            for name, colour in colours.items()
            if name in engines
        }
        for first in range(0, len(engines), BUTTONS_IN_ROW):
            yield [self._buttons[name] for name in engines[first : first + BUTTONS_IN_ROW]]

    def _is_chosen(self, engine: str) -> bool:
        return engine == self.engine

    @property
    def _colours(self) -> dict[str, Color]:
        """The engines' colours on the panel."""
        session = self._playback.session
        return palette(DARK_BACKGROUND).engines([*session.names, session.reference])

    @property
    def _listed(self) -> Sequence[OtherContact]:
        """The contacts that are listed, the newest first."""
        newest = self._contacts[::-1]
        at = newest.index(self._gone_to) if self._gone_to in newest else 0
        first = min(max(at - LISTED // 2, 0), max(len(newest) - LISTED, 0))
        return newest[first : first + LISTED]

    def _picture(self, difference: Difference) -> ContactPicture:
        moment = self._playback.view.moment
        colour = palette(moment.scene.arena.background).engines(self._colours)[self.engine]
        return ContactPicture(moment.scene, moment.states[self.engine], difference, colour)

    def _details(self, contact: OtherContact) -> Iterator[str]:
        """Yield the figures of the contact that is drawn, and how to read the drawing."""
        yield from contact.speeds.splitlines()
        found, against = contact.difference, self._playback.session.reference
        ink = "white" if palette(self._playback.view.moment.scene.arena.background).is_dark else "black"
        if found.normal and found.should_normal:
            yield LEGEND.format(colours=f"{self.engine} in its colour, {against} in {ink}")
        elif found.normal:
            yield LEGEND.format(colours=f"{self.engine} in its colour; {against} has no such contact")
        elif found.should_normal:
            yield LEGEND.format(colours=f"{against} in {ink}; {self.engine} has no such contact")

    def _bars(self, lines: Sequence[LedgerLine]) -> Iterator[Row]:
        largest = max((abs(line.share) for line in lines), default=1.0)
        for line in lines:
            yield [Bar(line.cause, line.text, line.share / largest, self._colours[self.engine])]

    # In the panes

    def draw_contact(self, surface: Surface, layout: Layout) -> None:
        """Draw the contact that was gone to in every pane, while its step is shown."""
        if self.contact:
            draw_contact(surface, layout, self._playback.view.panes, self.contact.difference, self.engine)
