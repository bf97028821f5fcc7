"""The ledger: every change that an engine makes to energy, momentum and positions, entered under its cause.

An engine reports states and contacts. Between two states the balls fly on parabolas, and contacts change momentum by
the impulses that the engine reported. Both are replayed here, in the order in which the engine resolved them. Whatever
the replay leaves unexplained is entered too, so the lines of the ledger always add up to the whole change.

`sandbox.analysis.attribution` attributes a contact's changes to causes, and explains the symbols.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sandbox.analysis.attribution import (
    FINDING,
    MAX_TRACE_STEPS,
    Block,
    Findings,
    SceneConstants,
    attribute_displacement,
    attribute_simultaneous,
    attribute_single,
    enter,
)
from sandbox.analysis.causes import NEGLIGIBLE, Cause
from sandbox.analysis.tunnelling import Passage, find_crossings, find_overlaps, no_deepening
from sandbox.compiled import Record, entry, kernel
from sandbox.scene.model import ARENA_WALLS, Scene
from sandbox.state import Contacts, Floats, Integers


@dataclass(frozen=True)
class Entry:
    """A line of the ledger: what a cause changed."""

    cause: Cause
    contacts: int  # or steps of a ball, for a cause that is not a contact's
    energy: float  # kg px²/s²; the lines add up to the whole change
    momentum: float  # kg px/s transferred wrongly, the sum of the lengths
    displacement: float  # px by which balls were displaced wrongly, the sum of the lengths


class Scratch(NamedTuple):
    """What the replay of a step needs of each ball.

    explained: (n, 2) px/s, the velocity that the contacts so far lead to; flown: (n, 2) px since the step began, then
    the displacement that has no cause yet; clock: (n,) s in the step, when the ball was moved last; last: (n,) its last
    contact in the step, or -1; uses: (n,) its contacts among those resolved together, 0 between them.
    """

    explained: Floats
    flown: Floats
    clock: Floats
    last: Integers
    uses: Integers


@kernel
def _fly(constants: SceneConstants, scratch: Scratch, ball: int, now: float) -> None:
    """Let a ball fly on its parabola to a time in the step (s)."""
    velocity, dt = scratch.explained, now - scratch.clock[ball]
    for axis in range(2):
        scratch.flown[ball, axis] += dt * (velocity[ball, axis] + dt * constants.gravity[axis] / 2)
        velocity[ball, axis] += dt * constants.gravity[axis]
    scratch.clock[ball] = now


@kernel
def _approach_speed(contact: Record, velocity: Floats) -> float:
    """Return the speed at which the two bodies of a contact approach along its normal. velocity: (2, 2), of both."""
    along_x: float = (velocity[0, 0] - velocity[1, 0]) * contact.normal[0]
    along_y: float = (velocity[0, 1] - velocity[1, 1]) * contact.normal[1]
    return along_x + along_y


@kernel
def _copy_velocities(contact: Record, velocity: Floats, both: Floats) -> None:
    """Copy the velocities of the two bodies of a contact; a wall's is 0."""
    for axis in range(2):
        both[0, axis] = velocity[contact.first, axis]
        both[1, axis] = velocity[contact.second, axis] if contact.second >= 0 else 0.0


@kernel
def _fly_to_contacts(
    constants: SceneConstants,
    block: Block,
    scratch: Scratch,
    contacts: Contacts,
    begin: int,
    end: int,
    within: Floats,
    touched: Floats,
) -> None:
    """Let the balls of contacts that were resolved together fly there."""
    for k in range(begin, end):
        i, j = contacts[k].first, contacts[k].second
        scratch.last[i] = k
        _fly(constants, scratch, i, within[k])
        since = touched[i]
        if j >= 0:
            scratch.last[j] = k
            _fly(constants, scratch, j, within[k])
            since = max(since, touched[j])
        block.findings[k].free_flight = min(contacts[k].time - since, MAX_TRACE_STEPS * constants.dt)


@kernel
def _apply_contacts(
    constants: SceneConstants,
    block: Block,
    scratch: Scratch,
    contacts: Contacts,
    begin: int,
    end: int,
    touched: Floats,
) -> None:
    """Change velocities by contacts that were resolved together, and attribute each."""
    velocity, uses = scratch.explained, scratch.uses
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
        contact = contacts[k]
        uses[contact.first], touched[contact.first] = 0, contact.time
        if contact.second >= 0:
            uses[contact.second], touched[contact.second] = 0, contact.time


