"""Heaps in arenas that rows of balls fill from wall to wall, in `exact`: none fails, and the walls carry the weight.

`pytest -m slow -s tests/slow/test_heaps.py` prints how many contacts a heap has, beside those of one with room.
"""

from random import Random

import numpy as np
import pytest
from exact_scenes import engine_of

from sandbox.scene.files import parse
from sandbox.scene.model import Scene

pytestmark = pytest.mark.slow

HEAPS = 200
RADIUS, GRAVITY, SECONDS = 8.0, 900.0, 3


def heap_at_random(seed: int, room: float = 0.0) -> Scene:
    """Return a scene whose arena is as wide as some balls in a row, or 1e-12 px more or less, with more room (px)."""
    random = Random(seed)
    in_a_row = random.choice([12, 20, 25, 30])
    width = 2 * RADIUS * in_a_row + random.choice([-1e-12, 0.0, 1e-12]) + room
    count = random.choice([in_a_row, in_a_row * 3 // 2, in_a_row * 2, in_a_row * 3])
    factors = f"elasticity = {random.uniform(0, 0.95)}\nfriction = {random.choice([0.0, 0.5])}\n"
    return parse(
        f"gravity = [0, {GRAVITY}]\nseed = {seed}\n[arena]\nsize = [{width!r}, 400]\n{factors}"
        f"[[balls]]\n{factors}radius = {RADIUS}\ncount = {count}\ninside = [[0, 0], [{width!r}, 400]]\n",
        f"heap {seed}",
    )


def contacts_of(scene: Scene) -> int:
    """Run a heap, check in each step that walls and gravity give it what it gains; return its number of contacts."""
    engine = engine_of(scene)
    weight = scene.bodies.mass.sum() * GRAVITY
    before, count = scene.bodies.mass @ engine.state().velocity, 0
    for _ in range(round(SECONDS * scene.rate)):
        engine.step()
        after, contacts = scene.bodies.mass @ engine.state().velocity, engine.contacts()
        at_wall = contacts[contacts["second"] < 0]
        (nx, ny), j, t = at_wall["normal"].T, at_wall["impulse"], at_wall["tangential"]
        given = np.array([-(j @ nx - t @ ny), weight / scene.rate - (j @ ny + t @ nx)])
        assert given == pytest.approx(after - before, abs=1e-9 * weight)
        before, count = after, count + len(contacts)
    return count


def test_heaps_on_full_floors_never_fail() -> None:
    ratios = [contacts_of(heap_at_random(seed)) / contacts_of(heap_at_random(seed, room=1.0)) for seed in range(HEAPS)]
    shares = np.percentile(ratios, [50, 90, 100])
    print("contacts, beside those of the same heap 1 px wider:", *(f"{share:.1f}" for share in shares))
