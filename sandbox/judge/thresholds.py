"""Every threshold of the judge, each with its derivation. Formulas are exact, so these are about rounding, or work."""

from typing import Final

SINGLE: Final = 5e-7  # of a length, what float32 leaves after a step: 6e-8 in each of four operations, and some room
DOUBLE: Final = 1e-9  # of a length, what float64 leaves after a step: 2e-16, times 1e6 for a grazing contact
TINY: Final = 1e-6  # of a radius, below which two places are one: an overlap that nobody sees, above all rounding
ALIKE: Final = 1e-3  # of a value, by which those of several steps may differ to be one: a sentence has three digits
REST: Final = 1.2  # steps of gravity, up to which a carried ball moves: one, and what rounding and a slope add
SPRING_STEPS: Final = 3  # in a row, in which a touch pushes two apart: a solver of impulses needs one, or two
DOUBTED: Final = 0.1  # of single contacts early or unexplained: then nothing names faults of the others
MAX_TOGETHER: Final = 24  # contacts of an island that is judged: more are a heap, where order decides
MAX_ISLANDS: Final = 1_500  # of a run, the first ones: each takes up to 0.5 ms, so that all take less than a second
REFUTED: Final = 0.01  # of single contacts, that a wrong law explains at least: a law acts in every contact of its kind
