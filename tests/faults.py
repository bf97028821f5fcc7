"""Engines with exactly one known fault each, and the causes that are true of each.

`EventDriven` has no fault: it flies on exact parabolas and resolves contacts at their exact times, few discs by brute
force, and shares no code with the engines of the sandbox. A fault overrides one method. `Stepped` finds contacts at the
end of a step and puts the balls where a contact in time would have led them; what it differs in by itself is `late`.

Points and vectors are complex numbers, x + iy, in px, px/s and px/s².
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, Final

import numpy as np
from pymunk import Circle
from verdicts import on_states

from sandbox.engines.impulse import ImpulseEngine
from sandbox.engines.pymunk import PymunkEngine
from sandbox.judge.causes import Cause
from sandbox.judge.summary import Verdict
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.state import CONTACT, Contacts, State, States, no_contacts

NEVER: Final = math.inf
OUTWARD: Final = (-1 + 0j, -1j, 1 + 0j, 1j)  # of the arena's left, top, right and bottom wall
FLOOR: Final = 3
HAPPENS: Final = 0.2  # s, when a fault happens that happens once


def dot(a: complex, b: complex) -> float:
    return a.real * b.real + a.imag * b.imag


def cross(a: complex, b: complex) -> float:
    return (a.conjugate() * b).imag


def turned(degrees: float) -> complex:
    return complex(math.cos(math.radians(degrees)), math.sin(math.radians(degrees)))


def to_face(depth: float, speed: float, pull: float) -> float:
    """Return when a depth (px, negative outside) grows to 0, now by `speed` px/s, which grows by `pull` px/s²."""
    square = speed * speed - 2 * pull * depth
    if square < 0 or (speed <= 0 and pull <= 0):
        return NEVER
    root = math.sqrt(square)
    time = -2 * depth / (speed + root) if speed > 0 else (root - speed) / pull
    return max(time, 0.0)


def to_circle(away: complex, speed: complex, reach: float) -> float:
    """Return when a centre, now `away` from another, comes within reach of it at a constant relative velocity."""
    approach, near = dot(speed, away), abs(away) ** 2 - reach * reach
    if approach <= 0:
        return NEVER
    square = approach * approach - abs(speed) ** 2 * near
    return NEVER if square < 0 else max(near / (approach + math.sqrt(square)), 0.0)


def to_circle_falling(away: complex, velocity: complex, gravity: complex, reach: float) -> float:
    """Return when a falling centre comes within reach of a point, from which it is `away` now."""
    quartic = [
        abs(gravity) ** 2 / 4,
        dot(gravity, velocity),
        abs(velocity) ** 2 - dot(gravity, away),
        -2 * dot(velocity, away),
        abs(away) ** 2 - reach * reach,
    ]
    cubic = np.polyder(quartic)
    times = []
    for root in np.roots(quartic):
        if abs(root.imag) < 1e-6:
            time = float(root.real)
            for _ in range(3):
                time -= float(np.polyval(quartic, time) / np.polyval(cubic, time))
            if time > -1e-9 and np.polyval(cubic, time) < 0:
                times.append(max(time, 0.0))
    return min(times, default=NEVER)


class Discs:
    """The balls of a scene, the contacts found, and what an engine shows of them."""

    def __init__(self, scene: Scene, initial: State) -> None:
        self.scene, self.dt, self.steps = scene, 1 / scene.rate, 0
        self.x = [complex(*point) for point in initial.position.tolist()]
        self.v = [complex(*vector) for vector in initial.velocity.tolist()]
        bodies = scene.bodies
        self.r: list[float] = bodies.radius.tolist()
        self.m: list[float] = bodies.mass.tolist()
        self.e: list[float] = bodies.elasticity.tolist()
        self.balls = range(len(self.x))
        self.f: list[float] = bodies.friction.tolist()
        self.w: list[float] = initial.spin.tolist()
        self.g = complex(*scene.gravity)
        self.wall_f = [scene.arena.friction] * 4 + [wall.friction for wall in scene.walls]
        self.wall_e = [scene.arena.elasticity] * 4 + [wall.elasticity for wall in scene.walls]
        self.found: list[tuple[Any, ...]] = []
        self.random = np.random.default_rng(1)

    @property
    def now(self) -> float:
        return self.steps / self.scene.rate

    def state(self) -> State:
        position, velocity = (np.array([(z.real, z.imag) for z in each]) for each in (self.x, self.v))
        return State(self.now, position, velocity, np.zeros(len(self.w)), np.array(self.w, float))

    def record_contacts(self) -> None:
        """They are recorded from the start."""

    def contacts(self) -> Contacts:
        found, self.found = self.found, []
        return np.array(found, CONTACT) if found else no_contacts()

    def kick(self, ball: int, dv: Vector) -> None:
        self.v[ball] += complex(*dv)

    def report(
        self, time: float, i: int, other: int, n: complex, impulse: float, depth: float, rubs: float, slip: float
    ) -> None:
        self.found.append((time, i, other, (n.real, n.imag), impulse, depth, rubs, slip))

    # What a contact does

    def restitution(self, i: int, other: int) -> float:
        return self.e[i] * (self.e[other] if other >= 0 else self.wall_e[~other])

    def impulse(self, i: int, other: int, right: float) -> float:
        return right

    def friction(self, i: int, other: int) -> float:
        return self.f[i] * (self.f[other] if other >= 0 else self.wall_f[~other])

    def rub(self, slip: float, mass: float, most: float) -> float:
        """Return the friction of a contact. mass: kg, one over the sum of the inverse masses; most: of the impulse."""
        return max(-most, min(most, slip * mass / 3))

    def most(self, i: int, other: int, impulse: float) -> float:
        return self.friction(i, other) * impulse

    def turn(self, i: int, rubs: float) -> None:
        """Let friction at its rim turn a ball."""
        self.w[i] -= 2 * rubs / (self.m[i] * self.r[i])

    def slip(self, i: int, other: int, n: complex) -> float:
        rims = self.r[i] * self.w[i] + (self.r[other] * self.w[other] if other >= 0 else 0.0)
        return self.approach(i, other, 1j * n) + rims

    def apply_friction(self, i: int, other: int, n: complex, impulse: float) -> tuple[float, float]:
        """Return the friction that two bodies get, and the slip before."""
        slip = self.slip(i, other, n)
        mass = 1 / (1 / self.m[i] + (1 / self.m[other] if other >= 0 else 0.0))
        rubs = self.rub(slip, mass, self.most(i, other, impulse))
        if rubs:
            for ball, sign in ((i, -1), (other, 1)):
                if ball >= 0:
                    self.v[ball] += sign * rubs * 1j * n / self.m[ball]
                    self.turn(ball, rubs)
        return rubs, slip

    def push(self, i: int, other: int, impulse: complex) -> None:
        """Give two bodies an impulse, which points from the first to the second."""
        self.v[i] -= impulse / self.m[i]
        if other >= 0:
            self.v[other] += impulse / self.m[other]

    def approach(self, i: int, other: int, n: complex) -> float:
        return dot(self.v[i] - (self.v[other] if other >= 0 else 0), n)

    def right_impulse(self, i: int, other: int, n: complex) -> float:
        """Return the textbook's impulse along a normal."""
        masses = 1 / self.m[i] + (1 / self.m[other] if other >= 0 else 0.0)
        return (1 + self.restitution(i, other)) * self.approach(i, other, n) / masses

    def resolve(self, time: float, i: int, other: int, n: complex, depth: float) -> None:
        impulse = self.impulse(i, other, self.right_impulse(i, other, n))
        slipping = self.apply_friction(i, other, n, impulse)
        self.push(i, other, impulse * n)
        self.report(time, i, other, n, impulse, depth, *slipping)


