"""How an engine flies: the balls that fly as they should, and a habit that most of the others share.

In a step of dt s from the velocity v under gravity g, a ball should come to x + v dt + g dt²/2 and v + g dt. A habit is
another gravity, another integration of it, a share of the velocity that is lost, a turn of the velocity, another length
of step, or a shift. Each is fitted to the median of all balls and steps, and holds if most of these then fit.
"""

import math
from collections.abc import Iterator, Mapping
from itertools import chain
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.judge.causes import Cause
from sandbox.judge.law import Slows
from sandbox.judge.thresholds import SINGLE
from sandbox.quantity import dot, length
from sandbox.scene.units import Dimension, Units
from sandbox.state import Bools, Floats, States

MOST: Final = 0.5  # of the balls and steps; fewer are no habit
LEAST: Final = 3  # balls and steps, which one of two that are wrong by themselves does not outvote

Complexes = NDArray[np.complex128]


class Habit(NamedTuple):
    """How an engine flies.

    fields: of LAW; cause: what is wrong, None if nothing; because: a sentence; within: the habit to which this one adds
    what it is called for, None if that is all; is_known: whether most balls fly so.
    """

    fields: Mapping[str, float]
    cause: Cause | None = None
    because: str = ""
    within: "Habit | None" = None
    is_known: bool = True

    @property
    def is_integrated(self) -> bool:
        """Whether all that is wrong with gravity is that it is integrated in steps."""
        return self.fields.get("theta", 0.5) != 0.5 and "gx" not in self.fields


class Legs(NamedTuple):
    """Flights of balls in steps, (k, 2) each, and dt (k, 1) s: start, end, and the velocities and spins (k,) there."""

    x: Floats
    v: Floats
    x_after: Floats
    v_after: Floats
    spin: Floats
    spin_after: Floats
    dt: Floats

    def keep_of_spins(self, share: float) -> bool:
        """Return whether most balls that turn keep a share of their spins."""
        turning = self.spin != 0
        shares = self.spin_after[turning] / self.spin[turning]
        return bool(len(shares) and abs(np.median(shares) - share) <= SINGLE * share)


def flown(
    before: States, dt: Floats, fields: Mapping[str, float], gravity: tuple[float, float]
) -> tuple[Floats, Floats]:
    """Return positions and velocities after steps of free flight, (steps, n, 2) each. fields: of LAW. dt: (steps,)."""
    get = fields.get
    g = np.array([get("gx", gravity[0]), get("gy", gravity[1])])
    dt = dt[:, None, None] * get("clock", 1.0)
    kept = get("kept", 1.0) * np.exp(1j * get("veer", 0.0)) * get("left", 1.0) ** dt[..., 0]
    x, v = before.position, before.velocity
    slows = get("slows_first", Slows.LAST)
    if slows == Slows.BEFORE_MOVE:
        v = _turned(v + dt * g, kept)
        return x + dt * v, v
    if slows == Slows.FIRST:
        v = _turned(v, kept)
    x = x + dt * v + get("theta", 0.5) * dt**2 * g + np.array([get("dx", 0.0), get("dy", 0.0)])
    if slows == Slows.AFTER_MOVE:
        v = _turned(v, kept)
    v = v + dt * g
    return x, _turned(v, kept) if slows == Slows.LAST else v


def _turned(v: Floats, by: Complexes) -> Floats:
    z = (v[..., 0] + 1j * v[..., 1]) * by
    return np.stack([z.real, z.imag], axis=-1)


def misses(after: States, dt: Floats, at: tuple[Floats, Floats]) -> Floats:
    """Return how far balls are from where a flight ends, px: (steps, n), of places and of velocities in a step."""
    x, v = at
    off = np.abs(after.position - x).max(axis=2)
    return np.maximum(off, np.abs(after.velocity - v).max(axis=2) * dt[:, None])  # type: ignore[no-any-return]


