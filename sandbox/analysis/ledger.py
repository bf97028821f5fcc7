"""The ledger: every change that an engine makes to energy, momentum and positions, entered under its cause.

An engine reports states and contacts. Between two states the balls fly on parabolas, and contacts change momentum by
the impulses that the engine reported. Both are replayed here, in the order in which the engine resolved them. Whatever
the replay leaves unexplained is entered too, so the lines of the ledger always add up to the whole change.

`sandbox.analysis.attribution` attributes a contact's changes to causes, and explains the symbols.
"""

import math
from collections.abc import Iterable, Sequence

import numpy as np

from sandbox.analysis.attribution import attribute_simultaneous, attribute_single
from sandbox.analysis.displacement import attribute_displacement
from sandbox.analysis.engine_gravity import engine_gravity
from sandbox.analysis.findings import (
    FINDING,
    MAX_TRACE_STEPS,
    Block,
    Findings,
    SceneConstants,
    StepLengths,
    Unexplained,
    of_step,
    pair_friction,
)
from sandbox.analysis.flights import (
    KINDS_OF_FLIGHT,
    Flights,
    enter_unexplained,
    explain_places,
    find_owners,
    find_unexplained,
)
from sandbox.analysis.replay import (
    Scratch,
    apply_contacts,
    apply_together,
    are_sums,
    begin_step,
    enter_push,
    find_lines,
    fly_to_contacts,
    sum_damped,
)
from sandbox.analysis.rescaled import RescaledImpulses
from sandbox.analysis.stamps import true_times
from sandbox.analysis.start_overlaps import StartOverlap, StartOverlaps
from sandbox.analysis.tunnelling import Passage, find_crossings, find_leaps, find_overlaps, no_deepening
from sandbox.compiled import entry, kernel
from sandbox.engines.engine import Traits
from sandbox.judge.causes import NEGLIGIBLE, Cause
from sandbox.judge.ledger import Entry, entries_of
from sandbox.quantity import length, spin_energy
from sandbox.scene.model import ARENA_WALLS, Scene
from sandbox.scene.walls import wall_distance
from sandbox.state import Bools, Contacts, Floats, Integers, Pushes, States


@kernel
def _attribute_displacement_once(
    constants: SceneConstants,
    block: Block,
    scratch: Scratch,
    unexplained: Unexplained,
    contacts: Contacts,
    k: int,
    before: Floats,
) -> None:
    """Attribute how a contact displaced its balls, unless its wall carries the ball on: then its last contact tells."""
    contact, last = contacts[k], contacts[scratch.last[contacts[k].first]]
    if last.second >= 0 or last.second != contact.second or last.time <= contact.time:
        ball = contact.first
        x, y = unexplained.place[ball, 0], unexplained.place[ball, 1]
        attribute_displacement(constants, block, k, contact, unexplained, scratch.last, before)
        if contact.second < 0:
            moved_x, moved_y = x - unexplained.place[ball, 0], y - unexplained.place[ball, 1]
            turned = moved_x * scratch.explained[ball, 1] - moved_y * scratch.explained[ball, 0]
            scratch.torque[0] += constants.mass[ball] * turned


@kernel
def _replay_contacts(
    constants: SceneConstants,
    block: Block,
    scratch: Scratch,
    unexplained: Unexplained,
    contacts: Contacts,
    begin: int,
    end: int,
    within: Floats,
    touched: Floats,
    before: tuple[Floats, Floats, Floats],
    after: tuple[Floats, Floats, Floats],
) -> None:
    """Replay the contacts of one time: together, or one by one, unless they are sums of impacts then."""
    each = end - begin if constants.together else 1
    for k in range(begin, end, each):
        fly_to_contacts(constants, block, scratch, contacts, k, k + each, within, touched, unexplained)
        for i in range(k, k + each):
            find_lines(constants, scratch, unexplained, contacts[i], before[0], after[0], i, block)
        apply_contacts(constants, block, scratch, contacts, k, k + each, touched)
    if constants.sums and end > begin + 1 and are_sums(constants, block, contacts, begin, end):
        apply_together(constants, block, scratch, contacts, begin, end, touched)


