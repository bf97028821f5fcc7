"""How numba compiles the kernels of an event loop.

Never fastmath: every operation rounds as IEEE 754 says. Division by zero is infinity, not an exception, and arrays are
not reference-counted (`_nrt`): both would be paid for at every access, and twice the time of the whole loop went there.
So a kernel cannot make an array.

`kernel` is compiled into those that call it, `entry` is what Python calls and what numba keeps on disk. That cache looks
at the entry's own file alone: after an edit to a kernel of another file, delete it (`__pycache__`, or NUMBA_CACHE_DIR).
"""

from typing import Any, Final

from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

kernel: Final = njit(error_model="numpy", _nrt=False)
entry: Final = njit(cache=True, error_model="numpy", _nrt=False)

Record = Any  # one element of a structured array: in a kernel, its fields are attributes, and writing them writes it


@intrinsic
def prefetch(typing: Any, array: Any, index: Any) -> Any:
    """Ask for an element of a 1-d array before it is needed, and go on while it is fetched from memory."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        element = builder.gep(context.make_array(array)(context, builder, args[0]).data, [args[1]])
        byte, number = ir.IntType(8).as_pointer(), ir.IntType(32)
        address = builder.bitcast(element, byte)
        kind = ir.FunctionType(ir.VoidType(), [byte, number, number, number])
        fetch = builder.module.declare_intrinsic("llvm.prefetch.p0", (), kind)
        to_read, and_keep, data = number(0), number(3), number(1)
        builder.call(fetch, [address, to_read, and_keep, data])
        return context.get_dummy_value()

    return types.void(array, types.intp), generate