def find_habit(
    units: Units,
    before: States,
    after: States,
    dt: Floats,
    gravity: tuple[float, float],
    floor: float,
    free: Bools,
    left: float,
) -> Habit | None:
    """Return how an engine flies, in a block of its steps; None if too few balls fly to say.

    free: (steps, n), whether a ball touches nothing; left: the share of velocities that the engine says its damping
    leaves after a second.
    """
    right = Habit({})
    fits = _fits(before, after, dt, right, gravity, floor)
    moving = free & ((length(before.velocity) * dt[:, None] > floor) | any(gravity))
    if moving.sum() < LEAST:
        return None
    if fits[moving].mean() > MOST:
        return right
    times = np.broadcast_to(dt[:, None], moving.shape)[moving][:, None]
    x, v, _, spin = (values[moving] for values in before)
    x_after, v_after, _, spin_after = (values[moving] for values in after)
    legs = Legs(x, v, x_after, v_after, spin, spin_after, times)
    g = np.array(gravity)
    habits: Iterator[Habit] = chain(
        _damped(units, left, g, times) if left != 1 else (), _candidates(units, legs, g, floor)
    )
    for habit in habits:
        as_habit = _fits(before, after, dt, habit, gravity, floor)
        without = fits & ~as_habit & moving  # flights that are right have no habit; the first step may begin otherwise
        if as_habit[moving].mean() > MOST and without.any(axis=1).sum() <= 1:
            return habit
    return right._replace(is_known=False)


def _fits(before: States, after: States, dt: Floats, habit: Habit, gravity: tuple[float, float], floor: float) -> Bools:
    fits: Bools = misses(after, dt, flown(before, dt, habit.fields, gravity)) <= floor
    return fits


def _candidates(units: Units, legs: Legs, g: Floats, floor: float) -> Iterator[Habit]:
    """Return habits to try, the fewest fields first."""
    x, v, x_after, v_after, _, _, dt = legs
    change = (v_after - v) / dt
    pull = np.median(change, axis=0)
    pull[np.abs(pull) * float(dt.max()) ** 2 <= floor] = 0.0
    if g.any() or np.abs(pull).max() > 0:
        yield from _of_gravity(units, legs, g, g)
        if np.abs(pull - g).max() * float(dt.max()) ** 2 > floor:
            yield from _of_gravity(units, legs, g, pull)
    yield from _of_velocity(legs, g)
    way = x_after - x - dt * (v + dt * g / 2)
    clock = 1 + float(np.median(dot(way, v) / np.maximum(dot(v, v), 1e-300) / dt[:, 0]))
    for ticks in dict.fromkeys((clock, *_clock_of(change, g))):
        yield Habit({"clock": ticks}, Cause.TELEPORTED, f"Each step flies for {ticks:.6g} of its length.")
    shift = np.median(way, axis=0)
    size = np.hypot(*shift)
    further = units.text(Dimension.LENGTH, "{:.3g}", size)
    by = "({:.3g}, {:.3g})".format(*units.scaled(Dimension.LENGTH, *shift))
    because = f"Every step puts each ball {further} further than its flight leads, by {by}."
    yield Habit({"dx": float(shift[0]), "dy": float(shift[1])}, Cause.TELEPORTED, because)


def _clock_of(change: Floats, g: Floats) -> list[float]:
    return [float(np.median(dot(change, g[None]) / dot(g, g)))] if g.any() else []


def _of_gravity(units: Units, legs: Legs, g: Floats, pull: Floats) -> Iterator[Habit]:
    """Return habits of another gravity, and of other ways to integrate it."""
    x, v, x_after, _, _, _, dt = legs
    fields = {"gx": float(pull[0]), "gy": float(pull[1])}
    by = units.text(Dimension.ACCELERATION, "({:.6g}, {:.6g})", *pull)
    due = "({:.6g}, {:.6g})".format(*units.scaled(Dimension.ACCELERATION, *g))
    accelerated = f"Balls in flight accelerate by {by}, where the scene's gravity is {due}."
    wrong = bool((pull != g).any())
    if wrong:
        yield Habit(
            fields, Cause.GRAVITY, accelerated if pull.any() else "Balls in flight do not fall: gravity is left out."
        )
    if not pull.any():
        return
    theta = float(np.median(dot((x_after - x) / dt - v, pull[None]) / np.maximum(dot(pull, pull), 1e-300) / dt[:, 0]))
    if not 0 < abs(2 * theta - 1) < 1.5:
        return
    theta = 0.5 + math.copysign(0.5 / round(1 / abs(2 * theta - 1)), theta - 0.5)
    because = integrated(units, theta, pull, dt)
    yield Habit(fields | {"theta": theta}, Cause.GRAVITY, f"{accelerated} {because}" if wrong else because)


