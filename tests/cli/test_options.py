"""Options: how they are parsed and reported."""

import re

import pytest
from conftest import Command

from sandbox.cli.options import parse_layers, parse_rates, parse_seeds, parse_setting, parse_size, settings_by_key
from sandbox.errors import SandboxError
from sandbox.view import Layer


def test_options_are_parsed() -> None:
    assert parse_seeds("0:200") == range(200)
    assert parse_rates("60,240") == [60, 240]
    assert parse_size("640x360") == (640, 360)
    assert (parse_layers(""), parse_layers("charts, trails")) == ([], [Layer.CHARTS, Layer.TRAILS])
    settings = [parse_setting("substeps=1,4"), parse_setting("collision_bias=0.5")]
    assert settings_by_key(settings) == {"substeps": [1, 4], "collision_bias": [0.5]}
    with pytest.raises(SandboxError, match=r"^--set substeps: is given twice; write all its values in one"):
        settings_by_key([parse_setting("substeps=1"), parse_setting("substeps=2")])


def test_defaults_are_shown_as_they_are_written(command: Command) -> None:
    _, out, _ = command("record", "--help")
    assert re.search(r"--size .*\[default: 1280x720\]", out)
    assert re.search(r"--show [^[]*\[default:\s+charts\]", out)


def test_the_help_names_all_that_a_recording_can_show(command: Command) -> None:
    _, out, _ = command("record", "--help")
    assert set(re.findall(r"\w+", out)) >= set(Layer)
