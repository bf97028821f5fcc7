"""What each engine supports: the table and the scenes agree."""

import pytest
from conftest import Command

import sandbox
from sandbox.engines.support import Support, engines


@pytest.fixture(scope="module")
def supported() -> dict[str, Support]:
    return engines()


def test_the_module_can_be_called_before_and_after_it_is_imported(supported: dict[str, Support]) -> None:
    assert sandbox.engines() == supported


def test_the_command_prints_a_table_that_fits_and_json(command: Command, supported: dict[str, Support]) -> None:
    code, out, _ = command("engines")
    assert code == 0
    lines = out.splitlines()
    assert lines[0].split()[:4] == ["pymunk", "article", "impulse", "exact"]
    assert max(map(len, lines)) <= 80
    assert next(line.split()[1:5] for line in lines if line.startswith("gravity ")) == ["yes", "no", "yes", "yes"]
