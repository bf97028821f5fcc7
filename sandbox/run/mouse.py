"""The control law of the mouse: how a held ball is pulled to the pointer, in every engine alike."""

import math
from collections.abc import Sequence
from typing import Final

from sandbox.run.edits import DeleteBall
from sandbox.run.inputs import End, Grab, Input, Move, Release
from sandbox.scene.model import Scene, Vector

PULL: Final = 25.0  # 1/s, of the critically damped pull: a ball is at the pointer within about a fifth of a second


MOST_PULL: Final = 40_000.0  # px/s², the hand's greatest acceleration, whatever the scene's gravity


BRAKE: Final = MOST_PULL / PULL**2  # px from the target; a ball that comes from further must be able to brake


class Hand:
    """The mouse in every engine: a critically damped pull of one ball to a point inside the arena.

    The pull is backward Euler's step of x'' = -w² (x - target) - 2 w x', which from rest does not overshoot, and
    blows up at no rate. Its acceleration is finite, so it goes no faster than it can brake; and it moves a ball by
    at most the ball's radius a step, so that walls and other balls stay solid to it.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene  # that runs: an edit replaces it
        self.ball: int | None = None
        self.target: Vector = (0.0, 0.0)

    def obey(self, given: Input) -> None:
        """Take, move or release as an input says."""
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
        """Return the change of the held ball's velocity for one step, px/s, from where it is and how it moves."""
        assert self.ball is not None
        h, w = 1 / self.scene.rate, PULL
        vx, vy = (
            (v - h * w * w * (x - to)) / (1 + h * w) ** 2
            for x, v, to in zip(position, velocity, self.target, strict=True)
        )
        vx, vy = _at_most(float(self.scene.bodies.radius[self.ball]) / h, vx, vy)
        dx, dy = (to - x for x, to in zip(position, self.target, strict=True))
        if vx * dx + vy * dy > 0 and math.hypot(dx, dy) > BRAKE:
            vx, vy = _at_most(math.sqrt(MOST_PULL * math.hypot(dx, dy)), vx, vy)
        return _at_most(MOST_PULL * h, vx - velocity[0], vy - velocity[1])


def _at_most(length: float, x: float, y: float) -> Vector:
    norm = math.hypot(x, y)
    return (x, y) if norm <= length else (x * length / norm, y * length / norm)
