"""One engine's pane: its balls and walls, the layers, and a title."""

from collections.abc import Collection, Mapping, Sequence
from typing import Final

from pygame import Color, Rect, Surface

from sandbox.engines import Engine
from sandbox.engines.pymunk import PymunkEngine
from sandbox.engines.stopping import StoppedEngine, StoppingEngine
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.session.history import Moment
from sandbox.session.samples import change_of_energy, share_of_energy
from sandbox.state import State
from sandbox.view.debug_draw import DebugDraw
from sandbox.view.discs import Discs
from sandbox.view.error_card import draw_failure_card
from sandbox.view.layers import Layer
from sandbox.view.layout import Layout
from sandbox.view.overlay import ABOVE_BALLS, BELOW_BALLS, Overlay
from sandbox.view.palette import INK, chart_background, contrast, palette
from sandbox.view.pixels import fill
from sandbox.view.primitives import draw_wall, line_sample, shortened, text_width, write
from sandbox.view.recent import RecentContacts, Trail

TITLE_GAP: Final = "    "  # between the parts of a title
KEPT: Final = "kept"
MIN_CHANGE: Final = 1e-3  # % of the energy; less counts as none


class Pane:
    """One engine on the screen. Pymunk's debug-draw draws its own engine; other engines are drawn from the scene."""

    scene: Scene
    _balls: tuple[int, ...] = ()
    _drawn: PymunkEngine | None = None
    debug_draw: DebugDraw | None = None

    def __init__(self, moment: Moment, name: str, engine: Engine) -> None:
        self.name = name
        self.show([moment], engine, live=True)
        self.energy_at_start = self.energy - self.work

    def show(self, moments: Sequence[Moment], engine: Engine, *, live: bool, afresh: bool = True) -> None:
        """Show the last of some moments, with trails and contacts of those before it.

        live: the engine is at the last moment. afresh: the moments do not continue what was shown.
        """
        moment = moments[-1]
        if afresh or moment.balls != self._balls:
            moments = [one for one in moments if one.balls == moment.balls]
            self.trail, self.recent_contacts = Trail(len(moment.balls)), RecentContacts()
        for one in moments:
            self.recent_contacts.add(one.contacts[self.name], one.states[self.name], one.scene.bodies.radius)
        for one in moments if afresh else moments[-1:]:
            self.trail.add(one.states[self.name])
        self._live = live
        self.failure = engine.error if isinstance(engine, StoppingEngine | StoppedEngine) else None
        if isinstance(engine, PymunkEngine) and engine is not self._drawn:
            self._drawn, self.debug_draw = engine, DebugDraw(engine.space, contrast(moment.scene.arena.background))
        if afresh or moment.scene is not self.scene:
            self._discs = Discs(moment.scene.bodies.radius, moment.scene.colors)
        self.scene, self.state, self._balls = moment.scene, moment.states[self.name], moment.balls
        self._held, self._target = moment.held, moment.target
        self.contacts = moment.counts[self.name]
        self.energy, self.work = moment.energy[self.name], moment.work[self.name]
        self.energy_scale = moment.energy_scale

    @property
    def title(self) -> str:
        """The engine, what its energy has become, by itself and by hand, and its number of contacts."""
        hand = [f"by hand {self.hand_text}"] if self.hand_text else []
        return TITLE_GAP.join([self.name, f"energy {self.energy_text}", *hand, f"contacts {self.contacts}"])

    @property
    def energy_text(self) -> str:
        """What the engine lost or made, see `share_of_energy`: "kept" if that is too little to show."""
        change = change_of_energy(self.energy, self.energy_at_start, self.work)
        change = share_of_energy(change, self.energy_scale)
        if not self.energy_scale:
            return f"{change:+.3g} kg px²/s²"
        return f"{change:+.3g} %" if abs(change) >= MIN_CHANGE else KEPT

    @property
    def hand_text(self) -> str:
        """What mouse and edits have added to the energy; empty if nothing."""
        if not self.work:
            return ""
        work = share_of_energy(self.work, self.energy_scale)
        return f"{work:+,.3g} {'%' if self.energy_scale else 'kg px²/s²'}"

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

        colour: of the engine's lines in the charts. ghosts: the balls whose outlines are drawn; outlined: in which
        engine they are.
        """
        inside, scale, origin = surface.subsurface(layout.arenas[index]), layout.scale, layout.origin
        overlay = Overlay(
            inside,
            self.scene,
            self.state,
            self.trail,
            self.recent_contacts,
            ghosts,
            scale=scale,
            text_height=layout.text_height,
            origin=origin,
        )
        fill(inside, overlay.palette.ground)
        for layer, draw in BELOW_BALLS.items():
            if layer in showing:
                draw(overlay)
        if self.debug_draw:
            past = None if self._live else (self.scene, self.state)
            self.debug_draw.draw(inside, scale, self._discs, past, origin)
        else:
            draw_walls(inside, self.scene, scale, origin)
            self._discs.draw(inside, self.state.position, scale, self.state.angle, origin)
        for layer, draw in ABOVE_BALLS.items():
            if layer in showing:
                draw(overlay)
        if self._held is not None:
            overlay.pull(self._held, self._target)
        if self.failure:
            draw_failure_card(surface, layout, layout.arenas[index], self.failure)
        self._draw_title(surface, layout, index, colour, outlined)

    def _draw_title(self, surface: Surface, layout: Layout, index: int, colour: Color, outlined: str) -> None:
        """Draw a sample of the engine's line in the charts, and as much of the title as there is room for.

        A change of the energy stays to the last, without that word; a long name is cut for it.
        """
        place, height = layout.title(index), layout.text_height
        if layout.strip.height:
            sample = Rect(place.x, place.y, 2 * height, place.height)
            line_sample(surface, sample, colour, palette(chart_background(self.scene.arena.background)).ground, height)
            place = Rect(sample.right + height // 2, place.y, place.right - sample.right - height // 2, place.height)
        parts = self.title.split(TITLE_GAP)
        if outlined:
            parts.insert(2, f"outlines: {outlined}")
        while len(parts) > 2 and text_width(TITLE_GAP.join(parts), height) > place.width:
            parts.pop()
        if text_width(TITLE_GAP.join(parts), height) > place.width:
            parts[1:] = [] if self.energy_text == KEPT else [self.energy_text]
        parts[0] = shortened(parts[0], place.width - text_width(TITLE_GAP.join(["", *parts[1:]]), height), height)
        write(surface, TITLE_GAP.join(parts), place, INK, height)


def draw_walls(surface: Surface, scene: Scene, scale: float, origin: Vector = (0.0, 0.0)) -> None:
    """Draw a scene's walls. scale: px of the surface for one px of the scene; origin: where the scene's is."""
    ink = contrast(scene.arena.background)
    for wall in scene.walls:
        draw_wall(surface, ink, (wall.start, wall.to), wall.thickness, scale, origin)


def draw_panes(
    surface: Surface,
    layout: Layout,
    panes: Sequence[Pane],
    showing: Collection[Layer],
    reference: str,
    states: Mapping[str, State],
) -> None:
    """Draw every pane. The ghosts are the balls of the reference, if that runs; states: of all engines."""
    background = panes[0].scene.arena.background
    colours = palette(chart_background(background)).engines([*(pane.name for pane in panes), reference])
    for index, pane in enumerate(panes):
        ghosts = states.get(reference) if pane.name != reference else None
        outlined = reference if ghosts is not None and Layer.GHOSTS in showing else ""
        pane.draw(surface, layout, index, showing, colours[pane.name], ghosts, outlined)
