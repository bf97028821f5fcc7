"""What a contact changed, and the cause of each part of that change.

Symbols: n is the unit normal from the first body to the second, u the speed at which the two approach along n, e their
elasticity, μ = 1 / (1/m_i + 1/m_j), J an impulse, g gravity, t (as an index) the time of first touch. An impulse J
changes the energy by J²/2μ - J u. Friction is along the tangent (-n_y, n_x): J_t is its impulse, s the slip of one rim
past the other, and f the product of both factors. J_t changes the energy by 3 J_t²/2μ - J_t s, because discs turn.

What a contact should have done follows from the scene and from the flight of its two bodies, which is traced back to
the time at which they touched.

- An engine that finds a contact late sees the balls overlap, and a normal that has turned. At first touch the impulse
  is J_t = (1 + e) μ u_t along n_t; where the contact was found it is (1 + e) μ u along n. The expected impulse is the
  one nearer to the engine's own; the rest is an error of the impulse.
- A contact found in time changes velocities only. One found τ late should also move the balls by τ J / m, to where
  they would be by now; engines push them apart or put them back on a wall instead.
- The line of centres follows from the places before the step and the flight since. A reported normal that is turned
  against it, or an impulse that acted along another, is an error of the normal; what else the velocities and spins
  changed by in the step of a contact is an error of the velocities, or friction if the pair has some.
- Friction should be s μ/3, which stops the slip, but no more than f J (Coulomb's law; O. R. Walton and R. L. Braun,
  J. Rheol. 30 (1986) 949, with beta_0 = 0): with the engine's own J and the slip as it found it, so that neither a late
  contact nor a wrong impulse is an error of friction too. Of several contacts that share a ball at one time, friction
  is not unique, and none of them is judged.
- What changes in flight (`unsteady`) bounds what is known about a contact: an error of that size is not the contact's.
- Solvers that resolve all contacts of a step together (`together`, see `sandbox.engines`) have no expected impulse for
  each contact before all are resolved. There each contact changes the energy by -J (u + u') / 2, with the speeds before
  and after; these terms add up. If the impulses are inferred, and have friction, they are not unique.
"""

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.analysis.causes import NEGLIGIBLE, Cause
from sandbox.compiled import Record, kernel
from sandbox.engines.walls import ARENA_COUNT
from sandbox.scene.model import Scene
from sandbox.state import Bools, Contacts, Floats, Integers

MAX_TURNED: Final = 0.5  # rad; what acts further from the normal is no impulse along a turned one
BOUNCED: Final = 0.75  # of the speed that gravity gives in a flight: more than that was not a bounce before it
WITHIN_ARM: Final = 1e-3  # of friction, that float32 and the iterations of a solver may be off
MOMENT_RATIOS: Final = (0.0, 0.5, 1.25, -1.0)  # of a disc's moment to an infinite one, a ring's, a sphere's; wrong sign
NO_ERROR: Final = (Cause.ROUNDING, Cause.GRAVITY, Cause.DAMPING)  # causes that are not a contact's own
MAX_TRACE_STEPS: Final = 3.0  # steps over which a contact is traced back at most

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


def pair_friction(scene: Scene, contacts: Contacts) -> Floats:
    """Return the friction of each contact, the product of the two factors: (contacts,)."""
    walls = [scene.arena.friction] * ARENA_COUNT + [wall.friction for wall in scene.walls]
    factors = np.concatenate([scene.bodies.friction, walls[::-1]])  # so that wall w is number ~w
    product: Floats = factors[contacts["first"]] * factors[contacts["second"]]
    return product


class SceneConstants(NamedTuple):
    """A scene's balls and walls, and an engine's flight.

    wall: (m, 7), direction of the segment, half the thickness (px), elasticity, start (px), length (px);
    gravity: px/s²; fall: px/s², what pulls at the balls in this engine's flight: gravity, unless the engine errs;
    together, infers: the engine's traits `together` and `infers_impulses`; centre: px, of the arena; substeps: of a
    step. Of one step: dt: s, its length; traced: s, by which a contact is traced back at most; left: the share of
    velocities and spins that the engine's damping leaves after each substep.
    """

    radius: Floats
    mass: Floats
    elasticity: Floats
    wall: Floats
    gravity: tuple[float, float]
    fall: tuple[float, float]
    together: bool
    infers: bool
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
    another contact at the same time; friction: (contacts,), the product of its two factors.
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
def _sum_unsteady(unexplained: Unexplained, contact: Record, what: int) -> float:
    """Return the sum of what changed untold of both bodies in their last flight: 0, px/s, or 1, px."""
    total: float = unexplained.unsteady[contact.first, what]
    if contact.second >= 0:
        total += unexplained.unsteady[contact.second, what]
    return total


@kernel
def _turn(ax: float, ay: float, bx: float, by: float) -> float:
    """Return the angle between two vectors, rad; 0 if one is 0."""
    return abs(math.atan2(ax * by - ay * bx, ax * bx + ay * by))


