"""Charts draw lines, names, marks and the cursor where the numbers say."""

import math
from collections.abc import Callable

import numpy as np
import pygame
import pytest
from conftest import scene_of
from moments import moment, sample
from pygame import Color, Rect, Surface
from window_driver import click, hover, press, run, step

from sandbox.analysis.reference import Trust
from sandbox.quantity import length
from sandbox.report.scales import BothSigns, Logarithmic, Scale, Span
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.session.samples import Samples
from sandbox.session.session import Session
from sandbox.view.charts import Charts, spread
from sandbox.view.instruments import ENERGY, ERROR, GAP, LAW, MOMENTUM, SPEEDS, Even, Instrument, histogram_of
from sandbox.view.run_so_far import Marks
from sandbox.view.theme import LIGHT, chart_palette
from sandbox.view.window import Window

PLACE = Rect(0, 0, 900, 300)
TEXT = 16
NAMES = ["pymunk", "article", "exact"]
PYMUNK, ARTICLE, EXACT = chart_palette().engines(NAMES).values()
TWO = ("radius = 20\nposition = [200, 300]\nvelocity = [60, 0]", "radius = 20\nposition = [600, 300]")


@pytest.fixture
def scene() -> Scene:
    return scene_of(*TWO, more="seconds = 10")


def charts_of(
    scene: Scene, seconds: float, course: Callable[[float], dict[str, float]], instrument: Instrument = MOMENTUM
) -> Charts:
    """Sample a course."""
    samples = Samples(NAMES, "exact")
    for number in range(round(seconds * 60) + 1):
        sample(samples, scene, number, **course(number / 60))
    charts = Charts(samples, 10.0)
    charts.show(instrument)
    return charts


def steady(time: float) -> dict[str, float]:
    return {"pymunk": 60.0, "article": 60.0, "exact": 60.0}


def draw(charts: Charts, time: float = 0.0, point: tuple[int, int] | None = None) -> Surface:
    surface = Surface(PLACE.size)
    charts.draw(surface, PLACE, TEXT, time, point)
    return surface


def rows_of(surface: Surface, plot: Rect, x: int, colour: Color) -> list[int]:
    return [y for y in range(plot.top, plot.bottom) if surface.get_at((x, y)) == colour]


def columns_of(surface: Surface, plot: Rect, colour: Color) -> list[int]:
    return [x for x in range(plot.x, plot.right) if rows_of(surface, plot, x, colour)]


def column(charts: Charts, time: float, start: float = 0.0, seconds: float = 10.0) -> int:
    plot = charts.plot(PLACE, TEXT)
    return round(plot.x + (time - start) / seconds * (plot.width - 1))


def row(plot: Rect, span: Span, position: float) -> float:
    return plot.bottom - 1 - (position - span[0]) / (span[1] - span[0]) * (plot.height - 1)


# Scales


def test_a_loss_of_a_ten_thousandth_is_seen_as_well_as_one_of_a_half() -> None:
    scale = BothSigns()
    span = scale.span(-50.0, 0.0)
    assert span == pytest.approx((-math.log10(1 + 100 / 1e-3), math.log10(1 + 0.01 / 1e-3)))
    none, small, half = (float(scale.position(np.array(value))) for value in (0.0, -0.01, -50.0))
    reach = span[1] - span[0]
    assert (none - small) / reach > 1 / 8
    assert (small - half) / reach > 1 / 2
    assert [text for _, text in scale.ticks(span)][:4] == ["0", "-100", "-10", "-1"]


@pytest.mark.parametrize(
    ("scale", "low", "high", "ends"),
    [
        (Logarithmic(), 1e-14, 0.2, (-3, 0)),
        (Logarithmic(), 1e-14, 230.0, (-3, 3)),
        (Logarithmic(), math.inf, -math.inf, (-3, 0)),
        (BothSigns(), math.inf, -math.inf, (-math.log10(11), math.log10(11))),
        (BothSigns(), -1e-9, 7.0, (-math.log10(11), math.log10(10001))),
    ],
)
def test_axes_reach_to_round_numbers(scale: Scale, low: float, high: float, ends: Span) -> None:
    assert scale.span(low, high) == pytest.approx(ends)


def test_labels_are_near_where_they_belong_and_not_over_each_other() -> None:
    assert spread([10, 50], [5, 5], 0, 100) == [10, 50]
    assert spread([50, 50, 10], [5, 8, 5], 0, 100) == [50, 55, 10]
    assert spread([97, 97], [5, 5], 0, 100) == [90, 95]


# Lines


