"""Engines that do many steps at once do the same as one step at a time, to the bit."""

import numpy as np
import pytest
from conftest import scene_of
from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox.engines import create
from sandbox.engines.engine import advance
from sandbox.engines.exact import engine as exact
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.state import Contacts, Floats, States

ROUGH = scene_of(
    "count = 30\nradius = 15\ninside = [[0, 300], [400, 600]]\nspeed = 200\nfriction = 0.8\nelasticity = 0.6",
    more="gravity = [0, 900]\n[[walls]]\nfrom = [0, 400]\nto = [300, 560]\nthickness = 10\nfriction = 0.5\n",
)  # a pile with friction on a slope: contacts that rest, part and touch again
ARTICLE, GAS, FUNNEL = load("article"), load("gas-100"), load("funnel")
CASES = {
    "article, few": ("article", ARTICLE),
    "article": ("article", GAS),
    "impulse, few": ("impulse", ARTICLE),
    "impulse, walls": ("impulse", FUNNEL),
    "impulse": ("impulse", GAS),
    "exact, heap": ("exact", FUNNEL),
    "exact, friction": ("exact", ROUGH),
    "exact": ("exact", GAS),
    "pymunk": ("pymunk", GAS),
    "pymunk, friction": ("pymunk", ROUGH),
}
WIDE = ("impulse, walls", "exact, heap", "exact, friction")  # the dearest


def play(name: str, scene: Scene, blocks: list[int], kick: int) -> list[Floats | Contacts]:
    """Run an engine in blocks of steps, with a kick before the block of that number."""
    engine = create(name, scene, spawn(scene))
    engine.record_contacts()
    parts = []
    for number, steps in enumerate(blocks):
        if number == kick:
            engine.kick(1, (40.0, -300.0))
        states = States.empty(steps, len(scene.bodies))
        states.position[:] = states.velocity[:] = np.nan
        advance(engine, states)
        now = engine.state()
        for what, rows in states._asdict().items():
            assert rows[-1].tobytes() == getattr(now, what).tobytes()
        parts.append((*states, engine.contacts()))
    return [np.concatenate(part) for part in zip(*parts, strict=True)]


@pytest.mark.parametrize(
    ("name", "scene"),
    [pytest.param(*case, id=key, marks=pytest.mark.wide if key in WIDE else ()) for key, case in CASES.items()],
)
@settings(max_examples=5)
@given(
    blocks=st.lists(st.integers(1, 90), min_size=2, max_size=4),
    rows=st.sampled_from([1, 2, 64]),
    substeps=st.integers(1, 3),
    persistence=st.sampled_from([1, 3, 10]),
    states_bytes=st.sampled_from([1, 40_000, 500_000]),
    data=st.data(),
)
def test_a_block_of_steps_is_so_many_single_steps(
    name: str,
    scene: Scene,
    blocks: list[int],
    rows: int,
    substeps: int,
    persistence: int,
    states_bytes: int,
    data: st.DataObject,
) -> None:
    """rows: of the contact log at first, so that it is full now and then; states_bytes: of Pymunk's, read together."""
    kick = data.draw(st.integers(0, len(blocks) - 1))
    if name == "pymunk":
        scene = scene.changed(pymunk={"substeps": substeps, "collision_persistence": persistence})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sandbox.engines.stepped.LOG_ROWS", rows)
        patch.setattr("sandbox.engines.pymunk.STATES_BYTES", states_bytes)
        patch.setattr(exact, "LOG_ROWS", rows)
        whole = play(name, scene, blocks, kick)
    singles = [1] * sum(blocks)
    one_by_one = play(name, scene, singles, sum(blocks[:kick]))
    for part, single in zip(whole, one_by_one, strict=True):
        assert part.tobytes() == single.tobytes()


def test_contacts_are_not_collected_before_they_are_asked_for() -> None:
    scene = load("gas-100")
    engine = create("article", scene, spawn(scene))
    advance(engine, States.empty(60, 100))
    engine.record_contacts()
    assert len(engine.contacts()) == 0
    advance(engine, States.empty(60, 100))
    time = engine.contacts()["time"]
    assert 1 < time.min() <= time.max() == 2
