"""How numba compiles kernels.

Never fastmath: every operation rounds as IEEE 754 prescribes. Division by zero yields infinity instead of raising, and
arrays are not reference-counted (`_nrt`), because both cost time at every access, together half of the event loop's,
and time to compile. Without reference counts, a kernel cannot make an array: Python passes all that it needs.

`kernel` is compiled into its callers; `entry` is called from Python, and its machine code is cached on disk. The cache
checks the entry's own file only: after an edit to a kernel in another file, delete the cache (in `__pycache__`, or in
NUMBA_CACHE_DIR). The tests do so by themselves.
"""

from collections.abc import Callable
from typing import Any, Final, cast

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]
from numba import njit, types
from numba.extending import intrinsic, register_jitable
from numpy.typing import NDArray

_OPTIONS: Final[dict[str, Any]] = {"error_model": "numpy", "_nrt": False}

_Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]  # numba ships no types

kernel: Final[_Decorator] = register_jitable(**_OPTIONS)
entry: Final[_Decorator] = njit(cache=True, **_OPTIONS)

Record = Any  # an element of a structured array; in a kernel, its fields are attributes, which write to the array


@intrinsic
def _prefetch(typing: Any, array: Any, index: Any) -> Any:
    """Start to fetch an element of an array from memory, without waiting: LLVM's intrinsic, as numba has none.

    With all calls of it in `exact`, `sandbox bench --only exact` has 1.24 times as many collisions per second as with
    none, for 100,000 discs that cover 20 % of the arena (350,000 and 282,000; medians of 9); 1.35 times if they cover
    50 %; for 10,000 discs 1.03 and 0.94 times.
    """

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        element = builder.gep(context.make_array(array)(context, builder, args[0]).data, [args[1]])
        byte, number = ir.IntType(8).as_pointer(), ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), [byte, number, number, number])
        fetch = builder.module.declare_intrinsic("llvm.prefetch.p0", (), kind)
        to_read, and_keep, data = number(0), number(3), number(1)
        builder.call(fetch, [builder.bitcast(element, byte), to_read, and_keep, data])
        return context.get_dummy_value()

    return types.void(array, types.intp), generate


prefetch: Final = cast("Callable[[NDArray[Any], int | np.int64], None]", _prefetch)
