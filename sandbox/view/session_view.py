"""A session on the screen: a pane for each engine, and charts."""

from collections.abc import Collection, Sequence
from typing import Final

from pygame import Surface

from sandbox.engines import default_engines
from sandbox.run.edits import edited_scenes
from sandbox.run.inputs import Input
from sandbox.scene.model import Scene
from sandbox.session.monitor import Monitor
from sandbox.session.session import Session
from sandbox.view.chart_data import ChartData
from sandbox.view.charts import Charts
from sandbox.view.discs import forget_pictures
from sandbox.view.layers import Layer
from sandbox.view.layout import Layout
from sandbox.view.pane import Pane, draw_panes

MAX_TRACED_STEPS: Final = 120  # how far trails and contacts go back after a jump in time


class SessionView:
    """A session with its panes and charts. engines: by default, Pymunk and a textbook engine."""

    def __init__(self, scene: Scene, engines: Sequence[str] | None, inputs: Sequence[Input] = ()) -> None:
        self._monitor = Monitor()
        names = engines or default_engines(*edited_scenes(scene, inputs))
        self.session = Session(scene, names, inputs, self._monitor)
        self.moment = self.session.shown
        runners = self.session.lockstep.engines.items()
        self.panes = [Pane(self.moment, name, runner.engine) for name, runner in runners]
        self.charts = Charts(ChartData(scene, self.moment.states))
        self._live = True
        self._disc_scale = 0.0  # in which the cached pictures of discs were drawn

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
        self.charts.data.scene = moment.scene
        self.charts.data.add(moment.step, moment.states)
        self.charts.marks = self._monitor.marks

    def forget_future(self) -> None:
        """Remove what the charts show after the current step: the run takes another course."""
        self.charts.data.series.cut(self.session.step)

    def chart_count(self, showing: Collection[Layer]) -> int:
        """Return how many charts there are, or 0 if they are hidden."""
        return len(self.charts.data.quantities) if Layer.CHARTS in showing else 0

    def draw(self, surface: Surface, layout: Layout, showing: Collection[Layer]) -> None:
        """Draw panes and charts."""
        if layout.scale != self._disc_scale:  # discs of another size are not drawn again
            forget_pictures()
            self._disc_scale = layout.scale
        draw_panes(surface, layout, self.panes, showing)
        self.charts.draw(surface, layout.strip, layout.text_height, self.moment.time)
