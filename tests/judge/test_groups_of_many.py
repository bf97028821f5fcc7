"""Faults in steps of many balls that touch: shown by contacts of few, and of walls and pairs that part each its way."""

from collections import Counter
from pathlib import Path
from typing import Final

import pytest

import sandbox
from sandbox.judge.causes import Cause
from sandbox.scene.files import load


def causes(scene: str, engine: str, seconds: float) -> Counter[Cause]:
    """Return how many contacts of an engine's run have each cause."""
    comparison = sandbox.compare(
        load(scene).changed(seconds=seconds, expect=()), list(dict.fromkeys([engine, "exact"]))
    )
    counts = Counter[Cause]()
    for suffered in comparison.runs[engine].suffered:
        counts[suffered.cause] += suffered.times
    return counts


def test_what_contacts_of_two_show_explains_a_whole_rack_that_came_before() -> None:
    """The break: 16 balls touch in each of the first 25 steps with a contact, of which nothing else is known yet."""
    scene = load("break-shot").changed(seconds=2.0, expect=())
    run = sandbox.compare(scene, ["article", "exact"]).runs["article"]
    assert run.figures.first_difference is not None
    assert run.figures.first_difference.cause == Cause.SMALL
    worst = run.suffered[0]
    assert worst.because.startswith(f"The impulse is {1 / 14:.4g} of what is due.")
    assert worst.share > 0.999
    assert Cause.UNKNOWN not in {suffered.cause for suffered in run.suffered}


def test_walls_that_turn_back_what_parts_beside_pairs_that_do_not() -> None:
    """The article reverses a velocity in a wall even if it leads out of it, and lets pairs that part alone.

    Some groups are joined only by what the order of pushes makes overlap: no exact step has them together.
    """
    counts = causes("gas-100", "article", 2.1)
    assert Cause.UNKNOWN not in counts
    assert counts[Cause.SMALL] > 1000
    assert counts[Cause.DOUBLE_BOUNCE] > 0


def test_groups_that_meet_between_the_ends_of_a_step_do_not_accuse_exact() -> None:
    """At 2.05 s two balls of the dense gas graze each other on their ways after other contacts of the step."""
    counts = causes("gas-dense", "exact", 3.2)
    assert counts[Cause.UNKNOWN] <= 3  # groups of more than 256 balls, at the start


STEP: Final = """
import numpy as np

def step(position, velocity, dt, scene):
    radius, size = scene.bodies.radius, scene.arena.size
    velocity += dt * np.array(scene.gravity)
    position += velocity * dt
    for i in range(len(position)):
        for axis in (0, 1):
            low, high = radius[i], size[axis] - radius[i]
            if not low <= position[i, axis] <= high:
                goes_out = (position[i, axis] > high) == (velocity[i, axis] > 0)
                position[i, axis] = min(max(position[i, axis], low), high)
                velocity[i, axis] *= -{bounce} if goes_out else 1
    for i in {order}(range(len(position))):
        for j in {order}(range(i + 1, len(position))):
            way = position[j] - position[i]
            distance, reach = (way @ way) ** 0.5, radius[i] + radius[j]
            normal = way / distance
            closing = (velocity[i] - velocity[j]) @ normal
            if distance < reach and closing > 0:
                velocity[i] -= {share} * closing * normal
                velocity[j] += {share} * closing * normal
            if distance < reach:
                position[i] -= (reach - distance) / 2 * normal
                position[j] += (reach - distance) / 2 * normal
"""

HEAP: Final = """
seconds = 0.8
gravity = [0, 900]

[arena]
size = [320, 300]
elasticity = 0.5

[[balls]]
count = 40
radius = 16
speed = 80
elasticity = 0.7
inside = [[16, 16], [304, 284]]
"""


@pytest.mark.parametrize(
    ("share", "says"), [(1.0, "found"), (0.8, "0.8 of what is due"), (1.1, "1.1 times what is due")]
)
def test_a_loop_of_ones_own_breaks_a_rack(tmp_path: Path, share: float, says: str) -> None:
    (tmp_path / "loop.py").write_text(STEP.format(share=share, order="list", bounce=1))
    spec = f"{tmp_path / 'loop.py'}:step"
    run = sandbox.compare(load("break-shot").changed(seconds=1.5, expect=()), [spec, "exact"]).runs[spec]
    assert says in run.suffered[0].because
    assert run.suffered[0].share > 0.9


def test_the_order_of_contacts_is_found_in_a_rack_alone(tmp_path: Path) -> None:
    """Up to 0.65 s, no ball has left the rack: no contact of two balls shows which rule the loop has."""
    (tmp_path / "loop.py").write_text(STEP.format(share=1.0, order="reversed", bounce=1))
    spec = f"{tmp_path / 'loop.py'}:step"
    run = sandbox.compare(load("break-shot").changed(seconds=0.65, expect=()), [spec, "exact"]).runs[spec]
    assert run.suffered[0].cause == Cause.LATE
    assert Cause.UNKNOWN not in {suffered.cause for suffered in run.suffered}


def test_a_heap_of_sixty_balls_is_found_late_whether_its_exact_step_is_known_or_not() -> None:
    """Where it is not, as balls are deep in each other, no figure says how much of the energy is wrong."""
    scene = load("pile").changed(seconds=1.1, expect=())
    runs = sandbox.compare(scene, ["impulse", "exact"]).runs
    worst = runs["impulse"].suffered[0]
    assert worst.cause == Cause.LATE
    assert worst.share > 0.98
    energies = {name: {entry.cause: entry.energy for entry in run.figures.ledger} for name, run in runs.items()}
    assert energies["impulse"][Cause.LATE] != 0
    assert energies["impulse"][Cause.UNKNOWN] != 0
    assert abs(energies["exact"][Cause.UNKNOWN]) < 0.02 * runs["exact"].energy_scale


@pytest.mark.parametrize(("share", "says"), [(1.0, "found late"), (0.8, "The impulse is 0.8 of what is due.")])
def test_a_loop_of_ones_own_lets_a_heap_fall(tmp_path: Path, share: float, says: str) -> None:
    """Of two with 0.7 of elasticity each, half of 1 + 0.7² is due."""
    due = (1 + 0.7**2) / 2
    (tmp_path / "loop.py").write_text(STEP.format(share=share * due, order="list", bounce=0.7 * 0.5))
    (tmp_path / "heap.toml").write_text(HEAP)
    spec = f"{tmp_path / 'loop.py'}:step"
    run = sandbox.compare(load(tmp_path / "heap.toml"), [spec, "exact"]).runs[spec]
    assert says in run.suffered[0].because
    assert run.suffered[0].share > 0.95