class EventDriven(Discs):
    """No fault: few discs from contact to contact, by brute force."""

    def reach(self, i: int, other: int) -> float:
        """Return the distance at which a ball meets a ball, or a wall's face or centre line."""
        return self.r[i] + (self.r[other] if other >= 0 else self.half_thickness(~other))

    def half_thickness(self, wall: int) -> float:
        return self.scene.walls[wall - 4].thickness / 2 if wall >= 4 else 0.0

    just: tuple[int, int] = (-1, -1)  # whose contact was resolved last, in this step

    def sees(self, i: int, other: int) -> bool:
        return True

    def meets(self, i: int, other: int, time: float) -> bool:
        """Return whether two bodies meet after some time (s); those just resolved do not meet again at once."""
        return self.sees(i, other) and (time > 1e-12 or (i, other) != self.just)

    def face(self, wall: int) -> float:
        """Return how far out a wall of the arena stands."""
        width, height = self.scene.arena.size
        return (0.0, 0.0, width, height)[wall]

    def ends(self, wall: int) -> tuple[complex, ...]:
        """Return the round ends of an inner wall."""
        segment = self.scene.walls[wall - 4]
        return complex(*segment.start), complex(*segment.to)

    def to_inner_wall(self, i: int, wall: int) -> tuple[float, complex]:
        """Return when a ball meets an inner wall, and the point of the centre line that is nearest then."""
        segment, reach = self.scene.walls[wall - 4], self.reach(i, ~wall)
        start, to = complex(*segment.start), complex(*segment.to)
        along = (to - start) / abs(to - start)
        off = cross(along, self.x[i] - start)
        towards = along * (-1j if off > 0 else 1j)
        best, where = NEVER, start
        time = NEVER
        if abs(off) > reach / 2:
            time = to_face(reach - abs(off), dot(self.v[i], towards), dot(self.g, towards))
        if time < NEVER:
            then = self.x[i] + time * (self.v[i] + time * self.g / 2)
            part = dot(along, then - start)
            if 0 <= part <= abs(to - start):
                best, where = time, start + part * along
        for end in self.ends(wall):
            away = end - self.x[i]
            time = to_circle_falling(away, self.v[i], self.g, reach) if self.g else to_circle(away, self.v[i], reach)
            if time < best:
                best, where = time, end
        return best, where

    def next_contact(self, within: float) -> tuple[float, int, int, complex]:
        """Return the first contact within some time (s): when, of whom, and where or along which normal at a wall."""
        first = (NEVER, -1, 0, 0j)
        for i in self.balls:
            for j in range(i + 1, len(self.x)):
                away = self.x[j] - self.x[i]
                time = to_circle(away, self.v[i] - self.v[j], self.reach(i, j))
                if time <= within and self.meets(i, j, time):
                    first, within = (time, i, j, 0j), time
            for wall, n in enumerate(OUTWARD):
                depth = dot(self.x[i], n) + self.reach(i, ~wall) - self.face(wall)
                time = to_face(depth, dot(self.v[i], n), dot(self.g, n))
                if time <= within and self.meets(i, ~wall, time):
                    first, within = (time, i, ~wall, n), time
            for wall in range(4, 4 + len(self.scene.walls)):
                time, where = self.to_inner_wall(i, wall)
                if time <= within and self.meets(i, ~wall, time):
                    first, within = (time, i, ~wall, where), time
        return first

    def fly(self, time: float) -> None:
        for i in self.balls:
            self.x[i] += time * (self.v[i] + time * self.g / 2)
            self.v[i] += time * self.g

    def resolve_at(self, now: float, i: int, other: int, where: complex) -> None:
        """Resolve a contact of bodies that have met."""
        if other >= 0:
            away = self.x[other] - self.x[i]
            depth, n = self.r[i] + self.r[other] - abs(away), away / abs(away)
        elif ~other >= 4:
            away = where - self.x[i]
            depth, n = self.r[i] + self.half_thickness(~other) - abs(away), away / abs(away)
        else:
            width, height = self.scene.arena.size
            depth, n = dot(self.x[i], where) + self.r[i] - (0.0, 0.0, width, height)[~other], where
        self.resolve(now, i, other, n, depth)

    def step(self) -> None:
        left = self.dt
        while True:
            time, i, other, where = self.next_contact(left)
            if i < 0:
                break
            self.fly(time)
            left -= time
            self.just = (i, other)
            self.resolve_at(self.now + self.dt - left, i, other, where)
        self.fly(left)
        self.just = (-1, -1)
        self.steps += 1
        self.after_step()

    def after_step(self) -> None:
        pass

    def happens(self) -> bool:
        """Return whether a fault that happens once happens after this step."""
        return self.steps == round(HAPPENS * self.scene.rate)


