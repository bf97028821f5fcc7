"""The keys of the window: one table for the window, its help and the README."""

from dataclasses import dataclass

import pygame
from pygame.event import Event


@dataclass(frozen=True)
class Control:
    """What keys do. `keys` are pygame key codes, `typed` the characters, whatever key types them on a keyboard."""

    action: str  # the method of the window
    shown: str
    does: str
    keys: tuple[int, ...] = ()
    typed: str = ""


CONTROLS = (
    Control("pause", "Space, P", "pause, and go on", (pygame.K_SPACE,), "p"),
    Control("one_step", "O, Right", "pause, and do one step", (pygame.K_RIGHT,), "o"),
    Control("restart", "R", "start again", (), "r"),
    Control("previous_scene", "[", "the bundled scene before", (), "["),
    Control("next_scene", "]", "the next bundled scene", (), "]"),
    Control("next_seed", "N", "start again with the next seed", (), "n"),
    Control("toggle_ghosts", "G", "outlines of the other pane's balls", (), "g"),
    Control("faster", "+", "twice as fast", (pygame.K_KP_PLUS,), "+="),
    Control("slower", "-", "half as fast", (pygame.K_KP_MINUS,), "-"),
    Control("toggle_help", "F1", "this help", (pygame.K_F1,)),
    Control("save_picture", "F12", "save a picture of the window", (pygame.K_F12,)),
    Control("quit", "Esc", "quit", (pygame.K_ESCAPE,)),
)
DRAG = ("Left drag", "pull the nearest ball, in every pane")


def action_of(event: Event) -> str | None:
    """Return the action that a key-down event asks for."""
    character = event.unicode.lower()
    for control in CONTROLS:
        if event.key in control.keys or (character and character in control.typed):
            return control.action
    return None
