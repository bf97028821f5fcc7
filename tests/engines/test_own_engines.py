"""Engines of one's own: in files, as classes, as functions; and what is said where they break the contract."""

import json
import math
import sys
from dataclasses import replace
from pathlib import Path
from textwrap import dedent
from typing import Any, Final

import numpy as np
import pytest
from conftest import Command, ball_at, do_steps, scene_of

from sandbox.analysis.comparison import compare
from sandbox.analysis.figures import Run
from sandbox.engines import create, named
from sandbox.engines.engine import Traits
from sandbox.engines.specs import file_and_name, settings_in
from sandbox.errors import EngineError, Refused, SandboxError
from sandbox.judge.causes import Cause
from sandbox.report.trajectory import simulate
from sandbox.run.edits import SetGravity
from sandbox.run.inputs import Grab
from sandbox.run.lockstep import Lockstep
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.session.session import Session
from sandbox.state import CONTACT, Contacts, Floats, State

LOOP: Final = dedent('''
    """A beginner's loop, which bounces balls off the walls and off each other."""


    def step(position, velocity, dt, scene):
        radius, (width, height) = scene.bodies.radius, scene.arena.size
        position += velocity * dt
        for i in range(len(position)):
            for axis, side in enumerate((width, height)):
                if not radius[i] < position[i, axis] < side - radius[i]:
                    velocity[i, axis] *= -1
            for j in range(i):
                way = position[j] - position[i]
                distance = (way @ way) ** 0.5
                if distance < radius[i] + radius[j]:
                    exchanged = (velocity[i] - velocity[j]) @ way * way / distance**2
                    velocity[i] -= exchanged
                    velocity[j] += exchanged
''')


ORDER: Final = "mine: the times of its contacts must be in order, from the last call until now, 0 to 1 s since"
NO_STEP: Final = (
    "mine: has no method step; an engine is a class or a function of (scene, initial), "
    "or a function step(position, velocity, dt, scene)"
)


@pytest.fixture
def loop(working_folder: Path) -> str:
    """Write the loop into a file of the working folder, and return its spec."""
    (working_folder / "loop.py").write_text(LOOP)
    return "loop.py:step"


class Flying:
    """Balls that fly, and touch nothing."""

    def __init__(self, scene: Scene, initial: State) -> None:
        self.scene, self.steps = scene, 0
        self.position, self.velocity, self.spin = initial.position, initial.velocity, initial.spin
        self.found: list[tuple[Any, ...]] = []

    def step(self) -> None:
        self.steps += 1
        self.position += self.velocity / self.scene.rate

    @property
    def time(self) -> float:
        return self.steps / self.scene.rate

    def state(self) -> State:
        return State(self.time, self.position.copy(), self.velocity.copy(), spin=self.spin.copy())

    def contacts(self) -> Contacts:
        found, self.found = np.array(self.found, CONTACT), []
        return found

    def kick(self, ball: int, dv: tuple[float, float]) -> None:
        self.velocity[ball] += dv


# Where engines are found


def test_a_loop_in_a_file_is_compared_and_verified_with_no_other_file(loop: str, command: Command) -> None:
    code, out, _ = command("compare", "oblique", "--engines", f"{loop},exact", "--seconds", "1")
    assert code == 0
    assert "loop.py:step Energy as it should be. 1 contact: found late, " in " ".join(out.split())
    code, out, _ = command("verify", "head-on", "--engines", loop)
    assert (code, "loop.py:step: 0 of 1 scene met, 1 close" in out) == (0, True)
    assert command("verify", "head-on", "--engines", loop, "--tolerance", "1e-9")[0] == 1


def test_a_path_may_have_spaces_brackets_and_commas_around_it(loop: str, tmp_path: Path, command: Command) -> None:
    folder = tmp_path / "my loops (old)"
    folder.mkdir()
    (folder / "loop.py").write_text(LOOP)
    code, _, err = command(
        *("trace", "head-on", "--engine", f"{folder}/loop.py:step", "--steps", "3", "--out", "trace.csv")
    )
    assert (code, err) == (0, "")
    code, out, err = command(
        "verify", "head-on", "--engines", f"my loops (old)/loop.py:step, pymunk(substeps=4),{loop}"
    )
    assert (code, err) == (0, "")
    assert [name in out for name in ("my loops (old)/loop.py:step: ", "pymunk(substeps=4): ")] == [True, True]


