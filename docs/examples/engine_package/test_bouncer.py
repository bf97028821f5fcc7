"""Holds the engine to limits: `pip install -e ".[test]"`, and then `pytest`."""

import pytest

import sandbox


@pytest.mark.parametrize("scene", ["oblique", "head-on"])
def test_elastic_contacts_keep_energy(scene: str) -> None:
    comparison = sandbox.compare(scene, ["bouncer", "exact"], seconds=2)
    assert comparison["bouncer"].energy_error == pytest.approx(0, abs=1e-9)
    assert comparison["bouncer"].escaped == 0
    assert not comparison.runs["bouncer"].missed


def test_a_finer_rate_comes_nearer_to_the_reference() -> None:
    assert sandbox.compare("oblique", ["bouncer", "exact"], rate=1920)["bouncer"].gap_max < 1


def test_inner_walls_are_refused() -> None:
    with pytest.raises(sandbox.Refused, match="use --engines impulse"):
        sandbox.compare("marble-run", ["bouncer", "exact"])