@kernel
def _enter_unexplained(
    constants: SceneConstants, block: Block, scratch: Scratch, ball: int, velocity: Floats, scale: float
) -> None:
    """Enter what no contact of the step explains of a ball's change.

    velocity: (2,) px/s at the end of the step; scale: px/s, the magnitude of the ball's speed before.
    """
    explained, displacement = scratch.explained[ball], scratch.flown[ball]
    dx, dy = velocity[0] - explained[0], velocity[1] - explained[1]
    error = math.hypot(dx, dy)
    energy = constants.mass[ball] * (dx * (velocity[0] + explained[0]) + dy * (velocity[1] + explained[1])) / 2
    if error <= NEGLIGIBLE * (abs(velocity[0]) + abs(velocity[1]) + scale):
        enter(block, Cause.ROUNDING, energy, 0.0, 0.0)
    else:
        cause = Cause.FRICTION if constants.has_friction and scratch.last[ball] >= 0 else Cause.UNTOLD
        enter(block, cause, energy, constants.mass[ball] * error, 0.0)
    moved = math.hypot(displacement[0], displacement[1])
    energy = -constants.mass[ball] * (constants.gravity[0] * displacement[0] + constants.gravity[1] * displacement[1])
    if moved <= NEGLIGIBLE * constants.radius[ball]:
        enter(block, Cause.ROUNDING, energy, 0.0, 0.0)
    else:
        enter(block, Cause.PUSHED, energy, 0.0, moved)


@kernel
def _begin_step(scratch: Scratch, velocity: Floats) -> None:
    """Begin a step with the velocities (n, 2) px/s before it."""
    for ball in range(len(velocity)):
        scratch.clock[ball], scratch.last[ball] = 0.0, -1
        for axis in range(2):
            scratch.explained[ball, axis], scratch.flown[ball, axis] = velocity[ball, axis], 0.0


@entry
def _replay(
    constants: SceneConstants,
    block: Block,
    scratch: Scratch,
    position: Floats,
    velocity: Floats,
    pulled: Integers,
    pull: Floats,
    off_parabola: Floats,
    contacts: Contacts,
    step_of: Integers,
    within: Floats,
    touched: Floats,
) -> int:
    """Replay a block of steps, and enter everything that changes. Returns the number of contacts replayed.

    position, velocity: (steps + 1, n, 2) px, px/s; pulled: (steps + 1,), the ball that the mouse pulled in each step,
    or -1, and pull: (steps + 1, 2) px/s, by how much; off_parabola: (2,) px between the engine's flight in a step and
    a parabola; contacts: (contacts,) CONTACT, step_of: their steps, and within: s since these began; touched: (n,) s,
    when each ball last had a contact.
    """
    n, at = position.shape[1], 0
    step_pull = math.hypot(constants.gravity[0], constants.gravity[1]) * constants.dt
    fall = constants.gravity[0] * off_parabola[0] + constants.gravity[1] * off_parabola[1]
    for step in range(1, len(position)):
        _begin_step(scratch, velocity[step - 1])
        ball = pulled[step]
        if ball >= 0:
            for axis in range(2):
                mean = scratch.explained[ball, axis] + pull[step, axis] / 2
                enter(block, Cause.HAND, constants.mass[ball] * pull[step, axis] * mean, 0.0, 0.0)
                scratch.explained[ball, axis] += pull[step, axis]

        # Velocities: contact by contact, or all contacts of a time if they are resolved together.
        begin = at
        while at < len(contacts) and step_of[at] == step:
            end = at + 1
            while constants.together and end < len(contacts) and step_of[end] == step and within[end] == within[at]:
                end += 1
            _fly_to_contacts(constants, block, scratch, contacts, at, end, within, touched)
            _apply_contacts(constants, block, scratch, contacts, at, end, touched)
            at = end

        # Positions: what the contacts of the step displaced.
        for ball in range(n):
            _fly(constants, scratch, ball, constants.dt)
        for ball in range(n):
            for axis in range(2):
                moved = position[step, ball, axis] - position[step - 1, ball, axis]
                scratch.flown[ball, axis] = moved - scratch.flown[ball, axis] - off_parabola[axis]
            enter(block, Cause.GRAVITY, -constants.mass[ball] * fall, 0.0, 0.0)
        for k in range(begin, at):
            attribute_displacement(constants, block, k, contacts[k], scratch.flown, scratch.last)
        for ball in range(n):
            scale = abs(velocity[step - 1, ball, 0]) + abs(velocity[step - 1, ball, 1]) + step_pull
            _enter_unexplained(constants, block, scratch, ball, velocity[step, ball], scale)
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
        n = len(bodies)
        vectors, integers = (np.empty((n, 2)), np.empty((n, 2))), (np.empty(n, np.int64), np.zeros(n, np.int64))
        self._scratch = Scratch(*vectors, np.empty(n), *integers)
        self._off_parabola: Floats | None = None
        self._findings: list[Findings] = []
        self._sums = np.zeros((4, len(Cause)))  # energy, momentum, displacement, contacts
        self._touched = np.full(len(bodies), -np.inf)
        self._deepening = no_deepening()
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
            self._scratch,
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
        deepest, passed, self._deepening = find_overlaps(
            position, velocity, self._constants.radius, reported[order], bounds, self._deepening
        )
        self.max_overlap = max(self.max_overlap, deepest)
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
