"""A Space beside its finer self: the same description built twice, stepped together, with the same mouse."""

from typing import Final

import numpy as np
import pymunk
from numpy.typing import NDArray

from sandbox.run.mouse import pulled
from sandbox.scene.fields import Vector
from sandbox.space.contents import DEFAULT_DT
from sandbox.space.description import BodyType, Rebuilt, SpaceDescription, rebuild
from sandbox.text import counted

MIN_SUBSTEPS: Final = 4
ITERATIONS: Final = 40  # at least, in each substep
WORK: Final = 50_000  # things x substeps x iterations of a step: about 8 ms, half a frame
VISIBLE: Final = 1 / 500  # of the width or height of what is shown, whichever is larger: about a pixel of a pane
MARGIN: Final = 0.04  # of the view, round the shapes
COARSE, FINE = SIDES = 0, 1


class SideBySide:
    """Two Spaces from one description: as it is, and in finer steps. Bodies go by their index in the description.

    dt: s, of the steps of the first; in each, the second does `substeps`. view: left, top, right and bottom of the
    shapes at the start, px. visible: px, the distance that counts as apart.
    """

    def __init__(self, description: SpaceDescription) -> None:
        self.description = description
        self.dt = description.current_time_step or DEFAULT_DT
        dynamic = [body.body_type is BodyType.DYNAMIC and body.in_space for body in description.bodies]
        self._dynamic = np.flatnonzero(dynamic)
        self.iterations = max(ITERATIONS, description.settings.iterations)
        things = len(self._dynamic) + len(description.constraints)
        most = WORK / max(1, things) / self.iterations
        self.substeps = next(n for n in (64, 32, 16, 8, MIN_SUBSTEPS) if n <= max(most, MIN_SUBSTEPS))
        finer = {"iterations": self.iterations, "sleep_time_threshold": float("inf")}
        settings = description.settings.model_copy(update=finer)
        self._finer = description.model_copy(update={"settings": settings, "sleeping": ()})
        self.sides: tuple[Rebuilt, ...] = ()
        self.restart()
        self.view = self._view()
        left, top, right, bottom = self.view
        self.visible = VISIBLE * max(right - left, bottom - top)

    def restart(self) -> None:
        """Build both again, and let go of what is held."""
        self.close()
        self.sides = rebuild(self.description), rebuild(self._finer)
        self.steps = 0
        self.held: tuple[int, Vector] | None = None  # a body, and where its position is pulled to
        self.apart_since: float | None = None  # s
        self.broken = ""  # why no further step is possible

    def close(self) -> None:
        """Wake all bodies: Pymunk may abort the process when Python frees a Space with bodies that sleep."""
        for side in self.sides:
            for body in side.space.bodies:
                body.activate()

    @property
    def names(self) -> tuple[str, str]:
        """What the two are called."""
        return "pymunk", f"pymunk in {self.substeps} substeps, {self.iterations} iterations"

    @property
    def time(self) -> float:
        """Since the start, s."""
        return self.steps * self.dt

    def step(self) -> None:
        """Do a step of the first, and the substeps of the second, unless a number in them is no longer finite."""
        if self.broken:
            return
        self._do(COARSE, 1)
        self._do(FINE, self.substeps)
        self.steps += 1
        for side, name in zip(SIDES, self.names, strict=True):
            lost = np.flatnonzero(~np.isfinite(self._positions(side)).all(axis=1))
            if len(lost) and not self.broken:
                self.broken = (
                    f"{name}: the position of bodies[{self._dynamic[lost[0]]}] is not finite at {self.time:.2f} s"
                )
        if self.apart_since is None and self.gap[0] > self.visible:
            self.apart_since = self.time

    @property
    def gap(self) -> tuple[float, int | None]:
        """The largest distance between a body's two positions, px, and which body; None if none is dynamic."""
        if not len(self._dynamic):
            return 0.0, None
        distance = np.hypot(*(self._positions(FINE) - self._positions(COARSE)).T)
        row = int(np.nan_to_num(distance, nan=np.inf).argmax())
        return float(distance[row]), int(self._dynamic[row])

    @property
    def readout(self) -> str:
        """How far the two are apart, since when, and what both lack of the program."""
        lost = len(self.description.callables)
        return f"{self._apart}; without {counted(lost, 'function')} of the program" if lost else self._apart

    @property
    def _apart(self) -> str:
        if self.broken:
            return self.broken
        gap, body = self.gap
        if body is None:
            return "no dynamic body"
        apart = f"{gap:.3g} px apart (bodies[{body}])" if gap else "not apart"
        if self.apart_since is None:
            return f"{apart}; never more than {self.visible:.2g} px apart so far"
        return f"{apart}; first more than {self.visible:.2g} px apart at {self.apart_since:.2f} s"

    # The mouse

    def grab(self, side: int, at: Vector) -> None:
        """Grab the dynamic body at a point of one of the two, px."""
        hit = self.sides[side].space.point_query_nearest(at, 0, pymunk.ShapeFilter())
        body = hit.shape.body if hit and hit.shape else None
        if body in self.sides[side].bodies and body and body.body_type == pymunk.Body.DYNAMIC:
            self._offset = body.position.x - at[0], body.position.y - at[1]
            self.held = self.sides[side].bodies.index(body), (body.position.x, body.position.y)

    def move(self, at: Vector) -> None:
        """Pull the body that is held, so that the point where it was grabbed is at a point, px."""
        if self.held:
            self.held = self.held[0], (at[0] + self._offset[0], at[1] + self._offset[1])

    def release(self) -> None:
        """Let go."""
        self.held = None

    def _do(self, number: int, substeps: int) -> None:
        side = self.sides[number]
        forces = [(body, body.force, body.torque) for body in side.bodies if any(body.force) or body.torque]
        for _ in range(substeps):
            for body, force, torque in forces:  # which Pymunk resets after each step
                body.force, body.torque = force, torque
            if self.held:
                body, h = side.bodies[self.held[0]], self.dt / substeps
                body.velocity = pulled(tuple(body.position), tuple(body.velocity), self.held[1], h)
            side.space.step(self.dt / substeps)

    def _positions(self, side: int) -> NDArray[np.float64]:
        bodies = self.sides[side].bodies
        return np.array([bodies[index].position for index in self._dynamic]).reshape(-1, 2)

    def _view(self) -> tuple[float, float, float, float]:
        boxes = [shape.bb for shape in self.sides[COARSE].shapes]
        if not boxes:
            return 0.0, 0.0, 1.0, 1.0
        left, top = min(box.left for box in boxes), min(box.bottom for box in boxes)
        right, bottom = max(box.right for box in boxes), max(box.top for box in boxes)
        margin = MARGIN * max(right - left, bottom - top) or 1.0
        return left - margin, top - margin, right + margin, bottom + margin
