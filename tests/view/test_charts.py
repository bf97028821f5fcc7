"""Charts keep samples of a run, and draw lines, marks and the cursor where the numbers say."""

import math
from collections.abc import Callable

import numpy as np
import pygame
import pytest
from conftest import scene_of
from pygame import Color, Rect, Surface

from sandbox.analysis.reference import Trust
from sandbox.run.lockstep import Lockstep
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.session.monitor import Marks
from sandbox.state import Floats, State
from sandbox.view.chart_data import CAPACITY, ChartData, Series
from sandbox.view.charts import HEADROOM, Charts
from sandbox.view.palette import Line, palette

PLACE = Rect(0, 0, 900, 300)
TEXT = 16
TWO = ("radius = 20\nposition = [200, 300]\nvelocity = [60, 0]", "radius = 20\nposition = [600, 300]")
FIRST, SECOND = (line.colour for line in palette("white").lines[:2])


@pytest.fixture
def scene() -> Scene:
    return scene_of(*TWO, more="seconds = 10")


def states(scene: Scene, time: float = 0.0, **velocity: float) -> dict[str, State]:
    """Make states at a time, one per engine: the first ball's speed, px/s, is also its distance from 200 px."""
    made = {}
    for name, speed in velocity.items():
        position, flight = np.array([[200.0 + speed, 300.0], [600.0, 300.0]]), np.array([[speed, 0.0], [0.0, 0.0]])
        made[name] = State(time, position, flight)
    return made


def run(scene: Scene, seconds: int, course: Callable[[float], dict[str, float]]) -> Charts:
    charts = Charts(ChartData(scene, states(scene, **course(0.0))))
    for step in range(1, seconds * scene.rate + 1):
        charts.data.add(step, states(scene, step / scene.rate, **course(step / scene.rate)))
    return charts


def draw(charts: Charts, time: float = 0.0) -> Surface:
    surface = Surface(PLACE.size)
    charts.draw(surface, PLACE, TEXT, time)
    return surface


def rows_of(surface: Surface, plot: Rect, x: int, colour: Color) -> list[int]:
    return [y for y in range(plot.top, plot.bottom) if surface.get_at((x, y)) == colour]


def column(charts: Charts, time: float, axis: float = 10.0) -> int:
    plot = charts.plots(PLACE, TEXT)[0]
    return round(plot.x + time / axis * (plot.width - 1))


def row(plot: Rect, low: float, high: float, value: float) -> float:
    return plot.bottom - 1 - (value - low) / ((high - low) * HEADROOM) * (plot.height - 1)


def test_a_series_keeps_an_hour_of_steps_evenly_in_bounded_memory() -> None:
    series = Series(2)
    hour = 3600 * 60
    for step in range(hour):
        if series.wants(step):
            series.add(step, (step, -step))
    assert CAPACITY / 2 <= len(series) <= CAPACITY
    gaps = np.diff(series.steps)
    assert set(gaps.tolist()) == {64}  # the least power of two by which an hour fits
    assert series.steps[0] == 0
    assert series.steps[-1] >= hour - 64
    assert np.array_equal(series.rows, np.column_stack([series.steps, -series.steps]))


def test_earlier_steps_are_not_sampled_again_until_the_series_is_cut() -> None:
    series = Series(1)
    for step in range(10):
        series.add(step, [step])
    assert not series.wants(4)
    series.cut(4)
    assert series.steps.tolist() == [0, 1, 2, 3, 4]
    assert series.wants(5)
    assert not series.wants(4)


def test_energy_gap_and_momentum_are_what_the_formulas_say(scene: Scene) -> None:
    data = ChartData(scene, states(scene, pymunk=60, article=60))
    data.add(1, states(scene, pymunk=90, article=30))
    assert data.of(0)[1].tolist() == pytest.approx([100 * 1.5**2, 100 * 0.5**2])
    assert data.of(1)[1].tolist() == pytest.approx([60 / math.sqrt(2), 0])  # over two balls
    assert data.of(2)[1].tolist() == [90, 30]


