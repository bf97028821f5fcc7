"""The laws of contact that an engine may have, right and wrong: each a name, a formula of six numbers, a sentence.

A law says which six numbers (see `observe`) a contact shows. Some have one parameter, which is read off the numbers
themselves. In sentences, {v} is the parameter and {d} the same in degrees.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np

from sandbox.judge.causes import Cause
from sandbox.judge.observe import AT_END, Met, Singles, Six, When
from sandbox.judge.run import Vectors, dot
from sandbox.judge.thresholds import DOUBLE
from sandbox.state import Bools, Floats, Integers


class Seen:
    """What the formulas are of, (k,) each: contacts s, where they are met, and the six numbers, kg px/s.

    u: px/s, how fast the two approach; due, rub: the right impulse and friction, kg px/s; vi, vj: px/s, before.
    """

    def __init__(self, s: Singles, met: Met) -> None:
        self.s, self.met, self.n, self.vi, self.vj = s, met, met.n, met.vi, met.vj
        self.six, self.u = s.seen(met.n), met.closing
        self.ji, self.jj, self.fi, self.fj, self.si, self.sj = self.six
        self.due, self.rub = s.right(met)
        self.closes, self.pair = self.u > 0, s.pair

    @property
    def before(self) -> Floats:
        """How fast the two approach where the step begins, along the normal, px/s."""
        return dot(self.s.vi - self.s.vj, self.n)

    @property
    def bounces(self) -> Bools:
        """Which are found at the end of a step in which gravity, or damping, has changed how fast the two approach."""
        at_end = self.met.when in (When.END, When.END_PUSHED)
        return (np.abs(self.u - self.before) > DOUBLE * np.abs(self.u)) & at_end

    @property
    def falls(self) -> Floats:
        """How fast gravity makes the first approach, px/s²."""
        return dot(np.asarray(self.s.run.pull), self.n)

    def given(self, impulse: Floats) -> Six:
        """Return the six numbers of an impulse and its friction."""
        return alike(impulse, self.s.friction(self.met, impulse))

    def shares(self, ji: Floats, jj: Floats) -> Six:
        """Return the six numbers of two impulses, with the right friction."""
        return ji, jj, self.rub, self.rub, self.rub, self.rub

    def along(self, n: Vectors, impulse: Floats, rub: Floats) -> Six:
        """Return the six numbers of an impulse and friction along other normals."""
        given = impulse * n + rub * 1j * n
        return alike(dot(given, self.n), dot(given, 1j * self.n), rub)

    def become(self, vi: Vectors, vj: Vectors, spun: Floats | float = 0.0) -> Six:
        """Return the six numbers of other velocities after the contact."""
        ci, cj, mi, mj, t = vi - self.vi, vj - self.vj, self.s.mi, np.where(self.pair, self.s.mj, 0.0), 1j * self.n
        ji, fi, jj, fj = -mi * dot(ci, self.n), -mi * dot(ci, t), mj * dot(cj, self.n), mj * dot(cj, t)
        turns = np.zeros(len(ji)) + spun
        return ji, np.where(self.pair, jj, ji), fi, np.where(self.pair, fj, fi), turns, turns


class Says(NamedTuple):
    """What a law says of contacts: six numbers, the parameter, and which of them it may be said of.

    causes: (k,) if the parameter decides between two.
    """

    six: Six
    value: Floats | None = None
    may: Bools | None = None
    causes: Integers | None = None


Formula = Callable[[Seen], Says]


@dataclass(frozen=True)
class Law:
    """A law. sentence: what is wrong; odd: what another law of as few numbers is likelier than.

    constant: a parameter that is one in all contacts; parting: a law of bodies that do not approach; reads: whether its
    parameter is read off the six numbers.
    """

    name: str
    cause: Cause
    formula: Formula
    sentence: str
    odd: bool = False
    constant: bool = False
    parting: bool = False
    reads: bool = True


def alike(impulse: Floats, friction: Floats, spun: Floats | None = None) -> Six:
    """Return the six numbers of two bodies that get the same, and turn by it."""
    turns = friction if spun is None else spun
    return impulse, impulse, friction, friction, turns, turns


def _sized(value: Floats, small: Cause = Cause.SMALL, large: Cause = Cause.LARGE) -> Integers:
    return np.where(value < 1, small, large)


def _impulse(c: Seen) -> Says:
    k = c.ji / c.due
    twice = (np.abs(k - 1 + c.s.e) < 1e-6) & (c.s.e < 1)  # 1 - e of it: resolved twice, or two contacts
    return Says(c.given(c.ji), k, c.closes & (np.abs(k) > 1e-6), np.where(twice, Cause.UNKNOWN, _sized(k)))


def _restitution(of: Callable[[Floats, Floats], Floats]) -> Formula:
    """Return the law whose restitution is made of both factors in another way than by their product."""

    def formula(c: Seen) -> Says:
        e = of(c.s.ei, c.s.ej)
        impulse = c.due * (1 + e) / (1 + c.s.e)
        return Says(c.given(impulse), e, (np.abs(e - c.s.e) > DOUBLE) & c.closes, _sized(impulse / c.due))

    return formula


def _restitution_before_gravity(c: Seen) -> Says:
    k = (c.ji / c.s.red - c.u) / c.before / c.s.e
    return Says(c.given(c.ji), k, c.bounces & (c.ji > 0) & (k > 0), _sized(k))


def _bounce_in_time(c: Seen) -> Says:
    """Return the impulse of a bounce in time: what a ball has fallen in the wall is due."""
    fallen = (1 + c.s.e) * c.falls * np.maximum(c.met.depth, 0) / c.u
    return Says(c.given(c.s.red * (c.u + np.maximum(0, c.s.e * c.u - fallen))), None, c.bounces & c.closes & ~c.pair)


def _friction(c: Seen) -> Says:
    f = (c.fi + c.fj + c.si + c.sj) / 4
    large = (f * np.sign(c.rub) > np.abs(c.rub)) | (c.rub == 0)
    causes = np.where(large, Cause.FRICTION_LARGE, Cause.FRICTION_SMALL)
    return Says(alike(c.due, f), np.where(c.rub != 0, f / c.rub, f / c.due), c.closes, causes)


def _other_friction(of: Callable[[Floats, Floats], Floats]) -> Formula:
    """Return the law whose factor of friction is made of both in another way than by their product."""

    def formula(c: Seen) -> Says:
        mu = of(c.s.fi, c.s.fj)
        f = c.s.friction(c.met, c.due, mu)
        causes = np.where(np.abs(f) > np.abs(c.rub), Cause.FRICTION_LARGE, Cause.FRICTION_SMALL)
        return Says(alike(c.due, f), mu, (np.abs(f - c.rub) > DOUBLE * np.abs(c.due)) & c.closes, causes)

    return formula


def _turns(first: float, second: float) -> Formula:
    """Return the law by which friction does not turn both balls."""

    def formula(c: Seen) -> Says:
        six = (c.due, c.due, c.rub, c.rub, first * c.rub, np.where(c.pair, second, first) * c.rub)
        return Says(six, None, (c.rub != 0) & (c.pair | (first == second)))

    return formula


def _turning(c: Seen) -> Says:
    larger = np.where(np.abs(c.si) > np.abs(c.sj), c.si, c.sj)
    return Says((c.due, c.due, c.rub, c.rub, c.si, c.sj), larger / c.rub, c.rub != 0)


def _moment(c: Seen) -> Says:
    moment = (c.fi + c.fj) / (c.si + c.sj)
    f = c.s.friction(c.met, c.due, third=1 + 2 / moment)
    return Says(alike(c.due, f, f / moment), moment, (moment > 0.05) & (np.abs(moment - 1) > 1e-6))


def _tangential(c: Seen) -> Says:
    f = (c.fi + c.fj) / 2
    return Says(alike(c.due, f, c.rub), (f - c.rub) / c.due, c.closes)


def _slope(c: Seen) -> Says:
    before = dot(c.vi, 1j * c.n) - c.rub / c.s.mi
    k = 1 + (c.rub - c.fi) / c.s.mi / before
    return Says(alike(c.due, c.fi, c.rub), k, ~c.pair & c.closes & (np.abs(before) > DOUBLE))


def _turned_normal(c: Seen) -> Says:
    n, right = c.s.seen_normal, c.s.right(replace(c.met, n=c.s.seen_normal))
    angle = np.angle(n / c.n)
    return Says(c.along(n, *right), angle, (np.abs(angle) < 0.8) & (np.abs(angle) > 1e-7))


def _along_velocity(c: Seen) -> Says:
    u = c.vi - c.vj
    return Says(c.along(u / np.abs(u), (1 + c.s.e) * c.s.red * np.abs(u), 0 * c.due), None, c.pair)


def _masses(power: int) -> Formula:
    """Return the law by which each velocity changes as if masses were a power of the radius."""

    def formula(c: Seen) -> Says:
        a, b = c.s.ri**power, c.s.rj**power
        change = (1 + c.s.e) * c.u / (1 / a + 1 / b)
        return Says(c.shares(change / a * c.s.mi, change / b * c.s.mj), None, c.pair)

    return formula


def _velocities(of: Callable[[Seen], tuple[Vectors, Vectors]]) -> Formula:
    """Return the law by which velocities become others."""
    return lambda c: Says(c.become(*of(c)), None, c.pair)


def _reflected(v: Vectors, n: Vectors) -> Vectors:
    return v - 2 * dot(v, n) * n


def _swapped_speeds(c: Seen) -> tuple[Vectors, Vectors]:
    """Reflect each and give it the other's speed; a ball at rest is taken to move along x."""
    a, b = (_reflected(np.where(np.abs(v) > 0, v / np.abs(v), 1.0), c.n) for v in (c.vi, c.vj))
    return a * np.abs(c.vj), b * np.abs(c.vi)


