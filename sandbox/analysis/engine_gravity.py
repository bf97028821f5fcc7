"""What pulls at the balls of an engine in flight, read from its states."""

from typing import Final

import numpy as np

from sandbox.judge.causes import NEGLIGIBLE
from sandbox.quantity import length
from sandbox.scene.model import Scene
from sandbox.state import Contacts, Damping, Floats, Integers

MIN_SHARE_RIGHT: Final = 0.1  # of the balls' steps in flight that are right, for which gravity is
MIN_SHARE_ALIKE: Final = 0.4  # of them that have the same error, for which it is gravity's
MIN_FLIGHTS: Final = 8  # steps of balls in flight, from which another gravity than the scene's is read


def engine_gravity(
    scene: Scene,
    damping: Damping,
    dt: Floats,
    position: Floats,
    velocity: Floats,
    contacts: Contacts,
    step_of: Integers,
) -> tuple[Floats, Floats] | None:
    """Return what pulls at balls in flight, and how far they are off its parabola, as in `Flights`: (2,) px/s² each.

    Gravity does the same to all balls in all steps. What differs from ball to ball, or from step to step, is not
    gravity's; nor is a displacement along gravity that no integration of it in steps gives: it gives half a step's fall
    too much or too little, or with substeps a whole part of that. A step after a contact does not count: in it, a
    solver may still push the balls apart. dt: (steps,) s. Returns None if no ball flies in the block.
    """
    gravity, still = np.array(scene.gravity, float), np.zeros(2)
    if not gravity.any():
        return gravity, still
    flying = np.ones((len(position) - 1, position.shape[1]), bool)
    between = contacts["second"] >= 0
    for step in (step_of, np.minimum(step_of + 1, len(flying))):
        flying[step - 1, contacts["first"]] = False
        flying[step[between] - 1, contacts["second"][between]] = False
    steps, balls = np.nonzero(flying)
    if not len(steps):
        return None
    before, dt, g = velocity[:-1][steps, balls], dt[steps, None], float(np.hypot(*gravity))
    fall = g * dt
    sped = (np.diff(velocity, axis=0)[steps, balls] - gravity * dt) / fall
    moved = (np.diff(position, axis=0)[steps, balls] - before * dt - gravity * dt * dt / 2) / (fall * dt)
    if damping.per_second < 1:
        slowed, behind = _damped_flight(before, gravity, dt, damping)
        sped, moved = sped - slowed / fall, moved - behind / (fall * dt)
    slight = 1e-7 + NEGLIGIBLE * length(before) / fall[:, 0]
    if _share(sped, still, slight) * _share(moved, still, slight) > MIN_SHARE_RIGHT:
        return gravity, still
    faster, off = np.median(sped, axis=0), np.median(moved, axis=0)
    unaltered, alike = (_share(sped, value, slight) for value in (still, faster))
    if unaltered > MIN_SHARE_ALIKE or alike < MIN_SHARE_ALIKE or len(steps) < MIN_FLIGHTS:
        faster = still
    off -= faster / 2
    off_alike = _share(moved - faster / 2, off, slight) >= MIN_SHARE_ALIKE
    if faster.any() and not off_alike:
        return gravity, still
    if not off_alike or not _is_integration(off, gravity):
        off = still
    return gravity + faster * g, off * g


def _damped_flight(velocity: Floats, gravity: Floats, dt: Floats, damping: Damping) -> tuple[Floats, Floats]:
    """Return by how much damping changes velocities and places in a step of flight, (k, 2) px/s and px.

    velocity: (k, 2) px/s, before the step; gravity: (2,) px/s²; dt: (k, 1) s.
    """
    slowed, behind, substep = np.zeros_like(velocity), np.zeros_like(velocity), dt / damping.substeps
    left = damping.per_second**substep
    for k in range(damping.substeps):
        behind += slowed * substep
        slowed = left * slowed - (1 - left) * (velocity + k * substep * gravity)
    return slowed, behind


def _share(values: Floats, value: Floats, slight: Floats) -> float:
    """Return the fraction of some vectors (k, 2) that are no further from another than slight (k,)."""
    return float(np.mean(length(values - value) <= slight))


def _is_integration(off: Floats, gravity: Floats) -> bool:
    """Return whether integrating gravity in steps gives a displacement (2,), in units of gravity times dt²."""
    size = float(np.hypot(*off))
    if size <= NEGLIGIBLE:
        return False
    substeps = 1 / (2 * size)
    aside = abs(off[0] * gravity[1] - off[1] * gravity[0]) / float(np.hypot(*gravity))
    return aside <= NEGLIGIBLE * size + 1e-7 and abs(substeps - round(substeps)) <= 1e-4 * substeps
