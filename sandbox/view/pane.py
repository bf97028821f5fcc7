"""One engine's pane: its arena as the engine has it now, and over it what belongs to comparing and dragging."""

import pygame
from pygame import Surface

from sandbox.engines import Engine
from sandbox.engines.pymunk import PymunkEngine
from sandbox.inputs import Hand
from sandbox.quantity import energy
from sandbox.scene import Scene, rgb
from sandbox.state import State
from sandbox.view.debug_draw import draw_space, paint
from sandbox.view.draw import capsule, disc, write
from sandbox.view.layout import Layout
from sandbox.view.palette import INK, contrast


class Pane:
    """What is shown of one engine. A Pymunk space is drawn by Pymunk's debug-draw, any other engine by the scene."""

    def __init__(self, scene: Scene, name: str, engine: Engine) -> None:
        self.scene = scene
        self.name = name
        self.engine = engine
        self.state = engine.state()
        self.contacts = len(engine.contacts())
        self.energy_at_start = self._energy_now()
        if isinstance(engine, PymunkEngine):
            paint(engine.space, scene.colors)

    def _energy_now(self) -> float:
        return float(energy(self.scene, self.state.position, self.state.velocity))

    def refresh(self) -> None:
        """Look at the engine again."""
        self.state = self.engine.state()
        self.contacts += len(self.engine.contacts())

    @property
    def title(self) -> str:
        """Engine, energy left, contacts."""
        left = f"{self._energy_now() / self.energy_at_start:.1%}" if self.energy_at_start else "none at the start"
        return f"{self.name}    energy {left}    contacts {self.contacts}"

    def draw(self, surface: Surface, layout: Layout, index: int, ghosts: State | None, hand: Hand) -> None:
        """Draw the pane at its place in a layout, with the outlines of another engine's balls where given."""
        arena = layout.arenas[index]
        inside = surface.subsurface(arena)
        inside.fill(rgb(self.scene.arena.background))
        if isinstance(self.engine, PymunkEngine):
            draw_space(inside, self.engine.space, layout.scale)
        else:
            self._draw_scene(inside, layout.scale)
        if ghosts is not None:
            self._draw_ghosts(inside, layout.scale, ghosts)
        if hand.ball is not None:
            self._draw_pull(inside, layout.scale, hand, hand.ball)
        write(surface, self.title, layout.title(index), INK, layout.text_height)

    def _draw_scene(self, inside: Surface, scale: float) -> None:
        ink = contrast(self.scene.arena.background)
        for wall in self.scene.walls:
            start, end = ((x * scale, y * scale) for x, y in (wall.start, wall.to))
            capsule(inside, ink, start, end, wall.thickness / 2 * scale)
        balls = zip(self.state.position.tolist(), self.scene.bodies.radius.tolist(), self.scene.colors, strict=True)
        for (x, y), radius, colour in balls:
            picture = disc(radius * scale, colour)
            inside.blit(
                picture, (round(x * scale) - picture.get_width() // 2, round(y * scale) - picture.get_height() // 2)
            )

    def _draw_ghosts(self, inside: Surface, scale: float, ghosts: State) -> None:
        balls = zip(ghosts.position.tolist(), self.scene.bodies.radius.tolist(), self.scene.colors, strict=True)
        for (x, y), radius, colour in balls:
            centre = round(x * scale), round(y * scale)
            pygame.draw.circle(inside, rgb(colour), centre, max(2, round(radius * scale)), 2)

    def _draw_pull(self, inside: Surface, scale: float, hand: Hand, ball: int) -> None:
        ink = contrast(self.scene.arena.background)
        start, end = ([round(c * scale) for c in point] for point in (self.state.position[ball], hand.target))
        pygame.draw.line(inside, ink, start, end, 2)
        pygame.draw.circle(inside, ink, end, 4)


def draw_panes(surface: Surface, layout: Layout, panes: list[Pane], *, ghosts: bool, hand: Hand) -> None:
    """Draw every pane; the first lends its balls as ghosts to the last, and the last to all others."""
    for index, pane in enumerate(panes):
        other = panes[0] if pane is panes[-1] else panes[-1]
        pane.draw(surface, layout, index, other.state if ghosts and other is not pane else None, hand)
