"""Box2D's own numbers come through, and a scene's elasticities, frictions and walls reach it."""

import sys

import numpy as np
import pytest
from conftest import LIBRARIES_REQUIRED, scene_of
from recorded import recorded

from sandbox.engines import Engine, create, registry
from sandbox.errors import Refused, SandboxError
from sandbox.run.trajectory import simulate
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.state import Floats

if not LIBRARIES_REQUIRED:
    pytest.importorskip("pyb2d3")

from sandbox.engines.box2d import Box2DEngine, impulses

FLOAT32 = 2e-7  # relative: two units in the last place


def pair(more: str = "", **second: float) -> Scene:
    """Throw a ball of 1 kg along x at 200 px/s at one at rest, with b px between its line of flight and the other."""
    keys = "\n".join(f"{key} = {value}" for key, value in second.items() if key != "b")
    return scene_of(
        "radius = 20\nposition = [100, 100]\nvelocity = [200, 0]\nelasticity = 0.9",
        f"radius = 20\nposition = [300, {100 + second.get('b', 0)}]\n{keys}",
        size="[2000, 600]",
        more=more,
    )


@pytest.mark.parametrize("elasticity", [1, 0.5, 0])
@pytest.mark.parametrize("mass", [1, 3, 50])
def test_head_on_any_masses_part_with_the_product_of_their_elasticities(mass: float, elasticity: float) -> None:
    engine, (contact,) = recorded("box2d", pair(mass=mass, elasticity=elasticity), 90)
    swap = (1 + 0.9 * elasticity) * 200 / (1 + 1 / mass)  # px/s: (1 + e) v_n / (1/m_1 + 1/m_2), m_1 = 1
    velocity = engine.state().velocity
    assert velocity == pytest.approx(np.array([[200 - swap, 0], [swap / mass, 0]]), abs=200 * FLOAT32)
    assert (contact["first"], contact["second"]) == (0, 1)
    assert contact["impulse"] == pytest.approx(swap, rel=2 * FLOAT32)
    assert contact["normal"].tolist() == [1, 0]


def test_an_oblique_contact_found_early_is_off_by_six_per_cent() -> None:
    """Box2D solves it up to 2.56 px before the two touch: 94.12 and 105.88 px/s along the line of flight, not 100.

    Pymunk, which solves it after, has 105.88 and 94.12.
    """
    velocity = simulate(load("oblique"), "box2d", seconds=1).velocity[-1]
    assert velocity[:, 0] == pytest.approx([94.1172, 105.8828], abs=1e-4)
    assert (velocity**2).sum() == pytest.approx(200**2, rel=4 * FLOAT32)
    assert velocity.sum(axis=0) == pytest.approx([200, 0], abs=200 * FLOAT32)


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
        "radius = 20\nposition = [100, 100]\nvelocity = [-300, 60]\nelasticity = 0.5",
        "radius = 20\nposition = [100, 300]\nvelocity = [-300, 60]",
        "radius = 20\nposition = [560, 100]\nvelocity = [-300, 60]\nelasticity = 0.5",
        "radius = 20\nposition = [560, 300]\nvelocity = [-300, 60]",
        more="walls = [{ from = [500, 10], to = [500, 590], elasticity = 0.6 }]",
    ).changed(arena={"size": (800, 600), "elasticity": 0.8})
    engine, contacts = recorded("box2d", scene, 30)
    velocity = engine.state().velocity
    assert velocity[:, 0] == pytest.approx([120, 240, 90, 180], rel=FLOAT32)
    assert velocity[:, 1] == pytest.approx([60, 60, 60, 60], rel=FLOAT32)
    found = {int(contact["first"]): contact for contact in contacts}
    assert [int(~found[ball]["second"]) for ball in range(4)] == [0, 0, 4, 4]
    assert [found[ball]["impulse"] for ball in range(4)] == pytest.approx([420, 540, 390, 480], rel=2 * FLOAT32)
    assert all(found[ball]["normal"].tolist() == [-1, 0] for ball in range(4))


def test_the_elasticity_of_two_balls_does_not_depend_on_the_walls() -> None:
    """Two trains of elastic balls meet head-on, one by one: in a soft box too they exchange their velocities."""
    balls = [f"radius = 10\nposition = [{x}, {y}]\nvelocity = [{v}, 0]" for y in (100, 200, 300) for x, v in MEETING]
    engine, contacts = recorded("box2d", scene_of(*balls).changed(arena={"size": (800, 600), "elasticity": 0.9}), 60)
    assert len(contacts) == 3
    assert engine.state().velocity[:, 0] == pytest.approx([-200, 100] * 3, rel=4 * FLOAT32)


MEETING = ((300, 100), (400, -200))  # px, px/s