@pytest.mark.parametrize(
    ("engines", "reference"),
    [(["pymunk", "impulse"], "impulse"), (["exact", "pymunk"], "exact"), (["pymunk", "exact", "impulse"], "exact")],
)
def test_the_reference_is_the_exact_engine_if_it_runs_and_else_the_last(engines: list[str], reference: str) -> None:
    data = ChartData(load("head-on"), Lockstep(load("head-on"), engines).states())
    assert data.reference == reference
    assert [quantity.title for quantity in data.quantities] == ["energy", "RMS gap", "momentum"]


def test_one_engine_has_no_gap_and_a_scene_at_rest_no_energy_in_percent() -> None:
    scene = scene_of("radius = 20\nposition = [200, 300]")
    data = ChartData(scene, Lockstep(scene, ["pymunk"]).states())
    assert [(quantity.title, quantity.unit) for quantity in data.quantities] == [
        ("energy", "kg px²/s²"),
        ("momentum", "kg px/s"),
    ]


def test_lines_are_drawn_at_the_height_of_their_values(scene: Scene) -> None:
    charts = run(scene, 9, lambda time: {"pymunk": 60.0, "article": 60.0 if time < 5 else 30.0})
    surface = draw(charts, time=9.9)
    energy, gap, momentum = charts.plots(PLACE, TEXT)
    x = next(x for x in range(column(charts, 7), column(charts, 8)) if rows_of(surface, energy, x, SECOND))
    assert np.mean(rows_of(surface, energy, x, SECOND)) == pytest.approx(row(energy, 0, 100, 25), abs=1)
    assert np.mean(rows_of(surface, energy, x, FIRST)) == pytest.approx(row(energy, 0, 100, 100), abs=1)
    assert np.mean(rows_of(surface, momentum, x, SECOND)) == pytest.approx(row(momentum, 0, 100, 30), abs=1)
    assert np.mean(rows_of(surface, momentum, x, FIRST)) == pytest.approx(row(momentum, 0, 100, 60), abs=1)
    apart = math.log10(30 / math.sqrt(2))
    assert np.mean(rows_of(surface, gap, x, FIRST)) == pytest.approx(row(gap, 1, 2, apart), abs=1)
    assert not rows_of(surface, gap, x, SECOND)  # the reference's own
    assert not rows_of(surface, gap, column(charts, 3), FIRST)  # no gap, no place on a logarithmic axis


def test_a_chart_drawn_sample_by_sample_equals_the_chart_drawn_at_once(scene: Scene) -> None:
    def course(time: float) -> dict[str, float]:
        return {"pymunk": 60.0 + 10 * math.sin(7 * time), "article": 60 * math.exp(-time / 3)}

    charts = run(scene, 0, course)
    for step in range(1, 900):  # past the end of the first axis
        charts.data.add(step, states(scene, step / 60, **course(step / 60)))
        step_by_step = draw(charts)
    at_once = draw(run(scene, 15, course))
    different = (pygame.surfarray.array3d(step_by_step) != pygame.surfarray.array3d(at_once)).any(axis=2)
    assert different.mean() < 2e-3  # where ends of lines meet other lines