class Stepped(Discs):
    """Finds contacts at the end of a step on a true parabola, and parts balls along the normal as found."""

    reflects: ClassVar = True  # a ball found in a wall is put where a bounce in time would have led it

    def sees(self, i: int, other: int) -> bool:
        return True

    def move(self) -> None:
        for i in self.balls:
            self.x[i] += self.dt * (self.v[i] + self.dt * self.g / 2)
            self.v[i] += self.dt * self.g

    def pairs(self) -> list[tuple[int, int]]:
        return [(i, j) for i in self.balls for j in range(i + 1, len(self.x))]

    def step(self) -> None:
        self.steps += 1
        self.move()
        width, height = self.scene.arena.size
        for i in self.balls:
            for wall, n in enumerate(OUTWARD):
                depth = dot(self.x[i], n) + self.r[i] - (0.0, 0.0, width, height)[wall]
                if depth > 0 and dot(self.v[i], n) > 0 and self.sees(i, ~wall):
                    self.resolve(self.now, i, ~wall, n, depth)
                    self.x[i] -= (1 + self.restitution(i, ~wall) * self.reflects) * depth * n
        for i, j in self.pairs():
            away = self.x[j] - self.x[i]
            depth, n = self.r[i] + self.r[j] - abs(away), away / abs(away)
            if depth > 0 and self.approach(i, j, n) > 0 and self.sees(i, j):
                self.resolve(self.now, i, j, n, depth)
                self.part(i, j, depth * n)

    def part(self, i: int, j: int, overlap: complex) -> None:
        pass


