"""A card with how one ball moves in every engine."""

from collections.abc import Sequence

from pygame import Surface

from sandbox.quantity import kinetic_energy, potential_energy, spin_energy
from sandbox.view.layout import Layout, ScreenPoint
from sandbox.view.pane import Pane
from sandbox.view.primitives import card


def draw_ball_card(surface: Surface, layout: Layout, panes: Sequence[Pane], ball: int, point: ScreenPoint) -> None:
    """Draw the card of a ball next to a point of the screen."""
    card(surface, ball_table(panes, ball), point, layout.text_height, surface.get_rect())


def ball_table(panes: Sequence[Pane], ball: int) -> list[list[str]]:
    """Return a ball's position, velocity, spin if balls can turn, and energy in every engine, as rows of a table."""
    turns = panes[0].scene.turns
    spin_title = ["spin, rad/s"] if turns else []
    rows = [[f"ball {ball}", "position, px", "velocity, px/s", *spin_title, "energy, kg px²/s²"]]
    for pane in panes:
        scene, one = pane.scene, slice(ball, ball + 1)
        position, velocity, mass = pane.state.position[one], pane.state.velocity[one], scene.bodies.mass[one]
        total = kinetic_energy(velocity, mass) + spin_energy(pane.state.spin[one], scene.bodies.moment[one])
        total += potential_energy(position, mass, scene.gravity, scene.arena.size)
        (x, y), (vx, vy) = position[0], velocity[0]
        spin = [f"{pane.state.spin[ball]:.2f}"] if turns else []
        rows.append([pane.name, f"{x:.2f}, {y:.2f}", f"{vx:.2f}, {vy:.2f}", *spin, f"{total:.6g}"])
    return rows
