"""What the window can do: one table for its keys, its toolbar, its help and the documentation."""

from dataclasses import dataclass
from enum import Enum, auto

import pygame
from pygame.event import Event

from sandbox.view.layers import Layer


class Group(Enum):
    """Controls that stand together in the toolbar and in the help."""

    TIME = auto()
    SCENE = auto()
    EDIT = auto()
    LAYERS = auto()
    WINDOW = auto()


class Action(Enum):
    """Something that the window does when a key or a button asks for it."""

    GO_TO_START = auto()
    STEP_BACK = auto()
    PAUSE = auto()
    STEP = auto()
    GO_TO_END = auto()
    SECOND_BACK = auto()
    SECOND_FORWARD = auto()
    PREVIOUS_CONTACT = auto()
    NEXT_CONTACT = auto()
    RESTART = auto()
    SLOWER = auto()
    FASTER = auto()
    PICK_SCENE = auto()
    PREVIOUS_SCENE = auto()
    NEXT_SCENE = auto()
    NEXT_SEED = auto()
    SAVE_SCENE = auto()
    SAVE_INPUTS = auto()
    UNDO = auto()
    REDO = auto()
    ADD_BALL = auto()
    DELETE_BALL = auto()
    USE_IMPULSE = auto()
    SELECT_PREVIOUS = auto()
    SELECT_NEXT = auto()
    PUSH_LEFT = auto()
    PUSH_RIGHT = auto()
    PUSH_UP = auto()
    PUSH_DOWN = auto()
    FIRST_CHART = auto()
    SECOND_CHART = auto()
    SHOW_ALL = auto()
    SAVE_PICTURE = auto()
    RECORD = auto()
    FULL_SCREEN = auto()
    HELP = auto()
    ESCAPE = auto()


class Panel(Enum):
    """A page that the side panel can show."""

    WHY = auto()
    ENGINES = auto()
    INSPECTOR = auto()


@dataclass(frozen=True)
class Control:
    """An action, or a layer or a page of the side panel to show or hide, with its keys.

    icon: its button's, if it is on the toolbar; icon_on: while the control is on, if it differs. key_names: as the help
    spells them. keys: pygame key codes, pressed with Shift if `shift`, else without. typed: characters, whatever key
    types them on a keyboard. repeats: while its key is held.
    """

    group: Group
    action: Action | Layer | Panel
    key_names: str
    does: str
    keys: tuple[int, ...] = ()
    typed: str = ""
    icon: str = ""
    icon_on: str = ""
    shift: bool = False
    repeats: bool = False


def _layer(layer: Layer, key: str, does: str) -> Control:
    return Control(Group.LAYERS, layer, key, does, (), key.lower(), icon=layer)


def _push(action: Action, key_name: str, does: str, key: int) -> Control:
    return Control(Group.EDIT, action, key_name, does, (key,), shift=True, repeats=True)


