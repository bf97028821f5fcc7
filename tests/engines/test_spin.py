"""Friction and spin: an impact changes both as Coulomb's law says, and contacts report it."""

import math
import re

import numpy as np
import pytest
from conftest import scene_of
from recorded import recorded

from sandbox import simulate
from sandbox.engines import registry
from sandbox.errors import SandboxError
from sandbox.quantity import energy
from sandbox.run.edits import AddBall, DeleteBall, SetVelocity
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.state import Contacts, State


def bounce(friction: float, spin: float = 0.0, elasticity: float = 1.0) -> Scene:
    """A ball of radius 10 that flies up and to the right, to the top wall."""
    return scene_of(
        f"radius = 10\nmass = 2\nposition = [100, 40]\nvelocity = [300, -100]\nspin = {spin}\n"
        f"friction = {friction}\nelasticity = {elasticity}",
        more="seconds = 1",
    ).changed(arena={"size": (800, 600), "friction": 1.0})


def after(engine_name: str, scene: Scene, steps: int = 40) -> tuple[State, Contacts]:
    engine, contacts = recorded(engine_name, scene, steps)
    return engine.state(), contacts


@pytest.mark.parametrize("engine", ["pymunk", "impulse"])
@pytest.mark.parametrize(
    ("friction", "spin", "along", "turn"),
    [
        (0.2, 0.0, 260.0, -80.0),  # slides all along: 0.2 x 200 of the momentum
        (1.0, 0.0, 200.0, -200.0),  # sticks: a third of the slip of 300
        (1.0, -30.0, 300.0, -300.0),  # rolls
        (0.2, -60.0, 340.0, -520.0),  # slips backwards
    ],
)
def test_a_bounce_with_friction_takes_from_the_speed_and_gives_twice_that_to_the_rim(
    engine: str, friction: float, spin: float, along: float, turn: float
) -> None:
    state, [contact] = after(engine, bounce(friction, spin))
    assert state.velocity[0] == pytest.approx([along, 100], abs=1e-9)
    assert 10 * state.spin[0] == pytest.approx(turn, abs=1e-9)
    assert contact["normal"] == pytest.approx([0, -1])
    assert (contact["impulse"], contact["tangential"]) == pytest.approx((2 * 200, 2 * (300 - along)), abs=1e-9)
    assert contact["slip"] == pytest.approx(300 + 10 * spin, abs=1e-9)


def test_box2d_gives_half_of_the_friction_in_an_elastic_bounce() -> None:
    """It clamps friction before it adds restitution."""
    pytest.importorskip("pyb2d3")
    state, _ = after("box2d", bounce(0.2))
    assert state.velocity[0] == pytest.approx([280, 100], abs=1e-3)
    assert 10 * state.spin[0] == pytest.approx(-40, abs=4)


@pytest.mark.parametrize("engine", [name for name in registry() if name not in ("article", "exact")])
def test_a_free_ball_turns_at_its_spin_past_whole_turns(engine: str) -> None:
    scene = scene_of("radius = 10\nposition = [400, 300]\nspin = -3")
    ran = simulate(scene, engine, seconds=4.0)
    assert ran.spin[:, 0] == pytest.approx(np.full(241, -3.0), abs=1e-4)
    assert ran.angle[:, 0] == pytest.approx(-3 * ran.time, abs=1e-3)


@pytest.mark.parametrize("engine", ["pymunk", "impulse"])
def test_a_pair_keeps_momentum_and_the_angular_momentum_of_each_about_the_point_of_contact(engine: str) -> None:
    scene = scene_of(
        "radius = 10\nmass = 1\nposition = [300, 300]\nvelocity = [200, 30]\nspin = 20\nfriction = 0.5",
        "radius = 30\nmass = 4\nposition = [400, 310]\nvelocity = [-50, 0]\nspin = -3\n"
        "friction = 0.6\nelasticity = 0.8",
    )
    start, (state, [contact]) = spawn(scene), after(engine, scene)
    bodies, n = scene.bodies, contact["normal"]
    tangent = np.array([-n[1], n[0]])
    impulse = contact["impulse"] * n + contact["tangential"] * tangent
    change = bodies.mass[:, None] * (state.velocity - start.velocity)
    assert change == pytest.approx(np.array([-impulse, impulse]), abs=1e-9)
    assert bodies.moment * (state.spin - start.spin) == pytest.approx(-bodies.radius * contact["tangential"], abs=1e-9)
    lost = energy(start, bodies, (0, 0), (800, 600)) - energy(state, bodies, (0, 0), (800, 600))
    mass, slip, along = 1 / (1 + 1 / 4), contact["slip"], contact["tangential"]
    closing = contact["impulse"] / mass / 1.8
    assert along == pytest.approx(slip * mass / 3)
    expected = mass * (1 - 0.8**2) * closing**2 / 2 + abs(along * slip) - along**2 / (2 * mass / 3)
    assert lost == pytest.approx(expected, rel=1e-9)


def test_edits_keep_the_spins_of_the_others() -> None:
    state = State(0.0, np.zeros((3, 2)), np.zeros((3, 2)), np.array([1.0, 2, 3]), np.array([4.0, 5, 6]))
    added = AddBall(step=0, position=(1, 1), radius=1, spin=7).change_state(state)
    assert (added.angle.tolist(), added.spin.tolist()) == ([1, 2, 3, 0], [4, 5, 6, 7])
    deleted = DeleteBall(step=0, ball=1).change_state(added)
    assert (deleted.angle.tolist(), deleted.spin.tolist()) == ([1, 3, 0], [4, 6, 7])
    thrown = SetVelocity(step=0, ball=0, velocity=(9, 9)).change_state(deleted)
    assert thrown.spin.tolist() == deleted.spin.tolist()


@pytest.mark.parametrize(
    ("spin", "message"),
    [
        ('"fast"', 'must be a number, got "fast"'),
        ("{ from = 3, to = 1 }", "is empty: from 3 is greater than to 1"),
        ("{ from = 3, max = 4 }", ".max is not a key of sandbox"),
        ("inf", "must be a finite number, got inf"),
    ],
)
def test_a_wrong_spin_is_named(spin: str, message: str) -> None:
    with pytest.raises(SandboxError, match=rf"spin ?{re.escape(message)}"):
        scene_of(f"radius = 20\nposition = [100, 100]\nspin = {spin}")


def test_a_trajectory_has_all_contacts_with_the_numbers_of_its_balls() -> None:
    scene = load("head-on")
    ran = simulate(scene, "exact", seconds=5.0)
    assert ran.contacts.tobytes() == recorded("exact", scene, 300)[1].tobytes()
    hit = math.ceil(ran.contacts["time"][0] * 60)
    edited = simulate(scene, "exact", seconds=5.0, inputs=[DeleteBall(step=hit, ball=0)])
    assert edited.contacts[0].tobytes() == ran.contacts[0].tobytes()
    assert set(edited.contacts["first"][1:].tolist()) == {1}
