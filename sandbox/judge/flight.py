"""How an engine flies: the balls that fly as they should, and a habit that most of the others share.

In a step of dt s from the velocity v under gravity g, a ball should come to x + v dt + g dt²/2 and v + g dt. A habit is
another gravity, another integration of it, a drag, a turn of the velocity, another length of step, or a shift. Each is
fitted to the median of all balls and steps, and holds if most of these then fit, and no other fits many more.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.judge.causes import Cause
from sandbox.judge.free_flight import fly_all
from sandbox.judge.law import LAW, Grid, Slows, law
from sandbox.judge.thresholds import DOUBLE, SINGLE
from sandbox.quantity import dot
from sandbox.scene.units import Dimension, Units
from sandbox.state import Bools, Floats, States

MOST: Final = 0.5  # of the balls and steps; fewer are no habit
LESS: Final = 0.5  # of the balls and steps that a habit leaves over; one with more fields must leave less of them
LEAST: Final = 3  # balls and steps, which one of two that are wrong by themselves does not outvote
AGREE: Final = 1e-3  # of a parameter, to which most flights show the same value, if it is what is wrong with them
SIZES: Final = (0, 0), (0, -1), (1, -1), (2, -1), (1, 0)  # powers of the radius and the mass by which a drag may go
ENDS: Final = (Slows.LAST, Slows.FIRST, Slows.BEFORE_MOVE)  # a move may be at the velocity after what slows it down
DRAGS: Final = [(speed, *size) for size in SIZES for speed in (0, 1, -1)][1:]  # the first is a share, as `kept`

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


class Flights(NamedTuple):
    """Steps of an engine of which it is asked how it flies.

    ball: (n,) BALL; gravity: px/s²; before, after: (steps, n) states; dt: (steps,) s; floor: px, below which a
    difference is rounding; moving: (steps, n), which balls fly and show how.
    """

    units: Units
    ball: NDArray[np.void]
    gravity: tuple[float, float]
    before: States
    after: States
    dt: Floats
    floor: float
    moving: Bools

    def fit(self, fields: Mapping[str, float]) -> Bools:
        """Return which balls fly by the law of some fields: (steps, n)."""
        at = flown(self.ball, self.before, self.dt, self.gravity, fields)
        fits: Bools = misses(self.after, self.dt, at) <= self.floor
        return fits


class Legs(NamedTuple):
    """Flights of balls in steps, (k, 2) each, and dt (k, 1) s: start, end, and the velocities and spins (k,) there.

    radius, mass: (k,) px, kg.
    """

    x: Floats
    v: Floats
    x_after: Floats
    v_after: Floats
    spin: Floats
    spin_after: Floats
    dt: Floats
    radius: Floats
    mass: Floats

    @classmethod
    def of(cls, f: Flights) -> "Legs":
        """Return the flights of the balls that move."""
        step, ball = np.nonzero(f.moving)
        x, v, _, spin = (values[step, ball] for values in f.before)
        x_after, v_after, _, spin_after = (values[step, ball] for values in f.after)
        size = f.ball["radius"][ball], f.ball["mass"][ball]
        return cls(x, v, x_after, v_after, spin, spin_after, f.dt[step, None], *size)

    def keep_of_spins(self, share: float) -> bool:
        """Return whether most balls that turn keep a share of their spins."""
        turning = self.spin != 0
        shares = self.spin_after[turning] / self.spin[turning]
        return bool(len(shares) and abs(np.median(shares) - share) <= SINGLE * share)


def flown(
    ball: NDArray[np.void], before: States, dt: Floats, gravity: tuple[float, float], fields: Mapping[str, float]
) -> States:
    """Return the states after steps of free flight. ball: (n,) BALL; fields: of LAW; dt: (steps,) s."""
    after = States.empty(*before.spin.shape)
    after.angle[:] = before.angle
    fly_all(np.array([law(gravity, **fields)], LAW), ball, before, dt, after)
    return after


def noise_of(states: States, dt: Floats) -> float:
    """Return the noise of steps, px, from the precision of the engine's numbers. states: also before; dt: s."""
    position, velocity = states.position[1:], states.velocity[1:]
    single = all(np.array_equal(a, a.astype(np.float32)) for a in (position, velocity))
    fractional = bool((position != np.round(position)).any())
    precision = SINGLE if single and fractional else DOUBLE
    reach = float(np.abs(states.position).max())
    return precision * (reach + float(np.abs(velocity).max() * dt.max()))