@entry
def _replay(
    every_step: SceneConstants,
    block: Block,
    scratch: Scratch,
    unexplained: Unexplained,
    flights: Flights,
    lengths: StepLengths,
    states: States,
    pushes: Pushes,
    off_parabola: Floats,
    contacts: Contacts,
    step_of: Integers,
    within: Floats,
    touched: Floats,
    steps_before: int,
    torques: Floats,
    damped: Floats,
) -> int:
    """Replay a block of steps, and enter everything that changes. Returns the number of contacts replayed.

    every_step: without what it has of one step; states: of steps + 1 rows; pushes: by a hand, by row; off_parabola: as
    in `Flights`, (2,); contacts: (contacts,) CONTACT, step_of: their steps, within: s since these began; touched: (n,)
    s, when each ball last had a contact; steps_before: of the run before the block; torques: (steps,) kg px²/s, and
    damped: (steps, 2) kg px/s, both written.
    """
    position, velocity, _, spin = states
    n, at, pushed = position.shape[1], 0, 0
    for step in range(1, len(position)):
        constants = of_step(every_step, lengths, step)
        before = position[step - 1], velocity[step - 1], spin[step - 1]
        after = position[step], velocity[step], spin[step]
        begin_step(scratch, unexplained, velocity[step - 1], spin[step - 1])
        while pushed < len(pushes) and pushes[pushed].row == step:
            enter_push(constants, block, scratch, before[0], pushes[pushed])
            pushed += 1

        # Replay contact by contact, or all contacts of a time if they are resolved together.
        begin = at
        while at < len(contacts) and step_of[at] == step:
            end = at + 1
            while end < len(contacts) and step_of[end] == step and within[end] == within[at]:
                end += 1
            _replay_contacts(constants, block, scratch, unexplained, contacts, at, end, within, touched, before, after)
            at = end

        # Attribute what each contact did to velocities, then to places, and enter what is left.
        elsewhere = find_unexplained(constants, block, scratch, unexplained, before, after, off_parabola)
        find_owners(constants, scratch, unexplained, contacts, begin, at, within, elsewhere)
        for k in range(begin, at):
            if block.shared[k]:
                attribute_simultaneous(constants, block, k, contacts[k], unexplained)
            else:
                attribute_single(constants, block, k, contacts[k], unexplained)
        for ball in range(n):
            explain_places(constants, block, unexplained, within, ball)
        for k in range(begin, at):
            _attribute_displacement_once(constants, block, scratch, unexplained, contacts, k, before[0])
        for ball in range(n):
            enter_unexplained(constants, block, scratch, unexplained, flights, ball, before, after, steps_before + step)
        torques[step - 1] = scratch.torque[0]
        sum_damped(constants, scratch, damped[step - 1])
    return at


def why_unjudged(traits: Traits) -> Cause | None:
    """Return why an engine's contacts cannot be judged one by one, None if they can."""
    if not traits.reports_contacts:
        return Cause.SILENT
    return Cause.SOFT if traits.soft else None