@dataclass(frozen=True)
class Fault:
    """An engine with a fault.

    true: the causes that are true of its states; fits: whether a scene can show it.
    """

    engine: type
    true: frozenset[Cause]
    fits: Callable[[Scene], bool]


FAULTS: Final[dict[str, Fault]] = {}


def _anywhere(scene: Scene) -> bool:
    return True


def without_inner_walls(scene: Scene) -> bool:
    return not scene.walls


def with_gravity(scene: Scene) -> bool:
    return any(scene.gravity)


def fault(*true: Cause, fits: Callable[[Scene], bool] = _anywhere) -> Callable[[type], type]:
    """Register an engine as one with a fault of which some causes are true."""

    def register(engine: type) -> type:
        FAULTS[engine.__name__] = Fault(engine, frozenset(true), fits)
        return engine

    return register


# Impulses


@fault(Cause.LARGE)
class ImpulseTooLarge(EventDriven):
    """Each impulse is 2 % larger than (1 + e) v_n over the inverse masses, and reported as it is."""

    def impulse(self, i: int, other: int, right: float) -> float:
        return 1.02 * right


@fault(Cause.SMALL)
class ImpulseTooSmall(EventDriven):
    """Each impulse is 2 % smaller."""

    def impulse(self, i: int, other: int, right: float) -> float:
        return 0.98 * right


@fault(Cause.SMALL)
class WallsTooSoft(EventDriven):
    """The restitution at walls is 3 % too small, so the impulse is."""

    def restitution(self, i: int, other: int) -> float:
        return super().restitution(i, other) * (0.97 if other < 0 else 1.0)


@fault(Cause.LARGE)
class OneWallTooHard(EventDriven):
    """The floor returns 3 % too much, by an impulse that is too large."""

    def restitution(self, i: int, other: int) -> float:
        return super().restitution(i, other) * (1.03 if other == ~FLOOR else 1.0)


@fault(Cause.UNEXPLAINED_IMPULSE)
class AddsTangentialPart(EventDriven):
    """A twentieth of the pair's impulse is added along the tangent, without being reported."""

    def push(self, i: int, other: int, impulse: complex) -> None:
        super().push(i, other, impulse * (1 + 0.05j) if other >= 0 else impulse)


@fault(Cause.UNEXPLAINED_IMPULSE)
class FrictionWhereNoneIs(EventDriven):
    """A tenth of a wall's impulse brakes the ball along the wall, though the product of their frictions is 0."""

    def push(self, i: int, other: int, impulse: complex) -> None:
        along = 1j * impulse
        against = -1.0 if dot(self.v[i], along) < 0 else 1.0
        super().push(i, other, impulse + (0.1 * against * along if other < 0 else 0))


@fault(Cause.UNEXPLAINED_IMPULSE, fits=lambda scene: len(set(scene.bodies.mass.tolist())) > 1)
class SwapsMasses(EventDriven):
    """Each of a pair is accelerated by the reported impulse over the mass of the other."""

    def push(self, i: int, other: int, impulse: complex) -> None:
        if other < 0:
            super().push(i, other, impulse)
        else:
            self.v[i] -= impulse / self.m[other]
            self.v[other] += impulse / self.m[i]


@fault(Cause.UNEXPLAINED_IMPULSE)
class LosesMomentum(EventDriven):
    """The second of a pair gets only half of the reported impulse."""

    def push(self, i: int, other: int, impulse: complex) -> None:
        super().push(i, other, impulse)
        if other >= 0:
            self.v[other] -= 0.5 * impulse / self.m[other]


@fault(Cause.UNEXPLAINED_IMPULSE)
class LeavesOutSecond(EventDriven):
    """In the third contact of a pair, only the first gets the reported impulse."""

    seen = 0

    def push(self, i: int, other: int, impulse: complex) -> None:
        self.seen += other >= 0
        super().push(i, other, impulse)
        if other >= 0 and self.seen == 3:
            self.v[other] -= impulse / self.m[other]


@fault(Cause.DOUBLE_BOUNCE, Cause.MISSED)
class TurnsTwice(EventDriven):
    """At the right wall, a ball already on its way back is reversed again, once: as if the wall were missed."""

    done = False

    def resolve(self, time: float, i: int, other: int, n: complex, depth: float) -> None:
        super().resolve(time, i, other, n, depth)
        if other == ~2 and not self.done:
            self.done = True
            super().resolve(time, i, other, n, depth)

    def sees(self, i: int, other: int) -> bool:
        return other != ~2 or not self.done


