"""Sentences on what is wrong with a step, and with many."""

import math
from collections.abc import Sequence

import numpy as np

from sandbox.judge.causes import NEGLIGIBLE, Cause
from sandbox.judge.fit import Outcome
from sandbox.judge.models import BY_NAME, Fault
from sandbox.quantity import length
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.state import Floats

SHORT = 1e-3  # ms; a contact that is so little late or early is found in time
LONG = 1000.0  # ms; a contact that closes so slowly that it would be later is said by its depth
NO_SINGLE_ERROR = "What the step did fits no single error."
ALIKE = 1e-3  # of a value, by which those of several steps may differ to be said once


def of_outcome(outcome: Outcome, cause: Cause, radius: float | None) -> str:
    """Return what an outcome says is wrong with a step; empty if nothing is. radius: px, of all balls if it is one."""
    trial = outcome.trial
    said = _of_value(BY_NAME[trial.fault], trial.value, radius) if trial.fault else ""
    if trial.is_in_time:
        return said
    late = _soft(outcome) if trial.is_soft else _late(outcome)
    if cause == Cause.OVERSHOOT and trial.is_soft:
        late = f"{late[:-1]}, and kept in touch until the step ends."
    elif cause == Cause.OVERSHOOT:
        late = f"{late[:-1]}, and put back on the wall: that much of its way is discarded."
    elif cause == Cause.POSITION_CORRECTION:
        late = f"{late[:-1]}, and put apart by that."
    return f"{said} {late}".strip()


def _of_value(fault: Fault, value: float, radius: float | None) -> str:
    """Return the sentence of a fault; of an impulse that is divided by the diameter, what that amounts to."""
    said = fault.says(value)
    if fault.name == "impulse" and radius and radius != 1 and abs(value * radius - 1) < ALIKE**2:
        return f"{said} It is divided by the diameter, {2 * radius:g} px: a restitution of {2 / radius - 1:.4g}."
    return said


def _late(outcome: Outcome) -> str:
    """Say how late a contact was found by a rule of steps."""
    return of_depth(max(outcome.met, key=lambda m: m["depth"]))


def of_depth(contact: np.void) -> str:
    """Say how late a contact was found, from its depth (px) and how fast it closed (px/s)."""
    depth, closing = float(contact["depth"]), float(contact["closing"])
    if closing <= 0:
        return f"The two were already parting, {depth:.3g} px deep, and were resolved again."
    late = 1e3 * depth / closing
    return f"Found {late:.3g} ms late, {depth:.3g} px deep." if late < LONG else f"Found {depth:.3g} px deep."


def of_push(part: np.void, cause: Cause) -> str:
    """Say how far two bodies are pushed apart."""
    if cause == Cause.OVERSHOOT:
        return f"The ball was put back on the wall, which discards {part['pushed']:.3g} px of its way."
    return f"Pushed apart by {part['pushed']:.3g} px, of an overlap of {part['overlap']:.3g} px."


def of_impulses(part: np.void, cause: Cause) -> str:
    """Say what is wrong with the impulses of contacts that are solved together."""
    two = _named(int(part["first"]), int(part["second"]))
    if cause == Cause.WARM_START:
        return f"The contact of {two} pulls them together."
    if part["after"] > 0:
        return f"The solver has not converged: {two} still approach at {part['after']:.3g} px/s."
    return f"The solver has not converged: {two} part at {-part['after']:.3g} px/s."


def _named(first: int, second: int) -> str:
    return f"balls {first} and {second}" if second >= 0 else f"ball {first} and a wall"


def _soft(outcome: Outcome) -> str:
    """Say when a soft contact was found."""
    met = max(outcome.met, key=lambda m: m["depth"])
    ms, apart = 1e3 * abs(float(met["time"])), f"{abs(met['depth']):.3g} px {'deep' if met['depth'] > 0 else 'apart'}"
    if not outcome.met["impulse"].any():
        return "The contact is missed, and the ball stopped where it touches."
    if met["closing"] <= 0:
        return f"The contact is soft: it still pushes the two, which part, {apart}."
    if math.isinf(ms):
        return f"Resolved {apart}, though the two would not have touched."
    when = f"Found {ms:.3g} ms {'late' if met['depth'] > 0 else 'early'}, {apart}." if ms < LONG else f"Found {apart}."
    several = sum(outcome.met["impulse"] > 0)
    if several < 2:
        return when
    in_turn = f"{several} contacts are solved in turn, a few times each."
    return f"{when} {in_turn}" if ms >= SHORT else in_turn


def summed(fault: Fault, values: Floats, radius: float | None) -> str:
    """Return the sentence of a model with many values of its parameter. radius: as in `of_outcome`."""
    low, high, median = float(np.min(values)), float(np.max(values)), float(np.median(values))
    if high - low <= ALIKE * max(abs(low), abs(high)):
        return _of_value(fault, median, radius)
    low, high = sorted((abs(low), abs(high))) if low * high > 0 else (low, high)
    return f"{fault.says(median)[:-1]} at the median, {low:.3g} to {high:.3g} in all."


def found_range(cause: Cause, depths: Sequence[float]) -> str:
    """Return how deep contacts were found that are found late, or how far apart those found early, px."""
    low, high = min(depths), max(depths)
    when, how = ("late", "deep") if cause == Cause.LATE else ("early", "apart")
    if high - low <= ALIKE * abs(high):
        return f"Contacts are found {when}, {high:.3g} px {how}."
    return f"Contacts are found {when}, {low:.3g} to {high:.3g} px {how}, {float(np.median(depths)):.3g} at the median."


def of_missed(scene: Scene, contact: tuple[int, int], way: Floats, overlap_time: float, *, is_through: bool) -> str:
    """Return how two bodies passed each other without a contact.

    way: (k, 2) px, of the balls in the step; overlap_time: s, for which two balls overlap on straight ways; is_through:
    whether they are apart after the step.
    """
    flown, wall = float(length(way).max()), ~contact[1]
    if wall < 0:
        if is_through:
            return (
                f"The two overlapped for {1e3 * overlap_time:.3g} ms, all within a step, in which one flew {flown:.3g} "
                "px, without a contact."
            )
        return "The two passed into each other without a contact."
    if not is_through:
        return f"The ball flew into {scene.wall_name(wall)} without a contact."
    start, to, thickness = scene.wall_line(wall)
    where = "the wall between ({:g}, {:g}) and ({:g}, {:g})".format(*start, *to)
    return f"The ball went through {where}: it flew {flown:.3g} px in the step, and the wall is {thickness:g} px thick."


def of_turn(late: str, normal: Vector | None, should: Vector | None) -> str:
    """Return a sentence on a contact found late, with the angle between its normal and the one at first touch."""
    if normal is None or should is None:
        return late
    turned = abs(
        math.atan2(normal[0] * should[1] - normal[1] * should[0], normal[0] * should[0] + normal[1] * should[1])
    )
    return f"{late[:-1]}, so the normal is turned by {math.degrees(turned):.2g}°." if turned > NEGLIGIBLE else late
