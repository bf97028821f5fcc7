"""The article's program, as it is in the article: classes and loops of plain Python."""

import math

from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn


class Ball:
    """A ball of the article's program. Velocities are in px per frame."""

    def __init__(self, position: list[float], velocity: list[float], radius: float) -> None:
        self.x, self.y = position
        self.vx, self.vy = velocity
        self.radius = radius

    def update(self, width: float, height: float) -> None:
        """Move by one frame, and bounce off the walls."""
        self.x += self.vx
        self.y += self.vy
        if self.x <= self.radius or self.x >= width - self.radius:
            self.vx = -self.vx
            self.x = self.radius if self.x <= self.radius else width - self.radius
        if self.y <= self.radius or self.y >= height - self.radius:
            self.vy = -self.vy
            self.y = self.radius if self.y <= self.radius else height - self.radius


def collide(a: Ball, b: Ball) -> None:
    """Collide two balls of the article's program."""
    dx, dy = a.x - b.x, a.y - b.y
    distance = math.sqrt(dx**2 + dy**2)
    if distance < a.radius + b.radius:
        length = math.sqrt(dx * dx + dy * dy)
        nx, ny = (dx / length, dy / length) if length else (1.0, 0.0)  # the article stops at length 0
        v_n = (a.vx - b.vx) * nx + (a.vy - b.vy) * ny
        if v_n > 0:
            return
        impulse = 2 * v_n / (a.radius + b.radius)
        a.vx -= impulse * nx
        a.vy -= impulse * ny
        b.vx += impulse * nx
        b.vy += impulse * ny
        overlap = a.radius + b.radius - distance
        a.x += nx * overlap / 2
        a.y += ny * overlap / 2
        b.x -= nx * overlap / 2
        b.y -= ny * overlap / 2


class PlainArticle:
    """The article's loop in plain Python, as in the article: every ball, then every pair."""

    def __init__(self, scene: Scene) -> None:
        initial = spawn(scene)
        self.size, radius = scene.arena.size, float(scene.bodies.radius[0])
        rows = zip(initial.position.tolist(), (initial.velocity / scene.rate).tolist(), strict=True)
        self.balls = [Ball(position, velocity, radius) for position, velocity in rows]

    def step(self) -> None:
        """Play a frame, without drawing it."""
        balls = self.balls
        for ball in balls:
            ball.update(*self.size)
        for i in range(len(balls)):
            for j in range(i + 1, len(balls)):
                collide(balls[i], balls[j])
