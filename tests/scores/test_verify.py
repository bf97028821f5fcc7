"""The scoreboard: exact meets every truth, the others get honest scores."""

import json
from importlib.metadata import EntryPoint
from pathlib import Path

import numpy as np
import pytest
from conftest import Command, ball_at, scene_of

from sandbox.analysis.comparison import compare
from sandbox.analysis.expectations import ExpectedQuantity, Score
from sandbox.analysis.verdict import key_figures
from sandbox.engines import _BUILT_IN, ENTRY_POINTS
from sandbox.engines.exact import ExactEngine
from sandbox.run.edits import SetVelocity
from sandbox.run.inputs import Grab, Input
from sandbox.scene.files import bundled, load
from sandbox.scene.model import Scene
from sandbox.scores.verify import Board, Outcome, Result, all_passed, as_json, verify
from sandbox.state import State

TRUTHS = list(bundled("truths"))


def board_of(*scenes: Scene, engines: tuple[str, ...] = ("exact",)) -> Board:
    return dict(verify(scenes, engines))


def result_of(scene: Scene, engine: str = "exact") -> Result:
    [row] = board_of(scene, engines=(engine,)).values()
    return row[engine]


def score_of(scene: Scene, engine: str = "exact") -> Score:
    return result_of(scene, engine).worst


@pytest.mark.parametrize("name", TRUTHS)
def test_the_exact_engine_meets_every_truth(name: str) -> None:
    result = result_of(load(name))
    assert result.outcome is Outcome.MET
    assert all(score.error < 1e-9 for score in result.judged if score.expect.tolerance == 1e-6)


def test_pymunk_s_score_is_its_error() -> None:
    """In `oblique` it leaves at 105.88, -99.83 px/s where 100, -100 is true."""
    result = result_of(load("oblique"), "pymunk")
    assert result.worst.error == pytest.approx(((105.882353 - 100) ** 2 + (99.826840 - 100) ** 2) ** 0.5, abs=1e-5)
    assert result.outcome is Outcome.CLOSE


class Textbook:
    """An engine of one's own: balls that meet each other and the arena, with no friction, in steps."""

    gravity_factor = impulse_factor = 1.0
    ignores_mass = ignores_elasticity = False

    def __init__(self, scene: Scene, initial: State) -> None:
        self.scene, self.steps = scene, 0
        self.position, self.velocity = initial.position.copy(), initial.velocity.copy()

    def step(self) -> None:
        dt, gravity = 1 / self.scene.rate, self.gravity_factor * np.array(self.scene.gravity)
        self.position += self.velocity * dt + gravity * dt**2 / 2
        self.velocity += gravity * dt
        for i in range(len(self.position)):
            self._bounce(i)
            for j in range(i):
                self._collide(j, i)
        self.steps += 1

    def _bounce(self, i: int) -> None:
        bodies, arena = self.scene.bodies, self.scene.arena
        for axis, sign in ((0, -1), (0, 1), (1, -1), (1, 1)):
            face = arena.size[axis] - bodies.radius[i] if sign > 0 else bodies.radius[i]
            depth, closing = sign * (self.position[i, axis] - face), sign * self.velocity[i, axis]
            if depth > 0 and closing > 0:
                change = 1 + (1 if self.ignores_elasticity else bodies.elasticity[i] * arena.elasticity)
                self.velocity[i, axis] -= sign * change * closing
                self.position[i, axis] -= sign * change * depth

    def _collide(self, i: int, j: int) -> None:
        bodies, apart = self.scene.bodies, self.position[j] - self.position[i]
        distance, reach = np.hypot(*apart), bodies.radius[i] + bodies.radius[j]
        normal = apart / distance
        closing = (self.velocity[i] - self.velocity[j]) @ normal
        if distance < reach and closing > 0:
            per = [1 if self.ignores_mass else 1 / bodies.mass[k] for k in (i, j)]
            e = 1 if self.ignores_elasticity else bodies.elasticity[i] * bodies.elasticity[j]
            impulse = self.impulse_factor * (1 + e) * closing / sum(per) * normal
            push = (reach - distance) / sum(per) * normal
            for k, sign, per_mass in ((i, -1, per[0]), (j, 1, per[1])):
                self.velocity[k] += sign * per_mass * impulse
                self.position[k] += sign * per_mass * push

    def state(self) -> State:
        return State(self.steps / self.scene.rate, self.position.copy(), self.velocity.copy())


class NoLoss(Textbook):
    ignores_elasticity = True


class EqualMasses(Textbook):
    ignores_mass = True


class WeakImpulse(Textbook):
    impulse_factor = 0.9


