"""The ledger: every change that an engine makes to energy, momentum and places, booked to its cause.

An engine is an open book of states and contacts. Between two states, balls fly on the parabola of gravity and
contacts change momentum by the impulses that the engine told; both are walked through here, in the order in which the
engine resolved them. What a contact should have done is known from the scene, and from the two balls' own flight: it
is traced back to the time at which they touched. Whatever the walk leaves over is booked too, so that the lines of
the ledger always add up to the whole change.

Throughout: n is the unit normal from the first to the second, u the speed at which the two approach along it, e their
elasticity, μ = 1 / (1/m_i + 1/m_j), J an impulse, g the gravity. An impulse J takes the energy J u - J²/2μ.

- An engine that finds a contact late sees the balls deep in each other, and on a normal that has turned. In time, the
  impulse is J_t = (1 + e) μ u_t on the normal of first touch; on the normal as found, (1 + e) μ u. Which of these an
  engine means is seen from its own impulse; what it lacks or has too much is an error of the impulse.
- A contact in time moves nothing but velocities. One found τ late should also move the balls to where they would be,
  by τ J_t / m; engines push apart, or put back on a wall, by something else.
- Solvers that resolve all contacts of a step together (`together`, see `sandbox.engines`) have no one contact's
  impulse right before all are; there each takes J (u + u') / 2, of the speeds before and after, which adds up.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sandbox.analysis.causes import (
    CAUSES,
    EARLY,
    ELASTICITY,
    FRICTION,
    GRAVITY,
    HAND,
    LARGE,
    LATE,
    MISSED,
    OVERSHOOT,
    PUSHED,
    ROUNDING,
    SHARE,
    SMALL,
    STALE,
    TURNED,
    UNCONVERGED,
    UNTOLD,
)
from sandbox.analysis.tunnelling import Passage, _crossings, _overlaps
from sandbox.scene.model import ARENA_WALLS, Scene
from sandbox.state import Contacts, Floats

LONGEST: Final = 3.0  # steps that a contact is traced back at most

BOOKED: Final = np.dtype(
    [
        ("cause", "i8"),  # what was most wrong with the contact, ROUNDING where nothing was
        ("wrong", "f8"),  # kg px/s: how far the momentum that it moved is from what it should have moved
        ("moved", "f8"),  # px: how far it put the balls from where they should be
        ("approach", "f8"),  # px/s along the normal as found, negative where the two part
        ("left", "f8"),  # px/s of approach after it
        ("due", "f8"),  # kg px/s: the impulse that it should have had
        ("late", "f8"),  # s after the two touched, negative where before
        ("turned", "f8"),  # rad from the normal of first touch to that found
        ("free", "f8"),  # s that both had flown undisturbed, LONGEST at most
        ("before", "f8", (2, 2)),  # px/s of first and second
        ("after", "f8", (2, 2)),  # px/s of first and second
    ]
)
Booked = NDArray[np.void]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class Entry:
    """A line of the ledger: what a cause changed."""

    cause: str  # of CAUSES
    contacts: int  # or steps of a ball, where it is no contact's
    energy: float  # kg px²/s²; the lines add up to the whole change
    momentum: float  # kg px/s that went where it should not, summed as lengths
    displacement: float  # px that balls were put from where they should be, summed as lengths


class Law(NamedTuple):
    """What a scene says of its balls and walls. wall: (m, 4), the segment's direction, half the thickness (px), e."""

    radius: Floats
    mass: Floats
    elasticity: Floats
    wall: Floats
    gravity: tuple[float, float]
    dt: float
    together: bool
    rough: bool


class Page(NamedTuple):
    """What a block of steps is booked on.

    energy, momentum, displacement, contacts: (causes,), of all blocks so far; row: (contacts,) BOOKED; timely:
    (contacts, 2), kg px, by which a contact in time would have moved its balls, times their mass; delay: (contacts,),
    the cause that a contact's time was booked to.
    """

    energy: Floats
    momentum: Floats
    displacement: Floats
    contacts: Floats
    row: Booked
    timely: Floats
    delay: Integers


@njit(cache=True)
def _sqrt(square):  # type: ignore[no-untyped-def]
    return math.sqrt(max(square, 0.0))


