"""What bodies that touch did to each other over several steps: contacts missed, contacts found late, and springs."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Final, NamedTuple

import numpy as np

from sandbox.judge.causes import Cause
from sandbox.judge.fit import Outcome
from sandbox.judge.groups import Flown
from sandbox.judge.overlaps import in_each_other, in_walls
from sandbox.judge.thresholds import SPRING_STEPS
from sandbox.judge.words import of_turn
from sandbox.quantity import length
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.scene.walls import ARENA_COUNT, nearest_on_segment, pieces_of
from sandbox.state import Bools, Floats, Integers

UNDECIDED: Final = 1  # steps, after which a contact that has not followed is missed
OUTWARD: Final = np.array([(-1.0, 0.0), (0.0, -1.0), (1.0, 0.0), (0.0, 1.0)])  # of the arena's walls


@dataclass
class StepError:
    """What is wrong with a step of some balls.

    step: of the run, from 1; balls: of the group; contact: first and second, None without one; candidates: the outcomes
    that leave nothing over, with their causes; cause, because: why; energy (kg px²/s²), momentum (kg px/s) and
    displacement (px): what is over of the exact step; speed: px/s, the sum of the velocities' errors; before, after,
    should: velocities (k, 2) px/s of the contact's balls, and their spins; times: how many balls or contacts it stands
    for; numbers: how many numbers the places, velocities and spins have that it shows wrong; depth: px, of the contact
    when it was found; gained: momentum (kg px/s) and angular momentum about the arena's centre (kg px²/s) that neither
    gravity gave nor a wall can have given; places: (k, 2) px, of the contact's balls before; flown: s, from there to
    where it is found; by_rule: whether a rule of steps explains it, which has no parameter.
    """

    step: int
    balls: tuple[int, ...]
    contact: tuple[int, int] | None
    cause: Cause
    because: str
    energy: float
    momentum: float
    displacement: float
    speed: float
    before: Floats
    after: Floats
    should: Floats
    spins: tuple[Floats, Floats, Floats]
    places: Floats
    flown: float
    candidates: list[tuple[Outcome, Cause]] = field(default_factory=list)
    times: int = 1
    numbers: int = 9
    by_rule: bool = False
    depth: float | None = None
    gained: Floats = field(default_factory=lambda: np.zeros(3))


class Touch(NamedTuple):
    """Two bodies that overlap before a step, or after it.

    depth: px, before; free, after: px/s, how fast they would approach without the contact, and do; pushed: px/s, by
    which they are pushed apart; central: whether nothing else changed their velocities.
    """

    pair: tuple[int, int]
    depth: float
    free: float
    after: float
    pushed: float
    central: bool


class Touches:
    """Finds the bodies of a scene that touch in a step."""

    def __init__(self, scene: Scene) -> None:
        self._scene, self._gravity = scene, np.array(scene.gravity)
        self._piece = pieces_of(scene)
        self._walls = range(0 if scene.arena.walls else ARENA_COUNT, ARENA_COUNT + len(scene.walls))

    def of(self, f: Flown, row: int, pair: tuple[int, int]) -> Touch:
        """Return how two bodies touch in a step."""
        return self._of_balls(f, row, pair) if pair[1] >= 0 else self._of_wall(f, row, pair)

    def _of_balls(self, f: Flown, row: int, pair: tuple[int, int]) -> Touch:
        """Return how two balls touch in a step. In complex numbers, which are faster than arrays of two."""
        first, second = pair
        x, v, _, _ = f.before
        y, w, _, _ = f.after
        away, after = (complex(*at[row, second]) - complex(*at[row, first]) for at in (x, y))
        fall = float(f.dt[row]) * complex(*self._gravity)
        free = [complex(*v[row, ball]) + fall for ball in pair]
        change = [complex(*w[row, ball]) - each for ball, each in zip(pair, free, strict=True)]
        given = [float(self._scene.bodies.mass[ball]) * each for ball, each in zip(pair, change, strict=True)]
        n, relative = away / (abs(away) or 1.0), change[0] - change[1]
        pushed, closing = -(relative * n.conjugate()).real, ((free[0] - free[1]) * n.conjugate()).real
        depth = float(self._scene.bodies.radius[[first, second]].sum()) - min(abs(away), abs(after))
        central = abs(sum(given)) <= (abs(given[0]) + abs(given[1])) / 2 and 2 * pushed**2 > abs(relative) ** 2
        return Touch(pair, depth, closing, closing - pushed, pushed, central)

    def _of_wall(self, f: Flown, row: int, pair: tuple[int, int]) -> Touch:
        """Return how a ball touches a wall in a step."""
        bodies, first = self._scene.bodies, pair[0]
        [free], [change] = self._change(f, row, [first])
        (away, depth), (_, after) = (self._away(states.position[row], pair) for states in (f.before, f.after))
        near = length(f.before.position[row] - f.before.position[row, first]) < 2 * (
            bodies.radius + bodies.radius[first]
        )
        near[first] = False
        given = (bodies.mass[near, None] * self._change(f, row, near)[1]).sum(axis=0)
        n = away / (float(length(away)) or 1.0)
        pushed, closing = -float(change @ n), float(free @ n)
        alone = bool(length(given) <= bodies.mass[first] * length(change) / 2)
        central = alone and 2 * pushed * pushed > float(change @ change)
        return Touch(pair, max(depth, after), closing, closing - pushed, pushed, central)

    def normals(self, error: StepError) -> tuple[Vector | None, Vector | None]:
        """Return the normals of an error's contact, from first to second: where the move ends, and at first touch.

        None where they are apart, or the error was found to be of that contact only later.
        """
        if error.contact is None or len(error.places) != sum(body >= 0 for body in error.contact):
            return None, None
        end, x, v = error.flown, error.places, error.before
        first, last = self._overlap(x, v, error.contact, end)
        at_end = self._normal(x, v, error.contact, end) if first <= end <= last else None
        at_touch = self._normal(x, v, error.contact, max(first, 0.0)) if first <= end and last >= 0 else None
        return at_end, at_touch

    def said(self, error: StepError) -> str:
        """Return the sentence of an error; of a contact found late, with how far its normal is turned by that."""
        return of_turn(error.because, *self.normals(error)) if error.cause == Cause.LATE else error.because

    def overlap_time(self, f: Flown, row: int, pair: tuple[int, int]) -> float:
        """Return for how long two balls overlap on straight ways, s; 0 for a wall."""
        if pair[1] < 0:
            return 0.0
        first, last = self._overlap(f.before.position[row, pair], f.before.velocity[row, pair], pair, float(f.dt[row]))
        return max(last - first, 0.0)

    def _overlap(self, x: Floats, v: Floats, pair: tuple[int, int], dt: float) -> tuple[float, float]:
        """Return from when until when two overlap on straight ways, s since the step began; all of it at a wall.

        x, v: (2, 2) px and px/s.
        """
        if pair[1] < 0:
            return 0.0, dt
        away, speed = x[1] - x[0], v[1] - v[0]
        reach = self._scene.bodies.radius[[*pair]].sum()
        square, along = float(speed @ speed), float(away @ speed)
        inside = along * along - square * (float(away @ away) - reach * reach)
        if square == 0 or inside < 0:
            return np.inf, -np.inf
        return (-along - inside**0.5) / square, (-along + inside**0.5) / square

    def _normal(self, x: Floats, v: Floats, pair: tuple[int, int], time: float) -> Vector:
        """Return the normal of a contact at a time since a step began, s. x, v: (k, 2) px and px/s, of its balls."""
        away, _ = self._between(x + time * (v + time * self._gravity / 2), pair)
        across = float(length(away)) or 1.0
        return float(away[0] / across), float(away[1] / across)

    def is_through(self, f: Flown, row: int, pair: tuple[int, int]) -> bool:
        """Return whether two bodies that met in a step are apart after it, or a ball is beyond a wall's middle."""
        (before, _), (after, depth) = (self._away(states.position[row], pair) for states in (f.before, f.after))
        return depth <= 0 or (pair[1] < 0 and bool(before @ after <= 0))

    def depth(self, x: Floats, pair: tuple[int, int]) -> float:
        """Return how deep two bodies are in each other, px; negative if they are apart. x: (n, 2) px."""
        return self._away(x, pair)[1]

    def _away(self, x: Floats, pair: tuple[int, int]) -> tuple[Floats, float]:
        """Return the way from the first body to the second, and how deep they are in each other, px. x: (n, 2) px."""
        return self._between(x[[pair[0], max(pair[1], 0)]], pair)

    def _between(self, x: Floats, pair: tuple[int, int]) -> tuple[Floats, float]:
        """Return what `_away` does. x: (k, 2) px, of the pair's balls only."""
        radius, (first, second) = self._scene.bodies.radius, pair
        if second >= 0:
            away = x[1] - x[0]
            return away, float(radius[first] + radius[second] - length(away))
        wall = ~second
        if wall < ARENA_COUNT:
            n = OUTWARD[wall]
            face = max(0.0, float(n @ self._scene.arena.size))
            return n, float(radius[first] + n @ x[0] - face)
        start, to, thickness = self._scene.wall_line(wall)
        away = nearest_on_segment(x[0], np.array(start), np.array(to)) - x[0]
        return away, float(radius[first] + thickness / 2 - length(away))

    def _change(self, f: Flown, row: int, balls: Bools | Sequence[int]) -> tuple[Floats, Floats]:
        """Return the velocities that balls would have after a step without a contact, and what they have besides."""
        free = f.before.velocity[row, balls] + f.dt[row] * self._gravity
        return free, f.after.velocity[row, balls] - free

    def among(self, f: Flown, row: int, balls: Sequence[int], gap: float = 0.0) -> list[Touch]:
        """Return how some balls touch each other, and walls, or are at most a gap (px) apart."""
        pairs = [*combinations(balls, 2), *((ball, ~wall) for ball in balls for wall in self._walls)]
        depths = (self._depths(states.position[row, balls], np.array(balls)) for states in (f.before, f.after))
        near = np.flatnonzero(np.maximum(*depths) > f.floor - gap)
        return [self.of(f, row, pairs[k]) for k in near.tolist()]

    def _depths(self, x: Floats, balls: Integers) -> Floats:
        """Return how deep each two balls are in each other, px, and then each ball in each wall. x: (k, 2) px."""
        radius = self._scene.bodies.radius[balls]
        return np.concatenate([in_each_other(x, radius), in_walls(x, radius, self._piece).ravel()])