def test_lines_are_drawn_at_the_height_of_their_values(scene: Scene) -> None:
    def course(time: float) -> dict[str, float]:
        return steady(time) | ({"article": 30.0} if time >= 5 else {})

    def drawn(instrument: Instrument) -> tuple[Surface, Rect, int]:
        charts = charts_of(scene, 8, course, instrument)
        return draw(charts, time=9.9), charts.plot(PLACE, TEXT), column(charts, 7)

    surface, plot, x = drawn(ENERGY)  # half of the speed is a quarter of the energy
    assert np.mean(rows_of(surface, plot, x, ARTICLE)) == pytest.approx(row(plot, (0, 2000), 450), abs=1)
    assert np.mean(rows_of(surface, plot, x, PYMUNK)) == pytest.approx(row(plot, (0, 2000), 1800), abs=2)
    surface, plot, x = drawn(ERROR)
    assert np.mean(rows_of(surface, plot, x, ARTICLE)) == pytest.approx(row(plot, (-80, 0), -75), abs=1)
    surface, plot, x = drawn(GAP)
    assert np.mean(rows_of(surface, plot, x, ARTICLE)) == pytest.approx(row(plot, (-3, 2), math.log10(30)), abs=1)
    assert not rows_of(surface, plot, x, EXACT)  # the reference's own
    surface, plot, x = drawn(MOMENTUM)
    assert np.mean(rows_of(surface, plot, x, ARTICLE)) == pytest.approx(row(plot, (0, 60), 30), abs=1)


def test_the_last_step_is_in_the_line_and_in_the_values(scene: Scene) -> None:
    charts = charts_of(scene, 5 / 60, steady)
    charts._seconds = 0.2
    surface, plot = draw(charts, time=0.19), charts.plot(PLACE, TEXT)
    assert max(columns_of(surface, plot, ARTICLE)) >= column(charts, 5 / 60, seconds=0.2)
    assert charts.values_at(0.2)[0][0] == "0.083 s"


def test_a_line_has_a_gap_where_the_engine_does_not_run_and_does_not_wait_for_the_reference(scene: Scene) -> None:
    charts = charts_of(scene, 2, steady)
    for number in range(121, 480):
        names = NAMES if number > 300 else NAMES[:1] + NAMES[2:]
        sample(charts.samples, scene, number, **dict.fromkeys(names, 50.0))
    for number in range(480, 540):
        charts.samples.add(moment(scene, number, pymunk=50.0, article=40.0))
    surface, plot = draw(charts), charts.plot(PLACE, TEXT)
    seen = {time: bool(rows_of(surface, plot, column(charts, time), ARTICLE)) for time in (1.0, 3.0, 4.5, 7.0, 8.8)}
    assert seen == {1.0: True, 3.0: False, 4.5: False, 7.0: True, 8.8: True}
    values = dict(charts.values_at(8.8)[1:])
    assert values == {"pymunk": "50 kg px/s", "article": "40 kg px/s", "exact": "not known"}


@pytest.mark.parametrize(
    ("low", "high", "span", "texts"),
    [
        (0.0, 100.0, (0, 100), ["100", "0", "80", "60", "40", "20"]),
        (42.0, 100.4, (0, 100), ["100", "0", "80", "60", "40", "20"]),
        (-60.0, 100.0, (-50, 100), None),
        (0.0, 0.0, (0, 1), None),
        (0.0, 1.5e6, (0, 1.5e6), ["1.5e6", "0", "1e6", "0.5e6"]),
        (math.inf, -math.inf, (0, 1), None),
    ],
)
def test_a_linear_axis_has_ticks_at_round_numbers(low: float, high: float, span: Span, texts: list[str] | None) -> None:
    axis = Even()
    found = axis.span(low, high)
    assert found[0] <= span[0] and found[1] >= span[1] - 1e-9  # noqa: PT018
    assert found[1] - found[0] <= 1.4 * (span[1] - span[0])
    steps = np.diff(sorted(at for at, _ in axis.ticks(found)))
    assert steps == pytest.approx(steps[0])
    if texts:
        assert [text for _, text in axis.ticks(found)] == texts


def test_rounding_is_written_as_0(scene: Scene) -> None:
    charts = charts_of(scene, 1, lambda time: steady(time) | {"article": 60.0 + 3e-14}, GAP)
    values = dict(charts.values_at(5.0)[1:])
    assert values == {"pymunk": "0 px", "article": "0 px"}


def test_the_axis_of_time_doubles_when_it_is_full(scene: Scene) -> None:
    charts = charts_of(scene, 11, lambda time: steady(time) | {"article": 50.0})
    surface = draw(charts, time=11)
    momentum = charts.plot(PLACE, TEXT)
    assert rows_of(surface, momentum, column(charts, 10.9, seconds=20), ARTICLE)
    assert column(charts, 10.9, seconds=20) < max(columns_of(surface, momentum, ARTICLE))


# Time


def test_the_cursor_is_drawn_at_the_time(scene: Scene) -> None:
    charts = charts_of(scene, 2, steady)
    surface = draw(charts, time=4)
    plot = charts.plot(PLACE, TEXT)
    assert len(rows_of(surface, plot, column(charts, 4), LIGHT.dim)) > plot.height - 3
    assert len(rows_of(surface, plot, column(charts, 5), LIGHT.dim)) == 0