def _swapped_tangents(c: Seen) -> tuple[Vectors, Vectors]:
    along = dot(c.vj - c.vi, 1j * c.n) * 1j * c.n
    return c.vi + along, c.vj - along


def _changed_signs(c: Seen) -> tuple[Vectors, Vectors]:
    across = np.abs(c.n.real) >= np.abs(c.n.imag)
    return np.where(across, -c.vi.conj(), c.vi.conj()), np.where(across, -c.vj.conj(), c.vj.conj())


def _merged(c: Seen) -> tuple[Vectors, Vectors]:
    mj = np.where(c.pair, c.s.mj, 0.0)
    centre = (c.s.mi * c.vi + mj * c.vj) / (c.s.mi + mj)
    return centre, centre


def _scaled(c: Seen) -> Says:
    given = c.due * c.n + c.rub * 1j * c.n
    vi, vj = c.vi - given / c.s.mi, np.where(c.pair, c.vj + given / c.s.mj, 0.0)
    seen_i, seen_j = c.s.dvi + c.vi, np.where(c.pair, c.s.dvj + c.vj, 0.0)
    k = (dot(seen_i, vi) + dot(seen_j, vj)) / (np.abs(vi) ** 2 + np.abs(vj) ** 2)
    return Says(c.become(k * vi, k * vj, c.rub), k, (k > 0) & (k < 2))


