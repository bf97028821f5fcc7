"""The units in which a scene is shown; its physics, JSON and CSV stay in px."""

import math
import re
from functools import partial

import numpy as np
import pytest

from sandbox.analysis.comparison import Comparison, compare
from sandbox.errors import SandboxError
from sandbox.judge.causes import Cause
from sandbox.judge.laws import LAWS
from sandbox.judge.ledger import ERROR
from sandbox.judge.words import OF_STEPS, of_errors
from sandbox.report.comparison_page import page
from sandbox.report.first_contacts import first_contacts
from sandbox.report.output import DEFAULT_WIDTH, text_of
from sandbox.report.scales import gap_scale
from sandbox.report.tables import print_comparison
from sandbox.scene.files import dump, load, parse
from sandbox.scene.model import Scene
from sandbox.scene.units import PIXELS, Dimension, LengthUnit, Units

METRES = Units(length=LengthUnit.METRE, pixels_per_metre=100)
METRES_TOML = '[units]\nlength = "m"\npixels_per_metre = 100\n'
DROP = """
gravity = [0, 981]
seconds = 1
[arena]
size = [400, 400]
[[balls]]
radius = 20
position = [200, 180]
[[balls]]
radius = 20
position = [100, 100]
velocity = [300, 0]
"""
HEIGHT, GRAVITY = 2.0, 9.81  # m, m/s²: of the first ball's lowest point, and of DROP in metres


def drop(units: str = METRES_TOML) -> Scene:
    return parse(f"{DROP}{units}", "drop.toml")


@pytest.fixture(scope="module")
def compared() -> Comparison:
    return compare(drop(), ["pymunk", "exact"])


def test_a_ball_that_falls_two_metres_lands_as_the_law_of_falling_has_it(compared: Comparison) -> None:
    title, (labels, before, after) = next(first_contacts(drop(), compared.runs["exact"], 5))
    speed = math.sqrt(2 * GRAVITY * HEIGHT)
    assert f"{speed:.4g}" == "6.264"
    down, up = f"(0, {speed:.4g})", f"(0, -{speed:.4g})"
    assert title.endswith(" s, ball 0 and the bottom wall")
    assert labels == ["", "kg", "velocity, m/s", "momentum, kg m/s", "energy, J"]
    assert before == ["ball 0, before", "1", down, down, f"{GRAVITY * HEIGHT:.4g}"]
    assert after[2:4] == [up, up]


@pytest.mark.parametrize(
    ("length", "shown"),
    [
        ("m", "2 m, 3 m/s, 4 kg m/s"),
        ("cm", "200 cm, 300 cm/s, 400 kg cm/s"),
        ("mm", "2e+03 mm, 3e+03 mm/s, 4e+03 kg mm/s"),
    ],
)
def test_energies_are_in_joules_whatever_the_unit_of_length(length: str, shown: str) -> None:
    units = Units(length=LengthUnit(length), pixels_per_metre=50)
    quantities = (Dimension.LENGTH, 100), (Dimension.VELOCITY, 150), (Dimension.MOMENTUM, 200)
    assert ", ".join(units.text(dimension, "{:.3g}", value) for dimension, value in quantities) == shown
    assert units.text(Dimension.ENERGY, "{:.3g}", 0.5 * 2 * 150**2) == "9 J"  # of 2 kg at 3 m/s


def said(cause: Cause, law: str, values: list[float]) -> str:
    """Return the sentence of errors with values, which are depths, too, in px."""
    errors = np.zeros(len(values), ERROR)
    errors["cause"], errors["law"], errors["value"], errors["depth"] = cause, law, values, values
    return of_errors(drop(), errors, {})


def test_nothing_of_a_scene_with_units_is_shown_in_pixels(compared: Comparison) -> None:
    shown = [
        text_of(partial(print_comparison, compared), DEFAULT_WIDTH),
        text_of(partial(print_comparison, compare(drop(), ["exact"])), DEFAULT_WIDTH),
        page(compared),
        *(said(law.cause, law.name, value) for law in LAWS for value in ([-0.5], [0.5, 2.0])),
        *(said(Cause.UNREPORTED, law, [0.5]) for law in OF_STEPS),
        *(said(cause, "", [0.5, 2.0]) for cause in (Cause.LATE, Cause.EARLY, Cause.OVERSHOOT)),
    ]
    for text in shown:
        text = re.sub("<(script|style|pre).*?</(script|style|pre)>|<[^>]*>", "", text, flags=re.DOTALL)  # noqa: PLW2901
        assert not re.findall(r"[^\n]*\bpx\b[^\n]*", text)
    for unit in ("m", "m/s", "J"):
        assert re.search(rf"[ (]{unit}\b", shown[1])


def test_physics_json_and_csv_do_not_depend_on_the_units(compared: Comparison) -> None:
    in_pixels = compare(drop(""), ["pymunk", "exact"])
    for name, run in compared.runs.items():
        assert run.final.position.tobytes() == in_pixels.runs[name].final.position.tobytes()
    for ours, theirs in zip(compared.rows(), in_pixels.rows(), strict=True):
        sentence = ours.pop("first_difference.because"), theirs.pop("first_difference.because")
        assert ours == theirs
        assert sentence[0] is None or sentence[0] == sentence[1].replace("0.136 px", "0.00136 m")


@pytest.mark.parametrize(
    ("table", "problem"),
    [
        ('[units]\nlength = "m"', "13: units must have both pixels_per_metre and a length of 'mm', 'cm' or 'm'"),
        ("[units]\npixels_per_metre = 100", "13: units must have both pixels_per_metre and a length of "),
        (METRES_TOML.replace('"m"', '"inch"'), "14: units.length must be 'px', 'mm', 'cm' or 'm', got 'inch'"),
        (METRES_TOML.replace("100", "0"), "15: units.pixels_per_metre must be greater than 0, got 0"),
    ],
)
def test_units_that_cannot_be_shown_are_refused(table: str, problem: str) -> None:
    with pytest.raises(SandboxError) as error:
        drop(table)
    assert str(error.value).replace('"', "'").startswith(f"drop.toml:{problem}")


def test_units_are_kept_in_a_file_and_left_out_if_px_are_shown(working_folder: None) -> None:
    dump(drop(), "drop.toml")
    assert load("drop.toml").units == METRES
    dump(drop('[units]\nlength = "px"\n'), "drop.toml")
    assert load("drop.toml").units == PIXELS
    assert "units" not in load("drop.toml").source


@pytest.mark.parametrize("pixels_per_metre", [1e-3, 1, 64, 100, 120, 1e4])
def test_the_axis_of_gaps_has_powers_of_ten_from_a_thousandth_of_a_pixel_to_a_pixel_or_further(
    pixels_per_metre: float,
) -> None:
    scale = gap_scale(Units(length=LengthUnit.METRE, pixels_per_metre=pixels_per_metre))
    assert scale.reach / scale.least == pytest.approx(1000)
    assert 1 - 1e-9 <= 1 / pixels_per_metre / scale.reach < 10
    assert math.log10(scale.least) == pytest.approx(round(math.log10(scale.least)))
    low, high = scale.span(0.0, 0.5 * scale.reach)
    assert 10 ** (high - low) == pytest.approx(1000)
