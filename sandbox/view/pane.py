"""One engine's pane: its balls and walls, the layers, and a title."""

from collections.abc import Collection, Sequence
from typing import Final

from pygame import Rect, Surface

from sandbox.engines import Engine
from sandbox.engines.pymunk import PymunkEngine
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.session.history import Moment
from sandbox.state import State
from sandbox.view.chart_data import scene_energy
from sandbox.view.debug_draw import DebugDraw
from sandbox.view.discs import LINE, Discs
from sandbox.view.layers import Layer
from sandbox.view.layout import Layout
from sandbox.view.overlay import ABOVE_BALLS, BELOW_BALLS, Overlay
from sandbox.view.palette import INK, chart_background, contrast, palette
from sandbox.view.pixels import fill
from sandbox.view.primitives import capsule, dashes, text_width, write
from sandbox.view.recent import RecentContacts, Trail

TITLE_GAP: Final = "    "  # between the parts of a title


class Pane:
    """One engine on the screen. Pymunk's debug-draw draws its own engine; other engines are drawn from the scene."""

    scene: Scene
    _balls: tuple[int, ...] = ()
    _drawn: PymunkEngine | None = None
    debug_draw: DebugDraw | None = None

    def __init__(self, moment: Moment, name: str, engine: Engine) -> None:
        self.name = name
        self.show([moment], engine, live=True)
        self.energy_at_start = self.energy

    def show(self, moments: Sequence[Moment], engine: Engine, *, live: bool, afresh: bool = True) -> None:
        """Show the last of some moments, with trails and contacts of those before it.

        live: the engine is at the last moment. afresh: the moments do not continue what was shown.
        """
        moment = moments[-1]
        if afresh or moment.balls != self._balls:
            moments = [one for one in moments if one.balls == moment.balls]
            self.trail, self.recent_contacts = Trail(len(moment.balls)), RecentContacts(moment.scene.bodies.radius)
        for one in moments:
            self.recent_contacts.add(one.contacts[self.name], one.states[self.name])
        for one in moments if afresh else moments[-1:]:
            self.trail.add(one.states[self.name])
        self._live = live
        if isinstance(engine, PymunkEngine) and engine is not self._drawn:
            self._drawn, self.debug_draw = engine, DebugDraw(engine.space)
        if afresh or moment.scene is not self.scene:
            scene = moment.scene
            line = LINE if self.debug_draw or scene.turns else None
            self._discs = Discs(scene.bodies.radius, scene.colors, line)
        self.scene, self.state, self._balls = moment.scene, moment.states[self.name], moment.balls
        self._held, self._target = moment.held, moment.target
        self.contacts = moment.counts[self.name]
        self.energy = scene_energy(self.scene, self.state)

    @property
    def title(self) -> str:
        """The engine, its energy as a share of the start, and its number of contacts."""
        left = f"{self.energy / self.energy_at_start:.1%}" if self.energy_at_start else "none at the start"
        return f"{self.name}{TITLE_GAP}energy {left}{TITLE_GAP}contacts {self.contacts}"

    def draw(
        self,
        surface: Surface,
        layout: Layout,
        index: int,
        showing: Collection[Layer],
        other: State | None,
    ) -> None:
        """Draw the pane at its place in a layout. other: another engine's balls, for the ghosts."""
        inside, scale, origin = surface.subsurface(layout.arenas[index]), layout.scale, layout.origin
        overlay = Overlay(
            inside,
            self.scene,
            self.state,
            self.trail,
            self.recent_contacts,
            other,
            scale=scale,
            text_height=layout.text_height,
            origin=origin,
        )
        fill(inside, overlay.palette.ground)
        for layer, draw in BELOW_BALLS.items():
            if layer in showing:
                draw(overlay)
        if self.debug_draw:
            self.debug_draw.draw(inside, scale, self._discs, None if self._live else self.state, origin)
        else:
            draw_walls(inside, self.scene, scale, origin)
            self._discs.draw(inside, self.state.position, scale, self.state.angle, origin)
        for layer, draw in ABOVE_BALLS.items():
            if layer in showing:
                draw(overlay)
        if self._held is not None:
            overlay.pull(self._held, self._target)
        self._draw_title(surface, layout, index)

    def _draw_title(self, surface: Surface, layout: Layout, index: int) -> None:
        """Draw a sample of the engine's line in the charts, and as much of the title as there is room for."""
        place, height = layout.title(index), layout.text_height
        if layout.strip.height:
            sample = Rect(place.x, place.centery - height // 2, 2 * height, height)
            colours = palette(chart_background(self.scene.arena.background))
            surface.fill(colours.ground, sample)
            line, width = colours.line(index), max(2, height // 6)
            for start, end in dashes(0, sample.width, line.dash, width):
                surface.fill(line.colour, (sample.x + start, sample.centery - width // 2, end - start, width))
            place = Rect(sample.right + height // 2, place.y, place.right - sample.right - height // 2, place.height)
        parts = self.title.split(TITLE_GAP)
        while len(parts) > 1 and text_width(TITLE_GAP.join(parts), height) > place.width:
            parts.pop()
        write(surface, TITLE_GAP.join(parts), place, INK, height)


def draw_walls(surface: Surface, scene: Scene, scale: float, origin: Vector = (0.0, 0.0)) -> None:
    """Draw a scene's walls. scale: px of the surface for one px of the scene; origin: where the scene's is."""
    ink = contrast(scene.arena.background)
    for wall in scene.walls:
        start, end = ((x * scale + origin[0], y * scale + origin[1]) for x, y in (wall.start, wall.to))
        capsule(surface, ink, start, end, wall.thickness / 2 * scale)


def draw_panes(surface: Surface, layout: Layout, panes: Sequence[Pane], showing: Collection[Layer] = ()) -> None:
    """Draw every pane. The ghosts in the last pane are the first's balls; in all others, they are the last's."""
    for index, pane in enumerate(panes):
        other = panes[0] if pane is panes[-1] else panes[-1]
        pane.draw(surface, layout, index, showing, other.state if other is not pane else None)