BOUNCES: Final = ("speed before gravity", "bounce in time")  # right, but for where the contact is found
V: Final = Cause.UNEXPLAINED_IMPULSE
FACTORS: Final[dict[str, Callable[[Floats, Floats], Floats]]] = {  # other ways to make one factor of two
    "the mean of the factors": lambda a, b: (a + b) / 2,
    "the lesser factor": np.minimum,
    "the larger factor": np.maximum,
    "the root of the product": lambda a, b: np.sqrt(a * b),
    "the sum of the factors": lambda a, b: a + b,
    "the first's own factor": lambda a, b: a,
}
LAWS: Final = (
    Law("impulse", Cause.SMALL, _impulse, "The impulse is {v:.4g} of what is due."),
    *(
        Law(f"e: {how}", Cause.LARGE, _restitution(of), f"The restitution is {how}, {{v:.4g}}.", reads=False)
        for how, of in FACTORS.items()
    ),
    Law("no e", Cause.LARGE, _restitution(lambda a, b: 1 + 0 * a), "The restitution is left out.", reads=False),
    Law(
        "while parting",
        Cause.DOUBLE_BOUNCE,
        lambda c: Says(alike(c.due, c.rub), None, c.u < 0),
        "Bodies that part are reversed again.",
        parting=True,
    ),
    Law(
        "speed before gravity",
        Cause.LATE,
        lambda c: Says(c.given(c.s.red * (c.u + c.s.e * c.before)), None, c.bounces),
        "",
    ),
    Law("restitution before gravity", Cause.SMALL, _restitution_before_gravity, "The restitution is {v:.4g} of due."),
    Law("bounce in time", Cause.LATE, _bounce_in_time, ""),
    Law("friction", Cause.FRICTION_SMALL, _friction, "Friction is {v:.4g} of what it should be."),
    Law("no friction", Cause.FRICTION_SMALL, _other_friction(lambda a, b: 0 * a), "Friction is left out.", reads=False),
    Law(
        "no limit",
        Cause.FRICTION_LARGE,
        _other_friction(lambda a, b: np.inf + a),
        "Friction has no limit.",
        reads=False,
    ),
    *(
        Law(
            f"mu: {how}",
            Cause.FRICTION_LARGE,
            _other_friction(of),
            f"Friction's factor is {how}, {{v:.4g}}.",
            reads=False,
        )
        for how, of in FACTORS.items()
    ),
    Law("no turn", V, _turns(0, 0), "Friction does not turn the balls."),
    Law("first not turned", V, _turns(0, 1), "Friction turns only the second of the two."),
    Law("second not turned", V, _turns(1, 0), "Friction turns only the first of the two."),
    Law("turning", V, _turning, "Friction turns the balls {v:.4g} times as much as it should."),
    Law("moment", V, _moment, "The moment of inertia is {v:.4g} of a disc's."),
    Law("tangential", V, _tangential, "Also {v:.4g} of the impulse acts along the tangent.", constant=True),
    Law("slope", V, _slope, "The speed along the wall is {v:.4g} of what it should be.", constant=True),
    Law(
        "push",
        Cause.UNKNOWN,
        lambda c: Says(alike(c.ji, 0 * c.ji), None, ~c.closes & (c.ji > 0)),
        "Pushed while the two part.",
        parting=True,
    ),
    Law("turned normal", Cause.NORMAL, _turned_normal, "The normal is turned by {d:.4g}°.", constant=True),
    Law("along velocity", Cause.NORMAL, _along_velocity, "The impulse is along the velocity, not the normal."),
    Law(
        "second share",
        V,
        lambda c: Says(c.shares(c.due, c.jj), c.jj / c.due, c.pair),
        "The second gets {v:.4g} of its impulse: momentum is not kept.",
        constant=True,
    ),
    Law(
        "first share",
        V,
        lambda c: Says(c.shares(c.ji, c.due), c.ji / c.due, c.pair),
        "The first gets {v:.4g} of its impulse: momentum is not kept.",
        constant=True,
    ),
    Law(
        "masses swapped",
        V,
        lambda c: Says(c.shares(c.due * c.s.mi / c.s.mj, c.due * c.s.mj / c.s.mi), None, c.pair),
        "Each ball is accelerated as if it had the other's mass.",
    ),
    *(
        Law(f"masses {power}", V, _masses(power), f"Masses are taken as {of}.")
        for power, of in enumerate(("equal", "the radius", "the radius squared", "the radius cubed"))
    ),
    Law("swap", V, _velocities(lambda c: (c.vj, c.vi)), "The two swap their whole velocities.", odd=True),
    Law(
        "speeds",
        V,
        _velocities(_swapped_speeds),
        "Each velocity is reflected at the tangent, and the speeds are swapped.",
    ),
    Law(
        "each",
        V,
        _velocities(lambda c: (_reflected(c.vi, c.n), _reflected(c.vj, c.n))),
        "Each velocity is reflected at the tangent by itself.",
        odd=True,
    ),
    Law(
        "tangents",
        V,
        _velocities(_swapped_tangents),
        "The two swap their velocities along the tangent only.",
        odd=True,
        parting=True,
    ),
    Law("reversed", V, _velocities(lambda c: (-c.vi, -c.vj)), "Whole velocities are reversed.", odd=True),
    Law("signs", V, _velocities(_changed_signs), "A component of each velocity changes sign.", odd=True),
    Law("stop", V, _velocities(lambda c: (0 * c.vi, 0 * c.vj)), "Velocities become 0.", odd=True),
    Law("merge", V, _velocities(_merged), "The two go on together, at the velocity of their centre of mass.", odd=True),
    Law("scaled", V, _scaled, "Then whole velocities are {v:.4g} of what they should be.", odd=True, constant=True),
)
BY_NAME: Final = {law.name: law for law in LAWS}


