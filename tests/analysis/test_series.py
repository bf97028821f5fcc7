"""The time series of a comparison are those of the trajectories."""

import csv
import io
from pathlib import Path

import numpy as np
import pytest
from conftest import Command, scene_of

from sandbox.analysis import series
from sandbox.analysis.comparison import compare
from sandbox.analysis.series import write_series
from sandbox.run.trajectory import simulate

COLUMNS = [
    *("time", "engine", "energy", "gap_rms", "gap_max", "momentum_x", "momentum_y", "angular_momentum"),
    *("centre_of_mass_height", "contacts"),
]
SCENE = scene_of(
    "radius = 20\nspin = 5\npositions = [[150, 250], [450, 260]]\nvelocities = [[200, 30], [0, 0]]",
    "radius = 10\nmass = 0.25\nposition = [300, 100]\nvelocity = [-50, 90]",
    more="seconds = 2\ngravity = [0, 300]",
)


@pytest.mark.usefixtures("working_folder")
def test_each_row_is_the_state_of_an_engine_after_a_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """Blocks of 7 steps, so that some begin in the middle."""
    monkeypatch.setattr(series, "BLOCK_STEPS", 7)
    names = ["pymunk", "exact"]
    write_series(compare(SCENE, names), "f.csv")
    read = list(csv.DictReader(io.StringIO(Path("f.csv").read_text())))
    assert list(read[0]) == COLUMNS
    assert [row["engine"] for row in read] == names * 121
    runs = {name: simulate(SCENE, name) for name in names}
    away = np.linalg.norm(runs["pymunk"].position - runs["exact"].position, axis=2)
    for name, run in runs.items():
        found = {
            key: np.array([float(row[key]) for row in read if row["engine"] == name])
            for key in COLUMNS
            if key != "engine"
        }
        m, (x, y), (vx, vy) = run.mass, np.moveaxis(run.position, 2, 0), np.moveaxis(run.velocity, 2, 0)
        moment = m * run.radius**2 / 2
        kinetic = (m * (vx**2 + vy**2) + moment * run.spin**2).sum(axis=1) / 2
        width, height = SCENE.arena.size
        assert found["time"] == pytest.approx(np.arange(121) / 60)
        assert found["energy"] == pytest.approx(kinetic + (m * 300 * (height - y)).sum(axis=1))
        assert found["momentum_x"] == pytest.approx((m * vx).sum(axis=1))
        assert found["momentum_y"] == pytest.approx((m * vy).sum(axis=1))
        turning = m * ((x - width / 2) * vy - (y - height / 2) * vx) + moment * run.spin
        assert found["angular_momentum"] == pytest.approx(turning.sum(axis=1))
        assert found["centre_of_mass_height"] == pytest.approx(height - (m * y).sum(axis=1) / m.sum())
        before = [np.count_nonzero(run.contacts["time"] <= time + 1e-9) for time in run.time]
        assert found["contacts"].tolist() == before
        assert before[-1] > 3
        assert found["gap_max"] == pytest.approx(away.max(axis=1) if name == "pymunk" else 0)
        assert found["gap_rms"] == pytest.approx(np.sqrt((away**2).mean(axis=1)) if name == "pymunk" else 0)


def test_series_on_standard_output_are_all_there_is(command: Command) -> None:
    code, out, err = command("compare", "head-on", "--engines", "pymunk,exact", "--seconds", "0.1", "--series", "-")
    assert (code, err, out.count("\n")) == (0, "", 1 + 2 * 7)
    assert out.startswith(",".join(COLUMNS))