@kernel
def _check_geometry(
    constants: SceneConstants, block: Block, k: int, contact: Record, unexplained: Unexplained, reach: float
) -> tuple[float, float, float]:
    """Compare a contact's normal and depth with the places of its bodies; return the normal and the depth to go by.

    Both are the reported ones, unless the places show otherwise by more than the balls were displaced in the step.
    """
    finding, nx, ny, depth = block.findings[k], contact.normal[0], contact.normal[1], contact.depth
    lx, ly = block.line[k, 0], block.line[k, 1]
    distance = math.hypot(lx, ly)
    of_arena = -ARENA_COUNT <= contact.second < 0
    if of_arena:
        wall = ~contact.second
        outward = -1.0 if wall < 2 else 1.0
        ax, ay = (outward, 0.0) if wall % 2 == 0 else (0.0, outward)
        distance = lx * ax + ly * ay
    elif distance <= NEGLIGIBLE * reach:
        return nx, ny, depth
    else:
        ax, ay = lx / distance, ly / distance
    slack, alone = NEGLIGIBLE * reach + _sum_unsteady(unexplained, contact, 1), True
    for side in range(2):
        ball = contact.first if side == 0 else contact.second
        if ball >= 0:
            slack += math.hypot(unexplained.place[ball, 0], unexplained.place[ball, 1])
            alone = alone and unexplained.contacts[ball] == 1
    in_line, found_there = False, False
    for lines in (block.line, block.line_after, block.line_before):
        there = math.hypot(lines[k, 0], lines[k, 1])
        in_line = in_line or _turn(nx, ny, lines[k, 0], lines[k, 1]) * reach <= slack
        found_there = found_there or abs(reach - there - depth) <= slack
    if of_arena:
        in_line = _turn(nx, ny, ax, ay) * reach <= slack
    if not in_line and (alone or of_arena or slack <= 2 * NEGLIGIBLE * reach):
        finding.turned = _turn(nx, ny, ax, ay)
        nx, ny = ax, ay
    if alone and not found_there and abs(reach - distance - depth) > slack:
        depth = reach - distance
        wx, wy = finding.before[0, 0] - finding.before[1, 0], finding.before[0, 1] - finding.before[1, 1]
        flown = constants.traced * math.hypot(wx, wy) + slack
        if abs(depth) > flown:
            finding.gap, depth = -depth, contact.depth
    elif not alone and not found_there and distance > 1.5 * reach:
        finding.gap = distance - reach
    return nx, ny, depth


@kernel
def _trace_back(
    constants: SceneConstants, contact: Record, finding: Record, reach: float, nx: float, ny: float, depth: float
) -> tuple[float, float, float, float]:
    """Trace a contact back to first touch; return its delay, and the speed of approach and the normal at that time.

    Bodies that overlapped before the last contact of either did not come to overlap in this flight; their contact
    counts as found in time, and so does one that is off by rounding.
    """
    wx, wy = finding.before[0, 0] - finding.before[1, 0], finding.before[0, 1] - finding.before[1, 1]
    speed = wx * nx + wy * ny
    if abs(depth) <= NEGLIGIBLE * reach or speed <= 0:
        return 0.0, speed, nx, ny
    j, longest = contact.second, min(finding.free_flight, constants.traced) * (1 + NEGLIGIBLE)
    if j < 0 and abs(constants.wall[~j, 0] * nx + constants.wall[~j, 1] * ny) < NEGLIGIBLE:
        acceleration = constants.fall[0] * nx + constants.fall[1] * ny
        delay, then = _first_touch_of_face(depth, speed, acceleration)
        return (delay, then, nx, ny) if delay <= longest else (0.0, speed, nx, ny)
    apart = reach - depth
    delay, tx, ty = _first_touch(apart * nx, apart * ny, wx, wy, reach)
    if delay > longest:
        return 0.0, speed, nx, ny
    return delay, max(wx * tx + wy * ty, 0.0), tx, ty


@kernel
def _owned(unexplained: Unexplained, k: int, ball: int, axis: int) -> float:
    """Return by how much a contact changed a ball's velocity along an axis besides its impulse, px/s."""
    owned: float = unexplained.velocity[ball, axis] if ball >= 0 and unexplained.owner[ball] == k else 0.0
    return owned


@kernel
def _sum_unowned(unexplained: Unexplained, k: int, contact: Record) -> float:
    """Return the sum of what changed of both velocities in the step of contact k, but not by it, px/s."""
    total = 0.0
    for side in range(2):
        ball = contact.first if side == 0 else contact.second
        if ball >= 0 and unexplained.cause[ball] != Cause.ROUNDING and unexplained.owner[ball] != k:
            total += math.hypot(unexplained.velocity[ball, 0], unexplained.velocity[ball, 1])
    return total


@kernel
def _is_along_another_normal(size: float, turned: float, reported: float, lawful: float, slight: float) -> bool:
    """Return whether an impulse (kg px/s), turned from the normal (rad), acted along another one.

    It has the size of the reported impulse, or obeys the law of restitution along its own direction. lawful: kg px/s
    times its size; slight: kg px/s, a negligible difference.
    """
    lengthened = turned * turned * size / 2  # by the tangential part that would turn it as much
    if size <= slight or turned >= MAX_TURNED or lengthened <= 2 * slight:
        return False
    return bool(min(abs(size - reported), abs(size - lawful / size)) <= slight)


@kernel
def attribute_velocity(
    constants: SceneConstants, block: Block, k: int, contact: Record, unexplained: Unexplained
) -> tuple[int, float]:
    """Find the cause of what a contact changed besides its impulse: friction, another normal, or something else.

    The impulse that acted on each ball is the reported one and this. If both had the same, and it has the size of the
    reported impulse, or obeys the law of restitution along its own direction, it acted along another normal.
    Returns the error's cause, or ROUNDING if the contact has no such error, and its size, kg px/s.
    """
    finding, i, j = block.findings[k], contact.first, contact.second
    if unexplained.owner[i] != k and (j < 0 or unexplained.owner[j] != k):
        return Cause.ROUNDING, 0.0
    nx, ny, impulse = contact.normal[0], contact.normal[1], contact.impulse
    e, per_i, per_j, _ = _pair_constants(constants, contact)
    alone = unexplained.contacts[i] == 1 and (j < 0 or unexplained.contacts[j] == 1)
    for axis in range(2 * alone):
        finding.unexplained[0, axis] = _owned(unexplained, k, i, axis)
        finding.unexplained[1, axis] = _owned(unexplained, k, j, axis)
    on_first_x, on_first_y = _owned(unexplained, k, i, 0) / per_i, _owned(unexplained, k, i, 1) / per_i
    px, py = impulse * nx - on_first_x, impulse * ny - on_first_y
    on_second_x = on_second_y = off = 0.0
    if j >= 0:
        on_second_x, on_second_y = _owned(unexplained, k, j, 0) / per_j, _owned(unexplained, k, j, 1) / per_j
        off = math.hypot(on_first_x + on_second_x, on_first_y + on_second_y)
    wx, wy = finding.before[0, 0] - finding.before[1, 0], finding.before[0, 1] - finding.before[1, 1]
    slight = 10 * NEGLIGIBLE * (abs(impulse) + math.hypot(wx, wy) / (per_i + per_j))
    normal_part = max(abs(on_first_x * nx + on_first_y * ny), abs(on_second_x * nx + on_second_y * ny))
    part = max(math.hypot(on_first_x, on_first_y), math.hypot(on_second_x, on_second_y))
    friction = block.friction[k]
    cause = Cause.VELOCITY if alone else Cause.UNKNOWN
    unreported = contact.tangential == 0 and max(normal_part, off) <= slight
    unreported = unreported and (constants.together or part <= friction * abs(impulse) + slight)
    if friction > 0 and (not alone or unreported):
        cause = Cause.FRICTION
        if alone:
            finding.tangential = on_first_x * ny - on_first_y * nx
            _explain_spins(constants, block, contact, finding, unexplained)
        else:
            block.crowded[k] = True  # which contact gave which part of it is unknown
    elif off <= slight:
        lawful = (1 + e) * (wx * px + wy * py) / (per_i + per_j)
        turned = _turn(px, py, nx, ny)
        if _is_along_another_normal(math.hypot(px, py), turned, abs(impulse), lawful, slight):
            cause, finding.turned = Cause.NORMAL, turned
    for side in range(2):
        ball = i if side == 0 else j
        if ball >= 0 and unexplained.owner[ball] == k:
            unexplained.cause[ball] = cause
            for axis in range(2):
                finding.after[side, axis] += unexplained.velocity[ball, axis]
    if cause == Cause.FRICTION:
        return Cause.ROUNDING, 0.0
    return cause, math.hypot(on_first_x, on_first_y) + math.hypot(on_second_x, on_second_y)


