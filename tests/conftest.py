"""Fixtures and helpers that several test modules use."""

import gc
import json
import multiprocessing
import os
import platform
import re
import shutil
import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Protocol

os.environ["NUMBA_CACHE_DIR"] = str(Path(__file__).parents[1] / ".pytest_cache" / "kernels")  # processes inherit it

import hypothesis
import pytest

from sandbox.cli import main
from sandbox.engines.machine_code import KERNEL_ENGINES, compile_engines
from sandbox.errors import SandboxError
from sandbox.scene.files import bundled, parse
from sandbox.scene.model import Scene

if TYPE_CHECKING:
    from browser import Browser

    from sandbox.view.window import Window

NO_KEY: Final = f"is not a key of sandbox {version('pymunk-sandbox')} (perhaps of a newer one)"
# How long an example takes depends on other programs; the examples are the same in each run.
hypothesis.settings.register_profile("tests", deadline=None, derandomize=True)
hypothesis.settings.load_profile("tests")
# Set by .ci/run, where a test fails that lacks a program, or a program or a library of an extra: "programs", "all".
_NO_SKIPS = os.environ.get("SANDBOX_NO_SKIPS", "")
PROGRAMS_REQUIRED, LIBRARIES_REQUIRED = _NO_SKIPS in ("programs", "all"), _NO_SKIPS == "all"


SHARING: Final = (  # files whose tests share comparisons, pages or a window, that take seconds to make
    "tests/engines/test_determinism.py",
    "tests/engines/test_exact_islands.py",
    "tests/report/",
    "tests/slow/test_stress.py",
    "tests/sweeps/test_sweep.py",
    "tests/view/test_desktop.py",
)


COMPILING: Final = pytest.StashKey[Iterator[None]]()


def pytest_configure(config: pytest.Config) -> None:
    """Compile the kernels of new sources once, while the processes that need them collect the tests."""
    starts_workers = getattr(config.option, "numprocesses", None) and not hasattr(config, "workerinput")
    if starts_workers:
        config.stash[COMPILING] = ProcessPoolExecutor().map(compile_engines, zip(KERNEL_ENGINES))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_node_collection_finished(node: Any) -> None:
    list(node.config.stash[COMPILING])  # no test starts before


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Give a process all tests of a file of SHARING, and of others one test after another."""
    from xdist.scheduler import LoadScopeScheduling

    class Scheduling(LoadScopeScheduling):  # type: ignore[misc]  # xdist ships no types
        def _split_scope(self, nodeid: str) -> str:
            return nodeid.partition("::")[0] if nodeid.startswith(SHARING) else nodeid

    return Scheduling(config, log)


def sizes(normal: int, *, slow: int) -> list[Any]:
    """Return two sizes of one test to parametrize it with: the slow one runs only with `pytest -m slow`."""
    return [normal, pytest.param(slow, marks=pytest.mark.slow)]


def sample(values: Iterable[Any], every: int) -> list[Any]:
    """Return values to parametrize a test with, one in so many by default; the others are marked as wide."""
    return [pytest.param(value, marks=pytest.mark.wide if k % every else ()) for k, value in enumerate(values)]


def bundled_scenes() -> list[Any]:
    """Return the names of the bundled scenes to parametrize a test with: by default four with few balls."""
    few = ("article", "billiards", "marble-run", "newtons-cradle")
    return [pytest.param(name, marks=() if name in few else pytest.mark.wide) for name in bundled()]


def require(*programs: str) -> None:
    """Skip a test if programs are not installed; fail it where nothing may be skipped."""
    missing = [program for program in programs if shutil.which(program) is None]
    if missing and PROGRAMS_REQUIRED:
        pytest.fail(f"not installed: {', '.join(missing)}")
    if missing:
        pytest.skip(f"needs {', '.join(missing)}")


def without_fma() -> dict[str, str]:
    """Return an environment in which a process has glibc's other pow; skip the test if glibc has only one."""
    from sandbox.engines.article import pow_variant

    if platform.machine() != "x86_64" or pow_variant() != "fma":
        pytest.skip("needs glibc on an x86-64 processor with FMA")
    return os.environ | {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-FMA,-FMA_Usable"}  # the second name before glibc 2.33


class Steps(Protocol):
    """An engine, engines in lockstep, or the playback of a window."""

    def step(self) -> None: ...


def do_steps(what: Steps, steps: int) -> None:
    for _ in range(steps):
        what.step()


def ball_at(x: float, y: float, vx: float = 0, vy: float = 0, radius: float = 20, **more: object) -> str:
    """Return the lines of a ball's table."""
    keys = {"radius": radius, "position": [x, y], "velocity": [vx, vy]} | more
    return "\n".join(f"{key} = {json.dumps(value)}" for key, value in keys.items())


def scene_of(*balls: str, size: str = "[800, 600]", more: str = "") -> Scene:
    """Parse a scene of ball groups, each given as the lines of its table."""
    groups = "\n".join(f"[[balls]]\n{group}" for group in balls)
    return parse(f"{more}\n[arena]\nsize = {size}\n{groups}\n", "test.toml")


@pytest.fixture(autouse=True)
def _no_process_left() -> Iterator[None]:
    """End the processes that a test has left running, such as those that compile: no other test starts with them."""
    yield
    for process in multiprocessing.active_children():
        process.terminate()
        process.join()


@pytest.fixture(autouse=True)
def _light_theme() -> Iterator[None]:
    """Begin each test in the light theme, whatever a window of the test before has chosen."""
    yield
    from sandbox.view.theme import theme

    theme.use(dark=False)


@pytest.fixture
def working_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Change to an empty folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def no_display(monkeypatch: pytest.MonkeyPatch) -> None:
    """Hide the display, if there is one."""
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)