class WeakGravity(Textbook):
    gravity_factor = 0.9


def test_a_good_engine_of_steps_and_each_with_one_bug_score_differently() -> None:
    names = [
        *("chain-of-five", "chains-touching-soft", "cradle-gapped", "free-fall-collision", "head-on-elasticities"),
        *("head-on-mass-ratios", "light-on-heavy", "heavy-on-light", "soft-rows-in-flight", "cluster"),
    ]
    engines = {each.__name__: each for each in (Textbook, NoLoss, EqualMasses, WeakImpulse, WeakGravity)}
    board = dict(verify([load(f"truths/{name}") for name in names], engines))
    passed = {
        name: sum(row[name].outcome in (Outcome.MET, Outcome.CLOSE) for row in board.values()) for name in engines
    }
    assert passed == {"Textbook": 10, "NoLoss": 8, "EqualMasses": 5, "WeakImpulse": 2, "WeakGravity": 8}
    assert {scene for scene, row in board.items() if row["WeakGravity"].outcome is Outcome.MISSED} == {
        "free-fall-collision",
        "soft-rows-in-flight",
    }


def test_an_engine_too_slow_for_a_scene_skips_it_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sandbox.scores.verify.FIRST_SECONDS", 0.0)
    board = dict(verify([load("oblique")], {"mine": Textbook, "impulse": "impulse"}, patience=0.0))
    assert board["oblique"]["impulse"].outcome is Outcome.CLOSE
    assert board["oblique"]["mine"].outcome is Outcome.SKIPPED
    assert "which is scored if it is named" in board["oblique"]["mine"].lines[0]


def test_the_json_names_error_tolerance_and_passed_or_why_it_was_refused() -> None:
    board = board_of(load("bouncing"), engines=("exact", "article"))
    document = json.loads(json.dumps(as_json(board)))
    row = document["scenes"]["bouncing"]
    passed = {"error": pytest.approx(0, abs=1e-9), "tolerance": 1e-6, "passed": True, "missed": [], "skipped": []}
    assert row["exact"] == passed
    assert list(row["article"]) == ["refused"]
    assert row["article"]["refused"].startswith("article: gravity and elasticity below 1 are not")
    assert document["tally"] == {"exact": {"met": 1}, "article": {"refused": 1}}


def test_a_miss_names_the_ball_the_quantity_its_unit_what_was_expected_and_what_came() -> None:
    scene = scene_of(
        "radius = 20\npositions = [[200, 100], [200, 300]]\nvelocity = [60, 0]\n[[expect]]\nat = 1\nball = 1\n"
        "position = [260, 300]\nvelocity = [57, 4]\nmomentum = [123, 4]\ntolerance = 1\n"
        'because = "nothing\\n  acts"\n'
    )
    result = result_of(scene)
    assert result.lines == [
        "ball 1 at 1 s: velocity (60, 0) instead of (57, 4), off by 5 px/s (tolerance 1 px/s): nothing acts",
        "at 1 s: momentum (120, 0) instead of (123, 4), off by 5 kg px/s (tolerance 1 kg px/s): nothing acts",
    ]
    assert result.worst.error == pytest.approx(5)
    first, second = result.document()["missed"]
    assert first == {
        "at": 1.0,
        "ball": 1,
        "quantity": "velocity",
        "unit": "px/s",
        "expected": (57.0, 4.0),
        "found": (60.0, 0.0),
        "error": 5.0,
        "tolerance": 1.0,
        "because": "nothing\n  acts",
    }
    assert (second["ball"], second["quantity"], second["unit"]) == (None, "momentum", "kg px/s")


def test_the_score_is_that_of_the_expectation_missed_most_and_so_is_the_first_line() -> None:
    expect = "\n[[expect]]\nat = 1\nball = 0\nposition = [{}, 300]\ntolerance = {}\nbecause = 'it flies on'"
    scene = scene_of(ball_at(200, 300, vx=60) + expect.format(272, 10) + expect.format(261, 1e-3))
    result = result_of(scene)
    assert result.worst.error == pytest.approx(1)
    assert result.worst.expect.tolerance == 1e-3
    assert "instead of (261, 300)" in result.lines[0]
    assert "instead of (272, 300)" in result.lines[1]


def test_the_engines_asked_for_must_pass_or_else_the_exact_engine() -> None:
    board = board_of(load("oblique"), engines=("article", "pymunk", "exact"))
    assert all_passed(board, None)
    assert all_passed(board, ["pymunk", "exact"])
    assert not all_passed(board, ["article", "exact"])
    strict = dict(verify([load("oblique")], ["pymunk"], tolerance=1e-3))
    assert strict["oblique"]["pymunk"].outcome is Outcome.MISSED
    refused = board_of(load("bouncing"), engines=("article",))
    assert refused["bouncing"]["article"].outcome is Outcome.REFUSED
    assert all_passed(refused, ["article"])


