"""Pymunk's settings in specs: each engine has one shortest spec, and sliders show the value in force."""

import math
from itertools import pairwise
from typing import Any

import pymunk
import pytest
from conftest import scene_of
from hypothesis import given
from hypothesis import strategies as st

from sandbox.engines import create, settings_in, with_settings
from sandbox.engines.pymunk import PymunkEngine
from sandbox.errors import SandboxError
from sandbox.scene.spawn import spawn
from sandbox.view.tuning import SCALES, are_same, in_force, meaning_of, normal, scale_of, with_setting

PLAIN = scene_of("radius = 20\nposition = [200, 300]")
OWN = scene_of("radius = 20\nposition = [200, 300]", more="[pymunk]\nsubsteps = 4\ndamping = 0.9")
VALUES: dict[str, st.SearchStrategy[Any]] = {
    "iterations": st.integers(1, 1_000),
    "substeps": st.integers(1, 1_000),
    "collision_slop": st.floats(0, 1e6),
    "collision_bias": st.floats(0, 1),
    "collision_persistence": st.integers(0, 1_000_000),
    "damping": st.floats(0, 1, exclude_min=True),
    "walls_first": st.integers(0, 1),
}
specs = st.lists(st.sampled_from(list(VALUES)), unique=True, max_size=7).flatmap(
    lambda keys: st.fixed_dictionaries({key: VALUES[key] for key in keys}).map(
        lambda settings: with_settings("pymunk", settings)
    )
)
scenes = st.sampled_from([PLAIN, OWN])


@given(spec=specs, scene=scenes)
def test_the_shortest_spec_is_of_the_same_engine(spec: str, scene: Any) -> None:
    short = normal(spec, scene)
    assert in_force(short, scene) == in_force(spec, scene)
    assert normal(short, scene) == short
    own = in_force("pymunk", scene)
    assert all(value != own[key] for key, value in settings_in(short)[1].items())


@given(spec=specs, scene=scenes, key=st.sampled_from(list(VALUES)), data=st.data())
def test_a_setting_changed_and_changed_back_leaves_the_engine_as_it_was(
    spec: str, scene: Any, key: str, data: st.DataObject
) -> None:
    short, value = normal(spec, scene), data.draw(VALUES[key])
    changed = with_setting(short, scene, key, value)
    assert in_force(changed, scene) == in_force(short, scene) | {key: value}
    assert are_same(with_setting(changed, scene, key, in_force(short, scene)[key]), short, scene)


def test_the_values_in_force_are_those_of_the_space() -> None:
    for spec, scene in (("pymunk", PLAIN), ("pymunk(collision_slop=0.5, iterations=30)", OWN)):
        engine = create(spec, scene, spawn(scene))
        assert isinstance(engine, PymunkEngine)
        space = engine.space
        shown = in_force(spec, scene)
        assert {key: getattr(space, key) for key in shown if hasattr(pymunk.Space, key)} == {
            key: shown[key]
            for key in ("iterations", "collision_slop", "collision_bias", "collision_persistence", "damping")
        }
    assert in_force("pymunk", OWN)["substeps"] == 4
    assert in_force("pymunk(substeps=2)", OWN)["substeps"] == 2


def test_the_scene_s_own_value_is_left_out_of_the_spec() -> None:
    assert with_setting("pymunk(substeps=4)", PLAIN, "substeps", 1) == "pymunk"
    assert with_setting("pymunk", OWN, "substeps", 1) == "pymunk(substeps=1)"
    assert with_setting("pymunk(substeps=1)", OWN, "substeps", 4) == "pymunk"
    assert normal("pymunk(substeps=2, iterations=30.0)", PLAIN) == "pymunk(substeps=2, iterations=30)"
    assert normal("mine(1).py:Mine", PLAIN) == "mine(1).py:Mine"


@pytest.mark.parametrize("spec", ["pymunk(substeps=0)", "pymunk(speed=3)", "exact(substeps=2)", "pymunk(substeps=2"])
def test_a_wrong_setting_is_an_error(spec: str) -> None:
    with pytest.raises(SandboxError, match=r"substeps|speed|exact"):
        normal(spec, PLAIN)


@pytest.mark.parametrize("key", SCALES)
def test_a_scale_has_the_value_in_force_to_the_bit_and_only_valid_ones(key: str) -> None:
    own = in_force("pymunk", PLAIN)[key]
    for value in (own, 0.37 if key in ("damping", "collision_bias", "collision_slop") else 7):
        scale = scale_of(key, own, value)
        assert {own, value} <= set(scale)
        assert list(scale) == sorted(set(scale))
        assert not any(math.isclose(a, b, rel_tol=1e-6) for a, b in pairwise(scale))
    for value in SCALES[key]:
        in_force(with_setting("pymunk", PLAIN, key, value), PLAIN)
    assert len(meaning_of(key)) > 10
