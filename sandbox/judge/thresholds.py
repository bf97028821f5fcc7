"""Every threshold of the judge, each with its derivation."""

from typing import Final

MAX_EVENTS: Final = 64  # of a few balls in a step, `exact`'s own MIN_STREAK: from there on they may have no end
EVENTS_PER_BALL: Final = 8  # more, for each ball of a group: each meets at most 5 others and 2 walls at once
TIE: Final = 1e-12  # s, between contacts that are simultaneous: a step's rounding, 2e-16 of 1/60 s, a hundred times
DOUBLE: Final = 1e-9  # of a length, what float64 leaves after a step: 2e-16, times 1e6 for a grazing contact
SINGLE: Final = 5e-7  # of a length, what float32 leaves after a step: 6e-8 in each of four operations, and some room
LEFT_OVER: Final = 1e-4  # of an error; a model that leaves more does not explain it: fits converge to the noise
MAX_BALLS: Final = 6  # of a group that is fitted; the models of more are too many to tell apart
MAX_FITS: Final = 300  # of a run, each up to 10 ms; then only models that have explained a step are tried
MAX_FRUITLESS: Final = 6  # fits in a row that explain nothing, or steps unlike the reference's: then none is tried
MAX_VAIN: Final = 60  # searches by all rules in a row, each of 20 ms, that explain nothing: then none is tried
SPRING_STEPS: Final = 3  # in a row, in which a touch pushes two apart: a solver of impulses needs one, or two
ALIKE: Final = 1e-3  # of a value, by which those of several steps may differ to be one: a sentence has three digits
FAR: Final = 0.1  # of a radius, by which a ball is apart from everything that it cannot have touched
NEAR: Final = 1.0  # of the smaller radius, within which two bodies may have been made to touch early
DEEP: Final = 0.5  # of a radius; balls deeper in each other take the reference seconds, of a step of many
PULLS: Final = 0.01  # of a change of velocities that only pulls explain: slow fits of pushes to heaps leave up to 0.002
