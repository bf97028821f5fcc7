"""An engine in a package of its own: discs in a box, with the textbook's impulse."""

from collections.abc import Iterable

import numpy as np

import sandbox

SIDES = ((0, -1), (1, -1), (0, 1), (1, 1))  # axis and outward direction of the left, top, right and bottom wall


class Bouncer:
    """Moves the discs, turns them round at the walls, and then lets those that overlap collide."""

    @staticmethod
    def check(scene: sandbox.Scene) -> None:
        """Raise Refused for what this engine lacks."""
        if scene.walls or not scene.arena.walls or scene.turns:
            raise sandbox.Refused("bouncer: has a box and discs that do not turn; use --engines impulse")

    def __init__(self, scene: sandbox.Scene, initial: sandbox.State) -> None:
        self.check(scene)
        self.scene, self.balls, self.steps = scene, scene.bodies, 0
        self.position, self.velocity = initial.position.copy(), initial.velocity.copy()

    def step(self) -> None:
        """Advance by one step."""
        self.steps += 1
        self.velocity += np.divide(self.scene.gravity, self.scene.rate)
        self.position += self.velocity / self.scene.rate
        for axis, direction in SIDES:
            edge = self.scene.arena.size[axis] if direction > 0 else 0
            outside = direction * (self.position[:, axis] - edge) + self.balls.radius > 0
            leaving = outside & (direction * self.velocity[:, axis] > 0)
            elasticity = self.balls.elasticity[leaving] * self.scene.arena.elasticity
            self.velocity[leaving, axis] *= -elasticity
        for i in range(len(self.position)):
            for j in range(i):
                self.collide(i, j)

    def collide(self, i: int, j: int) -> None:
        """Let two discs that overlap and approach each other collide."""
        way = self.position[j] - self.position[i]
        distance = float(np.hypot(*way))
        normal, mass = way / distance, self.balls.mass
        approach = float((self.velocity[i] - self.velocity[j]) @ normal)
        if distance < self.balls.radius[i] + self.balls.radius[j] and approach > 0:
            e = self.balls.elasticity[i] * self.balls.elasticity[j]
            impulse = (1 + e) * approach / (1 / mass[i] + 1 / mass[j])
            self.velocity[i] -= impulse / mass[i] * normal
            self.velocity[j] += impulse / mass[j] * normal

    def state(self) -> sandbox.State:
        """Return a snapshot."""
        return sandbox.State(self.steps / self.scene.rate, self.position.copy(), self.velocity.copy())

    def kick(self, ball: int, dv: Iterable[float]) -> None:
        """Add dv (px/s) to a ball's velocity, for the mouse."""
        self.velocity[ball] += np.fromiter(dv, float)
