"""The exact step of some balls as the reference does it: where impacts are without end, or balls lean on each other."""

from collections.abc import Iterator
from typing import Final

from sandbox.engines import REFERENCE, create
from sandbox.errors import LimitReached
from sandbox.scene.balls import BallGroup, Filter
from sandbox.scene.clock import Clock
from sandbox.scene.model import Scene
from sandbox.state import Integers, State

EITHER_SIDE: Final = (0.0, 1e-9, -1e-9)  # of a step, by which a contact at its end may fall into the next


def reference_steps(scene: Scene, balls: Integers, start: State, dt: float) -> Iterator[State]:
    """Yield how the reference ends a step of some of a scene's balls, with contacts at the step's end and without.

    start: of these balls; dt: s.
    """
    bodies, (width, height) = scene.bodies, scene.arena.size
    groups = [
        BallGroup(
            position=(width / 2, height / 2),  # they begin where `start` says
            filter=dict(zip(Filter.model_fields, bodies.filters[ball].tolist(), strict=True)),
            **{name: float(getattr(bodies, name)[ball]) for name in ("radius", "mass", "elasticity", "friction")},
        )
        for ball in balls.tolist()
    ]
    alone = scene.changed(balls=groups, expect=())
    for share in EITHER_SIDE:
        engine = create(REFERENCE, alone.timed(Clock(1 / (dt * (1 + share)))), start.copy())
        try:
            engine.step()
        except LimitReached:
            return
        yield engine.state()
