"""How far engines are apart, and what each does to energy and momentum."""

import csv
import io
import math
from dataclasses import replace

import numpy as np
import pytest
from conftest import ball_at, scene_of

from sandbox.analysis.comparison import Comparison, compare, flatten
from sandbox.analysis.verdict import verdict
from sandbox.engines import can_run
from sandbox.engines.engine import RunningEngine, advance
from sandbox.errors import SandboxError
from sandbox.report.trajectory import simulate
from sandbox.run.edits import AddBall, DeleteBall, SetGravity, SetVelocity
from sandbox.run.inputs import Grab, Input, Move, Release
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.state import States

FIGURES = {
    "energy_ratio", "energy_drift", "energy_error", "momentum_drift", "gap_rms", "gap_max",
    "pair_contacts", "wall_contacts", "max_overlap", "escaped", "expected", "met", "skipped", "first_difference",
    "causes", "ledger",
}  # fmt: skip


def known(figure: float | None) -> float:
    """Return a figure that the engine reports."""
    assert figure is not None
    return figure


def test_the_gap_is_the_distance_between_the_copies_of_a_ball() -> None:
    scene = load("article").changed(seconds=3.0)
    comparison = compare(scene, ["pymunk", "article"], against="article")
    away = np.linalg.norm(simulate(scene, "pymunk").position - simulate(scene, "article").position, axis=2)
    run = comparison.runs["pymunk"]
    assert run.gap_max == pytest.approx(away.max(axis=1))
    assert run.gap_rms == pytest.approx(np.sqrt((away**2).mean(axis=1)))
    assert run.figures.gap_max == pytest.approx(away.max())
    assert run.figures.gap_rms == pytest.approx(np.sqrt((away**2).mean()))
    assert comparison.runs["article"].figures.gap_max == 0
    assert comparison.time[-1] == 3


def everything(comparison: Comparison) -> list[bytes | str]:
    """Return all that a comparison holds, to the bit."""
    parts: list[bytes | str] = [repr(comparison.as_json()), repr(comparison.trust.horizon), comparison.time.tobytes()]
    for run in comparison.runs.values():
        arrays = (run.energy, run.momentum, run.gap_rms, run.gap_max, run.contacts, run.path)
        parts += [array.tobytes() for array in (*arrays, run.final.position, run.final.velocity)]
        parts += map(repr, (run.apart, run.differences, run.missed, run.escape, run.scores, run.theory))
    return parts


BLOCKS: dict[str, tuple[Scene, list[Input]]] = {
    "gas": (load("gas-100").changed(seconds=7.0), []),  # its speeds are sampled every other step
    "expectations": (load("bouncing").changed(seconds=2.0), []),
    "walls": (load("funnel").changed(seconds=1.5), []),
    "drag": (
        load("article").changed(seconds=3.0),
        [Grab(step=10, ball=0, at=(400, 300)), Move(step=20, at=(500, 200)), Release(step=100)],
    ),
    "edits": (
        load("gas-100").changed(seconds=3.0),
        [
            SetVelocity(step=20, ball=3, velocity=(90, 10)),
            DeleteBall(step=40, ball=2),
            Grab(step=50, ball=0, at=(9, 9)),
        ],
    ),
}


