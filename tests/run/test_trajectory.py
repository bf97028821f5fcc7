"""Traces, inputs and the hand: what is written is what was run, to the bit."""

import csv
import errno
import io
import json
import math
import re
import time
from pathlib import Path

import numpy as np
import pytest
from conftest import NO_KEY, scene_of
from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox.errors import SandboxError
from sandbox.files import whole_file
from sandbox.run.inputs import End, Grab, Input, Move, Release, Start, load_inputs, write_inputs
from sandbox.run.lockstep import Lockstep
from sandbox.run.mouse import MOST_PULL, PULL, Hand
from sandbox.run.trajectory import Trajectory, simulate, write_trace
from sandbox.scene.model import Scene
from sandbox.state import Floats

AWKWARD = [0.1, -0.0, 5e-324, 1 / 3, 1e8, -1.7976931348623157e308, 123456789.12345679, 2.0**-1074 * 3]
ENDINGS = ["npz", "csv", "xyz"]


def awkward() -> Trajectory:
    """Make a trajectory of numbers that a careless format loses."""
    rng = np.random.default_rng(0)
    shape = (4, 3, 2)
    position, velocity = rng.normal(size=shape), rng.normal(size=shape) * 10.0 ** rng.integers(-20, 20, shape)
    position.flat[: len(AWKWARD)] = AWKWARD
    velocity.flat[: len(AWKWARD)] = AWKWARD[::-1]
    return Trajectory(
        np.arange(4) / 60, position, velocity, np.array([20, 0.1, 1 / 3]), np.array([1, 1e-3, 7]), (800.0, 600.5)
    )


def read_npz(path: Path) -> list[Floats]:
    with np.load(path) as file:
        assert set(file.files) == {"time", "position", "velocity", "radius", "mass"}
        return [file[name] for name in ("time", "position", "velocity", "radius", "mass")]


def table(rows: list[list[float]], frames: int) -> list[Floats]:
    """Turn rows of time, x, y, vx, vy, radius, mass into the arrays of a trace."""
    array = np.array(rows).reshape(frames, -1, 7)
    return [array[:, 0, 0], array[:, :, 1:3], array[:, :, 3:5], array[0, :, 5], array[0, :, 6]]


def read_csv(path: Path) -> list[Floats]:
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    keys = ("time", "x", "y", "vx", "vy", "radius", "mass")
    assert [row["ball"] for row in rows] == ["0", "1", "2"] * 4
    return table([[float(row[key]) for key in keys] for row in rows], 4)


def read_xyz(path: Path) -> list[Floats]:
    lines = path.read_text().splitlines()
    assert len(lines) == 4 * (2 + 3)
    rows = []
    for frame in range(4):
        count, comment, *atoms = lines[frame * 5 : frame * 5 + 5]
        assert count == "3"
        match = re.fullmatch(
            r'Lattice="800\.0 0 0 0 600\.5 0 0 0 1" pbc="F F F" '
            r"Properties=species:S:1:pos:R:3:velo:R:3:radius:R:1:mass:R:1 Time=(\S+)",
            comment,
        )
        assert match
        for atom in atoms:
            species, x, y, z, vx, vy, vz, radius, mass = atom.split()
            assert (species, z, vz) == ("X", "0", "0")
            rows.append([float(number) for number in (match[1], x, y, vx, vy, radius, mass)])
    return table(rows, 4)


READ = {"npz": read_npz, "csv": read_csv, "xyz": read_xyz}


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_trace_holds_the_same_numbers_to_the_bit(tmp_path: Path, ending: str) -> None:
    trajectory = awkward()
    path = tmp_path / f"trace.{ending}"
    write_trace(trajectory, path)
    written = [trajectory.time, trajectory.position, trajectory.velocity, trajectory.radius, trajectory.mass]
    for ours, theirs in zip(written, READ[ending](path), strict=True):
        assert theirs.dtype == np.float64
        assert theirs.shape == ours.shape
        assert np.ascontiguousarray(theirs).tobytes() == ours.tobytes()


