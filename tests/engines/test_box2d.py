"""Box2D's own numbers come through, and a scene's elasticities, frictions and walls reach it."""

import sys

import numpy as np
import pytest
from conftest import LIBRARIES_REQUIRED, ball_at, scene_of

from sandbox import simulate
from sandbox.engines import create, registry
from sandbox.engines.engine import RunningEngine
from sandbox.errors import Refused, SandboxError
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.state import Floats

if not LIBRARIES_REQUIRED:
    pytest.importorskip("pyb2d3")


FLOAT32 = 2e-7  # relative: two units in the last place


def pair(more: str = "", b: float = 0, **second: float) -> Scene:
    """Throw a ball of 1 kg along x at 200 px/s at one at rest, with b px between its line of flight and the other."""
    balls = ball_at(100, 100, vx=200, elasticity=0.9), ball_at(300, 100 + b, **second)
    return scene_of(*balls, size="[2000, 600]", more=more)


@pytest.mark.parametrize("elasticity", [1, 0.5, 0])
@pytest.mark.parametrize("mass", [1, 3, 50])
def test_head_on_any_masses_part_with_the_product_of_their_elasticities(mass: float, elasticity: float) -> None:
    velocity = simulate(pair(mass=mass, elasticity=elasticity), "box2d", steps=90).velocity[-1]
    swap = (1 + 0.9 * elasticity) * 200 / (1 + 1 / mass)  # px/s: (1 + e) v_n / (1/m_1 + 1/m_2), m_1 = 1
    assert velocity == pytest.approx(np.array([[200 - swap, 0], [swap / mass, 0]]), abs=200 * FLOAT32)


def test_an_oblique_contact_nears_the_closed_form_as_the_rate_grows() -> None:
    """The closed form: the first keeps 200 sin² theta = 100 px/s, sin theta = b / 2r."""
    scenes = (pair(f"rate = {rate}", b=20 * 2**0.5, elasticity=1) for rate in (60, 240, 960))
    kept = [simulate(scene, "box2d", seconds=1.5).velocity[-1, 0, 0] for scene in scenes]
    exact = 200 * (1 - (1 + 0.9) / 4)
    errors = [abs(one - exact) for one in kept]
    assert errors == sorted(errors, reverse=True), f"{kept} px/s, exact is {exact}"
    assert errors[-1] < 1, f"{kept[-1]:.3f} px/s, exact is {exact}"


def test_a_wall_gives_back_the_product_of_the_elasticities() -> None:
    """Balls of two elasticities and walls of two: every pair has its own."""
    scene = scene_of(
        *(ball_at(x, y, vx=-300, vy=60, elasticity=e) for x in (100, 560) for y, e in ((100, 0.5), (300, 1))),
        more="walls = [{ from = [500, 10], to = [500, 590], elasticity = 0.6 }]",
    ).changed(arena={"size": (800, 600), "elasticity": 0.8})
    velocity = simulate(scene, "box2d", steps=30).velocity[-1]
    assert velocity[:, 0] == pytest.approx([120, 240, 90, 180], rel=FLOAT32)
    assert velocity[:, 1] == pytest.approx([60, 60, 60, 60], rel=FLOAT32)


def test_the_elasticity_of_two_balls_does_not_depend_on_the_walls() -> None:
    """Two trains of elastic balls meet head-on, one by one: in a soft box too they exchange their velocities."""
    balls = [f"radius = 10\nposition = [{x}, {y}]\nvelocity = [{v}, 0]" for y in (100, 200, 300) for x, v in MEETING]
    scene = scene_of(*balls).changed(arena={"size": (800, 600), "elasticity": 0.9})
    assert simulate(scene, "box2d", steps=60).velocity[-1, :, 0] == pytest.approx([-200, 100] * 3, rel=4 * FLOAT32)


MEETING = ((300, 100), (400, -200))  # px, px/s


def test_friction_is_the_product_of_the_two() -> None:
    """Sliding on a wall that it does not bounce off, a ball loses friction times its speed towards the wall."""
    scene = scene_of(ball_at(100, 500, vx=300, vy=300, friction=0.5, elasticity=0), size="[800, 600]\nfriction = 0.4")
    assert simulate(scene, "box2d", steps=30).velocity[-1, 0] == pytest.approx([300 - 0.5 * 0.4 * 300, 0], abs=0.01)


def test_more_elasticities_than_filters_are_refused_by_name() -> None:
    balls = [f"radius = 20\nposition = [{50 * k + 50}, 100]\nelasticity = {k / 20}" for k in range(8)]
    scene = scene_of(*balls[:7])
    create("box2d", scene, spawn(scene))
    scene = scene_of(*balls)
    with pytest.raises(Refused, match=r"^box2d: 9 different elasticities are more than its filters can tell apart"):
        create("box2d", scene, spawn(scene))


@pytest.mark.parametrize("thickness", [0, 4])
def test_a_ball_at_3000_px_a_second_does_not_pass_a_thin_wall(thickness: float) -> None:
    scene = scene_of(
        ball_at(200, 300, vx=3000, radius=10),
        more=f"walls = [{{ from = [400, 0], to = [400, 600], thickness = {thickness} }}]",
    )
    x = simulate(scene, "box2d", seconds=2).position[:, 0, 0]
    assert x.max() < 400 - thickness / 2
    assert x.min() > 0


@pytest.mark.parametrize("speed", [1e3, 1e4, 1e5, 1e6])
def test_nothing_escapes_and_no_speed_is_cut(speed: float) -> None:
    scene = scene_of(f"radius = 20\nposition = [400, 300]\nvelocity = [{speed}, {0.7 * speed}]")
    trace = simulate(scene, "box2d", seconds=10)
    assert (trace.position > 0).all()
    assert (trace.position < [800, 600]).all()
    assert np.hypot(*trace.velocity[-1, 0]) == pytest.approx(np.hypot(speed, 0.7 * speed), rel=1e-5)


def test_touching_balls_in_a_chain_do_not_pass_on_all_momentum() -> None:
    """Box2D bounces all contacts of a step at once, by their speeds before it: the cradle loses 39 % of its energy."""
    scene = load("newtons-cradle")
    velocity = simulate(scene, "box2d", seconds=4).velocity
    energy: Floats = (scene.bodies.mass[:, None] * velocity**2).sum(axis=(1, 2))
    assert energy[-1] / energy[0] == pytest.approx(0.609, abs=0.001)


def test_more_worlds_than_box2d_has_room_for_are_refused() -> None:
    scene = scene_of("radius = 20\nposition = [200, 300]")
    initial = spawn(scene)
    taken: list[RunningEngine] = []

    def take_all() -> None:
        while len(taken) < 200:
            taken.append(create("box2d", scene, initial))

    with pytest.raises(Refused, match=r"^box2d: it has room for 128 worlds"):
        take_all()
    taken.clear()
    create("box2d", scene, initial)


def test_without_pyb2d3_it_is_not_listed_and_naming_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyb2d3", None)
    scene = load("article")
    assert "box2d" not in registry()
    with pytest.raises(SandboxError, match=r"^box2d: needs pyb2d3, which is not installed; pip install pyb2d3$"):
        create("box2d", scene, spawn(scene))
