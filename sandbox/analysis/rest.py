"""Contacts of bodies that gravity holds together: they bear a weight, and are no bounces."""

import math
from typing import Final

from sandbox.analysis.causes import NEGLIGIBLE, Cause
from sandbox.analysis.findings import MAX_TRACE_STEPS, Block, SceneConstants, enter, pair_constants
from sandbox.compiled import Record, kernel

BOUNCED: Final = 0.75  # of the speed that gravity gives in a flight: more than that was not a bounce before it


@kernel
def _keeps_its_place(constants: SceneConstants, block: Block, k: int, contact: Record) -> bool:
    """Return whether two bodies of a heap, with other contacts at the same time, do not move apart or round in a step.

    Contacts that bear a heap's weight do so together, and mean nothing one after another.
    """
    _, _, _, reach = pair_constants(constants, contact)
    x, y = block.line_after[k, 0] - block.line_before[k, 0], block.line_after[k, 1] - block.line_before[k, 1]
    return bool(block.crowded[k] and not constants.together and math.hypot(x, y) <= NEGLIGIBLE * reach)


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
    shortly: bool = finding.free_flight <= MAX_TRACE_STEPS * constants.dt * (1 + NEGLIGIBLE)
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
