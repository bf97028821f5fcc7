"""What stands in finer steps, but moves on in the program's own: it leans, slides or topples."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from sandbox.space.evidence import MAX_CREEP, Evidence
from sandbox.space.findings import Fault, Rules
from sandbox.space.finer import Finer
from sandbox.space.mechanics import Floats
from sandbox.space.recording import Step
from sandbox.space.replay import Motion, distance

STILL: Final = 0.1  # of the smallest half width of a body: what moves less stands
ALREADY_SAID: Final = ("creeps", "sinks-in", "unsolved")  # rules that name the same bodies for what they do


@dataclass(frozen=True)
class Compared:
    """A recording compared with finer steps. named: the bodies that other rules found, by rule and index."""

    evidence: Evidence
    finer: Finer
    named: Mapping[str, set[int | None]]


def _moves_on(compared: Compared) -> Iterator[Fault]:
    """Bodies that move on by a part of their size, and stand in the reference from the start to the end.

    So does all that touches them before they move: what something else hits may fall.
    """
    evidence, found = compared.evidence, compared.finer
    steps, last = found.script.steps, len(found.error) - 1
    is_known = found.is_light & (found.until > last)
    stands = {body.id: _stands(compared, number) for number, body in enumerate(found.script.roster.bodies)}
    for number, body in enumerate(found.script.roster.bodies):
        half = evidence.half_width(body.id)
        ways = _ways(found, found.script.recorded, number)
        way, since = float(ways.max()), steps[int(np.argmax(ways > STILL * half))]
        if is_known[number] and stands[body.id] and way > MAX_CREEP * half:
            what = f"moves {way:.3g} px from {since.end:.3f} to {steps[last].end:.3f} s"
            report = evidence.report((body.id,), steps[last], what)
            is_new = not any(report.index in compared.named.get(rule, ()) for rule in ALREADY_SAID)
            touched = _touched(steps[: since.number - steps[0].number + 1], body.id)
            if is_new and all(stands.get(other, True) for other in touched):
                yield Fault(way, report, f"{way:.3g} px", since=since.end)


def _stands(compared: Compared, number: int) -> bool:
    """Return whether a body, by its number, stands in the reference, as long as that is known."""
    found, body = compared.finer, list(compared.finer.script.roster.bodies)[number]
    most = STILL * compared.evidence.half_width(body.id) if compared.evidence.is_dynamic(body.id) else 0.0
    return bool((_ways(found, found.reference, number)[: found.until[number]] <= most).all())


def _touched(steps: Iterable[Step], body: int) -> Iterator[int]:
    """Yield the ids of the bodies that touch a body in some steps."""
    for step in steps:
        contacts = step.after.contacts
        for side, other in (("body_a", "body_b"), ("body_b", "body_a")):
            yield from contacts[other][contacts[side] == body].tolist()


def _ways(found: Finer, motion: Motion, body: int) -> Floats:
    """Return how far a body is in each compared step from where it is in the first, px."""
    column = slice(body, body + 1)
    moved = Motion(motion.place[: len(found.error), column], motion.angle[: len(found.error), column])
    return distance(found.script.outlines[column], moved, moved.first(1))[:, 0]


COMPARED_RULES: Final[Rules[Compared]] = {"moves-on": _moves_on}
