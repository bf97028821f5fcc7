"""The laws of contact that an engine may have, right and wrong: each a name, a formula of six numbers, a sentence.

A law says which six numbers (see `observe`) a contact shows. Some have one parameter, which is read off the numbers
themselves, or given. In sentences, {v} is the parameter and {d} the same in degrees.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Final, NamedTuple

import numpy as np

from sandbox.judge.causes import Cause
from sandbox.judge.observe import SIGN, Bodies, Met, Singles, Six, When, turn_of
from sandbox.judge.run import Vectors, dot
from sandbox.judge.thresholds import DOUBLE, NEGLIGIBLE
from sandbox.state import Bools, Floats, Integers


class Says(NamedTuple):
    """What a law says of contacts: six numbers, the parameter, and which of them it may be said of.

    causes: (k,) if the parameter decides between two.
    """

    six: Six
    value: Floats | None = None
    may: Bools | bool = True
    causes: Integers | None = None


Value = Floats | float | None  # of a law's parameter; None to read it off the six numbers
Formula = Callable[[Met, Value], Says]


@dataclass(frozen=True)
class Law:
    """A law. sentence: what is wrong.

    reads: whether its parameter is read off the six numbers; constant: likewise, and it is one in all contacts;
    parting: a law of bodies that do not approach; of_pairs: of two balls only.
    """

    name: str
    cause: Cause
    formula: Formula
    sentence: str
    reads: bool = False
    constant: bool = False
    parting: bool = False
    of_pairs: bool = False


def six_of(impulse: Floats, friction: Floats, spun: Floats | None = None) -> Six:
    """Return the six numbers of two bodies, (k,) for both or (2, k); spun: as friction by default."""
    six = np.empty((3, 2, np.shape(impulse)[-1]))
    six[0], six[1], six[2] = impulse, friction, friction if spun is None else spun
    return six


def _given(c: Met, impulse: Floats) -> Six:
    """Return the six numbers of an impulse and its friction."""
    return six_of(impulse, c.friction(impulse))


def _sized(value: Floats) -> Integers:
    return np.where(value < 1, Cause.SMALL, Cause.LARGE)


def _bounces(c: Met) -> Bools:
    """Return which are found at the end of a step in which gravity, or damping, has changed how fast two approach."""
    return (np.abs(c.u - c.started) > DOUBLE * np.abs(c.u)) & (c.when == When.END)


def _impulse(c: Met, k: Value) -> Says:
    value: Floats = c.six[0, 0] / c.due if k is None else k + 0 * c.due
    twice = (np.abs(value - 1 + c.b.e) < NEGLIGIBLE) & (c.b.e < 1)  # 1 - e of it: resolved twice, or two contacts
    may = c.closes & (np.abs(value) > NEGLIGIBLE)
    return Says(_given(c, value * c.due), value, may, np.where(twice, Cause.UNKNOWN, _sized(value)))


def _restitution(of: Callable[[Floats], Floats], *, equal: bool = True, unequal: bool = True) -> Formula:
    """Return the law whose restitution is made of both factors, (2, k), in another way than by their product.

    equal, unequal: whether it may be said of factors that are: most ways make the same of equal ones.
    """

    def formula(c: Met, _: Value) -> Says:
        e = of(c.b.es)
        impulse = c.due * (1 + e) / (1 + c.b.e)
        may = (np.abs(e - c.b.e) > DOUBLE) & np.where(c.b.es[0] == c.b.es[1], equal, unequal)
        return Says(_given(c, impulse), e, may & c.closes, _sized(impulse / c.due))

    return formula


def _speed_before_gravity(c: Met, _: Value) -> Says:
    return Says(_given(c, c.b.red * (c.u + c.b.e * c.started)), may=_bounces(c))


def _bounce_in_time(c: Met, _: Value) -> Says:
    """Return the impulse of a bounce in time: what a ball has fallen in the wall is due."""
    fallen = (1 + c.b.e) * dot(np.asarray(c.pull), c.n) * np.maximum(c.depth, 0) / c.u
    return Says(_given(c, c.b.red * (c.u + np.maximum(0, c.b.e * c.u - fallen))), may=_bounces(c) & c.closes & ~c.pair)


def _friction(c: Met, k: Value) -> Says:
    f = c.six[1:].mean(axis=(0, 1)) if k is None else k * c.rub
    large = (f * np.sign(c.rub) > np.abs(c.rub)) | (c.rub == 0)
    causes = np.where(large, Cause.FRICTION_LARGE, Cause.FRICTION_SMALL)
    return Says(six_of(c.due, f), np.where(c.rub != 0, f / c.rub, f / c.due), c.closes, causes)


def _other_friction(of: Callable[[Floats], Floats]) -> Formula:
    """Return the law whose factor of friction is made of both, (2, k), in another way than by their product."""

    def formula(c: Met, _: Value) -> Says:
        mu = of(c.b.mus)
        f = c.friction(c.due, mu)
        causes = np.where(np.abs(f) > np.abs(c.rub), Cause.FRICTION_LARGE, Cause.FRICTION_SMALL)
        return Says(six_of(c.due, f), mu, (np.abs(f - c.rub) > DOUBLE * np.abs(c.due)) & c.closes, causes)

    return formula


def _no_turn(c: Met, _: Value) -> Says:
    return Says(six_of(c.due, c.rub, 0 * c.rub), may=c.rub != 0)


def _tangential(c: Met, k: Value) -> Says:
    f = c.six[1].mean(axis=0) if k is None else c.rub + k * c.due
    return Says(six_of(c.due, f, c.rub), (f - c.rub) / c.due, c.closes)


def _turned_normal(c: Met, angle: Value) -> Says:
    turn = turn_of(c.six) if angle is None else angle + 0 * c.due
    other = Met(c.b, c.when, c.t, c.n * np.exp(1j * turn), c.depth, c.v, c.w, 0 * c.n, c.pull)
    given = (other.due + 1j * other.rub) * np.exp(1j * turn)  # in the frame of the right normal
    return Says(six_of(given.real, given.imag, other.rub), turn, (np.abs(turn) < 0.8) & (np.abs(turn) > 1e-7))


def _share(of: int) -> Formula:
    """Return the law by which one body gets a share of its impulse."""

    def formula(c: Met, k: Value) -> Says:
        impulses = np.stack([c.due, c.due])
        impulses[of] = c.six[0, of] if k is None else k * c.due
        return Says(six_of(impulses, c.rub), impulses[of] / c.due)

    return formula


def _not_reduced(of: Callable[[Floats], Floats]) -> Formula:
    """Return the law that takes another mass, made of both, (2, k) kg, for the reduced mass."""

    def formula(c: Met, _: Value) -> Says:
        impulse = c.due * of(c.b.m) / c.b.red
        return Says(_given(c, impulse), may=c.closes & (c.b.m[0] != c.b.m[1]))

    return formula


def _masses(of: Callable[[Bodies], Floats]) -> Formula:
    """Return the law by which each velocity changes as if both had other masses, (2, k)."""

    def formula(c: Met, _: Value) -> Says:
        inverse = 1 / of(c.b)
        return Says(six_of((1 + c.b.e) * c.u / inverse.sum(axis=0) * inverse * c.b.m, c.rub))

    return formula


def _while_parting(c: Met, _: Value) -> Says:
    return Says(six_of(c.due, c.rub), may=c.u < 0)


BOUNCES: Final = ("speed before gravity", "bounce in time")  # right, but for where the contact is found
SMALL, LARGE, NORMAL, V = Cause.SMALL, Cause.LARGE, Cause.NORMAL, Cause.UNEXPLAINED_IMPULSE
Two = partial(Law, of_pairs=True)
ONE_MASS: Final = "The mass of one ball is taken for the reduced mass of both."
Unequal = partial(_restitution, equal=False)
LAWS: Final = (
    Law("impulse", SMALL, _impulse, "The impulse is {v:.4g} of what is due.", constant=True),
    Law("no e", LARGE, _restitution(lambda es: 1 + 0 * es[0]), "The restitution is left out."),
    Law("one e", LARGE, _restitution(lambda es: es[0], unequal=False), "Restitution is {v:.4g}, one factor of two."),
    Law("larger e", LARGE, Unequal(np.maximum.reduce), "Restitution is the larger factor, {v:.4g}."),
    Law("smaller e", LARGE, Unequal(np.minimum.reduce), "Restitution is the smaller factor, {v:.4g}."),
    Law("mean e", LARGE, Unequal(lambda es: es.mean(axis=0)), "Restitution is the mean of both factors, {v:.4g}."),
    Law("while parting", Cause.DOUBLE_BOUNCE, _while_parting, "Bodies that part are reversed again.", parting=True),
    Law("speed before gravity", Cause.LATE, _speed_before_gravity, ""),
    Law("bounce in time", Cause.LATE, _bounce_in_time, ""),
    Law("friction", Cause.FRICTION_SMALL, _friction, "Friction is {v:.4g} of what it should be.", reads=True),
    Law("no friction", Cause.FRICTION_SMALL, _other_friction(lambda mus: 0 * mus[0]), "Friction is left out."),
    Law("no limit", Cause.FRICTION_LARGE, _other_friction(lambda mus: np.inf + mus[0]), "Friction has no limit."),
    Law("sum of mu", Cause.FRICTION_LARGE, _other_friction(np.add.reduce), "Friction's factors are added."),
    Law("no turn", V, _no_turn, "Friction does not turn the balls."),
    Law("tangential", V, _tangential, "Also {v:.4g} of the impulse acts along the tangent.", constant=True),
    Law("turned normal", NORMAL, _turned_normal, "The normal is turned by {d:.4g}°.", constant=True),
    Two("second share", V, _share(1), "The second gets {v:.4g} of its impulse: momentum is not kept.", constant=True),
    Two("first share", V, _share(0), "The first gets {v:.4g} of its impulse: momentum is not kept.", constant=True),
    Two("first's mass", LARGE, _not_reduced(lambda m: m[0]), ONE_MASS),
    Two("second's mass", LARGE, _not_reduced(lambda m: m[1]), ONE_MASS),
    Two("both masses", LARGE, _not_reduced(np.add.reduce), "The sum of both masses is taken for the reduced mass."),
    Two("masses swapped", V, _masses(lambda b: b.m[::-1]), "Each ball is accelerated as if it had the other's mass."),
    Two("masses 0", V, _masses(lambda b: b.r**0), "Masses are taken as equal."),
    Two("masses 2", V, _masses(lambda b: b.r**2), "Masses are taken as the radius squared."),
    Two("masses 3", V, _masses(lambda b: b.r**3), "Masses are taken as the radius cubed."),
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
        Place("mirror", Cause.POSITION_CORRECTION, "Balls are mirrored at the wall, as if they lost no speed."),
        Place("begin across", Cause.OVERSHOOT, "Balls are put back to where the step began, across the wall."),
        Place("pushed", Cause.POSITION_CORRECTION, "Balls are pushed apart, but not to where they should be.", free=1),
        Place("beyond", Cause.POSITION_CORRECTION, "Balls are put out of walls further than they bounce.", free=1),
        Place("apart", Cause.TELEPORTED, "Balls that do not overlap are put further apart.", free=1),
    )
}


def shifts_of(c: Met, dv: Vectors, back: Vectors, dt: Floats) -> dict[str, tuple[Vectors, Bools]]:
    """Return by what places at the end of a step may be shifted, (2, k) px, by name, and of which contacts.

    dv: (2, k) px/s, by which the contact changes velocities; back: (2, k) px, to where the step began.
    """
    n, e, inside, u = c.n, c.b.e, c.depth > 0, np.where(c.u > 0, c.u, np.inf)
    balls, wall, out, first = c.pair & inside, ~c.pair & inside, c.depth * n, np.array([[1.0], [0.0]])
    bounced, rubbed = -dot(dv[0], n) / u, -dot(dv[0], 1j * n)
    late = np.minimum(c.depth / u, dt)
    return {
        "halves": (SIGN * out / 2, balls),
        "begin across": (first * dot(back[0], n) * n, ~c.pair),
        "by mass": (SIGN * out * c.b.red * c.b.inverse, balls),
        "on": (-first * out, wall),
        "mirror": (-first * 2 * out, wall & (e < 1)),
        "reflect": (-first * (1 + e) * out, wall),
        "reflect as bounced": (-first * bounced * out, wall & (np.abs(bounced - 1 - e) > DOUBLE)),
        "reflect with friction": (-first * ((1 + e) * out + late * rubbed * 1j * n), wall),
    }


def places(s: Singles, c: Met) -> list[tuple[Place, Bools]]:
    """Return what may have become of places, and of which contacts that fits."""
    n, tol, pair = c.n, s.tol_x, s.pair
    left = np.where(np.isfinite(c.t), s.dt - c.t, 0.0)
    off = s.dx - left * s.dv

    found = {"": (np.abs(off) <= tol).all(axis=0)}
    if c.when == When.END:
        for name, (shift, may) in shifts_of(c, s.dv, s.x - s.h, s.dt).items():
            found[name] = (np.abs(off - shift) <= tol).all(axis=0) & may
    if c.when != When.SHOWN:
        (a, b), only = dot(off, n), (np.abs(dot(off, 1j * n)) <= tol).all(axis=0)  # along the normal
        same, by_mass = np.abs(a + b) <= tol, np.abs(a + b * s.m[1] / s.m[0]) <= tol
        flies_on, is_deep = np.abs(s.dv[0]) <= s.tol, c.depth > s.run.tiny
        found["pushed"] = only & np.where(pair, same | by_mass, (a < 0) & flies_on) & is_deep
        further = (a < -(1 + c.b.e) * c.depth) & ~flies_on
        found["beyond"] = only & ~pair & further & is_deep & (c.when == When.END)
        found["apart"] = only & pair & same & (np.abs(c.depth) <= s.run.tiny)
    return [(PLACES[name], fits) for name, fits in found.items() if fits.any()]
