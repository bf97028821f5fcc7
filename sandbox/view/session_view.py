"""A session on the screen: a pane for each engine, with its balls, walls, layers and title, and the chart."""

import math
from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
import pygame
from pygame import Color, Rect, Surface

from sandbox.engines import REFERENCE, default_engines
from sandbox.engines.engine import RunningEngine
from sandbox.engines.pymunk import PymunkEngine
from sandbox.run.inputs import Input
from sandbox.scene.model import Scene
from sandbox.session.history import Moment
from sandbox.session.session import Session
from sandbox.state import Floats, State
from sandbox.view import Layer
from sandbox.view.charts import Charts
from sandbox.view.debug_draw import DebugDraw
from sandbox.view.layout import EDGE, Layout, ScreenPoint
from sandbox.view.overlay import NO_TRAIL, Overlay
from sandbox.view.primitives import Discs, card, draw_walls, first_lines, shortened, text_width, write
from sandbox.view.run_so_far import Marks
from sandbox.view.theme import palette, theme

AS_IT_SHOULD_BE: Final = "energy as it should be"
IT_SHOULD_HAVE: Final = "it should have"
MAX_REASON_LINES: Final = 8  # why an engine stands still
FADED: Final = 150  # of 255, how much of what is drawn of an engine that cannot run is hidden
MIN_ERROR: Final = 5e-3  # % of the energy; less counts as none
MAX_POSITIONS: Final = 90  # in the trail of a ball
MAX_POSITIONS_OF_ALL: Final = 20_000  # in the trails of all balls together
TRAIL_RATE: Final = 60  # positions a second in a trail
NOTED_LAG: Final = 0.1  # s by which the reference may be behind before that is noted, and outlines would mislead
MAX_BALLS_BESIDE: Final = 5_000  # of a scene in which the reference runs along, hidden: it takes a third of a frame
RESUMES: Final = "It goes on from the present state of the others as soon as the scene allows it."


