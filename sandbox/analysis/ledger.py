"""The ledger: every change that an engine makes to energy, momentum and positions, entered under its cause.

An engine reports states and contacts. Between two states the balls fly on parabolas, and contacts change momentum by
the impulses that the engine reported. Both are replayed here, in the order in which the engine resolved them. Whatever
the replay leaves unexplained is entered too, so the lines of the ledger always add up to the whole change.

`sandbox.analysis.attribution` attributes a contact's changes to causes, and explains the symbols.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numba import njit

from sandbox.analysis.attribution import (
    FINDING,
    MAX_TRACE_STEPS,
    Block,
    Findings,
    Integers,
    SceneConstants,
    attribute_displacement,
    attribute_simultaneous,
    attribute_single,
    enter,
)
from sandbox.analysis.causes import NEGLIGIBLE, Cause
from sandbox.analysis.tunnelling import Passage, find_crossings, find_overlaps
from sandbox.scene.model import ARENA_WALLS, Scene
from sandbox.state import Contacts, Floats


@dataclass(frozen=True)
class Entry:
    """A line of the ledger: what a cause changed."""

    cause: Cause
    contacts: int  # or steps of a ball, for a cause that is not a contact's
    energy: float  # kg px²/s²; the lines add up to the whole change
    momentum: float  # kg px/s transferred wrongly, the sum of the lengths
    displacement: float  # px by which balls were displaced wrongly, the sum of the lengths


@njit(cache=True)
def _fly(constants, velocity, flown, clock, ball, now):  # type: ignore[no-untyped-def]
    """Let a ball fly on its parabola to a time in the step (s)."""
    dt = now - clock[ball]
    for axis in range(2):
        flown[ball, axis] += dt * (velocity[ball, axis] + dt * constants.gravity[axis] / 2)
        velocity[ball, axis] += dt * constants.gravity[axis]
    clock[ball] = now


@njit(cache=True)
def _approach_speed(contact, velocity):  # type: ignore[no-untyped-def]
    """Return the speed at which the two bodies of a contact approach along its normal. velocity: (2, 2), of both."""
    along_x = (velocity[0, 0] - velocity[1, 0]) * contact.normal[0]
    return along_x + (velocity[0, 1] - velocity[1, 1]) * contact.normal[1]


@njit(cache=True)
def _copy_velocities(contact, velocity, both):  # type: ignore[no-untyped-def]
    """Copy the velocities of the two bodies of a contact; a wall's is 0."""
    for axis in range(2):
        both[0, axis] = velocity[contact.first, axis]
        both[1, axis] = velocity[contact.second, axis] if contact.second >= 0 else 0.0


@njit(cache=True)
def _apply_contacts(constants, block, velocity, contacts, begin, end, uses):  # type: ignore[no-untyped-def]
    """Change velocities by contacts that were resolved together, and attribute each. uses: (n,) zeros, restored."""
    for k in range(begin, end):
        contact, finding = contacts[k], block.findings[k]
        _copy_velocities(contact, velocity, finding.before)
        finding.approach = _approach_speed(contact, finding.before)
        uses[contact.first] += 1
        if contact.second >= 0:
            uses[contact.second] += 1
    for k in range(begin, end):
        contact = contacts[k]
        for axis in range(2):
            push = contact.impulse * contact.normal[axis]
            velocity[contact.first, axis] -= push / constants.mass[contact.first]
            if contact.second >= 0:
                velocity[contact.second, axis] += push / constants.mass[contact.second]
    for k in range(begin, end):
        contact, finding = contacts[k], block.findings[k]
        _copy_velocities(contact, velocity, finding.after)
        finding.approach_after = _approach_speed(contact, finding.after)
        if uses[contact.first] > 1 or (contact.second >= 0 and uses[contact.second] > 1):
            attribute_simultaneous(constants, block, k, contact)
        else:
            attribute_single(constants, block, k, contact)
    for k in range(begin, end):
        uses[contacts[k].first] = 0
        if contacts[k].second >= 0:
            uses[contacts[k].second] = 0


