"""What changes the energy of a Space, and the account in which it is entered."""

from enum import StrEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray


class Cause(StrEnum):
    """What changes the energy of a Space."""

    RESTITUTION = "restitution"  # normal impulses, with the restitution that the contact should have
    RESTITUTION_ERROR = "restitution_error"  # a contact ended with another normal velocity than that
    SUPPORT = "support"  # contacts and joints against what gravity, forces and damping did in the same step
    FRICTION = "friction"
    SURFACE = "surface"  # surface velocities
    JOINTS = "joints"  # all but motors and springs
    MOTORS = "motors"
    SPRINGS = "springs"  # springs with a force function of the program
    SPRING_DAMPING = "spring_damping"
    SPRING_INTEGRATION = "spring_integration"  # work of springs, less what they stored
    KINEMATIC = "kinematic"  # bodies of infinite mass that move
    DAMPING = "damping"  # Space.damping
    FORCES = "forces"  # Body.force and Body.torque
    INTEGRATION = "integration"  # work of gravity, less the potential energy of the way with the step's first velocity
    CORRECTION = "correction"  # overlapping bodies moved apart, against gravity
    POSITION_FUNCTIONS = "position_functions"
    VELOCITY_FUNCTIONS = "velocity_functions"
    CALLBACKS = "callbacks"  # changed within the step by nothing that was recorded: handlers, and what they removed
    VELOCITY_SET = "velocity_set"  # by the program, between steps
    POSITION_SET = "position_set"
    MASS_SET = "mass_set"
    GRAVITY_SET = "gravity_set"
    SPRINGS_SET = "springs_set"  # added, removed, changed, or moved with their bodies; asleep
    ADDED = "added"  # bodies
    REMOVED = "removed"


NUMBER: Final = {cause: number for number, cause in enumerate(Cause)}


class Account:
    """Adds to the line of a cause."""

    def __init__(self, work: NDArray[np.float64]) -> None:
        self._work = work

    def __call__(self, cause: Cause, value: float) -> None:
        """Add a change of energy, kg px²/s²."""
        self._work[NUMBER[cause]] += value