@fault(Cause.UNEXPLAINED_IMPULSE, Cause.UNREPORTED)
class LimitsSpeed(EventDriven):
    """A speed above the limit is cut: after a contact that gave it, or in flight."""

    def after_step(self) -> None:
        limit = 1.3 * max(100.0, min(abs(v) for v in self.v))
        self.v = [v * min(1.0, limit / abs(v)) if v else v for v in self.v]


# Friction and spin


def is_rough(scene: Scene) -> bool:
    return scene.is_rough


@fault(Cause.FRICTION_SMALL, fits=is_rough)
class NoFriction(EventDriven):
    """There is no friction."""

    def rub(self, slip: float, mass: float, most: float) -> float:
        return 0.0


@fault(Cause.FRICTION_LARGE, fits=is_rough)
class TwiceTheFriction(EventDriven):
    """Friction is twice Coulomb's: also where that would stop the slip."""

    def rub(self, slip: float, mass: float, most: float) -> float:
        return 2 * super().rub(slip, mass, most)


@fault(Cause.FRICTION_SMALL, fits=is_rough)
class FrictionBeforeRestitution(EventDriven):
    """Friction is limited by the impulse that stops the approach, as in Box2D; where it does not slide, it is right."""

    def most(self, i: int, other: int, impulse: float) -> float:
        return super().most(i, other, impulse) / (1 + self.restitution(i, other))


@fault(Cause.FRICTION_SMALL, fits=is_rough)
class FrictionAlongTheSlip(EventDriven):
    """Friction has the wrong sign: it speeds up what slips."""

    def rub(self, slip: float, mass: float, most: float) -> float:
        return -super().rub(slip, mass, most)


@fault(Cause.FRICTION_LARGE, fits=is_rough)
class NoLimitOfFriction(EventDriven):
    """Friction stops every slip, whatever the impulse along the normal allows."""

    def rub(self, slip: float, mass: float, most: float) -> float:
        return slip * mass / 3 if most else 0.0


@fault(Cause.FRICTION_SMALL, Cause.FRICTION_LARGE, fits=is_rough)
class SlipWithoutSpin(EventDriven):
    """Friction is of the velocities along the tangent, without what the spins add to them."""

    def slip(self, i: int, other: int, n: complex) -> float:
        return self.approach(i, other, 1j * n)


@fault(Cause.FRICTION_LARGE, fits=is_rough)
class SumOfFrictions(EventDriven):
    """The friction of a pair is the sum of both factors, not the product."""

    def friction(self, i: int, other: int) -> float:
        return self.f[i] + (self.f[other] if other >= 0 else self.wall_f[~other])


@fault(Cause.FRICTION_LARGE, fits=lambda scene: not scene.is_rough)
class FrictionOfSmoothBalls(EventDriven):
    """Friction is a tenth of the impulse, and reported, though the product of both factors is 0."""

    def friction(self, i: int, other: int) -> float:
        return 0.1


@fault(Cause.UNEXPLAINED_IMPULSE, fits=is_rough)
class NeverTurns(EventDriven):
    """Friction acts on velocities, and turns no ball."""

    def turn(self, i: int, rubs: float) -> None:
        pass


@fault(Cause.UNEXPLAINED_IMPULSE, fits=is_rough)
class TurnsAsRings(EventDriven):
    """Friction turns balls as if they were rings of moment m r²: half as much as discs."""

    def turn(self, i: int, rubs: float) -> None:
        super().turn(i, rubs / 2)


@fault(Cause.UNEXPLAINED_IMPULSE, Cause.FRICTION_LARGE, fits=is_rough)
class Rings(TurnsAsRings):
    """Besides turning as rings do, balls need half of the slip's momentum to stop it, where discs need a third."""

    def rub(self, slip: float, mass: float, most: float) -> float:
        return super().rub(1.5 * slip, mass, most)


@fault(Cause.UNEXPLAINED_IMPULSE, fits=is_rough)
class FirstOfPairDoesNotTurn(EventDriven):
    """The first of a pair is not turned by the friction that turns the second."""

    def turn(self, i: int, rubs: float) -> None:
        if i > 0:
            super().turn(i, rubs)


@fault(Cause.UNREPORTED, fits=lambda scene: any(group.spin for group in scene.balls))
class SpinsDieAway(EventDriven):
    """Every step takes 1 % of each spin, without a contact."""

    def after_step(self) -> None:
        self.w = [0.99 * w for w in self.w]