@njit(cache=True)
def _enter_unexplained(constants, block, ball, velocity, explained, displacement, touched, scale):  # type: ignore[no-untyped-def]
    """Enter what no contact of the step explains of a ball's change.

    velocity: (2,) px/s at the end of the step, and explained: the velocity that the contacts lead to; displacement:
    (2,) px that no contact explains; scale: px/s, the magnitude of the ball's speed before.
    """
    dx, dy = velocity[0] - explained[0], velocity[1] - explained[1]
    error = math.hypot(dx, dy)
    energy = constants.mass[ball] * (dx * (velocity[0] + explained[0]) + dy * (velocity[1] + explained[1])) / 2
    if error <= NEGLIGIBLE * (abs(velocity[0]) + abs(velocity[1]) + scale):
        enter(block, Cause.ROUNDING, energy, 0.0, 0.0)
    else:
        cause = Cause.FRICTION if constants.has_friction and touched else Cause.UNTOLD
        enter(block, cause, energy, constants.mass[ball] * error, 0.0)
    moved = math.hypot(displacement[0], displacement[1])
    energy = -constants.mass[ball] * (constants.gravity[0] * displacement[0] + constants.gravity[1] * displacement[1])
    if moved <= NEGLIGIBLE * constants.radius[ball]:
        enter(block, Cause.ROUNDING, energy, 0.0, 0.0)
    else:
        enter(block, Cause.PUSHED, energy, 0.0, moved)


@njit(cache=True)
def _attribute_displacements(constants, block, step, position, flown, off_parabola, contacts, begin, last):  # type: ignore[no-untyped-def]
    """Attribute where the contacts of a step put the balls.

    flown: (n, 2) px of flight in, the displacement that stays unexplained out.
    """
    fall = constants.gravity[0] * off_parabola[0] + constants.gravity[1] * off_parabola[1]
    for ball in range(len(flown)):
        for axis in range(2):
            moved = position[step, ball, axis] - position[step - 1, ball, axis]
            flown[ball, axis] = moved - flown[ball, axis] - off_parabola[axis]
        enter(block, Cause.GRAVITY, -constants.mass[ball] * fall, 0.0, 0.0)
    for k in range(len(contacts)):
        attribute_displacement(constants, block, begin + k, contacts[k], flown, last)


@njit(cache=True)
def _replay(constants, block, position, velocity, pulled, pull, off_parabola, contacts, step_of, within, touched):  # type: ignore[no-untyped-def]
    """Replay a block of steps, and enter everything that changes.

    position, velocity: (steps + 1, n, 2) px, px/s; pulled: (steps + 1,), the ball that the mouse pulled in each step,
    or -1, and pull: (steps + 1, 2) px/s, by how much; off_parabola: (2,) px between the engine's flight in a step and
    a parabola; contacts: (contacts,) CONTACT, step_of: their steps, and within: s since these began; touched: (n,) s,
    when each ball last had a contact.
    """
    n, at = position.shape[1], 0
    uses, last = np.zeros(n, np.int64), np.empty(n, np.int64)
    explained, flown, clock = np.empty((n, 2)), np.empty((n, 2)), np.empty(n)
    step_pull = math.hypot(constants.gravity[0], constants.gravity[1]) * constants.dt
    for step in range(1, len(position)):
        explained[:], flown[:], clock[:], last[:] = velocity[step - 1], 0.0, 0.0, -1
        ball = pulled[step]
        if ball >= 0:
            for axis in range(2):
                mean = explained[ball, axis] + pull[step, axis] / 2
                enter(block, Cause.HAND, constants.mass[ball] * pull[step, axis] * mean, 0.0, 0.0)
                explained[ball, axis] += pull[step, axis]

        # Velocities: contact by contact, or all contacts of a time if they are resolved together.
        begin = at
        while at < len(contacts) and step_of[at] == step:
            end = at + 1
            while constants.together and end < len(contacts) and step_of[end] == step and within[end] == within[at]:
                end += 1
            for k in range(at, end):
                i, j = contacts[k].first, contacts[k].second
                last[i] = k
                _fly(constants, explained, flown, clock, i, within[k])
                since = touched[i]
                if j >= 0:
                    last[j] = k
                    _fly(constants, explained, flown, clock, j, within[k])
                    since = max(since, touched[j])
                block.findings[k].free_flight = min(contacts[k].time - since, MAX_TRACE_STEPS * constants.dt)
            _apply_contacts(constants, block, explained, contacts, at, end, uses)
            for k in range(at, end):
                touched[contacts[k].first] = contacts[k].time
                if contacts[k].second >= 0:
                    touched[contacts[k].second] = contacts[k].time
            at = end

        for ball in range(n):
            _fly(constants, explained, flown, clock, ball, constants.dt)
        _attribute_displacements(constants, block, step, position, flown, off_parabola, contacts[begin:at], begin, last)
        for ball in range(n):
            scale = np.abs(velocity[step - 1, ball]).sum() + step_pull
            _enter_unexplained(
                constants, block, ball, velocity[step, ball], explained[ball], flown[ball], last[ball] >= 0, scale
            )
    return at


