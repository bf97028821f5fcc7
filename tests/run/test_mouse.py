"""The mouse's control law: a critically damped pull that is bounded and never overshoots."""

import math

import numpy as np
import pytest
from conftest import scene_of
from hypothesis import given
from hypothesis import strategies as st

from sandbox.run.inputs import End, Grab, Input, Move, Release
from sandbox.run.lockstep import Lockstep
from sandbox.run.mouse import MAX_PULL_ACCELERATION, PULL_RATE, Mouse
from sandbox.scene.files import parse
from sandbox.scene.model import Scene
from sandbox.state import Floats, State


def state_of(position: tuple[float, float], velocity: tuple[float, float]) -> State:
    """Return the state of a single ball."""
    return State(0.0, np.array([position]), np.array([velocity]))


def pulled(scene: Scene, to: float, x: float, v: float, steps: int) -> tuple[Floats, Floats]:
    """Pull a ball along x with no other force; return its positions and velocities, including the start."""
    mouse = Mouse(scene)
    mouse.apply(Grab(step=0, ball=0, at=(to, 300)))
    path, speeds = [x], [v]
    for _ in range(steps):
        dv = mouse.pull(state_of((path[-1], 300), (speeds[-1], 0)))
        assert dv[1] == 0
        speeds.append(speeds[-1] + dv[0])
        path.append(path[-1] + speeds[-1] / scene.rate)
    return np.array(path), np.array(speeds)


@given(rate=st.integers(1, 2000), away=st.floats(-30, 30), v=st.floats(-200, 200))
def test_the_pull_is_critically_damped_and_integrated_by_backward_euler(rate: int, away: float, v: float) -> None:
    # Both eigenvalues of the step are 1 / (1 + h w), so x_n - target = (c0 + c1 n) / (1 + h w)^n.
    scene = scene_of("radius = 250\nposition = [400, 300]", more=f"rate = {rate}")
    position, _ = pulled(scene, 400, 400 + away, v, 50)
    h, w = 1 / rate, 25.0
    assert w == PULL_RATE
    n = np.arange(51)
    expected = (away + n * (h * w * away + h * v) / (1 + h * w)) / (1 + h * w) ** n
    assert position - 400 == pytest.approx(expected, abs=1e-9)


@pytest.mark.wide
@given(rate=st.integers(1, 5000), radius=st.floats(1, 100), fraction=st.floats(0, 1), back=st.booleans())
def test_the_pull_never_overshoots_at_any_rate(rate: int, radius: float, fraction: float, back: bool) -> None:
    group = f"radius = {radius!r}\nposition = [400, 300]"
    start, far = (800 - radius, radius) if back else (radius, 800 - radius)
    target = start + fraction * (far - start)
    position, _ = pulled(scene_of(group, more=f"rate = {rate}"), target, start, 0, min(3 * rate, 400))
    left = (position - target) * math.copysign(1, start - target)
    assert left.min() >= -1e-9
    assert (np.diff(left) <= 1e-9).all()


def test_a_held_ball_arrives_within_half_a_second_across_the_arena() -> None:
    scene = scene_of("radius = 20\nposition = [400, 300]")
    position, velocity = pulled(scene, 780, 20, 0, 60)
    assert position[-1] == pytest.approx(780, abs=0.5)
    assert abs(velocity[-1]) < 10
    near, _ = pulled(scene, 420, 400, 0, 12)
    assert near[-1] == pytest.approx(420, abs=1.5)


@given(
    rate=st.integers(1, 2000),
    radius=st.floats(0.5, 200),
    at=st.tuples(st.floats(-1e4, 1e4), st.floats(-1e4, 1e4)),
    where=st.tuples(st.floats(0, 800), st.floats(0, 600)),
    v=st.tuples(st.floats(-5e3, 5e3), st.floats(-5e3, 5e3)),
)
def test_the_acceleration_is_bounded(
    rate: int, radius: float, at: tuple[float, float], where: tuple[float, float], v: tuple[float, float]
) -> None:
    mouse = Mouse(scene_of(f"radius = {radius!r}\nposition = [400, 300]", more=f"rate = {rate}"))
    mouse.apply(Grab(step=0, ball=0, at=at))
    dv = mouse.pull(state_of(where, v))
    assert MAX_PULL_ACCELERATION == 40_000
    assert math.hypot(*dv) * rate <= 40_000 * (1 + 1e-12)