@kernel
def attribute_besides(
    constants: SceneConstants, block: Block, k: int, contact: Record, unexplained: Unexplained
) -> tuple[int, float]:
    """Find the cause of the larger error in what a contact changed besides its impulse: of velocities or of spins.

    Returns the cause and the size (kg px/s) of that error: ROUNDING and 0 if the contact changed nothing else.
    """
    cause, error = attribute_velocity(constants, block, k, contact, unexplained)
    of_spin, spin_error = attribute_spin(constants, block, k, contact, unexplained)
    return (of_spin, spin_error) if spin_error > error else (cause, error)


@kernel
def turn_energy(constants: SceneConstants, ball: int, spin: float, change: float) -> float:
    """Return the energy (kg px²/s²) that a ball gains if its spin changes (rad/s)."""
    energy: float = constants.mass[ball] * constants.radius[ball] ** 2 / 2 * change * (spin + change / 2)
    return energy


@kernel
def _explain_spins(
    constants: SceneConstants, block: Block, contact: Record, finding: Record, unexplained: Unexplained
) -> None:
    """Explain spins by a friction that was not reported."""
    for side in range(2):
        ball = contact.first if side == 0 else contact.second
        if ball >= 0:
            by_friction = -2 * finding.tangential / (constants.mass[ball] * constants.radius[ball])
            unexplained.spin[ball] -= by_friction
            energy = turn_energy(constants, ball, finding.spin_before[side], by_friction)
            enter(block, Cause.FRICTION, energy, 0.0, 0.0)
            finding.spin_after[side] += by_friction
            slight = 10 * NEGLIGIBLE * (abs(by_friction) + abs(finding.spin_before[side]))
            right = abs(unexplained.spin[ball]) <= slight
            unexplained.spin_cause[ball] = Cause.ROUNDING if right else Cause.UNTOLD


@kernel
def is_moment(turned: float, right: float) -> bool:
    """Return whether friction turned a ball (rad/s) as if its moment of inertia were another. right: rad/s, of a disc.

    That of a ring or of a sphere, or an infinite one; or the turn has the wrong sign. Another change in the step of a
    contact need not be the contact's.
    """
    nearest = math.inf
    for ratio in MOMENT_RATIOS:
        nearest = min(nearest, abs(turned - ratio * right))
    return bool(right != 0 and nearest <= WITHIN_ARM * abs(right))


@kernel
def attribute_spin(
    constants: SceneConstants, block: Block, k: int, contact: Record, unexplained: Unexplained
) -> tuple[int, float]:
    """Find the cause of what the spins of a contact's balls changed by besides its friction.

    If a contact is found at a distance, its point may be taken from there: then friction has a longer or a shorter arm.
    Returns the cause, or ROUNDING if there is no such error, and the impulse at the rim (kg px/s) that gives as much.
    """
    finding, found, largest = block.findings[k], Cause.ROUNDING, 0.0
    for side in range(2):
        ball = contact.first if side == 0 else contact.second
        if ball < 0 or unexplained.spin_cause[ball] == Cause.ROUNDING:
            continue
        change, radius = unexplained.spin[ball], constants.radius[ball]
        at_rim = constants.mass[ball] * abs(change) * radius / 2
        if unexplained.contacts[ball] > 1:
            if unexplained.spin_cause[ball] != Cause.FRICTION:
                unexplained.spin_cause[ball] = Cause.FRICTION if block.friction[k] > 0 else Cause.UNKNOWN
            continue
        if abs(change) * radius <= 3 * unexplained.unsteady[ball, 2]:
            continue
        by_arm = at_rim <= 2 * abs(contact.depth * finding.tangential) / radius
        right = -2 * finding.tangential / (constants.mass[ball] * radius)
        cause = Cause.VELOCITY if is_moment(right + change, right) else Cause.UNKNOWN
        if by_arm and finding.tangential != 0:
            cause = Cause.LATE if contact.depth > 0 else Cause.EARLY
        unexplained.spin_cause[ball], finding.spin_error[side] = cause, change
        finding.spin_after[side] += change
        if at_rim > largest:
            found, largest = cause, at_rim
    return found, largest


@kernel
def coulomb(slip: float, impulse: float, friction: float, mass: float) -> float:
    """Return Coulomb's friction, kg px/s. slip: px/s; impulse: kg px/s along the normal; mass: μ, kg."""
    most = friction * max(impulse, 0.0)
    return min(max(slip * mass / 3, -most), most)


@kernel
def _heat(slip: float, tangential: float, mass: float) -> float:
    """Return how friction (kg px/s) changes the energy, kg px²/s². slip: px/s; mass: μ, kg."""
    return tangential * (3 * tangential / (2 * mass) - slip)


