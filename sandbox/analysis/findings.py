"""What is found about the contacts of a block of steps, and what that follows from: arrays, and sums by cause."""

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.compiled import Record, kernel
from sandbox.engines.walls import ARENA_COUNT
from sandbox.judge.causes import Cause
from sandbox.scene.model import Scene
from sandbox.state import Bools, Contacts, Floats, Integers

MAX_TRACE_STEPS: Final = 3.0  # steps over which a contact is traced back at most
NO_ERROR: Final = (Cause.ROUNDING, Cause.GRAVITY, Cause.DAMPING)  # causes that are not a contact's own
FINDING: Final = np.dtype(
    [
        ("cause", "i8"),  # of the contact's largest error; ROUNDING if it has none
        ("momentum_error", "f8"),  # kg px/s between the momentum that it moved and what it should have moved
        ("displacement_error", "f8"),  # px from where it put a ball to where that should be, the larger of both
        ("approach", "f8"),  # px/s along the normal as found, negative if the two separate
        ("approach_after", "f8"),  # px/s
        ("expected_impulse", "f8"),  # kg px/s
        ("delay", "f8"),  # s since the two touched, negative if they have not touched yet
        ("normal_error", "f8"),  # rad from the normal of first touch to the normal as found
        ("touch", "f8", (2,)),  # the normal of first touch, from first to second; zeros if it is not known
        ("turned", "f8"),  # rad from the line of centres to the normal along which the impulse acted
        ("depth", "f8"),  # px, overlap when it was found: as reported, or as the places show if they contradict
        ("gap", "f8"),  # px that the two were apart, if that is too far to have met; else 0
        ("unexplained", "f8", (2, 2)),  # px/s by which both velocities changed besides the only impulse
        ("free_flight", "f8"),  # s that both had flown undisturbed
        ("before", "f8", (2, 2)),  # px/s of first and second
        ("after", "f8", (2, 2)),  # px/s of first and second
        ("slip", "f8"),  # px/s of the first's rim past the second's, along the tangent
        ("slip_after", "f8"),  # px/s
        ("tangential", "f8"),  # kg px/s along the tangent, as reported, or as the velocities show if it is not reported
        ("expected_tangential", "f8"),  # kg px/s
        ("spin_error", "f8", (2,)),  # rad/s by which both spins changed besides the friction of the only contact
        ("spin_before", "f8", (2,)),  # rad/s of first and second
        ("spin_after", "f8", (2,)),  # rad/s of first and second
        ("rests", "?"),  # whether gravity holds the two together, and the contact only bears the weight
    ]
)
Findings = NDArray[np.void]


class SceneConstants(NamedTuple):
    """A scene's balls and walls, and an engine's flight.

    wall: (m, 7), direction of the segment, half the thickness (px), elasticity, start (px), length (px);
    gravity: px/s²; fall: px/s², what pulls at the balls in this engine's flight: gravity, unless the engine errs;
    together, infers, sums: the engine's traits `together`, `infers_impulses` and `sums_impacts`; centre: px, of the
    arena; substeps: of a step. Of one step: dt: s, its length; traced: s, by which a contact is traced back at most;
    left: the share of velocities and spins that the engine's damping leaves after each substep.
    """

    radius: Floats
    mass: Floats
    elasticity: Floats
    wall: Floats
    gravity: tuple[float, float]
    fall: tuple[float, float]
    together: bool
    infers: bool
    sums: bool
    centre: tuple[float, float]
    substeps: int
    dt: float = 0.0
    traced: float = 0.0
    left: float = 1.0


class StepLengths(NamedTuple):
    """What `SceneConstants` has of one step, of each of a block's: (steps,)."""

    dt: Floats
    traced: Floats
    left: Floats


@kernel
def of_step(constants: SceneConstants, lengths: StepLengths, step: int) -> SceneConstants:
    """Return the constants of a step, counted from 1 in its block."""
    return SceneConstants(
        constants.radius,
        constants.mass,
        constants.elasticity,
        constants.wall,
        constants.gravity,
        constants.fall,
        constants.together,
        constants.infers,
        constants.sums,
        constants.centre,
        constants.substeps,
        lengths.dt[step - 1],
        lengths.traced[step - 1],
        lengths.left[step - 1],
    )


class Unexplained(NamedTuple):
    """What the contacts of a step leave unexplained of each ball.

    velocity: (n, 2) px/s; place: (n, 2) px; spin: (n,) rad/s; cause, spin_cause: (n,) of the velocity and the spin;
    owner: (n,) the contact that the velocity belongs to, or -1; unsteady: (n, 3), how much of velocity, place and speed
    of the rim there was in the ball's last step without a contact, px/s, px and px/s; flown:
    (n,), whether it had one: before, the most of all balls without a contact in this step counts; contacts:
    (n,) in the step; partner: (n,) what the ball last touched, a ball or ~wall; room: (n,) px, the sum of the depths of
    the ball's contacts in the step.
    """

    velocity: Floats
    place: Floats
    spin: Floats
    cause: Integers
    spin_cause: Integers
    owner: Integers
    unsteady: Floats
    flown: Bools
    contacts: Integers
    partner: Integers
    room: Floats