@dataclass(frozen=True)
class Place:
    """What becomes of places besides the flight. cause: None if that is right; free: numbers that it fits."""

    name: str
    cause: Cause | None
    sentence: str
    free: float = 0.0


PLACES: Final = {
    place.name: place
    for place in (
        Place("", None, ""),
        Place("halves", Cause.LATE, "Balls are pushed apart by half of the overlap each."),
        Place("by mass", Cause.LATE, "Balls are pushed apart by their inverse masses."),
        Place("on", Cause.OVERSHOOT, "Balls are put on the wall: their way back is discarded."),
        Place("reflect", None, ""),
        Place("reflect as bounced", None, ""),
        Place("reflect with friction", None, ""),
        Place("mirror", Cause.POSITION_CORRECTION, "Balls are put as far off the wall as they were found in it."),
        Place("begin", Cause.OVERSHOOT, "Balls are put back to where the step began."),
        Place("begin across", Cause.OVERSHOOT, "Balls are put back to where the step began, across the wall."),
        Place("first only", Cause.POSITION_CORRECTION, "Of two that overlap, the first is put outside the second."),
        Place("second only", Cause.POSITION_CORRECTION, "Of two that overlap, the second is put outside the first."),
        Place("pushed", Cause.POSITION_CORRECTION, "Balls are pushed apart, but not to where they should be.", free=1),
        Place("apart", Cause.TELEPORTED, "Balls that do not overlap are put further apart.", free=1),
    )
}  # fmt: skip


