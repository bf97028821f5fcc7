"""Signals while kernels are compiled."""

import signal
from pathlib import Path
from typing import NoReturn

import numba
import pytest
from numba.core import event

from sandbox.compiled import entry


class Interrupted(Exception):
    """Raised by a signal handler."""


class _Passes(event.Listener):
    """Counts the passes of the compiler, and sends a signal in the first."""

    count = 0

    def on_start(self, _: object) -> None:
        self.count += 1
        if self.count == 1:
            signal.raise_signal(signal.SIGTERM)

    def on_end(self, _: object) -> None:
        pass


def test_a_signal_waits_until_a_kernel_is_compiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    passes, handled = _Passes(), list[int]()

    def handle(*_: object) -> NoReturn:
        handled.append(passes.count)
        raise Interrupted

    add = entry(lambda a, b: a + b)
    before = signal.signal(signal.SIGTERM, handle)
    try:
        with event.install_listener("numba:run_pass", passes), pytest.raises(Interrupted):
            add(1, 2)
    finally:
        signal.signal(signal.SIGTERM, before)
    assert handled == [passes.count]
    assert passes.count > 10
    assert add(1, 2) == 3