# Marks and values


def test_marks_are_labelled_above_the_charts_and_never_over_a_line(scene: Scene) -> None:
    charts = charts_of(scene, 2, steady)
    before = pygame.surfarray.array3d(draw(charts))
    charts.marks = Marks(
        Trust(horizon=8.0, undecided=6.0), differences={"article": 7.0, "pymunk": 7.01}, stopped=(8.0, "why")
    )
    after = pygame.surfarray.array3d(draw(charts))
    plot = charts.plot(PLACE, TEXT)
    changed = (after != before).any(axis=2)[plot.x : plot.right, plot.y + 6 : plot.bottom]
    wide = {column(charts, time) - plot.x for time in (6, 7, 7.01, 8)}
    assert set(np.flatnonzero(changed.any(axis=1)).tolist()) == wide
    texts, labels = zip(*((mark.text, label) for mark, label in charts.placed_marks(PLACE, TEXT)), strict=True)
    assert texts == ("article differs", "pymunk differs", "no longer comparable", "exact stops")
    assert all(label.bottom <= plot.y and label.right <= PLACE.width for label in labels)
    assert all(label.collidelist(labels[k + 1 :]) < 0 for k, label in enumerate(labels))


@pytest.mark.usefixtures("memory_screen")
def test_the_mouse_shows_values(monkeypatch: pytest.MonkeyPatch) -> None:
    cards: list[list[list[str]]] = []
    monkeypatch.setattr("sandbox.view.charts.card", lambda surface, rows, *_: cards.append(rows))
    window = Window(scene_of(*TWO, more="seconds = 10"), ["pymunk", "impulse"])
    run(window, 120)
    layout = window.layout
    plot = window.view.charts.plot(layout.strip, layout.text_height)
    hover(window, (layout.strip.x + plot.x + round(0.15 * plot.width), layout.strip.y + plot.centery))
    window.draw()
    assert cards[-1] == [
        ["1.500 s", "energy, kg px²/s²"],
        *([name, "1,800 kg px²/s²"] for name in ("pymunk", "impulse", "exact")),
    ]


@pytest.mark.usefixtures("memory_screen")
def test_a_click_in_the_histogram_goes_to_no_time(window: Window) -> None:
    press(window, "Space")
    run(window, 10)
    strip = window.layout.strip
    for instrument, reached in ((SPEEDS, 10), (ENERGY, 0)):
        window.view.charts.show(instrument)
        click(window, (strip.x + 9, strip.centery))
        assert step(window) == reached


def test_the_histogram_has_every_ball_and_the_law_of_the_reference() -> None:
    scene = load("gas-1000")
    session = Session(scene, ["impulse", "exact"])
    histogram = histogram_of(session.shown, "exact")
    rms = np.sqrt(np.mean(length(session.shown.states["exact"].velocity) ** 2))
    for name in ("impulse", "exact"):
        speeds, counts = histogram.lines[name]
        assert counts[::2].sum() == 1000
        assert speeds[-1] == histogram.end == pytest.approx(3 * rms)
    speeds, counts = histogram.lines[LAW]
    assert counts.max() == pytest.approx(
        1000 * 0.8578 * 3 / 24, rel=0.01
    )  # √2 e^-½ a unit of speed, in bins of an eighth
    assert speeds[counts.argmax()] == pytest.approx(rms / 2**0.5, abs=2)
    assert not histogram.refusal
    assert "too few" in histogram_of(Session(load("article"), ["exact"]).shown, "exact").refusal


def test_each_line_ends_in_its_engine_s_name_and_none_hides_the_descenders_of_another(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    written: dict[str, Color] = {}

    def underline(text: str, colour: Color, height: int) -> Surface:
        """Return a name of which only the lowest row shows."""
        written[text] = colour
        name = Surface((9, 22), pygame.SRCALPHA)
        name.fill(colour if text in NAMES else (0, 0, 0, 0), (0, 21, 9, 1))
        return name

    monkeypatch.setattr("sandbox.view.charts.lettering", underline)
    charts = charts_of(scene, 2, steady)
    beside = pygame.surfarray.array3d(draw(charts))[column(charts, 2) + 2 :]
    for name, colour in zip(NAMES, (PYMUNK, ARTICLE, EXACT), strict=True):
        assert written[name] == colour
        assert (beside == tuple(colour)[:3]).all(axis=2).sum() == 9


def test_charts_without_room_draw_nothing(scene: Scene) -> None:
    surface = Surface((100, 100))
    charts_of(scene, 1, steady).draw(surface, Rect(8, 90, 80, 0), TEXT, 1.0)
    assert (pygame.surfarray.array3d(surface) == 0).all()
