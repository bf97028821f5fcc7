"""What a contact changed, and the cause of each part of that change.

Symbols: n is the unit normal from the first body to the second, u the speed at which the two approach along n, e their
elasticity, μ = 1 / (1/m_i + 1/m_j), J an impulse, g gravity, t (as an index) the time of first touch. An impulse J
changes the energy by J²/2μ - J u.

What a contact should have done follows from the scene and from the flight of its two bodies, which is traced back to
the time at which they touched.

- An engine that finds a contact late sees the balls overlap, and a normal that has turned. At first touch the impulse
  is J_t = (1 + e) μ u_t along n_t; where the contact was found it is (1 + e) μ u along n. The expected impulse is the
  one nearer to the engine's own; the rest is an error of the impulse.
- A contact found in time changes velocities only. One found τ late should also move the balls by τ J_t / m, to where
  they would be by now; engines push them apart or put them back on a wall instead.
- Solvers that resolve all contacts of a step together (`together`, see `sandbox.engines`) have no expected impulse for
  each contact before all are resolved. There each contact changes the energy by -J (u + u') / 2, with the speeds before
  and after; these terms add up.
"""

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.analysis.causes import NEGLIGIBLE, Cause
from sandbox.compiled import Record, kernel
from sandbox.state import Floats, Integers

MAX_TRACE_STEPS: Final = 3.0  # steps over which a contact is traced back at most

FINDING: Final = np.dtype(
    [
        ("cause", "i8"),  # of the contact's largest error; ROUNDING if it has none
        ("momentum_error", "f8"),  # kg px/s between the momentum that it moved and what it should have moved
        ("displacement_error", "f8"),  # px between where it put the balls and where they should be
        ("approach", "f8"),  # px/s along the normal as found, negative if the two separate
        ("approach_after", "f8"),  # px/s
        ("expected_impulse", "f8"),  # kg px/s
        ("delay", "f8"),  # s since the two touched, negative if they have not touched yet
        ("normal_error", "f8"),  # rad from the normal of first touch to the normal as found
        ("free_flight", "f8"),  # s that both had flown undisturbed, at most MAX_TRACE_STEPS
        ("before", "f8", (2, 2)),  # px/s of first and second
        ("after", "f8", (2, 2)),  # px/s of first and second
    ]
)
Findings = NDArray[np.void]


class SceneConstants(NamedTuple):
    """A scene's balls and walls. wall: (m, 4), direction of the segment, half the thickness (px), elasticity."""

    radius: Floats
    mass: Floats
    elasticity: Floats
    wall: Floats
    gravity: tuple[float, float]
    dt: float
    together: bool
    has_friction: bool


class Block(NamedTuple):
    """Where the changes of a block of steps are entered.

    energy, momentum, displacement, contacts: (causes,), sums over all blocks so far; findings: (contacts,) FINDING;
    expected_shift: (contacts, 2) kg px, mass times the displacement that a contact in time would have given; timing:
    (contacts,), the cause that each contact's time was attributed to.
    """

    energy: Floats
    momentum: Floats
    displacement: Floats
    contacts: Floats
    findings: Findings
    expected_shift: Floats
    timing: Integers


@kernel
def _root(square: float) -> float:
    """Return the square root of a number; 0 if rounding has made it slightly negative."""
    return math.sqrt(max(square, 0.0))


@kernel
def _first_touch(x: float, y: float, wx: float, wy: float, reach: float) -> tuple[float, float, float]:
    """Return how long ago (s) two bodies were `reach` px apart, and the unit normal then.

    (x, y): px from the first to the second; (wx, wy): px/s at which they approach. The time is negative if they have
    not touched yet. For bodies that will miss each other it is the time of closest approach.
    """
    square = wx * wx + wy * wy
    nearest = (x * wx + y * wy) / square
    aside_x, aside_y = x - nearest * wx, y - nearest * wy
    ago = _root((reach * reach - aside_x * aside_x - aside_y * aside_y) / square) - nearest
    nx, ny = x + ago * wx, y + ago * wy
    distance = math.hypot(nx, ny)
    return ago, nx / distance, ny / distance


@kernel
def _first_touch_of_face(depth: float, speed: float, acceleration: float) -> tuple[float, float]:
    """Return how long ago a ball, now `depth` deep in a face, touched it, and its speed then (px, px/s, px/s²)."""
    then = _root(speed * speed - 2 * acceleration * depth)
    return 2 * depth / (speed + then), then


@kernel
def enter(block: Block, cause: int, energy: float, momentum: float, displacement: float) -> None:
    """Add a change to the sums of its cause."""
    block.energy[cause] += energy
    block.momentum[cause] += momentum
    block.displacement[cause] += displacement
    if momentum > 0 or displacement > 0:
        block.contacts[cause] += 1


