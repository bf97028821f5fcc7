"""The control law of the mouse: how a grabbed ball is pulled to the pointer, in every engine alike."""

import math
from collections.abc import Sequence
from typing import Final

from sandbox.run.edits import DeleteBall
from sandbox.run.inputs import End, Grab, Input, Move, Release
from sandbox.scene.fields import Vector
from sandbox.scene.model import Scene

PULL_RATE: Final = 25.0  # 1/s, of the critically damped pull: a ball reaches the pointer in about a fifth of a second
MAX_PULL_ACCELERATION: Final = 40_000.0  # px/s², whatever the scene's gravity
BRAKING_DISTANCE: Final = MAX_PULL_ACCELERATION / PULL_RATE**2  # px; further from the target the speed is limited


class Mouse:
    """The mouse, alike in every engine: a critically damped pull of one ball to a point inside the arena.

    The pull is a backward Euler step of x'' = -w² (x - target) - 2 w x', which does not overshoot from rest, and is
    stable at every rate. Its acceleration is limited, and its speed to what this acceleration can brake. It moves a
    ball by at most the ball's radius per step, so that walls and other balls stop it.
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
        x, y = (min(max(to, radius), size - radius) for to, size in zip(at, self.scene.arena.size, strict=True))
        self.target = x, y

    def pull(self, position: Sequence[float], velocity: Sequence[float]) -> Vector:
        """Return the change of the grabbed ball's velocity for one step, px/s. position: px; velocity: px/s."""
        assert self.ball is not None
        h, w = 1 / self.scene.rate, PULL_RATE
        damping = (1 + h * w) * (1 + h * w)  # not **, which is the C library's pow and has two variants
        vx, vy = (
            (v - h * w * w * (x - to)) / damping for x, v, to in zip(position, velocity, self.target, strict=True)
        )
        vx, vy = _at_most(float(self.scene.bodies.radius[self.ball]) / h, vx, vy)
        dx, dy = (to - x for x, to in zip(position, self.target, strict=True))
        if vx * dx + vy * dy > 0 and math.hypot(dx, dy) > BRAKING_DISTANCE:
            vx, vy = _at_most(math.sqrt(MAX_PULL_ACCELERATION * math.hypot(dx, dy)), vx, vy)
        return _at_most(MAX_PULL_ACCELERATION * h, vx - velocity[0], vy - velocity[1])


def _at_most(length: float, x: float, y: float) -> Vector:
    """Return a vector, shortened to a length if it is longer."""
    norm = math.hypot(x, y)
    return (x, y) if norm <= length else (x * length / norm, y * length / norm)
