"""A run as arrays: the states of an engine, the constants of the scene, and how exact the numbers are.

A point or vector of the plane is one complex number x + iy. So `abs` is its length, `z.conjugate() * w` has the scalar
product as its real and the cross product as its imaginary part, and `1j * n` is the normal n turned by a quarter: the
tangent. A contact is a ball i and a body j, a ball or ~wall, in step k, which leads from row k of the states to k + 1.
"""

from functools import cached_property
from typing import Final, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from sandbox.judge.thresholds import DOUBLE, NEGLIGIBLE, SINGLE
from sandbox.quantity import meeting
from sandbox.run.mouse import Pushes
from sandbox.scene.model import Scene
from sandbox.scene.walls import ARENA_COUNT, arena_faces, walls_of
from sandbox.state import Bools, Floats, Integers, States

Vectors = NDArray[np.complex128]
OUTWARD: Final = np.array([-1 + 0j, -1j, 1 + 0j, 1j])  # normals of the arena's left, top, right and bottom wall
NEVER: Final = np.inf


def dot(a: Vectors, b: Vectors) -> Floats:
    """Return the scalar products of vectors."""
    product: Floats = a.real * b.real + a.imag * b.imag
    return product


def cross(a: Vectors, b: Vectors) -> Floats:
    """Return the cross products of vectors: how far b turns to the left of a, for y up."""
    product: Floats = a.real * b.imag - a.imag * b.real
    return product


def vectors(pairs: Floats) -> Vectors:
    """Return pairs (..., 2) as vectors (...)."""
    z: Vectors = pairs[..., 0] + 1j * pairs[..., 1]
    return z


class Flights(NamedTuple):
    """Balls at the start of steps: x px, v px/s and dt s, each (k,); g: px/s², of the scene."""

    x: Vectors
    v: Vectors
    dt: Floats
    g: complex


class Contacts(NamedTuple):
    """Contacts that may happen: step, ball, and ball or ~wall, each (k,)."""

    k: Integers
    i: Integers
    j: Integers

    @classmethod
    def joined(cls, *parts: Self) -> Self:
        """Return several one after another."""
        return cls(*map(np.concatenate, zip(*parts, strict=True)))

    @property
    def ends(self) -> tuple[Integers, Integers]:
        """The steps and the balls of all: of each its first, and then of the pairs their second."""
        return np.concatenate([self.k, self.k[self.pair]]), np.concatenate([self.i, self.j[self.pair]])

    def any_in(self, marked: Bools) -> Bools:
        """Return which have a ball that is marked. marked: (steps, n)."""
        some: Bools = marked[self.k, self.i] | (self.pair & marked[self.k, self.other])
        return some

    def all_in(self, marked: Bools) -> Bools:
        """Return which have only balls that are marked. marked: (steps, n)."""
        every: Bools = marked[self.k, self.i] & (~self.pair | marked[self.k, self.other])
        return every

    def nodes(self, n: int) -> tuple[Integers, Integers]:
        """Return numbers for the ball of each contact in its step, of n balls, and for its second ball, if any."""
        return self.k * n + self.i, self.k * n + np.where(self.pair, self.j, self.i)

    def part(self, rows: Integers | Bools | list[int]) -> "Contacts":
        """Return some of them."""
        return Contacts(self.k[rows], self.i[rows], self.j[rows])

    @property
    def pair(self) -> Bools:
        """Which are of two balls."""
        return self.j >= 0

    @property
    def other(self) -> Integers:
        """The second ball; of a contact with a wall, any."""
        return np.maximum(self.j, 0)


class Islands(NamedTuple):
    """Balls in steps, (nodes,), with the number of the island of each, and the contacts of islands, (k,).

    one, two: the nodes of each contact, twice the same of a wall.
    """

    k: Integers
    i: Integers
    island: Integers
    c: Contacts
    one: Integers
    two: Integers

    @classmethod
    def of_contacts(cls, c: Contacts) -> Self:
        """Return an island for each contact."""
        k, i = c.ends
        one = np.arange(len(c.k))
        two = one.copy()
        two[c.pair] = np.arange(len(one), len(k))
        return cls(k, i, np.append(one, np.flatnonzero(c.pair)), c, one, two)

    @property
    def of(self) -> Integers:
        """The island of each contact."""
        return self.island[self.one]


