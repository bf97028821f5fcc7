"""The charts without an axis of time: one quantity over another, and the balls' momenta and energies."""

import numpy as np
import pytest
from conftest import scene_of
from pygame import Color, Rect, Surface
from window_driver import click, hover, press, run, step

from sandbox.session.history import Moment
from sandbox.state import State, no_contacts
from sandbox.view.instruments import Instrument
from sandbox.view.theme import chart_palette
from sandbox.view.untimed_charts import BallChart
from sandbox.view.window import Window

PLACE = Rect(0, 0, 600, 300)
TEXT = 14
RIGHT = (100.0, 0.0)
UP_TWICE = (0.0, -100.0)


def moment_of(velocity: tuple[tuple[float, float], ...], engines: tuple[str, ...] = ("exact",)) -> Moment:
    """A ball of 1 kg, red, and one of 2 kg, blue, in each engine."""
    scene = scene_of(
        'radius = 20\nposition = [100, 100]\ncolors = ["#c00000"]',
        'radius = 20\nmass = 2\nposition = [300, 100]\ncolors = ["#0000c0"]',
    )
    state = State(0.0, np.array([[100.0, 100.0], [300.0, 100.0]]), np.array(velocity))
    none, no = dict.fromkeys(engines, no_contacts()), dict.fromkeys(engines, 0.0)
    count = dict.fromkeys(engines, 0)
    return Moment(0, 0.0, scene, dict.fromkeys(engines, state), none, count, no, no, (0, 1), None, (0, 0), no, 1.0)


def drawn(chart: BallChart, moment: Moment) -> Surface:
    surface = Surface(PLACE.size)
    chart.draw(surface, PLACE, moment, TEXT)
    return surface


def extent(surface: Surface, part: Rect, colour: str) -> Rect:
    """Return the smallest rectangle with all pixels of a colour in a part of a surface."""
    points = [
        (x, y)
        for x in range(part.x, part.right)
        for y in range(part.y, part.bottom)
        if surface.get_at((x, y)) == Color(colour)
    ]
    return Rect(0, 0, 0, 0) if not points else Rect(points[0], (1, 1)).unionall([Rect(p, (1, 1)) for p in points])


LEFT, RIGHT_HALF = Rect(0, 22, 295, 257), Rect(305, 22, 295, 257)


def test_momenta_stand_head_to_tail_in_proportion() -> None:
    surface = drawn(BallChart({"exact": Color("black")}, chart_palette()), moment_of((RIGHT, UP_TWICE)))
    red, blue = extent(surface, LEFT, "#c00000"), extent(surface, LEFT, "#0000c0")
    assert blue.height / red.width == pytest.approx(2, rel=0.06)  # 200 kg px/s and 100
    assert blue.centerx == pytest.approx(red.right, abs=4)  # it begins where the other ends
    assert blue.bottom == pytest.approx(red.centery, abs=4)


def test_energies_are_bars_and_stand_on_one_another_in_the_last() -> None:
    surface = drawn(BallChart({"exact": Color("black")}, chart_palette()), moment_of((RIGHT, UP_TWICE)))
    last = Rect(520, 22, 80, 257)
    each = Rect(305, 22, 215, 257)
    red, blue = extent(surface, each, "#c00000"), extent(surface, each, "#0000c0")
    assert blue.height / red.height == pytest.approx(2, rel=0.05)  # 10,000 and 5,000 kg px²/s²
    assert red.bottom == blue.bottom
    red_above, blue_above = extent(surface, last, "#c00000"), extent(surface, last, "#0000c0")
    assert (red_above.height, blue_above.height) == pytest.approx((red.height, blue.height), abs=1)
    assert blue_above.bottom == red_above.y


def test_the_scales_stay_when_energy_is_lost() -> None:
    chart = BallChart({"exact": Color("black")}, chart_palette())
    before = extent(drawn(chart, moment_of((RIGHT, UP_TWICE))), RIGHT_HALF, "#c00000").height
    after = extent(drawn(chart, moment_of(((50.0, 0.0), (0.0, 0.0)))), RIGHT_HALF, "#c00000").height
    assert before / after == pytest.approx(4, rel=0.1)


