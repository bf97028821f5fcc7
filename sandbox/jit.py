"""How numba compiles kernels: see `sandbox.compiled`, whose functions call these.

Never fastmath: every operation rounds as IEEE 754 prescribes. Division by zero yields infinity instead of raising, and
arrays are not reference-counted (`_nrt`), because both cost time at every access, together half of the event loop's,
and time to compile. Without reference counts, a kernel cannot make an array: Python passes all that it needs.
"""

from collections.abc import Callable
from typing import Any, Final

from llvmlite import ir  # type: ignore[import-untyped]
from numba import _dynfunc, njit, types  # type: ignore[attr-defined]
from numba.core.caching import FunctionCache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.typed_passes import NativeLowering
from numba.extending import intrinsic, overload, register_jitable

_OPTIONS: Final[Any] = {"error_model": "numpy", "_nrt": False}
_OF_ENTRY: Final[Any] = {**_OPTIONS, "nogil": True}  # so that a thread can run a kernel while others go on in Python
Function = Callable[..., Any]  # numba ships no types


class _InlinedCode(JITCodeLibrary):
    """The code of a kernel that is a part of others: optimized, and made machine code, only there.

    Numba would do both for each kernel that one calls, and again for the caller, which takes most of the time.
    """

    def _optimize_final_module(self) -> None:
        """Do nothing."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()  # type: ignore[no-untyped-call]
        self._finalized = True


@register_pass(mutates_CFG=True, analysis_only=False)  # type: ignore[no-untyped-call]
class _InlinedLowering(NativeLowering):
    """Makes LLVM's code of a kernel that is a part of others, and a function without machine code as its key."""

    _name = "inlined_lowering"

    def run_pass(self, state: Any) -> bool:
        code = _InlinedCode(state.targetctx.codegen(), state.func_id.func_qualname)  # type: ignore[no-untyped-call]
        state.library, state.flags.no_compile = code, True
        super().run_pass(state)  # type: ignore[no-untyped-call]
        kernel, environment = state.cr.fndesc, state.cr.env
        stub = _dynfunc.make_function(kernel.lookup_module(), kernel.qualname, "", 0, environment, (code,))
        state.targetctx.insert_user_function(stub, kernel, [code])
        state.cr = state.cr._replace(cfunc=stub)
        return True


class _InlinedCompiler(CompilerBase):
    """Compiles a kernel that is a part of others."""

    def define_pipelines(self) -> list[PassManager]:
        manager = DefaultPassBuilder.define_nopython_pipeline(self.state)  # type: ignore[no-untyped-call]
        replaced = {NativeLowering: _InlinedLowering}
        manager.passes = [(replaced.get(step, step), about) for step, about in manager.passes]
        manager.finalize()
        return [manager]


_INLINED: Final[Any] = {**_OPTIONS, "forceinline": True, "pipeline_class": _InlinedCompiler}


class _Cache(FunctionCache):
    """Numba's cache of one function. wait_for: called with the module of a kernel that is not in it.

    Numba's own initialises the compiler before it loads machine code, which takes 0.3 s and is not needed.
    """

    def __init__(self, function: Function, wait_for: Callable[[str], object]) -> None:
        super().__init__(function)  # type: ignore[no-untyped-call]
        self._wait_for = wait_for

    def load_overload(self, signature: object, context: object) -> object:
        code = self._load(signature, context)
        if code is None:
            self._wait_for(self._py_func.__module__)
            code = self._load(signature, context)
        return code

    def _load(self, signature: object, context: object) -> object:
        with self._guard_against_spurious_io_errors():
            try:
                return self._load_overload(signature, context)  # type: ignore[no-untyped-call]
            except (ImportError, AttributeError):  # written by another version, of other modules
                self.flush()  # type: ignore[no-untyped-call]
        return None


def dispatcher(function: Function, wait_for: Callable[[str], object]) -> Any:
    """Return a kernel, which is compiled or loaded from the cache at its first call. wait_for: of `_Cache`."""
    compiled = njit(**_OF_ENTRY)(function)
    compiled._cache = _Cache(function, wait_for)
    return compiled


def inline(function: Function) -> None:
    """Let kernels call a function, which becomes a part of them."""
    register_jitable(**_INLINED)(function)


@intrinsic
def _prefetch(typing: Any, array: Any, index: Any) -> Any:
    """Start to fetch an element of an array from memory, without waiting, by LLVM's intrinsic, which numba lacks."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        element = builder.gep(context.make_array(array)(context, builder, args[0]).data, [args[1]])
        byte, number = ir.IntType(8).as_pointer(), ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), [byte, number, number, number])
        fetch = builder.module.declare_intrinsic("llvm.prefetch.p0", (), kind)
        to_read, and_keep, data = number(0), number(3), number(1)
        builder.call(fetch, [builder.bitcast(element, byte), to_read, and_keep, data])
        return context.get_dummy_value()

    return types.void(array, types.intp), generate


_fetch: Final[Any] = _prefetch


def compile_as_prefetch(function: Function) -> None:
    """Let kernels call a function of an array and an index, which starts to fetch the element from memory."""
    overload(function, jit_options=_INLINED)(lambda array, index: lambda array, index: _fetch(array, index))  # noqa: PLW0108