def places(s: Singles, met: Met) -> list[tuple[Place, Bools]]:
    """Return what may have become of places, and of which contacts that fits."""
    n, depth, pair, tol, mi = met.n, met.depth, s.pair, s.tol_x, s.mi
    left = np.where(np.isfinite(met.t), s.dt - met.t, 0.0)
    left_i = s.dt if met.when == When.SECOND_MOVED else left  # the first has yet to move
    left_j = s.dt if met.when == When.FIRST_MOVED else left
    di, dj = s.dxi - left_i * s.dvi, np.where(pair, s.dxj - left_j * s.dvj, 0.0)
    mj = np.where(pair, s.mj, 0.0)

    def shifted(a: Vectors | float, b: Vectors | float) -> Bools:
        fits: Bools = np.maximum(np.abs(di - a), np.abs(dj - b)) <= tol
        return fits

    def straight(along: Vectors) -> tuple[Bools, Bools, Bools]:
        """Return which are shifted along a normal only, which of these by the same, and by their inverse masses."""
        a, b = dot(di, along), dot(dj, along)
        only = (np.abs(dot(di, 1j * along)) <= tol) & (np.abs(dot(dj, 1j * along)) <= tol)
        return only, only & (np.abs(a + b) <= tol), only & (np.abs(a * mi + b * mj) <= tol * mi)

    found: dict[str, Bools] = {}
    if met.when == When.END_PUSHED:  # an overlap of before is pushed apart in the step's move
        n0, _ = s.run.geometry(s.at.i, s.at.j, s.xi, s.xj)
        only, _, by_mass = straight(n0)
        return [
            (replace(PLACES["pushed"], cause=None), (by_mass | only & ~pair) & (dot(di, n0) < 0) & (s.depth_before > 0))
        ]
    found[""] = shifted(0, 0)
    if met.when in AT_END:
        inside, u = depth > 0, dot(met.vi, n)
        balls, wall = pair & inside, ~pair & inside
        u = np.where(u > 0, u, np.inf)
        bounced, late, rubbed = -dot(s.dvi, n) / u, np.minimum(depth / u, s.dt), -dot(s.dvi, 1j * n)
        back_i, back_j = s.xi - s.hi, np.where(pair, s.xj - s.hj, 0.0)
        found |= {
            "halves": shifted(-depth / 2 * n, depth / 2 * n) & balls,
            "by mass": shifted(-depth * n * s.red / mi, depth * n * np.where(pair, s.red / s.mj, 0.0)) & balls,
            "on": shifted(-depth * n, 0) & wall,
            "reflect": shifted(-(1 + s.e) * depth * n, 0) & wall,
            "reflect as bounced": shifted(-bounced * depth * n, 0) & wall & (np.abs(bounced - 1 - s.e) > 1e-9),
            "mirror": shifted(-2 * depth * n, 0) & wall & (s.e < 1),
            "reflect with friction": shifted(-(1 + s.e) * depth * n - late * rubbed * 1j * n, 0) & wall,
            "begin": shifted(back_i, back_j),
            "begin across": shifted(dot(back_i, n) * n, 0) & ~pair,
            "first only": shifted(-depth * n, 0) & balls,
            "second only": shifted(0, depth * n) & balls,
        }
    if met.when != When.SHOWN:
        _, same, by_mass = straight(n)
        found["pushed"] = (same | by_mass) & pair & (depth > s.run.tiny)
        found["apart"] = same & pair & (np.abs(depth) <= s.run.tiny)
    return [(PLACES[name], fits) for name, fits in found.items() if fits.any()]
