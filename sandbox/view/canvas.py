"""A pane's arena to draw a scene on."""

from pygame import Surface

from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.state import Floats, State
from sandbox.view.theme import palette


class Canvas:
    """A surface that shows a scene in some state.

    scale: px of the surface for one px of the scene; origin: where the scene's is on it; text_height: px.
    """

    def __init__(
        self,
        surface: Surface,
        scene: Scene,
        state: State,
        *,
        scale: float,
        text_height: int,
        origin: Vector = (0.0, 0.0),
    ) -> None:
        self.surface = surface
        self.scene = scene
        self.state = state
        self.scale = scale
        self.origin = origin
        self.text_height = text_height
        self.palette = palette(scene.arena.background)

    def at(self, position: Floats) -> Floats:
        """Turn positions in the scene, (..., 2) px, into places on the surface."""
        return position * self.scale + self.origin
