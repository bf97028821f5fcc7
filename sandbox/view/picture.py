"""A picture of a comparison, without a window."""

import io
from typing import Final

import pygame
from pygame import Surface

from sandbox.analysis.comparison import Comparison
from sandbox.analysis.gas import wall_impulse
from sandbox.engines import create
from sandbox.files import whole_file
from sandbox.judge.causes import Cause
from sandbox.session.history import Moment
from sandbox.state import no_contacts
from sandbox.view.layout import Layout
from sandbox.view.pane import Pane, draw_panes
from sandbox.view.primitives import write
from sandbox.view.theme import theme

PICTURE_SIZE: Final = (1280, 560)  # px


def draw_picture(comparison: Comparison) -> Surface:
    """Draw the end of each engine's run in a pane, as the window does."""
    scene = comparison.scene
    surface = Surface(PICTURE_SIZE)
    surface.fill(theme.ground)
    layout = Layout(PICTURE_SIZE, scene.arena.size, len(comparison.runs))
    panes = []
    end = Moment(
        step=len(comparison.time) - 1,
        time=float(comparison.time[-1]),
        scene=scene,
        states={name: run.final for name, run in comparison.runs.items()},
        contacts=dict.fromkeys(comparison.runs, no_contacts()),
        counts={name: len(run.contacts) for name, run in comparison.runs.items()},
        energy={name: float(run.energy[-1]) for name, run in comparison.runs.items()},
        work={
            name: sum(entry.energy for entry in run.figures.ledger if entry.cause == Cause.APPLIED)
            for name, run in comparison.runs.items()
        },
        balls=tuple(range(len(scene.bodies))),
        held=None,
        target=(0.0, 0.0),
        wall_impulse={name: wall_impulse(run.contacts, scene.arena.size) for name, run in comparison.runs.items()},
        energy_scale=comparison.energy_scale,
    )
    for name, run in comparison.runs.items():
        pane = Pane(end, name, create(name, scene, run.final))
        pane.energy_at_start = float(run.energy[0])
        panes.append(pane)
    draw_panes(surface, layout, panes, (), comparison.against, end.states.get(comparison.against))
    caption = f"{scene.title or scene.name}    seed {scene.seed}    {comparison.time[-1]:.2f} s"
    write(surface, caption, layout.status, theme.dim, layout.text_height)
    return surface


def save_picture(surface: Surface, path: str) -> None:
    """Write a surface as PNG. Raises SandboxError if the file cannot be written."""
    png = io.BytesIO()
    pygame.image.save(surface, png, "picture.png")
    with whole_file(path) as file:
        file.write(png.getvalue())
