"""Contacts of bodies that gravity holds together: they bear a weight, and are no bounces."""

import math
from typing import Final

from sandbox.analysis.findings import (
    Block,
    SceneConstants,
    enter,
    pair_constants,
)
from sandbox.compiled import Record, kernel
from sandbox.judge.causes import NEGLIGIBLE, Cause

BOUNCED: Final = 0.75  # of the speed that gravity gives in a flight: more than that was not a bounce before it


@kernel
def _keeps_its_place(constants: SceneConstants, block: Block, k: int, contact: Record) -> bool:
    """Return whether two bodies of a heap, with other contacts at the same time, do not move apart or round in a step.

    Contacts that bear a heap's weight do so together, and mean nothing one after another. Two that bounce in the middle
    of a step are in the same place after it too, but have moved further until then than gravity moves what rests.
    """
    _, _, _, reach = pair_constants(constants, contact)
    before, after, met = block.line_before[k], block.line_after[k], block.line[k]
    slight = NEGLIGIBLE * reach
    fallen = math.hypot(constants.fall[0], constants.fall[1]) * constants.dt**2
    keeps = math.hypot(after[0] - before[0], after[1] - before[1]) <= slight
    keeps = keeps and math.hypot(met[0] - before[0], met[1] - before[1]) <= fallen + slight
    return bool(keeps and block.crowded[k] and not constants.together)


@kernel
def is_at_rest(constants: SceneConstants, block: Block, k: int, contact: Record, finding: Record) -> bool:
    """Return whether gravity holds two bodies together: they meet again shortly, and part, by no more than its pull.

    A ball that left a wall and came back on its parabola meets it at half of that speed: that is a bounce, unless it is
    found late.
    """
    nx, ny = contact.normal[0], contact.normal[1]
    pull, bounced = math.hypot(constants.fall[0], constants.fall[1]), 0.0
    if pull > 0 and _keeps_its_place(constants, block, k, contact):
        return True
    if contact.second < 0:
        pull = abs(constants.fall[0] * nx + constants.fall[1] * ny)
        if finding.depth <= NEGLIGIBLE * constants.radius[contact.first]:
            bounced = BOUNCED * pull * finding.free_flight
    shortly: bool = finding.free_flight <= constants.traced * (1 + NEGLIGIBLE)
    slow = 2 * pull * constants.dt * (1 + NEGLIGIBLE)
    least = bounced if bounced > 0 else -NEGLIGIBLE * slow
    return shortly and pull > 0 and least <= finding.approach <= slow and abs(finding.approach_after) <= slow


@kernel
def enter_rest(block: Block, k: int, energy: float) -> None:
    """Enter what a contact at rest takes with what gravity gives in each step: the two lines would only cancel out."""
    enter(block, Cause.GRAVITY, energy, 0.0, 0.0)
    block.timing[k] = Cause.GRAVITY


@kernel
def enter_friction_at_rest(
    constants: SceneConstants,
    block: Block,
    contact: Record,
    finding: Record,
    tangential: float,
    energy: float,
    mass: float,
) -> None:
    """Enter the friction of a contact at rest, which gravity pulled at as long as friction acted.

    Its heat is that of the mean slip; the rest of the energy (kg px²/s²) goes with what gravity gives in each step.
    """
    along = 0.0
    if contact.second < 0:
        along = constants.fall[1] * contact.normal[0] - constants.fall[0] * contact.normal[1]
    slipped = finding.slip - along * min(finding.free_flight, constants.dt) / 2 - 3 * tangential / (2 * mass)
    heat = min(-tangential * slipped, 0.0)
    enter(block, Cause.FRICTION, heat, 0.0, 0.0)
    enter(block, Cause.GRAVITY, energy - heat, 0.0, 0.0)
