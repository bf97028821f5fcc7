"""Sentences on what is wrong with a step, and with many."""

import math
from collections.abc import Sequence

import numpy as np

from sandbox.judge.causes import NEGLIGIBLE, Cause
from sandbox.judge.explain import Part
from sandbox.judge.fit import Outcome
from sandbox.judge.law import UNDONE
from sandbox.judge.models import BY_NAME
from sandbox.judge.restitutions import in_common
from sandbox.judge.thresholds import ALIKE
from sandbox.quantity import length
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.scene.units import Dimension
from sandbox.state import Floats

SHORT = 1e-3  # ms; a contact that is so little late or early is found in time
NO_SINGLE_ERROR = "What the step did fits no single error."


def of_outcome(scene: Scene, outcome: Outcome, cause: Cause) -> str:
    """Return what an outcome says is wrong with a step; empty if nothing is."""
    trial = outcome.trial
    said = _of_value(scene, [outcome]) if trial.fault else ""
    if trial.is_in_time:
        return said
    late = _soft(scene, outcome) if trial.is_soft else _late(scene, outcome)
    if cause == Cause.OVERSHOOT and trial.is_soft:
        late = f"{late[:-1]}, and kept in touch until the step ends."
    elif cause in (Cause.OVERSHOOT, Cause.POSITION_CORRECTION) and _puts_back(outcome):
        late = f"{late[:-1]}, and put back to where the step began."
    elif cause == Cause.OVERSHOOT:
        late = f"{late[:-1]}, and put back on the wall: that much of its way is discarded."
    elif "apart" in trial.rule:
        late = f"{late} {BY_NAME['apart'].sentence(trial.rule['apart'], scene.units)}"
    elif cause == Cause.POSITION_CORRECTION:
        late = f"{late[:-1]}, and put apart by that."
    return f"{said} {late}".strip()


def _puts_back(outcome: Outcome) -> bool:
    """Return whether bodies that are found in each other go back to where the step began."""
    pair = any(m["second"] >= 0 for m in outcome.met)
    return outcome.trial.rule.get("pair_place" if pair else "wall_place") in UNDONE


def _of_value(scene: Scene, outcomes: Sequence[Outcome]) -> str:
    """Return the sentence of a fault with one value, and the restitution that it amounts to.

    That an impulse is divided by the diameter can be known if all balls have one radius.
    """
    value = float(np.median([outcome.trial.value for outcome in outcomes]))
    fault, radius = BY_NAME[outcomes[0].trial.fault], float(scene.bodies.radius[0])
    said = fault.sentence(value, scene.units)
    if fault.name != "impulse" or radius == 1 or abs(value * radius - 1) >= ALIKE**2 or np.ptp(scene.bodies.radius):
        return f"{said} {in_common(scene, outcomes)}".strip()
    diameter = scene.units.text(Dimension.LENGTH, "{:g}", 2 * radius)
    return f"{said} It is divided by the diameter, {diameter}: a restitution of {2 / radius - 1:.4g}."


def _late(scene: Scene, outcome: Outcome) -> str:
    """Say how late a contact was found by a rule of steps."""
    deepest = max(outcome.met, key=lambda m: m["depth"])
    return of_depth(scene, float(deepest["depth"]), float(deepest["late"]), again=outcome.trial.gives_impulses)


def of_depth(scene: Scene, depth: float, late: float, *, again: bool = True) -> str:
    """Say how late a contact was found, px and s: only how deep if that is more than a step, as it was pushed since."""
    deep = f"{scene.units.text(Dimension.LENGTH, '{:.3g}', depth)} deep"
    if math.isinf(late):
        return f"The two were already parting, {deep}{', and were resolved again' * again}."
    return f"Found {1e3 * late:.3g} ms late, {deep}." if _is_within_a_step(scene, late) else f"Found {deep}."


def _is_within_a_step(scene: Scene, seconds: float) -> bool:
    return seconds * scene.rate <= 1 + NEGLIGIBLE


def of_push(scene: Scene, part: Part, cause: Cause) -> str:
    """Say how far two bodies are pushed apart."""
    pushed, overlap = (scene.units.text(Dimension.LENGTH, "{:.3g}", size) for size in (part.pushed, part.overlap))
    if cause == Cause.OVERSHOOT:
        return f"The ball was put back on the wall, which discards {pushed} of its way."
    return f"Pushed apart by {pushed}, of an overlap of {overlap}."


def of_impulses(scene: Scene, part: Part, cause: Cause) -> str:
    """Say what is wrong with the impulses of contacts that are solved together."""
    two = _named(part.first, part.second)
    if cause == Cause.WARM_START:
        return f"The contact of {two} pulls them together."
    speed = scene.units.text(Dimension.VELOCITY, "{:.3g}", abs(part.after))
    return f"The solver has not converged: {two} {'still approach' if part.after > 0 else 'part'} at {speed}."


def _named(first: int, second: int) -> str:
    return f"balls {first} and {second}" if second >= 0 else f"ball {first} and a wall"