def test_too_many_balls_are_refused_in_words() -> None:
    chart = BallChart({"exact": Color("black")}, chart_palette())
    many = moment_of((RIGHT, UP_TWICE))
    assert chart.rows_at(PLACE, (300, 100), many)[1:] == [
        ["ball 0", "100, 0", "5,000"],
        ["ball 1", "0, -200", "10,000"],
        ["all", "100, -200", "15,000"],
    ]
    balls = scene_of("radius = 1\nposition = [9, 9]\ngrid = [8, 4]\nspacing = 9")
    drawn(chart, Moment(0, 0.0, balls, many.states, {}, {}, {}, {}, tuple(range(32)), None, (0, 0), {}, 1.0))
    assert chart.rows_at(PLACE, (300, 100), many) == [["32 balls are too many: at most 30 are drawn"]]


@pytest.mark.usefixtures("memory_screen")
def test_a_ball_s_velocity_over_its_position_is_drawn_where_they_are(window: Window) -> None:
    press(window, "p")
    run(window, 40)
    window.editor.select(2)  # at 600, 100 with 60, -30 px/s
    charts, strip = window.view.charts, window.layout.strip
    charts.show(Instrument.BALL_VY)
    charts.show_across(Instrument.BALL_X)
    window.draw()
    plot = charts.plot(strip, window.layout.text_height).move(strip.topleft)
    x, y = 600 + 60 * 20 / 60, -30.0
    (left, right), (low, high) = (0.0, 800.0), (-30.0, 0.0)
    at = (
        plot.x + (x - left) / (right - left) * (plot.width - 1),
        plot.bottom - 1 - (y - low) / (high - low) * (plot.height - 1),
    )
    around = Rect(round(at[0]) - 3, round(at[1]) - 3, 6, 6)
    seen = {tuple(window.screen.get_at((i, j)))[:3] for i in range(*_span(around, 0)) for j in range(*_span(around, 1))}
    assert seen & {tuple(colour)[:3] for colour in charts._colours.values()}
    hover(window, plot.center)
    assert charts._plane
    rows = charts._plane.rows_at(window.view.session.samples, 20 / 60)
    assert rows[1:] == [[name, "620.0000 px", "-30.0000 px/s"] for name in ("pymunk", "impulse", "exact")]


def _span(rect: Rect, axis: int) -> tuple[int, int]:
    return rect[axis], rect[axis] + rect[axis + 2]


@pytest.mark.usefixtures("memory_screen")
def test_a_click_in_a_chart_without_time_does_not_go_to_one(window: Window) -> None:
    press(window, "p")
    run(window, 10)
    window.view.charts.show_across(Instrument.GAP)
    strip = window.layout.strip
    click(window, (strip.x + 9, strip.centery))
    assert step(window) == 10
    window.view.charts.show_across(None)
    click(window, (strip.x + 9, strip.centery))
    assert step(window) == 0


@pytest.mark.usefixtures("memory_screen")
def test_over_what_a_chart_is_drawn_is_chosen_in_a_menu_and_kept_in_the_next_scene(window: Window) -> None:
    press(window, "p")
    items = {item.text: item for item in window.timeline._choices_across()}
    assert items["time"].is_on()
    items["momentum"].do()
    assert window.view.charts.across is Instrument.MOMENTUM
    window.begin(window.scene, None)
    assert window.view.charts.across is Instrument.MOMENTUM
    shown = {widget for widget, _ in window._placed}
    assert window.timeline._across in shown
    window.view.charts.show(Instrument.MOMENTA)
    assert window.timeline._across not in {widget for widget, _ in window._placed}


@pytest.mark.usefixtures("memory_screen")
def test_another_selected_ball_is_sampled_as_far_back_as_the_history_goes(window: Window) -> None:
    press(window, "p")
    run(window, 5)
    charts = window.view.charts
    charts.show(Instrument.BALL_X)
    samples = window.view.session.samples
    for ball, start, speed in ((0, 200.0, 240.0), (2, 600.0, 60.0)):
        window.editor.select(ball)
        window.draw()
        assert charts._chart
        values = charts._chart.values(samples, 0)[:, samples.engines.index("exact")]
        assert values == pytest.approx(start + speed * np.arange(6) / 60)
