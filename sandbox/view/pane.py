"""One engine's pane: its balls and walls, the layers, and a title."""

from collections.abc import Collection, Sequence
from typing import Final

import pygame
from pygame import Color, Rect, Surface

from sandbox.engines import Engine
from sandbox.engines.pymunk import PymunkEngine
from sandbox.engines.stopping import StoppedEngine, StoppingEngine
from sandbox.errors import EngineError, LimitReached
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.session.history import Moment
from sandbox.session.samples import change_of_energy, share_of_energy
from sandbox.state import State
from sandbox.view.debug_draw import DebugDraw
from sandbox.view.discs import Discs
from sandbox.view.layers import Layer
from sandbox.view.layout import EDGE, Layout
from sandbox.view.overlay import ABOVE_BALLS, BELOW_BALLS, Overlay
from sandbox.view.palette import chart_palette, palette
from sandbox.view.pixels import fill
from sandbox.view.primitives import card, draw_wall, shortened, text_width, wrapped, write
from sandbox.view.recent import RecentContacts, Trail
from sandbox.view.theme import theme

TITLE_GAP: Final = "    "  # between the parts of a title
AS_IT_SHOULD_BE: Final = "energy as it should be"
BATCH: Final = "drawn in one batch"
PLAIN: Final = "plain debug-draw"
MAX_FAILURE_LINES: Final = 8  # of the reason why an engine stands still
MIN_CHANGE: Final = 5e-3  # % of the energy; less counts as none


class Pane:
    """One engine on the screen. Pymunk's debug-draw draws its own engine; other engines are drawn from the scene."""

    scene: Scene
    _balls: tuple[int, ...] = ()
    _drawn: PymunkEngine | None = None
    debug_draw: DebugDraw | None = None
    error: float | None = None  # of the energy: by how much it is off, in % if there is a scale
    is_alone = is_reference = False
    plain = False  # whether Pymunk draws with ragged edges, as it does by itself

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
            self._drawn, self.debug_draw = (
                engine,
                DebugDraw(engine.space, moment.scene.colors, palette(moment.scene.arena.background).wall),
            )
        if afresh or moment.scene is not self.scene:
            self._discs = Discs(moment.scene.bodies.radius, moment.scene.colors)
        self.step, self.scene, self._balls = moment.step, moment.scene, moment.balls
        self.state = moment.states[self.name]
        self._held, self._target = moment.held, moment.target
        self.contacts = moment.counts[self.name]
        self.energy, self.work = moment.energy[self.name], moment.work[self.name]
        self.energy_scale = moment.energy_scale

    def shows(self, moment: Moment) -> bool:
        """Return whether all that the pane shows of a moment is drawn."""
        now = self._held, self._target
        return moment.states[self.name] is self.state and (moment.held, moment.target) == now

    @property
    def title(self) -> str:
        """The engine, and its energy beside what it should have."""
        return f"{self.name}{TITLE_GAP}{self.energy_text}"

    @property
    def energy_text(self) -> str:
        """How the engine's energy compares with what it should have, in words; nothing while that is not known."""
        if self.error is None:
            return ""
        return energy_in_words(self.error, self.energy_scale, is_alone=self.is_alone)

    @property
    def signed_energy(self) -> str:
        """The same as briefly as possible."""
        error = self.error or 0.0
        return f"{'-' if error < 0 else '+'}{amount_text(error, self.energy_scale)}"

    @property
    def hand_text(self) -> str:
        """What mouse and edits have added to the energy; empty if nothing."""
        if not self.work:
            return ""
        work = share_of_energy(self.work, self.energy_scale)
        return f"{work:+,.3g} {'%' if self.energy_scale else 'kg px²/s²'}"

    @property
    def loss_text(self) -> str:
        """What the engine has lost or made since the start, rightly or not."""
        change = share_of_energy(change_of_energy(self.energy, self.energy_at_start, self.work), self.energy_scale)
        return f"{0.0 if abs(change) < MIN_CHANGE else change:+,.3g} {'%' if self.energy_scale else 'kg px²/s²'}"

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
        self._draw_frame(surface, layout.arenas[index])
        for layer, draw in BELOW_BALLS.items():
            if layer in showing:
                draw(overlay)
        if self.debug_draw:
            self.debug_draw.plain = self.plain
            past = None if self._live else (self.scene, self.state)
            self.debug_draw.draw(inside, scale, past, origin)
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
            sizes = (energy, energy.partition(" than")[0], self.signed_energy)
            energy = next((text for text in sizes if text_width(text, height, bold=True) <= beside), sizes[-1])
        room = place.right - left - (text_width(energy, height, bold=is_off) + height if is_off else 0)
        name = shortened(self.name, max(room, 3 * height), height)
        left = write(surface, name, Rect(left, place.y, place.right - left, place.height), theme.ink, height, bold=True)
        left += round(0.8 * height)
        line = Rect(left, place.y, place.right - left, place.height)
        if text_width(energy, height, bold=is_off) <= line.width:
            left = write(surface, energy, line, colour if is_off else theme.dim, height, bold=is_off)
        remarks = [f"outlines: {outlined}"] * bool(outlined) + [BATCH] * self.draws_batch + [PLAIN] * self.plain
        for remark in remarks:
            width = text_width(remark, height)
            if left + height + width <= place.right:
                place.width -= width
                write(surface, remark, Rect(place.right, place.y, width + 1, place.height), theme.dim, height)
                place.width -= height

    @property
    def draws_batch(self) -> bool:
        """Whether Pymunk's debug-draw has too many shapes, so that a batch draws them."""
        return self.debug_draw is not None and self._live and self.debug_draw.is_batch

    def _draw_frame(self, surface: Surface, arena: Rect) -> None:
        """Draw the arena's walls as a frame, or its edge as a thin line."""
        edge = EDGE if self.scene.arena.walls else 1
        pygame.draw.rect(surface, theme.wall, arena.inflate(2 * edge, 2 * edge), edge, border_radius=edge)