class Run:
    """What the balls did. x, v, w: (steps + 1, n) px, px/s and rad/s; v0: (steps, n), v with each push in it.

    meets: (n,), which balls can meet another; dt: (steps,) s; floor: px, below which a difference of places, or of
    velocities times dt, is rounding; tiny: px, below which two places are one. Once it is known how the engine flies,
    see `fly`: hx, hv: (steps, n), where its own flights end; u: px/s, the velocity with which a parabola begins that
    ends there, too; pull: px/s², how it falls; kept: the share of its spin that a ball keeps in a step; flown:
    (steps,) s, for how long it flies.
    """

    def __init__(self, scene: Scene, states: States, pushes: Pushes, clock: Floats) -> None:
        self.scene, bodies = scene, scene.bodies
        self.x, self.v, self.w = vectors(states.position), vectors(states.velocity), states.spin
        self.dt, self.g = clock, complex(*scene.gravity)
        self.v0 = self.v[:-1].copy()
        np.add.at(self.v0, (pushes["row"] - 1, pushes["ball"]), vectors(pushes["dv"]))
        self.steps, self.n = self.v0.shape
        self.r, self.m, self.e, self.mu = bodies.radius, bodies.mass, bodies.elasticity, bodies.friction
        self.moment, self.meets = bodies.moment, meeting(bodies.filters)
        walls = walls_of(scene)
        self.face = arena_faces(scene)
        self.wall_e, self.wall_mu, self.half = walls.elasticity, walls.friction, walls.half_thickness
        self.start, self.end = vectors(walls.start), vectors(walls.end)
        self.walls, self.length = len(self.start), np.abs(self.end - self.start)
        self.along = (self.end - self.start) / np.where(self.length > 0, self.length, 1.0)
        moved = self.x[1:], self.v[1:]
        single = all(np.array_equal(z, z.astype(np.complex64)) for z in moved)
        reach, fastest = (float(max(np.abs(z.real).max(), np.abs(z.imag).max())) for z in (self.x, self.v))
        self.floor = (SINGLE if single else DOUBLE) * (reach + fastest * float(clock.max()))
        self.tiny = 3 * self.floor + NEGLIGIBLE * float(self.r.min())

    def fly(self, hx: Vectors, hv: Vectors, pull: complex, kept: float, clock: float) -> None:
        """Set how the engine flies. clock: what share of a step it flies."""
        self.hx, self.hv, self.pull, self.kept, self.flown = hx, hv, pull, kept, self.dt * clock
        dt = self.flown[:, None]
        self.u = (hx - self.x[:-1]) / dt - pull * dt / 2

    @cached_property
    def every(self) -> tuple[Integers, Integers]:
        """Each step and ball, (steps n,) both."""
        k, i = np.indices(self.v0.shape).reshape(2, -1)
        return k, i

    def flights(self, k: Integers, i: Integers) -> Flights:
        """Return balls at the start of steps."""
        return Flights(self.x[k, i], self.v0[k, i], self.dt[k], self.g)

    def geometry(self, i: Integers, j: Integers, xi: Vectors, xj: Vectors) -> tuple[Vectors, Floats]:
        """Return the normals from ball i to the body j, and how deep they are in each other, px: (k,) each.

        xi, xj: (k,) px, where the balls are. The arena's walls are solid to any depth.
        """
        away, reach = xj - xi, self.r[i] + self.r[np.maximum(j, 0)]
        rows = np.flatnonzero(j < 0)
        wall, p = ~j[rows], xi[rows]
        part = np.clip(dot(self.along[wall], p - self.start[wall]), 0, self.length[wall])
        away[rows], reach[rows] = self.start[wall] + part * self.along[wall] - p, self.r[i[rows]] + self.half[wall]
        distance = np.abs(away)
        n, depth = away / np.where(distance > 0, distance, 1.0), reach - distance
        of_arena = rows[wall < ARENA_COUNT]
        side = ~j[of_arena]
        n[of_arena] = OUTWARD[side]
        depth[of_arena] = dot(xi[of_arena], n[of_arena]) + self.r[i[of_arena]] - self.face[side]
        return n, depth

    def depth(self, c: Contacts, x: Vectors) -> Floats:
        """Return how deep the bodies of contacts are in each other at places x, (steps, n) px."""
        return self.geometry(c.i, c.j, x[c.k, c.i], x[c.k, c.other])[1]

    def energies(self, x: Vectors, v: Vectors, w: Floats, i: Integers | slice = slice(None)) -> Floats:
        """Return the energy of balls i, of flight, height and spin: kg px²/s², in the shape of x."""
        g = np.asarray(self.g)
        return self.m[i] * (np.abs(v) ** 2 / 2 - dot(x, g)) + self.moment[i] * w**2 / 2

    def gain(self, k: Integers, i: Integers) -> Floats:
        """Return by how much the energy of balls at the end of steps is above that of the engine's own flights."""
        after = self.energies(self.x[k + 1, i], self.v[k + 1, i], self.w[k + 1, i], i)
        return after - self.energies(self.hx[k, i], self.hv[k, i], self.w[k, i] * self.kept, i)