unfreeze = gc.unfreeze


@pytest.fixture(scope="session")
def _few_objects_to_collect() -> Iterator[None]:
    """Freeze all objects once for each process, not in each window.

    A window that opens looks for garbage among all objects of its process, and that of the tests has millions.
    """
    gc.unfreeze()
    gc.collect()
    gc.freeze()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gc, "unfreeze", lambda: None)
        yield


@pytest.fixture
def all_objects_to_collect(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let windows look for garbage among all objects, as they do outside the tests."""
    monkeypatch.setattr(gc, "unfreeze", unfreeze)


@pytest.fixture
def memory_screen(working_folder: Path, monkeypatch: pytest.MonkeyPatch, _few_objects_to_collect: None) -> None:
    """Let windows open on a screen that is only in memory, in an empty folder, without outlines, numbers and marks.

    What fails in the drawing fails the test.
    """
    from window_driver import IdleWorker

    from sandbox.view import Layer
    from sandbox.view.notice import Notice

    monkeypatch.setattr("sandbox.view.case_so_far.CaseWorker", IdleWorker)
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setenv("SANDBOX_THEME", "light")
    monkeypatch.setattr(Notice, "strict", True)
    monkeypatch.setattr("webbrowser.open", lambda _: True)
    monkeypatch.setattr("sandbox.view.window.OPENS_WITH", (Layer.CHARTS,))


@pytest.fixture
def gate(monkeypatch: pytest.MonkeyPatch) -> Iterator[threading.Event]:
    """A gate in front of each step that exact does in a thread."""
    from sandbox.engines.exact.engine import ExactEngine

    opened, step = threading.Event(), ExactEngine.step

    def wait(engine: ExactEngine) -> None:
        if threading.current_thread() is not threading.main_thread():
            opened.wait()
        step(engine)

    monkeypatch.setattr(ExactEngine, "step", wait)
    yield opened
    opened.set()


@pytest.fixture
def fails_after_29_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let exact fail in its step 30."""
    from sandbox.engines.exact.engine import ExactEngine

    step = ExactEngine.step

    def fail(engine: ExactEngine) -> None:
        if engine._steps == 29:
            raise SandboxError("exact: contacts without end")
        step(engine)

    monkeypatch.setattr(ExactEngine, "step", fail)


@pytest.fixture
def window(memory_screen: None) -> "Window":
    """Open a window with three balls."""
    from window_driver import THREE_BALLS

    from sandbox.view.window import Window

    return Window(scene_of(*THREE_BALLS), None)


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> "Iterator[Browser]":
    """Start a Chromium that has no network."""
    from browser import chromium

    with chromium(tmp_path_factory.mktemp("profile")) as browser:
        yield browser


Command = Callable[..., tuple[int, str, str]]


@pytest.fixture
def command(no_display: None, monkeypatch: pytest.MonkeyPatch, capfdbinary: pytest.CaptureFixture[bytes]) -> Command:
    """Return a function that runs the command line without a display: exit code, and both outputs as UTF-8."""
    monkeypatch.setenv("PYTHONSAFEPATH", "")  # the command line sets it; restored after the test

    def run(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["sandbox", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        out, err = capfdbinary.readouterr()
        return int(ended.value.code or 0), out.decode(), err.decode()

    return run


def numbers_in(sentence: str) -> list[float]:
    """Return the numbers of a sentence, without those of bodies such as `ball 2`."""
    return [float(number) for number in re.findall(r"(?<![\w.])(?<!ball )(?<!balls )-?\d+(?:\.\d+)?", sentence)]