def energy_in_words(error: float, scale: float, *, is_alone: bool = False) -> str:
    """Return how an energy compares with what it should be. error: in % if there is a scale, else kg px²/s²."""
    if abs(error) < MIN_CHANGE:
        return AS_IT_SHOULD_BE
    beside = "at the start" if is_alone else "it should have"
    return f"{amount_text(error, scale)} {'less' if error < 0 else 'more'} than {beside}"


def amount_text(error: float, scale: float) -> str:
    """Return the size of an error of energy, with its unit."""
    size = abs(error)
    return f"{f'{size:,.0f}' if size >= 9.95 else f'{size:.2g}'} {'%' if scale else 'kg px²/s²'}"


def draw_failure_card(surface: Surface, layout: Layout, place: Rect, error: EngineError | LimitReached) -> None:
    """Draw in the place of an arena why its engine failed or reached a limit, and when."""
    height = layout.text_height
    how = f"failed at {error.time:.3f} s, and stands still" if isinstance(error, EngineError) else "stands still"
    text = f"{how}: {error}"
    lines = wrapped(text, place.width - 4 * height, height, "    ")[:MAX_FAILURE_LINES]
    card(surface, [[line] for line in lines], place.topleft, height, place)


def draw_walls(surface: Surface, scene: Scene, scale: float, origin: Vector = (0.0, 0.0)) -> None:
    """Draw a scene's walls. scale: px of the surface for one px of the scene; origin: where the scene's is."""
    ink = palette(scene.arena.background).wall
    for wall in scene.walls:
        draw_wall(surface, ink, (wall.start, wall.to), wall.thickness, scale, origin)


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
        ghosts = outlined if pane.name != reference else None
        named = reference if ghosts is not None and Layer.GHOSTS in showing else ""
        pane.draw(surface, layout, index, showing, colours[pane.name], ghosts, named)
