"""What is wrong with an engine's steps, beside the exact step from its own state: where, since when, and why."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any, Final, NamedTuple

import numpy as np

from sandbox.judge.causes import NEGLIGIBLE, Cause
from sandbox.judge.step_errors import StepError
from sandbox.judge.thresholds import SINGLE
from sandbox.judge.timeline import Timeline
from sandbox.judge.touching import Touches
from sandbox.quantity import length
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.scene.units import Dimension, Units
from sandbox.state import Floats, State

MAX_DIFFERENCES: Final = 200  # reported of one engine
Velocities = tuple[Vector, ...]
Spins = tuple[float, ...]


class Kind(StrEnum):
    """What of an engine differs."""

    OUTCOME = "outcome"  # of a contact
    MISSING = "missing"  # a contact that is due
    EXTRA = "extra"  # a contact that is not due
    FLIGHT = "flight"
    START = "start"


@dataclass(frozen=True)
class Difference:
    """What is wrong with a step of an engine; or that it begins elsewhere than the reference.

    What should be is what the exact step makes of the engine's own state before it.
    """

    kind: Kind
    time: float  # s, at the end of the step
    first: int  # ball
    second: int | None  # ball, or ~wall; None if no contact shows the difference
    cause: Cause
    because: str  # a sentence
    in_reference: bool  # whether the error is the reference's
    before: Velocities  # px/s of the ball or balls, before the step
    after: Velocities
    should_before: Velocities
    should_after: Velocities
    spin_before: Spins  # rad/s, as the velocities
    spin_after: Spins
    should_spin_before: Spins
    should_spin_after: Spins
    normal: Vector | None = None  # from the first to the second body, as the engine found it; None if not known
    depth: float | None = None  # px, their overlap then; negative if they were apart
    normal_at_touch: Vector | None = None  # in the exact step; None if the two do not touch in it
    should_normal: Vector | None = None  # the same

    @property
    def balls(self) -> list[int]:
        """The balls that it is about."""
        return [body for body in (self.first, self.second) if body is not None and body >= 0]

    def of_reference(self) -> "Difference":
        """Return the same, said of the reference."""
        return replace(self, in_reference=True, because=f"The reference is wrong here. {self.because}")

    @property
    def cause_label(self) -> str:
        """The cause in words, and whose it is if it is not the engine's."""
        return f"{self.cause.label}, in the reference" if self.in_reference else self.cause.label


class Passage(NamedTuple):
    """A contact that did not happen. step: of the run, from 1; first: ball; second: ball, or ~wall."""

    step: int
    first: int
    second: int


def pair_name(scene: Scene, contact: Difference | Passage) -> str:
    """Name the two bodies of a difference or a passage."""
    return f"ball {contact.first}" if contact.second is None else contact_name(scene, contact.first, contact.second)


def contact_name(scene: Scene, first: int, second: int) -> str:
    """Name the two bodies of a contact, by the numbers that contacts have."""
    return f"balls {first} and {second}" if second >= 0 else f"ball {first} and {scene.wall_name(~second)}"


def passages(timeline: Timeline) -> tuple[Passage, ...]:
    """Return the contacts of a run that did not happen."""
    missed = (error for error in timeline.errors if error.cause == Cause.MISSED and error.contact)
    return tuple(Passage(error.step, *error.contact) for error in missed if error.contact)


def differences(scene: Scene, timeline: Timeline) -> tuple[Difference, ...]:
    """Return the steps of an engine that are not as the exact step from the same state is, at most MAX_DIFFERENCES.

    What is wrong with all its flights is listed once.
    """
    flights: set[str] = set()
    listed: list[StepError] = []
    for error in timeline.errors:
        if error.contact or error.because not in flights:
            listed.append(error)
        if not error.contact:
            flights.add(error.because)
        if len(listed) == MAX_DIFFERENCES:
            break
    return tuple(_of_step(scene, timeline.touches, error) for error in listed)


def _of_step(scene: Scene, touches: Touches, error: StepError) -> Difference:
    (first, second), (spin, spin_after, should_spin) = error.contact or (error.balls[0], None), error.spins
    normal, should_normal = touches.normals(error)
    return Difference(
        _kind(error),
        scene.clock.time(error.step),
        first,
        second,
        error.cause,
        touches.said(error),
        in_reference=False,
        **_motion((error.before, error.after, error.before, error.should), (spin, spin_after, spin, should_spin)),
        normal=normal,
        depth=error.depth,
        normal_at_touch=should_normal,
        should_normal=should_normal,
    )


def _motion(velocity: Sequence[Floats], spin: Sequence[Floats]) -> dict[str, Any]:
    """Return the motion of a difference, by the names of its fields.

    velocity, spin: (k, 2) px/s and (k,) rad/s of the balls, before and after, and what both should be.
    """
    times = "before", "after", "should_before", "should_after"
    velocities = {time: tuple((x, y) for x, y in v.tolist()) for time, v in zip(times, velocity, strict=True)}
    times = "spin_before", "spin_after", "should_spin_before", "should_spin_after"
    return velocities | {time: tuple(each.tolist()) for time, each in zip(times, spin, strict=True)}


def _kind(error: StepError) -> Kind:
    if error.contact is None:
        return Kind.FLIGHT
    if error.cause == Cause.MISSED:
        return Kind.MISSING
    return Kind.EXTRA if error.cause in (Cause.DOUBLE_BOUNCE, Cause.WARM_START) else Kind.OUTCOME


def difference_at_start(scene: Scene, state: State, reference: State) -> Difference | None:
    """Return the first ball that begins elsewhere than in the reference, or otherwise, by more than float32 rounds."""
    away, extent = length(state.position - reference.position), float(np.abs(reference.position).max())
    speed = float(np.maximum(np.abs(state.velocity), np.abs(reference.velocity)).max())
    rim = scene.bodies.radius * np.abs(state.spin - reference.spin)
    at_rim = float((scene.bodies.radius * np.maximum(np.abs(state.spin), np.abs(reference.spin))).max())
    apart = away > np.maximum(NEGLIGIBLE * scene.bodies.radius, SINGLE * extent)
    apart |= length(state.velocity - reference.velocity) + rim > 2 * NEGLIGIBLE * (speed + at_rim)
    return _start(scene.units, state, reference, int(apart.argmax())) if apart.any() else None


def _start(units: Units, state: State, reference: State, ball: int) -> Difference:
    """Describe that a ball begins elsewhere than in the reference."""
    away = math.dist(state.position[ball], reference.position[ball])
    slower = math.dist(state.velocity[ball], reference.velocity[ball])
    states = state, state, reference, reference
    return Difference(
        Kind.START,
        0.0,
        ball,
        None,
        Cause.START,
        f"When the comparison begins, ball {ball} is {units.text(Dimension.LENGTH, '{:.3g}', away)} and "
        f"{units.text(Dimension.VELOCITY, '{:.3g}', slower)} from the reference's: what follows begins with that.",
        in_reference=False,
        **_motion([each.velocity[[ball]] for each in states], [each.spin[[ball]] for each in states]),
    )