@pytest.mark.parametrize(
    ("balls", "walls", "deep"),
    [
        ("[[100, 100], [136, 100]]", "", 4),  # two balls
        ("[[17, 300], [600, 300]]", "", 3),  # the left wall
        ("[[400, 300], [600, 277]]", "[[walls]]\nfrom = [500, 250]\nto = [700, 250]\nthickness = 16\n", 1),
        ("[[400, 300], [440, 300]]", "", 0),
    ],
)
def test_the_deepest_overlap_is_of_two_balls_or_of_a_ball_and_a_wall(balls: str, walls: str, deep: float) -> None:
    scene = scene_of(
        f"radius = 20\npositions = {balls}\n{walls}"
        "[[expect]]\nat = 0\noverlap = 7\ntolerance = 0.5\nbecause = 'nothing is so deep'\n",
        size="[800, 600]\noverlap = 5",
    )
    [deviation] = score_of(scene).deviations
    assert deviation.quantity is ExpectedQuantity.OVERLAP
    assert deviation.measured == pytest.approx(deep)


@pytest.mark.parametrize(
    ("x", "error"),
    [
        ((150, 250, 250, 350), 0),
        ((150, 150, 250, 350), 0.25),  # one too far left
        ((150, 150, 150, 350), 0.5),
        ((350, 250, 250, 350), 0.25),
        ((50, 250, 250, 350), 0.25),  # one in no column, on the left or on the right
        ((150, 250, 250, 450), 0.25),
        ((50, 50, 450, 450), 1),
    ],
)
def test_shares_in_columns_are_compared_by_their_sums_up_to_each(x: tuple[int, ...], error: float) -> None:
    scene = scene_of(
        f"radius = 20\npositions = {[[at, 100 * k + 50] for k, at in enumerate(x)]}\n"
        "[[expect]]\nat = 0\ncolumns = { from = 100, to = 400, shares = [2, 4, 2] }\ntolerance = 0.2\n"
        "because = 'a law of chance'\n"
    )
    assert score_of(scene).error == pytest.approx(error)
    if error == 0.5:
        [line] = result_of(scene).lines
        shares = "(0.750, 0.000, 0.250) instead of (0.250, 0.500, 0.250)"
        assert line == f"at 0 s: columns {shares}, off by 0.5 (tolerance 0.2): a law of chance"


# Times between two steps

FALLING = scene_of(
    "radius = 20\nposition = [200, 100]\nvelocity = [60, -30]",
    more="gravity = [0, 900]\nrate = 60\nseconds = 1\n"
    "[[expect]]\nat = 0.51\nball = 0\nposition = [230.6, 201.745]\nvelocity = [60, 429]\nenergy_ratio = 1\n"
    "tolerance = 1e-9\nbecause = 'x + v t + g t² / 2'",
)


def test_what_is_expected_between_two_steps_or_after_the_end_is_skipped_and_said_so() -> None:
    between = result_of(FALLING)  # 0.51 s are 30.6 steps
    assert between.outcome is Outcome.SKIPPED
    assert between.lines == ["ball 0 at 0.51 s: skipped, since 0.51 s is between two of 60 steps a second"]
    assert all_passed({"scene": {"exact": between}}, ["exact"])
    assert score_of(FALLING.changed(rate=100)).passed
    comparison = compare(FALLING, ["exact"])
    figures = comparison.runs["exact"].figures
    assert (figures.met, figures.expected, figures.skipped) == (0, 0, 1)
    assert ["expectations met", "0 of 0, 1 skipped"] in list(key_figures(comparison))
    figures = compare(FALLING.changed(rate=100), ["exact"]).runs["exact"].figures
    assert (figures.met, figures.expected, figures.skipped) == (1, 1, 0)
    assert compare(FALLING.changed(rate=100, seconds=0.5), ["exact"]).runs["exact"].scores == ()


@pytest.mark.wide
@pytest.mark.parametrize("rate", [60, 61, 250])
@pytest.mark.parametrize("name", ["bouncing", "truths/bounce-half", "truths/cradle-gapped", "truths/cluster"])
def test_compare_and_verify_score_alike(name: str, rate: int) -> None:
    scene = load(name).changed(rate=rate)
    for engine in ("pymunk", "impulse", "exact"):
        scores = compare(scene, [engine]).runs[engine].scores
        assert scores == tuple(one for one in result_of(scene, engine).scores if one.expect.at <= scene.seconds)


