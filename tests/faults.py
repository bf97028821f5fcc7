"""Engines with one known fault each, and the causes that are true of each: the corpus that the judge is scored on.

Those here run in the scenes of a seed. `programs` adds those of tutorials, each with a scene of its own.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, Final

import numpy as np
from event_driven import EventDriven, Stepped, dot, turned
from pymunk import Circle
from verdicts import on_states

from sandbox.engines import create
from sandbox.engines.pymunk import PymunkEngine
from sandbox.judge.causes import Cause
from sandbox.judge.summary import Verdict
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.state import State, States

FLOOR: Final = 3
HAPPENS: Final = 0.2  # s, when a fault happens that happens once


@dataclass(frozen=True)
class Fault:
    """An engine with a fault: a class, or a function `step`.

    true: the causes that are true of its states; fits: whether a scene of a seed can show it; scene: its own, in place
    of these; says: causes of which a verdict must name one; figures: the parameter of the fault in the forms in which
    it may be said, of which one must be, if there are any.
    """

    engine: Any
    true: frozenset[Cause]
    fits: Callable[[Scene], bool]
    scene: Scene | None = None
    says: frozenset[Cause] = frozenset()
    figures: tuple[float, ...] = ()


FAULTS: Final[dict[str, Fault]] = {}


def _anywhere(scene: Scene) -> bool:
    return True


def happens(engine: EventDriven) -> bool:
    """Return whether a fault that happens once happens after this step."""
    return engine.steps == round(HAPPENS * engine.scene.rate)


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

    impulse_factor = 1.02


@fault(Cause.SMALL)
class ImpulseTooSmall(EventDriven):
    """Each impulse is 2 % smaller."""

    impulse_factor = 0.98


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


@fault(Cause.UNREPORTED, fits=lambda scene: any(group.spin for group in scene.balls))
class SpinsDieAway(EventDriven):
    """Every step takes 1 % of each spin, without a contact."""

    def after_step(self) -> None:
        self.w = [0.99 * w for w in self.w]


@fault(Cause.UNREPORTED)
class SpinsOnce(EventDriven):
    """Ball 0 gets another spin once, in mid-flight; if it has a contact in that step, that may have done it."""

    def after_step(self) -> None:
        if happens(self):
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
        if happens(self):
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


@fault(Cause.TELEPORTED, Cause.UNREPORTED)
class FastClock(EventDriven):
    """Each step flies for 1 % longer than it lasts: balls are ahead of their flight; gravity adds 1 % more."""

    clock_factor = 1.01


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
class JittersVelocities(EventDriven):
    """Every step adds a random 0.1 px/s to each velocity, without a contact."""

    def after_step(self) -> None:
        jitter = self.random.normal(0, 0.1, (len(self.v), 2))
        self.v = [v + complex(*by) for v, by in zip(self.v, jitter.tolist(), strict=True)]


@fault(Cause.UNREPORTED)
class KicksOnce(EventDriven):
    """Ball 0 gets another velocity once, in mid-flight."""

    def after_step(self) -> None:
        if happens(self):
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

    gravity_factor = 1.01


@fault(Cause.GRAVITY, fits=with_gravity)
class GravityTurned(EventDriven):
    """Gravity points 1° aside: the flight is another parabola."""

    gravity_factor = turned(1)


@fault(Cause.GRAVITY, fits=with_gravity)
class NoGravity(EventDriven):
    """Gravity is left out: the flight is straight."""

    gravity_factor = 0


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

    impulse_factor = 1.02


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


@fault(*OF_PYMUNK, Cause.UNREPORTED)
class PymunkWithDrag(PymunkEngine):
    """Besides what Pymunk does, every step takes 0.2 % of each velocity, without a contact."""

    def step(self) -> None:
        super().step()
        for ball, (vx, vy) in enumerate(self.state().velocity.tolist()):
            self.kick(ball, (-0.002 * vx, -0.002 * vy))


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
    running = create(engine, scene, spawn(scene))
    states = States.empty(scene.steps + 1, len(scene.bodies))
    states.fill(0, running.state())
    for step in range(scene.steps):
        running.step()
        states.fill(step + 1, running.state())
    return on_states(scene, states)
