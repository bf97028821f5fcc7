"""Numbers on pages, words, and engines, as readers find them."""

import re
from pathlib import Path

import pytest

import sandbox
from sandbox.analysis.comparison import compare
from sandbox.engines import registry
from sandbox.report.about import KNOWN, about
from sandbox.report.comparison_page import page
from sandbox.report.numbers import minus, readable
from sandbox.scene.files import load

DOCUMENTS = Path(sandbox.__file__).parents[1]


@pytest.mark.parametrize(
    ("python", "people"),
    [
        ("1.200e+06", "1,200,000"),
        ("0.00e+00 px", "0 px"),
        ("5.84e-01", "0.584"),
        ("2.22e-16", "2.22 × 10⁻¹⁶"),  # noqa: RUF001
        ("1e-07 of it", "1 × 10⁻⁷ of it"),  # noqa: RUF001
        ("1.000e-12", "1 × 10⁻¹²"),  # noqa: RUF001
        ("an impulse of 1.2e+06 kg px/s.", "an impulse of 1,200,000 kg px/s."),
        ("pymunk(damping=1e-05)", "pymunk(damping=1e-05)"),
        ("mine-1e-05", "mine-1e-05"),
        ("a1e-05", "a1e-05"),
    ],
)
def test_numbers_in_sentences_have_no_exponents_of_python(python: str, people: str) -> None:
    assert readable(python) == people


def test_cells_have_separators_and_a_true_minus() -> None:
    assert minus("323643") == "323,643"
    assert minus("-0.5 px") == "\N{MINUS SIGN}0.5 px"


def test_no_number_on_a_page_has_an_exponent_of_python() -> None:
    text = page(compare(load("head-on").changed(seconds=2.0), ["pymunk", "impulse", "exact"]))
    shown = re.sub("<(script|style|pre).*?</(script|style|pre)>", "", text, flags=re.DOTALL)
    assert not re.findall(r"\de[+-]\d+", shown)


def test_the_readme_says_the_same_of_each_engine() -> None:
    lines = re.findall(r"^\| `(\w+)` \| (.+?) \| (.+?) \|$", (DOCUMENTS / "README.md").read_text(), re.MULTILINE)
    plain = {name: [re.sub(r"\[(.+?)\]\(.+?\)|`", r"\1", cell) for cell in cells] for name, *cells in lines}
    assert set(KNOWN) >= set(registry())
    for name, (what, wrong) in KNOWN.items():
        assert plain[name][0].startswith(what)
        assert plain[name][1] == wrong


def test_engines_with_settings_and_loops_of_ones_own_are_described() -> None:
    assert about("pymunk(substeps=4)").what == "a pymunk.Space: circles and segment walls; with substeps=4"
    assert about("my loops/mine.py:step").what == "a loop of yours, from my loops/mine.py:step"
    assert about("mine").what == "an engine that is not built in"
