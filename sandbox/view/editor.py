"""Edits of a running scene: balls added, deleted and thrown, walls, and what applies to all balls."""

from typing import Final

import numpy as np

from sandbox.errors import SandboxError
from sandbox.quantity import length
from sandbox.run.edits import (
    CONSTANTS,
    AddBall,
    ChangeBall,
    ChangeWall,
    DeleteBall,
    DeleteWall,
    Edit,
    SetElasticity,
    SetGravity,
    SetRate,
    SetVelocity,
)
from sandbox.scene.fields import PALETTE, Vector
from sandbox.scene.walls import segment_distance
from sandbox.session.history import Moment
from sandbox.view.notice import Notice
from sandbox.view.playback import Playback

NOTHING_SELECTED: Final = "no ball is selected: pause and click one"


class Editor:
    """Edits the run at its current step, in every engine.

    The selected ball stays selected when others are added or deleted. A wall of the scene can be selected instead.
    """

    def __init__(self, playback: Playback, notice: Notice) -> None:
        self._playback, self._notice = playback, notice
        self.select()

    @property
    def _moment(self) -> Moment:
        return self._playback.view.moment

    @property
    def _step(self) -> int:
        return self._playback.session.step

    # What is selected

    @property
    def selected(self) -> int | None:
        """The number of the selected ball, if it is there at the current step."""
        balls = self._moment.balls
        return balls.index(self._selected) if self._selected is not None and self._selected in balls else None

    def select(self, ball: int | None = None, pane: int = 0, wall: int | None = None) -> None:
        """Select a ball, as it is in a pane, or a wall of the scene, or nothing."""
        self._selected = None if ball is None else self._moment.balls[ball]  # counted over all balls of the run
        self._wall, self._pane = wall, pane

    @property
    def pane(self) -> int:
        """The pane in which something was selected, if it is still there."""
        return min(self._pane, len(self._playback.view.panes) - 1)

    @property
    def selected_wall(self) -> int | None:
        """The number of the selected wall, if it is there."""
        return self._wall if self._wall is not None and self._wall < len(self._moment.scene.walls) else None

    # Edits

    def give(self, edit: Edit) -> None:
        """Edit the run; show a notice if that is not possible."""
        with self._notice.reporting():
            self._give(edit)

    def _give(self, edit: Edit) -> None:
        """Edit the run. Raises SandboxError if the edit itself is not valid."""
        self._playback.settle()
        edit.change_scene(self._moment.scene)
        self._playback.give(edit)

    def change(self, **values: object) -> None:
        """Change values of the selected ball or wall, by the names that `ChangeBall` or `ChangeWall` has for them.

        Raises SandboxError, with nothing changed, if a value is not valid.
        """
        self._playback.settle()
        if self.selected is not None:
            self._give(ChangeBall(step=self._step, ball=self.selected, **values))
        elif self.selected_wall is not None:
            self._give(ChangeWall(step=self._step, wall=self.selected_wall, **values))

    def set_velocity(self, ball: int, velocity: Vector) -> None:
        """Set a ball's velocity, px/s."""
        with self._notice.reporting():
            self.give(SetVelocity(step=self._step, ball=ball, velocity=velocity))

    def delete(self, ball: int | None) -> None:
        """Delete a ball, or else the selected one, or the selected wall."""
        ball = self.selected if ball is None else ball
        if ball is not None:
            self.give(DeleteBall(step=self._step, ball=ball))
        elif self.selected_wall is not None:
            self.give(DeleteWall(step=self._step, wall=self.selected_wall))
            self.select()
        else:
            self._notice.show(NOTHING_SELECTED)

    @property
    def new_ball(self) -> dict[str, float]:
        """The radius (px), mass (kg) and so on of a ball to be added: of the selected one, or else the last."""
        model, bodies = self.selected, self._moment.scene.bodies
        model = len(bodies) - 1 if model is None else model
        return {key: float(getattr(bodies, key)[model]) for key in CONSTANTS}

    def add(self, position: Vector) -> None:
        """Add a ball at rest at a position (px), moved into the arena."""
        moment, constants = self._moment, self.new_ball
        with self._notice.reporting():
            at = moment.scene.arena.nearest_inside(position, constants["radius"])
            if not _is_free(moment, at, constants["radius"]):
                raise SandboxError("there is no room for a ball there")
            colour = PALETTE[len(moment.balls) % len(PALETTE)]
            self.give(AddBall(step=moment.step, position=at, color=colour, **constants))

    # What applies to all balls

    def elasticity(self) -> float:
        """Return the elasticity between two balls like the first, to hundredths."""
        return round(float(self._moment.scene.bodies.elasticity[0]) ** 2, 2)

    @property
    def has_one_elasticity(self) -> bool:
        """Whether that is the elasticity of all contacts."""
        scene = self._moment.scene
        return len({*scene.bodies.elasticity.tolist(), *(surface.elasticity for surface in scene.surfaces)}) == 1

    def set_elasticity(self, elasticity: float) -> None:
        """Set the elasticity of every pair."""
        self.give(SetElasticity(step=self._step, elasticity=elasticity))

    def set_gravity(self, gravity: float) -> None:
        """Set the gravity downwards, px/s²."""
        self._playback.settle()  # the moment shown may be another step's, with another gravity sideways
        self.give(SetGravity(step=self._step, gravity=(self._moment.scene.gravity[0], gravity)))

    def set_rate(self, rate: float) -> None:
        """Set the steps per second."""
        self.give(SetRate(step=self._step, rate=round(rate)))


def _is_free(moment: Moment, position: Vector, radius: float) -> bool:
    """Return whether a ball at a position would touch no ball of any engine, and no inner wall."""
    scene, here = moment.scene, np.array(position)
    gaps = [length(state.position - here) - scene.bodies.radius for state in moment.states.values()]
    gaps += [segment_distance(here, wall.start, wall.to) - wall.thickness / 2 for wall in scene.walls]
    return all((np.asarray(gap) >= radius).all() for gap in gaps)
