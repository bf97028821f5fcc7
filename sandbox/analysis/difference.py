"""The contacts in which an engine and the reference differ, and why.

Contacts are matched by pair and time. A contact of the reference without a match is missing, a contact of the engine
without one is extra; matched contacts may come in another order than in the reference, or have another outcome: other
velocities or spins after. The cause is the one that the ledger found for that contact. If that explains less than half
of the difference, the balls came into the contact differently, and the cause is the first error before it, of a contact
or in flight, of these balls or of balls that they met since; a wrong velocity outranks a wrong position. Without one in
the engine's own run, the reference's is searched. Without one there either, the cause is unknown.
"""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.analysis.explain import (
    BY_STATES,
    DISORDERED,
    NO_CAUSE,
    RESOLVED_TOGETHER,
    UNCONVERGED,
    WRONG_REFERENCE,
    explain_passage,
    explain_start,
)
from sandbox.analysis.findings import MAX_TRACE_STEPS
from sandbox.analysis.matching import match_contacts
from sandbox.analysis.record import (
    INSIGNIFICANT,
    Error,
    Reason,
    Record,
    errors_in_flight,
    errors_of_contacts,
    influence,
    overlap_reason,
    reason_of,
    significant,
)
from sandbox.analysis.start_overlaps import SINGLE_PRECISION
from sandbox.analysis.ties import SIMULTANEOUS
from sandbox.analysis.tunnelling import Passage
from sandbox.judge.causes import NEGLIGIBLE, Cause
from sandbox.judge.timeline import Timeline
from sandbox.judge.touching import StepError
from sandbox.quantity import length
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.state import Bools, Contacts, Floats, Integers, State

MAX_DIFFERENCES: Final = 200  # reported of one engine
MAX_CONTACTS_COMPARED: Final = 20_000  # the first of each engine
GRAVITYS_PART: Final = 0.1  # of a difference; earlier bounces, each off by less than counts, have added the rest
UNREPORTED: Final = Reason(Cause.UNTOLD, "The balls fly on as after this contact, but the engine does not report it.")
Velocities = tuple[Vector, ...]
Spins = tuple[float, ...]


class Kind(StrEnum):
    """How a contact differs from the reference's."""

    OUTCOME = "outcome"
    MISSING = "missing"
    EXTRA = "extra"
    ORDER = "order"
    FLIGHT = "flight"
    STATES = "states"
    START = "start"
    STEP = "step"


@dataclass(frozen=True)
class Difference:
    """A contact in which an engine and the reference differ; or what no contact shows: a flight, the start, states.

    Of a step, what should be is what the exact step makes of the engine's own state before it.
    """

    kind: Kind
    time: float  # s, in the engine; in the reference if it is missing
    first: int  # ball
    second: int | None  # ball, or ~wall; None if no contact shows the difference
    cause: Cause
    because: str  # a sentence
    in_reference: bool  # whether the error is the reference's
    before: Velocities | None  # px/s of the ball or balls in the engine; None if missing
    after: Velocities | None
    should_before: Velocities | None  # in the reference; None if extra
    should_after: Velocities | None
    spin_before: Spins | None = None  # rad/s, as the velocities
    spin_after: Spins | None = None
    should_spin_before: Spins | None = None
    should_spin_after: Spins | None = None
    normal: Vector | None = None  # from the first to the second body, as the engine found it
    depth: float | None = None  # px, their overlap then; negative if they were apart
    normal_at_touch: Vector | None = None  # when the two touched first, on the engine's own course; None if not known
    should_normal: Vector | None = None  # in the reference

    @property
    def balls(self) -> list[int]:
        """The balls that it is about."""
        return [body for body in (self.first, self.second) if body is not None and body >= 0]

    @property
    def cause_label(self) -> str:
        """The cause in words, and whose it is if it is not the engine's."""
        return f"{self.cause.label}, in the reference" if self.in_reference else self.cause.label


