"""One chooses what each chart shows, by mouse and by keys; histograms are drawn where the numbers say."""

import math

import numpy as np
import pygame
import pytest
from conftest import scene_of
from pygame import Color, Rect, Surface
from window_driver import click, hover, mouse, press, run, step

from sandbox.analysis.gas import expected_counts
from sandbox.report.colours import colours_of
from sandbox.scene.files import load
from sandbox.session.session import Session
from sandbox.view.instruments import Instrument
from sandbox.view.palette import palette
from sandbox.view.speed_chart import SpeedChart, histogram_of
from sandbox.view.window import Window

GAS = "count = 200\nradius = 5\ngrid = [20, 10]\nspacing = 30\nrms_speed = 100"
TWO = ("radius = 20\nposition = [200, 300]\nvelocity = [60, 0]", "radius = 20\nposition = [600, 300]")
DEFAULT = (Instrument.ENERGY, Instrument.GAP)


def shown(window: Window) -> tuple[Instrument, ...]:
    return window.view.charts.instruments


def corner(window: Window, chart: int) -> Rect:
    found = window.view.charts.corner(window.layout.strip, window.layout.text_height, chart)
    assert found
    return found


# Choosing


@pytest.mark.usefixtures("memory_screen")
def test_a_click_on_a_chart_s_title_opens_a_list_and_a_click_there_chooses(window: Window) -> None:
    run(window, 30)
    assert shown(window) == DEFAULT
    click(window, corner(window, 1).center)
    assert window.instruments.open_at == 1
    click(window, window.instruments.line(1, Instrument.HEIGHT).center)
    assert shown(window) == (Instrument.ENERGY, Instrument.HEIGHT)
    assert window.instruments.open_at is None
    assert step(window) == 30  # a title is no place in time
    click(window, corner(window, 0).center)
    click(window, (window.layout.strip.centerx, window.layout.strip.centery))
    assert shown(window) == (Instrument.ENERGY, Instrument.HEIGHT)
    assert step(window) == 30  # the click closed the list


@pytest.mark.usefixtures("memory_screen")
def test_keys_choose_too_and_every_instrument_is_reached(window: Window) -> None:
    press(window, "1")
    seen = []
    for _ in Instrument:
        press(window, "Down")
        seen.append(shown(window)[0])
        window.draw()
    assert set(seen) == set(Instrument)
    press(window, "1", "Enter")
    assert shown(window)[0] is Instrument.GAP
    assert window.instruments.open_at is None
    before = list(Instrument).index(shown(window)[1])
    press(window, "2", "Up", "Esc")
    assert shown(window)[1] is list(Instrument)[before - 1]
    assert window.running


@pytest.mark.usefixtures("memory_screen")
def test_an_instrument_that_the_other_chart_shows_changes_places_with_it(window: Window) -> None:
    window.view.charts.choose(0, Instrument.GAP)
    assert shown(window) == (Instrument.GAP, Instrument.ENERGY)


@pytest.mark.usefixtures("memory_screen")
def test_the_choice_survives_another_scene_and_other_engines(window: Window) -> None:
    window.view.charts.choose(1, Instrument.MOMENTUM)
    window.begin(load("bouncing"), None)
    assert shown(window) == (Instrument.ENERGY, Instrument.MOMENTUM)
    window.begin(load("bouncing"), ["exact"])
    assert shown(window) == (Instrument.ENERGY, Instrument.MOMENTUM)


@pytest.mark.usefixtures("memory_screen")
def test_a_key_shows_charts_that_are_hidden(window: Window) -> None:
    press(window, "h", "2")
    assert window.layout.strip.height
    assert window.instruments.open_at == 1


@pytest.mark.usefixtures("memory_screen")
def test_a_list_closes_with_its_charts(window: Window) -> None:
    press(window, "1", "h", "h")
    assert window.instruments.open_at is None


@pytest.mark.usefixtures("memory_screen")
def test_the_mouse_scrubs_charts_over_time_only() -> None:
    window = Window(scene_of(GAS), ["impulse"])
    window.view.charts.show((Instrument.SPEEDS, Instrument.PRESSURE))
    run(window, 30)
    window.draw()
    layout = window.layout
    where = window.view.charts.places(layout.strip, layout.text_height)
    assert where.histogram
    click(window, where.histogram.move(layout.strip.topleft).center)
    assert step(window) == 30
    mouse(window, pygame.MOUSEBUTTONDOWN, where.plots[0].move(layout.strip.topleft).midleft)
    assert step(window) == 0


