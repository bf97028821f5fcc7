"""How an engine flies: one law of velocities and one of places, fitted to all flights of a run that touch nothing."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np

from sandbox.judge.causes import Cause
from sandbox.judge.run import Flights, Run, Vectors, dot
from sandbox.judge.thresholds import ALIKE, DOUBLE
from sandbox.state import Bools, Floats, Integers

FEW: Final = 3  # flights, of which no law is read
MOST: Final = 20_000  # flights that a law is read from
SCHEMES: Final = (0.0, 0.5, 1.0, *(0.5 + s * 0.5 / k for k in range(2, 65) for s in (1, -1)))  # of gravity, in k parts
BY_BALL: Final[tuple[tuple[str, Callable[[Flights], Floats]], ...]] = (
    ("", lambda f: np.ones(len(f.r))),
    (" r", lambda f: f.r),
    (" / m", lambda f: 1 / f.m),
    (" r / m", lambda f: f.r / f.m),
    (" r² / m", lambda f: f.r**2 / f.m),
)
BY_SPEED: Final = ((" v²", 1), ("", -1), (" v", 0))  # the power of v in the share of the speed that a drag takes


@dataclass(frozen=True)
class SpeedLaw:
    """How velocities change in a flight: velocity(f), (k,) px/s.

    cause: None if that is right; name, values: of the sentence in `words`; factor: what velocities are multiplied by,
    if that is all.
    """

    velocity: Callable[[Flights], Vectors]
    cause: Cause | None = None
    name: str = ""
    values: tuple[float, ...] = ()
    factor: complex = 1.0


@dataclass(frozen=True)
class PlaceLaw:
    """Where flights end: place(f, w), (k,) px, w their velocities then. clock: the share of a step that they take."""

    place: Callable[[Flights, Vectors], Vectors]
    cause: Cause | None = None
    name: str = ""
    values: tuple[float, ...] = ()
    clock: float = 1.0


@dataclass(frozen=True)
class Habit:
    """How an engine flies. kept: the share of its spin that a ball keeps in a step."""

    speed: SpeedLaw
    place: PlaceLaw
    kept: float = 1.0

    def end(self, flights: Flights) -> tuple[Vectors, Vectors]:
        """Return where flights end, px, and with which velocities, px/s."""
        w = self.speed.velocity(flights)
        return self.place.place(flights, w), w


def by_gravity(f: Flights) -> Vectors:
    """Return the right velocities after flights, px/s."""
    return f.v + f.g * f.dt


def on_parabola(f: Flights, w: Vectors) -> Vectors:
    """Return the right ends of flights, px."""
    return f.x + f.v * f.dt + f.g * f.dt**2 / 2


RIGHT: Final = SpeedLaw(by_gravity), PlaceLaw(on_parabola)


def habit_of(run: Run, free: Bools, damping: float) -> Habit:
    """Return how an engine flies. free: (steps, n), which flights touch nothing; damping: as it declares, a second."""
    step, ball = np.nonzero(free)
    pick = np.unique(np.linspace(0, max(len(step) - 1, 0), MOST).astype(int))[: len(step)]
    step, ball = step[pick], ball[pick]
    moves = np.maximum(np.abs(run.v0[step, ball]), np.abs(run.v[step + 1, ball])) * run.dt[step] > run.floor
    k, i = step[moves], ball[moves]
    if len(k) < FEW:
        return Habit(*RIGHT)
    f, y, w = run.flights(k, i), run.x[k + 1, i], run.v[k + 1, i]
    speed, most = RIGHT[0], 0.5
    for law in _speeds(f, w, run.floor, damping):
        fits = np.mean(np.abs(law.velocity(f) - w) * f.dt <= 1.5 * run.floor)
        if fits > most:
            speed, most = law, (1 + fits) / 2  # a later law must explain most of what this one does not
        if fits == 1:
            break
    place, most = RIGHT[1], 0.5
    for way in _places(f, w, y, run.floor):
        fits = np.mean(np.abs(way.place(f, w) - y) <= 1.5 * run.floor)
        if fits > most and not (place.cause is Cause.GRAVITY and way.cause is Cause.TELEPORTED):
            place, most = way, (1 + fits) / 2
        if fits == 1:
            break
    if place.clock != 1:
        clock = place.clock
        speed = SpeedLaw(lambda f: f.v + f.g * clock * f.dt)
    return replace(Habit(speed, place), kept=_kept(run, step, ball))


def _kept(run: Run, step: Integers, ball: Integers) -> float:
    turning = run.w[step, ball] != 0
    if np.count_nonzero(turning) < FEW:
        return 1.0
    ratio = float(np.median(run.w[step + 1, ball][turning] / run.w[step, ball][turning]))
    return 1.0 if abs(ratio - 1) < DOUBLE else ratio


def _agreed(values: Floats) -> float | None:
    """Return the median of values, None if most are not that."""
    values = values[np.isfinite(values)]
    if len(values) < FEW:
        return None
    median = float(np.median(values))
    return median if np.median(np.abs(values - median)) <= ALIKE * abs(median) else None


def _centre(z: Vectors, least: float = 0.0) -> complex:
    """Return the median of vectors, without a component that is less than some rounding."""
    x, y = float(np.median(z.real)), float(np.median(z.imag))
    return complex(x if abs(x) > least else 0.0, y if abs(y) > least else 0.0)


def _speeds(f: Flights, w: Vectors, floor: float, damping: float) -> Iterator[SpeedLaw]:
    """Yield laws of velocities that flights show, the likelier first. w: px/s, after them."""
    yield RIGHT[0]
    dt = float(np.median(f.dt))
    if damping != 1:
        yield SpeedLaw(
            lambda f: f.v * damping**f.dt + f.g * f.dt, Cause.DAMPING, "damping", (100 * damping,), damping**dt
        )
    pull = _centre((w - f.v) / f.dt, floor / dt**2)
    if abs(pull - f.g) * dt**2 > floor:
        ratio = pull / f.g if f.g else 0j
        name = "no gravity" if not pull else "share of gravity" if ratio.real and abs(ratio.imag) < ALIKE else "pull"
        yield SpeedLaw(lambda f: f.v + pull * f.dt, Cause.GRAVITY, name, (pull.real, pull.imag, ratio.real))
    for first in (True, False) if f.g else (True,):  # gravity before or after what slows balls down
        yield from _factors(f, w, floor, first=first)
    base = by_gravity(f)
    with np.errstate(all="ignore"):
        lost = np.where(np.abs(base) * f.dt > 10 * floor, 1 - np.abs(w) / np.abs(base), np.nan) / f.dt
        for by_ball, size in BY_BALL:
            for by_speed, power in BY_SPEED:
                k = _agreed(lost / (np.abs(base) ** power * size(f)))
                if k is not None and abs(k) > DOUBLE and (power or by_ball):
                    law = partial(_drag, k=k, power=power, size=size)
                    yield SpeedLaw(law, Cause.UNREPORTED, f"drag by{by_speed}{by_ball}", (k,))


def _factors(f: Flights, w: Vectors, floor: float, *, first: bool) -> Iterator[SpeedLaw]:
    """Yield laws that multiply velocities, or one component of them."""
    base, seen = (by_gravity(f), w) if first else (f.v, w - f.g * f.dt)
    dt = float(np.median(f.dt))
    with np.errstate(all="ignore"):
        ratio = np.where(np.abs(base) * f.dt > 10 * floor, seen / base, np.nan)
        x, y = (
            _agreed(np.where(np.abs(part) * f.dt > 10 * floor, of / part, np.nan))
            for part, of in ((base.real, seen.real), (base.imag, seen.imag))
        )
    size, turn = _agreed(np.abs(ratio)), _agreed(np.angle(ratio))
    if size is not None and abs(size * np.exp(1j * (turn or 0)) - 1) > DOUBLE:
        factor = complex(size * np.exp(1j * (turn or 0)))

        def multiplied(f: Flights) -> Vectors:
            return factor * by_gravity(f) if first else factor * f.v + f.g * f.dt

        values = size, size ** (1 / dt), float(np.degrees(turn or 0))
        yield SpeedLaw(multiplied, Cause.UNREPORTED, "turned" if turn else "multiplied", values, factor)
    for name, k in (("multiplied x", x), ("multiplied y", y)):
        if k is not None and abs(k - 1) > DOUBLE:
            kx, ky = (k, 1.0) if name[-1] == "x" else (1.0, k)

            def scaled(f: Flights, kx: float = kx, ky: float = ky) -> Vectors:
                u = by_gravity(f) if first else f.v
                return kx * u.real + 1j * ky * u.imag + (0 if first else f.g * f.dt)

            yield SpeedLaw(scaled, Cause.UNREPORTED, name, (k,))


def _drag(f: Flights, k: float, power: int, size: Callable[[Flights], Floats]) -> Vectors:
    """Return velocities after each speed has lost k v^(power + 1) size a second."""
    u = by_gravity(f)
    with np.errstate(all="ignore"):
        share = np.where(u != 0, k * np.abs(u) ** power * size(f) * f.dt, 0.0)
    slower: Vectors = u * np.maximum(1 - share, 0)
    return slower


def _places(f: Flights, w: Vectors, y: Vectors, floor: float) -> Iterator[PlaceLaw]:
    """Yield laws of places that flights show, the likelier first. w: px/s, y: px, after them."""
    yield RIGHT[1]
    yield PlaceLaw(lambda f, w: f.x + f.dt * (f.v + w) / 2)
    for slowed in (True, False) if np.abs(w - by_gravity(f)).max() * float(f.dt.max()) > floor else (True,):
        yield from _schemes(f, w, y, floor, slowed=slowed)
    with np.errstate(all="ignore"):
        fall = (
            dot((w - f.v) / f.dt, np.asarray(f.g)) / abs(f.g) ** 2
            if f.g
            else dot(y - f.x, f.v) / np.abs(f.v) ** 2 / f.dt
        )
    clock = _agreed(fall)
    if clock is not None and abs(clock - 1) > DOUBLE and clock > 0:
        yield PlaceLaw(
            lambda f, w: f.x + f.v * clock * f.dt + f.g * (clock * f.dt) ** 2 / 2,
            *(Cause.TELEPORTED, "clock", (clock,), clock),
        )
    for scheme in (0.5, 1.0, 0.0) if f.g else (0.5,):
        yield from _odd_places(f, y, floor, scheme)


def _schemes(f: Flights, w: Vectors, y: Vectors, floor: float, *, slowed: bool) -> Iterator[PlaceLaw]:
    """Yield laws of places at some velocity between those before and after a flight, or before what slows it down."""

    def after(f: Flights, w: Vectors) -> Vectors:
        return w if slowed else by_gravity(f)

    change = after(f, w) - f.v
    with np.errstate(all="ignore"):
        shares = dot(y - f.x - f.v * f.dt, change) / (np.abs(change) ** 2 * f.dt)
    shares = shares[np.abs(change) * f.dt > floor]
    theta = float(np.median(shares)) if len(shares) else np.nan
    near = min(SCHEMES, key=lambda scheme: abs(scheme - theta))
    if abs(near - theta) < ALIKE:
        off = abs(near - 0.5) * abs(f.g) * float(np.median(f.dt)) ** 2
        cause = Cause.GRAVITY if f.g and near != 0.5 else None
        name = "gravity after" if near > 0.5 else "gravity before"
        yield PlaceLaw(lambda f, w: f.x + f.dt * (f.v + near * (after(f, w) - f.v)), cause, name, (off,))


def _odd_places(f: Flights, y: Vectors, floor: float, scheme: float) -> Iterator[PlaceLaw]:
    """Yield laws that change where flights end, which are integrated by a scheme."""

    def ends(f: Flights) -> Vectors:
        return f.x + f.dt * (f.v + f.dt * f.g * scheme)

    for name, cut in (("cut", np.trunc), ("rounded", np.rint)):

        def whole(f: Flights, w: Vectors, cut: Callable[[Floats], Floats] = cut) -> Vectors:
            z = ends(f)
            return cut(z.real) + 1j * cut(z.imag)

        yield PlaceLaw(whole, Cause.TELEPORTED, name)
    shift = _centre(y - ends(f), floor)
    yield PlaceLaw(lambda f, w: ends(f) + shift, Cause.TELEPORTED, "shifted", (shift.real, shift.imag))
