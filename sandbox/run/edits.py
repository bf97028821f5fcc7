"""Edits of a running scene: each changes the scene, the state of its balls, or both.

Like all inputs, an edit belongs to a step. After it, every engine is rebuilt from the edited scene and its own edited
state, so engines need not support edits.
"""

from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import replace
from typing import Literal

import numpy as np

from sandbox.errors import SandboxError
from sandbox.scene.balls import BallGroup
from sandbox.scene.fields import PALETTE, Colour, Count, Elasticity, Index, Model, NotNegative, NotTiny, Number, Vector
from sandbox.scene.keys import with_every_contact
from sandbox.scene.model import Scene
from sandbox.state import State, States


class Edit(Model):
    """A change before a step."""

    step: Index
    do: str

    def change_scene(self, scene: Scene) -> Scene:
        """Return the edited scene. Raises SandboxError if it is not valid."""
        return scene

    def change_state(self, state: State) -> State:
        """Return the edited state of an engine's balls."""
        return state


class AddBall(Edit):
    """Add a ball, after all others."""

    do: Literal["add"] = "add"
    position: Vector
    """Centre, px."""
    velocity: Vector = (0, 0)
    """Velocity, px/s."""
    spin: Number = 0
    """Angular velocity, rad/s; positive is clockwise on the screen."""
    radius: NotTiny
    """Radius, px."""
    mass: NotTiny = 1
    """Mass, kg; only ratios matter."""
    elasticity: Elasticity = 1
    """The ball's factor: the elasticity of a pair is the product of its two factors."""
    friction: NotNegative = 0
    """The ball's factor: the friction of a pair is the product of its two factors."""
    color: Colour = PALETTE[0]
    """A CSS colour name or #rrggbb."""

    def change_scene(self, scene: Scene) -> Scene:
        """Append the ball."""
        ball = BallGroup(colors=(self.color,), **self.model_dump(exclude={"step", "do", "color"}))
        return _with_balls(scene, [*scene.balls, ball])

    def change_state(self, state: State) -> State:
        """Append the ball's position, velocity and spin."""
        position, velocity = np.vstack([state.position, self.position]), np.vstack([state.velocity, self.velocity])
        return State(state.time, position, velocity, np.append(state.angle, 0.0), np.append(state.spin, self.spin))


class DeleteBall(Edit):
    """Delete a ball; the numbers of those after it decrease by one."""

    do: Literal["delete"] = "delete"
    ball: Index

    def change_scene(self, scene: Scene) -> Scene:
        """Remove the ball from its group. The others keep their colours."""
        check_ball(self.ball, scene)
        groups, first = [], 0
        for group in scene.balls:
            colors = scene.colors[first : first + group.ball_count]
            index = self.ball - first  # in the group
            first += group.ball_count
            if not 0 <= index < group.ball_count:
                groups.append(group.model_copy(update={"colors": colors}) if group.colors is None else group)
            elif group.ball_count > 1:
                others = {"count": group.ball_count - 1, "colors": colors[:index] + colors[index + 1 :]}
                groups.append(group.model_copy(update=others))
        return _with_balls(scene, groups)

    def change_state(self, state: State) -> State:
        """Remove the ball from the state."""
        kept = (np.delete(getattr(state, name), self.ball, axis=0) for name in States._fields)
        return State(state.time, *kept)


class SetVelocity(Edit):
    """Set the velocity of a ball."""

    do: Literal["velocity"] = "velocity"
    ball: Index
    velocity: Vector
    """Velocity, px/s."""

    def change_scene(self, scene: Scene) -> Scene:
        """Return the scene unchanged."""
        check_ball(self.ball, scene)
        return scene

    def change_state(self, state: State) -> State:
        """Set the ball's velocity."""
        velocity = state.velocity.copy()
        velocity[self.ball] = self.velocity
        return replace(state, velocity=velocity)


class SetElasticity(Edit):
    """Set the elasticity of every contact.

    The elasticity of a contact is the product of two factors, so each factor becomes the square root.
    """

    do: Literal["elasticity"] = "elasticity"
    elasticity: Elasticity

    def change_scene(self, scene: Scene) -> Scene:
        """Set the factors of all balls and walls."""
        return with_every_contact(scene, "elasticity", self.elasticity)


class SetGravity(Edit):
    """Set the gravity, px/s², y down."""

    do: Literal["gravity"] = "gravity"
    gravity: Vector

    def change_scene(self, scene: Scene) -> Scene:
        """Set the gravity."""
        return scene.changed(gravity=self.gravity, expect=())


class SetRate(Edit):
    """Set the number of steps per second."""

    do: Literal["rate"] = "rate"
    rate: Count

    def change_scene(self, scene: Scene) -> Scene:
        """Set the rate."""
        return scene.changed(rate=self.rate, expect=())


def edited_scenes(scene: Scene, inputs: Iterable[object]) -> Iterator[Scene]:
    """Yield the scene as it is at the start, and after each edit among inputs. Impossible edits are left out."""
    yield scene
    for edit in inputs:
        if isinstance(edit, Edit):
            with suppress(SandboxError):  # which the run reports
                scene = edit.change_scene(scene)
                yield scene


AnyEdit = AddBall | DeleteBall | SetVelocity | SetElasticity | SetGravity | SetRate


def check_ball(ball: int, scene: Scene) -> None:
    """Raise SandboxError if a scene has no ball of this number."""
    if ball >= len(scene.bodies):
        raise SandboxError(f"ball must be at most {len(scene.bodies) - 1}, got {ball}")


def _with_balls(scene: Scene, groups: Iterable[BallGroup]) -> Scene:
    """Return the scene with other balls, and without its expectations, which were for the old ones."""
    return scene.changed(balls=tuple(groups), expect=())
