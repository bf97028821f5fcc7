"""How an engine flies: one law of velocities and one of places, fitted to all flights of a run that touch nothing."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np

from sandbox.judge.causes import Cause
from sandbox.judge.run import Flights, Run, Vectors, dot
from sandbox.judge.thresholds import ALIKE, DOUBLE, DOUBTED, FEW
from sandbox.state import Bools, Floats

MOST: Final = 20_000  # flights that a law is read from
SCHEMES: Final = (0.0, 0.5, 1.0, *(0.5 + s * 0.5 / k for k in range(2, 65) for s in (1, -1)))  # of gravity, in k parts


@dataclass(frozen=True)
class FlightLaw:
    """How velocities change in flights, of(f), px/s, or where these end, of(f, w), px, if w are their velocities then.

    cause: None if that is right; name, values: of the sentence in `words`; clock: what share of a step they take.
    """

    of: Callable[..., Vectors]
    cause: Cause | None = None
    name: str = ""
    values: tuple[float, ...] = ()
    clock: float = 1.0


@dataclass(frozen=True)
class Habit:
    """How an engine flies. kept: the share of its spin that a ball keeps in a step."""

    speed: FlightLaw
    place: FlightLaw
    kept: float = 1.0

    def end(self, flights: Flights) -> tuple[Vectors, Vectors]:
        """Return where flights end, px, and with which velocities, px/s."""
        w = self.speed.of(flights)
        return self.place.of(flights, w), w


def by_gravity(f: Flights) -> Vectors:
    """Return the right velocities after flights, px/s."""
    return f.v + f.g * f.dt


RIGHT: Final = FlightLaw(by_gravity), FlightLaw(lambda f, w: f.x + f.v * f.dt + f.g * f.dt**2 / 2)


def habit_of(run: Run, free: Bools, damping: float) -> Habit:
    """Return how an engine flies. free: (steps, n), which flights touch nothing; damping: as it declares, a second."""
    step, ball = np.nonzero(free)
    pick = np.unique(np.linspace(0, max(len(step) - 1, 0), MOST).astype(int))[: len(step)]
    step, ball = step[pick], ball[pick]
    moves = np.maximum(np.abs(run.v0[step, ball]), np.abs(run.v[step + 1, ball])) * run.dt[step] > run.floor
    k, i = step[moves], ball[moves]
    if len(k) < FEW:
        return Habit(*RIGHT)
    f, y, w, floor = run.flights(k, i), run.x[k + 1, i], run.v[k + 1, i], 1.5 * run.floor
    speed = _best(_speeds(f, w, run.floor, damping), lambda law: np.abs(law.of(f) - w) * f.dt <= floor)
    place = _best(_places(f, w, y, run.floor, pull_of(speed, run.g)), lambda law: np.abs(law.of(f, w) - y) <= floor)
    if place.clock != 1:
        speed = FlightLaw(lambda f: f.v + f.g * place.clock * f.dt)
    turning = run.w[step, ball] != 0
    shares = run.w[step + 1, ball][turning] / run.w[step, ball][turning]
    kept = float(np.median(shares)) if len(shares) >= FEW else 1.0
    return Habit(speed, place, 1.0 if abs(kept - 1) < DOUBLE else kept)


def pull_of(speed: FlightLaw, gravity: complex) -> complex:
    """Return by what balls are accelerated in flight, px/s²."""
    return complex(*speed.values[:2]) if speed.cause is Cause.GRAVITY else gravity


def _best(laws: Iterator[FlightLaw], fits: Callable[[FlightLaw], Bools]) -> FlightLaw:
    """Return the law that explains nearly all flights, the first, which is right, if none does.

    A later law must explain most of what an earlier one does not.
    """
    best, most = None, 1 - DOUBTED
    for law in laws:
        best = best or law
        share = float(np.mean(fits(law)))
        if share > most:
            best, most = law, (1 + share) / 2
        if share == 1:
            break
    assert best
    return best


def _agreed(values: Floats) -> float | None:
    """Return the median of values, None if most are not that."""
    values = values[np.isfinite(values)]
    if len(values) < FEW:
        return None
    median = float(np.median(values))
    return median if np.median(np.abs(values - median)) <= ALIKE * abs(median) else None


def _speeds(f: Flights, w: Vectors, floor: float, damping: float) -> Iterator[FlightLaw]:
    """Yield laws of velocities that flights show, the likelier first. w: px/s, after them."""
    yield RIGHT[0]
    dt, base = float(np.median(f.dt)), by_gravity(f)
    if damping != 1:
        yield FlightLaw(lambda f: f.v * damping**f.dt + f.g * f.dt, Cause.DAMPING, "damping", (100 * damping,))
    pulls = (w - f.v) / f.dt
    middle = np.median([pulls.real, pulls.imag], axis=1)
    pull = complex(*np.where(np.abs(middle) * dt**2 > floor, middle, 0))  # without a component that is rounding
    if abs(pull - f.g) * dt**2 > floor:
        ratio = pull / f.g if f.g else 0j
        name = "share of gravity" if f.g and abs(ratio.imag) < ALIKE else "pull"
        yield FlightLaw(lambda f: f.v + pull * f.dt, Cause.GRAVITY, name, (pull.real, pull.imag, ratio.real))
    for first in (1, 0) if f.g else (1,):  # gravity before or after what slows balls down
        yield from _factors(f, w, floor, first)
    with np.errstate(all="ignore"):
        lost = np.where(np.abs(base) * f.dt > 10 * floor, 1 - np.abs(w) / np.abs(base), np.nan) / f.dt
        for by_speed, power in ((" v²", 1), ("", -1)):  # of v, in the share of the speed that a drag takes
            k = _agreed(lost / np.abs(base) ** power)
            if k is not None and abs(k) > DOUBLE:
                yield FlightLaw(partial(_drag, k=k, power=power), Cause.UNREPORTED, f"drag by{by_speed}", (k,))


def _factors(f: Flights, w: Vectors, floor: float, first: int) -> Iterator[FlightLaw]:
    """Yield the law that multiplies velocities. first: 1 if gravity is multiplied as well, 0 if not."""
    base, seen = f.v + first * f.g * f.dt, w - (1 - first) * f.g * f.dt
    with np.errstate(all="ignore"):
        ratio = np.where(np.abs(base) * f.dt > 10 * floor, dot(seen, base) / np.abs(base) ** 2, np.nan)
    factor = _agreed(ratio)
    if factor is not None and abs(factor - 1) > DOUBLE:
        values = factor, factor ** (1 / float(np.median(f.dt)))

        def multiplied(f: Flights) -> Vectors:
            return factor * (f.v + first * f.g * f.dt) + (1 - first) * f.g * f.dt

        yield FlightLaw(multiplied, Cause.UNREPORTED, "multiplied", values)


def _drag(f: Flights, k: float, power: int) -> Vectors:
    """Return velocities after each speed has lost k v^(power + 1) a second."""
    u = by_gravity(f)
    with np.errstate(all="ignore"):
        share = np.where(u != 0, k * np.abs(u) ** power * f.dt, 0.0)
    slower: Vectors = u * np.maximum(1 - share, 0)
    return slower


def _places(f: Flights, w: Vectors, y: Vectors, floor: float, pull: complex) -> Iterator[FlightLaw]:
    """Yield laws of places that flights show, the likelier first. w: px/s, y: px, after them; pull: px/s²."""
    yield RIGHT[1]
    yield FlightLaw(lambda f, w: f.x + f.dt * (f.v + w) / 2)
    for slowed in (True, False) if np.abs(w - by_gravity(f)).max() * float(f.dt.max()) > floor else (True,):
        yield from _schemes(f, w, y, floor, pull, slowed=slowed)
    with np.errstate(all="ignore"):
        seen, due = (w - f.v, np.asarray(f.g)) if f.g else (y - f.x, f.v)
        clock = _agreed(dot(seen, due) / np.abs(due) ** 2 / f.dt)
    if clock is not None and abs(clock - 1) > DOUBLE and clock > 0:
        end = lambda f, w: f.x + f.v * clock * f.dt + f.g * (clock * f.dt) ** 2 / 2  # noqa: E731
        yield FlightLaw(end, Cause.TELEPORTED, "clock", (clock,), clock=clock)


def _schemes(f: Flights, w: Vectors, y: Vectors, floor: float, pull: complex, *, slowed: bool) -> Iterator[FlightLaw]:
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
        off = abs(near - 0.5) * abs(pull) * float(np.median(f.dt)) ** 2
        cause = Cause.GRAVITY if pull and near != 0.5 else None
        name = "gravity after" if near > 0.5 else "gravity before"
        yield FlightLaw(lambda f, w: f.x + f.dt * (f.v + near * (after(f, w) - f.v)), cause, name, (off,))
