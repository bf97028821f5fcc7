"""Differences and passages, explained in sentences."""

import math
from typing import Final

import numpy as np

from sandbox.analysis.causes import CAUSE, CAUSES, SHARE
from sandbox.analysis.tunnelling import Passage
from sandbox.scene.model import ARENA_WALLS, Scene

_NOT_ITS_OWN: Final = "It is the reference's that is wrong."


_UNCONVERGED: Final = "Several contacts at once: the solver's iterations ended before all were right."


_ON_THE_WAY: Final = {
    "gravity": "Gravity, integrated in steps, brought the balls there at other speeds.",
    "friction": "Friction turned the balls on their way.",
    "untold": "The balls changed on their way, and the engine told of no contact.",
}


def explain(scene: Scene, contact: np.void, row: np.void) -> str:
    """Say in words what is wrong with a contact, by what the ledger says of it."""
    cause = CAUSE[row["cause"]]
    if cause in ("small", "large"):
        return _of_impulse(scene, contact, row)
    if cause in ("late", "early"):
        return _of_time(scene, contact, row)
    return {
        "overshoot": f"It was put back on the wall: {row['moved']:.3g} px of its way back were thrown away.",
        "pushed": f"The two were pushed apart, and are {row['moved']:.3g} px from where they should be.",
        "turned": "It was on its way back from the wall, and was turned round again.",
        "stale": "The solver began with the impulse of an earlier touch, and pulled at balls that part.",
        "unconverged": _UNCONVERGED,
        "gravity": "Gravity pulled for a whole step, though the wall was met within it.",
    }.get(cause, f"{CAUSES[cause].capitalize()}.")


def explain_passage(scene: Scene, passage: Passage) -> str:
    """Say in words what an engine did where it told of no contact."""
    if passage.second >= 0:
        return "The two passed into each other, and the engine told of no contact."
    wall = scene.walls[~passage.second - len(ARENA_WALLS)]
    ends = " to ".join("({:g}, {:g})".format(*end) for end in (wall.start, wall.to))
    return (
        f"The ball went through the wall, from {ends}: it flew {passage.flown:.3g} px in the step, and the wall is "
        f"{wall.thickness:g} px thick."
    )


def _of_impulse(scene: Scene, contact: np.void, row: np.void) -> str:
    """Say how much of an impulse is missing or too much, and which restitution that makes."""
    first, second, bodies = int(contact["first"]), int(contact["second"]), scene.bodies
    approach = float(row["approach"])
    if approach <= 0:
        return f"The two were parting, and had an impulse of {contact['impulse']:.4g} kg px/s."
    share = float(contact["impulse"] / row["due"])
    restitution = round(-float(row["left"]) / approach, 9) + 0.0  # not -0
    amount = f"{_percent(1 - share)} of it is missing" if share < 1 else f"it is {_percent(share - 1)} too large"
    still = ", the balls are still approaching" if restitution < 0 else ""
    if second < 0:
        due = float(row["due"]) / (float(bodies.mass[first]) * approach) - 1
        given = f"gave back {_percent(restitution)} of the speed, where {_percent(due)} is right."
        return f"{scene.wall_name(~second).capitalize()} {given}"
    radius, mass = float(bodies.radius[first]), float(bodies.mass[first])
    alike = radius == bodies.radius[second] and mass == bodies.mass[second]
    if alike and math.isclose(contact["impulse"] * radius, mass * approach, rel_tol=1e-9):
        return (
            f"The impulse was 2 v_n / {2 * radius:g} where 2 equal masses need v_n: {amount}{still}. Divided by the "
            f"diameter, it is a restitution of {restitution:.3g} (2/r - 1)."
        )
    return f"The impulse is wrong: {amount}{still}. It is a restitution of {restitution:.3g}."


def _of_time(scene: Scene, contact: np.void, row: np.void) -> str:
    """Say how late or early a contact was found, and what that does."""
    late, depth = float(row["late"]), float(contact["depth"])
    steps = f", which is more than a step of {1e3 / scene.rate:.3g} ms" if late * scene.rate > 1 + SHARE else ""
    found = f"Found {1e3 * abs(late):.3g} ms {'late' if late > 0 else 'early'}{steps}, "
    found += f"{depth:.2g} px deep" if depth > 0 else f"{-depth:.2g} px before they touch"
    if row["turned"] > SHARE:
        return f"{found}, so the normal is turned by {math.degrees(row['turned']):.2g}°."
    return f"{found}, and {row['moved']:.3g} px from where it should be then."


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %"