@njit(cache=True)
def _first_touch(x, y, wx, wy, reach):  # type: ignore[no-untyped-def]
    """Return how long ago (s) two were `reach` px apart, and the unit normal then.

    (x, y): px from the first to the second; (wx, wy): px/s at which they approach. A negative time is to come: the two
    are further apart yet. Of two that will miss each other it is when they are closest.
    """
    square = wx * wx + wy * wy
    nearest = (x * wx + y * wy) / square
    aside_x, aside_y = x - nearest * wx, y - nearest * wy
    ago = _sqrt((reach * reach - aside_x * aside_x - aside_y * aside_y) / square) - nearest
    nx, ny = x + ago * wx, y + ago * wy
    distance = math.hypot(nx, ny)
    return ago, nx / distance, ny / distance


@njit(cache=True)
def _first_fall(depth, speed, pull):  # type: ignore[no-untyped-def]
    """Return how long ago a ball touched a face that it is now so deep in, and at what speed (px, px/s, px/s²)."""
    then = _sqrt(speed * speed - 2 * pull * depth)
    return 2 * depth / (speed + then), then


@njit(cache=True)
def _book(page, cause, energy, momentum, displacement):  # type: ignore[no-untyped-def]
    page.energy[cause] += energy
    page.momentum[cause] += momentum
    page.displacement[cause] += displacement
    if momentum > 0 or displacement > 0:
        page.contacts[cause] += 1


@njit(cache=True)
def _pair(law, contact):  # type: ignore[no-untyped-def]
    """Return elasticity, inverse masses, and the distance at which the two touch."""
    i, j = contact.first, contact.second
    if j >= 0:
        e, reach = law.elasticity[i] * law.elasticity[j], law.radius[i] + law.radius[j]
        return e, 1 / law.mass[i], 1 / law.mass[j], reach
    return law.elasticity[i] * law.wall[~j, 3], 1 / law.mass[i], 0.0, law.radius[i] + law.wall[~j, 2]


@njit(cache=True)
def _in_time(law, contact, row, reach):  # type: ignore[no-untyped-def]
    """Trace a contact back to when the two touched: how late it was found, the speed of approach and normal then.

    What was deep before the last contact of either has not come in by this flight, and is taken as found in time.
    """
    nx, ny = contact.normal[0], contact.normal[1]
    wx, wy = row.before[0, 0] - row.before[1, 0], row.before[0, 1] - row.before[1, 1]
    j = contact.second
    if j < 0 and abs(law.wall[~j, 0] * nx + law.wall[~j, 1] * ny) < SHARE:
        pull = law.gravity[0] * nx + law.gravity[1] * ny
        late, speed = _first_fall(contact.depth, row.approach, pull)
        return (late, speed, nx, ny) if late <= row.free * (1 + SHARE) else (0.0, row.approach, nx, ny)
    apart = reach - contact.depth
    late, tx, ty = _first_touch(apart * nx, apart * ny, wx, wy, reach)
    if late > row.free * (1 + SHARE):
        return 0.0, row.approach, nx, ny
    return late, max(wx * tx + wy * ty, 0.0), tx, ty


@njit(cache=True)
def _judge(law, page, k, contact):  # type: ignore[no-untyped-def]
    """Book a contact that was resolved by itself."""
    row = page.row[k]
    e, per_i, per_j, reach = _pair(law, contact)
    mu, u, impulse = 1 / (per_i + per_j), row.approach, contact.impulse
    energy = impulse * (impulse / (2 * mu) - u)
    if u <= 0:
        cause = STALE if law.together else TURNED if contact.second < 0 else LARGE
        if impulse == 0:
            cause = ROUNDING
        row.cause, row.wrong = cause, abs(impulse)
        _book(page, cause, energy, row.wrong, 0.0)
        return
    late, u_t, tx, ty = _in_time(law, contact, row, reach)
    nx, ny = contact.normal[0], contact.normal[1]
    as_found, timely = (1 + e) * mu * u, (1 + e) * mu * u_t
    due = timely if abs(impulse - timely) < abs(impulse - as_found) else as_found
    natural = -(1 - e * e) * mu * u_t * u_t / 2
    energy_due = due * (due / (2 * mu) - u)
    row.due, row.late = due, late
    row.turned = math.atan2(abs(nx * ty - ny * tx), nx * tx + ny * ty)
    page.timely[k, 0], page.timely[k, 1] = late * timely * tx, late * timely * ty

    # A wall that gravity pulls to is met at a speed that is known to within a step's pull.
    pull = abs(law.gravity[0] * nx + law.gravity[1] * ny) * law.dt if contact.second < 0 else 0.0
    lacking = abs(impulse - due)
    if impulse < 0 and law.together:
        cause = STALE
    elif lacking <= SHARE * due:
        cause = ROUNDING
    elif lacking <= (1 + e) * mu * pull * (1 + SHARE):
        cause = GRAVITY
    else:
        cause = SMALL if impulse < due else LARGE
    astray = math.hypot(due * nx - timely * tx, due * ny - timely * ty)
    delay = ROUNDING if astray <= SHARE * timely else LATE if late > 0 else EARLY
    if u <= 2 * pull and cause != ROUNDING:  # at rest: what a step's gravity gives, the wall takes
        delay, natural, energy_due = GRAVITY, 0.0, energy
    page.delay[k] = delay
    _book(page, ELASTICITY, natural, 0.0, 0.0)
    _book(page, cause, energy - energy_due, lacking if cause not in (ROUNDING, GRAVITY) else 0.0, 0.0)
    _book(page, delay, energy_due - natural, astray if delay in (LATE, EARLY) else 0.0, 0.0)
    row.wrong = math.hypot(impulse * nx - timely * tx, impulse * ny - timely * ty)
    row.cause = cause if lacking >= astray and cause != GRAVITY else delay


