"""Compiling all kernels, which happens once, in processes of their own, while the program goes on."""

from collections.abc import Callable, Iterator
from functools import partial
from multiprocessing import connection
from threading import Lock
from typing import Any, Final, NamedTuple

from sandbox.engines import create
from sandbox.processes import ChildProcess
from sandbox.scene.balls import BallGroup
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn, warnings

POLL_INTERVAL: Final = 1 / 30  # s, between two pictures of the progress


def _compile_engine(name: str) -> None:
    """Run an engine with few balls, and with enough of them for a grid."""
    for scene in (load("head-on"), load("gas-100")):
        engine = create(name, scene, spawn(scene))
        engine.step()
        engine.kick(0, (1.0, 0.0))
        engine.state()


def _compile_exact() -> None:
    """Run the exact engine, with a heap at rest too, and a collapse.

    The heap is a ball on two others that fill the floor; a heavy ball on a light one collapses.
    """
    _compile_engine("exact")
    light = BallGroup(radius=10, position=(20.0, 90.0), elasticity=0.5)
    heavy = BallGroup(radius=10, mass=1000, position=(20.0, 70.0), velocity=(0.0, 100.0), elasticity=0.5)
    collapse = Scene(arena={"size": (40.0, 100.0)}, balls=[light, heavy])
    create("exact", collapse, spawn(collapse)).step()
    balls = BallGroup(radius=10, positions=((10.0, 90.0), (30.0, 90.0), (20.0, 70.0)))
    scene = Scene(arena={"size": (40.0, 100.0)}, balls=[balls], gravity=(0.0, 900.0))
    engine = create("exact", scene, spawn(scene))
    engine.record_contacts()
    for kick in (0.0, 0.01, 1.0):
        engine.kick(2, (0.0, kick))
        engine.step()


def _compile_scenes() -> None:
    """Place balls at random, and then on a lattice, as there is too little room."""
    group = BallGroup(radius=5, count=80, inside=((0.0, 0.0), (100.0, 100.0)))
    scene = Scene(arena={"size": (100.0, 100.0)}, balls=[group])
    list(warnings(scene, spawn(scene)))


def _compile_drawing() -> None:
    from sandbox.view.pixels import load_kernels  # noqa: PLC0415  # the command line does not import pygame

    load_kernels()


class Target(NamedTuple):
    """A part of the program. modules: beginnings of the names of those with its kernels; compile: calls each kernel."""

    title: str
    modules: tuple[str, ...]
    compile: Callable[[], object]


# In the order of what a window of few balls lacks: the charts, its engines at full speed, and then the marks.
COMPUTATION: Final = (
    Target("exact", ("sandbox.engines.exact",), _compile_exact),
    Target("article", ("sandbox.engines.article",), partial(_compile_engine, "article")),
    Target("impulse", ("sandbox.engines.impulse",), partial(_compile_engine, "impulse")),
    Target("scenes", ("sandbox.scene", "sandbox.quantity"), _compile_scenes),
)
DRAWING: Final = Target("drawing", ("sandbox.view",), _compile_drawing)


def _compile(_: "connection.Connection[Any, Any]", part: Target) -> None:
    part.compile()


class Compilation:
    """Compiles parts, so many at once.

    A part whose process fails counts as done: its kernels are compiled where they are called. A thread that lacks a
    kernel can `poll` too.
    """

    def __init__(self, parts: tuple[Target, ...], at_once: int) -> None:
        self._parts = parts
        self._at_once = at_once
        self._todo = list(parts)
        self._running: dict[Target, ChildProcess] = {}
        self._lock = Lock()  # of both

    def until_compiled(self, module: str) -> Iterator["Compilation"]:
        """Compile the part that a module belongs to next; yield the progress every POLL_INTERVAL until it is done."""
        part = next((part for part in self._parts if module.startswith(part.modules)), None)
        self._todo.sort(key=lambda other: other is not part)
        self.poll()
        while part in self._todo or part in self._running:
            yield self
            connection.wait([process.connection for process in self._running.values()], POLL_INTERVAL)
            self._note_ended()
            if part in self._todo or part in self._running:  # if not, another one may be waited for next
                self._start()

    def poll(self) -> None:
        """Start to compile, or note which processes have ended and start the next ones."""
        self._note_ended()
        self._start()

    def _note_ended(self) -> None:
        with self._lock:
            self._running = {part: process for part, process in self._running.items() if process.is_alive}

    def _start(self) -> None:
        with self._lock:
            while self._todo and len(self._running) < self._at_once:
                part = self._todo.pop(0)
                self._running[part] = ChildProcess(_compile, part)

    def stop(self) -> None:
        """Stop compiling; what is compiled stays in the cache."""
        with self._lock:
            self._todo.clear()
            for process in self._running.values():
                process.stop()
            self._running.clear()

    @property
    def is_running(self) -> bool:
        """Whether something is compiled, or about to be."""
        return bool(self._running) or 0 < len(self._todo) < len(self._parts)

    @property
    def done(self) -> int:
        """The number of parts that are compiled."""
        return len(self._parts) - len(self._todo) - len(self._running)

    @property
    def total(self) -> int:
        """The number of parts."""
        return len(self._parts)

    def __str__(self) -> str:
        part = next(iter((*self._running, *self._todo)))
        return f"Compiling {part.title} (once): {self.done + 1} of {self.total}"