class Pane:
    """One engine on the screen. Pymunk's debug-draw draws its own engine; other engines are drawn from the scene.

    state: of its balls or, while the engine cannot run the scene, of those from which it would continue. stands: why it
    stands still, or nothing. error: by how much its energy is off, %, None if that is not known.
    """

    moment: Moment
    state: State
    _drawn: PymunkEngine | None = None
    _discs_of: Scene | None = None
    debug_draw: DebugDraw | None = None
    error: float | None = None
    beside = IT_SHOULD_HAVE  # what its energy is compared with
    is_reference = False

    def __init__(self, moment: Moment, name: str, engine: RunningEngine | None) -> None:
        self.name = name
        self.show(moment, engine, live=True)

    def show(self, moment: Moment, engine: RunningEngine | None, *, live: bool) -> None:
        """Show a moment. live: the engine is there, too."""
        self.is_suspended, self._live = self.name not in moment.engines, live
        if isinstance(engine, PymunkEngine) and engine is not self._drawn:
            ink = palette(moment.scene.arena.background).wall
            self._drawn, self.debug_draw = engine, DebugDraw(engine.space, moment.scene.colors, ink)
        if moment.scene is not self._discs_of:
            self._discs_of, self._discs = moment.scene, Discs(moment.scene.bodies.radius, moment.scene.colors)
        self.moment, self.step, self.scene = moment, moment.step, moment.scene
        if self.is_suspended:
            self.state = next(reversed(moment.states.values()))
            why = moment.suspended[self.name].removeprefix(f"{self.name}: ").partition(";")[0]
            self.stands = f"{self.name} cannot run this: {why}. {RESUMES}"
        else:
            reading = moment.engines[self.name]
            self.state, self.stands = reading.state, reading.stands and f"{self.name} stands still: {reading.stands}"

    @property
    def energy_text(self) -> str:
        """How the engine's energy compares with what it should have, in words; nothing while there is no answer."""
        return "" if self.error is None or self.is_suspended else energy_in_words(self.error, self.beside)

    def draw(
        self,
        surface: Surface,
        layout: Layout,
        index: int,
        showing: Collection[Layer],
        colour: Color,
        trail: Floats,
        ghosts: State | None,
    ) -> None:
        """Draw the pane at its place in a layout.

        colour: of the engine in the title. trail: see `Overlay`. ghosts: the balls whose outlines are drawn.
        """
        place, height = layout.arenas[index], layout.text_height
        inside, scale, origin = surface.subsurface(place), layout.scale, layout.origin
        overlay = Overlay(inside, self.scene, self.state, scale, height, origin, trail, ghosts)
        inside.fill(overlay.palette.ground)
        edge = EDGE if self.scene.arena.walls else 1
        pygame.draw.rect(surface, theme.wall, place.inflate(2 * edge, 2 * edge), edge, border_radius=edge)
        if Layer.TRAILS in showing:
            overlay.trails()
        if self.debug_draw and self._live:
            self.debug_draw.recolour(overlay.palette.wall)
            self.debug_draw.draw(inside, scale, origin)
        else:
            draw_walls(inside, self.scene, scale, origin)
            self._discs.draw(inside, overlay.at(self.state.position), scale, self.state.angle)
        if Layer.GHOSTS in showing:
            overlay.outlines()
        if Layer.VELOCITY in showing:
            overlay.velocity()
        if Layer.NUMBERS in showing:
            overlay.numbers()
        if self.is_suspended:
            veil = Surface(place.size)
            veil.fill(overlay.palette.faint)
            veil.set_alpha(FADED)
            surface.blit(veil, place)
        elif self.moment.held is not None:
            overlay.pull(self.moment.held, self.moment.target)
        if self.stands:
            lines = first_lines(self.stands, place.width - 4 * height, height, MAX_REASON_LINES, "    ")
            card(surface, [[line] for line in lines], place.topleft, height, place)
        self._draw_title(surface, layout, index, colour)

    def _draw_title(self, surface: Surface, layout: Layout, index: int, colour: Color) -> None:
        """Draw the engine after its colour, and its energy; what has no room is left out."""
        place, height, text = layout.title(index), layout.text_height, self.energy_text
        swatch = Rect(place.x, 0, round(0.85 * height), round(0.85 * height))
        swatch.centery = place.centery
        pygame.draw.rect(surface, colour, swatch, border_radius=3)
        line = Rect(swatch.right + height // 2, place.y, place.right - swatch.right - height // 2, place.height)
        is_off = text not in ("", AS_IT_SHOULD_BE) and not self.is_reference
        whole, room = text_width(self.name, height, bold=True), line.width - height
        beside = {  # what may stand there, and the room that it leaves at least to the name, px
            "the reference" if self.is_reference else text: whole,
            text.partition(" than")[0] if is_off else "": min(whole, 4 * height),
        }
        fitting = (words for words, name in beside.items() if text_width(words, height, bold=is_off) + name <= room)
        energy = next(fitting, "")
        room -= text_width(energy, height, bold=is_off)
        name = shortened(self.name, max(room, 3 * height), height, bold=True)
        ink = theme.dim if self.is_suspended else theme.ink
        for words, hue, bold in ((name, ink, True), (energy, colour if is_off else theme.dim, is_off)):
            left = write(surface, words, line, hue, height, bold=bold) + height
            line = Rect(left, place.y, max(0, place.right - left), place.height)


def energy_in_words(error: float, beside: str) -> str:
    """Return how an energy compares with another, in words. error: %."""
    size = abs(error)
    if size < MIN_ERROR:
        return AS_IT_SHOULD_BE
    amount = f"{size:,.0f} %" if size >= 9.95 else f"{size:.2g} %"
    return f"{amount} {'less' if error < 0 else 'more'} than {beside}"


class SessionView:
    """A session with its panes and its chart.

    engines: by default, Pymunk and a textbook engine. `exact` runs along, hidden, unless it has a pane or there are
    more than MAX_BALLS_BESIDE balls. beside: whether nothing waits for it, see `Session`: its pane, the outlines and
    what the charts compare then may be a step before that of the other panes.
    """

    def __init__(
        self, scene: Scene, engines: Sequence[str] | None, inputs: Sequence[Input] = (), *, beside: bool = False
    ) -> None:
        names = engines or default_engines(scene)
        reference = REFERENCE if len(scene.bodies) <= MAX_BALLS_BESIDE else names[0]
        self.session = Session(scene, names, inputs, reference, beside=beside)
        self.moment = self.session.shown
        runners = self.session.runners
        self.panes = [Pane(self.moment, name, runners[name].engine) for name in self.session.names]
        self.charts = Charts(self.session.samples, scene.seconds, scene.units)
        self.charts.moment = self.moment
        self._live = True

    def update(self) -> None:
        """Show the session's current step, or the nearest in its history."""
        session, runners = self.session, self.session.runners
        moment, live = session.shown, session.is_live
        self.charts.note = self._note
        completed = self._completed(moment)
        if moment is self.moment and completed is self.charts.moment and live == self._live:
            return
        for pane in self.panes:
            is_there = pane.name in moment.engines or (pane.name in moment.suspended and moment.engines)
            runner = runners.get(pane.name)
            pane.show(moment if is_there else completed, runner.engine if runner else None, live=live)
        self.moment, self._live = moment, live
        self.charts.moment = completed

    def _completed(self, moment: Moment) -> Moment:
        """Return a moment, or the one that was completed last in place of one without the reference."""
        return moment if moment.is_complete else self.session.latest

    def mark(self, marks: Marks) -> bool:
        """Show what stands out in the run, and where its reference stops. Return whether that is news."""
        marks = replace(marks, stopped=self.session.stopped)
        is_news = marks != self.charts.marks
        self.charts.marks = marks
        return is_news

    @property
    def _note(self) -> str:
        session = self.session
        if session.lag > NOTED_LAG:
            return f"{session.reference} {session.lag:.1f} s behind"
        if session.reference != REFERENCE and len(session.names) > 1:
            return f"against {session.reference}: {REFERENCE} does not run along with so many balls"
        return ""

    def draw_chart(self, surface: Surface, layout: Layout, point: ScreenPoint | None) -> None:
        """Draw the chart, with its values at a point of the screen if there is one."""
        self.charts.draw(surface, layout.strip, layout.text_height, self.moment.time, point)

    def draw_panes(self, surface: Surface, layout: Layout, showing: Collection[Layer]) -> None:
        """Draw the panes."""
        errors, reference, outlined = self.energy_errors, self.session.reference, self._outlined
        for index, pane in enumerate(self.panes):
            pane.error, pane.beside = errors.get(pane.name), self.beside
            pane.is_reference = pane.name == reference and len(self.panes) > 1
            layers, colour = ((), theme.dim) if pane.is_suspended else (showing, self.charts.colours[pane.name])
            ghosts = outlined if pane.name != reference else None
            trail = self.trail(pane) if Layer.TRAILS in layers else NO_TRAIL
            pane.draw(surface, layout, index, layers, colour, trail, ghosts)

    def trail(self, pane: Pane) -> Floats:
        """Return where a pane's balls were, the oldest first, as far as the history goes: (positions, n, 2) px."""
        moment, kept = pane.moment, max(2, min(MAX_POSITIONS, MAX_POSITIONS_OF_ALL // len(pane.moment.balls)))
        stride = max(1, round(moment.scene.rate / TRAIL_RATE))
        moments = [*self.session.moments(max(0, moment.step - kept * stride), moment.step - 1), moment][::-stride]
        readings = [each.engines.get(pane.name) for each in moments[:kept] if each.balls == moment.balls]
        return np.array([reading.state.position for reading in reversed(readings) if reading])

    @property
    def _known(self) -> Moment | None:
        """The moment shown, or one shortly before that has the reference too; None if that is further behind."""
        moment = self._completed(self.moment)
        return moment if abs(self.moment.time - moment.time) <= NOTED_LAG else None

    @property
    def _outlined(self) -> State | None:
        """The reference's balls, of the moment shown or shortly before; None if they are not known."""
        moment = self._known
        return moment.states.get(self.session.reference) if moment and moment.balls == self.moment.balls else None

    @property
    def beside(self) -> str:
        """What energies are compared with, in words.

        Where the paths of the reference mean nothing any more, nor does what it has rightly lost on them.
        """
        if self.session.samples.is_alone:
            return "at the start"
        until = self.charts.marks.trust.until
        return IT_SHOULD_HAVE if until is None or self.moment.time <= until else self.session.reference

    @property
    def energy_errors(self) -> dict[str, float]:
        """By how much energies are off at the step shown or shortly before, as far as that is known, %."""
        known = self._known
        errors = self.session.samples.error_at(known.step) if known else {}
        return {name: error for name, error in errors.items() if math.isfinite(error)}
