"""What the window can be told to do: one table for its keys, its toolbar, its help and the README."""

from dataclasses import dataclass

import pygame
from pygame.event import Event


@dataclass(frozen=True)
class Control:
    """Something that a key does, and a button of the toolbar if it has an icon.

    keys: pygame key codes; typed: characters, whatever key types them on a keyboard; shows: what it shows or hides
    (the action is `show` then); icon_on: the icon while it is on, where that is another one. A group stands together.
    """

    group: str
    action: str  # the method of the window
    shown: str
    does: str
    keys: tuple[int, ...] = ()
    typed: str = ""
    icon: str = ""
    icon_on: str = ""
    shows: str = ""


def _layer(shows: str, key: str, does: str) -> Control:
    return Control("see", "show", key, does, (), key.lower(), icon=shows, shows=shows)


CONTROLS = (
    Control("time", "pause", "Space, P", "pause, and go on", (pygame.K_SPACE,), "p", icon="pause", icon_on="play"),
    Control("time", "one_step", "O, Right", "pause, and do one step", (pygame.K_RIGHT,), "o", icon="step"),
    Control("time", "restart", "R", "start again", (), "r", icon="restart"),
    Control("time", "slower", "-", "half as fast", (pygame.K_KP_MINUS,), "-", icon="slower"),
    Control("time", "faster", "+", "twice as fast", (pygame.K_KP_PLUS,), "+=", icon="faster"),
    Control("scene", "previous_scene", "[", "the bundled scene before", (), "[", icon="previous"),
    Control("scene", "next_scene", "]", "the next bundled scene", (), "]", icon="next"),
    Control("scene", "next_seed", "N", "start again with the next seed", (), "n", icon="seed"),
    _layer("velocity", "V", "arrows of velocity: where a ball would be in 0.2 s"),
    _layer("momentum", "M", "arrows of momentum"),
    _layer("trails", "T", "where the balls were"),
    _layer("contacts", "C", "contacts, and their impulse"),
    _layer("centre", "X", "the centre of mass"),
    _layer("numbers", "B", "the balls' numbers"),
    _layer("ghosts", "G", "outlines of the other pane's balls"),
    _layer("grid", "L", "lines of a grid"),
    _layer("charts", "H", "the charts"),
    Control("window", "save_picture", "F12", "save a picture of the window", (pygame.K_F12,), icon="picture"),
    Control("window", "record", "F9", "start and stop recording a GIF", (pygame.K_F9,), icon="record", icon_on="stop"),
    Control("window", "show", "F1", "this help", (pygame.K_F1,), icon="help", shows="help"),
    Control("window", "quit", "Esc", "quit", (pygame.K_ESCAPE,)),
)
DRAG = ("Left drag", "pull the nearest ball, in every pane")
HOVER = ("Mouse on a ball", "where it is, its velocity and its energy, in every engine")
WALK = ("Tab, Enter, arrows", "go to the next button of the toolbar, press it, move a slider")
HELP = (DRAG, HOVER, *((control.shown, control.does) for control in CONTROLS), WALK)


def control_of(event: Event) -> Control | None:
    """Return the control that a key-down event is of."""
    character = event.unicode.lower()
    for control in CONTROLS:
        if event.key in control.keys or (character and character in control.typed):
            return control
    return None