@pytest.mark.parametrize("ending", ENDINGS)
def test_the_same_trace_is_the_same_bytes(tmp_path: Path, ending: str, monkeypatch: pytest.MonkeyPatch) -> None:
    first, second = tmp_path / f"one.{ending}", tmp_path / f"two.{ending}"
    write_trace(awkward(), first)
    later = time.time() + 1e6
    monkeypatch.setattr(time, "time", lambda: later)
    write_trace(awkward(), second)
    assert first.read_bytes() == second.read_bytes()


def test_standard_output_is_csv(tmp_path: Path, capsysbinary: pytest.CaptureFixture[bytes]) -> None:
    write_trace(awkward(), "-")
    write_trace(awkward(), tmp_path / "trace.csv")
    out = capsysbinary.readouterr().out
    assert out == (tmp_path / "trace.csv").read_bytes()
    assert out.startswith(b"time,ball,x,y,vx,vy,radius,mass\n0.0,0,0.1,-0.0,")
    assert not list(Path.cwd().glob("-*"))


@pytest.mark.parametrize("name", ["trace.txt", "trace", "trace.NPZ", "trace.npz.gz", ".npz"])
def test_another_ending_is_a_mistake(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    message = f"{path}: a trace must end in one of .npz, .csv, .xyz"
    with pytest.raises(SandboxError, match=f"^{re.escape(message)}$"):
        write_trace(awkward(), path)
    assert list(tmp_path.iterdir()) == []


# --- Files whole or not at all ---------------------------------------------------------------------------------


@pytest.mark.parametrize("ending", ["csv", "xyz"])
def test_a_writer_that_fails_leaves_the_old_file(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"trace.{ending}"
    path.write_text("the old one")
    good = awkward()
    torn = Trajectory(good.time, good.position[:2], good.velocity, good.radius, good.mass, good.size)
    with pytest.raises(ValueError, match="zip"):
        write_trace(torn, path)
    assert list(tmp_path.iterdir()) == [path]
    assert path.read_text() == "the old one"


def _tear(path: Path, error: BaseException) -> None:
    with whole_file(path) as file:
        file.write(b"half of")
        file.flush()
        raise error


@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt()], ids=repr)
def test_a_file_is_whole_or_not_at_all(tmp_path: Path, error: BaseException) -> None:
    path = tmp_path / "file.json"
    expected = SandboxError if isinstance(error, OSError) else type(error)
    for old in (None, b"the old one"):
        if old:
            path.write_bytes(old)
        with pytest.raises(expected) as caught:
            _tear(path, error)
        if isinstance(error, OSError):
            assert str(caught.value) == f"{path}: cannot be written: No space left on device"
        assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == ({"file.json": old} if old else {})


def test_a_file_is_replaced_only_at_the_end(tmp_path: Path) -> None:
    path = tmp_path / "file.json"
    path.write_bytes(b"the old one")
    with whole_file(path) as file:
        file.write(b"the new one")
        file.flush()
        assert path.read_bytes() == b"the old one"
    assert path.read_bytes() == b"the new one"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("name", "why"),
    [
        pytest.param("missing/trace.csv", "No such file or directory", id="no-folder"),
        pytest.param("file/trace.csv", "Not a directory", id="file-for-a-folder"),
        pytest.param("folder.csv", "Is a directory", id="folder"),
        pytest.param("x" * 300 + ".csv", "File name too long", id="name-too-long"),
    ],
)
def test_where_nothing_can_be_written_is_a_mistake(tmp_path: Path, name: str, why: str) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "folder.csv").mkdir()
    path = tmp_path / name
    with pytest.raises(SandboxError) as caught:
        write_trace(awkward(), path)
    assert str(caught.value) == f"{path}: cannot be written: {why}"
    assert {file.name for file in tmp_path.iterdir()} == {"file", "folder.csv"}


# --- Simulate --------------------------------------------------------------------------------------------------

FREE = "radius = 5\nposition = [400, 300]\nvelocity = [60, -30]"


def test_simulate_holds_the_start_and_every_step() -> None:
    ran = simulate(scene_of(f"{FREE}\nmass = 3", more="rate = 50"), "pymunk", seconds=0.1)
    assert ran.time.tolist() == [0, 0.02, 0.04, 0.06, 0.08, 0.1]
    straight = np.array([400, 300]) + ran.time[:, None] * np.array([60, -30])
    assert ran.position[:, 0] == pytest.approx(straight, rel=1e-14)
    assert (ran.velocity == [60, -30]).all()
    assert (ran.radius.tolist(), ran.mass.tolist(), ran.size) == ([5], [3], (800, 600))


