"""What the window can do: one table for its keys, its help and the documentation."""

from dataclasses import dataclass
from enum import Enum
from typing import Final

import pygame
from pygame.event import Event

from sandbox.view import Layer

# What the window does when a key or a button asks for it.
Action = Enum(
    "Action",
    "GO_TO_START STEP_BACK PAUSE STEP GO_TO_END SECOND_BACK SECOND_FORWARD PREVIOUS_CONTACT NEXT_CONTACT "
    "RESTART DISCARD_EDITS SLOWER FASTER "
    "PICK_SCENE PREVIOUS_SCENE NEXT_SCENE NEXT_SEED SAVE_SCENE SAVE_INPUTS COPY_CODE "
    "UNDO REDO ADD_BALL DELETE_BALL NEXT_TOOL SELECT_PREVIOUS SELECT_NEXT "
    "NEXT_CHART SCALE SHOW_ALL ZOOM_IN ZOOM_OUT "
    "LARGER_TEXT SMALLER_TEXT THEME COLUMN PLAIN SAVE_PICTURE RECORD FULL_SCREEN HELP ESCAPE",
)


class Panel(Enum):
    """A page of the column. The value is its name."""

    SCENE = "Scene"
    BALLS = "Balls"
    ENGINES = "Engines"
    WHY = "Why"
    SHOW = "Show"


@dataclass(frozen=True)
class Control:
    """An action, or a layer or a page of the column to show or hide, with its keys.

    key_names: as the help spells them. keys: pygame key codes, pressed with Shift if `shift`, and with Ctrl if `ctrl`,
    else without. typed: characters, whatever key types them on a keyboard. repeats: while its key is held.
    """

    action: Action | Layer | Panel
    key_names: str
    does: str
    keys: tuple[int, ...] = ()
    typed: str = ""
    shift: bool = False
    ctrl: bool = False
    repeats: bool = False


def _control(action: Action | Layer | Panel, key_names: str, does: str, *, repeats: bool = False) -> Control:
    """Return a control whose keys are those that the help names: characters, with Ctrl or not, and keys by name."""
    keys, typed = list[int](), ""
    for name in key_names.split(", "):
        if name.startswith("Ctrl "):
            typed += chr(ord(name[-1]) & 31)  # the control character that it types
        elif len(name) == 1:
            typed += name.lower()
        else:
            keys.append(getattr(pygame, f"K_{name.upper().replace(' ', '')}"))
    return Control(action, key_names, does, tuple(keys), typed, repeats=repeats)


