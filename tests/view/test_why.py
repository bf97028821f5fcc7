"""The page that says why engines differ: its words, its contacts, and its keys."""

import math
import time

import numpy as np
import pygame
import pytest
from conftest import ball_at, scene_of
from pygame import Color, Rect, Surface
from window_driver import WorkerHere, click, colours, press, run, step

from sandbox.errors import SandboxError
from sandbox.run.edits import SetVelocity
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.session.session import Session
from sandbox.state import State
from sandbox.view.case_so_far import DIED, Case, CaseWorker, case_of
from sandbox.view.contact_mark import NORMAL, ContactPicture
from sandbox.view.run_so_far import ComparisonSoFar, RunSoFar
from sandbox.view.theme import palette
from sandbox.view.widgets import Bar, Widget, Words
from sandbox.view.window import Window

pytestmark = pytest.mark.usefixtures("memory_screen")


@pytest.fixture(autouse=True)
def _here(memory_screen: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sandbox.view.case_so_far.CaseWorker", WorkerHere)
    monkeypatch.setattr("sandbox.view.case_so_far.monotonic", lambda: 0.0)  # it never rests


def window_of(scene: Scene, engines: list[str], steps: int) -> Window:
    """Return a window with the page open, after some steps that are compared."""
    window = Window(scene, engines)
    window.playback.paused = True
    run(window, steps)
    press(window, "F5")
    for _ in range(6):
        window.frame(1 / 60)
    return window


@pytest.fixture
def article() -> Window:
    """The article's scene after a second: Pymunk has found one contact late."""
    return window_of(load("article"), ["pymunk", "article"], 60)


def widgets(window: Window) -> list[Widget]:
    return [widget for widget, _ in window.panel.placed(window.layout.panel, window.layout.text_height)]


def words(window: Window) -> list[str]:
    return [widget.text for widget in widgets(window) if isinstance(widget, Words)]


def place_of(window: Window, text: str) -> tuple[int, int]:
    """Return the middle of what has a text, or begins with it, in the panel."""
    for widget, place in window.panel.placed(window.layout.panel, window.layout.text_height):
        if getattr(widget, "text", "").startswith(text):
            return place.center
    raise AssertionError(text)


def expected(window: Window) -> Case:
    """Return what is to be said of the run that the window has done."""
    return case_of_run(RunSoFar.of(window.view.session))


def case_of_run(run: RunSoFar) -> Case:
    so_far = ComparisonSoFar()
    return case_of(run, so_far.of(run), so_far.marks)


def compared(window: Window) -> str:
    """Return up to when the page says that the run is compared; nothing if it does not say it."""
    return next((text for text in words(window) if text.startswith("Compared with exact")), "")


def test_the_page_says_what_compare_says_of_the_run_so_far(article: Window) -> None:
    case = expected(article)
    assert article.why.engine == "article"  # whose energy is most wrong
    assert "1.00 s" in compared(article)
    for engine in ("pymunk", "article"):
        click(article, place_of(article, engine))
        one = case.engines[engine]
        assert {*one.lines, *case.besides} <= {*words(article)}
        differ = f"{len(one.contacts)} contact{'s differ' if len(one.contacts) > 1 else ' differs'} from exact"
        assert differ in words(article)
        bars = [widget for widget in widgets(article) if isinstance(widget, Bar)]
        assert [(bar.name, bar.value) for bar in bars] == [(line.cause, line.text) for line in one.ledger]
    assert bars[0].share == -1.0


def test_a_long_run_is_compared_in_parts_each_twice_as_long() -> None:
    window = Window(load("bouncing"), ["pymunk"])
    press(window, "F5", "Right")
    for _ in range(2):
        window.frame(1 / 60)
    assert compared(window)  # all of the first step; of a run that has gone on, that is too little to say
    run(window, 299)
    seen = list[str]()
    for _ in range(9):
        window.frame(1 / 60)
        seen += [text for text in (compared(window),) if text and text not in seen]
    parts = ["1.00 s so far.", "2.00 s so far.", "4.00 s so far.", "5.00 s."]
    assert [text.removeprefix("Compared with exact up to ") for text in seen] == parts
    assert window.why.case.case == expected(window)


def test_the_headline_says_what_the_title_says_at_any_step(article: Window) -> None:
    for at in (60, 50, 40):
        article.playback.seek(at)
        [pane] = [pane for pane in article.view.panes if pane.name == article.why.engine]
        article.draw()
        assert f"{pane.name}: {pane.energy_text}" in words(article)


def test_the_page_follows_the_run_and_forgets_what_an_edit_undoes(article: Window) -> None:
    run(article, 30)
    article.frame(1 / 60)
    article.frame(1 / 60)
    assert "1.50 s" in compared(article)
    article.playback.seek(20)
    article.frame(1 / 60)
    assert "1.50 s" in compared(article)  # what has been reached still is there
    press(article, ">")
    sentence = article.why.contact.sentence if article.why.contact else ""
    assert sentence in words(article)
    article.playback.seek(20)
    article.playback.give(SetVelocity(step=20, ball=1, velocity=(0.0, 0.0)))
    article.frame(1 / 60)
    assert sentence not in words(article)
    run(article, 40)
    article.frame(1 / 60)
    article.frame(1 / 60)
    assert compared(article) == "Compared with exact up to 1.00 s. Times count from the last edit, at 0.33 s."


def first_contact(window: Window) -> list[np.ndarray]:
    """Return the normals as Pymunk finds the first contact, and when its balls touched.

    Balls fly straight until they touch.
    """
    before, after = window.view.session.moments(47, 47)[0].states, window.view.session.moments(50, 50)[0].states
    found = after["pymunk"].position[2] - after["pymunk"].position[1]
    return [found / math.hypot(*found), touching(before["pymunk"])]


def touching(state: State) -> np.ndarray:
    """Return the normal when balls 1 and 2 will touch, of radius 20."""
    offset, speed = (values[2] - values[1] for values in (state.position, state.velocity))
    a, b, c = speed @ speed, offset @ speed, offset @ offset - 40**2
    line = offset + speed * (-b - math.sqrt(b * b - a * c)) / a
    return np.asarray(line / math.hypot(*line))


def share_along(picture: Surface, normal: np.ndarray, colour: Color) -> float:
    """Return the share of a line through the middle of a picture that has a colour."""
    found, middle = [], np.divide(picture.get_size(), 2)
    for along in np.linspace(-1, 1, 61) * NORMAL * 14:
        x, y = np.rint(middle + along * normal).astype(int).tolist()
        found.append(tuple(colour)[:3] in colours(picture.subsurface(Rect(x - 1, y - 1, 3, 3))))
    return sum(found) / len(found)


@pytest.mark.parametrize("background", ["white", "#101418"])
def test_the_articles_first_contact_is_drawn_with_the_normal_found_and_the_right_one(background: str) -> None:
    scene = load("article")
    scene = scene.changed(arena=scene.arena.model_copy(update={"background": background}))
    window = window_of(scene, ["pymunk", "impulse"], 60)
    window.screen = pygame.display.set_mode((1900, 1000))
    window.why.show(next(contact for contact in expected(window).engines["pymunk"].contacts if contact.step == 50))
    window.frame(1 / 60)
    found, touch = first_contact(window)
    assert math.degrees(math.acos(found @ touch)) == pytest.approx(7.8, abs=0.05)
    of_background, other_side = palette(background), touch - 2 * (touch - (touch @ found) * found)
    blue = of_background.engines(["pymunk"])["pymunk"]
    place = next(place for widget, place in window._placed if isinstance(widget, ContactPicture))
    picture = window.screen.subsurface(place)  # in whose middle the two equal balls touch
    assert share_along(picture, found, blue) > 0.7
    assert 0.3 < share_along(picture, touch, blue) < 0.9
    assert share_along(picture, touch, of_background.ink) > 0.2  # under the dashes
    assert share_along(picture, other_side, of_background.ink) < 0.3
    assert any(text.startswith("0.833 s, balls 1 and 2: Found") for text in words(window))
    radius = 20 * window.layout.scale + 4
    for pane, of_pane in enumerate(window.view.panes):  # has a ring round each of them
        for ball in (1, 2):
            x, y = window.layout.to_screen(pane, of_pane.state.position[ball].tolist())
            above = window.screen.subsurface(Rect(round(x) - 1, round(y - radius) - 3, 3, 6))
            assert tuple(of_background.ink)[:3] in colours(above)


def test_what_is_drawn_goes_with_the_step_and_with_the_page(article: Window) -> None:
    press(article, "<")
    assert article.why.contact is not None
    article.playback.step()
    assert article.why.contact is None
    article.playback.step_back()
    assert article.why.contact is not None
    press(article, "F5")
    article.frame(1 / 60)
    assert article.layout.panel.width == 0


def test_keys_go_to_contacts_and_pause() -> None:
    window = window_of(load("newtons-cradle"), ["pymunk", "article"], 60)
    window.why.choose("pymunk")
    contacts = expected(window).engines["pymunk"].contacts
    assert [contact.step for contact in contacts] == sorted(contact.step for contact in contacts)
    window.playback.seek(0)
    window.playback.paused = False
    press(window, ">")
    assert window.playback.paused
    visited = [step(window)]
    for _ in contacts[1:]:
        press(window, ">")
        visited.append(step(window))
    assert visited == [contact.step for contact in contacts]
    press(window, ">")
    assert step(window) == visited[-1]
    assert "no later contact differs, as far as it is compared" in window.messages.text
    press(window, "<")
    assert step(window) == visited[-2]
    assert f"Contact {len(contacts) - 1} of {len(contacts)} unlike exact's" in words(window)


def test_the_next_contact_is_never_an_earlier_one(article: Window) -> None:
    article.why.choose("pymunk")
    here, last = step(article), expected(article).engines["pymunk"].contacts[-1]
    assert here > last.step
    press(article, ">")
    assert step(article) == here
    assert "no later contact differs" in article.messages.text
    press(article, "<")
    assert article.why.contact == last
    article.playback.seek(0)
    press(article, "<")
    assert step(article) == 0


def test_an_engine_that_agrees_has_a_sentence_instead_of_contacts() -> None:
    """Two equal balls meet in line at the end of a step, 1e-7 px deep: where impulse finds them."""
    scene = scene_of(ball_at(200, 300, vx=120, radius=10), ball_at(319.9999999, 300, radius=10))
    window = window_of(scene, ["impulse"], 60)
    one = expected(window).engines["impulse"]
    assert window.view.moment.engines["impulse"].state.velocity[:, 0].tolist() == [0, 120]  # they have met
    assert (one.contacts, one.ledger) == ((), ())
    assert one.lines[-1] == "Within a ball's radius of exact to the end."
    assert one.lines[-1] in words(window)
    press(window, ">", "<")
    assert step(window) == 60


def test_the_reference_alone_is_measured_against_nothing() -> None:
    window = window_of(load("article"), ["exact"], 30)
    window.draw()
    assert "exact: Only exact took part, so nothing is measured against it." in words(window)


def test_before_the_first_step_there_is_nothing_to_say(window: Window) -> None:
    press(window, "F5")
    window.playback.paused = True
    window.frame(0.0)
    window.playback.seek(0)
    window.frame(0.0)
    assert words(window) == ["Nothing has happened yet."]


def test_the_page_never_speaks_of_engines_that_were_replaced(article: Window) -> None:
    """In the frame in which they are, before the next comparison."""
    article.why.choose("article")
    assert any(text.startswith("What article lost") for text in words(article))
    place = place_of(article, expected(article).engines["article"].lines[0])
    article.line_up.remove(1)
    click(article, place)
    assert "article" not in " ".join(words(article))
    article.draw()


def answer_of(worker: CaseWorker) -> Case | SandboxError:
    """Wait for what a worker finds."""
    while (answer := worker.poll()) is None:
        time.sleep(0.02)
    return answer


@pytest.mark.wide
def test_a_process_finds_the_same_and_a_new_one_follows_when_it_dies() -> None:
    session = Session(load("article"), ["pymunk"], reference="exact")
    for _ in range(60):
        session.advance()
    so_far = RunSoFar.of(session)
    expected = case_of_run(so_far)
    worker = CaseWorker()
    try:
        assert worker.poll() is None
        worker.ask(so_far)
        assert answer_of(worker) == expected
        assert worker._process is not None
        worker._process._process.kill()
        worker._process._process.join()
        worker.ask(so_far)
        assert str(answer_of(worker)) == DIED
        worker.ask(RunSoFar(so_far.scene, ("pymunk", "none"), "none", (), 60))
        assert "none" in str(answer_of(worker))
    finally:
        worker.stop()


def test_a_contact_with_a_ball_at_rest_is_drawn() -> None:
    window = window_of(load("break-shot"), ["pymunk", "impulse"], 40)
    window.why.show(expected(window).engines["pymunk"].contacts[0])
    assert window.why.contact
    found = window.why.contact.difference
    assert any((0.0, 0.0) in (velocities or ()) for velocities in (found.before, found.should_after))
    window.draw()