@pytest.mark.wide
@pytest.mark.parametrize("name", BLOCKS)
def test_the_number_of_states_that_are_measured_together_changes_no_bit(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, inputs = BLOCKS[name]
    engines = [engine for engine in ("pymunk", "impulse", "exact") if can_run(engine, scene)]
    monkeypatch.setattr("sandbox.analysis.measurement.MAX_PATH_BYTES", 20_000)
    whole = compare(scene, engines, inputs=inputs)
    assert whole.stride > 1 or len(scene.bodies) < 4
    for steps in (1, 7):
        monkeypatch.setattr("sandbox.analysis.comparison.BLOCK_BYTES", (steps + 1) * 32 * len(scene.bodies))
        assert everything(compare(scene, engines, inputs=inputs)) == everything(whole)


def test_progress_is_reported_several_times_a_second(monkeypatch: pytest.MonkeyPatch) -> None:
    """Engines that take 10 ms a step, at first; then as long as ours."""
    times, pace = [0.0], [0.01]

    def slow_advance(engine: RunningEngine, states: States) -> None:
        advance(engine, states)
        times.append(times[-1] + len(states.position) * pace[0])

    monkeypatch.setattr("sandbox.run.lockstep.advance", slow_advance)
    monkeypatch.setattr("sandbox.run.lockstep.perf_counter", lambda: times[-1])
    scene, reported = load("article").changed(seconds=20.0), [(0.0, 0.0)]

    def progress(done: float) -> None:
        if done > 0.5:
            pace[0] = 1e-5
        reported.append((times[-1], done))

    assert everything(compare(scene, ["pymunk", "exact"], progress=progress)) == everything(
        compare(scene, ["pymunk", "exact"])
    )
    time, done = np.array(reported).T
    assert np.diff(time).max() < 1
    assert np.diff(done).max() > 0.2  # fast engines do many steps at once
    assert done[-1] == 1


def test_walls_and_the_mouse_account_for_momentum() -> None:
    scene = load("article").changed(seconds=5.0)
    inputs: list[Input] = [Grab(step=60, ball=0, at=(100, 100)), Release(step=120)]
    for run in compare(scene, ["pymunk", "article"], inputs=inputs).runs.values():
        assert known(run.figures.wall_contacts) > 0
        assert known(run.figures.momentum_drift) < 1e-13


@pytest.mark.parametrize("gravity", [(0, 0), (0, 900)])
def test_friction_of_a_wall_explains_momentum(gravity: tuple[float, float]) -> None:
    scene = scene_of(
        "radius = 20\nfriction = 0.5\nposition = [100, 500]\nvelocity = [200, 300]\nelasticity = 0.5",
        "radius = 10\nfriction = 0.5\nposition = [400, 590]\nvelocity = [-100, 0]",
        size="[800, 600]\nfriction = 0.5",
        more=f"seconds = 1\ngravity = {list(gravity)}",
    )
    for name, run in compare(scene, ["pymunk", "impulse", "exact"]).runs.items():
        assert known(run.figures.wall_contacts) > 0
        assert run.momentum[-1, 0] < 90, name  # 100 without friction
        assert known(run.figures.momentum_drift) < 1e-12, name


def test_contacts_are_counted_by_kind_and_overlap_is_the_deepest() -> None:
    scene = load("head-on").changed(seconds=2.0)
    figures = compare(scene, ["pymunk"]).runs["pymunk"].figures
    assert (figures.pair_contacts, figures.wall_contacts, figures.escaped) == (1, 0, 0)
    # 200 px/s are 3.33 px a step; they meet at 1.3 s, on a step, so the first overlap is a whole step deep
    assert figures.max_overlap == pytest.approx(200 / 60, abs=1e-9)


def test_a_ball_whose_centre_was_outside_has_escaped_in_figures_and_verdict(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scene_of(ball_at(420, 300, vx=6000), ball_at(400, 100))  # 100 px a step, and Pymunk finds the wall late
    for steps, escaped in ((3, 0), (4, 1), (5, 1)):
        comparison = compare(scene.changed(seconds=steps / 60), ["pymunk"])
        assert comparison.runs["pymunk"].figures.escaped == escaped
        words = "1 ball left the arena, first ball 0 at 0.067 s, by up to 20 px."
        assert (words in verdict(comparison)) == bool(escaped)
    monkeypatch.setattr("sandbox.analysis.comparison.BLOCK_BYTES", 3 * 2 * 32)  # three states
    escape = compare(scene.changed(seconds=5 / 60), ["pymunk"]).runs["pymunk"].escape
    assert escape is not None
    assert tuple(escape) == pytest.approx((4 / 60, 0, 1, 20))


def test_a_gas_is_compared_with_theory_and_three_balls_are_not() -> None:
    comparison = compare(load("gas-100"), ["impulse"])
    run = comparison.runs["impulse"]
    by_name = {row.figure: row for row in run.theory}
    pairs = by_name["contacts per second"]
    assert pairs.measured == known(run.figures.pair_contacts) / 20
    assert pairs.measured == pytest.approx(pairs.expected, rel=0.05)
    pressure = by_name["wall pressure, kg/s²"]
    assert pressure.measured == pytest.approx(pressure.expected, rel=0.05)
    assert by_name["distance of speeds from their law"].measured < 0.02
    written = comparison.as_json()["engines"]["impulse"]["theory"]
    assert {figure: row["measured"] for figure, row in written.items()} == {
        figure: row.measured for figure, row in by_name.items()
    }
    assert "theory" not in compare(load("article").changed(seconds=1.0)).as_json()["engines"]["pymunk"]


@pytest.mark.wide
def test_the_energy_error_ends_where_the_reference_means_nothing() -> None:
    """Beyond the horizon the energy of a scene that loses some depends on paths; that of one that keeps it does not."""
    lossy = scene_of(
        "radius = 20\nelasticity = 0.99\ncount = 30\ninside = [[0, 0], [300, 300]]\nspeed = 400", size="[300, 300]"
    )
    comparison = compare(lossy.changed(seconds=4.0), ["pymunk", "exact"])
    assert comparison.trust.horizon is not None
    run, right = comparison.runs["pymunk"], comparison.runs["exact"].energy
    within = comparison.time < comparison.trust.horizon
    assert np.isnan(run.energy_gap[~within]).all()
    around = np.stack([np.roll(right, shift) for shift in (-1, 0, 1)])[:, within][:, 1:]
    outside = np.maximum(run.energy[within][1:] - around.max(axis=0), around.min(axis=0) - run.energy[within][1:])
    assert run.figures.energy_error == pytest.approx(max(outside.max(), 0) / right[0])
    kept = compare(load("gas-100").changed(seconds=4.0), ["article", "exact"])
    assert kept.trust.horizon is not None
    assert not np.isnan(kept.runs["article"].energy_gap).any()
    assert kept.runs["exact"].figures.energy_error == 0


def test_json_and_csv_hold_the_same_figures() -> None:
    comparison = compare(load("article").changed(seconds=1.0))
    document = comparison.as_json()
    trust = ["horizon", "undecided", "unresolved", "reference_until", "energy_scale"]
    assert list(document) == ["scene", "seed", "rate", "since", "seconds", "against", *trust, "engines", "failed"]
    assert (document["scene"], document["seed"], document["rate"], document["seconds"]) == ("article", 0, 60, 1.0)
    assert list(document["engines"]) == ["pymunk", "article", "exact"]
    rows = list(csv.DictReader(io.StringIO(comparison.as_csv())))
    for row, (name, figures) in zip(rows, document["engines"].items(), strict=True):
        assert set(figures) == FIGURES
        assert row["engine"] == name
        for key in FIGURES - {"first_difference", "causes", "ledger"}:
            assert row[key] == str(figures[key])
        for cause, entry in figures["ledger"].items():
            assert {key: row[f"ledger.{cause}.{key}"] for key in entry} == {
                key: str(value) for key, value in entry.items()
            }
    first = document["engines"]["article"]["first_difference"]
    assert (first["first"], first["second"], first["cause"]) == (2, ~2, "overshoot")
    assert rows[1]["first_difference.time"] == str(first["time"]) == str(46 / 60)
    assert document["engines"]["exact"]["first_difference"] is None
    assert rows[2]["first_difference.time"] == ""


def test_the_columns_of_csv_are_the_same_for_all_scenes_and_engines() -> None:
    heads = set[tuple[str, ...]]()
    for scene, engines in (("gas-100", ["pymunk", "exact"]), ("head-on", ["exact"])):
        comparison = compare(load(scene).changed(seconds=0.5), engines)
        for row, figures in zip(comparison.rows(), comparison.as_json()["engines"].values(), strict=True):
            heads.add(tuple(row))
            assert set(flatten(figures)) - {"causes"} <= {*row, "first_difference"}
    assert len(heads) == 1


def exceeded(comparison: Comparison, **limits: float) -> list[str]:
    return list(comparison.exceeded(**limits))


def test_an_exceeded_limit_is_reported_with_its_value_and_time() -> None:
    comparison = compare(load("article"), ["pymunk", "article"])
    [gap] = exceeded(comparison, max_gap=100)
    run = comparison.runs["pymunk"]
    since = comparison.time[int(np.argmax(run.gap_max > 100))]
    assert gap == f"pymunk: gap {run.gap_max.max():.6g} px exceeds the limit of 100 px, first at {since:.3f} s"
    assert exceeded(comparison, max_gap=1000, max_energy_error=0.9) == []
    [error] = exceeded(comparison, max_energy_error=0.5)
    assert comparison.against == "article"
    assert error.startswith("pymunk: energy error 0.584135 exceeds the limit of 0.5, first at ")
    assert exceeded(comparison) == []
    between = replace(run, gap_max=np.array([0.0, 5.0, 1.0]), energy_gap=np.array([0.0, 0.5, 0.0]))
    assert exceeded(replace(comparison, runs={"pymunk": between, "exact": run}), max_gap=2.0, max_energy_error=0.25)[
        :2
    ] == [
        "pymunk: gap 5 px exceeds the limit of 2 px, first at 0.017 s",
        "pymunk: energy error 0.5 exceeds the limit of 0.25, first at 0.017 s",
    ]


AT_REST = scene_of("radius = 20\npositions = [[100, 100], [200, 200]]")
# One ball touches two others at the start, with an elasticity below 1: no law says which it hits first.
UNDECIDED = scene_of(
    f"radius = 20\nelasticity = 0.5\npositions = [[{300 - math.sqrt(40**2 - 20.5**2)}, 300]]\nvelocity = [200, 0]",
    "radius = 20\nelasticity = 0.5\npositions = [[300, 279.5], [300, 320.5]]",
)


@pytest.mark.parametrize(
    ("scene", "engines", "limit", "why"),
    [
        (AT_REST, ["pymunk"], "max_gap", "pymunk took part alone"),
        (AT_REST, ["exact"], "max_energy_error", "exact took part alone"),
        (AT_REST, ["pymunk", "exact"], "max_energy_error", "exact has no ball that moves"),
        (UNDECIDED, ["pymunk", "exact"], "max_energy_error", "exact means nothing from the start"),
    ],
)
def test_a_limit_on_what_is_not_known_is_an_error(scene: Scene, engines: list[str], limit: str, why: str) -> None:
    comparison = compare(scene.changed(seconds=0.1), engines)
    what = limit.removeprefix("max_").replace("_", " ")
    with pytest.raises(
        SandboxError, match=rf"^{engines[0]}: there is no {what} to compare with the limit of 1: {why}$"
    ):
        exceeded(comparison, **{limit: 1.0})


def test_an_edit_to_come_decides_which_engines_run_by_default() -> None:
    scene = load("head-on").changed(seconds=0.1)
    gravity = SetGravity(step=3, gravity=(0, 900))
    assert list(compare(scene, inputs=[gravity]).runs) == ["pymunk", "impulse", "exact"]
    assert list(compare(scene, inputs=[gravity.model_copy(update={"step": 60})]).runs) == ["pymunk", "article", "exact"]
    rough = [AddBall(step=step, position=(100 + 50 * step, 500), radius=20, friction=1) for step in (2, 3)]
    assert list(compare(scene, inputs=rough).runs) == ["pymunk", "impulse", "exact"]


def test_the_default_reference_is_the_exact_engine_or_else_the_last() -> None:
    scene = load("article").changed(seconds=0.1)
    assert compare(scene).against == "exact"
    assert compare(scene, ["exact", "pymunk"]).against == "exact"
    assert compare(scene, ["pymunk", "article"]).against == "article"
    assert compare(scene, against="pymunk").against == "pymunk"
    with pytest.raises(
        SandboxError, match=r"^cannot compare against 'artcle', which does not take part; did you mean article\?$"
    ):
        compare(scene, against="artcle")
    assert list(compare(scene, "pymunk").runs) == ["pymunk"]
