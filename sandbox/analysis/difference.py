"""What is wrong with an engine's steps, beside the exact step from its own state: where, since when, and why."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from sandbox.judge.causes import Cause
from sandbox.judge.ledger import NO_BODY, Errors
from sandbox.judge.words import of_errors
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.state import Floats

MAX_DIFFERENCES: Final = 200  # reported of one engine
Velocities = tuple[Vector, ...]
Spins = tuple[float, ...]


@dataclass(frozen=True)
class Difference:
    """What is wrong with a step of an engine.

    What should be is what the exact step makes of the engine's own state before it.
    """

    time: float  # s, at the end of the step
    first: int  # a ball
    second: int | None  # a ball, or a wall as a negative number; None if no contact shows the difference
    cause: Cause  # its key
    because: str  # a sentence
    before: Velocities  # px/s of the ball or balls, before the step
    after: Velocities  # px/s, after it
    should_after: Velocities  # px/s, after the exact step; empty if that is not known, as are the spins
    spin_before: Spins  # rad/s, as the velocities
    spin_after: Spins  # rad/s, likewise
    should_spin_after: Spins  # rad/s, likewise
    normal: Vector | None = None  # from the first to the second body, as the engine found it; None if not known
    depth: float | None = None  # px, their overlap then; negative if they were apart
    should_normal: Vector | None = None  # in the exact step; None if the two do not touch in it

    @property
    def balls(self) -> list[int]:
        """The balls that it is about."""
        return [body for body in (self.first, self.second) if body is not None and body >= 0]


def pair_name(scene: Scene, difference: Difference) -> str:
    """Name the bodies of a difference."""
    first, second = difference.first, difference.second
    return f"ball {first}" if second is None else contact_name(scene, first, second)


def contact_name(scene: Scene, first: int, second: int) -> str:
    """Name the two bodies of a contact, by the numbers that contacts have."""
    return f"balls {first} and {second}" if second >= 0 else f"ball {first} and {scene.wall_name(~second)}"


def differences(scene: Scene, errors: Errors, flights: dict[str, str]) -> tuple[Difference, ...]:
    """Return the steps of an engine that are not as the exact step from the same state is. flights: as in `Verdict`."""
    return tuple(_of_step(scene, errors[k : k + 1], flights) for k in range(len(errors)))


def _of_step(scene: Scene, row: Errors, flights: dict[str, str]) -> Difference:
    error = row[0]
    second = None if error["second"] == NO_BODY else int(error["second"])
    balls = slice(2 if second is not None and second >= 0 else 1)
    should = balls if np.isfinite(error["should"][balls]).all() else slice(0)
    return Difference(
        scene.clock.time(int(error["step"])),
        int(error["first"]),
        second,
        Cause(error["cause"]),
        of_errors(scene, row, flights),
        before=_vectors(error["before"][balls]),
        after=_vectors(error["after"][balls]),
        should_after=_vectors(error["should"][should]),
        spin_before=tuple(error["spin_before"][balls].tolist()),
        spin_after=tuple(error["spin_after"][balls].tolist()),
        should_spin_after=tuple(error["spin_should"][should].tolist()),
        normal=_vector(error["normal"]),
        depth=None if np.isnan(error["depth"]) else float(error["depth"]),
        should_normal=_vector(error["should_normal"]),
    )


def _vectors(pairs: Floats) -> Velocities:
    return tuple((x, y) for x, y in pairs.tolist())


def _vector(pair: Floats) -> Vector | None:
    return None if np.isnan(pair).any() else _vectors(pair[None])[0]
