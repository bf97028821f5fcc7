"""The energy ledger of a Space: by what each step, and the program between steps, changed its mechanical energy.

The energy is kinetic, potential (of the centres of gravity, in the Space's gravity), and elastic (of springs with
Pymunk's own laws). Bodies of infinite mass have none, nor has the rotation of those with an infinite moment.

Chipmunk's step moves all bodies with the velocities that they have, finds contacts, adds the springs' impulses, then
damping, gravity and forces, then the impulses of contacts and joints. All impulses of a step act at fixed points, so a
set of impulses J that changes the relative velocity at these points from v to u does the work J · (v + u) / 2 exactly.
"""

from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from sandbox.errors import SandboxError
from sandbox.space.causes import Cause
from sandbox.space.mechanics import Floats, Index, elastic_energy, is_within, kinetic_energy, potential_energy
from sandbox.space.memory import Snapshot
from sandbox.space.recording import Step
from sandbox.space.step_work import ContactHistory, StepWork, Work, add_membership, change_by_mass

LEAST_SHARE: Final = 0.005  # of the largest kinetic energy; smaller lines are printed together
SMALLEST_SHOWN: Final = 5e-5
MAX_SHARE: Final = 10.0  # of the largest kinetic energy: beyond, that is no measure of what changed
LARGEST: Final = 1e120  # px, px/s, rad or rad/s: beyond that, energies overflow


@dataclass(frozen=True)
class Ledger:
    """The energy ledger of a run of n steps.

    time: (n + 1,) s; kinetic, potential, elastic: (n + 1,) kg px²/s², at these times, before the program's changes;
    work: (n, causes) kg px²/s², of each step and of the program's changes before it, in the order of Cause;
    of_joints: the work of each constraint by its key; of springs, less what they stored.
    """

    time: Floats
    kinetic: Floats
    potential: Floats
    elastic: Floats
    work: Floats
    of_joints: dict[int, float]

    @property
    def total(self) -> Floats:
        """(n + 1,) energy."""
        return self.kinetic + self.potential + self.elastic

    @property
    def scale(self) -> float:
        """What shares are of: the largest kinetic energy, or the largest elastic one if that is larger."""
        return float(max(self.kinetic.max(), self.elastic.max()))

    @property
    def lines(self) -> dict[Cause, float]:
        """The change of energy over the run by its causes; they sum to the change of the total."""
        return {cause: float(value) for cause, value in zip(Cause, self.work.sum(axis=0), strict=True)}

    @property
    def shares(self) -> dict[str, float]:
        """The lines in words as shares of the scale, the largest first; 0 if nothing moved."""
        shares: dict[str, float] = defaultdict(float)
        for cause, value in self.lines.items():
            shares[cause.words] += value / self.scale if self.scale else 0.0
        return dict(sorted(shares.items(), key=lambda line: -abs(line[1])))

    def of(self, cause: Cause) -> Floats:
        """(n,) the change of each step by a cause."""
        return self.work[:, list(Cause).index(cause)]

    def text(self) -> Iterator[str]:
        """Yield its balance in lines of text: how much energy there was, and what changed it."""
        scale, shares = self.scale, self.shares
        if not scale:
            yield "Its energy: nothing moved."
            return
        since, until = self.time[[0, -1]].tolist()
        is_small = max(map(abs, shares.values()), default=0.0) > MAX_SHARE
        unit = "kg px²/s²; its largest kinetic energy is" if is_small else "% of the largest kinetic energy,"
        yield f"Its energy from {since:.4g} to {until:.4g} s, in {unit} {scale:.3g}:"
        large = {words: share for words, share in shares.items() if abs(share) >= LEAST_SHARE}
        change = float(self.total[-1] - self.total[0]) / scale
        rest = change - sum(large.values())
        lines = [*large.items(), *([("all else", rest)] if abs(rest) >= SMALLEST_SHOWN else []), ("together", change)]
        for words, share in lines:
            yield f"  {share * scale:+12.3g}  {words}" if is_small else f"  {100 * share:+9.2f} %  {words}"

    def as_json(self) -> dict[str, Any]:
        """Return its balance as a JSON document has it: energies in kg px²/s², times in s."""
        return {
            "since": float(self.time[0]),
            "until": float(self.time[-1]),
            "start": float(self.total[0]),
            "end": float(self.total[-1]),
            "largest_kinetic": self.scale,
            "lines": {str(cause): value for cause, value in self.lines.items() if value},
        }


def ledger_of(steps: Iterable[Step]) -> Ledger:
    """Return the energy ledger of successive steps, of which there is at least one.

    It ends before the first step that leaves a number which is not finite.
    """
    steps = list(steps)
    if not steps:
        raise SandboxError("no step was recorded")
    history = ContactHistory(steps[0].before)
    works: list[Work] = []
    of_joints: dict[int, float] = defaultdict(float)
    first = steps[0]
    energies = [(*_energies(first.before), elastic_energy(first.after, first.before))]
    for number, step in enumerate(steps):
        if not is_within(LARGEST, step.after):
            break
        works.append(defaultdict(float))
        if number:
            _add_program(works[-1], steps[number - 1], step)
        StepWork(step, history, works[-1], of_joints).add()
        energies.append((*_energies(step.after), elastic_energy(step.after, step.after)))
    time = np.array([first.time, *(step.end for step in steps[: len(works)])])
    work = np.array([[work[cause] for cause in Cause] for work in works]).reshape(len(works), len(Cause))
    kinetic, potential, elastic = np.array(energies).T
    return Ledger(time, kinetic, potential, elastic, work, of_joints)


def _energies(state: Snapshot) -> tuple[float, float]:
    """Return the kinetic and the potential energy."""
    bodies = state.bodies
    kinetic = kinetic_energy(bodies["mass"], bodies["moment"], bodies["velocity"], bodies["spin"]).sum()
    return float(kinetic), float(potential_energy(bodies["mass"], bodies["position"], state.settings["gravity"]).sum())


def _add_program(work: Work, previous: Step, step: Step) -> None:
    """Add what the program changed between two steps."""
    old, new = previous.after, step.before
    work[Cause.SPRINGS_SET] += elastic_energy(step.after, new) - elastic_energy(old, old)
    if old is new:
        return
    gravity = old.settings["gravity"]
    rows = Index(old.bodies["id"]).rows(new.bodies["id"])
    is_common = rows < len(old.bodies)
    a, b = old.bodies[rows[is_common]], new.bodies[is_common]
    velocity = kinetic_energy(a["mass"], a["moment"], b["velocity"], b["spin"]) - kinetic_energy(
        a["mass"], a["moment"], a["velocity"], a["spin"]
    )
    work[Cause.VELOCITY_SET] += velocity.sum()
    work[Cause.POSITION_SET] += potential_energy(a["mass"], b["position"] - a["position"], gravity).sum()
    work[Cause.MASS_SET] += change_by_mass(a, b, b, gravity)
    add_membership(work, old, new)
