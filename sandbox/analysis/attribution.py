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
from typing import Final

from sandbox.analysis.findings import (
    NO_ERROR,
    Block,
    SceneConstants,
    Unexplained,
    enter,
    pair_constants,
    sum_unowned,
    sum_unsteady,
)
from sandbox.analysis.first_touch import angle_between, check_geometry, real_root, trace_back
from sandbox.analysis.friction import (
    attribute_friction,
    attribute_spin,
    coulomb,
    explain_spins,
    friction_heat,
)
from sandbox.analysis.rest import enter_friction_at_rest, enter_rest, is_at_rest
from sandbox.compiled import Record, kernel
from sandbox.judge.causes import NEGLIGIBLE, Cause

MAX_TURNED: Final = 0.5  # rad; what acts further from the normal is no impulse along a turned one


@kernel
def _owned(unexplained: Unexplained, k: int, ball: int, axis: int) -> float:
    """Return by how much a contact changed a ball's velocity along an axis besides its impulse, px/s."""
    owned: float = unexplained.velocity[ball, axis] if ball >= 0 and unexplained.owner[ball] == k else 0.0
    return owned


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
    e, per_i, per_j, _ = pair_constants(constants, contact)
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
            explain_spins(constants, block, contact, finding, unexplained)
        else:
            block.crowded[k] = True  # which contact gave which part of it is unknown
    elif off <= slight:
        lawful = (1 + e) * (wx * px + wy * py) / (per_i + per_j)
        turned = angle_between(px, py, nx, ny)
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
def _by_damping(constants: SceneConstants, contact: Record, finding: Record) -> float:
    """Return by how much (px/s) two part faster because restitution is of their speed before the substep's damping."""
    e, _, _, _ = pair_constants(constants, contact)
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
    e, _, _, _ = pair_constants(constants, contact)
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
    then = real_root(u * u - 2 * pull * depth)
    ago = 2 * depth / (u + then)
    traced, first_order = e * then - pull * ago, e * u - (1 + e) * pull * depth / u
    off: float = min(abs(size - u - max(traced, 0.0)), abs(size - u - max(first_order, 0.0)))
    return off <= float(slight)


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
        finding.gap == 0 and otherwise == Cause.ROUNDING and is_at_rest(constants, block, k, contact, finding)
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
        pulls_back = contact.second < 0 and impulse < 0
        cause = Cause.STALE if constants.together else Cause.TURNED if pulls_back else Cause.LARGE
        cause = Cause.RESCALED if block.rescaled[k] else cause
    _, per_i, per_j, _ = pair_constants(constants, contact)
    finding.cause = cause if otherwise == Cause.ROUNDING else otherwise
    energy = impulse * (impulse * (per_i + per_j) / 2 - finding.approach)
    energy += friction_heat(finding.slip, contact.tangential, 1 / (per_i + per_j))
    if finding.rests:
        enter_rest(block, k, energy)
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
    rescaled: bool,
    within_timing: bool,
) -> int:
    """Return why an impulse is not the expected one.

    undamped: the impulse without damping's part, kg px/s; within_timing: whether it is between what is right as found
    and what is right at first touch, so that it is too large for one and too small for the other; the others: as for
    `_attribute_unmet`.
    """
    expected, impulse = finding.expected_impulse, contact.impulse
    error = abs(undamped - expected)
    if abs(impulse - expected) <= NEGLIGIBLE * expected:
        cause = Cause.ROUNDING
    elif rescaled:
        cause = Cause.RESCALED
    elif impulse < 0 and constants.together:
        cause = Cause.STALE
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
    elif within_timing:
        cause = Cause.LATE if finding.delay > 0 else Cause.EARLY
    else:
        cause = Cause.SMALL if undamped < expected else Cause.LARGE
    return cause


