"""Edits of a running scene: each changes the scene, the state of its balls, or both.

Like all inputs, an edit belongs to a step. After it, every engine is rebuilt from the edited scene and its own edited
state, so engines need not support edits. Their values are those of a scene's balls and walls, see `BallGroup` and
`Wall`, in the same units. Balls may overlap each other then, as at a scene's start, but walls only as deep as before.

A scene's expectations are for the scene that it was: an edit of the scene drops them.
"""
# ruff: noqa: D102 (the base class documents the methods)

import math
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise
from typing import Any, Final, Literal

import numpy as np
from pydantic import Field

from sandbox.errors import SandboxError
from sandbox.scene.balls import PER_BALL, BallGroup
from sandbox.scene.clock import Clock
from sandbox.scene.fields import PALETTE, Colour, Count, Elasticity, Index, Model, NotNegative, NotTiny, Number, Vector
from sandbox.scene.model import Scene, Wall
from sandbox.scene.overlaps import check_walls, depths_in_walls
from sandbox.state import State, States

CONSTANTS: Final = ("radius", "mass", "elasticity", "friction")  # of a ball
NO_VALUES: Final = {"step", "do", "ball", "wall", "continued"}  # fields that say when and where an edit is


class Input(Model):
    """What happens before a step. do: its kind."""

    step: Index
    do: str


class Edit(Input):
    """A change before a step."""

    @property
    def values(self) -> dict[str, Any]:
        """The new values by their names, without those that stay as they are."""
        return self.model_dump(exclude=NO_VALUES, exclude_none=True)

    def change_scene(self, scene: Scene) -> Scene:
        """Return the edited scene: by default with the new values. Raises SandboxError if it is not valid."""
        return scene.changed(**self.values, expect=())

    def change_state(self, state: State) -> State:
        """Return the edited state of an engine's balls."""
        return state

    def change_clock(self, clock: Clock) -> None:
        """Count the time from here on from the edit's step, as the engines built for it do."""
        clock.change(self.step)


class AddBall(Edit):
    """Add a ball, after all others."""

    do: Literal["add"] = "add"
    position: Vector
    """Centre, px."""
    velocity: Vector = (0, 0)
    spin: Number = 0
    radius: NotTiny
    """Radius, px."""
    mass: NotTiny = 1
    elasticity: Elasticity = 1
    friction: NotNegative = 0
    color: Colour = PALETTE[0]

    def change_scene(self, scene: Scene) -> Scene:
        values = self.values
        ball = BallGroup(colors=(values.pop("color"),), **values)
        return scene.changed(balls=[*scene.balls, ball], expect=())

    def change_state(self, state: State) -> State:
        position, velocity = np.vstack([state.position, self.position]), np.vstack([state.velocity, self.velocity])
        return State(state.time, position, velocity, np.append(state.angle, 0.0), np.append(state.spin, self.spin))


class ChangeBall(Edit):
    """Change properties of a ball; those left out, or None, stay as they are.

    Its position, velocity and spin then are the same in every engine.
    """

    do: Literal["change"] = "change"
    ball: Index
    x: Number | None = None
    y: Number | None = None
    vx: Number | None = None
    vy: Number | None = None
    spin: Number | None = None
    radius: NotTiny | None = None
    mass: NotTiny | None = None
    elasticity: Elasticity | None = None
    friction: NotNegative | None = None
    color: Colour | None = None

    def change_scene(self, scene: Scene) -> Scene:
        """Let the ball be a group of its own. The others keep their numbers and colours."""
        before, group, after = _split(scene, self.ball)
        width, height = scene.arena.size
        group = BallGroup(
            # Where the ball is belongs to the state; a coordinate that is not given is any in the arena.
            position=(width / 2 if self.x is None else self.x, height / 2 if self.y is None else self.y),
            spin=group.spin if self.spin is None else self.spin,
            colors=(self.color or scene.colors[self.ball],),
            filter=group.filter,
            **{key: self.values.get(key, getattr(group, key)) for key in CONSTANTS},
        )
        return scene.changed(balls=[*before, group, *after], expect=())

    def change_state(self, state: State) -> State:
        state = state.copy()
        for values, changes in ((state.position, (self.x, self.y)), (state.velocity, (self.vx, self.vy))):
            for axis, value in enumerate(changes):
                if value is not None:
                    values[self.ball, axis] = value
        if self.spin is not None:
            state.spin[self.ball] = self.spin
        return state


class DeleteBall(Edit):
    """Delete a ball; the numbers of those after it decrease by one."""

    do: Literal["delete"] = "delete"
    ball: Index

    def change_scene(self, scene: Scene) -> Scene:
        """Remove the ball from its group. The others keep their colours."""
        before, _, after = _split(scene, self.ball)
        return scene.changed(balls=[*before, *after], expect=())

    def change_state(self, state: State) -> State:
        kept = (np.delete(getattr(state, name), self.ball, axis=0) for name in States._fields)
        return State(state.time, *kept)


class SetVelocity(Edit):
    """Set the velocity of a ball."""

    do: Literal["velocity"] = "velocity"
    ball: Index
    velocity: Vector
    """Velocity, px/s."""

    def change_scene(self, scene: Scene) -> Scene:
        check_ball(self.ball, scene)
        return scene

    def change_state(self, state: State) -> State:
        velocity = state.velocity.copy()
        velocity[self.ball] = self.velocity
        return replace(state, velocity=velocity)


