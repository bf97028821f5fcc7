"""A session on the screen: a pane for each engine, and charts."""

import math
from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Final

from pygame import Surface

from sandbox.engines import REFERENCE, Engine, default_engines
from sandbox.report.run_so_far import Marks
from sandbox.run.edits import edited_scenes
from sandbox.run.inputs import Input
from sandbox.scene.model import Scene
from sandbox.session.history import Moment
from sandbox.session.session import Session
from sandbox.state import State
from sandbox.view.charts import Charts
from sandbox.view.layers import Layer
from sandbox.view.layout import Layout, ScreenPoint
from sandbox.view.pane import Pane, draw_panes
from sandbox.view.primitives import card

MAX_TRACED_STEPS: Final = 120  # how far trails and contacts go back after a jump in time
NOTED_LAG: Final = 0.1  # s by which the reference may be behind before that is noted, and outlines would mislead
MAX_BALLS_BESIDE: Final = 5_000  # of a scene in which the reference runs along, hidden: it takes a third of a frame


class SessionView:
    """A session with its panes and charts.

    engines: by default, Pymunk and a textbook engine. `exact` runs along, hidden, unless it has a pane or there are
    more than MAX_BALLS_BESIDE balls. beside: whether nothing waits for it, see `Session`: its pane, the outlines and
    the charts then may show a step before that of the other panes.
    """

    def __init__(
        self, scene: Scene, engines: Sequence[str] | None, inputs: Sequence[Input] = (), *, beside: bool = False
    ) -> None:
        names = engines or default_engines(*edited_scenes(scene, inputs))
        reference = REFERENCE if len(scene.bodies) <= MAX_BALLS_BESIDE else None
        self.session = Session(scene, names, inputs, reference, beside=beside)
        self.moment = self.session.shown
        runners = self.session.runners
        self.panes = [Pane(self.moment, name, runners[name].engine) for name in self.session.names]
        self.charts = Charts(self.session.samples, scene.seconds)
        self._energy_at_start = {name: self.moment.energy[name] - self.moment.work[name] for name in self.moment.energy}
        self.charts.moment = self.moment
        self._live = True
        self.plain = False

    def update(self) -> None:
        """Show the session's current step, or the nearest in its history."""
        session, runners = self.session, self.session.runners
        moment, live = session.shown, session.is_live
        self.charts.note = self._note
        completed = self._completed(moment)
        if moment is self.moment and completed is self.charts.moment and live == self._live:
            return
        for pane in self.panes:
            shown = moment if pane.name in moment.states else completed
            if live != self._live or not pane.shows(shown):
                self._show(pane, shown, runners[pane.name].engine, live=live)
        self.moment, self._live = moment, live
        self.charts.moment = completed

    def _completed(self, moment: Moment) -> Moment:
        """Return a moment, or the one that was completed last in place of one without the reference."""
        return moment if moment.is_complete else self.session.latest

    def _show(self, pane: Pane, moment: Moment, engine: Engine, *, live: bool) -> None:
        """Show a moment in a pane, with trails and contacts of those since the one that it shows, or before."""
        afresh = not 0 < moment.step - pane.step <= MAX_TRACED_STEPS or live != self._live
        first = max(0, moment.step - MAX_TRACED_STEPS) if afresh else pane.step + 1
        before = [each for each in self.session.moments(first, moment.step - 1) if pane.name in each.states]
        pane.show([*before, moment], engine, live=live, afresh=afresh)

    def mark(self, marks: Marks) -> bool:
        """Show what stands out in the run, and where its reference stops. Return whether that is news."""
        marks = replace(marks, stopped=self.session.stopped)
        is_news = marks != self.charts.marks
        self.charts.marks = marks
        return is_news

    @property
    def _note(self) -> str:
        """What is to be said of the reference."""
        session = self.session
        if session.lacks_reference:
            return f"{session.reference} is being compiled"
        if session.lag > NOTED_LAG:
            return f"{session.reference} {session.lag:.1f} s behind"
        if session.reference != REFERENCE and len(session.names) > 1:
            return f"against {session.reference}: {REFERENCE} does not run along with so many balls"
        return ""

    def chart_count(self, showing: Collection[Layer]) -> int:
        """Return how many charts there are, or 0 if they are hidden."""
        return int(Layer.CHARTS in showing)

    def draw(
        self, surface: Surface, layout: Layout, showing: Collection[Layer], point: ScreenPoint | None = None
    ) -> None:
        """Draw the panes and the chart, with its values at a point of the screen."""
        self.draw_panes(surface, layout, showing)
        self.draw_chart(surface, layout, point)

    def draw_chart(self, surface: Surface, layout: Layout, point: ScreenPoint | None = None) -> None:
        """Draw the chart, with its values at a point of the screen."""
        self.charts.draw(surface, layout.strip, layout.text_height, self.moment.time, point)

    def draw_panes(self, surface: Surface, layout: Layout, showing: Collection[Layer]) -> None:
        """Draw the panes."""
        for pane in self.panes:
            pane.plain = self.plain
            self._judge(pane)
        draw_panes(surface, layout, self.panes, showing, self.session.reference, self._outlined)

    @property
    def _outlined(self) -> State | None:
        """The reference's balls, of the moment shown or shortly before; None if they are not known."""
        moment = self._completed(self.moment)
        is_near = abs(self.moment.time - moment.time) <= NOTED_LAG and moment.balls == self.moment.balls
        return moment.states.get(self.session.reference) if is_near else None

    def _judge(self, pane: Pane) -> None:
        """Let a pane know by how much its energy is off."""
        samples = self.session.samples
        pane.energy_scale = self._completed(self.moment).energy_scale
        pane.error, pane.is_alone = self.energy_errors.get(pane.name), samples.is_alone

    @property
    def energy_errors(self) -> dict[str, float]:
        """By how much energies are off at the step shown, as far as that is known; in % if there is a scale."""
        errors = self.session.samples.energy_error(self.moment.step)
        return {name: error for name, error in errors.items() if not math.isnan(error)}

    def recolour(self) -> None:
        """Draw in the colours of the theme."""
        self.charts.recolour()
        for pane in self.panes:
            pane.recolour()

    def draw_title_card(self, surface: Surface, layout: Layout, point: ScreenPoint) -> None:
        """Draw the engines' figures in a table, if a point of the screen is on the title of a pane."""
        if any(layout.title(pane).collidepoint(point) for pane in range(len(self.panes))):
            card(surface, self.figures(), point, layout.text_height, surface.get_rect())

    def figures(self) -> list[list[str]]:
        """Return what each engine has done, and the time that its steps take, as rows of a table."""
        rows = [["", "energy", "since the start", "by hand", "contacts", "ms a step"]]
        for name, runner in self.session.runners.items():
            hidden = "" if name in self.session.names else ", hidden"
            pane = next((pane for pane in self.panes if pane.name == name), None)
            pane = pane or Pane(self._completed(self.moment), name, runner.engine)
            cost = "" if runner.step_seconds is None else f"{1000 * runner.step_seconds:.2g}"
            pane.energy_at_start = self._energy_at_start[name]
            self._judge(pane)
            rows.append([name + hidden, pane.energy_text, pane.loss_text, pane.hand_text, f"{pane.contacts:,}", cost])
        return rows