def test_a_drive_s_colon_belongs_to_the_path() -> None:
    spec = r"C:\my loops\mine.py:Mine"
    assert file_and_name(spec) == (Path(r"C:\my loops\mine.py"), "Mine")
    assert settings_in(spec) == (spec, {})


def test_a_file_runs_again_only_if_it_has_changed(loop: str, working_folder: Path) -> None:
    file = working_folder / "loop.py"
    before = simulate(load("head-on"), loop, steps=3).position
    file.write_text("def step(position, velocity, dt, scene): pass")
    assert not np.array_equal(simulate(load("head-on"), loop, steps=3).position, before)


def test_a_file_imports_those_beside_it(loop: str, working_folder: Path) -> None:
    """Not one of the same name beside a file that was loaded before."""
    (working_folder / "other").mkdir()
    (working_folder / "other" / "loop.py").write_text("def step(position, velocity, dt, scene): pass")
    (working_folder / "mine.py").write_text("from loop import step")
    scene = load("head-on")
    simulate(scene, "other/loop.py:step", steps=1)
    mine, original = (simulate(scene, one, steps=60).position for one in ("mine.py:step", loop))
    assert np.array_equal(mine, original)


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        ("none.py:Mine", "none.py: cannot be read: No such file or directory"),
        ("loop.py", "loop.py: must name a class or a function in the file, as in loop.py:Mine"),
        ("loop.py:stp", "loop.py: has no class or function 'stp'; did you mean step?"),
        ("empty.py:Mine", "empty.py: has no class or function 'Mine'; it has no class and no function"),
        ("broken.py:Mine", "broken.py:Mine: cannot be loaded: ZeroDivisionError: division by zero"),
        ("ends.py:Mine", "ends.py:Mine: cannot be loaded: SystemExit: 3"),
        ("syntax.py:Mine", "syntax.py:Mine: cannot be loaded: SyntaxError: "),
    ],
)
def test_a_file_without_an_engine_is_one_message(
    spec: str, message: str, loop: str, working_folder: Path, command: Command
) -> None:
    for name, text in (("empty", ""), ("broken", "1 / 0"), ("ends", "raise SystemExit(3)"), ("syntax", "def")):
        (working_folder / f"{name}.py").write_text(text)
    code, out, err = command("trace", "head-on", "--engine", spec, "--steps", "1")
    assert (code, out) == (2, "")
    assert err.splitlines()[-1].startswith(message)
    assert "sandbox/" not in err  # the traceback is the file's


def test_engines_from_python_have_the_names_of_a_mapping(loop: str) -> None:
    scene = load("head-on").changed(seconds=0.5)
    comparison = compare(scene, {"mine": Flying, "file": loop, "fine": "pymunk(substeps=4)", "exact": "exact"})
    assert list(comparison.runs) == ["mine", "file", "fine", "exact"]
    fine = simulate(scene, {"fine": "pymunk(substeps=4)"})
    assert np.array_equal(fine.position, simulate(scene, "pymunk(substeps=4)").position)
    assert np.array_equal(simulate(scene, Flying).position, simulate(scene, {"mine": Flying}).position)


def test_a_function_that_builds_an_engine_is_one() -> None:
    def build(scene: Scene, initial: State) -> Flying:
        return Flying(scene, initial)

    scene = load("head-on")
    assert np.array_equal(simulate(scene, build, steps=9).position, simulate(scene, Flying, steps=9).position)


