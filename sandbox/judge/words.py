"""The sentence of each cause, formatted in one place from its numbers."""

from functools import cache
from typing import Final

import numpy as np

from sandbox.judge.causes import Cause
from sandbox.judge.choose import UNTOUCHED
from sandbox.judge.flight import FlightLaw
from sandbox.judge.laws import BY_NAME, PLACES
from sandbox.judge.ledger import Errors
from sandbox.judge.thresholds import ALIKE
from sandbox.scene.model import Scene
from sandbox.scene.units import Dimension, Units
from sandbox.state import Floats

OF_STEPS: Final = {  # what no law of contacts is the cause of; {v} is how fast or how far a ball flies
    "passed": "Two balls met within the step without a contact; one flew {v} in it.",
    "through": "A ball went through a wall without a contact: it flew {v} in the step.",
    "several": "Several contacts at once, which are not judged.",
    "stopped": "A ball's velocity becomes 0 without a contact.",
    "changed": "A ball's velocity changes without a contact; it then moves at {v}.",
    "put": "Balls are put elsewhere without a contact.",
    "apart": "Bodies that overlap are pushed apart.",
    "approach": "The solver has not converged: bodies still approach, or part too slowly or too fast.",
    "pulls": "An impulse of an earlier step pulls bodies together.",
    "single": "What the step did fits no single error.",
    "overlap": "Bodies overlap when the run begins: no step led them into each other.",
}
FLIGHTS: Final = {
    "damping": "Damping leaves {0:.4g} % of the velocities each second.",
    "multiplied": "Every step multiplies velocities by {0:.6g} ({1:.4g} a second), without a contact.",
    "share of gravity": "Balls in flight fall with {2:.5g} times the scene's gravity.",
    "clock": "Each step flies for {0:.6g} of its length.",
}


def of_flight(units: Units, law: FlightLaw, kept: float) -> str:
    """Return the sentence of how an engine flies; without a cause, of the share of spin that it keeps."""
    if law.cause is None:
        return f"Every step multiplies spins by {kept:.6g}, without a contact."
    if law.name.startswith("drag by"):
        return f"Each second of flight takes {law.values[0]:.4g}{law.name[len('drag by') :]} px/s off a ball's speed."
    if law.name == "pull":
        acceleration = units.text(Dimension.ACCELERATION, "({:.6g}, {:.6g})", *law.values[:2])
        return f"Balls in flight accelerate by {acceleration}."
    if law.name.startswith("gravity"):
        when, where = ("after", "beyond") if law.name == "gravity after" else ("before", "short of")
        off = units.text(Dimension.LENGTH, "{:.3g}", law.values[0])
        pulled = f"Balls in flight move at the velocity {when} gravity's pull"
        return f"{pulled}, and end each step {off} {where} the parabola."
    return FLIGHTS[law.name].format(*law.values)


@cache
def said_by(cause: int, law: str, place: str) -> tuple[int, str, str]:
    """Return the cause, law and place by which errors are grouped. A wrong law is named without a place."""
    if cause == Cause.UNKNOWN:
        return cause, law if law in OF_STEPS else "single", ""
    is_timed, is_pushed = cause in (Cause.LATE, Cause.EARLY), cause == Cause.POSITION_CORRECTION
    law = "" if is_timed or (is_pushed and law == UNTOUCHED) else law
    is_alone = is_timed or (is_pushed and place == "pushed") or law in BY_NAME
    return cause, law, "" if is_alone else place


def of_errors(scene: Scene, errors: Errors, flights: dict[str, str]) -> str:
    """Return what is wrong with errors of one cause, law and place. flights: sentences of how the engine flies."""
    cause, law, place = said_by(*(errors[name][0].item() for name in ("cause", "law", "place")))
    also = str(errors["also"][0]) if (errors["also"] == errors["also"][0]).all() else ""
    if place == "flight":
        return flights[law]
    values = errors["value"][np.isfinite(errors["value"])]
    if cause == Cause.UNKNOWN:
        return OF_STEPS[law]
    said = _of_law(scene, law, values)
    if also and also != law and said:
        either = _of_law(scene, also, values)
        said = f"{said[:-1]}; or: {either[:1].lower()}{either[1:]}"
    depths = np.abs(errors["depth"][np.isfinite(errors["depth"])])
    if cause in (Cause.LATE, Cause.EARLY, Cause.OVERSHOOT) and len(depths):
        said = f"{_found(scene.units, Cause(cause), depths)} {said}".strip()
    where = PLACES[place].sentence if place in PLACES else ""
    if cause == Cause.POSITION_CORRECTION and not place:
        return OF_STEPS["apart"]
    return " ".join(filter(None, (said, where))) or OF_STEPS["single"]


def _of_law(scene: Scene, law: str, values: Floats) -> str:
    value = float(np.median(values)) if len(values) else np.nan
    if law in OF_STEPS:
        dimension = Dimension.VELOCITY if law == "changed" else Dimension.LENGTH
        most = scene.units.text(dimension, "{:.4g}", float(values.max(initial=0)))
        return OF_STEPS[law].format(v=f"up to {most}" if len(values) > 1 and np.ptp(values) > ALIKE * value else most)
    if law not in BY_NAME:
        return ""
    said = BY_NAME[law].sentence.format(v=value, d=abs(np.degrees(value)))
    if law == "impulse" and (diameter := _diameter(scene, value)):
        return f"{said[:-1]} (divided by the diameter, {diameter}, not by the inverse masses)."
    if len(values) > 1 and np.ptp(values) > ALIKE * abs(value) and "{" in BY_NAME[law].sentence:
        shown = np.degrees(values) if "{d" in BY_NAME[law].sentence else values
        return f"{said[:-1]} (the median; {shown.min():.3g} to {shown.max():.3g} in all)."
    return said


def _diameter(scene: Scene, value: float) -> str:
    """Return the diameter that an impulse is divided by, which can be known if all balls have one radius."""
    radius = float(scene.bodies.radius[0])
    if np.ptp(scene.bodies.radius) or radius == 1 or abs(value * radius - 1) > ALIKE**2:
        return ""
    return scene.units.text(Dimension.LENGTH, "{:g}", 2 * radius)


def _found(units: Units, cause: Cause, depths: Floats) -> str:
    """Say how deep contacts are found, or how far apart."""
    when, how = ("early", " apart") if cause == Cause.EARLY else ("late", "")
    low, high = units.scaled(Dimension.LENGTH, float(depths.min()), float(depths.max()))
    far = units.text(Dimension.LENGTH, "{:.3g}", float(depths.max()))
    spread = "up to " if high - low > ALIKE * high else ""
    return f"Found {when}, by {spread}{far}{how}."
