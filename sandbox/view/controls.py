"""What the window can do: one table for its keys, its help and the documentation."""

from dataclasses import dataclass
from enum import Enum, auto

import pygame
from pygame.event import Event

from sandbox.view.layers import Layer


class Group(Enum):
    """Controls that stand together in the help."""

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
    STOPWATCH = auto()
    TAKE_SNAPSHOT = auto()
    RETURN = auto()
    SLOWER = auto()
    FASTER = auto()
    PICK_SCENE = auto()
    PREVIOUS_SCENE = auto()
    NEXT_SCENE = auto()
    NEXT_SEED = auto()
    SAVE_SCENE = auto()
    SAVE_INPUTS = auto()
    COPY_CODE = auto()
    UNDO = auto()
    REDO = auto()
    ADD_BALL = auto()
    DELETE_BALL = auto()
    NEXT_TOOL = auto()
    COOL = auto()
    HEAT = auto()
    USE_IMPULSE = auto()
    SELECT_PREVIOUS = auto()
    SELECT_NEXT = auto()
    NEXT_CHART = auto()
    SCALE = auto()
    SHOW_ALL = auto()
    ZOOM_IN = auto()
    ZOOM_OUT = auto()
    LARGER_TEXT = auto()
    SMALLER_TEXT = auto()
    THEME = auto()
    ABOUT = auto()
    COLUMN = auto()
    PLAIN = auto()
    SAVE_PICTURE = auto()
    RECORD = auto()
    FULL_SCREEN = auto()
    HELP = auto()
    ESCAPE = auto()


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

    group: Group
    action: Action | Layer | Panel
    key_names: str
    does: str
    keys: tuple[int, ...] = ()
    typed: str = ""
    shift: bool = False
    ctrl: bool = False
    repeats: bool = False


def _layer(layer: Layer, key: str, does: str) -> Control:
    return Control(Group.LAYERS, layer, key, does, (), key.lower())


def _page(panel: Panel, key_names: str, does: str, key: int, typed: str = "") -> Control:
    return Control(Group.SCENE, panel, key_names, does, (key,), typed)