@kernel
def _pair_constants(constants: SceneConstants, contact: Record) -> tuple[float, float, float, float]:
    """Return elasticity, both inverse masses, and the distance at which the two touch."""
    i, j = contact.first, contact.second
    if j >= 0:
        e, reach = constants.elasticity[i] * constants.elasticity[j], constants.radius[i] + constants.radius[j]
        return e, 1 / constants.mass[i], 1 / constants.mass[j], reach
    e, reach = constants.elasticity[i] * constants.wall[~j, 3], constants.radius[i] + constants.wall[~j, 2]
    return e, 1 / constants.mass[i], 0.0, reach


@kernel
def _trace_back(
    constants: SceneConstants, contact: Record, finding: Record, reach: float
) -> tuple[float, float, float, float]:
    """Trace a contact back to first touch; return its delay, and the speed of approach and the normal at that time.

    Bodies that overlapped before the last contact of either did not come to overlap in this flight; their contact
    counts as found in time.
    """
    nx, ny = contact.normal[0], contact.normal[1]
    wx, wy = finding.before[0, 0] - finding.before[1, 0], finding.before[0, 1] - finding.before[1, 1]
    j = contact.second
    if j < 0 and abs(constants.wall[~j, 0] * nx + constants.wall[~j, 1] * ny) < NEGLIGIBLE:
        acceleration = constants.gravity[0] * nx + constants.gravity[1] * ny
        delay, speed = _first_touch_of_face(contact.depth, finding.approach, acceleration)
        in_flight = delay <= finding.free_flight * (1 + NEGLIGIBLE)
        return (delay, speed, nx, ny) if in_flight else (0.0, finding.approach, nx, ny)
    apart = reach - contact.depth
    delay, tx, ty = _first_touch(apart * nx, apart * ny, wx, wy, reach)
    if delay > finding.free_flight * (1 + NEGLIGIBLE):
        return 0.0, finding.approach, nx, ny
    return delay, max(wx * tx + wy * ty, 0.0), tx, ty


@kernel
def attribute_single(constants: SceneConstants, block: Block, k: int, contact: Record) -> None:
    """Attribute what a contact that was resolved by itself did to energy and momentum."""
    finding = block.findings[k]
    e, per_i, per_j, reach = _pair_constants(constants, contact)
    mu, u, impulse = 1 / (per_i + per_j), finding.approach, contact.impulse
    energy = impulse * (impulse / (2 * mu) - u)
    if u <= 0:
        cause = Cause.STALE if constants.together else Cause.TURNED if contact.second < 0 else Cause.LARGE
        if impulse == 0:
            cause = Cause.ROUNDING
        finding.cause, finding.momentum_error = cause, abs(impulse)
        enter(block, cause, energy, finding.momentum_error, 0.0)
        return
    delay, u_t, tx, ty = _trace_back(constants, contact, finding, reach)
    nx, ny = contact.normal[0], contact.normal[1]
    as_found, at_touch = (1 + e) * mu * u, (1 + e) * mu * u_t
    expected = at_touch if abs(impulse - at_touch) < abs(impulse - as_found) else as_found
    by_elasticity = -(1 - e * e) * mu * u_t * u_t / 2
    energy_expected = expected * (expected / (2 * mu) - u)
    finding.expected_impulse, finding.delay = expected, delay
    finding.normal_error = math.atan2(abs(nx * ty - ny * tx), nx * tx + ny * ty)
    block.expected_shift[k, 0], block.expected_shift[k, 1] = delay * at_touch * tx, delay * at_touch * ty

    # If gravity pulls a ball to a wall, the speed at which it meets the wall is known only to within one step's pull.
    step_pull = abs(constants.gravity[0] * nx + constants.gravity[1] * ny) * constants.dt if contact.second < 0 else 0.0
    impulse_error = abs(impulse - expected)
    if impulse < 0 and constants.together:
        cause = Cause.STALE
    elif impulse_error <= NEGLIGIBLE * expected:
        cause = Cause.ROUNDING
    elif impulse_error <= (1 + e) * mu * step_pull * (1 + NEGLIGIBLE):
        cause = Cause.GRAVITY
    else:
        cause = Cause.SMALL if impulse < expected else Cause.LARGE
    timing_error = math.hypot(expected * nx - at_touch * tx, expected * ny - at_touch * ty)
    timing = Cause.ROUNDING if timing_error <= NEGLIGIBLE * at_touch else Cause.LATE if delay > 0 else Cause.EARLY
    if u <= 2 * step_pull and cause != Cause.ROUNDING:  # at rest: the wall takes what gravity gives in each step
        timing, by_elasticity, energy_expected = Cause.GRAVITY, 0.0, energy
    block.timing[k] = timing
    is_error = cause not in (Cause.ROUNDING, Cause.GRAVITY)
    is_mistimed = timing in (Cause.LATE, Cause.EARLY)
    enter(block, Cause.ELASTICITY, by_elasticity, 0.0, 0.0)
    enter(block, cause, energy - energy_expected, impulse_error if is_error else 0.0, 0.0)
    enter(block, timing, energy_expected - by_elasticity, timing_error if is_mistimed else 0.0, 0.0)
    finding.momentum_error = math.hypot(impulse * nx - at_touch * tx, impulse * ny - at_touch * ty)
    finding.cause = cause if impulse_error >= timing_error and cause != Cause.GRAVITY else timing