class AddWall(Wall, Edit):
    """Add a wall, after all others."""

    do: Literal["add-wall"] = "add-wall"

    def change_scene(self, scene: Scene) -> Scene:
        return scene.changed(walls=[*scene.walls, Wall(**self.values)], expect=())


class ChangeWall(Edit):
    """Change a wall: its ends, its thickness, its elasticity, its friction; those left out, or None, stay.

    The wall stands still during every step: it does no work on the balls.
    """

    do: Literal["change-wall"] = "change-wall"
    wall: Index
    """Its number among the scene's own walls, from 0."""
    start: Vector | None = Field(None, validation_alias="from", serialization_alias="from")
    to: Vector | None = None
    thickness: NotNegative | None = None
    elasticity: Elasticity | None = None
    friction: NotNegative | None = None
    continued: Literal[True] | None = None
    """Whether this goes on with what the edit before it belongs to, so that both are undone together."""

    def change_scene(self, scene: Scene) -> Scene:
        check_wall(self.wall, scene)
        walls = list(scene.walls)
        walls[self.wall] = Wall(**walls[self.wall].model_dump() | self.values)
        return scene.changed(walls=walls, expect=())


class DeleteWall(Edit):
    """Delete a wall; the numbers of those after it decrease by one."""

    do: Literal["delete-wall"] = "delete-wall"
    wall: Index
    """Its number among the scene's own walls, from 0."""

    def change_scene(self, scene: Scene) -> Scene:
        check_wall(self.wall, scene)
        return scene.changed(walls=scene.walls[: self.wall] + scene.walls[self.wall + 1 :], expect=())


class SetElasticity(Edit):
    """Set the elasticity of every contact."""

    do: Literal["elasticity"] = "elasticity"
    elasticity: Elasticity

    def change_scene(self, scene: Scene) -> Scene:
        return with_every_contact(scene, "elasticity", self.elasticity)


class SetGravity(Edit):
    """Set the gravity, px/s², y down."""

    do: Literal["gravity"] = "gravity"
    gravity: Vector


class SetRate(Edit):
    """Set the number of steps per second."""

    do: Literal["rate"] = "rate"
    rate: Count

    def change_clock(self, clock: Clock) -> None:
        clock.change(self.step, self.rate)


def with_every_contact(scene: Scene, key: str, value: float) -> Scene:
    """Return a scene in which every contact has an elasticity or a friction, and without its expectations.

    That of a contact is the product of two factors, so each factor becomes the square root.
    """
    factor = {key: math.sqrt(value)}
    return scene.changed(
        arena=scene.arena.model_copy(update=factor),
        balls=tuple(group.model_copy(update=factor) for group in scene.balls),
        walls=tuple(wall.model_copy(update=factor) for wall in scene.walls),
        expect=(),
    )


def edited(scene: Scene, edit: Edit, states: Mapping[str, State]) -> Scene:
    """Return a scene after an edit. states: each engine's, before it.

    Raises SandboxError if the scene is not valid then, or a ball of an engine would be deeper in a wall than any was.
    """
    changed = edit.change_scene(scene)
    for name, state in states.items():
        deepest = float(depths_in_walls(scene, state.position).max())
        try:
            check_walls(changed, edit.change_state(state).position, deepest)
        except SandboxError as error:
            raise SandboxError(f"{name}: {error}") from None
    return changed


def edited_scenes(scene: Scene, inputs: Iterable[object]) -> Iterator[Scene]:
    """Yield the scene as it is at the start, and after each edit among inputs. Impossible edits are left out."""
    yield scene
    for edit in inputs:
        if isinstance(edit, Edit):
            with suppress(SandboxError):  # which the run reports
                scene = edit.change_scene(scene)
                yield scene


_OfBall = AddBall | ChangeBall | DeleteBall | SetVelocity
_OfWall = AddWall | ChangeWall | DeleteWall
AnyEdit = _OfBall | _OfWall | SetElasticity | SetGravity | SetRate


def check_ball(ball: int, scene: Scene) -> None:
    """Raise SandboxError if a scene has no ball of this number."""
    if ball >= len(scene.bodies):
        raise SandboxError(f"ball must be at most {len(scene.bodies) - 1}, got {ball}")


def check_wall(wall: int, scene: Scene) -> None:
    """Raise SandboxError if a scene has no wall of its own of this number."""
    if wall >= len(scene.walls):
        raise SandboxError(f"wall must be the number of one of the scene's {len(scene.walls)} own walls, got {wall}")


def _split(scene: Scene, ball: int) -> tuple[list[BallGroup], BallGroup, list[BallGroup]]:
    """Return the groups before a ball, its own, and those after it, all with their colours.

    Raises SandboxError if there is no such ball.
    """
    check_ball(ball, scene)
    groups, own, first = list[BallGroup](), 0, 0
    for group in scene.balls:
        end = first + group.ball_count
        for start, stop in pairwise([first, *(cut for cut in (ball, ball + 1) if first < cut < end), end]):
            lists = {key: values[start - first : stop - first] for key in PER_BALL if (values := getattr(group, key))}
            own = len(groups) if start == ball else own
            changes = {"count": stop - start, "colors": scene.colors[start:stop], **lists}
            groups.append(group.model_copy(update=changes))
        first = end
    return groups[:own], groups[own], groups[own + 1 :]