def test_the_mouse_and_edits_end_expectations() -> None:
    scene, edits = FALLING.changed(rate=100), [SetVelocity(step=k, ball=0, velocity=(10.0, 0.0)) for k in (0, 3)]
    firsts: list[Input] = [Grab(step=3, ball=0, at=(400, 500)), *edits]
    for first in firsts:
        assert compare(scene, ["exact"], inputs=[first]).runs["exact"].scores == ()
    later = Grab(step=60, ball=0, at=(400, 500))
    assert compare(scene, ["exact"], inputs=[later]).runs["exact"].figures.met == 1


# Engines that break


class Breaks(ExactEngine):
    """Raises an exception in a scene with more than five balls, after a step."""

    def step(self) -> None:
        super().step()
        if len(self.state().position) > 5:
            raise ZeroDivisionError("no \x1b mass")


@pytest.fixture
def breaks(monkeypatch: pytest.MonkeyPatch) -> None:
    entry = EntryPoint("breaks", f"{__name__}:{Breaks.__name__}", ENTRY_POINTS)
    monkeypatch.setitem(_BUILT_IN, "breaks", entry)


@pytest.mark.usefixtures("breaks")
def test_an_engine_that_breaks_ends_its_own_column_only() -> None:
    scenes = [load(name) for name in ("oblique", "newtons-cradle", "head-on")]
    board = board_of(*scenes, engines=("breaks", "exact"))
    assert [row["breaks"].outcome for row in board.values()] == [Outcome.MET, Outcome.BROKE, Outcome.NOT_RUN]
    assert [row["exact"].outcome for row in board.values()] == [Outcome.MET] * 3
    broken = board["newtons-cradle"]["breaks"]
    assert broken.message == "breaks: ZeroDivisionError: no \N{REPLACEMENT CHARACTER} mass"
    assert "in advance" in broken.details
    assert board["head-on"]["breaks"].message == "breaks broke in newtons-cradle"
    assert all_passed(board, None)
    assert not all_passed(board, ["breaks"])


@pytest.mark.usefixtures("breaks")
def test_the_command_names_the_engine_that_broke_and_ends_with_1(command: Command) -> None:
    code, out, err = command("verify", "newtons-cradle", "head-on", "--engines", "breaks")
    assert code == 1
    assert "newtons-cradle, breaks: ZeroDivisionError: no" in out
    assert "head-on" not in out  # no row says again that no engine is left
    assert out.endswith("breaks: 0 of 2 scenes met, 1 broke, 1 not run\n")
    assert err.startswith("Traceback")


# What the command prints


WIDE = """\
scene              exact          pymunk         article
oblique       2.0e-14 ok   5.9e+00 close  1.2e+02 MISSED
bouncing      0.0e+00 ok   1.5e+01 close         refused
"""


NARROW = """\
oblique
  exact    2.0e-14 ok
  pymunk   5.9e+00 close
  article  1.2e+02 MISSED
bouncing
"""


@pytest.mark.parametrize(("columns", "rows"), [(80, WIDE), (50, NARROW)])
def test_rows_fit_the_terminal(command: Command, monkeypatch: pytest.MonkeyPatch, columns: int, rows: str) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    _, out, _ = command("verify", "oblique", "bouncing", "--engines", "exact,pymunk,article")
    assert out.startswith(rows)
    tally = (
        "exact: 2 of 2 scenes met pymunk: 0 of 2 scenes met, 2 close article: 0 of 2 scenes met, 1 missed, 1 refused"
    )
    assert out.rpartition("\n\n")[2].split() == tally.split()


def test_two_scenes_of_one_name_have_a_row_each(command: Command, working_folder: Path) -> None:
    for folder, x in (("a", 261), ("b", 260)):
        Path(folder).mkdir()
        Path(folder, "fly.toml").write_text(
            "[arena]\nsize = [800, 600]\n[[balls]]\nradius = 20\nposition = [200, 300]\nvelocity = [60, 0]\n"
            f"[[expect]]\nat = 1\nball = 0\nposition = [{x}, 300]\ntolerance = 1e-9\nbecause = 'it flies on'\n"
        )
    code, out, _ = command("verify", "a/fly.toml", "b/fly.toml", "--engines", "exact", "--json", "-")
    assert code == 1
    assert {name: row["exact"]["passed"] for name, row in json.loads(out)["scenes"].items()} == {
        "fly": False,
        "b/fly.toml": True,
    }
