"""What each cause changed: rows of errors, and the sums of what the exact steps change themselves.

The energy of a step is the exact step's own change, which is the scene's, the hand's or rounding, plus the rest, which
is entered under the step's cause. So the lines add up to the whole change.
"""

from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sandbox.judge.causes import Cause
from sandbox.judge.run import Contacts, Run, Vectors, cross
from sandbox.judge.thresholds import FEW
from sandbox.state import Floats, Integers

NO_BODY: Final = np.iinfo(np.int64).max  # the second of a ball in flight
NAME: Final = "U32"
ERROR: Final = np.dtype(
    [
        ("step", "i8"),  # from 1
        ("first", "i8"),  # ball
        ("second", "i8"),  # ball, ~wall, or NO_BODY
        ("cause", "i8"),
        ("law", NAME),  # what is wrong, by the name of its sentence
        ("place", NAME),
        ("also", NAME),  # another law that explains it as well
        ("value", "f8"),  # of the law's parameter, or NaN
        ("depth", "f8"),  # px, where the contact is found, or NaN
        ("times", "i8"),  # contacts, or balls in flight
        ("energy", "f8"),  # kg px²/s², besides the exact step's own
        ("momentum", "f8"),  # kg px/s transferred wrongly, the sum of the lengths
        ("displacement", "f8"),  # px off the exact step, the sum of the lengths
        ("speed", "f8"),  # px/s, likewise
        ("gained", "f8", (3,)),  # momentum and angular momentum about the arena's centre that nothing outside gave
        ("before", "f8", (2, 2)),  # px/s, of both balls
        ("after", "f8", (2, 2)),
        ("should", "f8", (2, 2)),  # NaN if the exact step is not known
        ("spin_before", "f8", (2,)),  # rad/s
        ("spin_after", "f8", (2,)),
        ("spin_should", "f8", (2,)),
        ("normal", "f8", (2,)),  # where the contact is found, or NaN
        ("should_normal", "f8", (2,)),  # where the two touch, or NaN
    ]
)
PUSHES: Final = (Cause.SMALL, Cause.LARGE, Cause.DOUBLE_BOUNCE, Cause.UNKNOWN)  # what a spring may look like
Errors = NDArray[np.void]


def pairs(z: Vectors) -> Floats:
    """Return vectors (...) as pairs (..., 2)."""
    return np.stack([z.real, z.imag], axis=-1)


@dataclass
class Ledger:
    """The errors of a block of steps so far, and the sums (4, causes) of energy, momentum, displacement and times."""

    run: Run
    rows: list[Errors] = field(default_factory=list)
    sums: Floats = field(default_factory=lambda: np.zeros((4, len(Cause))))

    def rightful(self, cause: Cause, energy: Floats | float, times: int = 0) -> None:
        """Enter energy that the exact step changes, or that is rounding."""
        self.sums[0, cause] += np.sum(energy)
        self.sums[3, cause] += times

    def enter(self, c: Contacts, **columns: Any) -> None:
        """Enter errors of contacts, (k,), or of balls in flight, whose j is NO_BODY, with columns by name."""
        run, rows = self.run, np.zeros(len(c.k), ERROR)
        second = np.where((c.j < 0) | (c.j == NO_BODY), c.i, c.j)
        both, k = np.stack([c.i, second], axis=1), c.k[:, None]
        for name in ("value", "depth", "normal", "should_normal", "should", "spin_should"):
            rows[name] = np.nan
        rows["step"], rows["first"], rows["second"], rows["times"] = c.k + 1, c.i, c.j, 1
        rows["before"], rows["after"] = pairs(run.v0[k, both]), pairs(run.v[k + 1, both])
        rows["spin_before"], rows["spin_after"] = run.w[k, both], run.w[k + 1, both]
        for name, values in columns.items():
            rows[name] = values
        self.rows.append(rows)

    def gained(self, k: Integers, i: Integers) -> Floats:
        """Return what balls gain besides their own flights, of momentum and of angular momentum: (k, 3)."""
        run, m = self.run, self.run.m[i]
        dv, off = run.v[k + 1, i] - run.hv[k, i], run.x[k + 1, i] - run.hx[k, i]
        lever = run.x[k + 1, i] - complex(*run.scene.arena.size) / 2
        spun = run.moment[i] * (run.w[k + 1, i] - run.w[k, i] * run.kept)
        turned = m * (cross(lever, dv) + cross(off, run.hv[k, i])) + spun
        return np.stack([m * dv.real, m * dv.imag, turned], axis=-1)

    def errors(self) -> Errors:
        """Return all errors in order, what is wrong with all flights before others of its step, the unknown last."""
        rows = np.concatenate([*self.rows, np.empty(0, ERROR)])
        soften(rows)
        is_last = rows["cause"] == Cause.UNKNOWN
        return rows[np.lexsort((rows["first"], is_last, rows["place"] != "flight", rows["step"]))]


def soften(errors: Errors) -> None:
    """Call contacts soft that push in several steps in a row, also while the two part; if most are, all pushes."""
    pushes = np.flatnonzero((errors["second"] != NO_BODY) & np.isin(errors["cause"], PUSHES))
    pushes = pushes[np.lexsort((errors["step"][pushes], errors["second"][pushes], errors["first"][pushes]))]
    of = errors[pushes]
    follows = (np.diff(of["first"]) == 0) & (np.diff(of["second"]) == 0) & (np.diff(of["step"]) == 1)
    group = np.cumsum(np.append(True, ~follows))[: len(of)]
    long = np.bincount(group) >= FEW
    soft = (long & (np.bincount(group, of["law"] == "push") > 0))[group]
    if 2 * np.count_nonzero(soft) > len(soft):
        soft[:] = True
    errors["cause"][pushes[soft]], errors["law"][pushes[soft]], errors["place"][pushes[soft]] = Cause.SOFT, "soft", ""