CONTROLS = (
    Control(Group.TIME, Action.GO_TO_START, "Home", "go to the start; later steps are kept", (pygame.K_HOME,)),
    Control(
        Group.TIME,
        Action.STEP_BACK,
        "Left",
        "pause and go one step back",
        (pygame.K_LEFT,),
        repeats=True,
    ),
    Control(Group.TIME, Action.PAUSE, "Space, P", "pause or resume", (pygame.K_SPACE,), "p"),
    Control(
        Group.TIME,
        Action.STEP,
        "O, Right",
        "pause and do one step",
        (pygame.K_RIGHT,),
        "o",
        repeats=True,
    ),
    Control(Group.TIME, Action.GO_TO_END, "End", "go to the latest step reached", (pygame.K_END,)),
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
    Control(Group.TIME, Action.RESTART, "R", "restart and clear edits", (), "r"),
    Control(Group.TIME, Action.STOPWATCH, "M", "stopwatch from here, or show the time again", (), "m"),
    Control(Group.TIME, Action.TAKE_SNAPSHOT, "3", "take a snapshot to return to", (), "3"),
    Control(Group.TIME, Action.RETURN, "4", "return to the latest snapshot", (), "4"),
    Control(Group.TIME, Action.SLOWER, "-", "slower, down to 1/100", (pygame.K_KP_MINUS,), "-"),
    Control(Group.TIME, Action.FASTER, "+", "faster, up to as fast as possible", (pygame.K_KP_PLUS,), "+="),
    Control(Group.SCENE, Action.PICK_SCENE, "/, Ctrl O", "choose a scene", (), "/\x0f"),
    Control(Group.SCENE, Action.PREVIOUS_SCENE, "[", "previous bundled scene", (), "["),
    Control(Group.SCENE, Action.NEXT_SCENE, "]", "next bundled scene", (), "]"),
    Control(Group.SCENE, Action.NEXT_SEED, "N", "restart with the next seed", (), "n"),
    Control(Group.SCENE, Action.SAVE_SCENE, "S, Ctrl S", "save the balls as they are as a scene", (), "s\x13"),
    Control(
        Group.SCENE,
        Action.SAVE_INPUTS,
        "J, Ctrl C",
        "save what you did, and copy the command",
        (),
        "j\x03",
    ),
    Control(Group.SCENE, Action.COPY_CODE, "Q", "copy the balls as they are as a program for Pymunk", (), "q"),
    _page(Panel.SCENE, "F2", "the scene: gravity, elasticity, steps", pygame.K_F2),
    _page(Panel.BALLS, "F3, K", "the balls: a table, and the selected ball or wall", pygame.K_F3, "k"),
    _page(Panel.ENGINES, "F4, E", "the engines, and Pymunk's settings", pygame.K_F4, "e"),
    _page(Panel.WHY, "F5, W", "why engines differ: verdict, contacts and causes", pygame.K_F5, "w"),
    _page(Panel.SHOW, "F6", "what is shown: arrows, trails, numbers and more", pygame.K_F6),
    Control(Group.EDIT, Action.UNDO, "U, Ctrl Z", "undo the last throw or edit", (), "u\x1a"),
    Control(Group.EDIT, Action.REDO, "Y, Ctrl Y", "redo what was undone", (), "y\x19"),
    Control(Group.EDIT, Action.ADD_BALL, "A", "add a ball at the mouse, or where you click next", (), "a"),
    Control(
        Group.EDIT,
        Action.DELETE_BALL,
        "Delete",
        "delete the ball at the mouse, or the selected one",
        (pygame.K_DELETE, pygame.K_BACKSPACE),
    ),
    Control(Group.EDIT, Action.NEXT_TOOL, "F", "next tool: hand, move, ball, wall, erase", (), "f"),
    Control(Group.EDIT, Action.COOL, "5", "cool: take a tenth of the balls' energy of motion", (), "5"),
    Control(Group.EDIT, Action.HEAT, "6", "heat: give a tenth more", (), "6"),
    Control(Group.EDIT, Action.USE_IMPULSE, "I", "replace article by impulse", (), "i"),
    Control(
        Group.EDIT,
        Action.SELECT_PREVIOUS,
        ",",
        "select the previous ball; in Balls, walls too",
        (),
        ",",
        repeats=True,
    ),
    Control(Group.EDIT, Action.SELECT_NEXT, ".", "select the next ball; in Balls, walls too", (), ".", repeats=True),
    _layer(Layer.VELOCITY, "V", "velocity arrows, to where a ball would be in 0.2 s"),
    _layer(Layer.TRAILS, "T", "trails of where the balls were"),
    _layer(Layer.CONTACTS, "C", "contacts and their impulses"),
    _layer(Layer.CENTRE, "X", "centre of mass"),
    _layer(Layer.NUMBERS, "B", "ball numbers, of up to 1,000 balls"),
    _layer(Layer.GHOSTS, "G", "outlines of the balls in exact"),
    _layer(Layer.GRID, "L", "grid lines"),
    _layer(Layer.CHARTS, "H", "charts"),
    Control(Group.WINDOW, Action.NEXT_CHART, "1", "next chart", (), "1"),
    Control(Group.WINDOW, Action.SCALE, "2", "logarithmic chart, or linear", (), "2"),
    Control(Group.WINDOW, Action.SHOW_ALL, "0", "show all of the arena again", (), "0"),
    Control(Group.WINDOW, Action.ZOOM_IN, "Z", "enlarge what the panes show", (pygame.K_z,), repeats=True),
    Control(
        Group.WINDOW, Action.ZOOM_OUT, "Shift Z", "show more of the arena", (pygame.K_z,), shift=True, repeats=True
    ),
    Control(
        Group.WINDOW,
        Action.LARGER_TEXT,
        "Ctrl +",
        "larger text",
        (pygame.K_EQUALS, pygame.K_PLUS, pygame.K_KP_PLUS),
        ctrl=True,
    ),
    Control(
        Group.WINDOW, Action.SMALLER_TEXT, "Ctrl -", "smaller text", (pygame.K_MINUS, pygame.K_KP_MINUS), ctrl=True
    ),
    Control(Group.WINDOW, Action.THEME, "F7", "light, or dark", (pygame.K_F7,)),
    Control(Group.WINDOW, Action.ABOUT, "F10", "show or hide what the scene is about", (pygame.K_F10,)),
    Control(Group.WINDOW, Action.COLUMN, "F8", "show or hide the column", (pygame.K_F8,)),
    Control(Group.WINDOW, Action.PLAIN, "D", "Pymunk's debug-draw plain, or smooth", (), "d"),
    Control(Group.WINDOW, Action.SAVE_PICTURE, "F12", "save a picture of the window", (pygame.K_F12,)),
    Control(
        Group.WINDOW,
        Action.RECORD,
        "F9",
        "start or stop recording a GIF",
        (pygame.K_F9,),
    ),
    Control(Group.WINDOW, Action.FULL_SCREEN, "F11", "full screen, or a window again", (pygame.K_F11,)),
    Control(Group.WINDOW, Action.HELP, "F1", "show or hide the help", (pygame.K_F1,)),
    Control(Group.WINDOW, Action.ESCAPE, "Esc", "close what is open over the panes; twice, quit", (pygame.K_ESCAPE,)),
)
HELP = (
    ("Left drag", "pull a ball or a wall; if paused, set a velocity"),
    ("Drag in the charts", "go to that time, as in the bar; the wheel zooms"),
    ("Wheel, middle drag", "zoom in and out, and move what the panes show"),
    ("Mouse on a ball", "show position, velocity and energy in every engine"),
    *((control.key_names, control.does) for control in CONTROLS),
    ("Tab, Enter, arrows", "next button, press it, move a slider"),
)


def control_of(event: Event) -> Control | None:
    """Return the control whose key a key-down event is about."""
    character, shift = event.unicode.lower(), bool(event.mod & pygame.KMOD_SHIFT)
    ctrl = bool(event.mod & pygame.KMOD_CTRL)
    for control in CONTROLS:
        by_key = event.key in control.keys and (shift == control.shift or ctrl) and ctrl == control.ctrl
        if by_key or (character and character in control.typed and not (ctrl and character.isprintable())):
            return control
    return None