def test_steps_go_before_seconds_and_none_is_the_scenes() -> None:
    scene = scene_of(FREE, more="seconds = 0.25\nrate = 20")
    assert len(simulate(scene, "pymunk").time) == 6
    assert len(simulate(scene, "pymunk", steps=2).time) == 3
    assert len(simulate(scene, "pymunk", steps=0).time) == 1


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


# --- Inputs ----------------------------------------------------------------------------------------------------

RECORDED: list[Input] = [
    Start(scene="article", seed=3, rate=240),
    Grab(step=12, ball=1, at=(0.1, 1 / 3)),
    Move(step=12, at=(-5, 1e8)),
    Release(step=40),
    End(step=95),
]
LINES = """\
{"step":0,"do":"start","scene":"article","seed":3,"rate":240}
{"step":12,"do":"grab","ball":1,"at":[0.1,0.3333333333333333]}
{"step":12,"do":"move","at":[-5.0,1e8]}
{"step":40,"do":"release"}
{"step":95,"do":"end"}
"""


def two_balls(more: str = "") -> Scene:
    return scene_of("radius = 20\ngrid = [2, 1]\nspacing = 100", more=more)


def test_inputs_are_read_as_they_were_written(tmp_path: Path) -> None:
    path = tmp_path / "inputs.jsonl"
    write_inputs(RECORDED, path)
    assert load_inputs(path, two_balls()) == RECORDED
    assert [json.loads(line) for line in path.read_text().splitlines()] == [
        json.loads(line) for line in LINES.splitlines()
    ]


def test_inputs_as_the_module_shows_them_are_read(tmp_path: Path) -> None:
    path = tmp_path / "inputs.jsonl"
    path.write_text(LINES)
    assert load_inputs(path, two_balls()) == RECORDED


KINDS = "start, grab, move, release, add, delete, velocity, elasticity, gravity, rate, end"
BAD_INPUTS = {
    "not-json": ('{"step": 0', "is not JSON: Expecting ',' delimiter: line 1 column 11 (char 10)"),
    "not-an-object": ("[1]", f'must be an object with "do" as one of {KINDS}, got [1]'),
    "no-such-kind": ('{"do": "grabb"}', f'must be an object with "do" as one of {KINDS}, got {{"do": "grabb"}}'),
    "kind-is-a-list": ('{"do": ["a"]}', f'must be an object with "do" as one of {KINDS}, got {{"do": ["a"]}}'),
    "before-the-start": ('{"step": -1, "do": "release"}', "step must be at least 0, got -1"),
    "no-step": ('{"do": "release"}', "step is missing"),
    "ball-that-is-none": ('{"step": 9, "do": "grab", "ball": 2, "at": [1, 2]}', "ball must be at most 1, got 2"),
    "not-finite": ('{"step": 9, "do": "move", "at": [NaN, 2]}', "at[0] must be a finite number, got nan"),
    "no-point": ('{"step": 9, "do": "move", "at": "x"}', 'at must be a list in brackets, got "x"'),
    "unknown-key": ('{"step": 9, "do": "release", "bal": 3}', f"bal {NO_KEY}; known are do, step"),
    "a-start-after-others": (
        '{"step": 0, "do": "start", "scene": "x", "seed": 0, "rate": 1}',
        "start must come before all other inputs",
    ),
    "deep": ("[" * 100_000, "is nested too deeply"),
    "deep-kind": (
        '{"do": ' + "[" * 700 + "]" * 700 + "}",
        f'must be an object with "do" as one of {KINDS}, got {{"do": {"[" * 30}...',
    ),
    "number-too-long": ('{"step": ' + "9" * 5000 + "}", "has a number of too many digits"),
    "a-start-later-on": (
        '{"step": 3, "do": "start", "scene": "x", "seed": 0, "rate": 60}',
        "step must be 0, got 3",
    ),
}