def pair_name(scene: Scene, contact: Difference | Passage) -> str:
    """Name the two bodies of a difference or a passage."""
    return f"ball {contact.first}" if contact.second is None else _pair(scene, contact.first, contact.second)


def _pair(scene: Scene, first: int, second: int) -> str:
    return f"balls {first} and {second}" if second >= 0 else f"ball {first} and {scene.wall_name(~second)}"


class Place(NamedTuple):
    """Where a difference is: the contact's numbers in the engine and in the reference, -1 where it is not."""

    time: float
    kind: Kind
    own: int
    reference: int
    size: float  # px/s between the velocities after, or by which an impulse at the rim that turns as much moves a disc;


def difference_of_states(time: float, ball: int, own: Record, reference: Record) -> Difference:
    """Return the difference that states show, where contacts cannot be judged: a ball is away from the reference's.

    time: s, when it is first more than its radius away.
    """
    cause = reference.unjudged if own.unjudged is None else own.unjudged
    assert cause is not None
    reason = Reason(cause, BY_STATES, in_reference=own.unjudged is None)
    return Difference(Kind.STATES, time, ball, None, *reason, None, None, None, None)


def differences_of_steps(scene: Scene, timeline: Timeline) -> tuple[Difference, ...]:
    """Return the steps of an engine that are not as the exact step from the same state is, at most MAX_DIFFERENCES.

    What is wrong with all its flights is listed once.
    """
    flights: set[str] = set()
    found: list[StepError] = []
    for error in timeline.errors:
        if error.contact or error.because not in flights:
            found.append(error)
        if not error.contact:
            flights.add(error.because)
        if len(found) == MAX_DIFFERENCES:
            break
    return tuple(_of_step(scene, error) for error in found)


def _of_step(scene: Scene, error: StepError) -> Difference:
    before, after, should = (tuple((x, y) for x, y in v.tolist()) for v in (error.before, error.after, error.should))
    spins = [tuple(each.tolist()) for each in error.spins]
    first, second = error.contact or (error.balls[0], None)
    return Difference(
        Kind.STEP,
        scene.clock.time(error.step),
        first,
        second,
        error.cause,
        error.because,
        in_reference=False,
        before=before,
        after=after,
        should_before=before,
        should_after=should,
        spin_before=spins[0],
        spin_after=spins[1],
        should_spin_before=spins[0],
        should_spin_after=spins[2],
        depth=error.depth,
        normal=error.normal,
        normal_at_touch=error.should_normal,
        should_normal=error.should_normal,
    )


def differences(
    scene: Scene, own: Record, reference: Record, until: float, end: float, *, in_place: bool = False
) -> tuple[Difference, ...]:
    """Return the differences between an engine and the reference up to a time (s), in order of their steps.

    end: s, up to which contacts are known; one near it may have its match later; in_place: whether all balls are where
    the reference has them until then, so that none is on another course. If all velocities agree, the contacts that
    displaced balls are returned. At most MAX_DIFFERENCES are returned, of the first MAX_CONTACTS_COMPARED contacts.
    """
    for record in (own, reference):
        if len(record.contacts) > MAX_CONTACTS_COMPARED:
            until = min(until, float(record.contacts["time"][MAX_CONTACTS_COMPARED]))
    matches = _Matches(scene, own, reference, until, end)
    places = sorted(matches.other_contacts(), key=matches.order)[:MAX_DIFFERENCES]
    if apart := _apart_at_start(scene, own.start, reference.start):
        first, begin, others = _start(own.start, reference.start, apart[0]), 0.0, places
        reason = Reason(first.cause, first.because)
    elif places:
        origin, reason = matches.origin(places[0])
        first, begin, apart = matches.difference(origin, reason), origin.time, [*matches.bodies(origin)]
        others = places[1:] if origin == places[0] else places
    else:
        return matches.displacements()
    follows = reason._replace(because=f"The balls have been on other courses since {begin:.3f} s.")
    led_on = matches.led_on(begin, apart)
    differing = [first]
    for place in others:
        if in_place:
            later = UNREPORTED if place.kind == Kind.MISSING else matches.later_reason(place)
        else:
            later = follows if led_on(place) else matches.later_reason(place)
        differing.append(matches.difference(place, matches.own_reason(place) or later))
    return tuple(differing)