def test_friction_is_the_product_of_the_two() -> None:
    """Sliding on a wall that it does not bounce off, a ball loses friction times its speed towards the wall."""
    scene = scene_of(
        "radius = 20\nposition = [100, 500]\nvelocity = [300, 300]\nfriction = 0.5\nelasticity = 0"
    ).changed(arena={"size": (800, 600), "friction": 0.4})
    engine, _ = recorded("box2d", scene, 30)
    assert engine.state().velocity[0] == pytest.approx([300 - 0.5 * 0.4 * 300, 0], abs=0.01)


def test_more_elasticities_than_filters_are_refused_by_name() -> None:
    balls = [f"radius = 20\nposition = [{50 * k + 50}, 100]\nelasticity = {k / 20}" for k in range(8)]
    scene = scene_of(*balls[:7])
    create("box2d", scene, spawn(scene))
    scene = scene_of(*balls)
    with pytest.raises(Refused, match=r"^box2d: 9 different elasticities are more than its filters can tell apart"):
        create("box2d", scene, spawn(scene))


def test_impulses_of_a_chain_are_those_that_made_its_change() -> None:
    """Three balls between two walls, all touching."""
    first, second = np.array([0, 0, 1, 2]), np.array([-1, 1, 2, -3])
    normal = np.array([[-1.0, 0], [1, 0], [1, 0], [1, 0]])
    mass = np.array([1.0, 5.0, 0.2])
    given, smooth = np.array([7.0, 3.0, 2.0, 11.0]), np.full((4, 2), np.nan)
    change = np.array([[7.0 - 3, 0, 0], [3 - 2, 0, 0], [2 - 11, 0, 0]]) / mass[:, None]
    # Four impulses, three velocities: one share of the squeeze is free, which pushes all four alike.
    found, _ = impulses(first, second, normal, change, mass, smooth).T
    assert found - given == pytest.approx(np.full(4, (found - given)[0]), abs=1e-5)
    released = np.array([[0, 0, 0], [0, 0, 0], [11 / mass[2], 0, 0]])  # by the second wall
    found, along = impulses(first[:3], second[:3], normal[:3], change + released, mass, smooth[:3]).T
    assert found == pytest.approx(given[:3], rel=1e-6)
    assert (along == 0).all()


def test_impulses_along_the_tangent_are_those_that_turned_the_balls() -> None:
    """Two rough balls that touch, one of them at a wall: along n = (1, 0) and t = (0, 1)."""
    first, second, normal = np.array([0, 0]), np.array([1, -1]), np.array([[1.0, 0], [-1, 0]])
    mass, (n1, t1, n2, t2) = np.array([2.0, 5.0]), (7.0, 1.5, 3.0, -0.5)
    momentum = np.array([[-n1 + n2, -t1 + t2, -2 * (t1 + t2)], [n1, t1, -2 * t1]])
    found = impulses(first, second, normal, momentum / mass[:, None], mass, np.ones((2, 2)))
    assert found == pytest.approx(np.array([[n1, t1], [n2, t2]]), rel=1e-6)


def test_contacts_account_for_every_change_of_momentum() -> None:
    scene = load("gas-100")
    engine = Box2DEngine(scene, spawn(scene))
    engine.record_contacts()
    mass, counted = scene.bodies.mass, 0
    for _ in range(120):
        before = engine.state()
        engine.step()
        contacts = engine.contacts()
        explained = np.zeros_like(before.velocity)
        push = contacts["impulse"][:, None] * contacts["normal"]
        np.subtract.at(explained, contacts["first"], push)
        between = contacts["second"] >= 0
        np.add.at(explained, contacts["second"][between], push[between])
        change = (engine.state().velocity - before.velocity) * mass[:, None]
        speed = np.abs(before.velocity).max()
        assert np.abs(change - explained).max() < 1e-4 * speed * mass.max()
        counted += len(contacts)
    assert counted > 300


def test_a_ball_at_rest_on_the_floor_is_carried_by_it() -> None:
    scene = scene_of("radius = 20\nmass = 2\nposition = [400, 580]\nelasticity = 0", more="gravity = [0, 900]")
    _, contacts = recorded("box2d", scene, 60)
    assert len(contacts) == 60
    assert set(contacts["second"]) == {~3}
    assert contacts["impulse"][30:] == pytest.approx(np.full(30, 2 * 900 / 60), rel=1e-3)


def test_a_kick_adds_to_the_velocity() -> None:
    scene = scene_of("radius = 20\nposition = [200, 300]\nvelocity = [60, -30]")
    engine = Box2DEngine(scene, spawn(scene))
    engine.kick(0, (30.0, 0.1))
    assert engine.state().velocity[0] == pytest.approx([90, -29.9], rel=FLOAT32)


@pytest.mark.parametrize("thickness", [0, 4])
def test_a_ball_at_3000_px_a_second_does_not_pass_a_thin_wall(thickness: float) -> None:
    scene = scene_of(
        "radius = 10\nposition = [200, 300]\nvelocity = [3000, 0]",
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
    taken: list[Engine] = []

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