@njit(cache=True)
def _judge_together(law, page, k, contact):  # type: ignore[no-untyped-def]
    """Book one of several contacts that share balls and were resolved together."""
    row = page.row[k]
    e, per_i, per_j, reach = _pair(law, contact)
    mu, u, impulse = 1 / (per_i + per_j), row.approach, contact.impulse
    natural = -impulse * (1 - e) * u / 2 if impulse > 0 else 0.0
    pull = abs(law.gravity[0] * contact.normal[0] + law.gravity[1] * contact.normal[1]) * law.dt
    lacking = mu * abs(row.left + e * u)
    if impulse < 0:
        cause = STALE
    elif lacking <= SHARE * mu * abs(u):
        cause = ROUNDING
    elif contact.second < 0 and lacking <= (1 + e) * mu * pull * (1 + SHARE):
        cause = GRAVITY
    else:
        cause = UNCONVERGED
    _book(page, ELASTICITY, natural, 0.0, 0.0)
    error = -impulse * (u + row.left) / 2 - natural
    _book(page, cause, error, lacking if cause in (STALE, UNCONVERGED) else 0.0, 0.0)
    row.cause, row.wrong, row.due = cause, lacking, impulse
    if u > (2 * pull if contact.second < 0 else 0):
        late, _, tx, ty = _in_time(law, contact, row, reach)
        nx, ny = contact.normal[0], contact.normal[1]
        row.late, row.turned = late, math.atan2(abs(nx * ty - ny * tx), nx * tx + ny * ty)
        astray = abs(impulse) * math.hypot(nx - tx, ny - ty)
        delay = LATE if late > 0 else EARLY
        if row.turned > SHARE:
            _book(page, delay, 0.0, astray, 0.0)
            if astray > lacking:
                row.cause, row.wrong = delay, astray
        page.delay[k] = delay
        page.timely[k, 0], page.timely[k, 1] = late * impulse * tx, late * impulse * ty


@njit(cache=True)
def _settle(law, page, k, contact, place, last):  # type: ignore[no-untyped-def]
    """Book how a contact moved its balls. place: (n, 2) px that is not explained yet; last: contact of each ball."""
    row, nx, ny = page.row[k], contact.normal[0], contact.normal[1]
    energy = natural = put_back = row.moved = 0.0
    for side in range(2):
        ball = contact.first if side == 0 else contact.second
        if ball < 0:
            continue
        sign = 1 - 2 * side
        x, y = place[ball, 0], place[ball, 1]
        if last[ball] != k:
            along = x * nx + y * ny
            x, y = along * nx, along * ny
        place[ball, 0] -= x
        place[ball, 1] -= y
        due_x = -sign * page.timely[k, 0] / law.mass[ball]
        due_y = -sign * page.timely[k, 1] / law.mass[ball]
        energy -= law.mass[ball] * (law.gravity[0] * x + law.gravity[1] * y)
        natural -= law.mass[ball] * (law.gravity[0] * due_x + law.gravity[1] * due_y)
        row.moved += math.hypot(x - due_x, y - due_y)
        put_back -= sign * (x * nx + y * ny)
    size = law.radius[contact.first]
    if row.moved <= SHARE * size:
        cause = ROUNDING
    elif row.moved <= math.hypot(law.gravity[0], law.gravity[1]) * law.dt * law.dt:
        cause = GRAVITY
    elif contact.second >= 0:
        cause = PUSHED
    else:
        cause = OVERSHOOT if put_back > contact.depth / 2 else LATE
    _book(page, page.delay[k], natural, 0.0, 0.0)
    _book(page, cause, energy - natural, 0.0, row.moved if cause not in (ROUNDING, GRAVITY) else 0.0)
    if row.cause in (ROUNDING, GRAVITY):
        row.cause = cause