# What is drawn


def test_a_histogram_counts_all_balls_and_its_law_has_the_reference_s_energy() -> None:
    moment = Session(scene_of(GAS), ["impulse"], reference="exact").shown
    found = histogram_of(moment, "exact")
    assert found.law is not None
    speed = np.hypot(*moment.states["impulse"].velocity.T)
    assert found.counts["impulse"].sum() == 200
    assert found.counts["impulse"][0] == np.count_nonzero(speed < found.edges[1])
    whole = math.sqrt(np.sum(moment.states["exact"].velocity ** 2))
    assert found.edges[-1] == pytest.approx(3 * whole / math.sqrt(200))
    assert found.law == pytest.approx(expected_counts(found.edges, whole, 200))


@pytest.mark.parametrize(
    ("balls", "more", "words"),
    [
        (TWO, "", "2 balls are too few: 50 make a histogram"),
        ((GAS,), "gravity = [0, 100]", "no law: gravity pulls the balls"),
        ((GAS.replace("rms_speed = 100", ""),), "", "nothing moves"),
        ((GAS,), "", ""),
    ],
)
def test_where_a_histogram_means_nothing_it_says_why(balls: tuple[str, ...], more: str, words: str) -> None:
    found = histogram_of(Session(scene_of(*balls, more=more), ["exact"]).shown, "exact")
    assert found.refusal == words
    assert (found.law is None) == bool(words)


def test_bars_are_as_high_as_their_counts() -> None:
    moment = Session(scene_of(GAS), ["exact"]).shown
    found, colours = histogram_of(moment, "exact"), palette("white")
    black = Color(colours_of(["exact"])["exact"])
    surface, plot = Surface((400, 200)), Rect(60, 20, 300, 150)
    SpeedChart("exact", {"exact": black, "theory": colours.law}, colours).draw(
        surface, surface.get_rect(), plot, moment, 12
    )
    bins = len(found.edges) - 1
    for k in range(1, bins // 2):
        x = plot.x + round((k + 0.5) / bins * (plot.width - 1))
        rows = [y for y in range(plot.y, plot.bottom - 1) if surface.get_at((x, y)) == black]
        expected = plot.bottom - 1 - found.counts["exact"][k] / found.top * (plot.height - 1)
        assert min(abs(y - expected) for y in rows) <= 1


@pytest.mark.usefixtures("memory_screen")
def test_the_mouse_shows_what_a_bin_has(monkeypatch: pytest.MonkeyPatch) -> None:
    cards: list[list[list[str]]] = []
    monkeypatch.setattr("sandbox.view.charts.card", lambda surface, rows, *_: cards.append(rows))
    window = Window(scene_of(GAS), ["exact"])
    window.view.charts.show((Instrument.PRESSURE, Instrument.SPEEDS))
    window.draw()
    layout = window.layout
    plot = window.view.charts.places(layout.strip, layout.text_height).histogram
    assert plot
    hover(window, plot.move(layout.strip.topleft).midleft)
    window.draw()
    found = histogram_of(window.view.moment, "exact")
    assert found.law is not None
    assert cards[-1] == [
        ["balls", f"0 to {found.edges[1]:.4g} px/s"],
        ["exact", f"{found.counts['exact'][0]:.0f}"],
        ["theory", f"{found.law[0]:.1f}"],
    ]


@pytest.mark.parametrize(
    ("engines", "instrument", "words"),
    [
        (["exact"], Instrument.GAP, "one engine alone: nothing to be apart from"),
        (["impulse"], Instrument.PRESSURE, "no theory: fewer than 100 balls"),
        (["impulse"], Instrument.HEIGHT, ""),
    ],
)
@pytest.mark.usefixtures("memory_screen")
def test_a_chart_that_means_nothing_says_why(engines: list[str], instrument: Instrument, words: str) -> None:
    window = Window(scene_of(*TWO), engines)
    window.view.charts.show((instrument, Instrument.MOMENTUM))
    window.draw()
    assert window.view.charts._remarks == [words, ""]
