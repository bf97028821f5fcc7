"""`Simulation`: a scene that a program runs step by step, kicks and drags."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from conftest import do_steps, scene_of

import sandbox
from sandbox.state import Contacts, State, States

ENGINES = ("pymunk", "pymunk(substeps=4)", "article", "impulse", "exact")
STEPS = 90


def play(simulation: sandbox.Simulation) -> tuple[list[State], list[Contacts]]:
    """Drag one ball and kick another; return the state before and after each of STEPS steps, and their contacts."""
    states, contacts = [simulation.state], [simulation.contacts]
    for step in range(STEPS):
        if step == 10:
            simulation.grab(1, (400, 300))
        elif step == 40:
            simulation.move((200, 450))
        elif step == 60:
            simulation.release()
        elif step == 65:
            simulation.kick(0, (30, -200))
        simulation.step()
        states.append(simulation.state)
        contacts.append(simulation.contacts)
    return states, contacts


@pytest.mark.parametrize("engine", ENGINES)
def test_it_has_the_bits_of_simulate(engine: str) -> None:
    simulation = sandbox.Simulation("article", engine, seed=3, rate=120)
    states, contacts = play(simulation)
    trajectory = sandbox.simulate("article", engine, steps=STEPS, inputs=simulation.inputs)
    for part in States._fields:
        assert np.stack([getattr(state, part) for state in states]).tobytes() == getattr(trajectory, part).tobytes()
    assert np.concatenate(contacts).tobytes() == trajectory.contacts.tobytes()
    assert simulation.state.time == trajectory.time[-1] == 0.75


def test_a_kick_gives_its_momentum() -> None:
    simulation = sandbox.Simulation(scene_of("radius = 5\nmass = 3\nposition = [400, 300]"), "exact")
    simulation.kick(0, np.array([60, -30]))
    simulation.kick(np.int64(0), [0, 60])  # type: ignore[arg-type]
    assert simulation.state.velocity.tolist() == [[0, 0]]  # they act in the next step
    do_steps(simulation, 60)
    assert simulation.state.position[0].tolist() == pytest.approx([460, 330], abs=1e-9)


def test_a_grabbed_ball_follows_the_pointer_until_it_is_released() -> None:
    simulation = sandbox.Simulation(scene_of("radius = 5\nposition = [400, 300]"), "pymunk")
    simulation.move((700, 500))  # holds nothing
    simulation.release()
    simulation.grab(0, (500, 200))
    do_steps(simulation, 120)
    assert simulation.state.position[0].tolist() == pytest.approx([500, 200], abs=1e-3)
    simulation.release()
    simulation.move((700, 500))
    simulation.step()
    assert simulation.state.position[0].tolist() == pytest.approx([500, 200], abs=1e-2)
    assert [given.do for given in simulation.inputs] == ["start", "grab", "release"]


def test_a_state_and_contacts_stay_as_they_were() -> None:
    simulation = sandbox.Simulation("oblique", "pymunk")
    while not len(simulation.contacts):
        simulation.step()
    state, contacts = simulation.state, simulation.contacts
    before = state.position.tobytes(), contacts.tobytes()
    simulation.step()
    assert (state.position.tobytes(), contacts.tobytes()) == before
    assert len(simulation.contacts) == 0  # those of the last step only
    state.position[:] = 0
    assert simulation.state.position.all()


WRONG: tuple[tuple[Callable[[sandbox.Simulation], Any], str], ...] = (
    (lambda run: run.kick(3, (0, 0)), "ball must be at most 2, got 3"),
    (lambda run: run.grab(3, (0, 0)), "ball must be at most 2, got 3"),
    (lambda run: run.grab(-1, (0, 0)), "ball must be at least 0, got -1"),
    (lambda run: run.kick(0, 3), r"velocity must be a list in brackets, such as \[0, 900\], got 3"),  # type: ignore[arg-type]
    (lambda run: run.kick(0, (0, float("nan"))), r"velocity\[1\] must be a finite number, got nan"),
    (lambda run: run.move((1, 2, 3)), "at must have at most 2 entries, got 3"),
    (lambda run: run.grab(0, (0, 1e10)), r"at\[1\] must be at most 1e\+09, got 10000000000.0"),
    (lambda run: sandbox.Simulation(run.scene, ["exact"]), r"engine must be a name, a class or a function, got \[.*"),  # type: ignore[arg-type]
)


@pytest.mark.parametrize(("wrong", "message"), WRONG, ids=[message for _, message in WRONG])
def test_a_wrong_argument_is_refused_and_changes_nothing(
    wrong: Callable[[sandbox.Simulation], Any], message: str
) -> None:
    simulation = sandbox.Simulation("article", "pymunk")
    with pytest.raises(sandbox.SandboxError, match=f"^{message}$"):
        wrong(simulation)
    assert len(simulation.inputs) == 1


def test_an_engine_without_kick_refuses_it() -> None:
    class Still:
        def __init__(self, scene: sandbox.Scene, initial: sandbox.State) -> None:
            self.initial, self.steps, self.rate = initial, 0, scene.rate

        def step(self) -> None:
            self.steps += 1

        def state(self) -> sandbox.State:
            return sandbox.State(self.steps / self.rate, self.initial.position.copy(), self.initial.velocity.copy())

    simulation = sandbox.Simulation("article", Still)
    simulation.step()
    assert len(simulation.contacts) == 0
    with pytest.raises(sandbox.Refused, match="Still: has no method kick"):
        simulation.kick(0, (0, 1))