class Block(NamedTuple):
    """Where the changes of a block of steps are entered.

    energy, momentum, displacement, contacts: (causes,), sums over all blocks so far; findings: (contacts,) FINDING;
    expected_shift: (contacts, 2) kg px, mass times the displacement that a contact in time would have given; timing:
    (contacts,), the cause that each contact's time was attributed to; line: (contacts, 2) px from the first to the
    second, as flown; line_before, line_after: the same at the start and the end of the step; shared: (contacts,),
    whether it was resolved together with another of its balls; crowded: (contacts,), whether one of its balls has
    another contact at the same time; friction: (contacts,), the product of its two factors; rescaled: (contacts,),
    whether its impulse is only what a change of dt left of an earlier one.
    """

    energy: Floats
    momentum: Floats
    displacement: Floats
    contacts: Floats
    findings: Findings
    expected_shift: Floats
    timing: Integers
    line: Floats
    line_before: Floats
    line_after: Floats
    shared: Bools
    crowded: Bools
    friction: Floats
    rescaled: Bools


def pair_friction(scene: Scene, contacts: Contacts) -> Floats:
    """Return the friction of each contact, the product of the two factors: (contacts,)."""
    walls = [scene.arena.friction] * ARENA_COUNT + [wall.friction for wall in scene.walls]
    factors = np.concatenate([scene.bodies.friction, walls[::-1]])  # so that wall w is number ~w
    product: Floats = factors[contacts["first"]] * factors[contacts["second"]]
    return product


@kernel
def enter(block: Block, cause: int, energy: float, momentum: float, displacement: float) -> None:
    """Add a change to the sums of its cause."""
    block.energy[cause] += energy
    block.momentum[cause] += momentum
    block.displacement[cause] += displacement
    if momentum > 0 or displacement > 0:
        block.contacts[cause] += 1


@kernel
def pair_constants(constants: SceneConstants, contact: Record) -> tuple[float, float, float, float]:
    """Return elasticity, both inverse masses, and the distance at which the two touch."""
    i, j = contact.first, contact.second
    if j >= 0:
        e, reach = constants.elasticity[i] * constants.elasticity[j], constants.radius[i] + constants.radius[j]
        return e, 1 / constants.mass[i], 1 / constants.mass[j], reach
    e, reach = constants.elasticity[i] * constants.wall[~j, 3], constants.radius[i] + constants.wall[~j, 2]
    return e, 1 / constants.mass[i], 0.0, reach


@kernel
def line_to_wall(constants: SceneConstants, w: int, x: float, y: float) -> tuple[float, float]:
    """Return the vector from a point to a wall's centre line, or to a face of the arena, px."""
    wall = constants.wall[w]
    along = (x - wall[4]) * wall[0] + (y - wall[5]) * wall[1]
    if w >= ARENA_COUNT:
        along = min(max(along, 0.0), wall[6])
    return wall[4] + along * wall[0] - x, wall[5] + along * wall[1] - y


@kernel
def give_impulse(constants: SceneConstants, contact: Record, velocity: Floats) -> None:
    """Change the velocities of a contact's bodies, (n, 2) px/s, by the impulse that it reports, with friction."""
    for axis in range(2):
        along = contact.normal[0] if axis == 1 else -contact.normal[1]
        push = contact.impulse * contact.normal[axis] + contact.tangential * along
        velocity[contact.first, axis] -= push / constants.mass[contact.first]
        if contact.second >= 0:
            velocity[contact.second, axis] += push / constants.mass[contact.second]


@kernel
def sum_unsteady(unexplained: Unexplained, contact: Record, what: int) -> float:
    """Return the sum of what changed untold of both bodies in their last flight: 0, px/s, or 1, px."""
    total: float = unexplained.unsteady[contact.first, what]
    if contact.second >= 0:
        total += unexplained.unsteady[contact.second, what]
    return total


@kernel
def sum_unowned(unexplained: Unexplained, k: int, contact: Record) -> float:
    """Return the sum of what changed of both velocities in the step of contact k, but not by it, px/s."""
    total = 0.0
    for side in range(2):
        ball = contact.first if side == 0 else contact.second
        if ball >= 0 and unexplained.cause[ball] != Cause.ROUNDING and unexplained.owner[ball] != k:
            total += math.hypot(unexplained.velocity[ball, 0], unexplained.velocity[ball, 1])
    return total


@kernel
def turn_energy(constants: SceneConstants, ball: int, spin: float, change: float) -> float:
    """Return the energy (kg px²/s²) that a ball gains if its spin changes (rad/s)."""
    energy: float = constants.mass[ball] * constants.radius[ball] ** 2 / 2 * change * (spin + change / 2)
    return energy
