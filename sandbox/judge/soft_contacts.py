"""What explains a step whose contacts are soft, as Box2D's are: the ways to make it, and what each gets wrong."""

from collections.abc import Sequence
from itertools import combinations, pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sandbox.judge.causes import Cause
from sandbox.judge.fit import Outcome, Problem, Trial
from sandbox.judge.law import Order, When
from sandbox.judge.models import Fields
from sandbox.judge.soft_step import DISC_TURNS, NO_CONTACTS, SOFT
from sandbox.judge.thresholds import MAX_BALLS
from sandbox.judge.touching import in_each_other, in_walls
from sandbox.state import Floats, Integers

MAX_OTHERS: Final = 20  # steps that something else explains, after which contacts are not tried as soft ones
SUBSTEPS: Final = (4, 1, 2, 8)  # of a step: Box2D recommends 4


class SoftMemory:
    """What is known of an engine's soft contacts, from the steps that they explain.

    Their substeps; between which distances (px) the margin is, up to which they are found; and the impulses of the last
    step, which act again in the next.
    """

    def __init__(self) -> None:
        self._substeps: frozenset[int] = frozenset()
        self._others = 0  # steps that something else explains
        self._found, self._missed = 0.0, np.inf
        self._step = 0
        self._impulses: dict[tuple[int, int], NDArray[np.void]] = {}
        self._last: dict[tuple[int, int], NDArray[np.void]] = {}

    @property
    def _are_others(self) -> bool:
        """Whether enough steps show that contacts are not soft."""
        return self._others > MAX_OTHERS and not self._substeps

    def before(self, step: int, balls: Integers) -> NDArray[np.void]:
        """Return the contacts of some balls at the end of the step before: SOFT."""
        self._go_to(step)
        place = {ball: k for k, ball in enumerate(balls.tolist())}
        rows = []
        for (first, second), contact in self._last.items():
            if first in place and (second < 0 or second in place):
                row = contact.copy()
                row["first"], row["second"] = place[first], place[second] if second >= 0 else second
                rows.append(row)
        return np.array(rows, SOFT) if rows else NO_CONTACTS

    def _go_to(self, step: int) -> None:
        if step != self._step:
            self._last = self._impulses if step == self._step + 1 else {}
            self._step, self._impulses = step, {}

    def known(self, problem: Problem, flight: Fields, *, rough: bool) -> list[Trial]:
        """Return the trials that are as the steps before; of groups too large for others, all."""
        if self._are_others:
            return []
        substeps = self._substeps or (SUBSTEPS if len(problem.group.ball) > MAX_BALLS else ())
        return _trials(problem, flight, substeps, [self._margin(problem)], rough=rough)

    def _margin(self, problem: Problem) -> float:
        farthest = float(problem.group.ball["radius"].min()) if np.isinf(self._missed) else self._missed
        return (self._found + farthest) / 2

    def all(self, problem: Problem, flight: Fields, *, rough: bool) -> list[Trial]:
        """Return all trials: of contacts found at any distance, and up to each between those of two pairs of bodies."""
        if self._are_others:
            return []
        nearest = float(problem.group.ball["radius"].min())
        gaps = sorted({-depth for depth in _depths(problem, problem.before).values() if -nearest < depth < 0})
        margins = [nearest, 0.0, *(sum(two) / 2 for two in pairwise(gaps))]
        return _trials(problem, flight, self._substeps or SUBSTEPS, margins, rough=rough)

    def follow(self, problem: Problem, fitting: Sequence[Outcome]) -> None:
        """Learn from what explains a step."""
        soft = [outcome for outcome in fitting if outcome.trial.is_soft]
        if not soft:
            self._others += bool(fitting)
            return
        substeps = frozenset(int(outcome.trial.rule["substeps"]) for outcome in soft)
        self._substeps = self._substeps & substeps or substeps
        trial = soft[0].trial
        self._found = max(self._found, *_gaps(soft[0]))
        nearest = float(problem.group.ball["radius"].min())
        anywhere = problem.outcomes([trial._replace(rule={**trial.rule, "margin": nearest})])[0]
        if not problem.fits([anywhere]) and (gaps := [gap for gap in _gaps(anywhere) if gap > self._found]):
            self._missed = min(self._missed, *gaps)
        number = problem.group.ball["number"]
        for contact in problem.soft_contacts(trial):
            if not contact["pushed"] and -contact["depth"] > self._found:
                continue  # it may be too far away
            first, second = int(number[contact["first"]]), int(contact["second"])
            self._impulses[first, int(number[second]) if second >= 0 else second] = contact.copy()


