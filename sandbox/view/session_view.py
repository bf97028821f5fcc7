"""A session on the screen: a pane for each engine, with its balls, walls, layers and title, and charts."""

import math
from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Final

import pygame
from pygame import Color, Rect, Surface

from sandbox.engines import REFERENCE, RunningEngine, default_engines
from sandbox.engines.pymunk import PymunkEngine
from sandbox.run.inputs import Input
from sandbox.scene.model import Scene
from sandbox.session.history import Moment
from sandbox.session.session import Session
from sandbox.state import State
from sandbox.view import Layer
from sandbox.view.charts import Charts
from sandbox.view.debug_draw import DebugDraw
from sandbox.view.layout import EDGE, Layout, ScreenPoint
from sandbox.view.overlay import ABOVE_BALLS, BELOW_BALLS, Canvas, Overlay, RecentContacts, Trail
from sandbox.view.primitives import Discs, card, draw_walls, fill, first_lines, shortened, text_width, write
from sandbox.view.run_so_far import Marks
from sandbox.view.theme import chart_palette, palette, theme

AS_IT_SHOULD_BE: Final = "energy as it should be"
IT_SHOULD_HAVE: Final = "it should have"
BATCH: Final = "drawn in one batch"
PLAIN: Final = "plain debug-draw"
MAX_REASON_LINES: Final = 8  # why an engine stands still
FADED: Final = 150  # of 255, how much of what is drawn of an engine that cannot run is hidden
MIN_ERROR: Final = 5e-3  # % of the energy; less counts as none
MAX_TRACED_STEPS: Final = 120  # how far trails and contacts go back after a jump in time
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
    debug_draw: DebugDraw | None = None
    error: float | None = None
    beside = IT_SHOULD_HAVE  # what its energy is compared with
    is_reference = False
    plain = False  # whether Pymunk draws with ragged edges, as it does by itself

    def __init__(self, moments: Sequence[Moment], name: str, engine: RunningEngine | None) -> None:
        self.name = name
        self.show(moments, engine, live=True, afresh=True)

    def show(self, moments: Sequence[Moment], engine: RunningEngine | None, *, live: bool, afresh: bool) -> None:
        """Show the last of some moments, with trails and contacts of those before it.

        live: the engine is at the last moment. afresh: the moments do not continue what was shown.
        """
        moment = moments[-1]
        self.is_suspended = self.name not in moment.engines
        if afresh or self.is_suspended or moment.balls != self.moment.balls:
            moments = [each for each in moments if each.balls == moment.balls]
            self.trail, self.recent_contacts = Trail(len(moment.balls)), RecentContacts()
        running = [each.engines[self.name] for each in moments if self.name in each.engines]
        for reading in running:
            self.recent_contacts.add(reading.contacts, reading.state, moment.scene.bodies.radius)
        for reading in running if afresh else running[-1:]:
            self.trail.add(reading.state)
        self._live = live
        if isinstance(engine, PymunkEngine) and engine is not self._drawn:
            ink = palette(moment.scene.arena.background).wall
            self._drawn, self.debug_draw = engine, DebugDraw(engine.space, moment.scene.colors, ink)
        if afresh or moment.scene is not self.moment.scene:
            self._discs = Discs(moment.scene.bodies.radius, moment.scene.colors)
        self.moment, self.step, self.scene = moment, moment.step, moment.scene
        if self.is_suspended:
            self.state = next(reversed(moment.states.values()))
            why = moment.suspended[self.name].removeprefix(f"{self.name}: ").partition(";")[0]
            self.stands = f"{self.name} cannot run this: {why}. {RESUMES}"
        else:
            reading = moment.engines[self.name]
            self.state, self.stands = reading.state, reading.stands and f"{self.name} stands still: {reading.stands}"

    def shows(self, moment: Moment) -> bool:
        """Return whether all that the pane shows of a moment is drawn."""
        here, there = ((each.held, each.target, each.suspended) for each in (self.moment, moment))
        return here == there and (self.is_suspended or moment.states[self.name] is self.state)

    @property
    def energy_text(self) -> str:
        """How the engine's energy compares with what it should have, in words; nothing while that is not known."""
        return "" if self.error is None else energy_in_words(self.error, self.beside)

    def recolour(self) -> None:
        """Draw in the colours of the theme."""
        if self.debug_draw:
            self.debug_draw.recolour(palette(self.scene.arena.background).wall)

    def draw(
        self,
        surface: Surface,
        layout: Layout,
        index: int,
        showing: Collection[Layer],
        colour: Color,
        ghosts: State | None,
        outlined: str = "",
    ) -> None:
        """Draw the pane at its place in a layout.

        colour: of the engine in the title. ghosts: the balls whose outlines are drawn; outlined: in which
        engine they are.
        """
        place, height = layout.arenas[index], layout.text_height
        inside, scale, origin = surface.subsurface(place), layout.scale, layout.origin
        canvas = Canvas(inside, self.scene, self.state, scale, height, origin)
        overlay = Overlay(canvas, self.trail, self.recent_contacts, ghosts)
        fill(inside, overlay.palette.ground)
        edge = EDGE if self.scene.arena.walls else 1
        pygame.draw.rect(surface, theme.wall, place.inflate(2 * edge, 2 * edge), edge, border_radius=edge)
        for layer, draw in BELOW_BALLS.items():
            if layer in showing:
                draw(overlay)
        if self.debug_draw and self._live:
            self.debug_draw.plain = self.plain
            self.debug_draw.draw(inside, scale, origin)
        else:
            draw_walls(inside, self.scene, scale, origin)
            self._discs.draw(inside, self.state.position, scale, self.state.angle, origin)
        for layer, draw in ABOVE_BALLS.items():
            if layer in showing:
                draw(overlay)
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
        self._draw_title(surface, layout, index, colour, outlined)

    def _draw_title(self, surface: Surface, layout: Layout, index: int, colour: Color, outlined: str) -> None:
        """Draw the engine after its colour, and its energy; what has no room is left out."""
        place, height = layout.title(index), layout.text_height
        swatch = Rect(place.x, 0, round(0.85 * height), round(0.85 * height))
        swatch.centery = place.centery
        pygame.draw.rect(surface, colour, swatch, border_radius=3)
        left = swatch.right + height // 2
        is_off = self.energy_text not in ("", AS_IT_SHOULD_BE) and not self.is_reference
        energy = "the reference" if self.is_reference else self.energy_text
        beside = place.right - left - text_width(self.name, height, bold=True) - height
        if is_off:
            briefly = f"{'-' if (self.error or 0.0) < 0 else '+'}{amount_text(self.error or 0.0)}"
            sizes = (energy, energy.partition(" than")[0], briefly)
            energy = next((text for text in sizes if text_width(text, height, bold=True) <= beside), sizes[-1])
        room = place.right - left - (text_width(energy, height, bold=is_off) + height if is_off else 0)
        name, ink = shortened(self.name, max(room, 3 * height), height), theme.dim if self.is_suspended else theme.ink
        left = write(surface, name, Rect(left, place.y, place.right - left, place.height), ink, height, bold=True)
        left += round(0.8 * height)
        line = Rect(left, place.y, place.right - left, place.height)
        if text_width(energy, height, bold=is_off) <= line.width:
            left = write(surface, energy, line, colour if is_off else theme.dim, height, bold=is_off)
        is_batch = self.debug_draw is not None and self._live and self.debug_draw.is_batch
        remarks = [f"outlines: {outlined}"] * bool(outlined) + [BATCH] * is_batch + [PLAIN] * self.plain
        for remark in remarks:
            width = text_width(remark, height)
            if left + height + width <= place.right:
                place.width -= width
                write(surface, remark, Rect(place.right, place.y, width + 1, place.height), theme.dim, height)
                place.width -= height