def misses(after: States, dt: Floats, at: States) -> Floats:
    """Return how far balls are from where a flight ends, px: (steps, n), of places and of velocities in a step."""
    off = np.abs(after.position - at.position).max(axis=2)
    return np.maximum(off, np.abs(after.velocity - at.velocity).max(axis=2) * dt[:, None])  # type: ignore[no-any-return]


def find_habit(f: Flights, left: float) -> Habit | None:
    """Return how an engine flies; None if too few balls fly to say.

    left: the share of velocities that the engine says its damping leaves after a second.
    """
    if f.moving.sum() < LEAST:
        return None
    falls = ways_to_fall(f.units, f.gravity, float(f.dt[0]))
    fall_so = [f.fit(fall.fields) & f.moving for fall in falls]
    if fall_so[0].sum() > MOST * f.moving.sum():
        return falls[0]
    fall_somehow = np.logical_or.reduce(fall_so)
    best, left_over = None, 1 - MOST
    for habit in _candidates(f.units, Legs.of(f), np.array(f.gravity), f.floor, left):
        as_habit = f.fit(habit.fields)
        without = fall_somehow & ~as_habit  # what only falls has no other habit; the first step may begin otherwise
        over = 1 - as_habit[f.moving].mean()
        if over < left_over and without.any(axis=1).sum() <= 1:
            best, left_over = habit, over * LESS
        if not left_over:
            break
    return best or falls[int(np.argmax([fall.sum() for fall in fall_so]))]._replace(is_known=False)


def _candidates(units: Units, legs: Legs, g: Floats, floor: float, left: float) -> Iterator[Habit]:
    """Return habits to try, the fewest fields first."""
    dt = legs.dt
    if left != 1:
        damping = {"left": left}, f"Damping leaves {100 * left:.4g} % of the velocities each second."
        yield from _slowed(units, g, g, dt, damping, (Slows.AFTER_MOVE, Slows.FIRST, *ENDS), Cause.DAMPING)
    pull = np.median((legs.v_after - legs.v) / dt, axis=0)
    pull[np.abs(pull) * float(dt.max()) ** 2 <= floor] = 0.0
    if g.any() or np.abs(pull).max() > 0:
        yield from _of_gravity(units, legs, g, g)
        if np.abs(pull - g).max() * float(dt.max()) ** 2 > floor:
            yield from _of_gravity(units, legs, g, pull)
    yield from _of_velocity(units, legs, g, g)
    if g.any():
        yield from _of_velocity(units, legs, g, np.zeros(2))
    yield from _of_time(legs, g)
    yield from _of_places(units, legs, g, floor)


def _of_time(legs: Legs, g: Floats) -> Iterator[Habit]:
    """Return habits of another length of step: as places show it, or velocities."""
    way, v, dt = legs.x_after - legs.x - legs.dt * (legs.v + legs.dt * g / 2), legs.v, legs.dt
    clocks = [1 + float(np.median(dot(way, v) / np.maximum(dot(v, v), 1e-300) / dt[:, 0]))]
    if g.any():
        clocks.append(float(np.median(dot((legs.v_after - v) / dt, g[None]) / dot(g, g))))
    for ticks in dict.fromkeys(clocks):
        yield Habit({"clock": ticks}, Cause.TELEPORTED, f"Each step flies for {ticks:.6g} of its length.")


