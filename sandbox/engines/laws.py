"""Laws that engines share: Coulomb's limit, and times of impact (in closed form, or bracketed).

Throughout: r, v, a are position (px), velocity (px/s) and acceleration (px/s²) of one body relative to another; a gap
is the distance between their surfaces (px, negative if they overlap); times are seconds from now, `inf` for never.

Two bodies touch when their gap is 0 and shrinking. Bodies that overlap, by rounding or by the scene, touch at once if
they approach, and are left alone if they part (Bannerman, Strobl, Formella and Pöschel, arXiv:1211.6718). Quadratic
roots are computed in the form without cancellation.
"""

import math
from typing import Final

from sandbox.compiled import kernel

NEVER: Final = math.inf


@kernel
def friction_impulse(slip: float, limit: float, per_mass: float) -> float:
    """Return the impulse along the tangent (kg px/s) that stops a slip (px/s), or the limit, which is Coulomb's.

    per_mass: of both bodies, 1/kg. Uniform discs turn too, so that a third of the mass resists along the tangent (O. R.
    Walton and R. L. Braun, J. Rheol. 30 (1986) 949, with beta_0 = 0).
    """
    limit = max(0.0, limit)
    return max(-limit, min(limit, slip / (3 * per_mass)))


@kernel
def time_to_close(gap: float, v: float, a: float) -> float:
    """Return when a gap that changes by v t + a t²/2 is 0 and shrinking."""
    discriminant = v * v - 2 * a * gap
    if v <= 0 and gap <= 0:
        return 0.0 if v < 0 or a < 0 else NEVER
    if v <= 0:
        # Approaching: the first root, unless acceleration reverses the motion before it.
        if discriminant < 0 or (v == 0 and a >= 0):
            return NEVER
        return 2 * gap / (-v + math.sqrt(discriminant))
    if a >= 0:
        return NEVER
    # Parting, and pulled back: the last root; if an overlap never opens, they touch where the motion reverses.
    return (v + math.sqrt(max(0.0, discriminant))) / -a


@kernel
def time_to_touch(
    rx: float, ry: float, vx: float, vy: float, ax: float, ay: float, reach: float, limit: float
) -> float:
    """Return when two discs, or a disc and a point, that are r apart come within reach (px) of each other.

    A time after the limit (s) may be returned as `inf`.
    """
    b = rx * vx + ry * vy
    if ax != 0 or ay != 0:
        return _time_to_touch_falling(rx, ry, vx, vy, ax, ay, reach, limit)
    if b >= 0:
        return NEVER
    c = rx * rx + ry * ry - reach * reach
    discriminant = b * b - (vx * vx + vy * vy) * c
    if discriminant < 0:
        return NEVER
    return max(0.0, c / (-b + math.sqrt(discriminant)))


@kernel
def _time_to_touch_falling(
    rx: float, ry: float, vx: float, vy: float, ax: float, ay: float, reach: float, limit: float
) -> float:
    """Return the first root of f(t) = |r + v t + a t²/2|² - reach² at which f falls.

    f is a quartic. The roots of f'' divide the time into intervals on which f' is monotone, and the roots of f' divide
    these into intervals on which f is monotone: such an interval has a root if f changes sign, and only one.
    """
    rr, vv, aa = rx * rx + ry * ry, vx * vx + vy * vy, ax * ax + ay * ay
    ra, rv, va = rx * ax + ry * ay, rx * vx + ry * vy, vx * ax + vy * ay
    distance, v, a = math.sqrt(rr), math.sqrt(vv), math.sqrt(aa)
    # Beyond `far`, a t²/2 alone exceeds all other terms.
    far = min(limit, (v + math.sqrt(v * v + 2 * a * (distance + reach))) / a)
    if distance - reach > far * (v + a * far / 2):
        return NEVER
    f = (rr - reach * reach, 2 * rv, vv + ra, va, aa / 4)
    slope = (2 * rv, 2 * (vv + ra), 3 * va, aa, 0.0)
    bend1, bend2 = _roots_of_quadratic(2 * (vv + ra), 6 * va, 3 * aa)
    start = 0.0
    for bend in (bend1, bend2, far):
        end = min(max(bend, start), far)
        turn = _root(slope, start, end) if _value(slope, start) * _value(slope, end) < 0 else end
        for low, high in ((start, turn), (turn, end)):
            if low < high and _value(slope, (low + high) / 2) < 0:
                if _value(f, low) <= 0:
                    return low
                if _value(f, high) <= 0:
                    return _root(f, low, high)
        start = end
    return NEVER


@kernel
def _roots_of_quadratic(c: float, b: float, a: float) -> tuple[float, float]:
    """Return the two real roots of c + b t + a t² in ascending order, (0, 0) if they are complex or equal; a > 0."""
    discriminant = b * b - 4 * a * c
    if discriminant <= 0:
        return 0.0, 0.0
    q = -0.5 * (b + math.copysign(math.sqrt(discriminant), b))
    return min(q / a, c / q), max(q / a, c / q)


@kernel
def _value(p: tuple[float, float, float, float, float], t: float) -> float:
    return p[0] + t * (p[1] + t * (p[2] + t * (p[3] + t * p[4])))


@kernel
def _root(p: tuple[float, float, float, float, float], low: float, high: float) -> float:
    """Return the root of a polynomial that is monotone from low to high and changes sign: bracketed Newton."""
    rises = _value(p, high) > 0
    t = 0.5 * (low + high)
    for _ in range(100):
        value = _value(p, t)
        if (value > 0) == rises:
            high = t
        else:
            low = t
        slope = p[1] + t * (2 * p[2] + t * (3 * p[3] + t * 4 * p[4]))
        closer = t - value / slope if slope != 0 else low
        if not low < closer < high:
            closer = 0.5 * (low + high)
        if closer in (t, low, high):
            break
        t = closer
    return t


@kernel
def time_to_face(
    along: float, v_along: float, a_along: float, off: float, v_off: float, a_off: float, length: float, reach: float
) -> float:
    """Return when a point comes within reach (px) of a straight face, from either side.

    `along` is the point's coordinate along the face, 0 to length (px) between its ends; `off` its signed distance from
    the face's line.
    """
    side = 1.0 if off >= 0 else -1.0
    t = time_to_close(side * off - reach, side * v_off, side * a_off)
    if t < NEVER and 0 <= along + t * (v_along + t * a_along / 2) <= length:
        return t
    # Acceleration can take it round an end to the other side, and back.
    gap, v, a = -side * off - reach, -side * v_off, -side * a_off
    if a < 0 < v and v * v >= 2 * a * gap:
        t = time_to_close(gap, v, a)
        if 0 <= along + t * (v_along + t * a_along / 2) <= length:
            return t
    return NEVER


@kernel
def time_to_leave(x: float, v: float, a: float, low: float, high: float) -> tuple[float, int]:
    """Return when a coordinate leaves the range from low to high, and in which direction: -1 or 1."""
    if a == 0:
        edge, way = (high, 1) if v > 0 else (low, -1)
        return (max(0.0, (edge - x) / v) if v != 0 else NEVER), way
    down, up = time_to_close(x - low, v, a), time_to_close(high - x, -v, -a)
    return (down, -1) if down < up else (up, 1)