@njit(cache=True)
def _fly(law, velocity, flown, clock, ball, now):  # type: ignore[no-untyped-def]
    """Let a ball fly on its parabola to a time in the step (s)."""
    dt = now - clock[ball]
    for axis in range(2):
        flown[ball, axis] += dt * (velocity[ball, axis] + dt * law.gravity[axis] / 2)
        velocity[ball, axis] += dt * law.gravity[axis]
    clock[ball] = now


@njit(cache=True)
def _closing(contact, velocity):  # type: ignore[no-untyped-def]
    """Return the speed at which the two of a contact approach along its normal. velocity: (2, 2), of both."""
    along_x = (velocity[0, 0] - velocity[1, 0]) * contact.normal[0]
    return along_x + (velocity[0, 1] - velocity[1, 1]) * contact.normal[1]


@njit(cache=True)
def _look(contact, velocity, both):  # type: ignore[no-untyped-def]
    """Copy the velocities of the two of a contact; those of a wall are 0."""
    for axis in range(2):
        both[0, axis] = velocity[contact.first, axis]
        both[1, axis] = velocity[contact.second, axis] if contact.second >= 0 else 0.0


@njit(cache=True)
def _resolve(law, page, velocity, contacts, begin, end, uses):  # type: ignore[no-untyped-def]
    """Change velocities by contacts that were resolved together, and book each. uses: (n,) zeros, and left so."""
    for k in range(begin, end):
        contact, row = contacts[k], page.row[k]
        _look(contact, velocity, row.before)
        row.approach = _closing(contact, row.before)
        uses[contact.first] += 1
        if contact.second >= 0:
            uses[contact.second] += 1
    for k in range(begin, end):
        contact = contacts[k]
        for axis in range(2):
            push = contact.impulse * contact.normal[axis]
            velocity[contact.first, axis] -= push / law.mass[contact.first]
            if contact.second >= 0:
                velocity[contact.second, axis] += push / law.mass[contact.second]
    for k in range(begin, end):
        contact, row = contacts[k], page.row[k]
        _look(contact, velocity, row.after)
        row.left = _closing(contact, row.after)
        if uses[contact.first] > 1 or (contact.second >= 0 and uses[contact.second] > 1):
            _judge_together(law, page, k, contact)
        else:
            _judge(law, page, k, contact)
    for k in range(begin, end):
        uses[contacts[k].first] = 0
        if contacts[k].second >= 0:
            uses[contacts[k].second] = 0


@njit(cache=True)
def _leave(law, page, ball, velocity, told, place, touched, before):  # type: ignore[no-untyped-def]
    """Book what of a ball's change no contact of the step explains.

    velocity: (2,) px/s at the end of the step, and told: by the contacts; place: (2,) px that is not explained; before:
    px/s, of which order the ball's speed was.
    """
    dx, dy = velocity[0] - told[0], velocity[1] - told[1]
    wrong = math.hypot(dx, dy)
    energy = law.mass[ball] * (dx * (velocity[0] + told[0]) + dy * (velocity[1] + told[1])) / 2
    if wrong <= SHARE * (abs(velocity[0]) + abs(velocity[1]) + before):
        _book(page, ROUNDING, energy, 0.0, 0.0)
    else:
        _book(page, FRICTION if law.rough and touched else UNTOLD, energy, law.mass[ball] * wrong, 0.0)
    moved = math.hypot(place[0], place[1])
    energy = -law.mass[ball] * (law.gravity[0] * place[0] + law.gravity[1] * place[1])
    if moved <= SHARE * law.radius[ball]:
        _book(page, ROUNDING, energy, 0.0, 0.0)
    else:
        _book(page, PUSHED, energy, 0.0, moved)


@njit(cache=True)
def _places(law, page, step, position, flown, free, contacts, begin, last):  # type: ignore[no-untyped-def]
    """Book where the contacts of a step put the balls. flown: (n, 2) px of flight, made what is left unexplained."""
    fall = law.gravity[0] * free[0] + law.gravity[1] * free[1]
    for ball in range(len(flown)):
        for axis in range(2):
            moved = position[step, ball, axis] - position[step - 1, ball, axis]
            flown[ball, axis] = moved - flown[ball, axis] - free[axis]
        _book(page, GRAVITY, -law.mass[ball] * fall, 0.0, 0.0)
    for k in range(len(contacts)):
        _settle(law, page, begin + k, contacts[k], flown, last)


