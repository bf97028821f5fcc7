"""Trajectories and their trace files: a file has the numbers of the run, to the bit."""

import csv
import re
import time
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from conftest import scene_of

from sandbox.errors import SandboxError
from sandbox.report.trajectory import Trajectory, simulate
from sandbox.run.edits import AddBall, DeleteBall, SetGravity
from sandbox.run.inputs import Kick
from sandbox.scene.files import load
from sandbox.state import no_contacts

AWKWARD = [0.1, -0.0, 5e-324, 1 / 3, 1e8, -1.7976931348623157e308, 123456789.12345679, 2.0**-1074 * 3]
ENDINGS = ["npz", "csv"]


def awkward() -> Trajectory:
    """Return a trajectory of numbers that a careless format rounds."""
    rng = np.random.default_rng(0)
    shape = (4, 3, 2)
    position, velocity = rng.normal(size=shape), rng.normal(size=shape) * 10.0 ** rng.integers(-20, 20, shape)
    position.flat[: len(AWKWARD)] = AWKWARD
    velocity.flat[: len(AWKWARD)] = AWKWARD[::-1]
    angle, spin = rng.normal(size=(2, 4, 3))
    spin.flat[: len(AWKWARD)] = AWKWARD
    radius, mass = np.array([20, 0.1, 1 / 3]), np.array([1, 1e-3, 7])
    energy = np.array([1 / 3, 5e-324, 1.7976931348623157e308, 0.1])
    constants = radius, mass, (800.0, 600.5)
    return Trajectory(np.arange(4) / 60, position, velocity, *constants, angle, spin, no_contacts(), energy)


