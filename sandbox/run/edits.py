"""Edits of a running scene: each changes the scene that runs, the state of its balls, or both.

They belong to steps, as all inputs do. After one, every engine is built anew from the edited scene and its own
edited state, so that no engine needs to know of edits.
"""

import math
from collections.abc import Iterable
from typing import Final, Literal

import numpy as np

from sandbox.errors import SandboxError
from sandbox.scene.model import (
    PALETTE,
    BallGroup,
    Colour,
    Count,
    Elasticity,
    Index,
    Model,
    NotNegative,
    Scene,
    Size,
    Vector,
)
from sandbox.state import State


class Edit(Model):
    """A change made before a step."""

    step: Index
    do: str

    def change_scene(self, scene: Scene) -> Scene:
        """Return the scene as it is from now on. Raises SandboxError where there can be no such scene."""
        return scene

    def change_state(self, state: State) -> State:
        """Return an engine's balls as they go on from here."""
        return state


class AddBall(Edit):
    """One more ball, after all others."""

    do: Literal["add"] = "add"
    position: Vector
    """Centre, px."""
    velocity: Vector = (0, 0)
    """px/s."""
    radius: Size
    """px."""
    mass: Size = 1
    """kg; only ratios matter."""
    elasticity: Elasticity = 1
    """The ball's factor: a pair's elasticity is the product of the two."""
    friction: NotNegative = 0
    """The ball's factor: a pair's friction is the product of the two."""
    color: Colour = PALETTE[0]
    """A CSS colour name or #rrggbb."""

    def change_scene(self, scene: Scene) -> Scene:
        """Append the ball."""
        alike = {
            key: getattr(self, key) for key in ("position", "velocity", "radius", "mass", "elasticity", "friction")
        }
        return _with_balls(scene, [*scene.balls, BallGroup(colors=(self.color,), **alike)])

    def change_state(self, state: State) -> State:
        """Put the ball where it says."""
        position, velocity = np.vstack([state.position, self.position]), np.vstack([state.velocity, self.velocity])
        return State(state.time, position, velocity)


class DeleteBall(Edit):
    """A ball is taken away; those after it move up by one."""

    do: Literal["delete"] = "delete"
    ball: Index

    def change_scene(self, scene: Scene) -> Scene:
        """Take the ball out of its group. The others keep their colours."""
        _check_ball(self.ball, scene)
        groups, first = [], 0
        for group in scene.balls:
            colors = scene.colors[first : first + group.size]
            at = self.ball - first
            first += group.size
            if not 0 <= at < group.size:
                groups.append(group.model_copy(update={"colors": colors}) if group.colors is None else group)
            elif group.size > 1:
                left = {"count": group.size - 1, "colors": colors[:at] + colors[at + 1 :]}
                groups.append(group.model_copy(update=left))
        return _with_balls(scene, groups)

    def change_state(self, state: State) -> State:
        """Take the ball's row away."""
        return State(
            state.time, np.delete(state.position, self.ball, axis=0), np.delete(state.velocity, self.ball, axis=0)
        )


class SetVelocity(Edit):
    """A ball moves in another way from here."""

    do: Literal["velocity"] = "velocity"
    ball: Index
    velocity: Vector
    """px/s."""

    def change_scene(self, scene: Scene) -> Scene:
        """Leave the scene as it is."""
        _check_ball(self.ball, scene)
        return scene

    def change_state(self, state: State) -> State:
        """Give the ball its new velocity."""
        velocity = state.velocity.copy()
        velocity[self.ball] = self.velocity
        return State(state.time, state.position, velocity)


class SetElasticity(Edit):
    """Every pair of balls, and every ball and wall, meet with this elasticity.

    A pair's elasticity is the product of two factors, so each factor becomes the square root.
    """

    do: Literal["elasticity"] = "elasticity"
    elasticity: Elasticity

    def change_scene(self, scene: Scene) -> Scene:
        """Give everything the same factor."""
        factor = {"elasticity": math.sqrt(self.elasticity)}
        return scene.changed(
            arena=scene.arena.model_copy(update=factor),
            balls=tuple(group.model_copy(update=factor) for group in scene.balls),
            walls=tuple(wall.model_copy(update=factor) for wall in scene.walls),
            expect=(),
        )


class SetGravity(Edit):
    """Another gravity, px/s², y down."""

    do: Literal["gravity"] = "gravity"
    gravity: Vector

    def change_scene(self, scene: Scene) -> Scene:
        """Change the gravity."""
        return scene.changed(gravity=self.gravity, expect=())


class SetRate(Edit):
    """Another number of steps per second."""

    do: Literal["rate"] = "rate"
    rate: Count

    def change_scene(self, scene: Scene) -> Scene:
        """Change the rate."""
        return scene.changed(rate=self.rate, expect=())


EDITS: Final[tuple[type[Edit], ...]] = (AddBall, DeleteBall, SetVelocity, SetElasticity, SetGravity, SetRate)


def _check_ball(ball: int, scene: Scene) -> None:
    if ball >= len(scene.bodies):
        raise SandboxError(f"ball must be at most {len(scene.bodies) - 1}, got {ball}")


def _with_balls(scene: Scene, groups: Iterable[BallGroup]) -> Scene:
    """Return a scene of other balls. What was expected of the balls there were no longer holds."""
    return scene.changed(balls=tuple(groups), expect=())
