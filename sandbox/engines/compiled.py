"""How numba compiles the kernels of an event loop.

Never fastmath: every operation rounds as IEEE 754 says. Division by zero is infinity, not an exception, and arrays are
not reference-counted (`_nrt`): both would be paid for at every access, and half of the loop's time went there. So a
kernel cannot make an array.

`kernel` is compiled into those that call it; `entry` is what Python calls, and what numba keeps on disk. That cache
looks at the entry's own file alone: after an edit to a kernel of another file, delete the cache (in `__pycache__`, or
where NUMBA_CACHE_DIR says).
"""

from collections.abc import Callable
from typing import Any, Final, cast

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]
from numba import njit, types
from numba.extending import intrinsic
from numpy.typing import NDArray

_HOW: Final[dict[str, Any]] = {"error_model": "numpy", "_nrt": False}

kernel: Final = njit(**_HOW)
entry: Final = njit(cache=True, **_HOW)

Record = Any  # one element of a structured array: in a kernel, its fields are attributes, and setting them writes it


@intrinsic
def _prefetch(typing: Any, array: Any, index: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        element = builder.gep(context.make_array(array)(context, builder, args[0]).data, [args[1]])
        byte, number = ir.IntType(8).as_pointer(), ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), [byte, number, number, number])
        fetch = builder.module.declare_intrinsic("llvm.prefetch.p0", (), kind)
        to_read, and_keep, data = number(0), number(3), number(1)
        builder.call(fetch, [builder.bitcast(element, byte), to_read, and_keep, data])
        return context.get_dummy_value()

    return types.void(array, types.intp), generate


# Ask for an element of an array before it is needed, and go on while it is fetched from memory.
prefetch: Final = cast("Callable[[NDArray[Any], int | np.int64], None]", _prefetch)
