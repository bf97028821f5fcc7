"""Edits of a running scene: balls added, deleted and thrown, and what applies to all of them."""

import math
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
from sandbox.scene.model import ARENA_WALLS
from sandbox.scene.walls import segment_distance
from sandbox.session.history import Moment
from sandbox.view.notice import Notice
from sandbox.view.playback import Playback

NOTHING_SELECTED: Final = "no ball is selected: pause and click one, or use , and ."
ARENA_WALL: Final = (
    "the arena's walls cannot be changed here: they stand at its edges, with the elasticity and friction "
    "under [arena] in the scene's file"
)


class Editor:
    """Edits the run at its current step, in every engine.

    The selected ball stays selected when others are added or deleted. A wall can be selected instead; those of the
    arena cannot be changed.

    new_ball: what is set of balls to be added; in everything else they are like the selected ball, or the last.
    new_thickness: of walls to be drawn, px.
    """

    new_thickness = 4.0

    def __init__(self, playback: Playback, notice: Notice) -> None:
        self._playback = playback
        self._notice = notice
        self.new_ball: dict[str, float] = {}
        self.select(None)

    @property
    def _moment(self) -> Moment:
        return self._playback.view.moment

    @property
    def _step(self) -> int:
        return self._playback.session.step

    # The selected ball

    @property
    def selected(self) -> int | None:
        """The number of the selected ball, if it is there at the current step."""
        balls = self._moment.balls
        return balls.index(self._selected) if self._selected is not None and self._selected in balls else None

    def select(self, ball: int | None, pane: int = 0, *, by_key: bool = False) -> None:
        """Select a ball, or nothing."""
        self._selected = None if ball is None else self._moment.balls[ball]  # counted over all balls of the run
        self._wall: int | None = None
        self._pane, self.by_key = pane, by_key

    @property
    def pane(self) -> int:
        """The pane in which something was selected, if it is still there."""
        return min(self._pane, len(self._playback.view.panes) - 1)

    def show_in(self, pane: int) -> None:
        """Let what is selected be shown as it is in another pane."""
        self._pane = pane

    @property
    def selected_wall(self) -> int | None:
        """The number of the selected wall, see `Scene.wall_numbers`, if it stands."""
        return self._wall if self._wall in self._moment.scene.wall_numbers else None

    @property
    def own_wall(self) -> int | None:
        """The number of the selected wall among the scene's own, unless it is one of the arena's."""
        wall = self.selected_wall
        return wall - len(ARENA_WALLS) if wall is not None and wall >= len(ARENA_WALLS) else None

    def select_wall(self, wall: int) -> None:
        """Select a wall by its number, see `Scene.wall_numbers`."""
        self.select(None)
        self._wall = wall

    def select_next(self, by: int) -> None:
        """Select the ball so many numbers after the selected one, or before it if negative."""
        here = self.selected if self.selected is not None else -1 if by > 0 else 0
        self.select((here + by) % len(self._moment.balls), by_key=True)

    def set_velocity(self, ball: int, velocity: Vector) -> None:
        """Set a ball's velocity, px/s."""
        with self._notice.reporting():
            self.give(SetVelocity(step=self._step, ball=ball, velocity=velocity))

    # Balls that come and go

    def delete(self, ball: int | None) -> None:
        """Delete a ball, or else the selected one, or the selected wall."""
        ball = self.selected if ball is None else ball
        if ball is None and self.own_wall is not None:
            self.give(DeleteWall(step=self._step, wall=self.own_wall))
            self.select(None)
        elif ball is None and self.selected_wall is not None:
            self._notice.show(ARENA_WALL)
        elif ball is None:
            self._notice.show(NOTHING_SELECTED)
        else:
            self.give(DeleteBall(step=self._step, ball=ball))

    def size_of_new(self, key: str) -> float:
        """Return the radius (px) or the mass (kg) of a ball to be added."""
        return self._constants_of_new[key]

    @property
    def _constants_of_new(self) -> dict[str, float]:
        model, bodies = (
            len(self._moment.balls) - 1 if self.selected is None else self.selected,
            self._moment.scene.bodies,
        )
        return {key: float(getattr(bodies, key)[model]) for key in CONSTANTS} | self.new_ball

    def add(self, position: Vector | None) -> None:
        """Add a ball at rest at a position (px), moved into the arena, or else near the arena's middle."""
        moment, constants = self._moment, self._constants_of_new
        radius, colour = constants["radius"], PALETTE[len(moment.balls) % len(PALETTE)]
        with self._notice.reporting():
            at = _near_the_middle(moment, radius) if position is None else _inside(moment, position, radius)
            self.give(AddBall(step=moment.step, position=at, color=colour, **constants))

    # One ball or one wall

    def change(self, **values: object) -> None:
        """Change values of the selected ball or wall, by the names that `ChangeBall` or `ChangeWall` has for them.

        Raises SandboxError, with nothing changed, if a value is not valid.
        """
        self._playback.settle()
        if self.selected is not None:
            self._give(ChangeBall(step=self._step, ball=self.selected, **values))
        elif self.own_wall is not None:
            self._give(ChangeWall(step=self._step, wall=self.own_wall, **values))

    def give(self, edit: Edit) -> None:
        """Edit the run; show a notice if that is not possible."""
        with self._notice.reporting():
            self._give(edit)

    def _give(self, edit: Edit) -> None:
        """Edit the run. Raises SandboxError if the edit itself is not valid."""
        self._playback.settle()
        edit.change_scene(self._moment.scene)
        self._playback.give(edit)

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

    def gravity(self) -> float:
        """Return the gravity downwards, px/s²."""
        return self._moment.scene.gravity[1]

    def set_gravity(self, gravity: float) -> None:
        """Set the gravity downwards, px/s²."""
        self._playback.settle()  # the moment shown may be another step's, with another gravity sideways
        self.give(SetGravity(step=self._step, gravity=(self._moment.scene.gravity[0], gravity)))

    def rate(self) -> float:
        """Return the steps per second."""
        return self._moment.scene.rate

    def set_rate(self, rate: float) -> None:
        """Set the steps per second."""
        self.give(SetRate(step=self._step, rate=round(rate)))


def _inside(moment: Moment, position: Vector, radius: float) -> Vector:
    """Return the position inside the arena that is nearest to a position. Raises SandboxError if something is there."""
    inside = moment.scene.arena.nearest_inside(position, radius)
    if not _is_free(moment, inside, radius):
        raise SandboxError("there is no room for a ball there")
    return inside


def _near_the_middle(moment: Moment, radius: float) -> Vector:
    """Return a free position near the arena's middle. Raises SandboxError if the arena is full."""
    width, height = moment.scene.arena.size
    columns, rows = (
        np.arange(radius, side - radius * (1 - 1e-9), max(radius, side / 100)).tolist() for side in (width, height)
    )
    positions = sorted(((x, y) for x in columns for y in rows), key=lambda at: math.dist(at, (width / 2, height / 2)))
    for position in positions:
        if _is_free(moment, position, radius):
            return position
    raise SandboxError("there is no room for another ball")


def _is_free(moment: Moment, position: Vector, radius: float) -> bool:
    """Return whether a ball at a position would touch no ball of any engine, and no inner wall."""
    scene, here = moment.scene, np.array(position)
    return all(
        bool((length(state.position - here) >= scene.bodies.radius + radius).all()) for state in moment.states.values()
    ) and all(float(segment_distance(here, wall.start, wall.to)) >= radius + wall.thickness / 2 for wall in scene.walls)
