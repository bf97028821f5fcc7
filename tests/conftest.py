"""What the tests share."""

import os
import shutil
import sys
from collections.abc import Callable
from importlib.metadata import version
from typing import Final

import kernel_cache

os.environ["NUMBA_CACHE_DIR"] = str(kernel_cache.folder())  # before numba is imported; processes of tests inherit it

import pytest
from hypothesis import settings

from sandbox.cli import commands as cli
from sandbox.scene.files import parse
from sandbox.scene.model import Scene

settings.register_profile("thorough", max_examples=10_000)  # pytest --hypothesis-profile=thorough

NO_KEY: Final = f"is not a key of sandbox {version('pymunk-sandbox')} (perhaps of a newer one)"
REQUIRED = os.environ.get("SANDBOX_NO_SKIPS") == "1"  # set by .ci/run: what is missing there is a failure


def need(*programs: str) -> None:
    """Skip a test that needs programs which are not on this machine; fail where nothing may be skipped."""
    missing = [program for program in programs if shutil.which(program) is None]
    if missing and REQUIRED:
        pytest.fail(f"not installed: {', '.join(missing)}")
    if missing:
        pytest.skip(f"needs {', '.join(missing)}")


def scene_of(*balls: str, size: str = "[800, 600]", more: str = "") -> Scene:
    """Make a scene of ball groups, each the lines of its table."""
    groups = "\n".join(f"[[balls]]\n{group}" for group in balls)
    return parse(f"{more}\n[arena]\nsize = {size}\n{groups}\n", "test.toml")


Command = Callable[..., tuple[int, str, str]]


@pytest.fixture
def command(monkeypatch: pytest.MonkeyPatch, capfdbinary: pytest.CaptureFixture[bytes]) -> Command:
    """Run the command line as a shell without a display would: exit code, and both outputs, which are UTF-8."""
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setenv("PYTHONSAFEPATH", "")  # is set by the command line, and taken back after the test

    def run(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["sandbox", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        out, err = capfdbinary.readouterr()
        return int(ended.value.code or 0), out.decode(), said(err.decode())

    return run


def said(stderr: str) -> str:
    """Return what a command said on standard error, but for numba's first time on a machine."""
    return stderr.replace("Compiling the engines; this happens once.\n", "")
