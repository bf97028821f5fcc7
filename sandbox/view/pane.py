"""One engine's pane: its arena as the engine has it now, and over it what belongs to comparing and dragging."""

from collections.abc import Collection, Sequence

from pygame import Rect, Surface

from sandbox.engines import Engine
from sandbox.engines.pymunk import PymunkEngine
from sandbox.inputs import Hand
from sandbox.quantity import energy, kinetic_energy, potential_energy
from sandbox.scene import Scene
from sandbox.state import State
from sandbox.view.debug_draw import DebugDraw
from sandbox.view.draw import blit_discs, capsule, dashes, disc, text_width, write
from sandbox.view.layout import Layout
from sandbox.view.overlay import Overlay, Sparks, Trail
from sandbox.view.palette import INK, Palette, palette, paper


class Pane:
    """What is shown of one engine. A Pymunk space is drawn by Pymunk's debug-draw, any other engine by the scene."""

    def __init__(self, scene: Scene, name: str, engine: Engine) -> None:
        self.scene = scene
        self.name = name
        self.engine = engine
        self.state = engine.state()
        self.contacts = len(engine.contacts())
        self.trail = Trail(len(scene.bodies))
        self.trail.add(self.state)
        self.sparks = Sparks(scene.bodies.radius)
        self.energy_at_start = self._energy_now()
        self.debug_draw = DebugDraw(engine.space, scene.colors) if isinstance(engine, PymunkEngine) else None

    def _energy_now(self) -> float:
        return float(energy(self.scene, self.state.position, self.state.velocity))

    def refresh(self) -> None:
        """Look at the engine again."""
        self.state = self.engine.state()
        contacts = self.engine.contacts()
        self.contacts += len(contacts)
        self.trail.add(self.state)
        self.sparks.add(contacts, self.state)

    @property
    def title(self) -> str:
        """Engine, energy left, contacts."""
        left = f"{self._energy_now() / self.energy_at_start:.1%}" if self.energy_at_start else "none at the start"
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
            self._draw_scene(inside, layout.scale, over.palette)
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

    def _draw_scene(self, inside: Surface, scale: float, colours: Palette) -> None:
        for wall in self.scene.walls:
            start, end = ((x * scale, y * scale) for x, y in (wall.start, wall.to))
            capsule(inside, colours.ink, start, end, wall.thickness / 2 * scale)
        radius = scale * self.scene.bodies.radius
        blit_discs(inside, map(disc, radius.tolist(), self.scene.colors), scale * self.state.position, radius)

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
