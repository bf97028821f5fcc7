"""How numba compiles the kernels of an event loop.

Never fastmath: every operation rounds as IEEE 754 says. Division by zero is infinity, not an exception, and arrays are
not reference-counted (`_nrt`): both would be paid for at every access, and twice the time of the whole loop went there.
So a kernel cannot make an array.

`kernel` is compiled into those that call it, `entry` is what Python calls and what numba keeps on disk. That cache looks
at the entry's own file alone: after an edit to a kernel of another file, delete it (`__pycache__`, or NUMBA_CACHE_DIR).
"""

from typing import Any, Final

from numba import njit

kernel: Final = njit(error_model="numpy", _nrt=False)
entry: Final = njit(cache=True, error_model="numpy", _nrt=False)

Record = Any  # one element of a structured array: in a kernel, its fields are attributes, and writing them writes it
