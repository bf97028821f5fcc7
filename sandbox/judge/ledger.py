"""What each cause changed: rows of errors, and the sums of what the exact steps change themselves.

The energy of a step is the exact step's own change, which is the scene's, the hand's or rounding, plus the rest, which
is entered under the step's cause. So the lines add up to the whole change.
"""

from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sandbox.judge.causes import Cause
from sandbox.judge.choose import NAME, RIGHT, Said
from sandbox.judge.flight import by_gravity
from sandbox.judge.observe import SIGN, Singles, When
from sandbox.judge.run import NEVER, Islands, Run, Vectors, cross
from sandbox.state import Bools, Floats, Integers

NO_BODY: Final = np.iinfo(np.int64).max  # the second of a ball in flight
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
Errors = NDArray[np.void]


def pairs(z: Vectors) -> Floats:
    """Return vectors (...) as pairs (..., 2)."""
    return np.stack([z.real, z.imag], axis=-1)


@dataclass
class Ledger:
    """The errors of a block of steps so far, and the sums (4, causes) of energy, momentum, displacement and times.

    own: the line of what the scene takes where balls rest or several exact contacts follow one another.
    """

    run: Run
    own: Cause
    rows: list[Errors] = field(default_factory=list)
    sums: Floats = field(default_factory=lambda: np.zeros((4, len(Cause))))

    def rightful(self, cause: Cause, energy: Floats | float, times: int = 0) -> None:
        """Enter energy that the exact step changes, or that is rounding."""
        self.sums[0, cause] += np.sum(energy)
        self.sums[3, cause] += times

    def enter(self, k: Integers, i: Integers, j: Integers, **columns: Any) -> None:
        """Enter errors of contacts, (k,), or of balls in flight, whose j is NO_BODY, with columns by name."""
        run, rows = self.run, np.zeros(len(k), ERROR)
        both, step = np.stack([i, np.where((j < 0) | (j == NO_BODY), i, j)], axis=1), k[:, None]
        for name in ("value", "depth", "normal", "should_normal", "should", "spin_should"):
            rows[name] = np.nan
        rows["step"], rows["first"], rows["second"], rows["times"] = k + 1, i, j, 1
        rows["before"], rows["after"] = pairs(run.v0[step, both]), pairs(run.v[step + 1, both])
        rows["spin_before"], rows["spin_after"] = run.w[step, both], run.w[step + 1, both]
        for name, values in columns.items():
            rows[name] = values
        self.rows.append(rows)

    def enter_islands(self, islands: Islands, touch: Floats, said: Said) -> None:
        """Enter what islands of balls, or single balls, do otherwise than the exact step.

        touch: s, when their contacts are due; said: (islands,). What the exact step changes is that of the contacts as
        if each were alone, and is known of the velocities if there is one at most.
        """
        if not len(said):
            return
        run, (k, i, island, c, one, two), of, count = self.run, islands, islands.of, len(said)
        s, dx, dv, dw = Singles(run, c, touch), *np.zeros((2, len(k)), complex), np.zeros(len(k))
        met, end = s.met(When.TOUCH), s.met(When.END)
        is_due = touch < NEVER  # else restitution takes what it takes where the contact is found
        impulse, rub, left = (np.where(is_due, part, 0.0) for part in (met.due, met.rub, s.dt - touch))
        u = np.where(is_due, met.u, np.where(end.depth > 0, np.maximum(end.u, 0), 0.0))
        heat = (1 - s.e**2) * s.red * u**2 / 2
        rubbed = np.where(is_due, np.abs(rub * met.slip) - 1.5 * rub**2 / s.red, 0.0)
        given = SIGN * s.inverse * (impulse * met.n + rub * 1j * met.n)
        for node, change, inverse, r in zip((one, two), given, s.inverse, s.r, strict=True):
            np.add.at(dv, node, change)
            np.add.at(dx, node, left * change)
            np.add.at(dw, node, -2 * inverse * rub / r)
        off_x, off_v = np.abs(run.x[k + 1, i] - run.hx[k, i] - dx), np.abs(run.v[k + 1, i] - run.hv[k, i] - dv)

        def summed(values: Floats | Bools, by: Integers = island) -> Floats:
            return np.bincount(by, values, count).astype(float)

        energy = summed(run.gain(k, i)) + summed(heat, of) + summed(rubbed, of)
        several, first = np.bincount(of, minlength=count) > 1, np.unique(island, return_index=True)[1]
        right, wrong = said["cause"] == RIGHT, said["cause"] != RIGHT
        self.rightful(Cause.ELASTICITY, -heat, int((heat > 0).sum()))
        self.rightful(Cause.FRICTION, -rubbed, int((rubbed > 0).sum()))
        self.rightful(self.own, energy[right & several])
        self.rightful(Cause.ROUNDING, energy[right & ~several])

        order = np.lexsort((~is_due, of))
        some, begin = np.unique(of[order], return_index=True)
        head = order[begin]  # the contact that stands for an island, which is due if one is
        both, j = np.stack([first, first], axis=1), np.full(count, NO_BODY)
        both[some], j[some] = np.stack([one[head], two[head]], axis=1), c.j[head]
        normal, should_normal = np.full((2, count), np.nan + 0j)
        normal[some], should_normal[some] = end.n[head], met.n[head]
        normal[np.isnan(said["depth"]) | several] = should_normal[several] = np.nan
        should, spin_should = pairs((by_gravity(run.flights(k, i)) + dv)[both]), (run.w[k, i] + dw)[both]
        should[several], spin_should[several] = np.nan, np.nan
        gained = np.stack([summed(part) for part in self.gained(k, i).T], axis=1)
        is_free = (summed(~c.pair, of) == 0) & (summed(c.pair, of) + (said["cause"] != Cause.UNKNOWN) > 0)
        columns = {
            **{name: said[name] for name in ("cause", "law", "place", "also", "value", "depth")},
            "times": np.maximum(summed(is_due, of), 1), "energy": energy, "displacement": summed(off_x),
            "speed": summed(off_v), "momentum": summed(run.m[i] * off_v) / np.minimum(np.bincount(island), 2),
            "gained": gained * is_free[:, None], "normal": pairs(normal), "should": should,
            "spin_should": spin_should, "should_normal": pairs(should_normal),
        }  # fmt: skip
        at = both[wrong, 0]
        self.enter(k[at], i[at], j[wrong], **{name: column[wrong] for name, column in columns.items()})

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
        is_last = rows["cause"] == Cause.UNKNOWN
        return rows[np.lexsort((rows["first"], is_last, rows["place"] != "flight", rows["step"]))]