def energy_in_words(error: float, beside: str) -> str:
    """Return how an energy compares with another, in words. error: %."""
    if abs(error) < MIN_ERROR:
        return AS_IT_SHOULD_BE
    return f"{amount_text(error)} {'less' if error < 0 else 'more'} than {beside}"


def amount_text(error: float) -> str:
    """Return the size of an error of energy, %, in words if more is missing than ever was in motion."""
    size = abs(error)
    if error <= -100:
        return f"{size / 100:.2g} times the kinetic energy"
    return f"{size:,.0f} %" if size >= 9.95 else f"{size:.2g} %"


def draw_panes(
    surface: Surface,
    layout: Layout,
    panes: Sequence[Pane],
    showing: Collection[Layer],
    reference: str,
    outlined: State | None,
) -> None:
    """Draw every pane. outlined: the balls of the reference, if they are known."""
    colours = chart_palette().engines([*(pane.name for pane in panes), reference])
    for index, pane in enumerate(panes):
        pane.is_reference = pane.name == reference and len(panes) > 1
        layers, colour = ((), theme.dim) if pane.is_suspended else (showing, colours[pane.name])
        ghosts = outlined if pane.name != reference else None
        named = reference if ghosts is not None and Layer.GHOSTS in layers else ""
        pane.draw(surface, layout, index, layers, colour, ghosts, named)


