"""The page of recorded Spaces in a real browser: what it draws, and where findings lead."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pymunk
import pytest
from browser import Browser

from sandbox.report.space import PlayedSpace, page
from sandbox.space.findings import BodyReport, Certainty, Finding
from sandbox.space.finer import finer
from sandbox.space.recording import Recording

SYMPTOM = "Boxes <b>fall</b>"
PIXEL = """((x, y) => {{
  const canvas = document.querySelector("canvas");
  const [left, bottom, width] = JSON.parse(document.getElementById("data").textContent)[0].view;
  const scale = canvas.width / width;
  const copy = new OffscreenCanvas(1, 1).getContext("2d");
  copy.drawImage(canvas, -Math.floor((x - left) * scale), -Math.floor((y - bottom) * scale));
  return [...copy.getImageData(0, 0, 1, 1).data].slice(0, 3);
}})({x}, {y})"""
TIME = "document.querySelector('.time').value"


def recorded() -> Recording:
    """Return a box that slides, a ball on a rod, a lift, and a ball that comes later."""
    space = pymunk.Space()
    space.gravity = 0, 900
    floor = pymunk.Segment(space.static_body, (-100, 100), (500, 100), 5)
    box = pymunk.Body(1, 270)
    box.position, box.velocity = (0, 75), (200, 0)
    square = pymunk.Poly.create_box(box, (40, 40))
    floor.friction = square.friction = 0.7
    ball = pymunk.Body(1, 200)
    ball.position = 200, -50
    disc = pymunk.Circle(ball, 20)
    disc.color = (231, 76, 60, 255)
    lift = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
    lift.position, lift.velocity = (400, 50), (0, -30)
    space.add(floor, box, square, ball, disc, lift, pymunk.Poly.create_box(lift, (60, 20)))
    space.add(pymunk.PinJoint(space.static_body, ball, (150, -100), (0, 0)))
    recording = Recording(space)
    for step in range(60):
        if step == 30:
            late = pymunk.Body(1, 200)
            late.position = 300, -80
            space.add(late, pymunk.Circle(late, 20))
        recording.record(space.step, 1 / 60)
    return recording


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    recording = recorded()
    body = BodyReport(0, "a dynamic polygon", (0.0, 75.0), "", "slides")
    finding = Finding("slides", SYMPTOM, 0.5, (body,), "It was pushed.", "Stop it.", Certainty.LIKELY, 0.5)
    result = finer(recording)
    played = PlayedSpace("Space 1", [finding], None, ["Off by 3 px."], recording, result, "pymunk in 8 substeps")
    unrecorded = PlayedSpace("Space 2", [], None, [], None, None, "")
    file = tmp_path_factory.mktemp("page") / "page.html"
    file.write_text(page("game.py", [played, unrecorded]), encoding="utf-8")
    return file


@pytest.fixture
def opened(browser: Browser, written: Path) -> Iterator[Browser]:
    browser.visit(written)
    yield browser
    assert browser.errors == []
    assert browser.requests == [written.as_uri()]


def test_shapes_are_drawn_where_they_are_in_pymunk_s_colours(opened: Browser) -> None:
    opened.run("document.querySelector('.outlines').click()")
    assert opened.run(PIXEL.format(x=10, y=65)) == [52, 152, 219]  # the box
    assert opened.run(PIXEL.format(x=200, y=-62)) == [231, 76, 60]  # the ball, of a colour of its own
    assert opened.run(PIXEL.format(x=410, y=48)) == [39, 174, 96]  # the lift
    assert opened.run(PIXEL.format(x=300, y=100)) == [149, 165, 166]  # the floor
    assert opened.run(PIXEL.format(x=300, y=-80)) == [255, 255, 255]  # nothing yet
    opened.press("End")
    assert opened.run(PIXEL.format(x=410, y=20)) == [39, 174, 96]
    assert opened.run(PIXEL.format(x=10, y=65)) == [255, 255, 255]


def test_a_finding_leads_to_its_time_and_marks_its_body(opened: Browser) -> None:
    opened.run("document.querySelector('li [data-time]').click()")
    assert opened.run(TIME) == "0.500 s"
    assert opened.run(PIXEL.format(x=0, y=75 - 14 * scale_of(opened))) == [230, 159, 0]
    assert opened.run("document.querySelector('.marks i').style.left") == "50%"
    assert opened.run("document.querySelector('li strong').textContent") == SYMPTOM


def scale_of(browser: Browser) -> float:
    """Return the px of the Space in one of the screen."""
    return float(browser.run("JSON.parse(document.getElementById('data').textContent)[0].view[2]")) / float(
        browser.run("document.querySelector('canvas').width")
    )


def test_it_plays_to_the_end_by_a_key(opened: Browser) -> None:
    opened.press(" ")
    opened.wait_for(f"{TIME} === '1.000 s'")
    assert opened.run("document.querySelector('.play').textContent") == "Play"


def test_the_finer_run_is_drawn_as_outlines(opened: Browser) -> None:
    opened.press("End")
    picture = "document.querySelector('canvas').toDataURL()"
    drawn = opened.run(picture)
    opened.run("document.querySelector('.outlines').click()")
    assert opened.run(picture) != drawn


def test_nothing_is_wider_than_a_telephone(browser: Browser, written: Path) -> None:
    browser.visit(written, 400, 900)
    assert browser.run("document.documentElement.scrollWidth") == 400


def test_frames_are_left_out_where_the_page_would_be_too_large(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sandbox.report.space.MAX_NUMBERS", 4 * 3 * 20)
    played = PlayedSpace("Space 1", [], None, [], recorded(), None, "")
    data: list[Any] = json.loads(re.findall(r'id="data">(.*?)</script>', page("game.py", [played]))[0])
    assert len(data[0]["times"]) == 20
    assert data[0]["shapes"][-1]["from"] == 10
