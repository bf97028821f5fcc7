"""Holds the engine to limits: `pip install -e ".[test]"`, and then `pytest`."""

import pytest

import sandbox
from sandbox.scripting.pytest_plugin import SandboxCompare


@pytest.mark.parametrize("scene", ["oblique", "head-on"])
def test_elastic_contacts_keep_energy(scene: str, sandbox_compare: SandboxCompare) -> None:
    comparison = sandbox_compare(scene, "bouncer", seconds=2, max_energy_error=1e-9)
    assert comparison["bouncer"].escaped == 0
    assert not comparison.runs["bouncer"].missed


def test_a_finer_rate_comes_nearer_to_the_reference(sandbox_compare: SandboxCompare) -> None:
    sandbox_compare("oblique", "bouncer", rate=1920, max_gap=1)


def test_inner_walls_are_refused(sandbox_compare: SandboxCompare) -> None:
    with pytest.raises(sandbox.Refused, match="use --engines impulse"):
        sandbox_compare("marble-run", "bouncer")
