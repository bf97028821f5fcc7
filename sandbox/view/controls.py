"""What the window can be told to do: one table for its keys, its toolbar, its help and the README."""

from dataclasses import dataclass

import pygame
from pygame.event import Event


@dataclass(frozen=True)
class Control:
    """Something that a key does, and a button of the toolbar if it has an icon.

    keys: pygame key codes, with Shift or without it; typed: characters, whatever key types them on a keyboard; shows:
    what it shows or hides (the action is `show` then); icon_on: the icon while it is on, where that is another one. A
    group stands together.
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
    shift: bool = False


def _layer(shows: str, key: str, does: str) -> Control:
    return Control("see", "show", key, does, (), key.lower(), icon=shows, shows=shows)


CONTROLS = (
    Control(
        "time", "to_start", "Home", "to the start, and what was done since is kept", (pygame.K_HOME,), icon="start"
    ),
    Control("time", "step_back", "Left", "pause, and go one step back", (pygame.K_LEFT,), icon="back"),
    Control("time", "pause", "Space, P", "pause, and go on", (pygame.K_SPACE,), "p", icon="pause", icon_on="play"),
    Control("time", "one_step", "O, Right", "pause, and do one step", (pygame.K_RIGHT,), "o", icon="step"),
    Control("time", "to_end", "End", "to the furthest that was reached", (pygame.K_END,), icon="end"),
    Control("time", "second_back", "Page Up", "one second back", (pygame.K_PAGEUP,)),
    Control("time", "second_on", "Page Down", "one second on, as far as one has been", (pygame.K_PAGEDOWN,)),
    Control("time", "restart", "R", "start again, with nothing done yet", (), "r", icon="restart"),
    Control("time", "slower", "-", "slower, down to 1/100", (pygame.K_KP_MINUS,), "-", icon="slower"),
    Control("time", "faster", "+", "faster, up to all the machine can", (pygame.K_KP_PLUS,), "+=", icon="faster"),
    Control("scene", "pick", "/, Ctrl O", "choose a scene", (), "/\x0f", icon="pick"),
    Control("scene", "previous_scene", "[", "the bundled scene before", (), "[", icon="previous"),
    Control("scene", "next_scene", "]", "the next bundled scene", (), "]", icon="next"),
    Control("scene", "next_seed", "N", "start again with the next seed", (), "n", icon="seed"),
    Control("scene", "save_scene", "S, Ctrl S", "save the balls as they are as a scene", (), "s\x13", icon="save"),
    Control("edit", "undo", "U, Ctrl Z", "go back to before the last throw or edit", (), "u\x1a", icon="undo"),
    Control("edit", "redo", "Y, Ctrl Y", "do again what was undone", (), "y\x19", icon="redo"),
    Control("edit", "add_ball", "A", "add a ball: at the mouse, or where it is clicked next", (), "a", icon="add"),
    Control(
        "edit",
        "delete_ball",
        "Delete",
        "delete the ball under the mouse, or the chosen one",
        (pygame.K_DELETE, pygame.K_BACKSPACE),
        icon="delete",
    ),
    Control("edit", "choose_previous", ",", "choose the ball before", (), ","),
    Control("edit", "choose_next", ".", "choose the next ball", (), "."),
    Control("edit", "push_left", "Shift Left", "the chosen ball goes more to the left", (pygame.K_LEFT,), shift=True),
    Control("edit", "push_right", "Shift Right", "more to the right", (pygame.K_RIGHT,), shift=True),
    Control("edit", "push_up", "Shift Up", "more upwards", (pygame.K_UP,), shift=True),
    Control("edit", "push_down", "Shift Down", "more downwards", (pygame.K_DOWN,), shift=True),
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
    Control("window", "escape", "Esc", "close what is open over the panes, else quit", (pygame.K_ESCAPE,)),
)
DRAG = ("Left drag", "pull the nearest ball, in every pane; paused: set its velocity")
SCRUB = ("Drag in the charts", "go to that time; where they are not shown, in the bar")
HOVER = ("Mouse on a ball", "where it is, its velocity and its energy, in every engine")
WALK = ("Tab, Enter, arrows", "go to the next button of the toolbar, press it, move a slider")
HELP = (DRAG, SCRUB, HOVER, *((control.shown, control.does) for control in CONTROLS), WALK)


def control_of(event: Event) -> Control | None:
    """Return the control that a key-down event is of."""
    character, shift = event.unicode.lower(), bool(getattr(event, "mod", 0) & pygame.KMOD_SHIFT)
    for control in CONTROLS:
        if (event.key in control.keys and shift == control.shift) or (character and character in control.typed):
            return control
    return None
