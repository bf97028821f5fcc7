"""What passes, what is tied, and what cannot be known of an engine is said so."""

from itertools import pairwise
from typing import Final

import numpy as np
import pytest
from conftest import scene_of
from faults import FAULTS, judged
from verdicts import causes_of, on_states, states_of

from sandbox.judge.causes import Cause
from sandbox.judge.summary import Verdict
from sandbox.scene.model import Scene
from sandbox.state import States

DT: Final = 1 / 60
ROUGH: Final = scene_of(  # without gravity; the walls are rougher than the balls
    "count = 8\nradius = 20\nspeed = 200\nspin = {from = -20, to = 20}\nfriction = 0.5\n"
    "inside = [[20, 20], [380, 280]]",
    size="[400, 300]\nfriction = 0.8",
    more="seed = 1\nseconds = 1",
)
INNER: Final = "\n[[walls]]\nfrom = [400, 0]\nto = [400, 600]\nthickness = 6"


def along_x(scene: Scene, *balls: tuple[list[float], list[float]]) -> Verdict:
    """Judge balls that move along x, by their places and velocities in each row."""
    states = States.empty(len(balls[0][0]), len(balls))
    states.position[..., 1], states.velocity[..., 1] = 300.0, 0.0
    for ball, (x, v) in enumerate(balls):
        states.position[:, ball, 0], states.velocity[:, ball, 0] = x, v
    return on_states(scene, states)


def test_a_ball_that_is_found_in_a_wall_a_step_later_is_late_and_did_not_pass() -> None:
    """It is 0.26 px deep at the end of a step, and bounces in the next: as in a bowl of Pymunk."""
    scene = scene_of(f"radius = 16\nposition = [380.93, 300]{INNER}")
    x = [380.93, 381.26, 380.93, 380.6]
    verdict = along_x(scene, (x, [20.0, 20.0, -20.0, -20.0]))
    assert Cause.MISSED not in causes_of(verdict)


@pytest.mark.parametrize("v", [110.0, 700.0, 1300.0, 3700.0])
@pytest.mark.parametrize("body", ["wall", "ball"])
def test_what_flies_through_another_passes_once(body: str, v: float) -> None:
    """In many steps, or within one."""
    other = INNER if body == "wall" else "\n[[balls]]\nradius = 8\nposition = [400, 300]"
    x = [370 + v * DT * k for k in range(6 + int(80 / v / DT))]
    ball = f"radius = 4\nposition = [370, 300]{other}"
    verdict = along_x(scene_of(ball), (x, [v] * len(x)), *([([400.0] * len(x), [0.0] * len(x))] * (body == "ball")))
    assert [(each.cause, each.contacts) for each in verdict.causes] == [(Cause.MISSED, 1)]
    reach = 7 if body == "wall" else 12
    [error] = verdict.errors
    assert (error["first"], error["second"]) == (0, ~4 if body == "wall" else 1)
    assert error["step"] == 1 + int((30 - reach) / v / DT)  # in which the two touch
    assert error["speed"] == pytest.approx(2 * v)  # which the impulse would have changed


@pytest.mark.parametrize("x", [[300.0, 304.0], [300.0, 304.0, 304.0, 304.0]])
def test_what_has_not_passed_yet_is_not_missed(x: list[float]) -> None:
    """The two overlap by 2 px at the end, one still in flight, or at rest."""
    scene = scene_of("radius = 20\nposition = [300, 300]", "radius = 20\nposition = [342, 300]")
    v = [240.0, 240.0] if len(x) == 2 else [240.0, 0.0, 0.0, 0.0]
    assert Cause.MISSED not in causes_of(along_x(scene, (x, v), ([342.0] * len(x), [0.0] * len(x))))


def test_no_ball_in_a_bowl_of_pymunk_passes() -> None:
    """Fifteen balls fall into a bowl of twelve pieces, and none is outside at the end."""
    angles = np.linspace(0, np.pi, 13)
    rim = [(400 + 250 * np.cos(a), 200 + 250 * np.sin(a)) for a in angles.tolist()]
    walls = "\n".join(
        f"[[walls]]\nfrom = [{a[0]}, {a[1]}]\nto = [{b[0]}, {b[1]}]\nthickness = 6" for a, b in pairwise(rim)
    )
    balls = f"count = 15\nradius = 16\ninside = [[300, 60], [500, 190]]\nelasticity = 0.5\n{walls}"
    scene = scene_of(balls, more="gravity = [0, 900]\nseconds = 2")
    states = states_of(scene, "pymunk")
    assert (np.hypot(*(states.position - (400, 200)).transpose(2, 0, 1)) < 250).all()
    assert Cause.MISSED not in causes_of(on_states(scene, states))


def test_laws_that_fit_alike_are_both_said() -> None:
    """Where friction of 0.5 + 0.8 stops every slip, no limit and the sum of the factors do the same."""
    verdict = judged(FAULTS["NoLimitOfFriction"].engine, ROUGH)
    [large] = [each for each in verdict.causes if each.cause == Cause.FRICTION_LARGE]
    errors = verdict.errors[verdict.errors["cause"] == Cause.FRICTION_LARGE]
    assert "or:" in large.sentence or set(errors["law"]) == {"no limit"}
    assert {*errors["law"], *errors["also"]} >= {"no limit"}


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_an_engine_without_spins_is_known_where_balls_would_turn(friction: float) -> None:
    scene = scene_of(f"radius = 20\nposition = [300, 300]\nfriction = {friction}", size="[800, 600]\nfriction = 1")
    verdict = along_x(scene, ([300.0, 301, 302, 303], [60.0] * 4))
    assert verdict.is_spinless == bool(friction)
    assert not on_states(scene, states_of(scene, "exact")).errors.size


def test_contacts_that_are_soft_are_not_judged() -> None:
    """Two that overlap while one is slowed down and turned are no errors of an engine whose contacts last."""
    scene = scene_of("radius = 20\nposition = [300, 300]", "radius = 20\nposition = [345, 300]")
    states = States.empty(5, 2)
    states.position[:], states.velocity[:] = 300.0, 0.0
    states.position[:, 0, 0], states.velocity[:, 0, 0] = [300, 302, 304, 303, 301], [120, 120, 60, -60, -120]
    states.position[:, 1, 0] = 345
    assert causes_of(on_states(scene, states))
    verdict = on_states(scene, states, is_soft=True)
    assert not verdict.causes
    assert sum(entry.energy for entry in verdict.ledger) == pytest.approx(0, abs=1e-6)
