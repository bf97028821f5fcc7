"""A ball in free flight, in a step by a law: gravity, its integration, and what slows velocities down or turns them."""

import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sandbox.compiled import Record, entry, kernel
from sandbox.judge.law import Grid, Slows
from sandbox.scene.model import Scene
from sandbox.state import Floats, States

BALL: Final = np.dtype(
    [
        ("x", "f8"),  # px
        ("y", "f8"),
        ("vx", "f8"),  # px/s
        ("vy", "f8"),
        ("spin", "f8"),  # rad/s
        ("ax", "f8"),  # px/s², what pulls at it
        ("ay", "f8"),
        ("turning", "f8"),  # rad/s², of a disc that slides
        ("slips_for", "f8"),  # s, until it rolls
        ("carrier", "i8"),  # piece of wall, or -1
        ("number", "i8"),  # in the scene
        ("radius", "f8"),  # px
        ("mass", "f8"),  # kg
        ("elasticity", "f8"),
        ("friction", "f8"),
        ("filter", "i8", (3,)),  # as in `Bodies`
    ]
)


def balls_of(scene: Scene, more: int = 0) -> NDArray[np.void]:
    """Return a scene's balls, (n + more,) BALL, without their motion."""
    bodies = scene.bodies
    ball = np.zeros(len(bodies) + more, BALL)
    for name in ("radius", "mass", "elasticity", "friction"):
        ball[name][: len(bodies)] = getattr(bodies, name)
    ball["filter"][: len(bodies)] = bodies.filters
    ball["number"][: len(bodies)] = np.arange(len(bodies))
    return ball


@kernel
def fill_ball(b: Record, states: States, step: int, i: int) -> None:
    """Set a ball's motion to that of a state."""
    b.x, b.y = states.position[step, i, 0], states.position[step, i, 1]
    b.vx, b.vy = states.velocity[step, i, 0], states.velocity[step, i, 1]
    b.spin = states.spin[step, i]


@kernel
def kept_in(law: Record, dt: float) -> float:
    """Return the share of velocities that a law leaves in a step."""
    return float(law.kept * law.left**dt)


@kernel
def slow(law: Record, b: Record, dt: float) -> None:
    """Change a velocity as a law does in every step, with contacts and without."""
    b.spin *= law.kept_spin * law.left**dt
    kept, speed = kept_in(law, dt), math.hypot(b.vx, b.vy)
    if law.drag != 0 and speed > 0:
        share = law.drag * dt * speed**law.by_speed * b.radius**law.by_radius * b.mass**law.by_mass
        kept *= max(1 - share, 0.0)
    c, s, vy = kept * math.cos(law.veer), kept * math.sin(law.veer), law.kept_y * b.vy
    b.vx, b.vy = b.vx * c - vy * s, b.vx * s + vy * c


@kernel
def move(law: Record, b: Record, dt: float) -> None:
    """Move a ball as a step does whose contacts are found at its ends, and change its velocity."""
    fall_x, fall_y = law.gx * dt, law.gy * dt
    first = law.slows_first == Slows.BEFORE_MOVE
    if first:
        b.vx, b.vy = b.vx + fall_x, b.vy + fall_y
        slow(law, b, dt)
    theta = 0.0 if first else law.theta
    b.x += dt * (b.vx + theta * fall_x)
    b.y += dt * (b.vy + theta * fall_y)
    if law.grid == Grid.ROUNDED:
        b.x, b.y = np.rint(b.x), np.rint(b.y)
    elif law.grid == Grid.CUT:
        b.x, b.y = np.trunc(b.x), np.trunc(b.y)
    if law.slows_first == Slows.AFTER_MOVE:
        slow(law, b, dt)
    if law.after == 0 and not first:
        b.vx, b.vy = b.vx + fall_x, b.vy + fall_y


@kernel
def fly(law: Record, b: Record, dt: float) -> None:
    """Do what a law does to a ball that touches nothing."""
    dt *= law.clock
    if law.slows_first == Slows.FIRST:
        slow(law, b, dt)
    move(law, b, dt)
    b.x += law.dx
    b.y += law.dy
    if law.slows_first == Slows.LAST:
        slow(law, b, dt)


@entry
def fly_all(laws: NDArray[Any], ball: NDArray[Any], before: States, dt: Floats, after: States) -> None:
    """Do a step of free flight from each of some states.

    laws: (1,) LAW; ball: (n,) BALL, in whose motion it works; dt: (steps,) s; after: written.
    """
    for step in range(len(dt)):
        for i in range(len(ball)):
            b = ball[i]
            fill_ball(b, before, step, i)
            fly(laws[0], b, dt[step])
            after.position[step, i, 0], after.position[step, i, 1] = b.x, b.y
            after.velocity[step, i, 0], after.velocity[step, i, 1] = b.vx, b.vy
            after.spin[step, i] = b.spin
