"""The control law of the mouse: how a grabbed ball is pulled to the pointer, in every engine alike."""

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sandbox.quantity import dot, length, pass_through
from sandbox.run.edits import DeleteBall
from sandbox.run.inputs import End, Grab, Input, Move, Release
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene
from sandbox.scene.walls import ARENA_COUNT, nearest_on_segment, walls_of
from sandbox.state import Floats, State, States

PULL_RATE: Final = 25.0  # 1/s, of the critically damped pull: a ball reaches the pointer in about a fifth of a second
MAX_PULL_ACCELERATION: Final = 40_000.0  # px/s², whatever the scene's gravity
BRAKING_DISTANCE: Final = MAX_PULL_ACCELERATION / PULL_RATE**2  # px; further from the target the speed is limited
MAX_DEPTH: Final = 0.5  # of its radius, by which a ball is pulled into a wall, which pushes it out again
MAX_BALL_DEPTH: Final = 0.4  # of the sum of both radii, by which it is pulled into another ball: never to its centre
MAX_HIT: Final = 0.45  # of that sum, which it moves in a step that hits a ball: a faster one could come back through it
MIN_DEPTH: Final = 0.01  # of its radius, by which it is pulled on in a step where it is as deep already
MIN_DISTANCE: Final = 1e-9  # px

Push = tuple[int, Vector]  # a ball, and what is added to its velocity, px/s
Pushes = NDArray[np.void]  # (k,) of dtype PUSH: those in some steps
PUSH: Final = np.dtype(
    [
        ("row", "i8"),  # of the state that the step leads to, in a block
        ("ball", "i8"),
        ("dv", "f8", (2,)),  # px/s, by which the ball's velocity changes before the step
    ]
)


class Mouse:
    """The mouse, alike in every engine: a critically damped pull of one ball to a point inside the arena.

    The pull is a backward Euler step of x'' = -w² (x - target) - 2 w x', which does not overshoot from rest, and is
    stable at every rate. Its acceleration is limited, and its speed to what this acceleration can brake. In a step, it
    moves a ball no further than to what is in the way and less than a radius into it, so that inner walls and other
    balls stop it. The arena's walls stop it at any speed.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene  # replaced by edits
        self.ball: int | None = None
        self.target: Vector = (0.0, 0.0)

    def apply(self, given: Input) -> None:
        """Grab, move or release a ball as an input says; follow its number if a ball is deleted."""
        match given:
            case Grab(ball=ball, at=at):
                self.ball = ball
                self._aim(at)
            case Move(at=at) if self.ball is not None:
                self._aim(at)
            case DeleteBall(ball=ball) if self.ball is not None and ball < self.ball:
                self.ball -= 1
            case Release() | End() | DeleteBall(ball=self.ball):
                self.ball = None

    def _aim(self, at: Vector) -> None:
        assert self.ball is not None
        radius = float(self.scene.bodies.radius[self.ball])
        self.target = self.scene.arena.nearest_inside(at, radius)

    def pull(self, state: State) -> Vector:
        """Return the change of the grabbed ball's velocity for one step of an engine in a state, px/s."""
        assert self.ball is not None
        position, velocity = state.position[self.ball].tolist(), state.velocity[self.ball].tolist()
        h = 1 / self.scene.rate
        way = h * np.array(pulled(position, velocity, self.target, h))
        vx, vy = (_free_part(way, self.scene, state.position, self.ball) / h).tolist()
        return vx - velocity[0], vy - velocity[1]


def pulled(position: Sequence[float], velocity: Sequence[float], target: Vector, h: float) -> Vector:
    """Return the velocity to which the pull changes another in a step of h s, px/s, if nothing is in the way."""
    w = PULL_RATE
    damping = (1 + h * w) * (1 + h * w)  # not **, which is the C library's pow and has two variants
    vx, vy = ((v - h * w * w * (x - to)) / damping for x, v, to in zip(position, velocity, target, strict=True))
    dx, dy = (to - x for x, to in zip(position, target, strict=True))
    if vx * dx + vy * dy > 0 and math.hypot(dx, dy) > BRAKING_DISTANCE:
        vx, vy = _at_most(math.sqrt(MAX_PULL_ACCELERATION * math.hypot(dx, dy)), vx, vy)
    ax, ay = _at_most(MAX_PULL_ACCELERATION * h, vx - velocity[0], vy - velocity[1])
    return velocity[0] + ax, velocity[1] + ay


class Applied(NamedTuple):
    """The pushes on balls before a step, the same for every engine: kicks, and the pull of the mouse as it is then."""

    kicks: Sequence[Push]
    mouse: Mouse

    def pushes(self, state: State) -> list[Push]:
        """Return what is added to the velocities of an engine's balls in a state."""
        ball = self.mouse.ball
        return [*self.kicks] if ball is None else [*self.kicks, (ball, self.mouse.pull(state))]


def after_pushes(states: States, pushes: Pushes) -> States:
    """Return states with each push already in the velocities before its step, of all but the last."""
    velocity = states.velocity.copy()
    np.add.at(velocity, (pushes["row"] - 1, pushes["ball"]), pushes["dv"])
    return states._replace(velocity=velocity)


def _free_part(way: Floats, scene: Scene, position: Floats, ball: int) -> Floats:
    """Return as much of a ball's way in a step as goes through no inner wall and no other ball, px.

    A wall counts as the plane that touches it at its point nearest to the ball. Along a wall that it touches, the ball
    slides; before any other it stops. way: (2,) px; position: (n, 2) px.
    """
    radius, here = scene.bodies.radius, position[ball]
    if scene.walls:
        start, end, half_thickness = (part[ARENA_COUNT:] for part in walls_of(scene)[:3])
        offset = nearest_on_segment(here, start, end) - here
        distance = np.maximum(length(offset), MIN_DISTANCE)
        normal = offset / distance[:, None]
        gap = distance - radius[ball] - half_thickness
        room = np.maximum(gap + radius[ball] * MAX_DEPTH, radius[ball] * MIN_DEPTH)
        for touched in np.flatnonzero(gap < radius[ball] * MAX_DEPTH):
            way = way - max(float(dot(way, normal[touched]) - room[touched]), 0.0) * normal[touched]
        way = way * min(1.0, float((room / np.maximum(dot(way, normal), MIN_DISTANCE)).min()))
    span = math.hypot(*way.tolist())
    if span <= radius[ball] * MIN_DEPTH:
        return way
    offset, reach = position - here, radius + radius[ball]
    ahead = dot(offset, way) / span
    depth = reach * reach - (dot(offset, offset) - ahead * ahead)
    hit = (ahead > 0) & (depth > 0) & ~pass_through(scene.bodies.filters[ball], scene.bodies.filters.T)
    free = np.minimum(ahead - np.sqrt(np.maximum(depth, 0)) + reach * MAX_BALL_DEPTH, reach * MAX_HIT)
    free = np.maximum(free, radius[ball] * MIN_DEPTH)
    return way * min(1.0, float(free[hit].min(initial=span)) / span)


def _at_most(length: float, x: float, y: float) -> Vector:
    """Return a vector, shortened to a length if it is longer."""
    norm = math.hypot(x, y)
    return (x, y) if norm <= length else (x * length / norm, y * length / norm)