class Missed:
    """Contacts that did not happen in their step: found late if they follow while the bodies overlap, else missed."""

    def __init__(self, touches: Touches) -> None:
        self._touches = touches
        self._open: dict[tuple[int, int], StepError] = {}

    def undecided(self, steps: int) -> list[StepError]:
        """Return the contacts that may still follow after the end of a run of some steps."""
        return [error for error in self._open.values() if steps - error.step < UNDECIDED]

    def follow(self, f: Flown, row: int, step: int, errors: list[StepError]) -> list[StepError]:
        """Follow what is open through a step, and return the step's errors without those that go on."""
        for pair, error in list(self._open.items()):
            touch = self._touches.of(f, row, pair)
            if touch.depth + max(touch.free, 0.0) * f.dt[row] <= f.floor:
                del self._open[pair]
            elif touch.pushed * f.dt[row] > f.floor and touch.central and touch.free > 0:
                error.cause, late = Cause.LATE, step - error.step
                error.because = f"Found {late} step{'s' * (late > 1)} late."
                error.displacement, error.momentum = error.displacement + error.speed * late * float(f.dt[row]), 0.0
                error.speed, error.flown = 0.0, error.flown + late * float(f.dt[row])
                del self._open[pair]
        kept = []
        for error in errors:
            if error.cause != Cause.MISSED or error.contact is None:
                kept.append(error)
            elif error.contact not in self._open:
                self._open[error.contact] = error
                kept.append(error)
        return kept


