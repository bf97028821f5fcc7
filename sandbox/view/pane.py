"""One engine's pane: its arena as the engine has it now, and over it what belongs to comparing and dragging."""

from collections.abc import Collection, Sequence

from pygame import Rect, Surface

from sandbox.engines import Engine
from sandbox.engines.pymunk import PymunkEngine
from sandbox.quantity import energy, kinetic_energy, potential_energy
from sandbox.run.mouse import Hand
from sandbox.scene.model import Scene
from sandbox.session.history import Moment
from sandbox.state import State
from sandbox.view.debug_draw import DebugDraw
from sandbox.view.layout import Layout
from sandbox.view.overlay import Overlay, RecentContacts, Trail
from sandbox.view.palette import INK, contrast, palette, paper
from sandbox.view.primitives import blit_discs, capsule, dashes, disc, text_width, write


class Pane:
    """What is shown of one engine. A Pymunk space is drawn by Pymunk's debug-draw, any other engine by the scene."""

    _balls: tuple[int, ...] = ()
    _drawn: PymunkEngine | None = None
    debug_draw: DebugDraw | None = None

    def __init__(self, moment: Moment, name: str, engine: Engine) -> None:
        self.name = name
        self.energy_at_start = _energy(moment.scene, moment.states[name])
        self.show([moment], engine, live=True)

    def show(self, moments: Sequence[Moment], engine: Engine, *, live: bool, afresh: bool = True) -> None:
        """Show the last of some moments, and trails and contacts of those before.

        engine: that runs, and is at the last of them where it is live; afresh: what was shown is not what led here.
        """
        moment = moments[-1]
        if afresh or moment.balls != self._balls:
            moments = [one for one in moments if one.balls == moment.balls]
            self.trail, self.sparks = Trail(len(moment.balls)), RecentContacts(moment.scene.bodies.radius)
        for one in moments:
            self.sparks.add(one.contacts[self.name], one.states[self.name])
        for one in moments if afresh else moments[-1:]:
            self.trail.add(one.states[self.name])
        self.scene, self.state, self._balls = moment.scene, moment.states[self.name], moment.balls
        self.contacts = moment.counts[self.name]
        if isinstance(engine, PymunkEngine):
            drawn = engine if live else PymunkEngine(self.scene, self.state)
            if drawn is not self._drawn:
                self._drawn, self.debug_draw = drawn, DebugDraw(drawn.space, self.scene.colors)

    @property
    def title(self) -> str:
        """Engine, energy left, contacts."""
        now = _energy(self.scene, self.state)
        left = f"{now / self.energy_at_start:.1%}" if self.energy_at_start else "none at the start"
        return f"{self.name}{SPACE}energy {left}{SPACE}contacts {self.contacts}"

    def draw(
        self,
        surface: Surface,
        layout: Layout,
        index: int,
        ghosts: State | None,
        hand: Hand,
        showing: Collection[str] = (),
    ) -> None:
        """Draw the pane at its place in a layout, with the outlines of another engine's balls where given.

        showing: what else to draw, by the names that controls have for it.
        """
        arena = layout.arenas[index]
        inside = surface.subsurface(arena)
        over = Overlay(inside, self.scene, layout.scale, layout.text_height)
        inside.fill(over.palette.ground)
        if "grid" in showing:
            over.grid()
        if "trails" in showing:
            over.trails(self.trail.places())
        if self.debug_draw:
            self.debug_draw.draw(inside, layout.scale)
        else:
            draw_scene(inside, self.scene, self.state, layout.scale)
        if ghosts is not None:
            over.ghosts(ghosts)
        if "momentum" in showing:
            over.momentum(self.state)
        if "velocity" in showing:
            over.velocity(self.state)
        if "numbers" in showing:
            over.numbers(self.state)
        if "contacts" in showing:
            over.contacts(self.sparks.latest(), self.state.time)
        if "centre" in showing:
            over.centre(self.state)
        over.pull(self.state, hand)
        self._draw_title(surface, layout, index)

    def _draw_title(self, surface: Surface, layout: Layout, index: int) -> None:
        """Draw as much of the title as there is room for, after a sample of the engine's line in the charts."""
        place, height = layout.title(index), layout.text_height
        if layout.strip.height:
            sample = Rect(place.x, place.centery - height // 2, 2 * height, height)
            colours = palette(paper(self.scene.arena.background))
            surface.fill(colours.ground, sample)
            line, width = colours.line(index), max(2, height // 6)
            for start, end in dashes(0, sample.width, line.dash, width):
                surface.fill(line.colour, (sample.x + start, sample.centery - width // 2, end - start, width))
            place = Rect(sample.right + height // 2, place.y, place.right - sample.right - height // 2, place.height)
        parts = self.title.split(SPACE)
        while len(parts) > 1 and text_width(SPACE.join(parts), height) > place.width:
            parts.pop()
        write(surface, SPACE.join(parts), place, INK, height)


def _energy(scene: Scene, state: State) -> float:
    return float(energy(state.position, state.velocity, scene.bodies.mass, scene.gravity, scene.arena.size))


def draw_scene(surface: Surface, scene: Scene, state: State, scale: float) -> None:
    """Draw a scene's walls and balls. scale: px of the surface for one px of the scene."""
    ink = contrast(scene.arena.background)
    for wall in scene.walls:
        start, end = ((x * scale, y * scale) for x, y in (wall.start, wall.to))
        capsule(surface, ink, start, end, wall.thickness / 2 * scale)
    radius = scale * scene.bodies.radius
    blit_discs(surface, map(disc, radius.tolist(), scene.colors), scale * state.position, radius)


SPACE = "    "  # between the parts of a title


def draw_panes(
    surface: Surface, layout: Layout, panes: Sequence[Pane], *, showing: Collection[str] = (), hand: Hand
) -> None:
    """Draw every pane; the first lends its balls as ghosts to the last, and the last to all others."""
    for index, pane in enumerate(panes):
        other = panes[0] if pane is panes[-1] else panes[-1]
        ghosts = other.state if "ghosts" in showing and other is not pane else None
        pane.draw(surface, layout, index, ghosts, hand, showing)


def facts(panes: Sequence[Pane], ball: int) -> list[list[str]]:
    """Tell of a ball where it is in every engine, and with which velocity and energy: rows of a table."""
    rows = [[f"ball {ball}", "at, px", "velocity, px/s", "energy, kg px²/s²"]]
    for pane in panes:
        scene, one = pane.scene, slice(ball, ball + 1)
        position, velocity, mass = pane.state.position[one], pane.state.velocity[one], scene.bodies.mass[one]
        whole = kinetic_energy(velocity, mass) + potential_energy(position, mass, scene.gravity, scene.arena.size)
        (x, y), (vx, vy) = position[0], velocity[0]
        rows.append([pane.name, f"{x:.2f}, {y:.2f}", f"{vx:.2f}, {vy:.2f}", f"{whole:.6g}"])
    return rows