@pytest.mark.parametrize(
    ("engines", "message"),
    [
        ({"exact": Flying}, "exact: is the name of a built-in engine; choose another one"),
        ({"box2d": Flying}, "box2d: is the name of a built-in engine; choose another one"),
        ({"pymunk(substeps=2)": "pymunk"}, "pymunk(substeps=2): is the name of a built-in engine; choose another one"),
        ({"mine": 3}, "mine: must be the name of an engine, a class or a function, got 3"),
        ({"": Flying}, 'an engine must have a printable name, got ""'),
        ({"mine\x1b": Flying}, 'an engine must have a printable name, got "mine\\u001b"'),
    ],
)
def test_a_name_that_is_not_allowed_is_refused(engines: dict[str, Any], message: str) -> None:
    with pytest.raises(SandboxError) as error:
        named(engines)
    assert str(error.value) == message


# The contract


class NoStep:
    def __init__(self, scene: Scene, initial: State) -> None: ...

    def state(self) -> None: ...


class OtherArguments(Flying):
    def __init__(self, scene: Scene) -> None: ...


class Nan(Flying):
    def state(self) -> State:
        state = super().state()
        state.position[1] = np.nan if self.steps >= 5 else state.position[1]
        return state


def mine(**members: Any) -> type[Flying]:
    """Return a class of engines with other methods or attributes."""
    return type("Mine", (Flying,), members)


class Found(Flying):
    """Reports contacts in the third step."""

    rows: tuple[tuple[Any, ...], ...] = ()

    def step(self) -> None:
        super().step()
        if self.steps == 3:
            self.found += self.rows


def contact(time: float, first: int = 0, second: int = 1, normal: tuple[float, float] = (1.0, 0.0)) -> tuple[Any, ...]:
    return (time, first, second, normal, 1.0, 0.0, 0.0, 0.0)


def finds(*rows: tuple[Any, ...]) -> type[Found]:
    return type("Mine", (Found,), {"rows": rows})


class Raises(Flying):
    def step(self) -> None:
        super().step()
        if self.steps == 30:
            self.position[7] = 0.0


def returns(position: Floats, velocity: Floats, dt: float, scene: Scene) -> tuple[Floats, Floats]:
    return position + velocity * dt, velocity


def of_two(position: Floats, velocity: Floats) -> None:
    position += velocity / 60


def returns_nothing(first: object, second: object) -> None: ...


def of_three(position: Floats, velocity: Floats, dt: float) -> None: ...


@pytest.mark.parametrize(
    ("engine", "message"),
    [
        (NoStep, NO_STEP),
        (OtherArguments, "mine: its arguments are (scene: sandbox.scene.model.Scene) -> None; an engine is a class "),
        (of_three, "mine: its arguments are "),
        (of_two, "mine: raised TypeError: unsupported operand type(s) for /: 'State' and 'int'"),
        (returns_nothing, NO_STEP),
        (mine(state=lambda _: None), "mine: its state must be a sandbox.State, got None"),
        (Nan, "mine: the position of ball 1 must be finite, got [nan, nan]"),
        (
            mine(state=lambda self: replace(Flying.state(self), velocity=self.velocity[:1])),
            "mine: its velocity must be an array of shape (2, 2), got array([[ 60., -30.]])",
        ),
        (mine(contacts=lambda _: None), "mine: its contacts must be an array of sandbox.state.CONTACT, got None"),
        (finds(contact(0.05, 0, 3)), "mine: its contacts must be of two of its 2 balls and 4 walls"),
        (finds(contact(0.05, 1, 1)), "mine: its contacts must be of two of its 2 balls and 4 walls"),
        (finds(contact(math.inf)), "mine: its contacts must have finite numbers"),
        (
            mine(state=lambda self: replace(Flying.state(self), position=np.add(self.position, [[0], [1]]))),
            "mine: must start with the state it is built from: position [500.0, 300.0], got [501.0, 301.0] of ball 1",
        ),
        (
            mine(state=lambda self: replace(Flying.state(self), spin=np.zeros(2))),
            "mine: must start with the state it is built from: spin 2.0, got 0.0 of ball 0",
        ),
        (finds(contact(0.05), contact(0.04)), ORDER),
        (finds(contact(1.05)), ORDER),
        (finds(contact(0.05, normal=(0.0, 0.0))), "mine: the normals of its contacts must be unit vectors"),
        (Raises, "mine: raised IndexError: index 7 is out of bounds for axis 0 with size 2"),
        (mine(step=lambda _: sys.exit(3)), "mine: raised SystemExit: 3"),
        (
            mine(step=lambda self: self.scene.bodies.radius.fill(3)),
            "mine: raised ValueError: assignment destination is read-only",
        ),
        (returns, "mine: it must change the arrays position and velocity in place and return nothing, got tuple"),
    ],
)
def test_what_breaks_the_contract_is_one_message(engine: Any, message: str) -> None:
    scene = scene_of(ball_at(200, 300, vx=60, vy=-30, spin=2), ball_at(500, 300), more="seconds = 1")
    failed = compare(scene, {"mine": engine, "impulse": "impulse"}).failed
    assert str(failed["mine"]).startswith(message)