CONTROLS = (
    Control(
        Group.TIME, Action.GO_TO_START, "Home", "go to the start; later steps are kept", (pygame.K_HOME,), icon="start"
    ),
    Control(
        Group.TIME,
        Action.STEP_BACK,
        "Left",
        "pause and go one step back",
        (pygame.K_LEFT,),
        icon="back",
        repeats=True,
    ),
    Control(
        Group.TIME, Action.PAUSE, "Space, P", "pause or resume", (pygame.K_SPACE,), "p", icon="pause", icon_on="play"
    ),
    Control(
        Group.TIME,
        Action.STEP,
        "O, Right",
        "pause and do one step",
        (pygame.K_RIGHT,),
        "o",
        icon="step",
        repeats=True,
    ),
    Control(Group.TIME, Action.GO_TO_END, "End", "go to the latest step reached", (pygame.K_END,), icon="end"),
    Control(Group.TIME, Action.SECOND_BACK, "Page Up", "go one second back", (pygame.K_PAGEUP,), repeats=True),
    Control(
        Group.TIME,
        Action.SECOND_FORWARD,
        "Page Down",
        "go one second forward, at most to the latest step",
        (pygame.K_PAGEDOWN,),
        repeats=True,
    ),
    Control(Group.TIME, Action.PREVIOUS_CONTACT, "<", "go to the previous contact that differs", (), "<", repeats=True),
    Control(
        Group.TIME, Action.NEXT_CONTACT, ">", "go to the next contact that differs, and draw it", (), ">", repeats=True
    ),
    Control(Group.TIME, Action.RESTART, "R", "restart and clear edits", (), "r", icon="restart"),
    Control(Group.TIME, Action.SLOWER, "-", "slower, down to 1/100", (pygame.K_KP_MINUS,), "-", icon="slower"),
    Control(
        Group.TIME, Action.FASTER, "+", "faster, up to as fast as possible", (pygame.K_KP_PLUS,), "+=", icon="faster"
    ),
    Control(Group.SCENE, Action.PICK_SCENE, "/, Ctrl O", "choose a scene", (), "/\x0f", icon="pick"),
    Control(Group.SCENE, Action.PREVIOUS_SCENE, "[", "previous bundled scene", (), "[", icon="previous"),
    Control(Group.SCENE, Action.NEXT_SCENE, "]", "next bundled scene", (), "]", icon="next"),
    Control(Group.SCENE, Action.NEXT_SEED, "N", "restart with the next seed", (), "n", icon="seed"),
    Control(
        Group.SCENE, Action.SAVE_SCENE, "S, Ctrl S", "save the balls as they are as a scene", (), "s\x13", icon="save"
    ),
    Control(
        Group.SCENE,
        Action.SAVE_INPUTS,
        "J, Ctrl C",
        "save what you did, and copy the command",
        (),
        "j\x03",
        icon="inputs",
    ),
    Control(
        Group.SCENE,
        Panel.ENGINES,
        "E",
        "choose the engines, and Pymunk's settings",
        (),
        "e",
        icon="engines",
    ),
    Control(Group.SCENE, Panel.WHY, "W", "why engines differ: verdict, contacts and causes", (), "w", icon="why"),
    Control(Group.EDIT, Action.UNDO, "U, Ctrl Z", "undo the last throw or edit", (), "u\x1a", icon="undo"),
    Control(Group.EDIT, Action.REDO, "Y, Ctrl Y", "redo what was undone", (), "y\x19", icon="redo"),
    Control(Group.EDIT, Action.ADD_BALL, "A", "add a ball at the mouse, or where you click next", (), "a", icon="add"),
    Control(
        Group.EDIT,
        Action.DELETE_BALL,
        "Delete",
        "delete the ball at the mouse, or the selected one",
        (pygame.K_DELETE, pygame.K_BACKSPACE),
        icon="delete",
    ),
    Control(
        Group.EDIT,
        Panel.INSPECTOR,
        "K",
        "inspector: change and move balls and walls",
        (),
        "k",
        icon="inspect",
    ),
    Control(Group.EDIT, Action.USE_IMPULSE, "I", "replace article by impulse", (), "i"),
    Control(
        Group.EDIT,
        Action.SELECT_PREVIOUS,
        ",",
        "select the previous ball; in the inspector, walls too",
        (),
        ",",
        repeats=True,
    ),
    Control(
        Group.EDIT, Action.SELECT_NEXT, ".", "select the next ball; in the inspector, walls too", (), ".", repeats=True
    ),
    _push(Action.PUSH_LEFT, "Shift Left", "push the selected ball to the left, or move the wall", pygame.K_LEFT),
    _push(Action.PUSH_RIGHT, "Shift Right", "push it to the right", pygame.K_RIGHT),
    _push(Action.PUSH_UP, "Shift Up", "push it up", pygame.K_UP),
    _push(Action.PUSH_DOWN, "Shift Down", "push it down", pygame.K_DOWN),
    _layer(Layer.VELOCITY, "V", "velocity arrows, to where a ball would be in 0.2 s"),
    _layer(Layer.MOMENTUM, "M", "momentum arrows"),
    _layer(Layer.TRAILS, "T", "trails of where the balls were"),
    _layer(Layer.CONTACTS, "C", "contacts and their impulses"),
    _layer(Layer.CENTRE, "X", "centre of mass"),
    _layer(Layer.NUMBERS, "B", "ball numbers, of up to 1,000 balls"),
    _layer(Layer.GHOSTS, "G", "outlines of the balls in exact"),
    _layer(Layer.GRID, "L", "grid lines"),
    _layer(Layer.CHARTS, "H", "charts"),
    Control(Group.WINDOW, Action.FIRST_CHART, "1", "choose what the first chart shows", (), "1"),
    Control(Group.WINDOW, Action.SECOND_CHART, "2", "choose what the second chart shows", (), "2"),
    Control(Group.WINDOW, Action.SHOW_ALL, "0", "show all of the arena again", (), "0"),
    Control(Group.WINDOW, Action.SAVE_PICTURE, "F12", "save a picture of the window", (pygame.K_F12,), icon="picture"),
    Control(
        Group.WINDOW,
        Action.RECORD,
        "F9",
        "start or stop recording a GIF",
        (pygame.K_F9,),
        icon="record",
        icon_on="stop",
    ),
    Control(Group.WINDOW, Action.FULL_SCREEN, "F11", "full screen, or a window again", (pygame.K_F11,), icon="full"),
    Control(Group.WINDOW, Action.HELP, "F1", "show or hide the help", (pygame.K_F1,), icon="help"),
    Control(Group.WINDOW, Action.ESCAPE, "Esc", "close what is open over the panes; twice, quit", (pygame.K_ESCAPE,)),
)
HELP = (
    ("Left drag", "pull the nearest ball; if paused, set its velocity"),
    ("Drag in the charts", "go to that time, as in the bar; the wheel zooms"),
    ("Wheel, middle drag", "zoom in and out, and move what the panes show"),
    ("Mouse on a ball", "show position, velocity and energy in every engine"),
    *((control.key_names, control.does) for control in CONTROLS),
    ("Tab, Enter, arrows", "next item of the toolbar, press it, move a slider"),
)


def control_of(event: Event) -> Control | None:
    """Return the control whose key a key-down event is about."""
    character, shift = event.unicode.lower(), bool(event.mod & pygame.KMOD_SHIFT)
    for control in CONTROLS:
        if (event.key in control.keys and shift == control.shift) or (character and character in control.typed):
            return control
    return None
