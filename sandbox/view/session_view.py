"""A session on the screen: a pane for each engine, and charts."""

import math
from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Final

from pygame import Surface

from sandbox.engines import REFERENCE, default_engines
from sandbox.report.run_so_far import Marks
from sandbox.run.edits import edited_scenes
from sandbox.run.inputs import Input
from sandbox.scene.model import Scene
from sandbox.session.session import Session
from sandbox.view.charts import Charts
from sandbox.view.layers import Layer
from sandbox.view.layout import Layout, ScreenPoint
from sandbox.view.pane import Pane, draw_panes
from sandbox.view.primitives import card

MAX_TRACED_STEPS: Final = 120  # how far trails and contacts go back after a jump in time
MAX_BALLS_BESIDE: Final = 5_000  # of a scene in which the reference runs along, hidden: it takes a third of a frame


class SessionView:
    """A session with its panes and charts.

    engines: by default, Pymunk and a textbook engine. `exact` runs along, hidden, unless it has a pane or there are
    more than MAX_BALLS_BESIDE balls.
    """

    def __init__(self, scene: Scene, engines: Sequence[str] | None, inputs: Sequence[Input] = ()) -> None:
        names = engines or default_engines(*edited_scenes(scene, inputs))
        reference = REFERENCE if len(scene.bodies) <= MAX_BALLS_BESIDE else None
        self.session = Session(scene, names, inputs, reference)
        self.moment = self.session.shown
        lockstep = self.session.lockstep
        self.panes = [Pane(self.moment, name, lockstep.engines[name].engine) for name in self.session.names]
        self.charts = Charts(self.session.samples, scene.seconds)
        self._energy_at_start = {name: self.moment.energy[name] - self.moment.work[name] for name in self.moment.energy}
        self.charts.moment = self.moment
        self._live = True
        self.plain = False

    def update(self) -> None:
        """Show the session's current step, or the nearest in its history."""
        session, before = self.session, self.moment
        moment, live = session.shown, session.is_live
        if moment is before and live == self._live:
            return
        afresh = not 0 < moment.step - before.step <= MAX_TRACED_STEPS or live != self._live
        first = max(0, moment.step - MAX_TRACED_STEPS) if afresh else before.step + 1
        for pane in self.panes:
            engine = session.lockstep.engines[pane.name].engine
            pane.show(session.moments(first, moment.step), engine, live=live, afresh=afresh)
        self.moment, self._live = moment, live
        self.charts.moment = moment
        self.charts.note = self._note

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
        draw_panes(surface, layout, self.panes, showing, self.session.reference, self.moment.states)

    def _judge(self, pane: Pane) -> None:
        """Let a pane know by how much its energy is off."""
        samples = self.session.samples
        pane.error, pane.is_alone = self.energy_errors[pane.name], samples.is_alone

    @property
    def energy_errors(self) -> dict[str, float]:
        """By how much each engine's energy is off at the step shown, in % if there is a scale."""
        errors = self.session.samples.energy_error(self.moment.step)
        return {name: 0.0 if math.isnan(error) else error for name, error in errors.items()}

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
        for name, runner in self.session.lockstep.engines.items():
            hidden = "" if name in self.session.names else ", hidden"
            pane = Pane(self.moment, name, runner.engine) if hidden else next(p for p in self.panes if p.name == name)
            cost = "" if runner.step_seconds is None else f"{1000 * runner.step_seconds:.2g}"
            pane.energy_at_start = self._energy_at_start[name]
            self._judge(pane)
            rows.append([name + hidden, pane.energy_text, pane.loss_text, pane.hand_text, f"{pane.contacts:,}", cost])
        return rows