@pytest.mark.parametrize(("line", "message"), BAD_INPUTS.values(), ids=BAD_INPUTS)
def test_a_mistake_in_inputs_has_its_line(tmp_path: Path, line: str, message: str) -> None:
    path = tmp_path / "inputs.jsonl"
    path.write_text('{"step": 0, "do": "release"}\n' + line + "\n")
    with pytest.raises(SandboxError) as caught:
        load_inputs(path, two_balls())
    assert str(caught.value) == f"{path}:2: {message}"


def test_all_mistakes_in_inputs_at_once_and_steps_in_order(tmp_path: Path) -> None:
    path = tmp_path / "inputs.jsonl"
    path.write_text(
        '{"step": 5, "do": "release"}\n{"step": 4, "do": "release"}\n{"step": 6, "do": "end", "at": 1, "ball": 2}\n'
        '{"step": 5, "do": "grab", "ball": 2, "at": [0, 0]}\n'
    )
    with pytest.raises(SandboxError) as caught:
        load_inputs(path, two_balls())
    assert str(caught.value).splitlines() == [
        f"{path}:2: step must be at least 5, got 4",
        f"{path}:3: at {NO_KEY}; known are do, step",
        f"{path}:3: ball {NO_KEY}; known are do, step",
        f"{path}:4: ball must be at most 1, got 2",
    ]


def test_of_very_many_mistakes_in_inputs_the_first_hundred_are_told(tmp_path: Path) -> None:
    path = tmp_path / "inputs.jsonl"
    path.write_text("[1]\n" * 1000)
    with pytest.raises(SandboxError) as caught:
        load_inputs(path, two_balls())
    told = str(caught.value).splitlines()
    assert told[99].startswith(f"{path}:100: must be an object")
    assert told[100:] == [f"{path}: has more than these 100 errors"]


def test_a_line_of_inputs_ends_only_where_json_lines_do(tmp_path: Path) -> None:
    path = tmp_path / "inputs.jsonl"
    path.write_text('{"step": 0, "do": "start", "scene": "a\u2028b\x85c", "seed": 0, "rate": 60}\n[1]\n')
    with pytest.raises(SandboxError) as caught:
        load_inputs(path, two_balls())
    first, second = str(caught.value).split("\n")
    assert first == f"{path}:1: scene must not have control characters, got U+2028"
    assert second.startswith(f"{path}:2: must be an object")


# --- The hand --------------------------------------------------------------------------------------------------


def pulled(scene: Scene, to: float, x: float, v: float, steps: int) -> tuple[Floats, Floats]:
    """Pull a ball along x with nothing else acting: positions and velocities, the start among them."""
    hand = Hand(scene)
    hand.obey(Grab(step=0, ball=0, at=(to, 300)))
    path, speeds = [x], [v]
    for _ in range(steps):
        dv = hand.pull((path[-1], 300), (speeds[-1], 0))
        assert dv[1] == 0
        speeds.append(speeds[-1] + dv[0])
        path.append(path[-1] + speeds[-1] / scene.rate)
    return np.array(path), np.array(speeds)


@settings(deadline=None)
@given(rate=st.integers(1, 2000), away=st.floats(-30, 30), v=st.floats(-200, 200))
def test_the_pull_is_backward_eulers_critically_damped_one(rate: int, away: float, v: float) -> None:
    # Both eigenvalues of the step are 1 / (1 + h w), so x_n - target = (c0 + c1 n) / (1 + h w)^n.
    scene = scene_of("radius = 250\nposition = [400, 300]", more=f"rate = {rate}")
    position, _ = pulled(scene, 400, 400 + away, v, 50)
    h, w = 1 / rate, 25.0
    assert w == PULL
    n = np.arange(51)
    expected = (away + n * (h * w * away + h * v) / (1 + h * w)) / (1 + h * w) ** n
    assert position - 400 == pytest.approx(expected, abs=1e-9)


@settings(deadline=None)
@given(rate=st.integers(1, 5000), radius=st.floats(1, 100), share=st.floats(0, 1), back=st.booleans())
def test_the_pull_never_overshoots_at_any_rate(rate: int, radius: float, share: float, back: bool) -> None:
    group = f"radius = {radius!r}\nposition = [400, 300]"
    start, far = (800 - radius, radius) if back else (radius, 800 - radius)
    target = start + share * (far - start)
    position, _ = pulled(scene_of(group, more=f"rate = {rate}"), target, start, 0, min(3 * rate, 400))
    left = (position - target) * math.copysign(1, start - target)
    assert left.min() >= -1e-9
    assert (np.diff(left) <= 1e-9).all()


