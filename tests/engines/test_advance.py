"""Engines that do many steps at once do the same as one step at a time, to the bit."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox.engines import advance, create
from sandbox.engines.exact import engine as exact
from sandbox.engines.stepped import SteppedEngine
from sandbox.scene.files import load
from sandbox.scene.spawn import spawn
from sandbox.state import Contacts, Floats, States

SCENES = {
    "article": ["article", "gas-100"],
    "impulse": ["article", "funnel", "gas-100"],
    "exact": ["funnel", "gas-100"],
    "pymunk": ["gas-100"],
}


def play(name: str, scene: str, blocks: list[int], kick: int) -> list[Floats | Contacts]:
    """Run an engine in blocks of steps, with a kick before the block of that number."""
    loaded = load(scene)
    engine = create(name, loaded, spawn(loaded))
    engine.record_contacts()
    parts = []
    for number, steps in enumerate(blocks):
        if number == kick:
            engine.kick(1, (40.0, -300.0))
        states = States.empty(steps, len(loaded.bodies))
        states.position[:] = states.velocity[:] = np.nan
        advance(engine, states)
        for rows, now in zip(states, States.of(engine.state()), strict=True):
            assert rows[-1:].tobytes() == now.tobytes()
        parts.append((*states, engine.contacts()))
    return [np.concatenate(part) for part in zip(*parts, strict=True)]


@pytest.mark.parametrize(("name", "scene"), [(name, scene) for name, scenes in SCENES.items() for scene in scenes])
@settings(max_examples=5)
@given(blocks=st.lists(st.integers(1, 90), min_size=2, max_size=4), rows=st.sampled_from([1, 2, 64]), data=st.data())
def test_a_block_of_steps_is_so_many_single_steps(
    name: str, scene: str, blocks: list[int], rows: int, data: st.DataObject
) -> None:
    """rows: of the contact log at first, so that it is full now and then."""
    kick = data.draw(st.integers(0, len(blocks) - 1))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sandbox.engines.stepped.LOG_ROWS", rows)
        patch.setattr(exact, "LOG_ROWS", rows)
        whole = play(name, scene, blocks, kick)
    singles = [1] * sum(blocks)
    one_by_one = play(name, scene, singles, sum(blocks[:kick]))
    for part, single in zip(whole, one_by_one, strict=True):
        assert part.tobytes() == single.tobytes()


def test_contacts_are_not_collected_before_they_are_asked_for() -> None:
    scene = load("gas-100")
    engine = create("article", scene, spawn(scene))
    assert isinstance(engine, SteppedEngine)
    engine.advance(60, *States.empty(60, 100))
    engine.record_contacts()
    assert len(engine.contacts()) == 0
    engine.advance(60, *States.empty(60, 100))
    time = engine.contacts()["time"]
    assert 1 < time.min() <= time.max() == 2