class Ledger:
    """The ledger of one engine, kept block by block of steps.

    traits: the engine's, whose changes all are on the line of `why_unjudged` if its contacts cannot be judged;
    max_overlap: px, of two balls at the end of any step; missed: passages without a reported contact.
    """

    def __init__(self, scene: Scene, traits: Traits) -> None:
        self._scene, self._clock = scene, scene.clock
        self._damping, self._unjudged = traits.damping, why_unjudged(traits)
        bodies, damping = scene.bodies, traits.damping
        gravity = (float(scene.gravity[0]), float(scene.gravity[1]))
        self._constants = SceneConstants(
            bodies.radius,
            bodies.mass,
            bodies.elasticity,
            _wall_constants(scene),
            gravity,
            gravity,
            traits.together,
            traits.infers_impulses,
            traits.sums_impacts,
            (scene.arena.size[0] / 2, scene.arena.size[1] / 2),
            damping.substeps,
        )
        n = len(bodies)
        self._scratch = Scratch(
            explained=np.empty((n, 2)),
            spin=np.empty(n),
            flown=np.empty((n, 2)),
            clock=np.empty(n),
            last=np.empty(n, np.int64),
            uses=np.zeros(n, np.int64),
            score=np.empty(n),
            torque=np.empty(1),
            damped=np.empty((n, 2)),
        )
        self._unexplained = Unexplained(
            velocity=np.empty((n, 2)),
            place=np.empty((n, 2)),
            spin=np.empty(n),
            cause=np.empty(n, np.int64),
            spin_cause=np.empty(n, np.int64),
            owner=np.empty(n, np.int64),
            unsteady=np.zeros((n, 3)),
            flown=np.zeros(n, np.bool_),
            contacts=np.empty(n, np.int64),
            partner=np.full(n, -1),
            room=np.empty(n),
        )
        kinds = (n, KINDS_OF_FLIGHT)
        self._flights = Flights(np.zeros(kinds, np.int64), np.zeros((*kinds, 2)), np.zeros((*kinds, 2)))
        self._off_parabola: Floats | None = None
        self._findings: list[Findings] = []
        self._sums = np.zeros((4, len(Cause)))  # energy, momentum, displacement, contacts
        self._touched = np.full(len(bodies), -np.inf)
        self._deepening = no_deepening()
        self._rescaled = RescaledImpulses(self._clock, scene.pymunk.collision_persistence)
        self._start_overlaps: StartOverlaps | None = None
        self.missed: list[Passage] = []
        self.max_overlap = 0.0
        self._steps = 0

    def add(self, states: States, contacts: Contacts, pushes: Pushes) -> tuple[Floats, Floats]:
        """Enter a block of steps. states: of steps + 1 rows, from the last state of the block before.

        pushes: by a hand, by row. Returns what was given in each step: the angular momentum about the arena's centre by
        walls, gravity, hand and damping, (steps,) kg px²/s, and the momentum by damping, (steps, 2) kg px/s.
        """
        position, velocity = states.position, states.velocity
        steps = len(position) - 1
        clock, lengths = self._clock, self._lengths(steps)
        step_of = clock.steps_containing(contacts["time"])
        within = np.clip(contacts["time"] - clock.times(step_of - 1), 0.0, 1 / clock.rates(step_of))
        step_of = np.clip(step_of - self._steps, 1, steps)
        if not self._constants.together:
            at_start = (within <= lengths.dt[step_of - 1] * NEGLIGIBLE) & (step_of > 1) & (contacts["impulse"] != 0)
            step_of = step_of - at_start
            within = np.where(at_start, lengths.dt[step_of - 1], within)
            moved = self._resolved_next(lengths.dt, velocity, contacts, step_of, within)
            step_of, within = step_of + moved, np.where(moved, 0.0, within)
        if not self._steps:
            self._note_touching(position[0], contacts)
            self._start_overlaps = StartOverlaps(self._scene, position[0])
        if self._off_parabola is None and self._unjudged is None:
            self._read_gravity(lengths.dt, position, velocity, contacts, step_of)
        within = true_times(self._constants, lengths, position, velocity, contacts, step_of, within)
        energy, momentum, displacement, count = self._sums
        block = Block(
            energy,
            momentum,
            displacement,
            count,
            findings=np.zeros(len(contacts), FINDING),
            expected_shift=np.zeros((len(contacts), 2)),
            timing=np.full(len(contacts), int(Cause.ROUNDING)),
            line=np.empty((len(contacts), 2)),
            line_before=np.empty((len(contacts), 2)),
            line_after=np.empty((len(contacts), 2)),
            shared=np.zeros(len(contacts), np.bool_),
            crowded=_crowded(contacts),
            friction=pair_friction(self._scene, contacts),
            rescaled=self._rescaled.find(contacts, self._steps + step_of),
        )
        torques, damped = np.empty(steps), np.empty((steps, 2))
        replayed = _replay(
            self._constants,
            block,
            self._scratch,
            self._unexplained,
            self._flights,
            lengths,
            states,
            pushes,
            np.zeros(2) if self._off_parabola is None else self._off_parabola,
            contacts,
            step_of,
            within,
            self._touched,
            self._steps,
            torques,
            damped,
        )
        assert replayed == len(contacts)
        if len(block.findings):
            self._findings.append(block.findings)
        self._steps += steps
        if self._scene.is_rough:
            turning = spin_energy(states.spin[[0, -1]], self._scene.bodies.moment)
            self._sums[0, Cause.SPIN] += turning[1] - turning[0]
        self._check_overlaps(position, velocity, contacts, step_of)
        if self._start_overlaps:
            self._start_overlaps.follow(position[1:], clock.times(np.arange(self._steps - steps, self._steps) + 1))
        if self._unjudged is None:
            at_end = within >= lengths.dt[step_of - 1] * (1 - NEGLIGIBLE)
            self._check_inner_walls(position, contacts, step_of, ~at_end)
            self._check_leaps(position, contacts, step_of)
        return torques, damped

    def _lengths(self, steps: int) -> StepLengths:
        """Return what the ledger needs of each of the next steps."""
        numbers, damping = self._steps + np.arange(1, steps + 1), self._damping
        dt, traced = 1 / self._clock.rates(numbers), self._clock.lengths_around(numbers, MAX_TRACE_STEPS)
        return StepLengths(dt, traced, np.array([damping.left_after(one / damping.substeps) for one in dt.tolist()]))

    def _note_touching(self, position: Floats, contacts: Contacts) -> None:
        """Note the balls that touch a wall at the start, or a ball that they have a contact with."""
        radius = self._constants.radius
        self._touched[wall_distance(self._scene, position) <= radius * (1 + NEGLIGIBLE)] = 0.0
        first, second = (contacts[key][contacts["second"] >= 0] for key in ("first", "second"))
        reach = (radius[first] + radius[second]) * (1 + NEGLIGIBLE)
        touching = length(position[first] - position[second]) <= reach
        self._touched[np.concatenate([first[touching], second[touching]])] = 0.0

    def _resolved_next(
        self, dt: Floats, velocity: Floats, contacts: Contacts, step_of: Integers, within: Floats
    ) -> Bools:
        """Return which contacts at the end of a step were resolved at the start of the next: (contacts,).

        The velocity of one of the two changes in the next step only, and neither changes in this one, unless by an
        earlier contact of the step. If that is so for most, the engine reports the start of the step for all.
        dt: (steps,) s.
        """
        steps = len(velocity) - 1
        fall = np.multiply.outer(dt, self._constants.gravity)
        slight = np.abs(contacts["impulse"]) / 1000
        at_end = (within >= dt[step_of - 1] * (1 - NEGLIGIBLE)) & (step_of < steps) & (slight > 0)

        def changes(key: str, step: Integers, numbers: Integers) -> Bools:
            ball = np.maximum(contacts[key][numbers], 0)
            change = np.abs(velocity[step, ball] - velocity[step - 1, ball] - fall[step - 1]).sum(axis=1)
            changed: Bools = (change * self._constants.mass[ball] > slight[numbers]) & (contacts[key][numbers] >= 0)
            return changed

        numbers = np.flatnonzero(at_end)
        stays = [
            ~changes(key, step_of[numbers], numbers) & (contacts[key][numbers] >= 0) for key in ("first", "second")
        ]
        numbers = numbers[stays[0] | stays[1]]
        found = step_of.copy()
        led_on: set[tuple[int, int]] = set()  # balls with such a contact, with its step: their later ones follow it
        for k in numbers.tolist():
            one, step = np.array([k]), step_of[[k]]
            balls = [int(contacts[key][k]) for key in ("first", "second")]
            earlier = contacts[:k][step_of[:k] == step]
            next_only = moved = False
            for key, ball in zip(("first", "second"), balls, strict=True):
                now = bool(changes(key, step, one)[0])
                next_only |= not now and bool(changes(key, step + 1, one)[0])
                moved |= now and ball not in earlier["first"] and ball not in earlier["second"]
            follows = any((ball, int(step[0])) in led_on for ball in balls)
            if (follows or next_only) and not moved:
                found[k] += 1
                led_on |= {(ball, int(step[0])) for ball in balls if ball >= 0}
        resolved_next: Bools = np.minimum.accumulate(found[::-1])[::-1] > step_of  # steps must not descend
        return at_end if 2 * np.count_nonzero(resolved_next) > np.count_nonzero(at_end) else resolved_next

    def _read_gravity(
        self, dt: Floats, position: Floats, velocity: Floats, contacts: Contacts, step_of: Integers
    ) -> None:
        """Read from the flights of a block what pulls at the balls, and how far they are from its parabola. dt: s."""
        read = engine_gravity(self._scene, self._damping, dt, position, velocity, contacts, step_of)
        if read is not None:
            fall, self._off_parabola = read
            fall_x, fall_y = fall.tolist()
            self._constants = self._constants._replace(fall=(fall_x, fall_y))

    @property
    def flights(self) -> Flights:
        """How the engine errs in flight, so far."""
        off = (0.0, 0.0) if self._off_parabola is None else (float(self._off_parabola[0]), float(self._off_parabola[1]))
        damping = self._damping.per_second
        return self._flights._replace(gravity=self._constants.fall, off_parabola=off, damping=damping)

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
        if self._unjudged is None:
            self._enter_missed(position, [(step, *divmod(key, n)) for step, key in passed.tolist()])

    def _check_inner_walls(self, position: Floats, contacts: Contacts, step_of: Integers, early: Bools) -> None:
        """Find the balls that go through an inner wall without a reported contact. early: before the end of a step."""
        ends = np.array([(*wall.start, *wall.to) for wall in self._scene.walls], float)
        if len(ends):
            bounds = np.searchsorted(step_of, np.arange(len(position) + 1))
            crossings = find_crossings(position, ends, len(ARENA_WALLS), contacts, early, bounds)
            self._enter_missed(position, crossings.tolist())

    def _check_leaps(self, position: Floats, contacts: Contacts, step_of: Integers) -> None:
        """Find the balls that fly through others within a step."""
        bounds, before = np.searchsorted(step_of, np.arange(len(position) + 1)), self._steps - len(position) + 1
        for step, ball, other in find_leaps(position, self._constants.radius, contacts, bounds).tolist():
            flown = math.dist(position[step, ball], position[step - 1, ball])
            self.missed.append(Passage(before + step, min(ball, other), max(ball, other), flown, within_step=True))
            self._sums[3, Cause.MISSED] += 1

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

    @property
    def start_overlaps(self) -> Sequence[StartOverlap]:
        """What overlapped at the start."""
        return self._start_overlaps.found if self._start_overlaps else ()

    def entries(self) -> tuple[Entry, ...]:
        """Return a line for each cause that occurred, in the order of Cause."""
        return entries_of(self._sums if self._unjudged is None else _in_one_line(self._sums, self._unjudged))