@fault(Cause.UNREPORTED)
class SpinsOnce(EventDriven):
    """Ball 0 gets another spin once, in mid-flight; if it has a contact in that step, that may have done it."""

    def after_step(self) -> None:
        if self.happens():
            self.w[0] += 3


# Normals and times


@fault(Cause.NORMAL)
class TurnsNormal(EventDriven):
    """The contact is in time, but its impulse acts along a normal that is turned by 3°, and reported so."""

    def resolve(self, time: float, i: int, other: int, n: complex, depth: float) -> None:
        super().resolve(time, i, other, n * turned(3) if other >= 0 else n, depth)


@fault(Cause.LATE, Cause.MISSED)
class FindsLate(EventDriven):
    """A contact is found half a pixel deep: late by part of a step; a slighter touch is never found."""

    def reach(self, i: int, other: int) -> float:
        return super().reach(i, other) - 0.5


@fault(Cause.EARLY)
class FindsEarly(EventDriven):
    """A contact is found half a pixel before the two touch; some that would pass each other touch."""

    def reach(self, i: int, other: int) -> float:
        return super().reach(i, other) + 0.5


@fault(Cause.LATE, Cause.POSITION_CORRECTION, Cause.MISSED)
class PushesApart(FindsLate):
    """Found half a pixel deep, two balls are pushed apart by it, not to where a contact in time would have them."""

    def resolve(self, time: float, i: int, other: int, n: complex, depth: float) -> None:
        super().resolve(time, i, other, n, depth)
        if other >= 0:
            self.x[i] -= depth / 2 * n
            self.x[other] += depth / 2 * n


@fault(Cause.LATE, Cause.EARLY)
class WallElsewhere(EventDriven):
    """The right wall stands 2 px further in: its contacts come 2 px before the two touch."""

    def face(self, wall: int) -> float:
        return super().face(wall) - (2.0 if wall == 2 else 0.0)


# Contacts missed


@fault(Cause.MISSED)
class IgnoresPair(EventDriven):
    """The first two balls that meet fly through each other, then and later."""

    ignored: tuple[int, int] | None = None

    def resolve(self, time: float, i: int, other: int, n: complex, depth: float) -> None:
        if other >= 0 and self.ignored is None:
            self.ignored = i, other
        else:
            super().resolve(time, i, other, n, depth)

    def sees(self, i: int, other: int) -> bool:
        return (i, other) != self.ignored


@fault(Cause.MISSED)
class LacksWall(EventDriven):
    """The right wall is not there."""

    def sees(self, i: int, other: int) -> bool:
        return other != ~2


@fault(Cause.MISSED, fits=lambda scene: bool(scene.walls))
class IgnoresInnerWall(EventDriven):
    """The first inner wall is not there."""

    def sees(self, i: int, other: int) -> bool:
        return other != ~4


@fault(Cause.MISSED, Cause.LATE, fits=lambda scene: bool(scene.walls))
class IgnoresEnds(EventDriven):
    """The round ends of inner walls are not there: a ball that touches one flies on, or meets the face later."""

    def ends(self, wall: int) -> tuple[complex, ...]:
        return ()


# Positions


@fault(Cause.TELEPORTED)
class PutsApart(EventDriven):
    """After each contact of a pair, both are put 0.2 px further apart, though they do not overlap."""

    def resolve(self, time: float, i: int, other: int, n: complex, depth: float) -> None:
        super().resolve(time, i, other, n, depth)
        if other >= 0:
            self.x[i] -= 0.2 * n
            self.x[other] += 0.2 * n


@fault(Cause.TELEPORTED)
class PutsElsewhereOnce(EventDriven):
    """Ball 0 is put 3 px away once, in mid-flight."""

    def after_step(self) -> None:
        if self.happens():
            self.x[0] += 3 - 0.5j


@fault(Cause.TELEPORTED)
class JittersPlaces(EventDriven):
    """Every ball is put some hundredths of a pixel elsewhere after each step."""

    def after_step(self) -> None:
        jitter = self.random.normal(0, 0.02, (len(self.x), 2))
        self.x = [x + complex(*by) for x, by in zip(self.x, jitter.tolist(), strict=True)]


@fault(Cause.TELEPORTED)
class Drifts(EventDriven):
    """Every ball is put 0.01 px to the right after each step."""

    def after_step(self) -> None:
        self.x = [x + 0.01 for x in self.x]


