"""Worksheets: other numbers for each pupil, and answers from the law of impacts."""

import base64
import re
from pathlib import Path

import pytest
from browser import chromium
from conftest import Command, scene_of

from sandbox.errors import SandboxError
from sandbox.report.worksheet import worksheet
from sandbox.scene.model import Scene

CARTS = (
    "radius = 20\nposition = [100, 60]\nvelocity = [200, 0]\nelasticity = 0.5",
    "radius = 20\nposition = [400, 60]",
)
ROW = re.compile(r"<th>(?:ball \d|  after|together).*?</tr>", re.DOTALL)


def carts(seed: int = 0) -> Scene:
    return scene_of(*CARTS, size="[800, 120]", more=f"seconds = 4\nseed = {seed}")


def cells(row: str) -> list[str]:
    return re.findall(r"<td[^>]*>(.*?)</td>", row)


def x_of(vector: str) -> float:
    return float(vector.strip("()").replace("\N{MINUS SIGN}", "-").split(",")[0])


def tables(page: str) -> list[list[list[str]]]:
    return [[cells(row) for row in ROW.findall(table)] for table in page.split("<table>")[1:]]


def test_the_answers_are_those_of_the_law_of_impacts() -> None:
    e, pupils = 0.5, 8
    given, answers = (
        [table for table in tables(part) if len(table) == 6]  # of two balls
        for part in worksheet(carts(), pupils, with_answers=True).split('<section class="answers">')
    )
    assert len(given) == len(answers) == pupils
    for sheet, answer in zip(given, answers, strict=True):
        assert [row[1] for row in sheet] == [answer[0][1], "", answer[2][1], "", "", ""]
        assert {text for row in sheet for text in row[2:]} == {""}
        m, n = float(answer[0][0]), float(answer[2][0])
        u, v = x_of(answer[0][1]), x_of(answer[2][1])
        assert v == 0
        assert x_of(answer[1][1]) == pytest.approx(u * (m - e * n) / (m + n), rel=1e-3)
        assert x_of(answer[3][1]) == pytest.approx(u * (1 + e) * m / (m + n), rel=1e-3)
        assert answer[4][2] == answer[5][2]
    assert len({str(sheet) for sheet in given}) == pupils


def test_a_seed_gives_the_same_sheets_and_another_one_others() -> None:
    one, same, other = (worksheet(carts(seed), 2, with_answers=False) for seed in (1, 1, 2))
    assert one == same
    assert tables(one) != tables(other)
    assert "answers" not in re.sub(r"<style>.*</style>", "", one, flags=re.DOTALL)


@pytest.mark.wide
def test_what_makes_no_sheet_is_refused() -> None:
    apart = scene_of("radius = 20\nposition = [100, 60]", more="seconds = 1")
    with pytest.raises(SandboxError, match="nothing touches in 1 s, so there is nothing to ask"):
        worksheet(apart, 1, with_answers=True)
    with pytest.raises(SandboxError, match="test has 13 balls; a sheet has room for 12"):
        worksheet(scene_of("radius = 5\ngrid = [13, 1]\nspacing = 20\nposition = [20, 20]"), 1, with_answers=True)
    bounce = scene_of("radius = 20\nposition = [100, 40]\nmass = 2", more="seconds = 2\ngravity = [0, 900]")
    with pytest.raises(SandboxError, match="its numbers differ for 6 pupils at most"):  # only its mass does
        worksheet(bounce, 7, with_answers=True)


def test_numbers_below_zero_have_the_sign_for_minus() -> None:
    page = worksheet(carts().changed(gravity=(-30, 0)), 4, with_answers=True)
    numbers = [text for table in tables(page) for row in table for text in row]
    assert "Gravity is (\N{MINUS SIGN}30, 0) px/s²" in page
    assert any("\N{MINUS SIGN}" in text for text in numbers)
    assert not any("-" in text for text in numbers)


def test_each_sheet_is_a_page_of_paper(working_folder: Path, command: Command) -> None:
    assert command("worksheet", "head-on", "--pupils", 3, "--seed", 5, "--out", "sheets.html") == (0, "", "")
    with chromium(working_folder / "profile") as browser:
        browser.call("Page.navigate", url=(working_folder / "sheets.html").as_uri())
        browser.wait_for("document.readyState === 'complete'")
        printed = base64.b64decode(browser.call("Page.printToPDF")["data"])
    assert len(re.findall(rb"/Type\s*/Page\b", printed)) == 4