class Ledger:
    """The ledger of one engine, kept block by block of steps.

    max_overlap: px, of two balls at the end of any step; missed: passages without a reported contact.
    """

    def __init__(self, scene: Scene, *, together: bool) -> None:
        self._scene = scene
        bodies = scene.bodies
        friction = max(scene.arena.friction, *bodies.friction, *(wall.friction for wall in scene.walls))
        self._constants = SceneConstants(
            bodies.radius,
            bodies.mass,
            bodies.elasticity,
            _wall_constants(scene),
            (float(scene.gravity[0]), float(scene.gravity[1])),
            1 / scene.rate,
            together,
            friction > 0,
        )
        self._off_parabola: Floats | None = None
        self._findings: list[Findings] = []
        self._sums = np.zeros((4, len(Cause)))  # energy, momentum, displacement, contacts
        self._touched = np.full(len(bodies), -np.inf)
        self._deepening = [np.empty(0, np.int64), np.empty(0, np.int64)]
        self.missed: list[Passage] = []
        self.max_overlap = 0.0
        self._steps = 0

    def add(self, position: Floats, velocity: Floats, contacts: Contacts, pulled: Integers, pull: Floats) -> None:
        """Enter a block of steps. position, velocity: (steps + 1, n, 2), from the last state of the block before."""
        steps = len(position) - 1
        constants, rate = self._constants, self._scene.rate
        step_of = steps_containing(contacts["time"], rate)
        within = np.clip(contacts["time"] - (step_of - 1) / rate, 0.0, constants.dt)
        step_of = np.clip(step_of - self._steps, 1, steps)
        if self._off_parabola is None:
            self._off_parabola = _off_parabola(self._scene, position, velocity, contacts, step_of)
        energy, momentum, displacement, count = self._sums
        block = Block(
            energy,
            momentum,
            displacement,
            count,
            findings=np.zeros(len(contacts), FINDING),
            expected_shift=np.zeros((len(contacts), 2)),
            timing=np.full(len(contacts), int(Cause.ROUNDING)),
        )
        replayed = _replay(
            constants,
            block,
            position,
            velocity,
            pulled,
            pull,
            self._off_parabola,
            contacts,
            step_of,
            within,
            self._touched,
        )
        assert replayed == len(contacts)
        if len(block.findings):
            self._findings.append(block.findings)
        self._steps += steps
        self._check_overlaps(position, velocity, contacts, step_of)
        self._check_inner_walls(position, contacts, step_of, within)

    def _check_overlaps(self, position: Floats, velocity: Floats, contacts: Contacts, step_of: Integers) -> None:
        """Find the deepest overlap, and the pairs that pass into each other without a reported contact."""
        n = position.shape[1]
        reported = contacts["first"] * n + contacts["second"]
        reported[contacts["second"] < 0] = -1
        order = np.lexsort((reported, step_of))
        bounds = np.searchsorted(step_of, np.arange(len(position) + 1))
        deepest, passed, *self._deepening = find_overlaps(
            position, velocity, self._constants.radius, reported[order], bounds, *self._deepening
        )
        self.max_overlap = max(self.max_overlap, float(deepest))
        self._enter_missed(position, [(step, *divmod(key, n)) for step, key in passed.tolist()])

    def _check_inner_walls(self, position: Floats, contacts: Contacts, step_of: Integers, within: Floats) -> None:
        """Find the balls that go through an inner wall without a reported contact."""
        ends = np.array([(*wall.start, *wall.to) for wall in self._scene.walls], float)
        if len(ends):
            bounds = np.searchsorted(step_of, np.arange(len(position) + 1))
            early = within < self._constants.dt * (1 - NEGLIGIBLE)
            crossings = find_crossings(position, ends, len(ARENA_WALLS), contacts, early, bounds)
            self._enter_missed(position, crossings.tolist())

    def _enter_missed(self, position: Floats, found: Iterable[tuple[int, int, int]]) -> None:
        """Enter the contacts missed in a block: step in it, first and second."""
        before = self._steps - len(position) + 1
        for step, first, second in found:
            flown = math.dist(position[step, first], position[step - 1, first])
            self.missed.append(Passage(before + step, first, second, flown))
            self._sums[3, Cause.MISSED] += 1

    @property
    def findings(self) -> Findings:
        """What was found about every contact so far."""
        return np.concatenate(self._findings) if self._findings else np.empty(0, FINDING)

    def entries(self) -> tuple[Entry, ...]:
        """Return a line for each cause that occurred, in the order of Cause."""
        return tuple(
            Entry(cause, int(contacts), float(energy), float(momentum), float(displacement))
            for cause, (energy, momentum, displacement, contacts) in zip(Cause, self._sums.T, strict=True)
            if energy or contacts
        )


