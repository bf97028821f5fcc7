"""What the window can do: one table of its keys, buttons, help and functions, which the documentation shows too."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, StrEnum
from functools import partial
from typing import Any, Final

import pygame
from pygame.event import Event

from sandbox.view import Layer
from sandbox.view.theme import theme

LEFT: Final = "\N{SINGLE LEFT-POINTING ANGLE QUOTATION MARK}"
RIGHT: Final = "\N{SINGLE RIGHT-POINTING ANGLE QUOTATION MARK}"


class Panel(Enum):
    """A page of the column. The value is its name."""

    SCENE = "Scene"
    BALLS = "Balls"
    ENGINES = "Engines"
    WHY = "Why"
    SHOW = "Show"


class Topic(StrEnum):
    """What one wants to do: the help is grouped by it, the first things first."""

    FIRST = "First of all"
    TIME = "Time"
    COMPARE = "Compare"
    EDIT = "Balls and walls"
    SEE = "In the panes"
    FILES = "Scenes and files"
    WINDOW = "The window"


@dataclass(frozen=True, eq=False)
class Control:
    """An action of the window.

    key: as the help spells it. name: on its button. do: what it does to the `Window`, which is not imported here, as
    its parts import this table. is_on: whether what it turns on and off is on.
    """

    topic: Topic
    key: str
    name: str
    does: str
    do: Callable[[Any], object]
    is_on: Callable[[Any], bool] = lambda _: False


def _layer(layer: Layer, key: str, name: str, does: str) -> Control:
    return Control(
        Topic.SEE,
        key,
        name,
        does,
        lambda w: w.showing.symmetric_difference_update({layer}),
        lambda w: layer in w.showing,
    )


def _page(page: Panel, key: str, does: str) -> Control:
    topic = Topic.FIRST if page is Panel.WHY else Topic.WINDOW
    return Control(topic, key, page.value, does, lambda w: w.panel.toggle(page), lambda w: w.panel.open is page)


_first, _time, _compare, _edit = (
    partial(Control, topic) for topic in (Topic.FIRST, Topic.TIME, Topic.COMPARE, Topic.EDIT)
)
_see, _files, _window = (partial(Control, topic) for topic in (Topic.SEE, Topic.FILES, Topic.WINDOW))


class Action(Enum):
    """What the window does when a key or a button asks for it."""

    PAUSE = _first("Space", "Play", "pause or resume", lambda w: w.playback.pause(), lambda w: w.playback.paused)
    STEP = _first("Right", RIGHT, "pause and do one step", lambda w: w.playback.step())
    RESTART = _first("R", "Restart", "restart; edits stay, made at the start", lambda w: w.restart(keep=True))
    PICK_SCENE = _first("/", "Open\N{HORIZONTAL ELLIPSIS}", "choose a scene", lambda w: w.scenes.open_picker())
    UNDO = _first("Ctrl Z", "Undo", "undo the last throw or edit", lambda w: w.playback.undo())
    WHY = _page(Panel.WHY, "F5", "why engines differ: verdict, contacts and causes")
    SAVE_SCENE = _first(
        "Ctrl S", "Scene file", "save the balls as they are as a scene",
        lambda w: w.saver.save_scene(w.mouse.pane or 0),
    )  # fmt: skip
    HELP = _first("F1", "Help", "show or hide the help", lambda w: w.cards.toggle_help(), lambda w: w.cards.help_open)
    ESCAPE = _first("Escape", "", "close what is open over the panes; twice, quit", lambda w: w.escape())

    GO_TO_START = _time("Home", f"|{LEFT}", "go to the start; later steps are kept", lambda w: w.playback.seek(0))
    STEP_BACK = _time("Left", LEFT, "pause and go one step back", lambda w: w.playback.step_back())
    GO_TO_END = _time(
        "End", f"{RIGHT}|", "go to the latest step reached", lambda w: w.playback.seek(w.playback.session.end)
    )
    SLOWER = _time("-", "\N{MINUS SIGN}", "slower, down to 1/100", lambda w: w.playback.change_speed(-1))
    FASTER = _time("+", "+", "faster, up to as fast as possible", lambda w: w.playback.change_speed(1))

    PREVIOUS_CONTACT = _compare(
        "<", f"{LEFT} Previous", "go to the previous contact that differs", lambda w: w.show_contact(-1)
    )
    NEXT_CONTACT = _compare(">", f"Next {RIGHT}", "go to the next one, and draw it", lambda w: w.show_contact(1))
    GHOSTS = _layer(Layer.GHOSTS, "G", "Outlines of exact", "outlines of the balls in exact, of up to 300")
    CHARTS = _layer(Layer.CHARTS, "H", "Chart", "charts")

    REDO = _edit("Ctrl Y", "Redo", "redo what was undone", lambda w: w.playback.redo())
    DISCARD_EDITS = _edit(
        "Shift R", "Discard edits", "restart without edits; undo brings them back", lambda w: w.restart(keep=False)
    )
    DELETE = _edit("Delete", "", "delete the selected ball or wall", lambda w: w.editor.delete())

    VELOCITY = _layer(Layer.VELOCITY, "V", "Velocities", "velocity arrows, to where a ball would be in 0.2 s")
    TRAILS = _layer(Layer.TRAILS, "T", "Trails", "trails of where the balls were")
    NUMBERS = _layer(Layer.NUMBERS, "B", "Numbers", "ball numbers, of up to 30 balls")
    SHOW_ALL = _see("0", "Fit", "show all of the arena again", lambda w: w.mouse.show_all())

    PREVIOUS_SCENE = _files("[", LEFT, "previous bundled scene", lambda w: w.scenes.open_bundled(-1))
    NEXT_SCENE = _files("]", RIGHT, "next bundled scene", lambda w: w.scenes.open_bundled(1))
    NEXT_SEED = _files("N", "Next seed", "restart with the next seed", lambda w: w.scenes.next_seed())
    SAVE_INPUTS = _files(
        "J", "What I did", "save what you did, and show the command that replays it", lambda w: w.saver.save_inputs()
    )
    SAVE_PICTURE = _files("F12", "Picture", "save a picture of the window", lambda w: w.save_picture())
    RECORD = _files(
        "F9", "Record", "start or stop recording a GIF",
        lambda w: w.recorder.toggle(w.saver.free_name(".gif"), w.screen.get_size()),
        lambda w: w.recorder.seconds is not None,
    )  # fmt: skip

    SCENE = _page(Panel.SCENE, "F2", "the scene: gravity, elasticity, steps")
    BALLS = _page(Panel.BALLS, "F3", "the selected ball or wall")
    ENGINES = _page(Panel.ENGINES, "F4", "the engines")
    SHOW = _page(Panel.SHOW, "F6", "what is shown: arrows, trails, numbers and more")
    COLUMN = _window(
        "F8", "Panel", "show or hide the column", lambda w: w.panel.toggle(), lambda w: w.panel.open is not None
    )
    THEME = _window(
        "F7", "Dark", "light, or dark", lambda _: theme.use(dark=not theme.is_dark), lambda _: theme.is_dark
    )
    LARGER_TEXT = _window("Ctrl +", "Larger text", "larger text", lambda w: w.change_text(1))
    SMALLER_TEXT = _window("Ctrl -", "Smaller text", "smaller text", lambda w: w.change_text(-1))


BY_MOUSE: Final = {
    Topic.FIRST: ("Drag a ball", "pull it while time passes; if paused, set its velocity"),
    Topic.TIME: ("Drag in the chart", "go to that time, as on the timeline"),
    Topic.COMPARE: ("Mouse on a ball", "its position, velocity and energy in every engine"),
    Topic.EDIT: ("Drag a wall", "move it; the tools below the panes do more"),
    Topic.SEE: ("Wheel, drag", "zoom in and out; move what the panes show by empty ground"),
    Topic.FILES: ("Drop a file", "run its scene"),
    Topic.WINDOW: ("Click a value", "type another, and press Enter"),
}
HELP: Final = tuple(  # rows of its table: a topic, a key, and what it does
    (topic, key, does)
    for topic in Topic
    for key, does in (
        BY_MOUSE[topic],
        *((action.value.key, action.value.does) for action in Action if action.value.topic is topic),
    )
)


def tip_of(action: Action) -> str:
    """Return what a control does, and its key."""
    does = action.value.does
    return f"{does[0].upper()}{does[1:]}  ({action.value.key})"


LETTERS: Final = {code: chr(code + 64) for code in range(32)}  # of the control characters that Ctrl makes of them
BY_KEY: Final = {action.value.key.upper(): action for action in Action}


def action_of(event: Event) -> Action | None:
    """Return the action whose key a key-down event is about: what it types, whatever key that is, or else the key."""
    ctrl, typed, key = event.mod & pygame.KMOD_CTRL, event.unicode.upper(), pygame.key.name(event.key).upper()
    if ctrl:
        typed = typed.translate(LETTERS)
    held = "CTRL " if ctrl else "SHIFT " if event.mod & pygame.KMOD_SHIFT else ""
    names = [name for typed_or_key in (typed, key) for name in (held + typed_or_key, *([] if ctrl else [typed_or_key]))]
    return next((BY_KEY[name] for name in names if name in BY_KEY), None)