class SessionView:
    """A session with its panes and charts.

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
        self.panes = [Pane([self.moment], name, runners[name].engine) for name in self.session.names]
        self.charts = Charts(self.session.samples, scene.seconds, scene.units)
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
            is_there = pane.name in moment.engines or (pane.name in moment.suspended and moment.engines)
            shown, runner = moment if is_there else completed, runners.get(pane.name)
            if live != self._live or not pane.shows(shown):
                self._show(pane, shown, runner.engine if runner else None, live=live)
        self.moment, self._live = moment, live
        self.charts.moment = completed

    def _completed(self, moment: Moment) -> Moment:
        """Return a moment, or the one that was completed last in place of one without the reference."""
        return moment if moment.is_complete else self.session.latest

    def _show(self, pane: Pane, moment: Moment, engine: RunningEngine | None, *, live: bool) -> None:
        """Show a moment in a pane, with trails and contacts of those since the one that it shows, or before."""
        afresh = not 0 < moment.step - pane.step <= MAX_TRACED_STEPS or live != self._live
        first = max(0, moment.step - MAX_TRACED_STEPS) if afresh else pane.step + 1
        pane.show([*self.session.moments(first, moment.step - 1), moment], engine, live=live, afresh=afresh)

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
        errors = self.energy_errors
        for pane in self.panes:
            pane.plain, pane.error, pane.beside = self.plain, errors.get(pane.name), self.beside
        draw_panes(surface, layout, self.panes, showing, self.session.reference, self._outlined)

    @property
    def _outlined(self) -> State | None:
        """The reference's balls, of the moment shown or shortly before; None if they are not known."""
        moment = self._completed(self.moment)
        is_near = abs(self.moment.time - moment.time) <= NOTED_LAG and moment.balls == self.moment.balls
        return moment.states.get(self.session.reference) if is_near else None

    @property
    def beside(self) -> str:
        """What energies are compared with, in words.

        Where the paths of the reference mean nothing any more, nor does what it has rightly lost on them.
        """
        if self.session.samples.is_alone:
            return "at the start"
        until = self.charts.marks.trust.until
        if until is None or self.moment.time <= until or self.session.samples.keeps_energy:
            return IT_SHOULD_HAVE
        return self.session.reference

    @property
    def energy_errors(self) -> dict[str, float]:
        """By how much energies are off at the step shown, as far as that is known, %."""
        errors = self.session.samples.error_at(self.moment.step)
        return {name: error for name, error in errors.items() if math.isfinite(error)}

    def recolour(self) -> None:
        """Draw in the colours of the theme."""
        self.charts.recolour()
        for pane in self.panes:
            pane.recolour()