CONTROLS: Final = (
    _control(Action.GO_TO_START, "Home", "go to the start; later steps are kept"),
    _control(Action.STEP_BACK, "Left", "pause and go one step back", repeats=True),
    _control(Action.PAUSE, "Space, P", "pause or resume"),
    _control(Action.STEP, "O, Right", "pause and do one step", repeats=True),
    _control(Action.GO_TO_END, "End", "go to the latest step reached"),
    _control(Action.SECOND_BACK, "Page Up", "go one second back", repeats=True),
    _control(Action.SECOND_FORWARD, "Page Down", "go one second forward, at most to the latest step", repeats=True),
    _control(Action.PREVIOUS_CONTACT, "<", "go to the previous contact that differs", repeats=True),
    _control(Action.NEXT_CONTACT, ">", "go to the next contact that differs, and draw it", repeats=True),
    Control(Action.RESTART, "R", "restart; edits stay, and are made at the start", (pygame.K_r,)),
    Control(Action.DISCARD_EDITS, "Shift R", "restart without edits; undo brings them back", (pygame.K_r,), shift=True),
    Control(Action.SLOWER, "-", "slower, down to 1/100", (pygame.K_KP_MINUS,), "-"),
    Control(Action.FASTER, "+", "faster, up to as fast as possible", (pygame.K_KP_PLUS,), "+="),
    _control(Action.PICK_SCENE, "/, Ctrl O", "choose a scene"),
    _control(Action.PREVIOUS_SCENE, "[", "previous bundled scene"),
    _control(Action.NEXT_SCENE, "]", "next bundled scene"),
    _control(Action.NEXT_SEED, "N", "restart with the next seed"),
    _control(Action.SAVE_SCENE, "S, Ctrl S", "save the balls as they are as a scene"),
    _control(Action.SAVE_INPUTS, "J, Ctrl C", "save what you did, and copy the command"),
    _control(Action.COPY_CODE, "Q", "copy the balls as they are as a program for Pymunk"),
    _control(Panel.SCENE, "F2", "the scene: gravity, elasticity, steps"),
    _control(Panel.BALLS, "F3, K", "the balls: a table, and the selected ball or wall"),
    _control(Panel.ENGINES, "F4, E", "the engines, and Pymunk's settings"),
    _control(Panel.WHY, "F5, W", "why engines differ: verdict, contacts and causes"),
    _control(Panel.SHOW, "F6", "what is shown: arrows, trails, numbers and more"),
    _control(Action.UNDO, "U, Ctrl Z", "undo the last throw or edit"),
    _control(Action.REDO, "Y, Ctrl Y", "redo what was undone"),
    _control(Action.ADD_BALL, "A", "add a ball at the mouse, or where you click next"),
    Control(
        Action.DELETE_BALL,
        "Delete",
        "delete the ball at the mouse, or the selected one",
        (pygame.K_DELETE, pygame.K_BACKSPACE),
    ),
    _control(Action.NEXT_TOOL, "F", "next tool: hand, move, ball, wall, erase"),
    _control(Action.SELECT_PREVIOUS, ",", "select the previous ball; in Balls, walls too", repeats=True),
    _control(Action.SELECT_NEXT, ".", "select the next ball; in Balls, walls too", repeats=True),
    _control(Layer.VELOCITY, "V", "velocity arrows, to where a ball would be in 0.2 s"),
    _control(Layer.TRAILS, "T", "trails of where the balls were"),
    _control(Layer.CONTACTS, "C", "contacts and their impulses"),
    _control(Layer.CENTRE, "X", "centre of mass"),
    _control(Layer.NUMBERS, "B", "ball numbers, of up to 1,000 balls"),
    _control(Layer.GHOSTS, "G", "outlines of the balls in exact"),
    _control(Layer.GRID, "L", "grid lines"),
    _control(Layer.CHARTS, "H", "charts"),
    _control(Action.NEXT_CHART, "1", "next chart"),
    _control(Action.SCALE, "2", "logarithmic chart, or linear"),
    _control(Action.SHOW_ALL, "0", "show all of the arena again"),
    Control(Action.ZOOM_IN, "Z", "enlarge what the panes show", (pygame.K_z,), repeats=True),
    Control(Action.ZOOM_OUT, "Shift Z", "show more of the arena", (pygame.K_z,), shift=True, repeats=True),
    Control(Action.LARGER_TEXT, "Ctrl +", "larger text", (pygame.K_EQUALS, pygame.K_PLUS, pygame.K_KP_PLUS), ctrl=True),
    Control(Action.SMALLER_TEXT, "Ctrl -", "smaller text", (pygame.K_MINUS, pygame.K_KP_MINUS), ctrl=True),
    _control(Action.THEME, "F7", "light, or dark"),
    _control(Action.COLUMN, "F8", "show or hide the column"),
    _control(Action.PLAIN, "D", "Pymunk's debug-draw plain, or smooth"),
    _control(Action.SAVE_PICTURE, "F12", "save a picture of the window"),
    _control(Action.RECORD, "F9", "start or stop recording a GIF"),
    _control(Action.FULL_SCREEN, "F11", "full screen, or a window again"),
    _control(Action.HELP, "F1", "show or hide the help"),
    Control(Action.ESCAPE, "Esc", "close what is open over the panes; twice, quit", (pygame.K_ESCAPE,)),
)
OF_ACTION: Final[dict[object, Control]] = {control.action: control for control in CONTROLS}
EDITS: Final = (  # they apply to the balls at the current step
    *(Action.UNDO, Action.REDO, Action.ADD_BALL, Action.DELETE_BALL, Action.NEXT_TOOL),
    *(Action.SELECT_PREVIOUS, Action.SELECT_NEXT),
)
HELP: Final = (
    ("Left drag", "pull a ball or a wall; if paused, set a velocity"),
    ("Drag in the charts", "go to that time, as in the bar; the wheel zooms"),
    ("Wheel, middle drag", "zoom in and out, and move what the panes show"),
    ("Mouse on a ball", "show position, velocity and energy in every engine"),
    *((control.key_names, control.does) for control in CONTROLS),
    ("Tab, Enter, arrows", "next button, press it, move a slider"),
)


def tip_of(action: object) -> str:
    """Return what a control does, and its keys."""
    control = OF_ACTION[action]
    return f"{control.does[0].upper()}{control.does[1:]}  ({control.key_names})"


def control_of(event: Event) -> Control | None:
    """Return the control whose key a key-down event is about."""
    character, shift = event.unicode.lower(), bool(event.mod & pygame.KMOD_SHIFT)
    ctrl = bool(event.mod & pygame.KMOD_CTRL)
    for control in CONTROLS:
        by_key = event.key in control.keys and (shift == control.shift or ctrl) and ctrl == control.ctrl
        if by_key or (character and character in control.typed and not (ctrl and character.isprintable())):
            return control
    return None
