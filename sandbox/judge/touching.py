"""What bodies that touch did to each other over several steps: contacts missed, contacts found late, and springs."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Final, NamedTuple

import numpy as np

from sandbox.engines.walls import ARENA_COUNT
from sandbox.judge.causes import Cause
from sandbox.judge.fit import Outcome
from sandbox.judge.groups import Flown
from sandbox.judge.thresholds import SPRING_STEPS
from sandbox.quantity import length, nearest_on_segment
from sandbox.scene.model import Scene
from sandbox.state import Floats

OUTWARD: Final = np.array([(-1.0, 0.0), (0.0, -1.0), (1.0, 0.0), (0.0, 1.0)])  # of the arena's walls


@dataclass
class StepError:
    """What is wrong with a step of some balls.

    step: of the run, from 1; balls: of the group; contact: first and second, None without one; candidates: the outcomes
    that leave nothing over, with their causes; cause, because: why; energy (kg px²/s²), momentum (kg px/s) and
    displacement (px): what is over of the exact step; speed: px/s, the sum of the velocities' errors;
    before, after, should: velocities (k, 2) px/s of the contact's balls, and their spins; times: how many balls or
    contacts it stands for; numbers: how many places, velocities and spins it shows wrong; depth: px, of the contact
    when it was found.
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
    candidates: list[tuple[Outcome, Cause]] = field(default_factory=list)
    times: int = 1
    numbers: int = 9
    depth: float | None = None


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
        self._walls = range(0 if scene.arena.walls else ARENA_COUNT, ARENA_COUNT + len(scene.walls))

    def of(self, f: Flown, row: int, pair: tuple[int, int]) -> Touch:
        """Return how two bodies touch in a step."""
        mass, (first, second) = self._scene.bodies.mass, pair
        free = f.before.velocity[row] + f.dt[row] * self._gravity
        change = f.after.velocity[row] - free
        ends = [self._away(states.position[row], pair) for states in (f.before, f.after)]
        away, depth = ends[0]
        central = True
        if second >= 0:
            relative, moving = change[first] - change[second], free[first] - free[second]
            given = mass[[first, second], None] * change[[first, second]]
            central = bool(length(given.sum(axis=0)) <= length(given).sum() / 2)
        else:
            relative, moving = change[first], free[first]
            others = mass[:, None] * change
            central = bool(length(others.sum(axis=0) - others[first]) <= length(others[first]) / 2) or len(mass) == 1
        n = away / (float(length(away)) or 1.0)
        pushed, closing = -float(relative @ n), float(moving @ n)
        central = central and 2 * pushed * pushed > float(relative @ relative)
        return Touch(pair, max(depth, ends[1][1]), closing, closing - pushed, pushed, central)

    def _away(self, x: Floats, pair: tuple[int, int]) -> tuple[Floats, float]:
        """Return the way from the first body to the second, and how deep they are in each other, px."""
        radius, (first, second) = self._scene.bodies.radius, pair
        if second >= 0:
            away = x[second] - x[first]
            return away, float(radius[first] + radius[second] - length(away))
        wall = ~second
        if wall < ARENA_COUNT:
            n = OUTWARD[wall]
            face = max(0.0, float(n @ self._scene.arena.size))
            return n, float(radius[first] + n @ x[first] - face)
        start, to, thickness = self._scene.wall_line(wall)
        away = nearest_on_segment(x[first], np.array(start), np.array(to)) - x[first]
        return away, float(radius[first] + thickness / 2 - length(away))

    def among(self, f: Flown, row: int, balls: Sequence[int], gap: float = 0.0) -> list[Touch]:
        """Return how some balls touch each other, and walls, or are at most a gap (px) apart."""
        pairs = [*combinations(balls, 2), *((ball, ~wall) for ball in balls for wall in self._walls)]
        touches = (self.of(f, row, pair) for pair in pairs)
        return [touch for touch in touches if touch.depth > f.floor - gap]


class Missed:
    """Contacts that did not happen in their step: found late if they follow while the bodies overlap, else missed."""

    def __init__(self, touches: Touches) -> None:
        self._touches = touches
        self._open: dict[tuple[int, int], StepError] = {}

    def follow(self, f: Flown, row: int, step: int, errors: list[StepError]) -> list[StepError]:
        """Follow what is open through a step, and return the step's errors without those that go on."""
        for pair, error in list(self._open.items()):
            touch = self._touches.of(f, row, pair)
            if touch.depth <= f.floor:
                del self._open[pair]
            elif touch.pushed * f.dt[row] > f.floor and touch.central and touch.free > 0:
                error.cause, late = Cause.LATE, step - error.step
                error.because = f"Found {late} step{'s' * (late > 1)} late."
                error.displacement, error.momentum = error.displacement + error.speed * late * float(f.dt[row]), 0.0
                error.speed = 0.0
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

    def follow(self, touches: Sequence[Touch], step: int, errors: list[StepError]) -> None:
        """Note what pushes in a step with some errors."""
        for touch in touches:
            if touch.pushed <= 0:
                continue
            last, streak = self._streaks.get(touch.pair, (step - 1, []))
            if last < step - 1:
                streak = []
            streak.append((touch, errors))
            self._streaks[touch.pair] = step, streak
            if _is_spring(streak):
                for each, of_step in streak:
                    for error in of_step:
                        error.cause, error.contact = Cause.SOFT, each.pair
                        error.because = "The contact pushes in several steps, as a spring does, and not by one impulse."
                        error.candidates = []


def _is_spring(streak: Sequence[tuple[Touch, list[StepError]]]) -> bool:
    """Return whether a contact pushes like a spring."""
    touches = [touch for touch, _ in streak]
    slight = 1e-6 * max(touch.pushed for touch in touches)
    while_closing = any(touch.after > slight for touch in touches)
    while_parting = any(touch.free < -slight for touch in touches)
    values = {
        (o.trial.fault, f"{o.trial.value:.3g}") for _, errors in streak for e in errors for o, _ in e.candidates[:1]
    }
    return len(streak) >= SPRING_STEPS and while_closing and while_parting and len(values) != 1