@kernel
def _cause_of_friction(
    constants: SceneConstants,
    block: Block,
    k: int,
    contact: Record,
    unexplained: Unexplained,
    mass: float,
    otherwise: int,
    right: float,
) -> int:
    """Return why a contact's friction is not the right one, kg px/s. mass: μ, kg; otherwise: as `_attribute_unmet`.

    At a wall, the slip may lack gravity's pull of the step. If the contact is found at a distance, friction may act in
    the middle of the gap, or of the overlap, and so have another arm.
    """
    finding, friction = block.findings[k], block.friction[k]
    tangential, slip = finding.tangential, finding.slip
    pull = 0.0
    if contact.second < 0:
        nx, ny = contact.normal[0], contact.normal[1]
        pull = abs(constants.fall[1] * nx - constants.fall[0] * ny) * constants.dt
    speeds = _speed_of_rims(constants, contact, finding)
    error, slight = abs(tangential - right), NEGLIGIBLE * (10 * abs(right) + mass * speeds)
    least = coulomb(slip - pull, contact.impulse, friction, mass) - slight
    most = coulomb(slip + pull, contact.impulse, friction, mass) + slight
    unsteady = _sum_unsteady(unexplained, contact, 0) + _sum_unsteady(unexplained, contact, 2)
    if error <= slight:
        cause = Cause.ROUNDING
    elif otherwise == Cause.NORMAL:
        cause = Cause.NORMAL
    elif block.crowded[k]:
        cause = Cause.FRICTION
    elif error <= mass * unsteady:
        cause = Cause.UNTOLD
    elif error <= mass * _sum_unowned(unexplained, k, contact):
        cause = Cause.UNKNOWN
    elif least <= tangential <= most:
        cause = Cause.GRAVITY
    elif _is_by_arm(constants, contact, finding, friction):
        cause = Cause.LATE if contact.depth > 0 else Cause.EARLY
    elif tangential * right >= 0 and abs(tangential) > abs(right):
        cause = Cause.FRICTION_LARGE
    else:
        cause = Cause.FRICTION_SMALL
    return cause


@kernel
def _is_by_arm(constants: SceneConstants, contact: Record, finding: Record, friction: float) -> bool:
    """Return whether friction is right for a point of contact in the middle of the overlap, or of the gap."""
    _, per_i, per_j, _ = _pair_constants(constants, contact)
    slip, per_mass = finding.slip, 0.0
    for side in range(2):
        ball = contact.first if side == 0 else contact.second
        if ball >= 0:
            short = contact.depth / (2 * constants.radius[ball])
            slip -= short * constants.radius[ball] * finding.spin_before[side]
            per_mass += (per_i if side == 0 else per_j) * (1 + 2 * (1 - short) ** 2)
    right = coulomb(3 * slip / per_mass, contact.impulse, friction, 1.0)
    return bool(contact.depth != 0 and abs(finding.tangential - right) <= WITHIN_ARM * abs(right))


@kernel
def _speed_of_rims(constants: SceneConstants, contact: Record, finding: Record) -> float:
    """Return the sum of the speeds of a contact's bodies, of flight and at their rims, px/s."""
    total: float = abs(finding.spin_before[0]) * constants.radius[contact.first]
    if contact.second >= 0:
        total += abs(finding.spin_before[1]) * constants.radius[contact.second]
    for side in range(2):
        total += math.hypot(finding.before[side, 0], finding.before[side, 1])
    return total


@kernel
def _attribute_friction(
    constants: SceneConstants,
    block: Block,
    k: int,
    contact: Record,
    unexplained: Unexplained,
    touch: tuple[float, float, float],
    expected: float,
    causes: tuple[int, int, int],
    at_rest: bool,
) -> tuple[int, float, float]:
    """Attribute the friction of a contact that was resolved by itself.

    touch: the normal of first touch and the impulse along it (kg px/s); expected: kg px/s, the expected impulse along
    the normal; causes: of what the contact did besides, of the error of its impulse, and of its time; at_rest: whether
    the two rest on each other. Returns the cause of friction's error, its size, and the right friction at first touch,
    kg px/s.
    """
    finding, friction = block.findings[k], block.friction[k]
    otherwise, of_impulse, timing = causes
    _, per_i, per_j, _ = _pair_constants(constants, contact)
    mass, slip, tangential = 1 / (per_i + per_j), finding.slip, finding.tangential
    tx, ty, at_touch = touch
    wx, wy = finding.before[0, 0] - finding.before[1, 0], finding.before[0, 1] - finding.before[1, 1]
    slip_t = slip + wx * (contact.normal[1] - ty) + wy * (tx - contact.normal[0])
    if contact.second < 0:
        slip_t -= (constants.fall[1] * tx - constants.fall[0] * ty) * finding.delay
    right, right_t = coulomb(slip, contact.impulse, friction, mass), coulomb(slip_t, at_touch, friction, mass)
    finding.expected_tangential = right_t if abs(tangential - right_t) < abs(tangential - right) else right
    right = finding.expected_tangential
    cause = _cause_of_friction(constants, block, k, contact, unexplained, mass, otherwise, right)
    error = abs(tangential - right) if cause in (Cause.FRICTION_SMALL, Cause.FRICTION_LARGE, Cause.UNTOLD) else 0.0
    is_reported = tangential == contact.tangential  # or else its energy is entered with the velocities
    unaccused = tangential if cause == Cause.FRICTION else right
    heat, heat_t = _heat(slip, unaccused, mass), _heat(slip_t, right_t, mass)
    if of_impulse == Cause.ROUNDING or right == right_t:
        of_impulse = timing
    enter(block, cause, _heat(slip, tangential, mass) - heat, error, 0.0)
    if not is_reported:
        enter(block, Cause.FRICTION, -_heat(slip, tangential, mass), 0.0, 0.0)
    if at_rest:
        _enter_friction_at_rest(constants, block, contact, finding, unaccused, heat, mass)
    elif cause == Cause.FRICTION:
        enter(block, Cause.FRICTION, heat, 0.0, 0.0)
    else:
        heat_expected = _heat(slip, coulomb(slip, expected, friction, mass), mass)
        enter(block, of_impulse, heat - heat_expected, 0.0, 0.0)
        heat_later = _heat(slip, right_t, mass)  # gravity does the difference, on the way that a late contact lacks
        enter(block, timing, heat_later - heat_t, 0.0, 0.0)
        pulled = timing if timing in (Cause.LATE, Cause.EARLY) else Cause.GRAVITY
        enter(block, pulled, heat_expected - heat_later, 0.0, 0.0)
        enter(block, Cause.FRICTION, heat_t, 0.0, 0.0)
    return cause, error, right_t