def _apart_at_start(scene: Scene, own: State, reference: State) -> list[int]:
    """Return the balls that begin elsewhere than in the reference, or otherwise, by more than float32 rounds."""
    away, extent = length(own.position - reference.position), float(np.abs(reference.position).max())
    speed = float(np.maximum(np.abs(own.velocity), np.abs(reference.velocity)).max())
    rim = scene.bodies.radius * np.abs(own.spin - reference.spin)
    at_rim = float((scene.bodies.radius * np.maximum(np.abs(own.spin), np.abs(reference.spin))).max())
    apart = away > np.maximum(NEGLIGIBLE * scene.bodies.radius, SINGLE_PRECISION * extent)
    apart |= length(own.velocity - reference.velocity) + rim > 2 * NEGLIGIBLE * (speed + at_rim)
    return np.flatnonzero(apart).tolist()


def _start(own: State, reference: State, ball: int) -> Difference:
    """Describe that a ball begins elsewhere than in the reference."""
    states = own, reference
    away = math.dist(*(state.position[ball] for state in states))
    slower = math.dist(*(state.velocity[ball] for state in states))
    velocity, should_velocity = (((float(x), float(y)),) for x, y in (state.velocity[ball] for state in states))
    spin, should_spin = ((float(state.spin[ball]),) for state in states)
    return Difference(
        Kind.START,
        0.0,
        ball,
        None,
        Cause.START,
        explain_start(ball, away, slower),
        in_reference=False,
        before=velocity,
        after=velocity,
        should_before=should_velocity,
        should_after=should_velocity,
        spin_before=spin,
        spin_after=spin,
        should_spin_before=should_spin,
        should_spin_after=should_spin,
    )


