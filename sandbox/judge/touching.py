"""What bodies that touch did in several steps: overlaps at the start, contacts missed and found late, springs."""

from collections.abc import Iterator, Sequence
from itertools import chain, combinations
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.judge.causes import Cause
from sandbox.judge.groups import Flown
from sandbox.judge.step_errors import StepError
from sandbox.judge.thresholds import FAR, SPRING_STEPS
from sandbox.judge.words import of_outcome, of_turn
from sandbox.quantity import length, pass_through, passing
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.scene.overlaps import depth_rounding
from sandbox.scene.units import Dimension
from sandbox.scene.walls import ARENA_COUNT, nearest_on_segment, wall_distance
from sandbox.state import Bools, Floats, Integers, States

MAX_PAIRS: Final = 400_000  # pairs of balls in steps that are looked through for how an engine flies
UNDECIDED: Final = 1  # steps, after which a contact that has not followed is missed
OUTWARD: Final = np.array([(-1.0, 0.0), (0.0, -1.0), (1.0, 0.0), (0.0, 1.0)])  # of the arena's walls

SEVERAL: Final = 10  # times its depth at the start, up to which an overlap explains what is found later
OF_OVERLAP: Final = (
    *(Cause.LATE, Cause.EARLY, Cause.POSITION_CORRECTION, Cause.TELEPORTED, Cause.OVERSHOOT, Cause.DOUBLE_BOUNCE),
    *(Cause.WARM_START, Cause.UNCONVERGED, Cause.UNKNOWN),
)


def in_each_other(x: Floats, radius: Floats, filters: Integers) -> Floats:
    """Return how deep balls are in each other, px, in the order of `itertools.combinations`. x: (k, 2) px.

    filters: (k, 3), as in `Bodies`; the depth of balls that pass through each other is -inf.
    """
    first, second = np.triu_indices(len(x), 1)
    depth = radius[first] + radius[second] - length(x[first] - x[second])
    return np.where(passing(filters, first, second), -np.inf, depth)


def in_walls(x: Floats, radius: Floats, piece: NDArray[np.void]) -> Floats:
    """Return how deep balls are in walls, px: (k, walls). piece: PIECE, of all walls, by their numbers."""
    if not len(piece):
        return np.empty((len(x), 0))
    rx, ry = x[:, :1] - piece["x"], x[:, 1:] - piece["y"]
    along, off = rx * piece["tx"] + ry * piece["ty"], ry * piece["tx"] - rx * piece["ty"]
    is_end, is_arena = piece["length"] == 0, piece["wall"] < ARENA_COUNT
    distance = np.where(is_end, np.hypot(rx, ry), np.where(is_arena, off, np.abs(off)))
    beside = is_arena | np.where(is_end, along >= 0, (along >= 0) & (along <= piece["length"]))
    depth = np.where(beside, radius[:, None] + piece["half_thickness"] - distance, -np.inf)
    starts = np.flatnonzero(np.diff(piece["wall"], prepend=-1))
    depths: Floats = np.maximum.reduceat(depth, starts, axis=1)
    return depths


