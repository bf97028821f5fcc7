"""The virial series of hard discs."""

from typing import Final

import numpy as np

# B_k / B_2^(k-1) of hard discs, k from 1 to 10: N. Clisby and B. M. McCoy, J. Stat. Phys. 122 (2006) 15, table 1.
# B_3 and B_4 are known in closed form: 4/3 - √3/π and 2 - 9√3/(2π) + 10/π².
VIRIAL_COEFFICIENTS: Final = (
    1.0, 1.0, 0.78200444, 0.53223180, 0.33355604, 0.1988425, 0.1148728, 0.0649930, 0.0362193, 0.0199537,
)  # fmt: skip


def virial_series(eta: float) -> float:
    """Return Z from the first ten terms in ρ B_2 = 2η: closer than Henderson's up to η = 0.4, 0.6 % low at 0.5."""
    return float(np.polynomial.polynomial.polyval(2 * eta, VIRIAL_COEFFICIENTS))