def test_a_csv_has_the_same_numbers_to_the_bit(tmp_path: Path) -> None:
    trajectory = awkward()
    trajectory.save(tmp_path / "trace.csv")
    with (tmp_path / "trace.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    (x, y), (vx, vy) = trajectory.position.T, trajectory.velocity.T
    expected = {"time": trajectory.time[:, None], "energy": trajectory.energy[:, None], "ball": np.arange(3.0)}
    expected |= {"x": x.T, "y": y.T, "vx": vx.T, "vy": vy.T}
    expected |= {name: getattr(trajectory, name) for name in ("radius", "mass", "angle", "spin")}
    assert set(rows[0]) == set(expected)
    for name, values in expected.items():
        column = np.array([float(row[name]) for row in rows])
        assert column.tobytes() == np.broadcast_to(values, (4, 3)).tobytes()


@pytest.mark.parametrize("name", ["awkward", "edited"])
def test_what_is_saved_is_loaded_to_the_bit(name: str, tmp_path: Path) -> None:
    inputs = [AddBall(step=3, position=(60, 60), radius=10)]
    trajectory = awkward() if name == "awkward" else simulate(load("oblique"), "pymunk", steps=70, inputs=inputs)
    trajectory.save(tmp_path / "run.npz")
    loaded = np.load(tmp_path / "run.npz")
    for field in fields(Trajectory):
        saved, read = np.asarray(getattr(trajectory, field.name)), loaded[field.name]
        assert (read.shape, read.dtype, read.tobytes()) == (saved.shape, saved.dtype, saved.tobytes())
    assert len(loaded["contacts"]) == (name == "edited")


@pytest.mark.parametrize("ending", ENDINGS)
def test_the_same_trace_is_the_same_bytes(tmp_path: Path, ending: str, monkeypatch: pytest.MonkeyPatch) -> None:
    first, second = tmp_path / f"one.{ending}", tmp_path / f"two.{ending}"
    awkward().save(first)
    later = time.time() + 1e6
    monkeypatch.setattr(time, "time", lambda: later)
    awkward().save(second)
    assert first.read_bytes() == second.read_bytes()


def test_standard_output_is_csv(tmp_path: Path, capsysbinary: pytest.CaptureFixture[bytes]) -> None:
    awkward().save("-")
    awkward().save(tmp_path / "trace.csv")
    out = capsysbinary.readouterr().out
    assert out == (tmp_path / "trace.csv").read_bytes()
    assert out.startswith(b"time,ball,x,y,vx,vy,radius,mass,angle,spin,energy\n0.0,0,0.1,-0.0,")
    assert not list(Path.cwd().glob("-*"))


@pytest.mark.parametrize("name", ["trace.txt", "trace", ".npz"])
def test_another_ending_is_rejected(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    message = f"{path}: a trace must end in one of .npz, .csv"
    with pytest.raises(SandboxError, match=f"^{re.escape(message)}$"):
        awkward().save(path)
    assert list(tmp_path.iterdir()) == []


FREE = "radius = 5\nposition = [400, 300]\nvelocity = [60, -30]"


def test_a_trajectory_has_the_start_and_every_step() -> None:
    ran = simulate(scene_of(f"{FREE}\nmass = 3", more="rate = 50\nseconds = 0.1"), "pymunk")
    assert ran.time.tolist() == [0, 0.02, 0.04, 0.06, 0.08, 0.1]
    straight = np.array([400, 300]) + ran.time[:, None] * np.array([60, -30])
    assert ran.position[:, 0] == pytest.approx(straight, rel=1e-14)
    assert (ran.velocity == [60, -30]).all()
    assert (ran.radius.tolist(), ran.mass.tolist(), ran.size) == ([5], [3], (800, 600))


def test_energy_is_of_flight_spin_and_gravity() -> None:
    """A uniform disc of mass 3 and radius 5 has the moment m r²/2 = 37.5; it falls 200 px at 900 px/s²."""
    falling = "radius = 5\nmass = 3\nposition = [400, 100]\nvelocity = [60, -30]\nspin = 8"
    ran = simulate(scene_of(falling, more="gravity = [0, 900]\nseconds = 0.5"), "exact")
    start = 3 * (60**2 + 30**2) / 2 + 37.5 * 8**2 / 2 + 3 * 900 * (600 - 100)
    assert ran.energy == pytest.approx(np.full(31, start), rel=1e-13)
    assert ran.momentum == pytest.approx(np.column_stack([np.full(31, 180.0), -90 + 2700 * ran.time]), rel=1e-12)


def test_energy_and_momentum_are_of_the_balls_that_exist() -> None:
    inputs = [
        AddBall(step=2, position=(100, 100), velocity=(0, 40), radius=5, mass=2),
        SetGravity(step=4, gravity=(0, 10)),
        DeleteBall(step=4, ball=0),
    ]
    ran = simulate(scene_of(FREE), "exact", steps=5, inputs=inputs)
    first, second = (60**2 + 30**2) / 2, 2 * 40**2 / 2
    assert ran.energy[:4].tolist() == [first, first, first + second, first + second]
    height = 600 - (100 + 40 * 2 / 60)
    assert ran.energy[4:] == pytest.approx([second + 2 * 10 * height] * 2, rel=1e-13)
    assert ran.momentum[[0, 3, 4]].tolist() == [[60, -30], [60, 50], [0, 80]]


def test_steps_override_the_seconds_of_the_scene() -> None:
    scene = scene_of(FREE, more="seconds = 0.25\nrate = 20")
    assert len(simulate(scene, "pymunk").time) == 6
    assert len(simulate(scene, "pymunk", steps=2).time) == 3
    assert len(simulate(scene, "pymunk", steps=0).time) == 1


def test_a_kick_adds_to_the_velocity_of_its_ball_from_its_step_on() -> None:
    scene = scene_of("radius = 20\nposition = [200, 300]\nvelocity = [60, 0]")
    run = simulate(scene, "exact", steps=3, inputs=[Kick(step=1, ball=0, velocity=(0, -200))])
    assert run.velocity[:, 0].tolist() == [[60, 0], [60, 0], [60, -200], [60, -200]]