def test_the_pull_does_not_overshoot_in_a_large_arena() -> None:
    scene = scene_of("radius = 50\nposition = [400, 300]", size="[2000, 2000]", more="rate = 240")
    position, _ = pulled(scene, 1950, 50, 0, 2 * 240)
    assert position.max() - 1950 <= 1e-6


def test_a_held_ball_arrives_within_half_a_second_across_the_arena() -> None:
    scene = scene_of("radius = 20\nposition = [400, 300]")
    position, velocity = pulled(scene, 780, 20, 0, 60)
    assert position[-1] == pytest.approx(780, abs=0.5)
    assert abs(velocity[-1]) < 10
    near, _ = pulled(scene, 420, 400, 0, 12)
    assert near[-1] == pytest.approx(420, abs=1.5)


@settings(deadline=None)
@given(
    rate=st.integers(1, 2000),
    radius=st.floats(0.5, 200),
    at=st.tuples(st.floats(-1e4, 1e4), st.floats(-1e4, 1e4)),
    where=st.tuples(st.floats(0, 800), st.floats(0, 600)),
    v=st.tuples(st.floats(-5e3, 5e3), st.floats(-5e3, 5e3)),
)
def test_acceleration_and_step_are_bounded(
    rate: int, radius: float, at: tuple[float, float], where: tuple[float, float], v: tuple[float, float]
) -> None:
    hand = Hand(scene_of(f"radius = {radius!r}\nposition = [400, 300]", more=f"rate = {rate}"))
    hand.obey(Grab(step=0, ball=0, at=at))
    dv = hand.pull(where, v)
    assert MOST_PULL == 40_000
    assert math.hypot(*dv) * rate <= 40_000 * (1 + 1e-12)
    if math.hypot(*v) <= radius * rate:  # slower than the bound before, so after: the disc of speeds is convex
        assert math.hypot(v[0] + dv[0], v[1] + dv[1]) <= radius * rate * (1 + 1e-12)


def test_the_pull_does_not_scale_with_gravity() -> None:
    first, second = (
        pulled(scene_of("radius = 20\nposition = [400, 300]", more=f"gravity = [0, {g}]"), 700, 100, 0, 30)
        for g in (0, 9000)
    )
    assert np.array_equal(first[0], second[0])


@settings(deadline=None)
@given(at=st.tuples(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6)), move=st.booleans())
def test_the_target_is_held_inside_the_arena(at: tuple[float, float], move: bool) -> None:
    hand = Hand(scene_of("radius = 5\nposition = [50, 50]", "radius = 30\nposition = [400, 300]"))
    hand.obey(Grab(step=0, ball=1, at=(400, 300) if move else at))
    if move:
        hand.obey(Move(step=1, at=at))
    x, y = hand.target
    assert (x, y) == (sorted((30, at[0], 770))[1], sorted((30, at[1], 570))[1])


def test_the_hand_takes_moves_and_lets_go() -> None:
    hand = Hand(two_balls())

    def held() -> int | None:
        return hand.ball

    hand.obey(Move(step=0, at=(100, 100)))  # of nothing
    assert held() is None
    hand.obey(Grab(step=0, ball=1, at=(100, 110)))
    assert (held(), hand.target) == (1, (100, 110))
    hand.obey(Move(step=1, at=(200, 210)))
    assert (held(), hand.target) == (1, (200, 210))
    hand.obey(Release(step=2))
    assert held() is None
    hand.obey(Grab(step=3, ball=0, at=(1, 1)))
    hand.obey(End(step=4))
    assert held() is None


def test_a_pipe_takes_what_is_written(monkeypatch: pytest.MonkeyPatch) -> None:
    raw = io.BytesIO()
    monkeypatch.setattr("sys.stdout", io.TextIOWrapper(raw))
    with whole_file("-") as file:
        file.write(b"\xff\n")
    assert raw.getvalue() == b"\xff\n"