def test_an_exception_of_an_engine_comes_with_its_own_traceback() -> None:
    with pytest.raises(EngineError) as error:
        simulate(load("head-on"), {"mine": Raises})
    frames = [line for line in error.value.details.splitlines() if line.startswith("  File")]
    assert len(frames) == 1
    assert f'"{__file__}"' in frames[0]
    assert error.value.time == 0.5


def test_states_are_copied_and_have_the_time_of_the_run() -> None:
    class SharesArrays(Flying):
        def state(self) -> State:
            return State(5.0, self.position, self.velocity, spin=self.spin)

    engine = create(SharesArrays, scene := load("head-on"), spawn(scene))
    before = engine.state()
    copy = before.position.copy()
    engine.step()
    assert np.array_equal(before.position, copy)
    assert engine.state().time == 1 / 60


def test_contacts_count_from_when_an_engine_is_built_after_an_edit_too() -> None:
    class KeepsTime(Found):
        def __init__(self, scene: Scene, initial: State) -> None:
            super().__init__(scene, initial)
            self.rows = (contact(initial.time + 3 / 60),)

    inputs = [SetGravity(step=30, gravity=(0, 9))]
    run = simulate(load("head-on"), {"mine": KeepsTime}, steps=60, inputs=inputs)
    assert run.contacts["time"].tolist() == [3 / 60, 33 / 60]


@pytest.mark.parametrize("error", [1e-3, -1e-12])  # s, of the engine's own clock
def test_a_contact_has_the_time_of_the_step_by_any_clock_and_the_lower_ball_first(error: float) -> None:
    lockstep = Lockstep(load("head-on"), {"mine": finds(contact(3 / 60 + error, 1, 0))})
    runner = lockstep.engines["mine"]
    runner.record_contacts()
    do_steps(lockstep, 3)
    [found] = runner.contacts()
    assert found["time"] == runner.state().time == 3 / 60
    assert (found["first"], found["second"], found["normal"].tolist()) == (0, 1, [-1, 0])


def test_a_failure_after_an_edit_has_the_time_of_the_run() -> None:
    comparison = compare(
        load("head-on").changed(seconds=1.0),
        {"mine": Raises, "exact": "exact"},
        inputs=[SetGravity(step=12, gravity=(0, 9))],
    )
    assert comparison.failed["mine"].time == pytest.approx(0.7)


def test_an_engine_that_fails_costs_its_column_and_exit_code_2(working_folder: Path, command: Command) -> None:
    text = "def step(position, velocity, dt, scene):\n    position += velocity * dt\n    assert position[0, 0] < 300"
    (working_folder / "mine.py").write_text(text)
    code, out, err = command("compare", "head-on", "--engines", "mine.py:step,impulse,exact", "--seconds", "2")
    assert code == 2
    assert "Failed at" in out.partition("RMS gap")[0]
    assert err.splitlines()[-1] == "mine.py:step: raised AssertionError"
    assert err.count("Traceback") == 1
    code, out, err = command("compare", "head-on", "--engines", "exact,mine.py:step", "--against", "mine.py:step")
    assert (code, out) == (2, "")  # the reference


