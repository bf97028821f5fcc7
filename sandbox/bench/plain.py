"""Baselines: engines in plain Python, and a Pymunk space as a user would set it up."""

import heapq
import math

import pymunk

from sandbox.engines.pymunk import WALL_HALF_THICKNESS
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn


def plain_space(scene: Scene) -> pymunk.Space:
    """Return a space with the scene's elastic balls and arena, to be run by `space.step(1 / scene.rate)`.

    It has only what a user would write, and so costs the same. Tests of contacts and settings therefore have a loop of
    their own.
    """
    space = pymunk.Space()
    initial, bodies = spawn(scene), scene.bodies
    for ball, (position, velocity) in enumerate(zip(initial.position.tolist(), initial.velocity.tolist(), strict=True)):
        mass, radius = float(bodies.mass[ball]), float(bodies.radius[ball])
        body = pymunk.Body(mass, pymunk.moment_for_circle(mass, 0, radius))
        body.position, body.velocity = position, velocity
        circle = pymunk.Circle(body, radius)
        circle.elasticity = 1
        space.add(body, circle)
    (width, height), far = scene.arena.size, WALL_HALF_THICKNESS
    corners = [(-far, -far), (width + far, -far), (width + far, height + far), (-far, height + far)]
    for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
        wall = pymunk.Segment(space.static_body, a, b, far)
        wall.elasticity = 1
        space.add(wall)
    return space


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


class PlainDiscs:
    """The textbook's event-driven discs: one heap of predicted collisions, from which stale ones are skipped.

    After R. Sedgewick and K. Wayne, Algorithms (4th ed.), section 6.1; all discs equal and elastic.
    """

    def __init__(self, scene: Scene) -> None:
        initial = spawn(scene)
        self.x, self.v = initial.position.tolist(), initial.velocity.tolist()
        self.radius, self.size = float(scene.bodies.radius[0]), scene.arena.size
        self.time = 0.0
        self.hits = [0] * len(self.x)  # collisions of each disc, by which stale events are recognised
        self.events: list[tuple[float, int, int, int, int]] = []
        for i in range(len(self.x)):
            self._predict(i)

    def _predict(self, i: int) -> None:
        (x, y), (vx, vy), r = self.x[i], self.v[i], self.radius
        for axis, (c, v) in enumerate(((x, vx), (y, vy))):
            if v:
                t = ((self.size[axis] - r if v > 0 else r) - c) / v
                heapq.heappush(self.events, (self.time + t, i, ~axis, self.hits[i], 0))
        for j, ((ox, oy), (ovx, ovy)) in enumerate(zip(self.x, self.v, strict=True)):
            dx, dy, dvx, dvy = ox - x, oy - y, ovx - vx, ovy - vy
            b = dx * dvx + dy * dvy
            if b < 0:
                discriminant = b * b - (dvx * dvx + dvy * dvy) * (dx * dx + dy * dy - 4 * r * r)
                if discriminant > 0:
                    t = (dx * dx + dy * dy - 4 * r * r) / (-b + math.sqrt(discriminant))
                    heapq.heappush(self.events, (self.time + max(0.0, t), i, j, self.hits[i], self.hits[j]))

    def collide(self) -> None:
        """Advance to the next collision of two discs."""
        while True:
            time, i, j, hits_i, hits_j = heapq.heappop(self.events)
            if self.hits[i] != hits_i or (j >= 0 and self.hits[j] != hits_j):
                continue
            for x, v in zip(self.x, self.v, strict=True):
                x[0] += v[0] * (time - self.time)
                x[1] += v[1] * (time - self.time)
            self.time = time
            self.hits[i] += 1
            if j < 0:
                self.v[i][~j] *= -1
                self._predict(i)
                continue
            self.hits[j] += 1
            nx, ny = ((b - a) / (2 * self.radius) for a, b in zip(self.x[i], self.x[j], strict=True))
            impulse = (self.v[i][0] - self.v[j][0]) * nx + (self.v[i][1] - self.v[j][1]) * ny
            for axis, n in enumerate((nx, ny)):
                self.v[i][axis] -= impulse * n
                self.v[j][axis] += impulse * n
            self._predict(i)
            self._predict(j)
            return