@njit(cache=True)
def _walk(law, page, position, velocity, pulled, pull, free, contacts, step_of, within, met):  # type: ignore[no-untyped-def]
    """Walk through a block of steps, and book all that changes.

    position, velocity: (steps + 1, n, 2) px, px/s; pulled: (steps + 1,), the ball that the hand pulled in each step, or
    -1, and pull: (steps + 1, 2) px/s, by how much; free: (2,) px, by which the engine's flight differs from a parabola
    in a step; contacts: (contacts,) CONTACT, step_of: their steps, and within: s since these began; met: (n,) s, when
    each ball last had a contact.
    """
    n, at = position.shape[1], 0
    uses, last = np.zeros(n, np.int64), np.empty(n, np.int64)
    told, flown, clock = np.empty((n, 2)), np.empty((n, 2)), np.empty(n)
    fastest = math.hypot(law.gravity[0], law.gravity[1]) * law.dt
    for step in range(1, len(position)):
        told[:], flown[:], clock[:], last[:] = velocity[step - 1], 0.0, 0.0, -1
        ball = pulled[step]
        if ball >= 0:
            for axis in range(2):
                mean = told[ball, axis] + pull[step, axis] / 2
                _book(page, HAND, law.mass[ball] * pull[step, axis] * mean, 0.0, 0.0)
                told[ball, axis] += pull[step, axis]

        # Velocities, contact by contact, or all at once that are resolved together.
        begin = at
        while at < len(contacts) and step_of[at] == step:
            end = at + 1
            while law.together and end < len(contacts) and step_of[end] == step and within[end] == within[at]:
                end += 1
            for k in range(at, end):
                i, j = contacts[k].first, contacts[k].second
                last[i] = k
                _fly(law, told, flown, clock, i, within[k])
                since = met[i]
                if j >= 0:
                    last[j] = k
                    _fly(law, told, flown, clock, j, within[k])
                    since = max(since, met[j])
                page.row[k].free = min(contacts[k].time - since, LONGEST * law.dt)
            _resolve(law, page, told, contacts, at, end, uses)
            for k in range(at, end):
                met[contacts[k].first] = contacts[k].time
                if contacts[k].second >= 0:
                    met[contacts[k].second] = contacts[k].time
            at = end

        for ball in range(n):
            _fly(law, told, flown, clock, ball, law.dt)
        _places(law, page, step, position, flown, free, contacts[begin:at], begin, last)
        for ball in range(n):
            before = np.abs(velocity[step - 1, ball]).sum() + fastest
            _leave(law, page, ball, velocity[step, ball], told[ball], flown[ball], last[ball] >= 0, before)
    return at


