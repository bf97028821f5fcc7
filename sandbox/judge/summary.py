"""The verdict on a run: what is wrong with its steps, by cause, in order, and in sums. A pure function of them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, Self

import numpy as np

from sandbox.judge.causes import Cause, Entry
from sandbox.judge.ledger import Errors
from sandbox.judge.words import of_errors, said_by
from sandbox.scene.model import Scene
from sandbox.state import Floats


class Judged(NamedTuple):
    """A block of steps, judged. errors: in order; sums: of what is right, (4, causes); clock: (steps,) s.

    contacts: how many it has; flights: sentences of how the engine flies; is_spinless: whether nothing ever turns;
    overlap: px, the deepest of two balls before a step of the engine.
    """

    errors: Errors
    sums: Floats
    clock: Floats
    contacts: int
    flights: dict[str, str]
    is_spinless: bool
    overlap: float


@dataclass(frozen=True)
class CauseOfError:
    """What is wrong with some contacts, or flights."""

    cause: Cause  # its key
    contacts: int  # or steps of a ball
    share: float  # of the engine's error
    parameter: float | None  # the median of the number in the sentence; None if it has none
    sentence: str  # what is wrong


@dataclass(frozen=True)
class Verdict:
    """What is wrong with a run.

    causes: the largest share of its error first; errors: ERROR, in order; flights: sentences of how the engine flies;
    ledger: every change of energy, momentum and places; gained: (steps, 3), see `ledger`, up to each step;
    is_spinless: whether an engine reports no spin of a scene whose balls turn; overlap: px, the deepest of two balls
    before a step.
    """

    causes: tuple[CauseOfError, ...]
    errors: Errors
    flights: dict[str, str]
    ledger: tuple[Entry, ...]
    gained: Floats
    is_spinless: bool
    overlap: float

    def of_steps(self, substeps: int) -> Self:
        """Return the verdict by the steps that contain so many of those that were judged."""
        errors = self.errors.copy()
        errors["step"] = -(-errors["step"] // substeps)
        return replace(self, errors=errors, gained=self.gained[substeps - 1 :: substeps])


def summary(scene: Scene, blocks: Sequence[Judged]) -> Verdict:
    """Return the verdict on blocks of steps that follow one another."""
    begun = np.cumsum([0, *(len(block.clock) for block in blocks)])
    parts = [block.errors.copy() for block in blocks]
    for first, part in zip(begun, parts, strict=False):
        part["step"] += first
    errors, sums = np.concatenate(parts), np.sum([block.sums for block in blocks], axis=0)
    flights = {name: text for block in blocks for name, text in block.flights.items()}
    for row, name in enumerate(("energy", "momentum", "displacement", "times")):
        np.add.at(sums[row], errors["cause"], errors[name])
    gravity, late = sums[0, Cause.GRAVITY], sums[0, Cause.LATE]
    if gravity * late < 0:  # what gravity in steps gives in flight, it gives back where contacts reverse velocities
        both = np.sign(gravity) * min(abs(gravity), abs(late))
        sums[0, [Cause.GRAVITY, Cause.LATE]] -= both, -both
    gained = np.zeros((int(begun[-1]), 3))
    np.add.at(gained, errors["step"] - 1, errors["gained"])
    contacts = max(1, sum(block.contacts for block in blocks))
    n = len(scene.bodies)
    reach = sum(float(block.clock.sum()) for block in blocks) * n / (n + 2 * contacts)
    return Verdict(
        _causes(scene, errors, reach, flights),
        errors,
        flights,
        tuple(Entry(Cause(k), int(row[3]), *row[:3]) for k, row in enumerate(sums.T.tolist()) if row[0] or row[3]),
        np.cumsum(gained, axis=0),
        scene.is_rough and all(block.is_spinless for block in blocks),
        max(block.overlap for block in blocks),
    )


def _causes(scene: Scene, errors: Errors, reach: float, flights: dict[str, str]) -> tuple[CauseOfError, ...]:
    """Return the causes, by their shares. reach: s, the mean time between contacts, for which a speed is wrong."""
    if not len(errors):
        return ()
    size = errors["displacement"] + errors["speed"] * reach
    keys = [said_by(*key) for key in zip(*(errors[name].tolist() for name in ("cause", "law", "place")), strict=True)]
    numbers = {key: number for number, key in enumerate(sorted(set(keys)))}
    group = np.array([numbers[key] for key in keys])
    said = [(cause, of_errors(scene, errors[group == k], flights)) for k, (cause, _, _) in enumerate(numbers)]
    found, whole = [], float(size.sum()) or 1.0
    for cause, sentence in dict.fromkeys(said):
        is_said = np.array([each == (cause, sentence) for each in said])[group]
        values = errors["value"][is_said & np.isfinite(errors["value"])]
        parameter = float(np.median(values)) if len(values) and cause != Cause.UNKNOWN else None
        share, times = float(size[is_said].sum()) / whole, int(errors["times"][is_said].sum())
        found.append(CauseOfError(Cause(cause), times, share, parameter, sentence))
    return tuple(sorted(found, key=lambda each: -each.share))