@kernel
def _enter_friction_at_rest(
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


@kernel
def _by_damping(constants: SceneConstants, contact: Record, finding: Record) -> float:
    """Return by how much (px/s) two part faster because restitution is of their speed before the substep's damping."""
    e, _, _, _ = _pair_constants(constants, contact)
    pull = 0.0
    if contact.second < 0:
        pull = constants.fall[0] * contact.normal[0] + constants.fall[1] * contact.normal[1]
    returns: float = e * (finding.approach - pull * constants.dt / constants.substeps)
    return returns * (1 / constants.left - 1)


@kernel
def _by_gravity(constants: SceneConstants, contact: Record, finding: Record, impulse: float) -> bool:
    """Return whether a wall's impulse (kg px/s) is right but for gravity's part in the step.

    The speed before may lack gravity's pull of the step, or half of it, and so may the speed that restitution is of. Or
    the bounce was traced back, to first order in the depth.
    """
    e, _, _, _ = _pair_constants(constants, contact)
    pull, depth = constants.fall[0] * contact.normal[0] + constants.fall[1] * contact.normal[1], finding.depth
    if pull == 0:
        return False
    u, size = finding.approach, impulse / constants.mass[contact.first]
    slight = NEGLIGIBLE * (abs(u) + abs(pull) * constants.dt)
    for a in range(5):
        for b in range(5):
            stops, returns = u - (a - 2) * pull * constants.dt / 2, u - (b - 2) * pull * constants.dt / 2
            if abs(stops + e * returns - size) <= slight:
                return True
    if depth <= 0 or u <= 0:
        return False
    then = _root(u * u - 2 * pull * depth)
    ago = 2 * depth / (u + then)
    traced, first_order = e * then - pull * ago, e * u - (1 + e) * pull * depth / u
    off: float = min(abs(size - u - max(traced, 0.0)), abs(size - u - max(first_order, 0.0)))
    return off <= float(slight)


@kernel
def _keeps_its_place(constants: SceneConstants, block: Block, k: int, contact: Record) -> bool:
    """Return whether two bodies of a heap, with other contacts at the same time, do not move apart or round in a step.

    Contacts that bear a heap's weight do so together, and mean nothing one after another.
    """
    _, _, _, reach = _pair_constants(constants, contact)
    x, y = block.line_after[k, 0] - block.line_before[k, 0], block.line_after[k, 1] - block.line_before[k, 1]
    return bool(block.crowded[k] and not constants.together and math.hypot(x, y) <= NEGLIGIBLE * reach)


@kernel
def _is_at_rest(constants: SceneConstants, block: Block, k: int, contact: Record, finding: Record) -> bool:
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
def _enter_rest(block: Block, k: int, energy: float) -> None:
    """Enter what a contact at rest takes with what gravity gives in each step: the two lines would only cancel out."""
    enter(block, Cause.GRAVITY, energy, 0.0, 0.0)
    block.timing[k] = Cause.GRAVITY


@kernel
def _attribute_unmet(
    constants: SceneConstants,
    block: Block,
    k: int,
    contact: Record,
    finding: Record,
    uncertain: float,
    unowned: float,
    otherwise: int,
) -> None:
    """Attribute a contact of two that part, or that are too far apart to have met.

    uncertain, unowned: kg px/s, how much of its impulse is not known, because velocities change in flight, or change in
    the step but not by this contact; otherwise: the cause of what it did besides, or ROUNDING.
    """
    impulse = contact.impulse
    finding.rests = (
        finding.gap == 0 and otherwise == Cause.ROUNDING and _is_at_rest(constants, block, k, contact, finding)
    )
    if finding.gap > 0:
        cause = Cause.UNKNOWN
    elif impulse == 0 or finding.rests:
        cause = Cause.ROUNDING
    elif abs(impulse) <= uncertain:
        cause = Cause.UNTOLD
    elif abs(impulse) <= unowned:
        cause = Cause.UNKNOWN
    else:
        cause = Cause.STALE if constants.together else Cause.TURNED if contact.second < 0 else Cause.LARGE
    _, per_i, per_j, _ = _pair_constants(constants, contact)
    finding.cause = cause if otherwise == Cause.ROUNDING else otherwise
    energy = impulse * (impulse * (per_i + per_j) / 2 - finding.approach)
    energy += _heat(finding.slip, contact.tangential, 1 / (per_i + per_j))
    if finding.rests:
        _enter_rest(block, k, energy)
        return
    finding.momentum_error = math.hypot(impulse, contact.tangential)
    enter(block, finding.cause, energy, finding.momentum_error, 0.0)


@kernel
def _cause_of_impulse(
    constants: SceneConstants,
    contact: Record,
    finding: Record,
    undamped: float,
    uncertain: float,
    unowned: float,
    otherwise: int,
    at_rest: bool,
) -> int:
    """Return why an impulse is not the expected one.

    undamped: the impulse without damping's part, kg px/s; the others: as for `_attribute_unmet`.
    """
    expected, impulse = finding.expected_impulse, contact.impulse
    error = abs(undamped - expected)
    if impulse < 0 and constants.together:
        cause = Cause.STALE
    elif abs(impulse - expected) <= NEGLIGIBLE * expected:
        cause = Cause.ROUNDING
    elif error <= NEGLIGIBLE * expected:
        cause = Cause.DAMPING
    elif otherwise == Cause.NORMAL:
        cause = Cause.NORMAL
    elif error <= uncertain:
        cause = Cause.UNTOLD
    elif error <= unowned:
        cause = Cause.UNKNOWN
    elif at_rest or (contact.second < 0 and _by_gravity(constants, contact, finding, undamped)):
        cause = Cause.GRAVITY
    else:
        cause = Cause.SMALL if undamped < expected else Cause.LARGE
    return cause


@kernel
def attribute_single(
    constants: SceneConstants, block: Block, k: int, contact: Record, unexplained: Unexplained
) -> None:
    """Attribute what a contact that was resolved by itself did to energy and momentum."""
    finding = block.findings[k]
    e, per_i, per_j, reach = _pair_constants(constants, contact)
    mu, u, impulse = 1 / (per_i + per_j), finding.approach, contact.impulse
    otherwise, other_error = attribute_besides(constants, block, k, contact, unexplained)
    lx, ly, finding.depth = _check_geometry(constants, block, k, contact, unexplained, reach)
    uncertain = 3 * (1 + e) * mu * _sum_unsteady(unexplained, contact, 0)
    unowned = 3 * (1 + e) * mu * _sum_unowned(unexplained, k, contact)
    if finding.gap > 0 or u <= 0:
        _attribute_unmet(constants, block, k, contact, finding, uncertain, unowned, otherwise)
        return

    # What the contact should have done, as it was found and at first touch.
    delay, u_t, tx, ty = 0.0, u, lx, ly
    if finding.turned == 0:
        delay, u_t, tx, ty = _trace_back(constants, contact, finding, reach, lx, ly, finding.depth)
    as_found, at_touch = (1 + e) * mu * u, (1 + e) * mu * u_t
    undamped = impulse - mu * _by_damping(constants, contact, finding)
    expected = at_touch if abs(undamped - at_touch) < abs(undamped - as_found) else as_found
    finding.expected_impulse, finding.delay, finding.normal_error = expected, delay, _turn(lx, ly, tx, ty)
    finding.touch[0], finding.touch[1] = tx, ty

    # Its errors: of the impulse, of its time, of its normal, of friction, and what it did besides.
    finding.rests = at_rest = _is_at_rest(constants, block, k, contact, finding)
    cause = _cause_of_impulse(constants, contact, finding, undamped, uncertain, unowned, otherwise, at_rest)
    impulse_error = abs(impulse - expected)
    turning = expected * math.hypot(contact.normal[0] - lx, contact.normal[1] - ly)
    timing_error = math.hypot(expected * lx - at_touch * tx, expected * ly - at_touch * ty)
    timing = Cause.ROUNDING if timing_error <= NEGLIGIBLE * at_touch else Cause.LATE if delay > 0 else Cause.EARLY
    block.timing[k] = timing
    touch = tx, ty, at_touch
    by_friction, friction_error, rubs = _attribute_friction(
        constants, block, k, contact, unexplained, touch, expected, (otherwise, cause, timing), at_rest
    )
    block.expected_shift[k, 0] = delay * (at_touch * tx - rubs * ty)
    block.expected_shift[k, 1] = delay * (at_touch * ty + rubs * tx)
    if timing != Cause.ROUNDING:
        found = expected, coulomb(finding.slip, expected, block.friction[k], mu)
        timing_error = _timing_error((lx, ly), touch, found, rubs)
    energy, energy_expected = impulse * (impulse / (2 * mu) - u), expected * (expected / (2 * mu) - u)
    by_elasticity = -(1 - e * e) * mu * u_t * u_t / 2
    if at_rest:
        _enter_rest(block, k, energy)
        timing, energy, by_elasticity, energy_expected = Cause.GRAVITY, 0.0, 0.0, 0.0
    is_error, is_mistimed = cause not in NO_ERROR, timing in (Cause.LATE, Cause.EARLY)
    enter(block, Cause.ELASTICITY, by_elasticity, 0.0, 0.0)
    enter(block, cause, energy - energy_expected, impulse_error if is_error else 0.0, 0.0)
    enter(block, timing, energy_expected - by_elasticity, timing_error if is_mistimed else 0.0, 0.0)

    # The largest is the contact's cause; together they are the momentum that it moved wrongly.
    if turning > NEGLIGIBLE * at_touch:
        enter(block, Cause.NORMAL, 0.0, turning, 0.0)
    moved_wrongly = _moved_wrongly(contact, finding, (lx, ly), touch, (1 + e) * mu, otherwise)
    finding.momentum_error = max(moved_wrongly, friction_error, other_error, timing_error if is_mistimed else 0.0)
    errors = impulse_error, timing_error, turning if turning > NEGLIGIBLE * at_touch else -1.0, friction_error
    finding.cause = _cause_of_largest(errors, (cause, timing, Cause.NORMAL, by_friction))
    if other_error > max(impulse_error / 10, timing_error, turning, friction_error):  # the impulse was not as reported
        finding.cause = otherwise


@kernel
def _moved_wrongly(
    contact: Record,
    finding: Record,
    line: tuple[float, float],
    touch: tuple[float, float, float],
    mass: float,
    otherwise: int,
) -> float:
    """Return how far the momentum that a contact moved along its normal is from what it should be, kg px/s.

    line: the normal as found; touch: the normal at first touch, and the impulse along it; mass: (1 + e) times the
    reduced mass, kg.
    """
    (lx, ly), (tx, ty, right) = line, touch
    if finding.turned > 0 and otherwise == Cause.ROUNDING:
        along_x = (finding.before[0, 0] - finding.before[1, 0]) * lx
        right = mass * max(along_x + (finding.before[0, 1] - finding.before[1, 1]) * ly, 0.0)
    x, y = contact.impulse * contact.normal[0] - right * tx, contact.impulse * contact.normal[1] - right * ty
    return math.hypot(x, y)


@kernel
def _cause_of_largest(errors: tuple[float, float, float, float], causes: tuple[int, int, int, int]) -> int:
    """Return the cause of the largest error: of the impulse, of its time, of its normal, of friction."""
    impulse, timing, normal, friction = errors
    if friction > max(impulse, timing, normal):
        return causes[3]
    if normal >= max(impulse, timing):
        return causes[2]
    return causes[0] if impulse >= timing and causes[0] not in (Cause.GRAVITY, Cause.DAMPING) else causes[1]


@kernel
def _timing_error(
    line: tuple[float, float], touch: tuple[float, float, float], found: tuple[float, float], rubs: float
) -> float:
    """Return how far the impulse of a contact as found is from that at first touch, with friction, kg px/s.

    line: the normal as found, and found: the impulses along it and along its tangent; touch: the normal of first touch
    and the impulse along it, and rubs: the friction there.
    """
    (lx, ly), (tx, ty, at_touch), (expected, friction) = line, touch, found
    x = expected * lx - friction * ly - at_touch * tx + rubs * ty
    y = expected * ly + friction * lx - at_touch * ty - rubs * tx
    return math.hypot(x, y)


@kernel
def _enter_simultaneous_friction(constants: SceneConstants, block: Block, k: int, contact: Record) -> None:
    """Enter the friction of one of several contacts that were resolved together: it is not unique, so not judged."""
    finding = block.findings[k]
    _, per_i, per_j, _ = _pair_constants(constants, contact)
    tangential, mass = finding.tangential, 1 / (per_i + per_j)
    energy = -tangential * (finding.slip + finding.slip_after) / 2
    finding.expected_tangential = tangential
    if _is_at_rest(constants, block, k, contact, finding):
        _enter_friction_at_rest(constants, block, contact, finding, tangential, energy, mass)
    elif abs(tangential) <= NEGLIGIBLE * abs(contact.impulse):
        enter(block, Cause.ROUNDING, energy, 0.0, 0.0)
    else:
        enter(block, Cause.FRICTION if energy <= 0 and block.friction[k] > 0 else Cause.UNCONVERGED, energy, 0.0, 0.0)


@kernel
def attribute_simultaneous(
    constants: SceneConstants, block: Block, k: int, contact: Record, unexplained: Unexplained
) -> None:
    """Attribute what one of several contacts that share balls and were resolved together did."""
    finding = block.findings[k]
    e, per_i, per_j, reach = _pair_constants(constants, contact)
    mu, u, impulse = 1 / (per_i + per_j), finding.approach, contact.impulse
    by_elasticity = -impulse * (1 - e) * u / 2 if impulse > 0 else 0.0
    nx, ny = contact.normal[0], contact.normal[1]
    step_pull = abs(constants.fall[0] * nx + constants.fall[1] * ny) * constants.dt
    impulse_error = mu * abs(finding.approach_after + e * u)
    undamped_error = mu * abs(finding.approach_after + e * u + _by_damping(constants, contact, finding))
    if impulse < 0:
        cause = Cause.STALE
    elif impulse_error <= NEGLIGIBLE * mu * abs(u):
        cause = Cause.ROUNDING
    elif undamped_error <= NEGLIGIBLE * mu * abs(u):
        cause = Cause.DAMPING
    elif undamped_error <= 3 * (1 + e) * mu * _sum_unsteady(unexplained, contact, 0):
        cause = Cause.UNTOLD
    elif contact.second < 0 and undamped_error <= (1 + e) * mu * step_pull * (1 + NEGLIGIBLE):
        cause = Cause.GRAVITY
    elif constants.infers and block.friction[k] > 0:
        cause = Cause.UNKNOWN
    else:
        cause = Cause.UNCONVERGED
    is_error = cause in (Cause.STALE, Cause.UNCONVERGED, Cause.UNTOLD)
    _enter_simultaneous_friction(constants, block, k, contact)
    energy, finding.rests = (
        -impulse * (u + finding.approach_after) / 2,
        _is_at_rest(constants, block, k, contact, finding),
    )
    if finding.rests:
        _enter_rest(block, k, energy)
        energy = by_elasticity = 0.0
    enter(block, Cause.ELASTICITY, by_elasticity, 0.0, 0.0)
    energy_error = energy - by_elasticity
    enter(block, cause, energy_error, impulse_error if is_error else 0.0, 0.0)
    finding.cause, finding.momentum_error, finding.expected_impulse = cause, impulse_error, impulse
    finding.depth = contact.depth
    otherwise, other_error = attribute_besides(constants, block, k, contact, unexplained)
    if other_error > impulse_error:
        finding.cause, finding.momentum_error = otherwise, other_error
    if u <= 0 or finding.rests:
        return
    delay, _, tx, ty = _trace_back(constants, contact, finding, reach, nx, ny, contact.depth)
    finding.delay, finding.normal_error, finding.touch[0], finding.touch[1] = delay, _turn(nx, ny, tx, ty), tx, ty
    timing_error = abs(impulse) * math.hypot(nx - tx, ny - ty)
    timing = Cause.LATE if delay > 0 else Cause.EARLY if delay < 0 else Cause.ROUNDING
    if finding.normal_error > NEGLIGIBLE:
        enter(block, timing, 0.0, timing_error, 0.0)
        if timing_error > finding.momentum_error:
            finding.cause, finding.momentum_error = timing, timing_error
    block.timing[k] = timing
    rubs = finding.tangential
    block.expected_shift[k, 0] = delay * (impulse * tx - rubs * ty)
    block.expected_shift[k, 1] = delay * (impulse * ty + rubs * tx)


@kernel
def _depth_in(constants: SceneConstants, position: Floats, ball: int, other: int) -> float:
    """Return how deep a ball is in another, or in ~wall, px; 0 if they do not overlap. position: (n, 2) px."""
    x, y = position[ball, 0], position[ball, 1]
    if other >= 0:
        reach = constants.radius[ball] + constants.radius[other]
        dx, dy = position[other, 0] - x, position[other, 1] - y
    else:
        reach = constants.radius[ball] + constants.wall[~other, 2]
        dx, dy = line_to_wall(constants, ~other, x, y)
    depth: float = max(reach - math.hypot(dx, dy), 0.0)
    return depth


@kernel
def mends_overlap(constants: SceneConstants, unexplained: Unexplained, before: Floats, ball: int, moved: float) -> bool:
    """Return whether a ball that was moved (px) overlaps others by half as much: in the step, or before it.

    before: (n, 2) px, positions at the start of the step. A solver that resolves contacts together hands what it mends
    on from ball to ball: there all overlaps of the step count. Looks first at what the ball touched last.
    """
    other, room = unexplained.partner[ball], unexplained.room[ball]
    depth = _depth_in(constants, before, ball, other)
    if 2 * (room + depth) >= moved:
        return True
    for one in range(-len(constants.wall), len(constants.mass)):
        if one not in (ball, other):
            depth += _depth_in(constants, before, ball, one)
    if constants.together and room + depth > 0:
        for one in range(len(constants.mass)):
            room += unexplained.room[one] if one != ball else 0.0
    enough: bool = 2 * (room + depth) >= moved
    return enough


@kernel
def _displacement_by_friction_at_rest(constants: SceneConstants, contact: Record, finding: Record, ball: int) -> float:
    """Return how far (px) friction at rest puts a ball from where the same impulse at once, at the end, would have it.

    It acts for as long as the two touch, at most for a step. 0 of a contact that is not at rest.
    """
    held: float = abs(contact.tangential) / constants.mass[ball] * min(finding.free_flight, constants.dt) / 2
    return held if finding.rests else 0.0


@kernel
def attribute_displacement(
    constants: SceneConstants,
    block: Block,
    k: int,
    contact: Record,
    unexplained: Unexplained,
    last: Integers,
    before: Floats,
) -> None:
    """Attribute how a contact displaced its balls.

    last: (n,) each ball's last contact; before: (n, 2) px, positions at the start of the step.
    """
    finding, nx, ny = block.findings[k], contact.normal[0], contact.normal[1]
    energy = energy_expected = put_back = moved = error = finding.displacement_error = 0.0
    mends = True
    for side in range(2):
        ball = contact.first if side == 0 else contact.second
        if ball < 0:
            continue
        sign = 1 - 2 * side
        x, y = unexplained.place[ball, 0], unexplained.place[ball, 1]
        if last[ball] != k:
            along, across = x * nx + y * ny, y * nx - x * ny
            held = _displacement_by_friction_at_rest(constants, contact, finding, ball)
            across = min(max(across, -held), held)
            x, y = along * nx - across * ny, along * ny + across * nx
        unexplained.place[ball, 0] -= x
        unexplained.place[ball, 1] -= y
        expected_x = -sign * block.expected_shift[k, 0] / constants.mass[ball]
        expected_y = -sign * block.expected_shift[k, 1] / constants.mass[ball]
        energy -= constants.mass[ball] * (constants.gravity[0] * x + constants.gravity[1] * y)
        energy_expected -= constants.mass[ball] * (
            constants.gravity[0] * expected_x + constants.gravity[1] * expected_y
        )
        off = math.hypot(x - expected_x, y - expected_y)
        error, finding.displacement_error = error + off, max(finding.displacement_error, off)
        put_back -= sign * (x * nx + y * ny)
        by = math.hypot(x, y)
        moved += by
        if by > NEGLIGIBLE * constants.radius[ball]:
            mends = mends and mends_overlap(constants, unexplained, before, ball, by)
    cause = _cause_of_displacement(constants, block, k, contact, unexplained, error, put_back, moved, mends)
    is_error = cause not in NO_ERROR
    enter(block, block.timing[k], energy_expected, 0.0, 0.0)
    enter(block, cause, energy - energy_expected, 0.0, error if is_error else 0.0)
    if finding.cause in NO_ERROR:
        finding.cause = cause


@kernel
def _cause_of_displacement(
    constants: SceneConstants,
    block: Block,
    k: int,
    contact: Record,
    unexplained: Unexplained,
    error: float,
    put_back: float,
    moved: float,
    mends: bool,
) -> int:
    """Return why a contact displaced its balls wrongly.

    error: px, of both together; put_back: px along the normal, away from the other body; moved: px, of both together;
    mends: whether overlaps are deep enough for that.
    """
    finding, slight = block.findings[k], NEGLIGIBLE * constants.radius[contact.first]
    fall = math.hypot(constants.fall[0], constants.fall[1])
    delay, at_rest = finding.delay, block.timing[k] == Cause.GRAVITY
    _, _, _, reach = _pair_constants(constants, contact)
    depth = reach - math.hypot(block.line[k, 0], block.line[k, 1])
    overlap = max(contact.depth, reach - math.hypot(block.line_before[k, 0], block.line_before[k, 1]), 0.0)
    mends = mends and depth <= 2 * overlap + slight  # or else they were held before they overlapped
    if error <= slight:
        cause = Cause.ROUNDING
    elif error <= 3 * _sum_unsteady(unexplained, contact, 1):
        cause = Cause.PLACED
    elif error <= 3 * _sum_unsteady(unexplained, contact, 0) * constants.dt:
        cause = Cause.UNTOLD
    elif error <= 2 * fall * (constants.dt**2 if at_rest else delay * delay if contact.second < 0 else 0.0):
        cause = Cause.GRAVITY
    elif moved <= slight:
        cause = Cause.LATE if delay > 0 else Cause.EARLY
    elif mends:
        shift, nx, ny = block.expected_shift[k], contact.normal[0], contact.normal[1]
        way_back = (shift[0] * nx + shift[1] * ny) / constants.mass[contact.first]
        mistimed = Cause.LATE if delay > 0 else Cause.EARLY
        put_on_wall = Cause.OVERSHOOT if contact.depth / 2 < put_back < way_back - slight else mistimed
        cause = Cause.PUSHED if contact.second >= 0 or delay == 0 else put_on_wall
    elif abs(depth) <= 10 * slight or finding.approach <= 0:
        cause = Cause.PLACED
    else:  # resolved at another time than reported
        way_back = abs(depth / finding.approach * contact.impulse) / constants.mass[contact.first]
        cause = Cause.LATE if depth > 0 else Cause.EARLY
        if contact.second < 0 and depth / 2 < put_back < way_back - slight:
            cause, finding.displacement_error = Cause.OVERSHOOT, way_back - put_back
        if finding.cause in NO_ERROR:  # or else its time has explained a larger error
            finding.depth, finding.delay = depth, depth / finding.approach
    return cause