def steps_containing(time: Floats, rate: int) -> Integers:
    """Return the step in which each time (s) lies: the first that ends no sooner, counted from 1."""
    step = np.ceil(time * rate - NEGLIGIBLE).astype(np.int64)
    return np.maximum(step + (time > step / rate), 1)


def _wall_constants(scene: Scene) -> Floats:
    """Return each wall's direction, half its thickness (px, 0 for the arena's) and its elasticity: (m, 4)."""
    arena = [(*along, 0.0, scene.arena.elasticity) for along in ((0, 1), (1, 0), (0, 1), (1, 0))]
    inner = []
    for wall in scene.walls:
        dx, dy = wall.to[0] - wall.start[0], wall.to[1] - wall.start[1]
        size = math.hypot(dx, dy)
        inner.append((dx / size, dy / size, wall.thickness / 2, wall.elasticity))
    return np.array([*arena, *inner], float)


def _off_parabola(scene: Scene, position: Floats, velocity: Floats, contacts: Contacts, step_of: Integers) -> Floats:
    """Return the difference between an engine's flight under gravity and a parabola in a step, px: (2,).

    It is the same in every step without contacts; the median of those steps is returned.
    """
    dt, gravity = 1 / scene.rate, np.array(scene.gravity, float)
    if not gravity.any():
        return np.zeros(2)
    flying = np.ones((len(position) - 1, position.shape[1]), bool)
    flying[step_of - 1, contacts["first"]] = False
    between = contacts["second"] >= 0
    flying[step_of[between] - 1, contacts["second"][between]] = False
    difference = np.diff(position, axis=0) - velocity[:-1] * dt - gravity * dt * dt / 2
    return np.median(difference[flying], axis=0) if flying.any() else np.zeros(2)