@fault(Cause.TELEPORTED, fits=with_gravity)
class DriftsDown(EventDriven):
    """Every ball is put 0.03 px further along gravity after each step: no integrator of gravity does that."""

    def after_step(self) -> None:
        self.x = [x + 0.03 * self.g / abs(self.g) for x in self.x]


@fault(Cause.TELEPORTED, Cause.UNREPORTED)
class FastClock(EventDriven):
    """Each step flies for 1 % longer than it lasts: balls are ahead of their flight; gravity adds 1 % more."""

    def __init__(self, scene: Scene, initial: State) -> None:
        super().__init__(scene, initial)
        self.dt *= 1.01


@fault(Cause.TELEPORTED)
class SinglePrecision(EventDriven):
    """Places and velocities are rounded to single precision after each step: mostly by less than an error."""

    def after_step(self) -> None:
        self.x, self.v = ([complex(np.complex64(z)) for z in each] for each in (self.x, self.v))


# Velocities in flight


@fault(Cause.UNREPORTED)
class Drag(EventDriven):
    """Every step takes 0.1 % of each velocity, without a contact."""

    def after_step(self) -> None:
        self.v = [0.999 * v for v in self.v]


@fault(Cause.UNREPORTED)
class Rotation(EventDriven):
    """Every step turns each velocity by 0.05°, without a contact."""

    def after_step(self) -> None:
        self.v = [turned(0.05) * v for v in self.v]


@fault(Cause.UNREPORTED)
class JittersVelocities(EventDriven):
    """Every step adds a random 0.1 px/s to each velocity, without a contact."""

    def after_step(self) -> None:
        jitter = self.random.normal(0, 0.1, (len(self.v), 2))
        self.v = [v + complex(*by) for v, by in zip(self.v, jitter.tolist(), strict=True)]


@fault(Cause.UNREPORTED)
class KicksOnce(EventDriven):
    """Ball 0 gets another velocity once, in mid-flight."""

    def after_step(self) -> None:
        if self.happens():
            self.v[0] += 12 - 7j


@fault(Cause.UNREPORTED, Cause.TELEPORTED)
class Sticks(EventDriven):
    """Ball 0 stands still for five steps, and then goes on: its velocity becomes 0, and what it was."""

    kept: tuple[complex, complex] | None = None

    def after_step(self) -> None:
        since = self.steps - round(HAPPENS * self.scene.rate)
        if since == 0:
            self.kept = self.x[0], self.v[0]
        if self.kept and 0 <= since < 5:
            self.x[0], self.v[0] = self.kept[0], 0j
        elif self.kept and since == 5:
            self.x[0], self.v[0] = self.kept


# Gravity


@fault(Cause.GRAVITY, fits=with_gravity)
class GravityTooStrong(EventDriven):
    """Gravity is 1 % too strong: the flight is another parabola."""

    def __init__(self, scene: Scene, initial: State) -> None:
        super().__init__(scene, initial)
        self.g *= 1.01


@fault(Cause.GRAVITY, fits=with_gravity)
class GravityTurned(EventDriven):
    """Gravity points 1° aside: the flight is another parabola."""

    def __init__(self, scene: Scene, initial: State) -> None:
        super().__init__(scene, initial)
        self.g *= turned(1)


@fault(Cause.GRAVITY, fits=with_gravity)
class NoGravity(EventDriven):
    """Gravity is left out: the flight is straight."""

    def __init__(self, scene: Scene, initial: State) -> None:
        super().__init__(scene, initial)
        self.g *= 0


@fault(Cause.GRAVITY, Cause.LATE, fits=lambda scene: with_gravity(scene) and not scene.walls)
class ExplicitGravity(Stepped):
    """Steps fly at the velocity before gravity: short of the parabola. Contacts are found late."""

    def move(self) -> None:
        for i in self.balls:
            self.x[i] += self.dt * self.v[i]
            self.v[i] += self.dt * self.g


@fault(Cause.GRAVITY, Cause.LATE, fits=lambda scene: with_gravity(scene) and not scene.walls)
class SemiImplicitGravity(Stepped):
    """Steps fly at the velocity after gravity: beyond the parabola. Contacts are found late."""

    def move(self) -> None:
        for i in self.balls:
            self.v[i] += self.dt * self.g
            self.x[i] += self.dt * self.v[i]