def crossing(radius: float, more: str = "") -> dict[str, Floats]:
    """Pull a ball from x = 50 px to 740 px for two seconds; return where it is after each step in every engine, px."""
    ball = f"radius = {radius}\nposition = [50, 300]"
    scene = parse(f"[arena]\nsize = [800, 600]\n[[balls]]\n{ball}\n{more}", "test.toml")
    lockstep = Lockstep(scene, ["pymunk", "impulse", "exact"], [Grab(step=0, ball=0, at=(740, 300))])
    found: dict[str, list[Floats]] = {name: [] for name in lockstep.engines}
    for _ in range(120):
        lockstep.step()
        for name, state in lockstep.states().items():
            found[name].append(state.position[0])
    return {name: np.array(path) for name, path in found.items()}


@pytest.mark.parametrize(("x", "along"), [(400, 0), (300, 200)], ids=["upright", "slanted"])
@pytest.mark.parametrize("radius", [0.5, 5, 20])
def test_an_inner_wall_stops_a_ball_that_is_pulled_against_it(radius: float, x: float, along: float) -> None:
    wall = f"[[walls]]\nfrom = [{x}, 0]\nto = [{x + along}, 600]\nthickness = 2"
    for name, path in crossing(radius, wall).items():
        before_wall = (x + along * path[:, 1] / 600 - path[:, 0]) * 600 / math.hypot(along, 600)
        assert before_wall.min() > radius / 4, name
        assert np.diff(path[:, 0]).max() > 25, name  # px a step, before the wall is near


def test_a_ball_in_the_way_of_a_small_ball_is_hit() -> None:
    other = "[[balls]]\nradius = 5\nposition = [400, 300]\nmass = 1e6\n"
    for name, path in crossing(5, other).items():
        assert 385 < path[:, 0].max() < 400, name


@given(at=st.tuples(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6)), move=st.booleans())
def test_the_target_is_clamped_to_the_arena(at: tuple[float, float], move: bool) -> None:
    mouse = Mouse(scene_of("radius = 5\nposition = [50, 50]", "radius = 30\nposition = [400, 300]"))
    mouse.apply(Grab(step=0, ball=1, at=(400, 300) if move else at))
    if move:
        mouse.apply(Move(step=1, at=at))
    x, y = mouse.target
    assert (x, y) == (sorted((30, at[0], 770))[1], sorted((30, at[1], 570))[1])


def test_a_move_without_a_ball_is_ignored_and_the_end_releases() -> None:
    mouse = Mouse(scene_of("radius = 20\ngrid = [2, 1]\nspacing = 100"))
    mouse.apply(Move(step=0, at=(100, 100)))
    assert mouse.ball is None
    mouse.apply(Grab(step=3, ball=1, at=(1, 1)))
    mouse.apply(End(step=4))
    assert mouse.ball is None


def test_a_grab_holds_from_its_step_to_the_release_in_every_engine() -> None:
    inputs: list[Input] = [Grab(step=2, ball=0, at=(420, 300)), Release(step=5)]
    lockstep = Lockstep(scene_of("radius = 5\nposition = [400, 300]"), ["pymunk", "article"], inputs)
    moved = []
    for _ in range(8):
        before = {name: state.velocity[0, 0] for name, state in lockstep.states().items()}
        lockstep.step()
        moved.append({name: state.velocity[0, 0] != before[name] for name, state in lockstep.states().items()})
    for name in ("pymunk", "article"):
        assert [step[name] for step in moved] == [False, False, True, True, True, False, False, False]
    assert lockstep.given == inputs
    ends = [state.position[0].tolist() for state in lockstep.states().values()]
    assert ends[0] == pytest.approx(ends[1], rel=1e-12)
