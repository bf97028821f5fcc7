"""The contacts of each engine with the motion of their balls before and after, for the page's table."""

import base64
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sandbox.analysis.comparison import Comparison
from sandbox.analysis.figures import Run
from sandbox.scene.units import Dimension


def impacts(comparison: Comparison, most: int) -> dict[str, Any]:
    """Return what the table needs: the balls' masses and moments of inertia, units, walls' names, engines' contacts.

    units: the name of each and what a value in px becomes the shown one by.
    """
    scene = comparison.scene
    return {
        "mass": scene.bodies.mass.tolist(),
        "units": {each.name: (scene.units.name(each), scene.units.factor(each)) for each in Dimension},
        "moment": scene.bodies.moment.tolist(),
        "walls": [scene.wall_name(number) for number in range(scene.wall_numbers.stop)],
        "engines": {name: _of_run(run, most) for name, run in comparison.runs.items() if len(run.impacts)},
    }


def _of_run(run: Run, most: int) -> dict[str, Any]:
    """Return the first contacts of an engine.

    contacts: (k, 3), time (s) and the numbers of the bodies; motion: (k, 2, 2, 3), of both bodies before and after,
    velocity (px/s) and spin (rad/s). A wall's are zeros.
    """
    impacts = run.impacts[:most]
    contacts = run.contacts[: len(impacts)]
    numbers = np.column_stack([contacts["time"], contacts["first"], contacts["second"]])
    motion = np.stack([impacts["before"], impacts["after"]], axis=2)
    return {"all": len(run.contacts), "contacts": packed(numbers.astype("<f8")), "motion": packed(motion.astype("<f4"))}


def packed(values: NDArray[Any]) -> str:
    """Return an array's bytes in base64."""
    return base64.b64encode(values.tobytes()).decode()