def _gaps(outcome: Outcome) -> list[float]:
    """Return the gaps of the contacts that push, px, after a 0 for a step without any."""
    pushing = outcome.met[outcome.met["impulse"] > 0]
    return [0.0, *np.maximum(-pushing["depth"], 0.0).tolist()]


def _trials(
    problem: Problem, flight: Fields, substeps: Sequence[int] | frozenset[int], margins: Sequence[float], *, rough: bool
) -> list[Trial]:
    """Return the ways to make a step with so many substeps, and such margins (px)."""
    base = {name: value for name, value in flight.items() if name in ("gx", "gy")} | {"when": When.SOFT}
    stops = [(-1, 0.0), *_stops(problem)] if substeps else []
    return [
        Trial(
            {**base, "substeps": n, "order": order, "margin": margin, "offset": offset, "stops": ball, "stop": stop},
            fault,
        )
        for fault in (("", "early limit") if rough else ("",))
        for n in substeps
        for order in Order
        for margin in margins
        for ball, stop in stops
        for offset in (0.0, problem.floor / 4, -problem.floor / 4)  # bodies that touch may be apart by rounding
    ]


def _stops(problem: Problem) -> list[tuple[int, float]]:
    """Return the balls that a wall may have stopped: which, and how far each came, px."""
    number = problem.group.ball["number"].tolist()
    depths = _depths(problem, problem.after).items()
    at_walls = {number.index(first) for (first, second), depth in depths if second < 0 and depth >= -problem.floor}
    ways = np.hypot(*(problem.after[:, :2] - problem.before[:, :2]).T)
    return [(ball, float(ways[ball])) for ball in sorted(at_walls) if ways[ball] > problem.floor]


def _depths(problem: Problem, state: Floats) -> dict[tuple[int, int], float]:
    """Return how deep balls and walls are in each other, px, by their numbers in the scene. state: (k, 5)."""
    ball, piece = problem.group.ball, problem.group.piece
    number = ball["number"].tolist()
    walls = np.unique(piece["wall"]).tolist()
    pairs = [*combinations(number, 2), *((ball, ~wall) for ball in number for wall in walls)]
    x = state[:, :2]
    in_balls = in_each_other(x, ball["radius"], ball["filter"])
    depths = np.concatenate([in_balls, in_walls(x, ball["radius"], piece).ravel()])
    return dict(zip(pairs, depths.tolist(), strict=True))


def cause_of_soft(outcome: Outcome, problem: Problem) -> Cause:
    """Return what is wrong with a step of soft contacts.

    Where it leaves velocities right, the bodies stay in touch until the step ends. Else it is friction if that has more
    part in what is wrong with velocities than the impulse, which acts before the two touch, or after.
    """
    met = outcome.met
    if not met["impulse"].any():
        return Cause.MISSED
    off = (outcome.after - problem.exact.after) * problem.scale
    is_right = np.abs(off[:, 2:]).max() <= problem.enough()
    deepest = met[met["depth"].argmax()]
    if deepest["depth"] > problem.floor:
        return Cause.SOFT if deepest["depth"] > deepest["closing"] * problem.group.dt else Cause.LATE
    if is_right:
        return Cause.OVERSHOOT
    moved, turned = np.linalg.norm(off[:, 2:4]), np.linalg.norm(off[:, 4]) / DISC_TURNS
    if turned > moved / 2:  # friction moves a disc by half of what it turns its rim
        got, due = (np.abs(o.after[:, 4] - problem.group.ball["spin"]).sum() for o in (outcome, problem.exact))
        if got < due:  # none is limited late: more than is due comes from where the contact was found
            return Cause.FRICTION_SMALL
    return Cause.UNCONVERGED if _share_a_ball(met) else Cause.EARLY


def _share_a_ball(met: NDArray[np.void]) -> bool:
    """Return whether two of some contacts push the same ball."""
    pushing = met[met["impulse"] > 0]
    balls = [ball for m in pushing for ball in (int(m["first"]), int(m["second"])) if ball >= 0]
    return len(set(balls)) < len(balls)


def bounced_at_its_end(problem: Problem, outcome: Outcome) -> Outcome | None:
    """Return the exact step with the contacts at its end that an outcome has before it. None if it has some itself."""
    if len(problem.exact.met):
        return None
    depths = _depths(problem, problem.exact.after)
    gap = max(-depths[int(m["first"]), int(m["second"])] for m in outcome.met)
    due = problem.outcomes([Trial({}, "offset", {}, gap + 2 * problem.floor)])[0]
    return due if len(due.met) and np.isfinite(due.left) else None