class _Matches:
    """The contacts of an engine, matched with the reference's.

    trusted: s, up to which the engine and the reference can differ; until: s, up to which a contact that has no match
    will have none; end: s, up to which contacts are known; of_reference: for each contact of the engine the number of
    the reference's, or -1; matched: which of the reference's have a match; at_ends_of_steps: whether that is where the
    engine has all its contacts.
    """

    def __init__(self, scene: Scene, own: Record, reference: Record, until: float, end: float) -> None:
        self.scene, self.own, self.reference = scene, own, reference
        self.clock = scene.clock
        times = own.contacts["time"]
        steps = self.clock.steps_containing(times)
        self.trusted, self.until, self.end = until, min(until, end - self._slack(end)), end
        slack = self.clock.lengths_around(steps, MAX_TRACE_STEPS)
        self.of_reference, self.matched = match_contacts(own, reference, until + self._slack(until), slack)
        error = np.abs(times - self.clock.times(steps)) * self.clock.rates(steps)
        self.at_ends_of_steps = bool((error <= NEGLIGIBLE).all())

    def _slack(self, time: float) -> float:
        """Return how long before or after a time (s) another engine may have the same contact, s."""
        return float(self.clock.lengths_around(self.clock.steps_containing(time), MAX_TRACE_STEPS))

    def order(self, place: Place) -> tuple[float, bool, int, int]:
        """Return the key by which places are sorted: by time, then as the engine resolved them.

        What an engine that finds contacts at the ends of steps lacks, it lacks at the end of a step, and may lack
        because of what it found there.
        """
        lacks, time = place.own < 0, place.time
        if lacks and self.at_ends_of_steps:
            time = self.clock.time(int(self.clock.steps_containing(time)))
        return time, lacks, place.own, place.reference

    def other_contacts(self) -> list[Place]:
        """Find the contacts that differ, without those that differ far less than another does."""
        places = [*self.other_velocities(), *self.unmatched()]
        largest = max((place.size for place in places), default=0.0)
        return [one for one in places if one.size > INSIGNIFICANT * largest]

    def other_velocities(self) -> Iterator[Place]:
        """Find the matched contacts that have other velocities after, or come in another order.

        What rests has no outcome: its contacts only bear its weight.
        """
        matched = np.flatnonzero(self.of_reference >= 0)
        numbers = self.of_reference[matched]
        contacts, own, reference = (
            self.own.contacts[matched],
            self.own.findings[matched],
            self.reference.findings[numbers],
        )
        fall = np.multiply.outer(contacts["time"] - self.reference.contacts["time"][numbers], self.scene.gravity)
        difference = own["after"] - reference["after"] - fall[:, None]
        difference[contacts["second"] < 0, 1] = 0.0
        radius = self._radii(contacts)
        turned = radius / 2 * np.abs(own["spin_after"] - reference["spin_after"])
        unfallen = own["after"] - reference["after"]  # gravity pulls at what flies, and not at what a wall bears
        unfallen[contacts["second"] < 0, 1] = 0.0
        size = np.maximum(np.minimum(length(difference), length(unfallen)), turned).max(axis=1)
        rest = own["rests"] & reference["rests"]
        fastest = np.maximum(*(np.abs(one["before"]).max(axis=(1, 2)) for one in (own, reference)))
        fastest += np.maximum(*((radius * np.abs(one["spin_before"])).max(axis=1) for one in (own, reference)))
        disordered = self._disordered(matched)
        for at in np.flatnonzero(((size > NEGLIGIBLE * fastest) | disordered) & ~rest).tolist():
            k, kind = int(matched[at]), Kind.ORDER if disordered[at] else Kind.OUTCOME
            differs = max(float(size[at]), _speed(self.own, k)) if disordered[at] else float(size[at])
            yield Place(float(contacts["time"][at]), kind, k, int(numbers[at]), differs)

    def _radii(self, contacts: Contacts) -> Floats:
        """Return the radii of both bodies of each contact, 0 of a wall: (k, 2) px."""
        radius, second = self.scene.bodies.radius, contacts["second"]
        return np.column_stack([radius[contacts["first"]], np.where(second >= 0, radius[np.maximum(second, 0)], 0.0)])

    def unmatched(self) -> Iterator[Place]:
        """Find the contacts that only one of the two has."""
        has_impulse = self.own.contacts["impulse"][: len(self.of_reference)] != 0
        for k in np.flatnonzero((self.of_reference < 0) & has_impulse).tolist():
            place = Place(float(self.own.contacts["time"][k]), Kind.EXTRA, k, -1, _speed(self.own, k))
            if self.own.findings["rests"][k] and self._has_others(self.reference, place):
                continue
            if place.time <= self.until:
                yield place
            elif place.time <= self.trusted and self.own_reason(place):  # its match may come after the end
                yield place._replace(kind=Kind.OUTCOME)
        for r in np.flatnonzero(~self.matched).tolist():
            place = Place(float(self.reference.contacts["time"][r]), Kind.MISSING, -1, r, _speed(self.reference, r))
            if self.reference.findings["rests"][r] and self._has_others(self.own, place):
                continue
            if self._is_of_settling(place):
                continue
            if place.time <= self.until or (place.time <= self.trusted and self.own_reason(place)):
                yield place

    def _is_of_settling(self, place: Place) -> bool:
        """Return whether the reference's contact is one of the small ones in which bodies come to rest on each other.

        It changes velocities by no more than gravity does in a step, and the engine has others of the two near, or the
        two part already: so `exact` hands weight on. No engine of steps can have the same ones.
        """
        parts = self.reference.findings["approach"][place.reference] <= 0
        return place.size <= self._pull(place.time) and bool(parts or self._has_others(self.own, place))

    def _pull(self, time: float) -> float:
        """Return what gravity adds to a velocity in the step that contains a time (s), px/s."""
        return math.hypot(*self.scene.gravity) * self.clock.length(time)

    def displacements(self) -> tuple[Difference, ...]:
        """Return what displaced balls, if no contact has other velocities: contacts, or a flight before them."""
        contacts = np.flatnonzero(self._displacement_errors())[:MAX_DIFFERENCES].tolist()
        differing = tuple(
            self.difference(self._displacement_at(k), reason_of(self.scene, self.own, k)) for k in contacts
        )
        errors = [
            error
            for error in errors_in_flight(
                self.scene, self.own, self.reference, dict.fromkeys(range(len(self.scene.bodies)), np.inf)
            )
            if error.time <= self.trusted + self.clock.length(self.trusted)
            and error.time < self.end  # or else it may be of a contact that the engine reports in its next step
            and not (differing and differing[0].time <= error.time)
        ]
        return (self._flight(min(errors)), *differing) if errors else differing

    def origin(self, place: Place) -> tuple[Place, Reason]:
        """Find where a difference begins, and why: there, or at an earlier error in the engine or the reference."""
        if reason := self.own_reason(place):
            return place, reason
        if place.own >= 0 and self._has_unconverged_neighbour(self.own, place.own, place.size):
            return place, Reason(Cause.UNCONVERGED, UNCONVERGED)
        error = self._first_error(self.own, place)
        if (error is None or error.of_position) and self._is_of_several_late(place):
            return place, Reason(Cause.LATE, DISORDERED if place.kind == Kind.ORDER else RESOLVED_TOGETHER)
        if error is None or error.of_position:
            wrong = self._error_of_reference(place)
            if wrong and (error is None or not wrong.of_position):
                return place, _in_reference(wrong.reason)
        if error is None:
            return place, self._reason_elsewhere(place)
        return (place if error.contact < 0 else self._displacement_at(error.contact)), error.reason

    def later_reason(self, place: Place) -> Reason:
        """Return why a contact after the first difference differs, with the contact in which that began."""
        begin, reason = self.origin(place)
        if begin == place:
            return reason
        since = f"It follows from {begin.time:.3f} s, {_pair(self.scene, *self.bodies(begin))}"
        return reason._replace(because=f"{since}: {reason.because}")

    def led_on(self, begin: float, bodies: Iterable[int]) -> Callable[[Place], bool]:
        """Return whether a place has a ball that some bodies, on other courses since a time (s), can have led on."""
        contacts = self.own.contacts[: len(self.of_reference)]
        since = {ball: begin for ball in bodies if ball >= 0}
        for k in range(int(np.searchsorted(contacts["time"], begin)), len(contacts)):
            pair = [int(contacts[key][k]) for key in ("first", "second")]
            if any(ball in since for ball in pair):
                since |= {ball: float(contacts["time"][k]) for ball in pair if ball >= 0 and ball not in since}
        return lambda place: any(since.get(ball, math.inf) <= place.time for ball in self.bodies(place))

    def _first_error(self, record: Record, place: Place) -> Error | None:
        """Find the first error that can have led to a difference: of its balls, or of balls that they met since.

        A contact that the engine lacks may have been resolved in the step of its time, or after it, unreported.
        """
        first, second = self.bodies(place)
        time = place.time + (self.clock.length(place.time) if place.kind == Kind.MISSING else 0.0)
        until, contacts = influence(record.contacts, [first, second], time)
        other = self.reference if record is self.own else self.own
        in_flight = errors_in_flight(self.scene, record, other, until)
        errors = [*errors_of_contacts(self.scene, record, contacts), *in_flight]
        return min(significant(errors), default=None)

    def own_reason(self, place: Place) -> Reason | None:
        """Return the reason that lies in the contact itself, None if it is right or explains too little."""
        bodies, displaced = self.bodies(place), place.size * self.clock.length(place.time)
        time = place.time - SIMULTANEOUS
        if place.own < 0:
            if passage := self._passage(self.own, place.time, *bodies):
                return Reason(Cause.MISSED, explain_passage(self.scene, passage))
            return overlap_reason(self.scene, self.own, Cause.MISSED, bodies, time, displaced)
        contact, finding = self.own.contacts[place.own], self.own.findings[place.own]
        displaced = max(displaced, float(finding["displacement_error"]))
        if reason := overlap_reason(self.scene, self.own, Cause(finding["cause"]), bodies, time, displaced):
            return reason
        return reason_of(self.scene, self.own, place.own) if self._explains(contact, finding, place.size) else None

    def _flight(self, error: Error) -> Difference:
        """Describe an error in flight as a difference of its own."""
        return Difference(Kind.FLIGHT, error.time, error.ball, None, *error.reason, None, None, None, None)

    def difference(self, place: Place, reason: Reason) -> Difference:
        """Describe the difference at a place."""
        own = self.own.findings[place.own] if place.own >= 0 else None
        reference = self.reference.findings[place.reference] if place.reference >= 0 else None
        first, second = self.bodies(place)
        return Difference(
            place.kind,
            place.time,
            first,
            second,
            *reason,
            _velocities(own, "before", second),
            _velocities(own, "after", second),
            _velocities(reference, "before", second),
            _velocities(reference, "after", second),
            spin_before=_spins(own, "spin_before", second),
            spin_after=_spins(own, "spin_after", second),
            should_spin_before=_spins(reference, "spin_before", second),
            should_spin_after=_spins(reference, "spin_after", second),
            normal=_normal(self.own.contacts, "normal", place.own),
            depth=None if own is None else float(own["depth"]),
            normal_at_touch=_normal(self.own.findings, "touch", place.own),
            should_normal=_normal(self.reference.contacts, "normal", place.reference),
        )

    def _displacement_errors(self) -> Floats:
        """Return the error of each contact's displacements, px; 0 if it is negligible."""
        error = self.own.findings["displacement_error"][: len(self.of_reference)]
        radius = self.scene.bodies.radius[self.own.contacts["first"][: len(self.of_reference)]]
        return np.where(error > NEGLIGIBLE * radius, error, 0.0)

    def _displacement_at(self, k: int) -> Place:
        return Place(float(self.own.contacts["time"][k]), Kind.OUTCOME, k, int(self.of_reference[k]), 0.0)

    def bodies(self, place: Place) -> tuple[int, int]:
        """Return first and second of the contact at a place."""
        contact = self.reference.contacts[place.reference] if place.own < 0 else self.own.contacts[place.own]
        return int(contact["first"]), int(contact["second"])

    def _reason_elsewhere(self, place: Place) -> Reason:
        """Find why a contact differs of which the engine's own run shows no error, nor before it."""
        passage = self._passage(self.reference, place.time, *self.bodies(place))
        if place.kind == Kind.EXTRA and passage:
            return _in_reference(Reason(Cause.MISSED, explain_passage(self.scene, passage)))
        if place.kind == Kind.MISSING:
            return self._why_missing(place)
        if place.kind == Kind.ORDER and self.own.findings["delay"][place.own] > 0:
            return Reason(Cause.LATE, DISORDERED)
        shown = place.own >= 0 and self._shows_its_cause(place)
        return reason_of(self.scene, self.own, place.own) if shown else Reason(Cause.UNKNOWN, NO_CAUSE)

    def _shows_its_cause(self, place: Place) -> bool:
        """Return whether a contact was found at another time, or whether gravity is a part of its difference.

        What gravity does until a late contact is no error of its impulse, but changes the slip, and so the friction.
        """
        finding = self.own.findings[place.own]
        wrong = finding["momentum_error"] / self.scene.bodies.mass[self.bodies(place)[0]]
        until_found = abs(finding["delay"]) * math.hypot(*self.scene.gravity)
        by_gravity = wrong >= GRAVITYS_PART * place.size or until_found >= place.size / 2
        by_gravity &= finding["cause"] == Cause.GRAVITY and not finding["rests"]
        return bool(finding["cause"] in (Cause.LATE, Cause.EARLY) or by_gravity)

    def _error_of_reference(self, place: Place) -> Error | None:
        """Return the reference's error in its contact at a place, or else the first before it.

        Returns None if its contact displaces the balls less wrongly than the engine's own, if the cause of its error is
        unknown, or if the error is no larger than what gravity does in a step: in contacts that small, `exact` brings
        bodies to rest on each other. Such errors are no evidence against the reference.
        """
        error = self._first_error(self.reference, place)
        if place.reference >= 0:
            contact, finding = self.reference.contacts[place.reference], self.reference.findings[place.reference]
            if place.own >= 0 and finding["displacement_error"] < self.own.findings["displacement_error"][place.own]:
                return None
            at = (float(contact["time"]), int(contact["first"]), place.reference)
            if self._explains(contact, finding, place.size):
                error = Error(False, *at, reason_of(self.scene, self.reference, place.reference))
            elif self._has_unconverged_neighbour(self.reference, place.reference, place.size):
                error = Error(False, *at, Reason(Cause.UNCONVERGED, UNCONVERGED))
        if error is None or error.reason.cause == Cause.UNKNOWN:
            return None
        return error if error.of_position or error.size > self._pull(place.time) else None

    def _has_others(self, record: Record, place: Place) -> bool:
        """Return whether an engine has a contact of the same two bodies near, with an impulse or without."""
        contacts, (first, second) = record.contacts, self.bodies(place)
        near = np.abs(contacts["time"] - place.time) <= self._slack(place.time)
        return bool((near & (contacts["first"] == first) & (contacts["second"] == second)).any())

    def _why_missing(self, place: Place) -> Reason:
        """Explain why the engine may have missed a contact of the reference."""
        slack = f"{1e3 * self._slack(place.time):.3g} ms"
        if self._has_others(self.own, place):
            return Reason(Cause.UNKNOWN, f"Within {slack}, the engine has fewer contacts of the two.")
        first, second = self.bodies(place)
        finding = self.reference.findings[place.reference]
        approach = float(finding["approach"])
        if second >= 0 and approach > 0:
            reach = float(self.scene.bodies.radius[[first, second]].sum())
            overlap_time = 2 * reach * approach / float(np.sum((finding["before"][0] - finding["before"][1]) ** 2))
            if overlap_time < self.clock.length(place.time):
                because = f"The two would overlap for {1e3 * overlap_time:.2g} ms: less than a step, which can miss it."
                return Reason(Cause.MISSED, because)
        return Reason(Cause.MISSED, f"The engine has no such contact within {slack}.")

    def _disordered(self, matched: Integers) -> Bools:
        """Return for each matched contact whether the next one of a ball of it comes earlier in the reference."""
        times = self.reference.contacts["time"][self.of_reference[matched]]
        last: dict[int, int] = {}
        found = np.zeros(len(matched), bool)
        pairs = zip(*(self.own.contacts[key][matched].tolist() for key in ("first", "second")), strict=True)
        for at, pair in enumerate(pairs):
            for ball in pair:
                if ball >= 0 and ball in last and times[last[ball]] > times[at] + SIMULTANEOUS:
                    found[last[ball]] = True
                last[ball] = at
        return found

    def _passage(self, record: Record, time: float, first: int, second: int) -> Passage | None:
        """Find where an engine lets two bodies pass that should have touched at a time (s)."""
        step, slack = self.clock.steps(time), 2 * MAX_TRACE_STEPS
        pair = (first, second)
        passages = (one for one in record.missed if (one.first, one.second) == pair and 0 <= one.step - step <= slack)
        return next(passages, None)

    def _has_unconverged_neighbour(self, record: Record, k: int, size: float) -> bool:
        """Return whether a ball of a contact had another at that time, not converged by half of a size (px/s)."""
        contacts, findings, mass = record.contacts, record.findings, self.scene.bodies.mass
        balls = [ball for ball in (contacts["first"][k], contacts["second"][k]) if ball >= 0]
        neighbours = np.isin(contacts["first"], balls) | np.isin(contacts["second"], balls)
        neighbours &= (contacts["time"] == contacts["time"][k]) & (findings["cause"] == Cause.UNCONVERGED)
        return bool((findings["momentum_error"][neighbours] / mass[balls].min() >= size / 2).any())

    def _is_of_several_late(self, place: Place) -> bool:
        """Return whether the engine resolved several contacts of a place's balls in its step, and found one late.

        In the reference they must be at different times: at one time they are simultaneous there too.
        """
        time = place.time if place.own < 0 else float(self.own.contacts["time"][place.own])
        balls = [ball for ball in self.bodies(place) if ball >= 0]
        steps = [self.clock.steps_containing(record.contacts["time"]) for record in (self.own, self.reference)]
        step = self.clock.steps_containing(time)
        own, reference = (
            (of_step == step) & (np.isin(record.contacts["first"], balls) | np.isin(record.contacts["second"], balls))
            for of_step, record in zip(steps, (self.own, self.reference), strict=True)
        )
        late = self.own.findings["delay"][own] > NEGLIGIBLE * self.clock.length(time)
        times = self.reference.contacts["time"][reference]
        return bool(own.sum() > 1 and late.any() and len(times) > 1 and np.ptp(times) > SIMULTANEOUS)

    def _explains(self, contact: np.void, finding: np.void, size: float) -> bool:
        """Return whether a contact's error is at least half of the difference in the velocities after it (px/s).

        A ball that gravity pulled to a wall, and that the wall left at rest, is where it should be; and contacts of
        what rests bear its weight only together.
        """
        mass = self.scene.bodies.mass
        lighter = min(mass[contact["first"]], mass[contact["second"]] if contact["second"] >= 0 else math.inf)
        needed = min(size, abs(finding["approach"])) / 2
        left_at_rest = finding["cause"] == Cause.GRAVITY and abs(finding["approach_after"]) <= NEGLIGIBLE * needed
        rests = left_at_rest or finding["rests"]
        return bool(finding["cause"] != Cause.ROUNDING and not rests and finding["momentum_error"] / lighter >= needed)