@kernel
def attribute_single(
    constants: SceneConstants, block: Block, k: int, contact: Record, unexplained: Unexplained
) -> None:
    """Attribute what a contact that was resolved by itself did to energy and momentum."""
    finding = block.findings[k]
    e, per_i, per_j, reach = pair_constants(constants, contact)
    mu, u, impulse = 1 / (per_i + per_j), finding.approach, contact.impulse
    otherwise, other_error = attribute_besides(constants, block, k, contact, unexplained)
    lx, ly, finding.depth = check_geometry(constants, block, k, contact, unexplained, reach)
    uncertain = 3 * (1 + e) * mu * sum_unsteady(unexplained, contact, 0)
    unowned = 3 * (1 + e) * mu * sum_unowned(unexplained, k, contact)
    if finding.gap > 0 or u <= 0:
        _attribute_unmet(constants, block, k, contact, finding, uncertain, unowned, otherwise)
        return

    # What the contact should have done, as it was found and at first touch.
    delay, u_t, tx, ty = 0.0, u, lx, ly
    if finding.turned == 0:
        delay, u_t, tx, ty = trace_back(constants, contact, finding, reach, lx, ly, finding.depth)
    as_found, at_touch = (1 + e) * mu * u, (1 + e) * mu * u_t
    undamped = impulse - mu * _by_damping(constants, contact, finding)
    expected = at_touch if abs(undamped - at_touch) < abs(undamped - as_found) else as_found
    finding.expected_impulse, finding.delay, finding.normal_error = expected, delay, angle_between(lx, ly, tx, ty)
    finding.touch[0], finding.touch[1] = tx, ty

    # Its errors: of the impulse, of its time, of its normal, of friction, and what it did besides.
    finding.rests = at_rest = is_at_rest(constants, block, k, contact, finding)
    rescaled = block.rescaled[k] and not at_rest
    cause = _cause_of_impulse(
        constants,
        contact,
        finding,
        undamped,
        uncertain,
        unowned,
        otherwise,
        at_rest,
        rescaled,
        (undamped - as_found) * (undamped - at_touch) < 0,
    )
    impulse_error = abs(impulse - expected)
    turning = expected * math.hypot(contact.normal[0] - lx, contact.normal[1] - ly)
    timing_error = math.hypot(expected * lx - at_touch * tx, expected * ly - at_touch * ty)
    timing = Cause.ROUNDING if timing_error <= NEGLIGIBLE * at_touch else Cause.LATE if delay > 0 else Cause.EARLY
    block.timing[k] = timing
    touch = tx, ty, at_touch
    by_friction, friction_error, rubs = attribute_friction(
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
        enter_rest(block, k, energy)
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
    _, per_i, per_j, _ = pair_constants(constants, contact)
    tangential, mass = finding.tangential, 1 / (per_i + per_j)
    energy = -tangential * (finding.slip + finding.slip_after) / 2
    finding.expected_tangential = tangential
    if is_at_rest(constants, block, k, contact, finding):
        enter_friction_at_rest(constants, block, contact, finding, tangential, energy, mass)
    elif abs(tangential) <= NEGLIGIBLE * abs(contact.impulse):
        enter(block, Cause.ROUNDING, energy, 0.0, 0.0)
    else:
        enter(block, Cause.FRICTION if energy <= 0 and block.friction[k] > 0 else Cause.UNCONVERGED, energy, 0.0, 0.0)


@kernel
def _cause_of_shared_impulse(
    constants: SceneConstants,
    block: Block,
    k: int,
    contact: Record,
    unexplained: Unexplained,
    error: float,
    undamped_error: float,
) -> int:
    """Return why one of several contacts that share balls ends with a wrong velocity.

    error: of the impulse, and undamped_error: without damping's part, kg px/s.
    """
    e, per_i, per_j, _ = pair_constants(constants, contact)
    mu, u = 1 / (per_i + per_j), block.findings[k].approach
    nx, ny = contact.normal[0], contact.normal[1]
    step_pull = abs(constants.fall[0] * nx + constants.fall[1] * ny) * constants.dt
    slight = NEGLIGIBLE * mu * (abs(u) + math.hypot(constants.fall[0], constants.fall[1]) * constants.dt)
    if contact.impulse < 0:
        cause = Cause.RESCALED if block.rescaled[k] else Cause.STALE
    elif error <= slight:
        cause = Cause.ROUNDING
    elif block.rescaled[k]:
        cause = Cause.RESCALED
    elif undamped_error <= slight:
        cause = Cause.DAMPING
    elif undamped_error <= 3 * (1 + e) * mu * sum_unsteady(unexplained, contact, 0):
        cause = Cause.UNTOLD
    elif contact.second < 0 and undamped_error <= (1 + e) * mu * step_pull * (1 + NEGLIGIBLE):
        cause = Cause.GRAVITY
    elif constants.infers and block.friction[k] > 0:
        cause = Cause.UNKNOWN
    else:
        cause = Cause.UNCONVERGED
    return cause


@kernel
def _attribute_sum(constants: SceneConstants, block: Block, k: int, contact: Record, unexplained: Unexplained) -> None:
    """Attribute what one of several contacts did that share balls and are sums of impacts: it has no law of its own."""
    finding = block.findings[k]
    _, per_i, per_j, _ = pair_constants(constants, contact)
    impulse, tangential, mass = contact.impulse, contact.tangential, 1 / (per_i + per_j)
    energy = -impulse * (finding.approach + finding.approach_after) / 2
    heat = -tangential * (finding.slip + finding.slip_after) / 2
    finding.rests = is_at_rest(constants, block, k, contact, finding)
    if finding.rests:
        enter_rest(block, k, energy)
        enter_friction_at_rest(constants, block, contact, finding, tangential, heat, mass)
    else:
        enter(block, Cause.ELASTICITY, energy, 0.0, 0.0)
        enter(block, Cause.FRICTION, heat, 0.0, 0.0)
    finding.cause, finding.momentum_error = attribute_besides(constants, block, k, contact, unexplained)
    finding.expected_impulse, finding.expected_tangential, finding.depth = impulse, tangential, contact.depth


@kernel
def attribute_simultaneous(
    constants: SceneConstants, block: Block, k: int, contact: Record, unexplained: Unexplained
) -> None:
    """Attribute what one of several contacts that share balls and were resolved together did."""
    if constants.sums:
        _attribute_sum(constants, block, k, contact, unexplained)
        return
    finding = block.findings[k]
    e, per_i, per_j, reach = pair_constants(constants, contact)
    mu, u, impulse = 1 / (per_i + per_j), finding.approach, contact.impulse
    by_elasticity = -impulse * (1 - e) * u / 2 if impulse > 0 else 0.0
    nx, ny = contact.normal[0], contact.normal[1]
    impulse_error = mu * abs(finding.approach_after + e * u)
    undamped_error = mu * abs(finding.approach_after + e * u + _by_damping(constants, contact, finding))
    cause = _cause_of_shared_impulse(constants, block, k, contact, unexplained, impulse_error, undamped_error)
    is_error = cause in (Cause.RESCALED, Cause.STALE, Cause.UNCONVERGED, Cause.UNTOLD)
    _enter_simultaneous_friction(constants, block, k, contact)
    energy, finding.rests = (
        -impulse * (u + finding.approach_after) / 2,
        is_at_rest(constants, block, k, contact, finding),
    )
    if finding.rests:
        enter_rest(block, k, energy)
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
    delay, _, tx, ty = trace_back(constants, contact, finding, reach, nx, ny, contact.depth)
    finding.delay, finding.normal_error, finding.touch[0], finding.touch[1] = (
        delay,
        angle_between(nx, ny, tx, ty),
        tx,
        ty,
    )
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
