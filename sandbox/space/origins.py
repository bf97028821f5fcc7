"""What a program did before and between its steps: where it added objects and pushed bodies, and what it set to 0."""

import math
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any, Final, NamedTuple
from unittest.mock import patch
from weakref import WeakKeyDictionary, WeakSet

import pymunk

SANDBOX: Final = str(Path(__file__).parents[1])
_PYMUNK: Final = str(Path(pymunk.__file__).parent)
_EXAMPLES: Final = str(Path(_PYMUNK) / "examples")
_STANDARD: Final = str(Path(os.__file__).parent)  # Python's library, which may hold that of packages
_PUSHES: Final = [f"apply_{what}_at_{where}_point" for what in ("force", "impulse") for where in ("local", "world")]
MIN_DENT: Final = 0.05  # of the square root of a hull's area, for a vertex within it


class Push(NamedTuple):
    """How far from the centre of gravity a body was pushed, px; how far, were the point of the other coordinates."""

    lever: float
    other_lever: float
    call: str  # and its line


class Origins:
    """Remembers which lines of the program added objects and pushed bodies furthest off, and the dents of polygons.

    zeros: the shapes whose elasticity, or friction, the program set to 0, which it is anyway.
    """

    def __init__(self) -> None:
        self.lines: WeakKeyDictionary[Any, str] = WeakKeyDictionary()  # that added objects, as file:line
        self.pushes: WeakKeyDictionary[pymunk.Body, Push] = WeakKeyDictionary()
        self.dents: WeakKeyDictionary[pymunk.Poly, float] = WeakKeyDictionary()  # px
        self.zeros: dict[str, WeakSet[pymunk.Shape]] = {name: WeakSet() for name in ("elasticity", "friction")}

    def remember(self, objects: tuple[Any, ...]) -> None:
        """Remember the line of the program that is being run as that of some objects, unless they have one."""
        line = ""
        for each in objects:
            if each not in self.lines:
                line = line or program_line()
                self.lines[each] = line

    @contextmanager
    def followed(self) -> Iterator[None]:
        """Follow, within a `with` block, which polygons the program makes, and where it pushes bodies."""
        make = pymunk.Poly.__init__

        def make_followed(poly: Any, body: Any, vertices: Any, *more: Any, **named: Any) -> None:
            vertices = list(vertices)
            make(poly, body, vertices, *more, **named)
            if not more and "transform" not in named and (dent := _dent(poly.get_vertices(), vertices)):
                self.dents[poly] = dent

        pushes: dict[str, Any] = {name: self._followed_push(name) for name in _PUSHES}
        factors: dict[str, Any] = {name: self._followed_factor(name) for name in self.zeros}
        with (
            patch.object(pymunk.Poly, "__init__", make_followed),
            patch.multiple(pymunk.Body, **pushes),
            patch.multiple(pymunk.Shape, **factors),
        ):
            yield

    def _followed_factor(self, name: str) -> property:
        """Return a property of a shape that remembers which shapes the program set it to 0 of."""
        factor = getattr(pymunk.Shape, name)

        def set_followed(shape: pymunk.Shape, value: float) -> None:
            factor.fset(shape, value)
            (self.zeros[name].discard if value else self.zeros[name].add)(shape)

        return property(factor.fget, set_followed)

    def _followed_push(self, name: str) -> Callable[..., None]:
        """Return a method of a body that pushes, and remembers the push."""
        push = getattr(pymunk.Body, name)

        def push_followed(body: pymunk.Body, *arguments: Any, **named: Any) -> None:
            push(body, *arguments, **named)
            point = named.get("point", (*arguments[1:], (0, 0))[0])
            centre = body.center_of_gravity
            local, world = math.dist(point, centre), math.dist(point, body.local_to_world(centre))
            lever, other_lever = (local, world) if "local" in name else (world, local)
            if body not in self.pushes or lever > self.pushes[body].lever:
                self.pushes[body] = Push(lever, other_lever, f"{name} in {program_line()}")

        return push_followed


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
    if file.startswith(_EXAMPLES):
        return True
    standard = file.startswith(_STANDARD) and "site-packages" not in file
    return not standard and not file.startswith((SANDBOX, _PYMUNK, "<frozen"))