def _in_one_line(sums: Floats, line: Cause) -> Floats:
    """Return the sums of a ledger, (4, causes), with all that the engine changes in one line."""
    changed, kept = np.zeros_like(sums), [Cause.SPIN, Cause.HAND, Cause.ROUNDING]
    changed[:, kept] = sums[:, kept]
    changed[:, line] = np.delete(sums, kept, axis=1).sum(axis=1)
    return changed


def _crowded(contacts: Contacts) -> Bools:
    """Return whether a ball of each contact has another contact at the same time: (k,)."""
    ball = np.concatenate([contacts["first"], contacts["second"]])
    time = np.concatenate([contacts["time"]] * 2)
    order = np.lexsort((time, ball))
    again = (np.diff(ball[order]) == 0) & (np.diff(time[order]) == 0) & (ball[order[1:]] >= 0)
    crowded = np.zeros(len(ball), bool)
    crowded[order[1:]] = again
    crowded[order[:-1]] |= again
    return crowded[: len(contacts)] | crowded[len(contacts) :]


def _wall_constants(scene: Scene) -> Floats:
    """Return the walls as in `SceneConstants`, those of the arena without thickness: (m, 7).

    Those that do not stand are infinitely far behind their lines, so that nothing overlaps them.
    """
    rows = []
    elasticities = [scene.arena.elasticity] * len(ARENA_WALLS) + [wall.elasticity for wall in scene.walls]
    for wall, elasticity in enumerate(elasticities):
        start, to, thickness = scene.wall_line(wall)
        size = math.dist(start, to)
        along = ((to[0] - start[0]) / size, (to[1] - start[1]) / size)
        half = thickness / 2 if wall >= len(ARENA_WALLS) or scene.arena.walls else -math.inf
        rows.append((*along, half, elasticity, *start, size))
    return np.array(rows, float)