class Ledger:
    """The books of one engine, kept block by block of steps.

    deepest: px that two balls overlapped at the end of any step; missed: where it told of no contact.
    """

    def __init__(self, scene: Scene, *, together: bool) -> None:
        self._scene = scene
        bodies = scene.bodies
        friction = max(scene.arena.friction, *bodies.friction, *(wall.friction for wall in scene.walls))
        self._law = Law(
            bodies.radius,
            bodies.mass,
            bodies.elasticity,
            _walls_of(scene),
            (float(scene.gravity[0]), float(scene.gravity[1])),
            1 / scene.rate,
            together,
            friction > 0,
        )
        self._free: Floats | None = None
        self._rows: list[Booked] = []
        self._sums = np.zeros((4, len(CAUSES)))  # energy, momentum, displacement, contacts
        self._met = np.full(len(bodies), -np.inf)
        self._passing = [np.empty(0, np.int64), np.empty(0, np.int64)]
        self.missed: list[Passage] = []
        self.deepest = 0.0
        self._steps = 0

    def add(self, position: Floats, velocity: Floats, contacts: Contacts, pulled: Integers, pull: Floats) -> None:
        """Book a block of steps. position, velocity: (steps + 1, n, 2), from the last state of the block before."""
        steps = len(position) - 1
        law, rate = self._law, self._scene.rate
        step_of = step_at(contacts["time"], rate)
        within = np.clip(contacts["time"] - (step_of - 1) / rate, 0.0, law.dt)
        step_of = np.clip(step_of - self._steps, 1, steps)
        if self._free is None:
            self._free = _flight(self._scene, position, velocity, contacts, step_of)
        energy, momentum, displacement, count = self._sums
        page = Page(
            energy,
            momentum,
            displacement,
            count,
            np.zeros(len(contacts), BOOKED),
            np.zeros((len(contacts), 2)),
            np.full(len(contacts), ROUNDING),
        )
        walked = _walk(law, page, position, velocity, pulled, pull, self._free, contacts, step_of, within, self._met)
        assert walked == len(contacts)
        if len(page.row):
            self._rows.append(page.row)
        self._steps += steps
        self._look_at_overlaps(position, velocity, contacts, step_of)
        self._look_at_walls(position, contacts, step_of, within)

    def _look_at_overlaps(self, position: Floats, velocity: Floats, contacts: Contacts, step_of: Integers) -> None:
        """Find the deepest overlap, and the pairs that pass into each other with no contact told."""
        n = position.shape[1]
        told = contacts["first"] * n + contacts["second"]
        told[contacts["second"] < 0] = -1
        order = np.lexsort((told, step_of))
        bounds = np.searchsorted(step_of, np.arange(len(position) + 1))
        deepest, passed, *self._passing = _overlaps(
            position, velocity, self._law.radius, told[order], bounds, *self._passing
        )
        self.deepest = max(self.deepest, float(deepest))
        self._miss(position, [(step, *divmod(key, n)) for step, key in passed.tolist()])

    def _look_at_walls(self, position: Floats, contacts: Contacts, step_of: Integers, within: Floats) -> None:
        """Find the balls that go through an inner wall with no contact told."""
        ends = np.array([(*wall.start, *wall.to) for wall in self._scene.walls], float)
        if len(ends):
            bounds = np.searchsorted(step_of, np.arange(len(position) + 1))
            early = within < self._law.dt * (1 - SHARE)
            self._miss(position, _crossings(position, ends, len(ARENA_WALLS), contacts, early, bounds).tolist())

    def _miss(self, position: Floats, found: Iterable[tuple[int, int, int]]) -> None:
        """Book what was missed in a block: step of it, first and second."""
        before = self._steps - len(position) + 1
        for step, first, second in found:
            flown = math.dist(position[step, first], position[step - 1, first])
            self.missed.append(Passage(before + step, first, second, flown))
            self._sums[3, MISSED] += 1

    @property
    def rows(self) -> Booked:
        """Every contact so far."""
        return np.concatenate(self._rows) if self._rows else np.empty(0, BOOKED)

    def entries(self) -> tuple[Entry, ...]:
        """Sum up, by cause: those that occurred, in the order of CAUSES."""
        return tuple(
            Entry(cause, int(contacts), float(energy), float(momentum), float(displacement))
            for cause, (energy, momentum, displacement, contacts) in zip(CAUSES, self._sums.T, strict=True)
            if energy or contacts
        )


def step_at(time: Floats, rate: int) -> Integers:
    """Return the step in which each time (s) lies: the first that ends no sooner, counted from 1."""
    step = np.ceil(time * rate - SHARE).astype(np.int64)
    return np.maximum(step + (time > step / rate), 1)


def _walls_of(scene: Scene) -> Floats:
    """Return each wall's direction, half its thickness (px, 0 of the arena's) and its elasticity: (m, 4)."""
    arena = [(*along, 0.0, scene.arena.elasticity) for along in ((0, 1), (1, 0), (0, 1), (1, 0))]
    inner = []
    for wall in scene.walls:
        dx, dy = wall.to[0] - wall.start[0], wall.to[1] - wall.start[1]
        size = math.hypot(dx, dy)
        inner.append((dx / size, dy / size, wall.thickness / 2, wall.elasticity))
    return np.array([*arena, *inner], float)


def _flight(scene: Scene, position: Floats, velocity: Floats, contacts: Contacts, step_of: Integers) -> Floats:
    """Return by how much an engine's flight under gravity differs from a parabola in a step, px: (2,).

    It is the same in every step without contacts, of which the middle one is taken.
    """
    dt, gravity = 1 / scene.rate, np.array(scene.gravity, float)
    if not gravity.any():
        return np.zeros(2)
    flying = np.ones((len(position) - 1, position.shape[1]), bool)
    flying[step_of - 1, contacts["first"]] = False
    between = contacts["second"] >= 0
    flying[step_of[between] - 1, contacts["second"][between]] = False
    beyond = np.diff(position, axis=0) - velocity[:-1] * dt - gravity * dt * dt / 2
    return np.median(beyond[flying], axis=0) if flying.any() else np.zeros(2)