def _of_places(units: Units, legs: Legs, g: Floats, floor: float) -> Iterator[Habit]:
    """Return habits that put balls elsewhere than they fly, in whole px or shifted: those that do it least first."""
    whole, shifted = list[tuple[float, Habit]](), list[tuple[float, Habit]]()
    for theta in (0.5, 1.0, 0.0) if g.any() else (0.5,):
        fall = _fall(units, g, g, theta, legs.dt)
        within = fall if fall.cause else None
        at = legs.x + legs.dt * (legs.v + legs.dt * g * theta)
        for grid, kept, how in ((Grid.ROUNDED, np.rint(at), "rounded"), (Grid.CUT, np.trunc(at), "cut")):
            because = f"Positions are {how} to whole pixels in each step."
            habit = Habit({**fall.fields, "grid": grid}, Cause.TELEPORTED, because, within)
            whole.append((float((kept != legs.x_after).mean()), habit))
        shift = np.median(legs.x_after - at, axis=0)
        shift[np.abs(shift) <= floor] = 0.0
        dx, dy = shift.tolist()
        size = math.hypot(dx, dy)
        further = units.text(Dimension.LENGTH, "{:.3g}", size)
        by = "({:.3g}, {:.3g})".format(*units.scaled(Dimension.LENGTH, dx, dy))
        because = f"Every step puts each ball {further} further than its flight leads, by {by}."
        shifted.append((size, Habit({**fall.fields, "dx": dx, "dy": dy}, Cause.TELEPORTED, because, within)))
    for found in (whole, shifted):
        yield from (habit for _, habit in sorted(found, key=lambda each: each[0]))


def _of_gravity(units: Units, legs: Legs, g: Floats, pull: Floats) -> Iterator[Habit]:
    """Return habits of another gravity, and of other ways to integrate it."""
    x, v, x_after, dt = legs.x, legs.v, legs.x_after, legs.dt
    if (pull != g).any():
        yield _fall(units, g, pull, 0.5, dt)
    if not pull.any():
        return
    theta = float(np.median(dot((x_after - x) / dt - v, pull[None]) / np.maximum(dot(pull, pull), 1e-300) / dt[:, 0]))
    if 0 < abs(2 * theta - 1) < 1.5:
        yield _fall(units, g, pull, 0.5 + math.copysign(0.5 / round(1 / abs(2 * theta - 1)), theta - 0.5), dt)


def _fall(units: Units, g: Floats, pull: Floats, theta: float, dt: Floats) -> Habit:
    """Return the habit of a gravity `pull` where it should be g, px/s², integrated in a way. theta: of LAW; dt: s."""
    fields, says = dict[str, float](), list[str]()
    if (pull != g).any():
        fields |= {"gx": float(pull[0]), "gy": float(pull[1])}
        by = units.text(Dimension.ACCELERATION, "({:.6g}, {:.6g})", *pull)
        due = "({:.6g}, {:.6g})".format(*units.scaled(Dimension.ACCELERATION, *g))
        accelerated = f"Balls in flight accelerate by {by}, where the scene's gravity is {due}."
        says.append(accelerated if pull.any() else "Balls in flight do not fall: gravity is left out.")
    if theta != 0.5 and pull.any():
        fields |= {"theta": theta}
        says.append(integrated(units, theta, pull, dt))
    return Habit(fields, Cause.GRAVITY if fields else None, " ".join(says))


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
    thetas = (0.5, 0.0, 1.0) if pull.any() else (0.5,)
    return [_fall(units, pull, pull, theta, np.array([dt])) for theta in thetas]


def _of_velocity(units: Units, legs: Legs, g: Floats, pull: Floats) -> Iterator[Habit]:
    """Return habits that slow velocities down, or turn them, under a gravity `pull` where it should be g."""
    v, fall, after, dt = legs.v, legs.dt * pull, legs.v_after, legs.dt
    for whole, slowed, orders in ((v + fall, after, ENDS), (v, after - fall, (Slows.FIRST, Slows.AFTER_MOVE))):
        for slower in _slower(units, legs, _complex(whole), _complex(slowed)):
            yield from _slowed(units, g, pull, dt, slower, orders, Cause.UNREPORTED)