@fault(Cause.GRAVITY, Cause.LATE, Cause.OVERSHOOT, fits=lambda scene: with_gravity(scene) and not scene.walls)
class PositionVerlet(Stepped):
    """Places follow from the two before, and velocities from them. What is found in a wall is put on it."""

    reflects: ClassVar = False

    def __init__(self, scene: Scene, initial: State) -> None:
        super().__init__(scene, initial)
        self.before = [x - self.dt * v for x, v in zip(self.x, self.v, strict=True)]

    def move(self) -> None:
        places = zip(self.x, self.before, strict=True)
        self.x, self.before = [2 * x - before + self.dt**2 * self.g for x, before in places], self.x
        self.v = [(x - before) / self.dt for x, before in zip(self.x, self.before, strict=True)]

    def step(self) -> None:
        super().step()
        self.before = [x - self.dt * v for x, v in zip(self.x, self.v, strict=True)]


# Engines in steps. Those without inner walls would miss them.

LATE_BY_ITSELF: Final = (Cause.LATE, Cause.MISSED)  # of a stepped engine: shorter touches than a step are missed


@fault(*LATE_BY_ITSELF, fits=without_inner_walls)
class SteppedRight(Stepped):
    """Contacts are found up to a step late, on a normal that has turned meanwhile; touches within a step are missed."""


@fault(*LATE_BY_ITSELF, Cause.LARGE, fits=without_inner_walls)
class SteppedImpulseTooLarge(Stepped):
    """Besides being late, each impulse is 2 % too large."""

    def impulse(self, i: int, other: int, right: float) -> float:
        return 1.02 * right


@fault(*LATE_BY_ITSELF, Cause.SMALL, fits=lambda scene: without_inner_walls(scene) and with_gravity(scene))
class SteppedWallsTooSoft(Stepped):
    """Besides being late, walls return 3 % too little."""

    def restitution(self, i: int, other: int) -> float:
        return super().restitution(i, other) * (0.97 if other < 0 else 1.0)


@fault(*LATE_BY_ITSELF, Cause.OVERSHOOT, fits=without_inner_walls)
class SteppedDiscardsOvershoot(Stepped):
    """A ball found in a wall is put on it, which discards the way that it has flown back already."""

    reflects: ClassVar = False


@fault(*LATE_BY_ITSELF, Cause.POSITION_CORRECTION, fits=without_inner_walls)
class SteppedPushesApart(Stepped):
    """Balls found overlapping are pushed apart by half of it each."""

    def part(self, i: int, j: int, overlap: complex) -> None:
        self.x[i] -= overlap / 2
        self.x[j] += overlap / 2


@fault(*LATE_BY_ITSELF, fits=without_inner_walls)
class SteppedIgnoresPair(Stepped):
    """Balls 0 and 1 fly through each other."""

    def sees(self, i: int, other: int) -> bool:
        return (i, other) != (0, 1)


# Engines of the sandbox with one thing changed

OF_IMPULSE: Final = (Cause.LATE, Cause.POSITION_CORRECTION, Cause.MISSED)
OF_PYMUNK: Final = (*OF_IMPULSE, Cause.GRAVITY, Cause.UNCONVERGED, Cause.WARM_START)


class _Kicked:
    """Lets a sandbox's engine run, and changes velocities after each step."""

    made: Callable[[Scene, State], Any]

    def __init__(self, scene: Scene, initial: State) -> None:
        self.engine = type(self).made(scene, initial)
        self.contacts, self.record_contacts = self.engine.contacts, self.engine.record_contacts
        self.state, self.kick = self.engine.state, self.engine.kick

    def step(self) -> None:
        self.engine.step()
        for ball, (vx, vy) in enumerate(self.engine.state().velocity.tolist()):
            self.engine.kick(ball, (-0.002 * vx, -0.002 * vy))


@fault(*OF_IMPULSE, Cause.UNREPORTED)
class ImpulseWithDrag(_Kicked):
    """Besides what `impulse` does, every step takes 0.2 % of each velocity, without a contact."""

    made = ImpulseEngine


@fault(*OF_PYMUNK, Cause.UNREPORTED)
class PymunkWithDrag(_Kicked):
    """Besides what Pymunk does, every step takes 0.2 % of each velocity, without a contact."""

    made = PymunkEngine


@fault(*OF_PYMUNK, Cause.SMALL)
class PymunkTooSoft(PymunkEngine):
    """Besides what Pymunk does, its balls have 3 % less elasticity: impulses are too small."""

    def __init__(self, scene: Scene, initial: State) -> None:
        super().__init__(scene, initial)
        for shape in self.space.shapes:
            if isinstance(shape, Circle):
                shape.elasticity *= 0.97


def judged(engine: Any, scene: Scene) -> Verdict:
    """Run an engine, and judge its states."""
    running = engine(scene, spawn(scene))
    states = [running.state()]
    for _ in range(scene.steps):
        running.step()
        states.append(running.state())
    return on_states(scene, States.stack(states))