def free_balls(scene: Scene, *ends: States) -> Bools:
    """Return which balls touch nothing before steps and after them: (steps, n); of many balls, in some steps.

    ends: the states there.
    """
    steps, n, radius, filters = len(ends[0].position), len(scene.bodies), scene.bodies.radius, scene.bodies.filters
    rows = min(steps, max(1, MAX_PAIRS // (n * n)))
    free = np.zeros((steps, n), bool)
    free[:rows] = True
    for states in ends:
        x = states.position[:rows]
        free[:rows] &= wall_distance(scene, x) > (1 + FAR) * radius
        for i in range(n - 1):
            apart = length(x[:, i + 1 :] - x[:, i : i + 1]) > (1 + FAR) * (radius[i + 1 :] + radius[i])
            apart |= pass_through(filters[i], filters[i + 1 :].T)
            free[:rows, i] &= apart.all(axis=1)
            free[:rows, i + 1 :] &= apart
    return free


class Touch(NamedTuple):
    """Two bodies that overlap before a step, or after it.

    depth: px, before; free, after: px/s, how fast they would approach without the contact, and do; pushed: px/s, by
    which they are pushed apart; central: whether nothing else explains the push.
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

    def of(self, f: Flown, row: int, pair: tuple[int, int]) -> Touch:
        """Return how two bodies touch in a step."""
        return self.of_pairs(f, np.array([row]), np.array([pair]))[0] if pair[1] >= 0 else self._of_wall(f, row, pair)

    def of_pairs(self, f: Flown, rows: Integers, pairs: Integers) -> list[Touch]:
        """Return how pairs of balls, (k, 2), touch in their steps."""
        bodies, at = self._scene.bodies, (rows[:, None], pairs)
        away, after = (x[:, 1] - x[:, 0] for x in (f.before.position[at], f.after.position[at]))
        free = f.before.velocity[at] + np.multiply.outer(f.dt[rows], self._gravity)[:, None]
        change = f.after.velocity[at] - free
        given = bodies.mass[pairs, None] * change
        distance = length(away)
        n, relative = away / np.where(distance > 0, distance, 1.0)[:, None], change[:, 0] - change[:, 1]
        pushed, closing = -(relative * n).sum(axis=1), ((free[:, 0] - free[:, 1]) * n).sum(axis=1)
        depth = bodies.radius[pairs].sum(axis=1) - np.minimum(distance, length(after))
        central = length(given.sum(axis=1)) <= length(given).sum(axis=1) / 2
        central &= 2 * pushed**2 > (relative**2).sum(axis=1)
        each = (column.tolist() for column in (pairs, depth, closing, closing - pushed, pushed, central))
        return [Touch((pair[0], pair[1]), *values) for pair, *values in zip(*each, strict=True)]

    def _of_wall(self, f: Flown, row: int, pair: tuple[int, int]) -> Touch:
        """Return how a ball touches a wall in a step."""
        bodies, first = self._scene.bodies, pair[0]
        [free], [change] = self._change(f, row, [first])
        (away, depth), (_, after) = (self._away(states.position[row], pair) for states in (f.before, f.after))
        near = self._may_meet(f, row, first)
        given = (bodies.mass[near, None] * self._change(f, row, near)[1]).sum(axis=0)
        n = away / (float(length(away)) or 1.0)
        pushed, closing = -float(change @ n), float(free @ n)
        alone = bool(length(given) <= bodies.mass[first] * length(change) / 2)
        central = alone and (pushed >= closing or 2 * pushed * pushed > float(change @ change))
        return Touch(pair, max(depth, after), closing, closing - pushed, pushed, central)

    def _may_meet(self, f: Flown, row: int, ball: int) -> Bools:
        """Return which others a ball may touch on straight ways in a step: (n,)."""
        bodies, x = self._scene.bodies, f.before.position[row]
        way = f.dt[row] * f.before.velocity[row]
        away, by = x - x[ball], way - way[ball]
        square = (by * by).sum(axis=1)
        nearest = np.clip(-(away * by).sum(axis=1) / np.where(square > 0, square, 1.0), 0.0, 1.0)
        meet: Bools = length(away + nearest[:, None] * by) < (1 + FAR) * (bodies.radius + bodies.radius[ball])
        meet &= ~pass_through(bodies.filters[ball], bodies.filters.T)
        meet[ball] = False
        return meet

    def contact_places(self, f: Flown, row: int, pair: tuple[int, int]) -> Floats:
        """Return where the balls of a contact were when a step found it, (k, 2) px: before its move, or after.

        That is where the normal is nearer to the push.
        """
        balls = [body for body in pair if body >= 0]
        x, v = f.before.position[row, balls], f.before.velocity[row, balls]
        change = self._change(f, row, balls)[1]
        push = (change[1] if len(balls) > 1 else 0.0) - change[0]
        moved = x + f.dt[row] * (v + f.dt[row] * self._gravity / 2)
        return max(moved, x, key=lambda at: float(push @ self._normal(at, 0 * v, pair, 0.0)))

    def normals(self, error: StepError) -> tuple[Vector | None, Vector | None]:
        """Return the normals of an error's contact, from first to second: where the move ends, and at first touch.

        None where they are apart, or the error was found to be of that contact only later.
        """
        if error.contact is None or len(error.places) != sum(body >= 0 for body in error.contact):
            return None, None
        end, x, v = error.flown, error.places, error.before
        first, last = self._overlap(x, v, error.contact, end)
        at_end = self._normal(x, v, error.contact, end) if first <= end <= last else None
        if error.contact_places is not None:
            at_end = self._normal(error.contact_places, 0 * v, error.contact, 0.0)
        at_touch = self._normal(x, v, error.contact, max(first, 0.0)) if first <= end and last >= 0 else None
        return at_end, at_touch

    def said(self, error: StepError) -> str:
        """Return the sentence of an error; of a contact found late, with how far its normal is turned by that."""
        because = error.because or of_outcome(self._scene, *error.candidates[0])
        return of_turn(because, *self.normals(error)) if error.cause == Cause.LATE else because

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
        return self.depth(f.after.position[row], pair) <= 0 or (pair[1] < 0 and self.passes(f, row, pair))

    def passes(self, f: Flown, row: int, pair: tuple[int, int]) -> bool:
        """Return whether two balls overlap on straight ways in a step, or one goes beyond the middle of a wall."""
        if pair[1] >= 0:
            return self.overlap_time(f, row, pair) > 0
        (before, _), (after, _) = (self._away(states.position[row], pair) for states in (f.before, f.after))
        return bool(before @ after <= 0)

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

    def among(self, f: Flown, row: int, balls: Sequence[int]) -> list[Touch]:
        """Return how some balls touch each other, and walls."""
        walls = np.unique(f.piece["wall"]).tolist()
        pairs = [*combinations(balls, 2), *((ball, ~wall) for ball in balls for wall in walls)]
        depths = (self._depths(f, states.position[row, balls], np.array(balls)) for states in (f.before, f.after))
        near = np.flatnonzero(np.maximum(*depths) > f.floor)
        return [self.of(f, row, pairs[k]) for k in near.tolist()]

    def _depths(self, f: Flown, x: Floats, balls: Integers) -> Floats:
        """Return how deep each two balls are in each other, px, and then each ball in each wall. x: (k, 2) px."""
        radius, filters = self._scene.bodies.radius[balls], self._scene.bodies.filters[balls]
        return np.concatenate([in_each_other(x, radius, filters), in_walls(x, radius, f.piece).ravel()])


class StartOverlaps:
    """The bodies of a scene that overlap at the start and have not come apart since, with their depths then, px.

    No engine led them into each other, and engines part them in different ways. So what is wrong with the place, the
    time or the order of such a contact is no error of a step; what is wrong with its impulse or its friction is.
    """

    def __init__(self, scene: Scene, position: Floats, touches: Touches) -> None:
        self._scene, self._touches = scene, touches
        least = depth_rounding(scene)
        depths = {pair: touches.depth(position, pair) for pair in _near(scene, position)}
        self._depths = {pair: depth for pair, depth in depths.items() if depth > least}

    def follow(self, f: Flown, row: int, errors: list[StepError]) -> None:
        """Excuse the errors of a step that come from an overlap, and forget those that the step ended."""
        for error in errors if self._depths else ():
            pair = self._overlap_of(error)
            if pair is not None:
                error.because = self._because(pair)
                error.cause, error.candidates = Cause.OVERLAPPED, []
        for pair in list(self._depths):
            if self._touches.depth(f.after.position[row], pair) <= 0:
                del self._depths[pair]

    def _overlap_of(self, error: StepError) -> tuple[int, int] | None:
        """Return the overlap that an error comes from: of its contact, others of its group, or a ball in flight."""
        if error.contact is None:
            return next((pair for pair in self._depths if pair[1] < 0 and error.balls == pair[:1]), None)
        if error.cause not in OF_OVERLAP:
            return None
        depth = error.displacement if error.depth is None or error.cause == Cause.TELEPORTED else error.depth
        bodies = {*error.balls, error.contact[1]}
        deep = [pair for pair in self._depths if bodies.issuperset(pair) and depth <= SEVERAL * self._depths[pair]]
        return error.contact if error.contact in deep else next(iter(deep), None)

    def _because(self, pair: tuple[int, int]) -> str:
        first, second = pair
        partner = f"ball {second}" if second >= 0 else self._scene.wall_name(~second)
        depth = self._scene.units.text(Dimension.LENGTH, "{:.3g}", self._depths[pair])
        return (
            f"Ball {first} and {partner} overlapped by {depth} when the comparison began: no step led them into each "
            "other."
        )


def _near(scene: Scene, position: Floats) -> Iterator[tuple[int, int]]:
    """Yield the pairs of bodies that may overlap: first and second. position: (n, 2) px."""
    radius = scene.bodies.radius
    order = np.argsort(position[:, 0], kind="stable")
    x, largest = position[order], 2 * float(radius.max())
    for by in range(1, len(order)):
        near = x[by:, 0] - x[:-by, 0] < largest
        if not near.any():
            break
        overlap = length(x[by:] - x[:-by]) < radius[order[by:]] + radius[order[:-by]]
        overlap &= ~passing(scene.bodies.filters, order[by:], order[:-by])
        for k in np.flatnonzero(near & overlap).tolist():
            first, second = sorted((int(order[k]), int(order[k + by])))
            yield first, second
    for ball in np.flatnonzero(wall_distance(scene, position) < radius).tolist():
        for wall in range(0 if scene.arena.walls else ARENA_COUNT, ARENA_COUNT + len(scene.walls)):
            yield ball, ~wall


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
                error.contact_places = self._touches.contact_places(f, row, pair)
                del self._open[pair]
        kept = []
        for error in errors:
            if error.cause != Cause.MISSED or error.contact is None:
                kept.append(error)
            elif error.contact not in self._open:
                self._open[error.contact] = error
                kept.append(error)
        return kept


Streak = list[tuple[Touch, list[StepError]]]  # a contact's touches in steps one after another, and their errors


class Springs:
    """Contacts that push in several steps, while the two still approach and while they part already."""

    def __init__(self) -> None:
        self._step = 0
        self._now: dict[tuple[int, int], Streak] = {}  # that go on in this step
        self._last: dict[tuple[int, int], Streak] = {}  # that went on in the step before
        self._of_ball: dict[int, list[tuple[int, int]]] = {}  # these, by their bodies

    def _go_to(self, step: int) -> None:
        if step != self._step:
            self._last = self._now if step == self._step + 1 else {}
            self._step, self._now, self._of_ball = step, {}, {}
            for pair in self._last:
                for body in pair:
                    self._of_ball.setdefault(body, []).append(pair)

    def before(self, step: int, balls: Sequence[int]) -> list[tuple[int, int]]:
        """Return the contacts of some balls, with each other or walls, that may be springs since the step before."""
        self._go_to(step)
        near = dict.fromkeys(chain.from_iterable(self._of_ball.get(ball, ()) for ball in balls))
        return [pair for pair in near if pair[0] in balls and (pair[1] < 0 or pair[1] in balls)]

    def follow(self, touches: Sequence[Touch], step: int, errors: list[StepError]) -> None:
        """Note what touches in a step with some errors, none of them by a rule. Steps come in their order."""
        self._go_to(step)
        for touch in touches:
            if touch.depth <= 0:
                continue
            streak = self._now[touch.pair] = self._last.get(touch.pair, [])
            streak.append((touch, errors))
            if _is_spring([(each, of_step) for each, of_step in streak if each.pushed > 0]):
                for error in (error for _, of_step in streak for error in of_step):
                    error.cause, error.contact, error.candidates = Cause.SOFT, touch.pair, []
                    error.because = "The contact pushes in several steps, as a spring does, and not by one impulse."


def _is_spring(streak: Streak) -> bool:
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