def test_only_new_samples_are_drawn(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    points: list[int] = []
    draw_line = Charts._draw_line

    def counting(surface: Surface, line: Line, x: Floats, y: Floats, width: int) -> None:
        points.append(len(x))
        draw_line(surface, line, x, y, width)

    monkeypatch.setattr(Charts, "_draw_line", staticmethod(counting))
    charts = run(scene, 5, lambda time: {"pymunk": 60.0})
    draw(charts)
    assert points == [301, 301]  # energy and momentum
    draw(charts)
    assert len(points) == 2
    charts.data.add(301, states(scene, pymunk=61))
    draw(charts)
    assert points[2:] == [2, 2]


def test_the_axis_of_time_doubles_when_it_is_full(scene: Scene) -> None:
    charts = run(scene, 11, lambda time: {"pymunk": 60.0})
    surface = draw(charts, time=11)
    energy = charts.plots(PLACE, TEXT)[0]
    assert rows_of(surface, energy, column(charts, 10.9, axis=20), FIRST)
    assert not rows_of(surface, energy, column(charts, 11.2, axis=20), FIRST)


def test_a_point_of_the_charts_stands_for_a_time(scene: Scene) -> None:
    charts = Charts(ChartData(scene, states(scene, pymunk=60)))
    place = Rect(8, 400, 900, 200)
    plot = charts.plots(place, TEXT)[0]
    for time in (0.0, 2.5, 10.0):
        x = place.x + round(plot.x + time / 10 * plot.width)
        assert charts.time_at(place, TEXT, (min(x, place.right - 1), 450)) == pytest.approx(time, abs=0.02)
    assert charts.time_at(place, TEXT, (9, 450)) == 0.0  # in the margin
    assert charts.time_at(place, TEXT, (500, 399)) is None


def test_the_cursor_is_drawn_at_the_time(scene: Scene) -> None:
    charts = run(scene, 2, lambda time: {"pymunk": 60.0})
    surface = draw(charts, time=4)
    energy = charts.plots(PLACE, TEXT)[0]
    ink = Color("black")
    assert len(rows_of(surface, energy, column(charts, 4), ink)) == energy.height
    assert len(rows_of(surface, energy, column(charts, 5), ink)) == 0


def test_horizon_and_first_differences_are_marked_through_all_charts(scene: Scene) -> None:
    charts = run(scene, 2, lambda time: {"pymunk": 60.0, "article": 60.0})
    before = pygame.surfarray.array3d(draw(charts))
    charts.marks = Marks(Trust(horizon=6.0), differences={"article": 7.0, "pymunk": 10.1})
    surface = draw(charts)
    for plot in charts.plots(PLACE, TEXT):
        assert rows_of(surface, plot, column(charts, 7), SECOND)
        assert rows_of(surface, plot, column(charts, 6), Color("black"))
    changed = (pygame.surfarray.array3d(surface) != before).any(axis=2)
    assert not changed[: column(charts, 5.9)].any()
    assert not changed[column(charts, 9.5) :].any()  # pymunk's first difference is beyond the axis


def test_the_earliest_end_of_the_reference_is_marked_by_its_name(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    labels = list[str]()

    def note(text: str, *_: object) -> Surface:
        labels.append(text)
        return Surface((9, 9))

    monkeypatch.setattr("sandbox.view.charts.lettering", note)
    charts = run(scene, 2, lambda time: {"pymunk": 60.0})
    charts.marks = Marks(Trust(horizon=8.0, undecided=5.0, unresolved=6.0))
    surface = draw(charts)
    plot = charts.plots(PLACE, TEXT)[0]
    assert rows_of(surface, plot, column(charts, 5), Color("black"))
    assert not rows_of(surface, plot, column(charts, 6), Color("black"))
    assert [label for label in labels if label in {"horizon", "undecided", "unresolved"}] == ["undecided"]


def test_charts_without_room_draw_nothing(scene: Scene) -> None:
    charts = run(scene, 1, lambda time: {"pymunk": 60.0})
    surface = Surface((100, 100))
    charts.draw(surface, Rect(8, 90, 80, 0), TEXT, 1.0)
    assert (pygame.surfarray.array3d(surface) == 0).all()


def test_after_a_cut_the_chart_shows_what_is_left(scene: Scene) -> None:
    charts = run(scene, 8, lambda time: {"pymunk": 60.0})
    draw(charts)
    charts.data.series.cut(4 * scene.rate)
    surface = draw(charts)
    energy = charts.plots(PLACE, TEXT)[0]
    assert rows_of(surface, energy, column(charts, 3.9), FIRST)
    assert not rows_of(surface, energy, column(charts, 4.2), FIRST)
