"""What a program did before and between its steps: where it added objects and pushed bodies, and what it set to 0."""

import math
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from types import FrameType
from typing import Any, Final, NamedTuple
from unittest.mock import patch
from weakref import WeakKeyDictionary, WeakSet

import pymunk

SANDBOX: Final = str(Path(__file__).parents[1])
_PYMUNK: Final = str(Path(pymunk.__file__).parent)  # and in a folder within it, its examples
_STANDARD: Final = str(Path(os.__file__).parent)  # Python's library, which may hold that of packages
_PUSHES: Final = [f"apply_{what}_at_{where}_point" for what in ("force", "impulse") for where in ("local", "world")]
MIN_DENT: Final = 0.05  # of the square root of a hull's area, for a vertex within it


class Push(NamedTuple):
    """How far from the centre of gravity a body was pushed, px; how far, were the point of the other coordinates."""

    lever: float
    other_lever: float
    call: str  # and its line


class Origins:
    """Remembers which lines of the program added objects and pushed bodies furthest off, and what it made and set.

    grown: the Spaces with something that no rule has looked at;
    zeros: the shapes whose elasticity, or friction, the program set to 0, which it is anyway.
    """

    def __init__(self) -> None:
        self.lines: WeakKeyDictionary[Any, str] = WeakKeyDictionary()  # that added objects, as file:line
        self.grown: WeakSet[pymunk.Space] = WeakSet()
        self.pushes: WeakKeyDictionary[pymunk.Body, Push] = WeakKeyDictionary()
        self.dents: WeakKeyDictionary[pymunk.Poly, float] = WeakKeyDictionary()  # px
        self.zeros: dict[str, WeakSet[pymunk.Shape]] = {name: WeakSet() for name in ("elasticity", "friction")}

    @contextmanager
    def followed(self) -> Iterator[None]:
        """Follow, within a `with` block, what the program adds, makes and sets, and where it pushes bodies."""
        looks: list[tuple[type, str, Callable[..., None]]] = [(pymunk.Space, "add", self._look_at_addition)]
        looks.append((pymunk.Poly, "__init__", self._look_at_polygon))
        looks += [(pymunk.Body, name, partial(self._look_at_push, name)) for name in _PUSHES]
        looks += [(pymunk.Shape, name, partial(self._look_at_factor, name)) for name in self.zeros]
        with ExitStack() as stack:
            for kind, name, look in looks:
                stack.enter_context(patch.object(kind, name, _followed(getattr(kind, name), look)))
            yield

    def _look_at_addition(self, space: pymunk.Space, *objects: Any) -> None:
        if objects:  # Pymunk adds nothing after each step
            self.grown.add(space)
            line = program_line()
            for each in objects:
                self.lines.setdefault(each, line)

    def _look_at_polygon(self, poly: Any, body: Any, vertices: Any, transform: Any = None, *_: Any, **__: Any) -> None:
        if not transform and (dent := _dent(poly.get_vertices(), list(vertices))):
            self.dents[poly] = dent

    def _look_at_push(self, name: str, body: pymunk.Body, _: Any = 0, point: Any = (0, 0), **__: Any) -> None:
        centre = body.center_of_gravity
        local, world = math.dist(point, centre), math.dist(point, body.local_to_world(centre))
        lever, other_lever = (local, world) if "local" in name else (world, local)
        if body not in self.pushes or lever > self.pushes[body].lever:
            self.pushes[body] = Push(lever, other_lever, f"{name} in {program_line()}")

    def _look_at_factor(self, name: str, shape: pymunk.Shape, value: float) -> None:
        (self.zeros[name].discard if value else self.zeros[name].add)(shape)


def _followed(do: Any, look: Callable[..., None]) -> Any:
    """Return a method, or a property that can be set, whose calls are looked at once they are done."""
    if isinstance(do, property):
        return property(do.fget, _followed(do.fset, look))

    def call(*arguments: Any, **named: Any) -> None:
        do(*arguments, **named)
        look(*arguments, **named)

    return call


def _dent(hull: list[pymunk.Vec2d], vertices: list[tuple[float, float]]) -> float:
    """Return how far the innermost of some vertices is inside of their hull, px; 0 if that is little."""
    if not 2 < len(hull) < len(vertices):
        return 0.0
    sides = [(a, (b - a).perpendicular().normalized()) for a, b in zip(hull, hull[1:] + hull[:1], strict=True)]
    dent = max(min((point - a).dot(inwards) for a, inwards in sides) for point in vertices)
    return dent if dent > MIN_DENT * math.sqrt(abs(pymunk.area_for_poly(hull))) else 0.0


def program_line(frame: FrameType | None = None) -> str:
    """Return the innermost line of the program on the call stack of a frame, by default this one, as file:line.

    Frames of Pymunk, the sandbox and Python's library are skipped. Empty if no other is left.
    """
    frame = frame or sys._getframe()
    while frame and not is_program(frame.f_code.co_filename):
        frame = frame.f_back
    if not frame:
        return ""
    path, here = Path(frame.f_code.co_filename).absolute(), Path.cwd()
    return f"{path.relative_to(here) if path.is_relative_to(here) else path.name}:{frame.f_lineno}"


def is_program(file: str) -> bool:
    """Return whether a file is of the program, or a package that it uses."""
    is_standard = file.startswith(_STANDARD) and "site-packages" not in file
    return not is_standard and not file.startswith((SANDBOX, "<frozen")) and str(Path(file).parent) != _PYMUNK