@pytest.mark.wide
def test_a_traceback_is_printed_once_for_all_rows_of_a_sweep(working_folder: Path, command: Command) -> None:
    (working_folder / "mine.py").write_text("def step(position, velocity, dt, scene):\n    1 / 0")
    arguments = ("--engines", "mine.py:step", "--seconds", "0.1", "--seeds", "0:3", "--out", "rows.csv")
    code, _, err = command("sweep", "head-on", *arguments, "--workers", "1")
    assert code == 1
    assert err.count("Traceback") == 1
    assert err.count(" at 0.017 s: raised ZeroDivisionError: division by zero\n") == 3


def test_verify_says_when_an_engine_broke_and_names_it_once(working_folder: Path, command: Command) -> None:
    text = "def step(position, velocity, dt, scene):\n    position += velocity * dt\n    assert position[0, 0] < 301"
    (working_folder / "mine.py").write_text(text)
    code, out, err = command("verify", "head-on", "--engines", "mine.py:step")
    begin, speed = (one[0, 0] for one in (spawn(load("head-on")).position, spawn(load("head-on")).velocity))
    broke = math.ceil((301 - begin) / speed * 60) / 60  # s, after the step that leads to 301 px or beyond
    assert code == 1
    assert " ".join(out.split("\n\n")[1].split()) == f"head-on, mine.py:step at {broke:.3f} s: raised AssertionError"
    assert err.count("Traceback") == 1


PRINTS = """print("loading")


def step(position, velocity, dt, scene):
    print("step")
    position += velocity * dt
"""


@pytest.mark.parametrize(
    "arguments",
    [
        ("compare", "head-on", "--seconds", "0.1", "--engines", "mine.py:step,exact", "--json", "-"),
        ("compare", "head-on", "--seconds", "0.1", "--engines", "mine.py:step,exact", "--csv", "-"),
        ("trace", "head-on", "--seconds", "0.1", "--engine", "mine.py:step"),
        ("verify", "head-on", "--engines", "mine.py:step", "--json", "-"),
        ("sweep", "head-on", "--seconds", "0.1", "--engines", "mine.py:step,exact", "--workers", "1"),
    ],
    ids=lambda arguments: f"{arguments[0]}-{arguments[-2]}",
)
def test_what_an_engine_prints_is_not_in_a_document(
    working_folder: Path, command: Command, arguments: tuple[str, ...]
) -> None:
    (working_folder / "mine.py").write_text(PRINTS)
    code, out, err = command(*arguments)
    assert code == int(arguments[0] == "verify")  # a loop without contacts misses the expectations
    assert not {"loading", "step"} & {*out.splitlines()}
    assert "loading" in err.splitlines()
    if arguments[0] != "sweep":  # whose worker writes to another standard error
        assert "step" in err.splitlines()
    if "--json" in arguments:
        json.loads(out)


def test_without_a_document_engines_print_to_standard_output(working_folder: Path, command: Command) -> None:
    (working_folder / "mine.py").write_text(PRINTS)
    _, out, _ = command("compare", "head-on", "--seconds", "0.1", "--engines", "mine.py:step,exact")
    assert out.startswith("loading\nstep\n")


def test_an_engine_that_fails_in_a_session_stops_and_the_others_go_on() -> None:
    session = Session(load("head-on"), {"mine": Raises, "impulse": "impulse"})
    for _ in range(60):
        session.advance()
    states = session.shown.states
    assert np.array_equal(states["mine"].position, session.moments(29, 29)[0].states["mine"].position)
    alone = simulate(load("head-on"), "impulse", steps=60)
    assert np.array_equal(states["impulse"].position, alone.position[60])


# What an engine may leave out


class Dumb(Flying):
    """A flight that reports nothing, and cannot be dragged."""

    contacts = kick = None  # type: ignore[assignment]


def silent(scene: Scene, engine: Any) -> Run:
    return compare(scene, {"mine": engine, "exact": "exact"}).runs["mine"]


