"""What changes the energy of a Space."""

from enum import StrEnum
from typing import Final, Self

STEPS: Final = "gravity and what bears it, in steps instead of at every moment"


class Cause(StrEnum):
    """What changes the energy of a Space: its name in JSON, and its words, which others may share."""

    words: str

    def __new__(cls, name: str, words: str) -> Self:
        """Name a cause."""
        cause = str.__new__(cls, name)
        cause._value_, cause.words = name, words
        return cause

    # Normal impulses, with the restitution that the contact should have:
    RESTITUTION = "restitution", "bounces, as elasticities say"
    # A contact ended with another normal velocity than that:
    RESTITUTION_ERROR = "restitution_error", "bounces, other than elasticities say"
    SUPPORT = "support", STEPS  # contacts and joints against what gravity, forces and damping did in the same step
    FRICTION = "friction", "friction"
    SURFACE = "surface", "surface velocities"
    JOINTS = "joints", "joints"  # all but motors and springs
    MOTORS = "motors", "motors"
    SPRINGS = "springs", "springs with a law of the program"
    SPRING_DAMPING = "spring_damping", "dampers of springs"
    # Work of springs, less what they stored:
    SPRING_INTEGRATION = "spring_integration", "springs, in steps instead of at every moment"
    KINEMATIC = "kinematic", "kinematic bodies that push"  # bodies of infinite mass that move
    DAMPING = "damping", "the Space's damping"
    FORCES = "forces", "forces and torques"  # Body.force and Body.torque
    # Work of gravity, less the potential energy of the way with the step's first velocity:
    INTEGRATION = "integration", STEPS
    CORRECTION = "correction", "bodies moved apart that overlapped"  # overlapping bodies moved apart, against gravity
    POSITION_FUNCTIONS = "position_functions", "position functions"
    VELOCITY_FUNCTIONS = "velocity_functions", "velocity functions"
    # Changed within the step by nothing that was recorded: handlers, and what they removed:
    CALLBACKS = "callbacks", "handlers and callbacks"
    VELOCITY_SET = "velocity_set", "the program: velocities and impulses"  # between steps, as what follows
    POSITION_SET = "position_set", "the program: positions"
    MASS_SET = "mass_set", "the program: masses and moments"
    GRAVITY_SET = "gravity_set", "the program: gravity"
    SPRINGS_SET = "springs_set", "the program: springs"  # added, removed, changed, or moved with their bodies; asleep
    ADDED = "added", "bodies added"
    REMOVED = "removed", "bodies removed"
