"""Engines that run a scene, and what is shown of them: a pane each, and charts."""

from collections.abc import Collection, Sequence
from typing import Final

from pygame import Surface

from sandbox.engines import default_engines
from sandbox.run.inputs import Input
from sandbox.run.mouse import Hand
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.session.monitor import Monitor
from sandbox.session.session import Session
from sandbox.view.chart import ChartData, Charts
from sandbox.view.debug_draw import turned
from sandbox.view.draw import disc
from sandbox.view.layout import Layout
from sandbox.view.pane import Pane, draw_panes

BEHIND: Final = 120  # steps that trails and contacts reach back, where they are shown afresh


class Stage:
    """A session, and what is shown of it. Where no engines are named: Pymunk and its reference."""

    def __init__(self, scene: Scene, engines: Sequence[str] | None, inputs: Sequence[Input] = ()) -> None:
        self._monitor = Monitor()
        self.session = Session(scene, engines or default_engines(scene, spawn(scene)), inputs, self._monitor)
        self.moment = self.session.shown
        runners = self.session.lockstep.engines.items()
        self.panes = [Pane(self.moment, name, runner.engine) for name, runner in runners]
        self.charts = Charts(ChartData(scene, self.moment.states))
        self._live = True
        self._scale = 0.0  # that discs were drawn in

    def look(self) -> None:
        """Show where the session is."""
        session, before = self.session, self.moment
        moment, live = session.shown, session.is_live
        if moment is before and live == self._live:
            return
        afresh = not 0 < moment.step - before.step <= BEHIND or live != self._live
        first = max(0, moment.step - BEHIND) if afresh else before.step + 1
        for pane in self.panes:
            engine = session.lockstep.engines[pane.name].engine
            pane.show(session.moments(first, moment.step), engine, live=live, afresh=afresh)
        self.moment, self._live = moment, live
        self.charts.history.scene = moment.scene
        self.charts.history.add(moment.step, moment.states)
        self.charts.marks = self._monitor.marks

    def forget_to_come(self) -> None:
        """Take what the charts show after this step out of them: the run takes another course."""
        self.charts.history.series.cut(self.session.step)

    def draw(self, surface: Surface, layout: Layout, showing: Collection[str]) -> None:
        """Draw panes and charts."""
        if layout.scale != self._scale:  # of no use any more are pictures in another size
            disc.cache_clear()
            turned.cache_clear()
            self._scale = layout.scale
        hand = Hand(self.moment.scene)
        hand.ball, hand.target = self.moment.held, self.moment.target
        draw_panes(surface, layout, self.panes, showing=showing, hand=hand)
        self.charts.draw(surface, layout.strip, layout.text_height, self.moment.time)