@kernel
def attribute_simultaneous(constants: SceneConstants, block: Block, k: int, contact: Record) -> None:
    """Attribute what one of several contacts that share balls and were resolved together did."""
    finding = block.findings[k]
    e, per_i, per_j, reach = _pair_constants(constants, contact)
    mu, u, impulse = 1 / (per_i + per_j), finding.approach, contact.impulse
    by_elasticity = -impulse * (1 - e) * u / 2 if impulse > 0 else 0.0
    nx, ny = contact.normal[0], contact.normal[1]
    step_pull = abs(constants.gravity[0] * nx + constants.gravity[1] * ny) * constants.dt
    impulse_error = mu * abs(finding.approach_after + e * u)
    if impulse < 0:
        cause = Cause.STALE
    elif impulse_error <= NEGLIGIBLE * mu * abs(u):
        cause = Cause.ROUNDING
    elif contact.second < 0 and impulse_error <= (1 + e) * mu * step_pull * (1 + NEGLIGIBLE):
        cause = Cause.GRAVITY
    else:
        cause = Cause.UNCONVERGED
    is_error = cause in (Cause.STALE, Cause.UNCONVERGED)
    enter(block, Cause.ELASTICITY, by_elasticity, 0.0, 0.0)
    energy_error = -impulse * (u + finding.approach_after) / 2 - by_elasticity
    enter(block, cause, energy_error, impulse_error if is_error else 0.0, 0.0)
    finding.cause, finding.momentum_error, finding.expected_impulse = cause, impulse_error, impulse
    if u <= (2 * step_pull if contact.second < 0 else 0):
        return
    delay, _, tx, ty = _trace_back(constants, contact, finding, reach)
    finding.delay, finding.normal_error = delay, math.atan2(abs(nx * ty - ny * tx), nx * tx + ny * ty)
    timing_error = abs(impulse) * math.hypot(nx - tx, ny - ty)
    timing = Cause.LATE if delay > 0 else Cause.EARLY
    if finding.normal_error > NEGLIGIBLE:
        enter(block, timing, 0.0, timing_error, 0.0)
        if timing_error > impulse_error:
            finding.cause, finding.momentum_error = timing, timing_error
    block.timing[k] = timing
    block.expected_shift[k, 0], block.expected_shift[k, 1] = delay * impulse * tx, delay * impulse * ty


@kernel
def attribute_displacement(
    constants: SceneConstants, block: Block, k: int, contact: Record, unexplained: Floats, last: Integers
) -> None:
    """Attribute how a contact displaced its balls.

    unexplained: (n, 2) px, each ball's displacement that has no cause yet; last: (n,) each ball's last contact.
    """
    finding, nx, ny = block.findings[k], contact.normal[0], contact.normal[1]
    energy = energy_expected = put_back = finding.displacement_error = 0.0
    for side in range(2):
        ball = contact.first if side == 0 else contact.second
        if ball < 0:
            continue
        sign = 1 - 2 * side
        x, y = unexplained[ball, 0], unexplained[ball, 1]
        if last[ball] != k:
            along = x * nx + y * ny
            x, y = along * nx, along * ny
        unexplained[ball, 0] -= x
        unexplained[ball, 1] -= y
        expected_x = -sign * block.expected_shift[k, 0] / constants.mass[ball]
        expected_y = -sign * block.expected_shift[k, 1] / constants.mass[ball]
        energy -= constants.mass[ball] * (constants.gravity[0] * x + constants.gravity[1] * y)
        energy_expected -= constants.mass[ball] * (
            constants.gravity[0] * expected_x + constants.gravity[1] * expected_y
        )
        finding.displacement_error += math.hypot(x - expected_x, y - expected_y)
        put_back -= sign * (x * nx + y * ny)
    error = finding.displacement_error
    if error <= NEGLIGIBLE * constants.radius[contact.first]:
        cause = Cause.ROUNDING
    elif error <= math.hypot(constants.gravity[0], constants.gravity[1]) * constants.dt * constants.dt:
        cause = Cause.GRAVITY
    elif contact.second >= 0:
        cause = Cause.PUSHED
    else:
        cause = Cause.OVERSHOOT if put_back > contact.depth / 2 else Cause.LATE
    is_error = cause not in (Cause.ROUNDING, Cause.GRAVITY)
    enter(block, block.timing[k], energy_expected, 0.0, 0.0)
    enter(block, cause, energy - energy_expected, 0.0, error if is_error else 0.0)
    if finding.cause in (Cause.ROUNDING, Cause.GRAVITY):
        finding.cause = cause