def _in_reference(reason: Reason) -> Reason:
    """Return a reason as the reference's error, unless bodies overlapped at the start: no engine caused that."""
    if reason.cause == Cause.OVERLAPPED:
        return reason
    return Reason(reason.cause, f"{WRONG_REFERENCE} {reason.because}", in_reference=True)


def _speed(record: Record, k: int) -> float:
    """Return by how much a contact changes the velocity of the ball that it changes more, px/s."""
    finding = record.findings[k]
    return float(length(finding["after"] - finding["before"])[: 1 if record.contacts["second"][k] < 0 else 2].max())


def _velocities(finding: np.void | None, key: str, second: int) -> Velocities | None:
    """Return the velocities of a contact's balls before or after it, without a wall's."""
    if finding is None:
        return None
    return tuple((float(x), float(y)) for x, y in finding[key][: 1 if second < 0 else 2])


def _spins(finding: np.void | None, key: str, second: int) -> Spins | None:
    """Return the spins of a contact's balls before or after it."""
    return None if finding is None else tuple(float(spin) for spin in finding[key][: 1 if second < 0 else 2])


def _normal(rows: NDArray[np.void], key: str, row: int) -> Vector | None:
    """Return the normal in a row of contacts or findings; None for row -1, and if it is not known."""
    x, y = rows[key][row].tolist() if row >= 0 else (0.0, 0.0)
    return (x, y) if x or y else None
