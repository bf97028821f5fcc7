"""A picture of one contact, large: the two bodies, normals, velocities and overlap."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import pygame
from pygame import Color, Rect, Surface

from sandbox.analysis.difference import Difference
from sandbox.scene.fields import rgb
from sandbox.scene.model import Scene
from sandbox.state import State
from sandbox.view.contact_mark import ContactMark
from sandbox.view.palette import palette
from sandbox.view.pane import draw_walls
from sandbox.view.widgets.widget import Widget

HEIGHT: Final = 13.0  # in heights of the text
RADIUS: Final = 2.0  # of the larger ball, likewise


@dataclass(eq=False)
class ContactPicture(Widget):
    """Draws a contact that differs as `ContactMark` does, with its balls as an engine found them.

    state: of the engine, at the end of the contact's step; colour: the engine's.
    """

    scene: Scene
    state: State
    difference: Difference
    colour: Color
    width: float = 5.0

    takes_keys = False

    def __post_init__(self) -> None:
        found, bodies = self.difference, self.scene.bodies
        normal = found.normal or found.should_normal
        second = found.second
        if normal and second is not None and second >= 0:
            position = self.state.position.copy()
            reach = bodies.radius[found.first] + bodies.radius[second] - (found.depth or 0.0)
            position[second] = position[found.first] + reach * np.array(normal)
            self.state = replace(self.state, position=position)

    @property
    def look(self) -> object:
        """The contact."""
        return self.difference, self.colour.normalize(), self.scene.arena.background

    def height(self, width: int, text_height: int) -> int:
        """Return its height, px."""
        return round(HEIGHT * text_height)

    def draw(self, surface: Surface, place: Rect, text_height: int, *, hot: bool) -> None:
        """Draw the bodies, and the contact over them."""
        scene, balls = self.scene, self.difference.balls
        picture = Surface(place.size)
        picture.fill(palette(scene.arena.background).ground)
        scale = RADIUS * text_height / float(scene.bodies.radius[balls].max())
        middle = self.state.position[balls].mean(axis=0)
        x, y = np.divide(place.size, 2) - scale * middle
        draw_walls(picture, scene, scale, (float(x), float(y)))
        for ball in balls:
            centre = scale * self.state.position[ball] + (x, y)
            pygame.draw.circle(picture, rgb(scene.colors[ball]), centre, scale * scene.bodies.radius[ball])
        mark = ContactMark(picture, scene, self.state, self.difference, scale, (float(x), float(y)), text_height)
        mark.draw(self.colour, overlap=True)
        mark.write_depth()
        surface.blit(picture, place)