def test_without_contacts_an_engine_is_judged_by_its_steps(loop: str) -> None:
    """The loop finds contacts late; balls that fly through everything miss first the contact of the two."""
    scene = load("head-on")
    for engine, cause in ((loop, Cause.LATE), (Dumb, Cause.MISSED)):
        run = silent(scene, engine)
        figures = run.figures
        assert (figures.pair_contacts, figures.wall_contacts, figures.momentum_drift) == (None, None, 0)
        assert bool(run.missed) == (cause == Cause.MISSED)
        assert {entry.cause for entry in figures.ledger} <= {cause, Cause.ROUNDING}
        first = figures.first_difference
        assert first is not None
        assert (first.cause, first.second) == (cause, 1)


def test_the_ledger_of_an_engine_without_contacts_adds_up(loop: str) -> None:
    scene = load("bouncing").changed(seconds=3.0)
    run = silent(scene, loop)
    assert sum(entry.energy for entry in run.figures.ledger) == pytest.approx(run.energy[-1] - run.energy[0], rel=1e-9)


def test_without_kick_drags_are_refused_by_name() -> None:
    scene, grab = load("head-on"), Grab(step=30, ball=0, at=(100, 100))
    message = "mine: has no method kick, so its balls cannot be dragged"
    with pytest.raises(Refused, match=f"^{message}$"):
        compare(scene, {"mine": Dumb, "exact": "exact"}, inputs=[grab])
    session = Session(scene, {"mine": Dumb, "exact": "exact"})
    with pytest.raises(Refused, match=f"^{message}$"):
        session.give(grab.model_copy(update={"step": 0}))
    assert session.inputs == []


def test_a_function_can_be_dragged(loop: str) -> None:
    scene = scene_of(ball_at(200, 300))
    assert simulate(scene, loop, steps=60, inputs=[Grab(step=0, ball=0, at=(400, 300))]).position[60, 0, 0] > 390


# Traits


def test_traits_must_be_traits() -> None:
    with pytest.raises(EngineError, match=r"^Mine: its traits must be sandbox\.Traits\(\.\.\.\), got {'soft': True}"):
        simulate(load("head-on"), mine(traits={"soft": True}), steps=1)


def test_traits_have_types() -> None:
    with pytest.raises(SandboxError, match=r"^Traits: soft must be True or False, got 1$"):
        Traits(soft=1)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="sofft"):
        Traits(sofft=True)  # type: ignore[call-arg]


# Contacts that last several steps


class Spring(Flying):
    """Balls as springs, in walls of springs; each reports a contact every step."""

    traits = Traits(soft=True)
    normals = np.array([(-1.0, 0.0), (0.0, -1.0), (1.0, 0.0), (0.0, 1.0)])

    def step(self) -> None:
        super().step()
        balls, touching = self.scene.bodies, dict[tuple[int, int], tuple[Floats, float]]()
        for i, radius in enumerate(balls.radius):
            for wall, normal in enumerate(self.normals):
                edge = max(0.0, float(normal @ self.scene.arena.size))
                touching[i, ~wall] = normal, self.position[i] @ normal + radius - edge
            for j in range(i + 1, len(balls)):
                way = self.position[j] - self.position[i]
                touching[i, j] = way / np.hypot(*way), radius + balls.radius[j] - np.hypot(*way)
        for (i, j), (normal, depth) in touching.items():
            push = 150.0**2 * max(0.0, depth) / (1 + (j >= 0)) / self.scene.rate
            self.velocity[i] -= push * normal
            if j >= 0:
                self.velocity[j] += push * normal
            if push > 0:
                self.found.append((self.time, i, j, tuple(normal), push, 0.0, 0.0, 0.0))


def test_a_spring_is_accused_of_nothing_though_it_reports_a_touch_many_times() -> None:
    """At 960 steps a touch of 20 ms keeps the energy to 1 %, though half of it is in the spring meanwhile."""
    run = silent(load("head-on").changed(rate=960), Spring)
    assert (run.figures.pair_contacts or 0) > 0
    assert run.missed == 0
    assert run.figures.energy_drift is not None
    assert run.figures.energy_drift < 0.01
    assert (np.abs(run.energy / run.energy[0] - 1)).max() > 0.4
    assert {entry.cause for entry in run.figures.ledger} <= {Cause.SOFT, Cause.ROUNDING}
    assert run.figures.first_difference is None
    assert run.causes == ()