def _soft(scene: Scene, outcome: Outcome) -> str:
    """Say when a soft contact was found."""
    met = max(outcome.met, key=lambda m: m["depth"])
    distance = scene.units.text(Dimension.LENGTH, "{:.3g}", abs(float(met["depth"])))
    ms, apart = 1e3 * abs(float(met["time"])), f"{distance} {'deep' if met['depth'] > 0 else 'apart'}"
    if not outcome.met["impulse"].any():
        return "The contact is missed, and the ball stopped where it touches."
    if met["closing"] <= 0:
        return f"The contact is soft: it still pushes the two, which part, {apart}."
    if math.isinf(ms):
        return f"Resolved {apart}, though the two would not have touched."
    in_time = f"{ms:.3g} ms {'late' if met['depth'] > 0 else 'early'}, " if _is_within_a_step(scene, ms / 1e3) else ""
    when = f"Found {in_time}{apart}."
    several = sum(outcome.met["impulse"] > 0)
    if several < 2:
        return when
    in_turn = f"{several} contacts are solved in turn, a few times each."
    return f"{when} {in_turn}" if ms >= SHORT else in_turn


def summed(scene: Scene, outcomes: Sequence[Outcome]) -> str:
    """Return the sentence of a model with many values of its parameter."""
    values = np.array([outcome.trial.value for outcome in outcomes])
    if np.ptp(values) <= ALIKE * np.abs(values).max():
        return _of_value(scene, outcomes)
    said = BY_NAME[outcomes[0].trial.fault].sentence_of_many(values, scene.units)
    return f"{said} {in_common(scene, outcomes)}".strip()


def found_range(scene: Scene, cause: Cause, depths: Sequence[float]) -> str:
    """Return how deep contacts were found that are found late, or how far apart those found early, px."""
    low, high, median = scene.units.scaled(Dimension.LENGTH, min(depths), max(depths), float(np.median(depths)))
    when, how = ("early", "apart") if cause == Cause.EARLY else ("late", "deep")
    found = f"{high:.3g} {scene.units.length} {how}"
    if high - low > ALIKE * abs(high):
        found = f"{low:.3g} to {found}, {median:.3g} at the median"
    put_back = ", and balls put back, which discards some of their way" * (cause == Cause.OVERSHOOT)
    return f"Contacts are found {when}, {found}{put_back}."


def of_changes(scene: Scene, cause: Cause, first: str, sizes: Sequence[float]) -> str:
    """Return the sentence on the first of many changes without a contact, with the range of all that are not 0.

    sizes: of the mean change in each step, px/s, or px where balls are put elsewhere.
    """
    changes = [size for size in sizes if size > 0]
    if len(changes) < 2:
        return first
    dimension = Dimension.VELOCITY if cause == Cause.UNREPORTED else Dimension.LENGTH
    low, high = scene.units.scaled(dimension, min(changes), max(changes))
    some = f"{low:.3g} to {high:.3g}" if high - low > ALIKE * high else f"{high:.3g}"
    return f"{first[:-1]}; such changes are of {some} {scene.units.name(dimension)}."


def of_missed(scene: Scene, contact: tuple[int, int], way: Floats, overlap_time: float, *, is_through: bool) -> str:
    """Return how two bodies passed each other without a contact.

    way: (k, 2) px, of the balls in the step; overlap_time: s, for which two balls overlap on straight ways; is_through:
    whether they are apart after the step.
    """
    flown, wall = scene.units.text(Dimension.LENGTH, "{:.3g}", float(length(way).max())), ~contact[1]
    if wall < 0:
        if is_through:
            return (
                f"The two overlapped for {1e3 * overlap_time:.3g} ms, all within a step, in which one flew {flown}, "
                "without a contact."
            )
        return "The two passed into each other without a contact."
    if not is_through:
        return f"The ball flew into {scene.wall_name(wall)} without a contact."
    start, to, thickness = scene.wall_line(wall)
    ends = scene.units.scaled(Dimension.LENGTH, *start, *to)
    what, where = "wall", "between ({:g}, {:g}) and ({:g}, {:g})".format(*ends)
    if start == to:
        what, where = "peg", "at ({:g}, {:g})".format(*ends)
    thick = f"the {what} is {scene.units.text(Dimension.LENGTH, '{:g}', thickness)} thick"
    return f"The ball went through the {what} {where}: it flew {flown} in the step, and {thick}."


def of_turn(late: str, normal: Vector | None, should: Vector | None) -> str:
    """Return a sentence on a contact found late, with the angle between its normal and the one at first touch."""
    if normal is None or should is None:
        return late
    turned = abs(
        math.atan2(normal[0] * should[1] - normal[1] * should[0], normal[0] * should[0] + normal[1] * should[1])
    )
    if turned <= NEGLIGIBLE:
        return late
    degrees = float(f"{math.degrees(turned):.2g}")  # two digits, of which `g` alone makes 1e+02
    return f"{late[:-1]}, so the normal is turned by {degrees:g}°."
