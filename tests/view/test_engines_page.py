"""The page of engines: by mouse alone and by keyboard alone, each pane in its own colour."""

import numpy as np
import pygame
import pytest
from conftest import scene_of
from pygame import Rect
from window_driver import THREE_BALLS, click, colours, mouse, press, run

from sandbox.view.engines_page import FULL
from sandbox.view.session_view import SessionView
from sandbox.view.theme import chart_palette
from sandbox.view.widgets import TextButton, Widget, Words
from sandbox.view.widgets.fields import Field, Slider
from sandbox.view.window import Window

pytestmark = pytest.mark.usefixtures("memory_screen")
TUNED = "pymunk(iterations=30, substeps=4)"


@pytest.fixture
def window(memory_screen: None) -> Window:
    """Open the page beside two panes, of Pymunk and Pymunk with settings, after some steps."""
    window = Window(scene_of(*THREE_BALLS), ["pymunk", TUNED])
    window.screen = pygame.display.set_mode((1024, 640))
    press(window, "e")
    run(window, 20)
    return window


def placed(window: Window) -> list[tuple[Widget, Rect]]:
    return window.panel.placed(window.layout.panel, window.layout.text_height)


def find(window: Window, name: str, kind: type[Widget] = Widget) -> tuple[Widget, Rect]:
    """Return the last widget of the page with a text or name, and its place."""
    return next(
        (widget, place)
        for widget, place in reversed(placed(window))
        if isinstance(widget, kind) and name in (getattr(widget, "text", ""), getattr(widget, "name", ""))
    )


def push(window: Window, name: str, kind: type[Widget] = Widget) -> None:
    window.panel.scroll(100)
    while not window.layout.panel.contains(find(window, name, kind)[1]):
        window.panel.scroll(-1)
    click(window, find(window, name, kind)[1].center)


def listed(window: Window) -> list[str]:
    """Return the engines on the page, after checking that they run."""
    texts = [widget.text for widget, _ in placed(window) if isinstance(widget, Words) and widget.dots]
    assert texts == window.view.session.names == [pane.name for pane in window.view.panes]
    return texts


def test_panes_are_added_and_removed_by_the_mouse(window: Window) -> None:
    push(window, "exact", TextButton)
    assert listed(window) == ["pymunk", TUNED, "exact"]
    push(window, TUNED, Words)
    push(window, "Remove")
    assert listed(window) == ["pymunk", "exact"]
    push(window, "pymunk(substeps=4)")
    assert listed(window) == ["pymunk", "exact", "pymunk(substeps=4)"]
    assert window.view.moment.step == 20


def test_a_slider_shows_the_value_in_force_and_chooses_when_it_is_let_go(memory_screen: None) -> None:
    scene = scene_of(*THREE_BALLS, more="[pymunk]\ndamping = 0.9")
    window = Window(scene, ["pymunk", "pymunk(iterations=30)"])
    press(window, "e")
    values = {widget.name: widget.value() for widget, _ in placed(window) if isinstance(widget, Slider)}
    assert values["damping"] == 0.9
    assert (values["iterations"], values["substeps"], values["persistence"]) == (10, 1, 3)
    view = window.view
    slider, place = find(window, "substeps")
    mouse(window, pygame.MOUSEBUTTONDOWN, place.center)
    for x in range(place.centerx, place.right, 5):
        mouse(window, pygame.MOUSEMOTION, (x, place.centery))
    assert window.view is view
    mouse(window, pygame.MOUSEBUTTONUP, (place.right, place.centery), held=False)
    assert isinstance(slider, Slider)
    assert listed(window)[0] == f"pymunk(substeps={slider.values[-1]})"
    slider, place = find(window, "substeps")
    click(window, (place.x + 1, place.centery))
    assert listed(window) == ["pymunk", "pymunk(iterations=30)"]


def test_any_engine_can_be_typed(window: Window) -> None:
    push(window, "or type one", Field)
    press(window, *"pymunk(damping=0.5)", "Enter")
    assert listed(window) == ["pymunk", TUNED, "pymunk(damping=0.5)"]
    push(window, "or type one", Field)
    press(window, *"pymnk", "Enter")
    assert "did you mean pymunk?" in window.messages.text
    assert len(listed(window)) == 3


def test_what_cannot_be_done_is_grey_and_says_why(window: Window) -> None:
    def why(name: str) -> str:
        widget, _ = find(window, name, TextButton)
        assert isinstance(widget, TextButton)
        return widget.refusal()

    assert "a second radius" in why("article")
    push(window, "article", TextButton)
    assert listed(window) == ["pymunk", TUNED]
    assert why("Remove") == ""
    push(window, "Remove")
    push(window, TUNED, Words)
    assert "the last engine stays" in why("Remove")
    for _ in range(5):
        window.line_up.add(next(iter(window.line_up.choices)))
    assert why("exact") == FULL


def test_each_pane_has_the_colour_of_its_lines_in_the_charts(window: Window) -> None:
    window.draw()
    names = listed(window)
    lines = {name: tuple(colour)[:3] for name, colour in chart_palette().engines(names).items()}
    assert len(set(lines.values())) == 2
    for pane, name in enumerate(names):
        _, heading = find(window, name, Words)
        for place in (heading, window.layout.title(pane)):
            seen = colours(window.screen.subsurface(place))
            assert lines[name] in seen
            assert lines[names[1 - pane]] not in seen
    drawn = colours(window.screen.subsurface(window.layout.strip))
    assert lines[names[1]] in drawn  # over the line of the first, which has the same energy


def test_a_narrow_pane_cuts_a_long_name_and_keeps_the_energy(window: Window, monkeypatch: pytest.MonkeyPatch) -> None:
    window.screen = pygame.display.set_mode((640, 480))
    title, seen = window.layout.title(1), []
    for share in (1.1, 1.2):  # as wide as each other
        monkeypatch.setattr(SessionView, "energy_errors", dict.fromkeys(window.view.session.names, share))
        window.draw()
        seen.append(pygame.surfarray.array3d(window.screen.subsurface(title)))
    changed = (seen[0] != seen[1]).any(axis=(1, 2))
    assert np.flatnonzero(changed).min() > title.width // 3
