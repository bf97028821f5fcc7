"""The judge's thresholds, each with its derivation. Formulas are exact, so most are about rounding.

What concerns one formula or one search alone stands there: factors for rounding that adds up, limits of effort, and
the numbers that a candidate takes to fit.
"""

from typing import Final

SINGLE: Final = 5e-7  # of a length: what float32 leaves after a step, 6e-8 in each of four operations, and some room
DOUBLE: Final = 1e-9  # of a length: what float64 leaves after a step, 2e-16, times 1e6 at a grazing contact
NEGLIGIBLE: Final = 1e-6  # of an impulse, a speed or a radius: above all rounding, and below every digit that is shown
ALIKE: Final = 1e-3  # of a value: sentences have three digits, so that values that differ by less read the same
REST: Final = 1.2  # times what gravity does in a step, which a ball at rest may move: once, and room for a slope
FEW: Final = 3  # flights, contacts or steps in a row that agree show a rule: a right engine may need two for a contact
DOUBTED: Final = 0.1  # of single contacts are early or unexplained: then the faults of the others may be chance
REFUTED: Final = 0.01  # of single contacts, that a wrong law explains at least: it acts in every contact of its kind
MAX_TOGETHER: Final = 24  # contacts of an island that is judged: more are a heap, where the order decides
