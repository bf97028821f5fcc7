"""The record of an engine's run, and the errors in it, in the order in which they can have led to others."""

import math
from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple

import numpy as np

from sandbox.analysis.explain import (
    explain,
    explain_damping,
    explain_flight,
    explain_gravity,
    explain_overlap,
)
from sandbox.analysis.findings import Findings
from sandbox.analysis.flights import DAMPED, PUSHED_OUT, PUT_ELSEWHERE, SPIN_CHANGED, VELOCITY_CHANGED, Flights
from sandbox.analysis.start_overlaps import MAY_BE_BY_OVERLAP, StartOverlap, overlap_of
from sandbox.analysis.ties import SIMULTANEOUS
from sandbox.analysis.tunnelling import Passage
from sandbox.judge.causes import NEGLIGIBLE, Cause
from sandbox.scene.model import Scene
from sandbox.state import Contacts, State

INSIGNIFICANT: Final = 1e-3  # of the largest difference, or error: a smaller one is not the first
_OF_POSITIONS: Final = (Cause.PUSHED, Cause.PLACED, Cause.OVERSHOOT)
_IN_FLIGHT: Final = {
    VELOCITY_CHANGED: Cause.UNTOLD,
    SPIN_CHANGED: Cause.UNTOLD,
    PUT_ELSEWHERE: Cause.PLACED,
    PUSHED_OUT: Cause.PUSHED,
}


class Record(NamedTuple):
    """An engine's contacts, what the ledger found about each, the contacts it missed, and its errors in flight.

    start: its state when the comparison begins; overlaps: what overlapped then; clamps_early: whether the engine is
    known to limit friction by the impulse without restitution; name: the engine's; unjudged: why its contacts cannot be
    judged one by one, if so.
    """

    contacts: Contacts
    findings: Findings
    missed: Sequence[Passage]
    flights: Flights
    start: State
    overlaps: Sequence[StartOverlap] = ()
    clamps_early: bool = False
    name: str = "The engine"
    unjudged: Cause | None = None


class Reason(NamedTuple):
    """Why a contact differs. The fields are those of `Difference`."""

    cause: Cause
    because: str
    in_reference: bool = False


class Error(NamedTuple):
    """An error of an engine, in the order in which errors are looked for."""

    of_position: bool  # and not of a velocity, which outranks it
    time: float  # s
    ball: int
    contact: int  # its number, or -1 if the error is in flight
    reason: Reason
    size: float = math.inf  # px/s or px, of one step; infinite if every step repeats it


def reason_of(scene: Scene, record: Record, k: int) -> Reason:
    """Return the reason that the ledger found for an error of a contact, unless it is an overlap at the start."""
    contact, finding = record.contacts[k], record.findings[k]
    cause, bodies = Cause(finding["cause"]), (int(contact["first"]), int(contact["second"]))
    displaced, time = float(finding["displacement_error"]), float(contact["time"]) - SIMULTANEOUS
    overlapped = overlap_reason(scene, record, cause, bodies, time, displaced)
    return overlapped or Reason(cause, explain(scene, contact, finding, clamps_early=record.clamps_early))


def overlap_reason(
    scene: Scene, record: Record, cause: Cause, bodies: Sequence[int], time: float, displaced: float
) -> Reason | None:
    """Return the reason if an error of a cause is that of bodies that overlapped at the start, or else None.

    bodies: a pair, or one ball; time: s, up to which they have not come apart; displaced: px, by the error.
    """
    overlap = overlap_of(record.overlaps, bodies, time, displaced) if cause in MAY_BE_BY_OVERLAP else None
    return Reason(Cause.OVERLAPPED, explain_overlap(scene, overlap)) if overlap else None


def influence(contacts: Contacts, bodies: Sequence[int], time: float) -> tuple[dict[int, float], list[int]]:
    """Return which balls can have led to what some bodies do at a time (s), each with the time up to which it can have.

    Also returns the contacts, by number, that passed it on, the last first.
    """
    until = {body: time for body in bodies if body >= 0}
    passed = []
    for k in range(int(np.searchsorted(contacts["time"], time)) - 1, -1, -1):
        pair = int(contacts["first"][k]), int(contacts["second"][k])
        if any(ball in until for ball in pair):
            passed.append(k)
            for ball in pair:
                if ball >= 0:
                    until.setdefault(ball, float(contacts["time"][k]))
    return until, passed


def significant(errors: Sequence[Error]) -> list[Error]:
    """Leave out errors that are far smaller than another of their kind, unless every step repeats them."""
    found = []
    for of_position in (False, True):
        sizes = [one.size for one in errors if one.of_position == of_position and one.size < math.inf]
        least = INSIGNIFICANT * max(sizes, default=0.0)
        found += [one for one in errors if one.of_position == of_position and one.size >= least]
    return found


def errors_of_contacts(scene: Scene, record: Record, numbers: Sequence[int]) -> Iterator[Error]:
    """Find the errors of some contacts."""
    bodies = scene.bodies
    for k in numbers:
        contact, finding = record.contacts[k], record.findings[k]
        cause, first = Cause(finding["cause"]), int(contact["first"])
        if cause in (Cause.ROUNDING, Cause.GRAVITY, Cause.DAMPING):
            continue
        speed = finding["momentum_error"] / bodies.mass[first]
        fastest = np.abs(finding["before"]).max() + (bodies.radius[first] * np.abs(finding["spin_before"])).max()
        of_velocity = cause not in _OF_POSITIONS and speed > NEGLIGIBLE * fastest
        if of_velocity or finding["displacement_error"] > NEGLIGIBLE * bodies.radius[first]:
            reason = reason_of(scene, record, k)
            size = float(speed if of_velocity else finding["displacement_error"])
            yield Error(not of_velocity, float(contact["time"]), first, k, reason, size)


def errors_in_flight(scene: Scene, record: Record, other: Record, until: dict[int, float]) -> Iterator[Error]:
    """Find the errors of some balls in flight, each up to a time (s), of gravity, and damping that another has not."""
    flights, of_other, clock = record.flights, other.flights.damping, scene.clock
    for ball, time in until.items():
        for kind, cause in _IN_FLIGHT.items():
            step = int(flights.step[ball, kind])
            if step and clock.time(step - 1) < time:
                reason = Reason(cause, explain_flight(scene, flights, ball, kind))
                size = math.hypot(*flights.change[ball, kind])
                if kind == PUSHED_OUT:
                    reason = overlap_reason(scene, record, cause, [ball], clock.time(step), size) or reason
                size *= scene.bodies.radius[ball] if kind == SPIN_CHANGED else 1.0
                of_position = kind not in (VELOCITY_CHANGED, SPIN_CHANGED)
                yield Error(of_position, clock.time(step), ball, -1, reason, float(size))
        other_gravity = flights.gravity != (float(scene.gravity[0]), float(scene.gravity[1]))
        if other_gravity or flights.off_parabola != (0.0, 0.0):
            reason = Reason(Cause.GRAVITY, explain_gravity(scene, flights))
            yield Error(not other_gravity, clock.time(1), ball, -1, reason)
        damped = int(flights.step[ball, DAMPED])
        if damped and clock.time(damped - 1) < time and flights.damping != of_other:
            reason = Reason(Cause.DAMPING, explain_damping(flights.damping, other.name, of_other))
            yield Error(False, clock.time(damped), ball, -1, reason)