def integrated(units: Units, theta: float, pull: Floats, dt: Floats) -> str:
    """Return the sentence on gravity that is integrated in steps. theta: of LAW; pull: (2,) px/s²; dt: s, of steps."""
    substeps = round(1 / abs(2 * theta - 1))
    steps = "steps" if substeps == 1 else f"{substeps} substeps a step"
    how = "the velocity after it" if theta > 0.5 else "the velocity before it"
    factor = units.factor(Dimension.LENGTH) * abs(theta - 0.5) * float(np.hypot(*pull))
    low, high = (f"{factor * t**2:.3g}" for t in (dt.min(), dt.max()))
    off = f"{low} {units.length}" if low == high else f"{low} to {high} {units.length}"
    return (
        f"Gravity is integrated in {steps}, which move balls at {how}: each step ends {off} "
        f"{'beyond' if theta > 0.5 else 'short of'} the parabola."
    )


def ways_to_fall(units: Units, gravity: tuple[float, float], dt: float) -> list[Habit]:
    """Return how engines may integrate gravity that show no flight: the parabola, and at either velocity."""
    pull = np.array(gravity)
    stepped = (
        Habit({"theta": theta}, Cause.GRAVITY, integrated(units, theta, pull, np.array([dt]))) for theta in (0.0, 1.0)
    )
    return [Habit({}), *(stepped if pull.any() else ())]


def _damped(units: Units, left: float, g: Floats, dt: Floats) -> Iterator[Habit]:
    """Return the habits of an engine whose damping leaves a share of velocities after a second."""
    because = f"Damping leaves {100 * left:.4g} % of the velocities each second."
    for slows in (Slows.AFTER_MOVE, Slows.FIRST, Slows.LAST, Slows.BEFORE_MOVE):
        for theta in (0.0, 0.5, 1.0) if g.any() else (0.5,):
            fields = {"left": left, "slows_first": slows, "theta": theta}
            fall = Habit({"theta": theta}, Cause.GRAVITY, integrated(units, theta, g, dt)) if theta != 0.5 else None
            yield Habit(fields, Cause.DAMPING, because, fall)


def _of_velocity(legs: Legs, g: Floats) -> Iterator[Habit]:
    """Return habits that change velocities by a share of them, or turn them."""
    _, v, _, v_after, _, _, dt = legs
    before, fallen, after = (_complex(z) for z in (v, v + dt * g, v_after))
    for slows, slowed, whole in ((Slows.LAST, after, fallen), (Slows.FIRST, after - _complex(dt * g), before)):
        by = slowed[whole != 0] / whole[whole != 0]
        if not len(by):
            continue
        kept, veer = float(np.median(np.abs(by))), float(np.median(np.angle(by)))
        spins_too = legs.keep_of_spins(kept)
        slower, turned = {"kept": kept, "kept_spin": kept if spins_too else 1.0}, {"veer": veer}
        much = f"Every step multiplies velocities{' and spins' * spins_too} by {kept:.6g}, without a contact."
        far = f"Every step turns velocities by {np.degrees(veer):.4g}°, without a contact."
        for fields, because in ((slower, much), (turned, far), (slower | turned, f"{much} {far}")):
            for theta in (0.5, 1.0, 0.0) if g.any() else (0.5,):
                more = {"slows_first": slows, "theta": theta}
                yield Habit(fields | more, Cause.UNREPORTED, because)
                if slows == Slows.LAST:  # the move is at the velocity after
                    yield Habit(fields | more | {"slows_first": Slows.FIRST}, Cause.UNREPORTED, because)
                    yield Habit(fields | {"slows_first": Slows.BEFORE_MOVE, "theta": 1.0}, Cause.UNREPORTED, because)
                else:
                    yield Habit(fields | more | {"slows_first": Slows.AFTER_MOVE}, Cause.UNREPORTED, because)


def _complex(v: Floats) -> Complexes:
    return v[:, 0] + 1j * v[:, 1]