def _slowed(
    units: Units,
    g: Floats,
    pull: Floats,
    dt: Floats,
    slower: tuple[Mapping[str, float], str],
    orders: Sequence[Slows],
    cause: Cause,
) -> Iterator[Habit]:
    """Return the habits of what slows velocities down, in some orders, with each way to integrate gravity."""
    fields, because = slower
    for slows in orders:
        for theta in (1.0,) if slows == Slows.BEFORE_MOVE else (0.5, 1.0, 0.0) if pull.any() else (0.5,):
            fall = _fall(units, g, pull, theta, dt)
            all_fields = {**fields, **fall.fields, "slows_first": slows, "theta": theta}
            yield Habit(all_fields, cause, because, fall if fall.cause else None)


def _slower(units: Units, legs: Legs, whole: Complexes, slowed: Complexes) -> Iterator[tuple[Mapping[str, float], str]]:
    """Return fields of LAW, and their sentences, by which whole velocities become slowed ones, px/s: (k,)."""
    moves = whole != 0
    by, speed, dt = slowed[moves] / whole[moves], np.abs(whole[moves]), legs.dt[moves, 0]
    kept, veer = _agreed(np.abs(by)), _agreed(np.angle(by))
    if kept is not None:
        spins_too = legs.keep_of_spins(kept)
        slower = {"kept": kept, "kept_spin": kept if spins_too else 1.0}
        much = f"Every step multiplies velocities{' and spins' * spins_too} by {kept:.6g}, without a contact."
        yield slower, much
    if veer is not None:
        turned, far = {"veer": veer}, f"Every step turns velocities by {np.degrees(veer):.4g}°, without a contact."
        yield turned, far
    if kept is not None and veer is not None:
        yield slower | turned, f"{much} {far}"
    for axis, part in (("x", np.real), ("y", np.imag)):
        share = _agreed(part(slowed)[part(whole) != 0] / part(whole)[part(whole) != 0])
        if share:
            along = f"Every step multiplies velocities along {axis} by {share:.6g}, without a contact."
            yield {"kept_y": share} if axis == "y" else {"kept": share, "kept_y": 1 / share}, along
    lost = (1 - np.abs(by)) / dt
    for by_speed, by_radius, by_mass in DRAGS:
        size = legs.radius[moves] ** by_radius * legs.mass[moves] ** by_mass
        drag = _agreed(lost / (speed**by_speed * size))
        if drag:
            fields = {"drag": drag, "by_speed": by_speed, "by_radius": by_radius, "by_mass": by_mass}
            yield fields, _of_drag(units, drag, by_speed, by_radius, by_mass)


def _agreed(values: Floats) -> float | None:
    """Return the median of some values, None if most are not that."""
    if not len(values):
        return None
    median = float(np.median(values))
    return median if np.median(np.abs(values - median)) <= AGREE * abs(median) else None


def _of_drag(units: Units, drag: float, by_speed: int, by_radius: int, by_mass: int) -> str:
    """Return the sentence on a drag. by_speed, by_radius, by_mass: the powers of what its share goes by."""
    value = abs(drag) / units.factor(Dimension.LENGTH) ** (by_speed + by_radius)
    powers = ("v", by_speed + 1), ("r", by_radius), ("1/m", -by_mass)
    factors = [f"{value:.4g}", *(f"{name}{'²' * (power == 2)}" for name, power in powers if power)]
    size = ", ".join(["r its radius"] * bool(by_radius) + ["m its mass"] * bool(by_mass))
    rate = " ".join(factors).replace(" 1/m", " / m")
    of = f" v{f' ({size})' if size else ''}" if len(factors) > 1 else ""
    takes, off = ("takes", "off") if drag > 0 else ("adds", "to")
    return f"Each second of flight {takes} {rate} {units.name(Dimension.VELOCITY)} {off} a ball's speed{of}."


def _complex(v: Floats) -> Complexes:
    return v[:, 0] + 1j * v[:, 1]
