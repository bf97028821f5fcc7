"""Which form the kernels of an engine run in: Python, until it is clear that this costs as much as compiling.

Then another process fills the cache, and the engines change over when it is full, each at the end of a step and with
the same bits, so that nothing waits. With a full cache, many balls run as machine code from the start.
"""

import multiprocessing
from collections.abc import Iterable
from functools import partial
from importlib import import_module
from typing import Final

from sandbox.compiled import cache_folder, has_numba
from sandbox.processes import ChildProcess

KERNEL_ENGINES: Final = ("article", "impulse", "exact")


class MachineCode:
    """Decides when the engines of one kind change over from Python to machine code.

    compiling, loading: so much of the engine's work by Python that compiling will be worth it, on another core, and
    that loading from a full cache will be; many: balls that are that much work soon.
    """

    def __init__(self, name: str, compiling: int, loading: int, many: int) -> None:
        self._name, self._compiling, self._loading, self._many = name, compiling, loading, many
        self._work = 0  # of all engines of this kind in this process
        self._process: ChildProcess | None = None
        self._is_cached = False
        _all[name] = self

    def is_due(self, work: int = 0, balls: int = 0) -> bool:
        """Return whether an engine is to run machine code from now on, after more work as Python or for many balls."""
        self._work += work
        if self._work < self._loading and balls < self._many:
            return False
        if self._is_in_cache():
            return True
        may_compile = has_numba() and not multiprocessing.current_process().daemon
        if self._work >= self._compiling and not self._process and may_compile:
            self._process = ChildProcess(_fill_cache, self._name)
        return False

    def compile(self) -> None:
        """Fill the cache here and now, for work that will be worth it."""
        if not has_numba() or self._is_in_cache():
            return
        from sandbox.engines import can_run, create  # noqa: PLC0415  (it imports the engines, and these this module)
        from sandbox.scene.files import load  # noqa: PLC0415
        from sandbox.scene.spawn import spawn  # noqa: PLC0415

        self._is_cached, self._many, many = True, 0, self._many
        for scene in filter(partial(can_run, self._name), map(load, ("head-on", "bouncing"))):
            engine = create(self._name, scene, spawn(scene))
            engine.record_contacts()
            for _ in range(scene.steps):
                engine.step()
            engine.state()
        self._many = many
        marker = cache_folder() / f"{self._name}.complete"
        marker.parent.mkdir(parents=True, exist_ok=True)
        marker.touch()

    def _is_in_cache(self) -> bool:
        if not self._is_cached:
            self._is_cached = has_numba() and (cache_folder() / f"{self._name}.complete").exists()
        return self._is_cached


_all: Final[dict[str, MachineCode]] = {}


def compile_engines(names: Iterable[str]) -> None:
    """Fill the cache for engines, as far as they have kernels, before much work is done."""
    for name in names:
        if name in KERNEL_ENGINES:
            import_module(f"sandbox.engines.{name}")
            _all[name].compile()


def _fill_cache(_: object, name: str) -> None:
    compile_engines([name])
