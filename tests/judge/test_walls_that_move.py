"""Laws of impacts are the same in a frame that moves uniformly: what is said at walls that all move is so too."""

from dataclasses import replace
from itertools import pairwise
from typing import Any, Final

import pytest
from faults import FAULTS, EventDriven, judged

from sandbox.scene.model import Scene
from sandbox.state import State

VELOCITY: Final = 70.0, -40.0  # px/s, of the frame
CORNERS: Final = (100, 100), (400, 100), (400, 300), (100, 300), (100, 100)
BALL: Final = {"count": 3, "radius": 15, "speed": 250, "inside": [[120, 120], [380, 280]]}
ROUGH: Final = {"friction": 0.5, "spin": {"from": -20, "to": 20}}
TABLES: Final[dict[str, dict[str, Any]]] = {
    "gas": {"balls": [BALL]},
    "gravity": {"balls": [BALL], "gravity": [0, 900]},
    "soft and falling": {"balls": [{**BALL, "elasticity": 0.8}], "gravity": [0, 900]},
    "rough and soft": {"balls": [{**BALL, **ROUGH, "elasticity": 0.8}]},
    "rough and falling": {"balls": [{**BALL, **ROUGH}], "gravity": [0, 900]},
}
INVARIANT: Final = (  # faults of contacts with walls that are the same in each frame
    *("ImpulseTooLarge", "ImpulseTooSmall", "WallsTooSoft", "FindsLate", "FindsEarly"),
    *("NoFriction", "HalfOfFriction", "TwiceTheFriction"),
)


def scene(velocity: tuple[float, float], name: str, seed: int) -> Scene:
    """Return a scene in a box of four walls that move."""
    walls = [{"from": start, "to": to, "velocity": velocity, "friction": 0.4} for start, to in pairwise(CORNERS)]
    arena = {"size": (800, 600), "walls": False}
    return Scene(arena=arena, walls=walls, seed=seed, seconds=1, **TABLES[name])


class InMovingBox:
    """An engine that another has run in a box that stands still, as one sees it who moves."""

    def __init__(self, engine: Any, still: Scene, start: State) -> None:
        class WithoutArena(engine):  # type: ignore[misc]
            def sees(self, i: int, other: int) -> bool:
                return not -4 <= other < 0 and super().sees(i, other)

        start = replace(start, velocity=start.velocity - VELOCITY)
        self._engine = WithoutArena(still, start)

    def step(self) -> None:
        self._engine.step()

    def state(self) -> State:
        state: State = self._engine.state()
        position = state.position + [state.time * v for v in VELOCITY]
        return replace(state, position=position, velocity=state.velocity + VELOCITY)


def in_moving_box(engine: Any, name: str, seed: int) -> Any:
    """Return what the judge says of an engine in a box that moves."""
    still = scene((0, 0), name, seed)
    return judged(lambda _, start: InMovingBox(engine, still, start), scene(VELOCITY, name, seed))


@pytest.mark.parametrize("name", TABLES)
def test_an_engine_without_a_fault_has_no_error(name: str) -> None:
    assert in_moving_box(EventDriven, name, 1).errors == []


@pytest.mark.parametrize("name", INVARIANT)
def test_a_fault_at_a_wall_that_moves_is_named(name: str) -> None:
    errors = in_moving_box(FAULTS[name].engine, "rough and soft", 1).errors
    assert errors
    assert {error.cause for error in errors} <= FAULTS[name].true
    assert errors[0].contact == (0, ~7)
