"""A test never runs a kernel that was compiled from other sources."""

import os
from pathlib import Path
from typing import Any, cast

import kernel_cache
import pytest

from sandbox import jit
from sandbox.engines.exact import event_loop

CALLER = "from numba import njit\nfrom sandbox.laws import LIMIT\n"
CALLED = '"""Laws."""\nLIMIT = 1\n'


def digest(package: Path) -> str:
    return kernel_cache.digest(kernel_cache.kernel_sources(package))


@pytest.mark.parametrize(
    ("file", "text", "differs"),
    [
        ("laws.py", CALLED.replace("1", "2"), True),
        ("laws.py", '"""The laws."""\nLIMIT = 1  # px\n', False),
        ("engine.py", CALLER + "LIMIT += 1", True),
        ("window.py", "SIZE = 2", False),
    ],
)
def test_only_code_that_kernels_use_changes_the_digest(tmp_path: Path, file: str, text: str, differs: bool) -> None:
    package = tmp_path / "sandbox"
    package.mkdir()
    for name, source in {"engine.py": CALLER, "laws.py": CALLED, "window.py": "SIZE = 1"}.items():
        (package / name).write_text(source)
    before = digest(package)
    (package / file).write_text(text)
    assert (digest(package) != before) == differs


def test_numba_keeps_kernels_in_the_folder_of_these_sources() -> None:
    folder, function = str(kernel_cache.folder()), cast("Any", event_loop.run).__wrapped__
    assert os.environ["NUMBA_CACHE_DIR"] == folder
    assert jit.dispatcher(function, print).stats.cache_path.startswith(folder)