class Springs:
    """Contacts that push in several steps, while the two still approach and while they part already."""

    def __init__(self) -> None:
        self._streaks: dict[tuple[int, int], tuple[int, list[tuple[Touch, list[StepError]]]]] = {}
        self._step = 0
        self._indexed = -1  # the step whose contacts are in `_of_ball`, by their bodies
        self._of_ball: dict[int, list[tuple[int, int]]] = {}

    def pushing(self, step: int, balls: Sequence[int]) -> list[tuple[int, int]]:
        """Return the contacts of some balls that push in a step, once all of it is noted."""
        if step != self._indexed:
            self._indexed, self._of_ball = step, {}
            for pair in (pair for pair, (last, _) in self._streaks.items() if last == step):
                for body in pair:
                    self._of_ball.setdefault(body, []).append(pair)
        return list(dict.fromkeys(pair for ball in balls for pair in self._of_ball.get(ball, ())))

    def follow(self, touches: Sequence[Touch], step: int, errors: list[StepError]) -> None:
        """Note what touches in a step with some errors. Steps come in their order."""
        if step != self._step:
            self._step = step
            self._streaks = {pair: streak for pair, streak in self._streaks.items() if streak[0] >= step - 1}
        for touch in touches:
            if touch.depth <= 0:
                continue
            _, streak = self._streaks.get(touch.pair, (step, []))
            streak.append((touch, errors))
            self._streaks[touch.pair] = step, streak
            pushing = [(each, of_step) for each, of_step in streak if each.pushed > 0]
            if _is_spring([each for each in pushing if not any(error.by_rule for error in each[1])]):
                for error in (error for _, of_step in streak for error in of_step if not error.by_rule):
                    error.cause, error.contact, error.candidates = Cause.SOFT, touch.pair, []
                    error.because = "The contact pushes in several steps, as a spring does, and not by one impulse."


def _is_spring(streak: Sequence[tuple[Touch, list[StepError]]]) -> bool:
    """Return whether a contact that pushes does so like a spring."""
    if len(streak) < SPRING_STEPS:
        return False
    if any(error.cause == Cause.SOFT and not error.candidates for _, errors in streak for error in errors):
        return True  # as was found a step ago
    touches = [touch for touch, _ in streak]
    slight = 1e-6 * max(touch.pushed for touch in touches)
    while_closing = any(touch.after > slight for touch in touches)
    while_parting = any(touch.free < -slight for touch in touches)
    values = {
        (o.trial.fault, f"{o.trial.value:.3g}") for _, errors in streak for e in errors for o, _ in e.candidates[:1]
    }
    return while_closing and while_parting and len(values) != 1
