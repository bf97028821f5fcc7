"""The motion of both bodies before and after contacts, in words, as a law of impacts has it."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from sandbox.analysis.difference import contact_name
from sandbox.analysis.figures import Run
from sandbox.report.numbers import rounded
from sandbox.scene.model import Scene
from sandbox.scene.units import Dimension
from sandbox.state import Floats

SHOWN: Final = {
    "velocity": Dimension.VELOCITY,
    "momentum": Dimension.MOMENTUM,
    "energy": Dimension.ENERGY,
}  # after the mass


def first_contacts(scene: Scene, run: Run, most: int) -> Iterator[tuple[str, list[list[str]]]]:
    """Yield the first contacts of an engine, at most `most`, of those whose motion is kept.

    Each is its time and its bodies in words, and a table: its labels, then rows for each body, and for both together.
    """
    labels = ["", "kg", *(f"{name}, {scene.units.name(dimension)}" for name, dimension in SHOWN.items())]
    for impact, contact in zip(run.impacts[:most], run.contacts, strict=False):
        bodies = int(contact["first"]), int(contact["second"])
        balls = [number for number in bodies if number >= 0]
        motion = np.stack([impact["before"], impact["after"]], axis=1)[: len(balls)]  # (balls, 2, 3): before and after
        yield f"{contact['time']:.3f} s, {contact_name(scene, *bodies)}", [labels, *_rows(scene, balls, motion)]


def _rows(scene: Scene, balls: list[int], motion: Floats) -> Iterator[list[str]]:
    mass, moment = scene.bodies.mass[balls, None], scene.bodies.moment[balls, None]
    energy = (mass * (motion[..., :2] ** 2).sum(axis=2) + moment * motion[..., 2] ** 2) / 2
    quantities = motion[..., :2], mass[..., None] * motion[..., :2], energy
    factors = map(scene.units.factor, SHOWN.values())
    velocity, momentum, energy = (factor * values for factor, values in zip(factors, quantities, strict=True))
    for row, number in enumerate(balls):
        for after, label in enumerate((f"ball {number}, before", "  after")):
            kilograms = "" if after else f"{mass[row, 0]:g}"
            numbers = _vector(velocity[row, after]), _vector(momentum[row, after]), rounded(energy[row, after])
            yield [label, kilograms, *numbers]
    if len(balls) > 1:
        for after, label in enumerate(("together, before", "  after")):
            yield [label, "", "", _vector(momentum[:, after].sum(axis=0)), rounded(energy[:, after].sum())]


def _vector(vector: Floats) -> str:
    return f"({', '.join(map(rounded, vector))})"
