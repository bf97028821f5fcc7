"""What each engine supports: the table, the documents, and the scenes agree."""

import re
from pathlib import Path

import pytest
from conftest import Command

import sandbox
from sandbox.engines.support import Feature, Support, engines

ENGINES = Path(__file__).parents[2] / "docs" / "engines.md"
DOCUMENTED = {  # row of the table in docs/engines.md -> the features that it is about
    "several radii and masses": (Feature.RADII, Feature.MASSES),
    "elasticity below 1, friction, spin": (Feature.ELASTICITY, Feature.FRICTION, Feature.SPIN),
    "gravity, inner walls": (Feature.GRAVITY, Feature.WALLS),
    "an arena without walls": (Feature.OPEN,),
}


@pytest.fixture(scope="module")
def supported() -> dict[str, Support]:
    return engines()


def test_it_is_what_the_documents_say(supported: dict[str, Support]) -> None:
    head, _, *rows = (line.split("|")[1:-1] for line in ENGINES.read_text().splitlines() if line.startswith("| "))
    names = re.findall(r"`(\w+)`", ENGINES.read_text().partition("## Side by side")[2].partition("\n|---")[0])
    assert set(supported) <= set(names) == {"exact", "pymunk", "article", "impulse", "box2d", "watch"}
    cells = {row[0].strip(): [cell.strip() for cell in row[1:]] for row in [head, *rows]}
    for label, features in DOCUMENTED.items():
        for name, cell in zip(names, cells[label], strict=True):
            if name in supported:
                accepted = {feature in supported[name].accepts for feature in features}
                assert accepted == {cell == "yes"}, f"{name}: {label}"


def test_the_module_can_be_called_before_and_after_it_is_imported(supported: dict[str, Support]) -> None:
    assert sandbox.engines() == supported


def test_the_command_prints_a_table_that_fits_and_json(command: Command, supported: dict[str, Support]) -> None:
    code, out, _ = command("engines")
    assert code == 0
    lines = out.splitlines()
    assert lines[0].split()[:4] == ["pymunk", "article", "impulse", "exact"]
    assert max(map(len, lines)) <= 80
    assert next(line.split()[1:5] for line in lines if line.startswith("gravity ")) == ["yes", "no", "yes", "yes"]
