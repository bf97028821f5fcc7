"""The first difference: planted faults get the right name, at the contact where they are."""

import math
from collections.abc import Callable
from importlib.metadata import EntryPoint
from typing import Any

import numpy as np
import pytest
from conftest import scene_of
from faults import EventDriven

import sandbox.engines
from sandbox.analysis.comparison import compare
from sandbox.analysis.difference import Difference, pair_name
from sandbox.judge.causes import Cause
from sandbox.scene.fields import Vector
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.state import CONTACT, Contacts, State, no_contacts


class Faulty:
    """A plain stepped engine in a box, right except that it finds contacts late. Overriding a method plants a fault."""

    def __init__(self, scene: Scene, initial: State) -> None:
        self.scene, self.dt = scene, 1 / scene.rate
        self.time, self.steps = 0.0, 0
        self.x, self.v = initial.position.copy(), initial.velocity.copy()
        self.m, self.r = scene.bodies.mass, scene.bodies.radius
        self.found: list[tuple[Any, ...]] = []

    def impulse(self, i: int, j: int, right: float) -> float:
        return right

    def sees(self, i: int, j: int) -> bool:
        return True

    def put_back(self, depth: float) -> float:
        return 2 * depth

    def bounce(self, right: float) -> float:
        return right

    def step(self) -> None:
        self.steps += 1
        self.x += self.v * self.dt
        for i, x in enumerate(self.x):
            for wall, (nx, ny) in enumerate(((-1, 0), (0, -1), (1, 0), (0, 1))):
                n = np.array([nx, ny], float)
                face = max(0.0, float(n @ np.array(self.scene.arena.size)))
                depth, u = x @ n + self.r[i] - face, self.v[i] @ n
                if depth > 0 and u > 0:
                    impulse = self.bounce(2 * self.m[i] * u)
                    self.v[i] -= impulse / self.m[i] * n
                    self.x[i] -= self.put_back(depth) * n
                    self.report(i, ~wall, n, impulse, depth)
        for i in range(len(self.x)):
            for j in range(i + 1, len(self.x)):
                away = self.x[j] - self.x[i]
                depth = self.r[i] + self.r[j] - np.hypot(*away)
                n = away / np.hypot(*away)
                u = (self.v[i] - self.v[j]) @ n
                if depth > 0 and u > 0 and self.sees(i, j):
                    impulse = self.impulse(i, j, 2 * u / (1 / self.m[i] + 1 / self.m[j]))
                    self.v[i] -= impulse / self.m[i] * n
                    self.v[j] += impulse / self.m[j] * n
                    self.report(i, j, n, impulse, depth)

    def report(self, i: int, other: int, n: Any, impulse: float, depth: float) -> None:
        self.found.append((self.steps * self.dt, i, other, tuple(n), impulse, depth))

    def state(self) -> State:
        return State(self.steps * self.dt, self.x.copy(), self.v.copy())

    def contacts(self) -> Contacts:
        found, self.found = self.found, []
        return np.array([(*one, 0.0, 0.0) for one in found], CONTACT) if found else no_contacts()

    def kick(self, ball: int, dv: Vector) -> None:
        self.v[ball] += dv


class TooMuch(Faulty):
    def impulse(self, i: int, j: int, right: float) -> float:
        return 1.02 * right


class OneStepLate(Faulty):
    """Waits for a step between seeing an overlap and resolving it."""

    def __init__(self, scene: Scene, initial: State) -> None:
        super().__init__(scene, initial)
        self.seen: dict[tuple[int, int], int] = {}

    def sees(self, i: int, j: int) -> bool:
        return self.steps > self.seen.setdefault((i, j), self.steps)


class Blind(Faulty):
    def sees(self, i: int, j: int) -> bool:
        return (i, j) != (1, 2)


class MissesFirst(Faulty):
    """Sees no contact of two balls until they have turned at the walls."""

    def sees(self, i: int, j: int) -> bool:
        return bool(self.v[0, 0] < 0)


class SoftWalls(Faulty):
    def bounce(self, right: float) -> float:
        return right * 1.99 / 2


class Discards(Faulty):
    """Puts a ball 1 px less far back than it should, where it is 1 px deep."""

    def put_back(self, depth: float) -> float:
        return 2 * depth - 1


class BeyondTheLine(Faulty):
    """Reverses a ball at an inner wall at 400 px once its centre is beyond, and leaves it there."""

    def step(self) -> None:
        before = self.x[0, 0]
        super().step()
        if before < 400 <= self.x[0, 0]:
            self.report(0, ~4, (1.0, 0.0), 2 * self.v[0, 0], 22.0)
            self.v[0, 0] *= -1


First = Callable[[str, Scene], Difference | None]


def register(engine: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Register one of the engines above as `faulty`."""
    faulty = EntryPoint("faulty", f"{__name__}:{engine}", sandbox.engines.ENTRY_POINTS)
    monkeypatch.setitem(sandbox.engines._BUILT_IN, "faulty", faulty)


@pytest.fixture
def first_of(monkeypatch: pytest.MonkeyPatch) -> First:
    """Find the first difference of one of the engines above from exact."""

    def find(engine: str, scene: Scene) -> Difference | None:
        register(engine, monkeypatch)
        return compare(scene, ["faulty", "exact"]).runs["faulty"].figures.first_difference

    return find


# Balls 0 and 1 meet head-on, and then 2 is hit by 1. At 60 steps a second they touch on a step, but for rounding.
ROW = scene_of(
    "radius = 20\nposition = [100, 300]\nvelocity = [240, 0]",
    "radius = 20\nposition = [300, 300]",
    "radius = 20\nposition = [502, 300]",
    more="seconds = 3",
)
# One ball that a wall of 780 stops 1.4 px deep; another that never meets it.
WALL = scene_of(
    "radius = 20\nposition = [302, 300]\nvelocity = [480, 0]", "radius = 20\nposition = [100, 100]", more="seconds = 2"
)


def test_an_engine_without_a_fault_differs_in_displacements_only(first_of: First) -> None:
    assert first_of("Faulty", WALL) is None
    late = first_of("Faulty", load("oblique"))
    assert late is not None
    assert late.cause == Cause.LATE


def test_two_per_cent_too_much_impulse(first_of: First) -> None:
    one = first_of("TooMuch", ROW)
    assert one is not None
    assert (one.kind, one.first, one.second, one.cause) == ("outcome", 0, 1, Cause.LARGE)
    assert one.because == "The impulse is wrong: it is 2 % too large. It amounts to a restitution of 1.04."
    assert one.after is not None
    assert one.after[0][0] == pytest.approx(-0.02 * 240)
    assert one.should_after == ((0.0, 0.0), (240.0, 0.0))


def test_contacts_one_step_late(first_of: First) -> None:
    one = first_of("OneStepLate", load("oblique"))
    assert one is not None
    assert (one.kind, one.first, one.second, one.cause) == ("outcome", 0, 1, Cause.LATE)
    late = 1e3 * (53 / 60 - EXACT_OBLIQUE)
    assert late > 1e3 / 60
    assert one.because.startswith(f"Found {late:.3g} ms late, which is more than a step of 16.7 ms, ")


EXACT_OBLIQUE = 0.8585786437626906  # s


def test_a_contact_that_may_be_resolved_after_the_end_is_not_missing(first_of: First) -> None:
    """The two touch in step 52, and this engine parts them in the next."""
    assert first_of("OneStepLate", load("oblique").changed(seconds=52 / 60)) is None
    assert first_of("Blind", ROW.changed(seconds=0.1 + (160 + 162) / 240)) is not None


def test_balls_falling_together_have_the_same_contact_later() -> None:
    """Found 6.7 ms late, they have fallen on at 900 px/s²; what they give each other is the same."""
    scene = scene_of(
        "radius = 20\nposition = [100, 100]\nvelocity = [240, 0]",
        "radius = 20\nposition = [302.4, 100]",
        more="gravity = [0, 900]\nseconds = 0.9",
    )
    one = compare(scene, ["impulse", "exact"]).runs["impulse"].figures.first_difference
    assert one is not None
    assert one.after is not None
    assert one.should_after is not None
    assert one.after[0][1] - one.should_after[0][1] == pytest.approx(900 * (41 / 60 - 162.4 / 240))
    assert one.cause == Cause.PUSHED


def test_one_pair_ignored(first_of: First) -> None:
    one = first_of("Blind", ROW)
    assert one is not None
    assert (one.kind, one.first, one.second, one.cause) == ("missing", 1, 2, Cause.MISSED)
    assert one.because == "The two passed into each other without a reported contact."
    assert one.time == pytest.approx((160 + 162) / 240)
    assert (one.before, one.should_after) == (None, ((0.0, 0.0), (240.0, 0.0)))


def beside_a_wall(x: float, vx: float) -> Scene:
    """Make a scene of a ball that flies at an inner wall at 400 px, which `Faulty` ignores."""
    wall = "[[walls]]\nfrom = [400, 250]\nto = [400, 350]\nthickness = 4"
    return scene_of(f"radius = 20\nposition = [{x}, 300]\nvelocity = [{vx}, 0]\n{wall}", more="seconds = 0.5")


@pytest.mark.parametrize(
    ("x", "vx"), [(310, 3000), (300, 3000), (485, -3000), (500, -3000)], ids=["right", "onto", "left", "onto, left"]
)
def test_a_ball_that_goes_through_a_wall(first_of: First, x: float, vx: float) -> None:
    one = first_of("Faulty", beside_a_wall(x, vx))
    assert one is not None
    assert (one.kind, one.first, one.second, one.cause) == ("missing", 0, ~4, Cause.MISSED)
    assert one.because == (
        "The ball went through the wall between (400, 250) and (400, 350): it flew 50 px in the step, and the wall is "
        "4 px thick."
    )
    assert one.time == pytest.approx((abs(x - 400) - 22) / 3000)
    assert (one.before, one.should_after) == (None, ((-vx, 0.0),))


def test_a_wall_contact_reported_in_the_step_is_not_missed(monkeypatch: pytest.MonkeyPatch) -> None:
    """From 310 px to 360, to 410, which is reported, and back through the wall to 360, which is not."""
    register("BeyondTheLine", monkeypatch)
    run = compare(beside_a_wall(310, 3000).changed(seconds=0.1), ["faulty"]).runs["faulty"]
    [passage] = run.missed
    assert passage[:3] == (3, 0, ~4)
    assert passage.flown == pytest.approx(50)


def test_a_ball_that_the_reference_lets_through_a_wall() -> None:
    runs = compare(load("truths/thin-wall-60-hz"), ["exact", "pymunk"], against="pymunk").runs
    one = runs["exact"].figures.first_difference
    assert one is not None
    assert (one.kind, one.cause) == ("extra", Cause.MISSED)
    assert one.because.startswith("The reference is wrong here. The ball went through the wall between (900, 60)")
    assert one.cause_label == "contact missed, in the reference"


def test_walls_that_give_back_too_little(first_of: First) -> None:
    one = first_of("SoftWalls", WALL)
    assert one is not None
    assert (one.kind, one.first, one.second, one.cause) == ("outcome", 0, ~2, Cause.SMALL)
    assert one.because == "The right wall gave back 99 % of the speed, where 100 % is right."
    assert one.after is not None
    assert one.after[0] == pytest.approx((-0.99 * 480, 0.0))


def test_one_pixel_of_overshoot_thrown_away(first_of: First) -> None:
    one = first_of("Discards", WALL)
    assert one is not None
    assert (one.kind, one.first, one.second, one.cause) == ("outcome", 0, ~2, Cause.OVERSHOOT)
    assert one.because == "The ball was put back on the wall, which discarded 1 px of its way."
    assert one.after == one.should_after


# The article's rule, by radius


@pytest.mark.parametrize(
    ("radius", "cause", "said"),
    [
        (
            20,
            Cause.SMALL,
            ("2 v_n / 40 ", "95 % of it is missing, and the balls are still approaching", " -0.9 (2/r - 1)"),
        ),
        (
            4,
            Cause.SMALL,
            ("2 v_n / 8 ", "75 % of it is missing, and the balls are still approaching", " -0.5 (2/r - 1)"),
        ),
        (2, Cause.SMALL, ("2 v_n / 4 ", "50 % of it is missing.", " a restitution of 0 (2/r - 1)")),
        (0.5, Cause.LARGE, ("2 v_n / 1 ", "it is 100 % too large.", " 3 (2/r - 1)")),
    ],
)
def test_the_article_s_divisor_is_named_with_its_restitution(
    radius: float, cause: Cause, said: tuple[str, ...]
) -> None:
    scene = meeting(radius)
    run = compare(scene, ["article", "exact"]).runs["article"]
    one = run.figures.first_difference
    assert one is not None
    assert one.cause == cause
    for words in said:
        assert words in one.because
    gained = sum(entry.energy for entry in run.figures.ledger if entry.cause == cause)
    assert (gained > 0) == (cause == Cause.LARGE)


def test_at_radius_one_the_article_is_right() -> None:
    run = compare(meeting(1), ["article", "exact"]).runs["article"]
    assert not {Cause.SMALL, Cause.LARGE} & {entry.cause for entry in run.figures.ledger}
    assert run.figures.energy_ratio == pytest.approx(1)


def meeting(radius: float) -> Scene:
    return scene_of(
        f"radius = {radius}\nposition = [100, 300]\nvelocity = [30, 0]",
        f"radius = {radius}\nposition = [{130.25 + 2 * radius}, 300]",
        more="seconds = 1.5",
    )


# The causes in the article's own scene


def test_each_engine_s_cause_in_the_article_s_scene() -> None:
    runs = compare(load("article"), ["pymunk", "article", "impulse", "exact"]).runs
    firsts = {name: run.figures.first_difference for name, run in runs.items()}
    causes = {name: first.cause for name, first in firsts.items() if first}
    assert causes == {"pymunk": Cause.LATE, "article": Cause.SMALL, "impulse": Cause.LATE}
    article = firsts["article"]
    assert article is not None
    assert article.because == (
        "The impulse was 2 v_n / 40 where two equal masses need v_n: 95 % of it is missing, and the balls are still "
        "approaching. Dividing by the diameter amounts to a restitution of -0.9 (2/r - 1)."
    )


def test_a_contact_shorter_than_a_step_is_missing() -> None:
    """With the centres 39.9 px aside, they overlap for 2 √(40² - 39.9²) / 400 s = 14 ms, between two steps."""
    scene = scene_of(
        "radius = 20\nposition = [100, 300]\nvelocity = [400, 0]",
        "radius = 20\nposition = [303.4, 339.9]",
        more="seconds = 1",
    )
    one = compare(scene, ["pymunk", "exact"]).runs["pymunk"].figures.first_difference
    assert one is not None
    assert (one.kind, one.first, one.second, one.cause) == ("missing", 0, 1, Cause.MISSED)
    assert one.because == "The two would overlap for 14 ms: less than a step, which can miss it."


@pytest.mark.parametrize(
    ("engine", "found", "cause"), [("pymunk", "8.09 ms", Cause.LATE), ("box2d", "8.58 ms", Cause.EARLY)]
)
def test_an_error_of_the_reference_is_reported_as_the_reference_s(engine: str, found: str, cause: Cause) -> None:
    """In `oblique` exact is right, so any difference from another engine is that engine's error."""
    if engine not in sandbox.engines.registry():
        pytest.skip(f"needs {engine}")
    runs = compare(load("oblique"), ["exact", engine], against=engine).runs
    one, its = (runs["exact"].figures.first_difference, runs[engine].figures.first_difference)
    assert one is not None
    assert its is None
    assert one.cause == cause
    assert one.because.startswith(f"The reference is wrong here. Found {found} {cause.key}, ")


def test_a_reference_of_which_no_cause_is_known_is_not_called_wrong() -> None:
    """A ball slides along the floor. With 16 substeps, Pymunk has many contacts in each step, all with friction."""
    scene = scene_of(
        "radius = 15\nfriction = 0.5\nposition = [50, 285]\nvelocity = [200, 0]",
        size="[400, 300]\nfriction = 0.5",
        more="gravity = [0, 900]\nseconds = 0.2",
    )
    one = compare(scene).runs["pymunk"].figures.first_difference
    assert one is not None
    assert not one.in_reference
    assert one.because == "Gravity is integrated in steps: each ends 0.125 px short of the parabola."


class KicksLate(EventDriven):
    """Ball 0 gets another velocity at the end of step 59 of 60, or the number that a test sets."""

    at = 59

    def after_step(self) -> None:
        if self.steps == self.at:
            self.v[0] += 12


@pytest.mark.parametrize(("at", "found"), [(57, True), (58, True), (59, True), (60, False)])
def test_a_kick_near_the_end_is_a_difference_but_in_the_last_step(at: int, *, found: bool) -> None:
    """At the end of the last one, the engine may have a contact that it reports in the next."""
    scene = scene_of("radius = 20\nposition = [100, 300]\nvelocity = [100, 0]", more="seconds = 1")
    late = type("KicksLate", (KicksLate,), {"at": at})
    one = compare(scene, {"late": late, "exact": "exact"}).runs["late"].figures.first_difference
    assert (one is not None) == found
    if one:
        assert (one.kind, one.cause, round(one.time * 60)) == ("flight", Cause.UNTOLD, at)


def test_a_ball_that_passes_into_another_in_the_last_steps_is_missed() -> None:
    """The two touch after 57.5 steps, and have gone deeper in two steps by the end."""

    class Blind(EventDriven):
        def sees(self, i: int, other: int) -> bool:
            return other < 0

    scene = scene_of(
        "radius = 20\nposition = [100, 300]\nvelocity = [100, 0]",
        "radius = 20\nposition = [235.8, 300]",
        more="seconds = 1",
    )
    one = compare(scene, {"blind": Blind, "exact": "exact"}).runs["blind"].figures.first_difference
    assert one is not None
    assert (one.kind, one.cause) == ("missing", Cause.MISSED)


def test_a_contact_without_impulse_is_no_difference() -> None:
    """Along a wall that it touches, the article reverses a speed of 0 in every step."""
    scene = scene_of("radius = 20\nposition = [20, 300]\nvelocity = [0, 100]", more="seconds = 1")
    run = compare(scene, ["article", "exact"]).runs["article"]
    assert run.figures.wall_contacts == 60
    assert run.differences == ()
    assert not {Cause.TURNED, Cause.LARGE} & {entry.cause for entry in run.figures.ledger}


def test_balls_at_rest_that_are_pushed_out_of_an_overlap_at_the_start_are_not_blamed() -> None:
    scene = scene_of("radius = 20\nposition = [100, 300]", "radius = 20\nposition = [120, 300]", more="seconds = 1")
    one = compare(scene, ["article", "exact"]).runs["article"].figures.first_difference
    assert one is not None
    assert one.cause == Cause.OVERLAPPED
    assert one.because.startswith("Ball 0 and ball 1 overlapped by 20 px when the comparison began: ")


@pytest.mark.skipif("box2d" not in sandbox.engines.registry(), reason="needs box2d")
def test_each_contact_of_an_unconverged_chain_is_reported_as_unconverged() -> None:
    """Box2D's first contact of the cradle ends with the right restitution, but the next ones take too little on."""
    one = (
        compare(load("newtons-cradle").changed(seconds=2.0), ["box2d", "exact"]).runs["box2d"].figures.first_difference
    )
    assert one is not None
    assert (one.first, one.second, one.cause) == (0, 1, Cause.UNCONVERGED)
    assert one.because.endswith("Several contacts at once: the solver's iterations ended before all were right.")


@pytest.mark.skipif("box2d" not in sandbox.engines.registry(), reason="needs box2d")
def test_no_engine_differs_from_a_reference_whose_answer_depends_on_the_numbers_of_the_balls() -> None:
    comparison = compare(load("newtons-cradle").changed(seconds=2.0), ["exact", "box2d"], against="box2d")
    assert comparison.undecided == pytest.approx(180 / 240 + 1 / 60)  # s, the step after the first two touch
    assert comparison.runs["exact"].differences == ()


@pytest.mark.skipif("box2d" not in sandbox.engines.registry(), reason="needs box2d")
def test_a_missing_contact_of_balls_that_did_not_approach_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    """Box2D has a contact between the cradle's last two while both are at rest; Pymunk does not."""
    monkeypatch.setattr("sandbox.analysis.reference.find_tie", lambda *_, **__: None)  # as if Box2D were decided
    scene = load("newtons-cradle").changed(seconds=2.0)
    found = compare(scene, ["pymunk", "box2d"], against="box2d").runs["pymunk"].differences
    wrong = [one for one in found if one.kind == "missing" and one.cause == Cause.UNCONVERGED]
    assert wrong
    assert wrong[0].because.startswith("The reference is wrong here. Several contacts at once")


def test_the_cradle_s_contacts_one_a_step_are_late_and_not_missing() -> None:
    """Pymunk passes the velocity on by one ball in each step: the fifth contact is three steps late, to the bit."""
    run = compare(load("newtons-cradle").changed(seconds=2.0), ["pymunk", "exact"]).runs["pymunk"]
    assert run.figures.pair_contacts == 5
    assert "missing" not in [one.kind for one in run.differences]
    assert [(one.first, one.second) for one in run.differences] == [(0, 1), (1, 2), (2, 3), (3, 4), (4, 5)]


@pytest.mark.parametrize("speed", [240, 1000])
def test_a_missed_contact_is_not_matched_with_a_later_one_of_the_same_pair(first_of: First, speed: int) -> None:
    """The two, 24 px aside, fly through each other, turn at the walls, and would meet again: 40² = 24² + 32²."""
    scene = scene_of(
        f"radius = 20\nposition = [100, 300]\nvelocity = [{speed}, 0]",
        f"radius = 20\nposition = [700, 324]\nvelocity = [-{speed}, 0]",
        more="seconds = 4",
    )
    one = first_of("MissesFirst", scene)
    assert one is not None
    assert (one.kind, one.first, one.second, one.cause) == ("missing", 0, 1, Cause.MISSED)
    assert one.time == pytest.approx((600 - 32) / (2 * speed))


def test_contacts_of_one_step_in_another_order() -> None:
    """Ball 2 meets the heavy 1 two milliseconds before 0 does: a step finds both, and resolves 0 and 1 first."""
    scene = scene_of(
        "radius = 20\nposition = [100, 300]\nvelocity = [200, 0]",
        "radius = 20\nmass = 100\nposition = [240.6, 300]",
        "radius = 20\nposition = [380.8, 300]\nvelocity = [-200, 0]",
        more="seconds = 1",
    )
    one = compare(scene, ["impulse", "exact"]).runs["impulse"].figures.first_difference
    assert one is not None
    assert (one.kind, one.first, one.second, one.cause) == ("order", 0, 1, Cause.LATE)
    assert one.because.startswith(
        "Several contacts were found late, at the end of a step, and resolved in another order"
    )


def test_a_late_contact_is_compared_with_the_one_that_it_should_have_been() -> None:
    """In the break shot the cue ball hits ball 1 again within milliseconds, sooner than a step finds the first hit."""
    for name, run in compare(load("break-shot").changed(seconds=1.0)).runs.items():
        if one := run.figures.first_difference:
            assert (name, one.first, one.second) in {("pymunk", 0, 1), ("article", 0, 1)}
            assert one.before is not None
            assert one.should_before is not None
            assert np.allclose(one.before, one.should_before)


@pytest.mark.parametrize("engine", ["pymunk", "impulse"])
def test_a_depth_in_a_sentence_is_that_of_the_contact_that_the_sentence_names(engine: str) -> None:
    """In a gas, one late contact leads to many others, found late by other times at other depths."""
    scene = load("gas-100").changed(seconds=0.5)
    found = compare(scene, [engine, "exact"]).runs[engine].differences
    depths = {f"{one.time:.3f} s, {pair_name(scene, one)}": one.depth for one in found if one.depth is not None}
    named = set[str]()
    for one in found:
        here = f"{one.time:.3f} s, {pair_name(scene, one)}"
        where, _, because = one.because.removeprefix("It follows from ").rpartition(": ")
        if because.startswith("Found ") and (where or here) in depths:
            assert f" ms late, {depths[where or here]:.2g} px deep" in because
            named.add(where)
    assert len(named) > 5


def test_friction_at_a_slip_that_gravity_sped_up_is_gravity_s() -> None:
    """A ball falls on a rough slope between two steps."""
    scene = load("pile").changed(seconds=0.76)
    first = compare(scene, ["impulse", "exact"]).runs["impulse"].figures.first_difference
    assert first
    assert (first.cause, first.because[:33]) == (Cause.GRAVITY, "Gravity pulled for a whole step, ")


def test_no_difference_is_reported_beyond_the_horizon() -> None:
    comparison = compare(load("gas-100"))
    assert comparison.horizon is not None
    for run in comparison.runs.values():
        assert all(one.time <= comparison.horizon for one in run.differences)
        steps = [math.ceil(one.time * comparison.scene.rate - 1e-6) for one in run.differences]
        assert steps == sorted(steps)


def test_the_reference_does_not_differ_from_itself() -> None:
    assert compare(load("funnel").changed(seconds=2.0), ["exact"]).runs["exact"].differences == ()


def test_contacts_at_one_time_in_another_order_are_no_difference_where_the_paths_are_the_same() -> None:
    """In a corner a ball touches both walls at once: one engine tells the right one first, the other the lower one."""
    corner = scene_of(
        "radius = 20\nposition = [300, 300]\nvelocity = [123, 123]", size="[600, 600]", more="seconds = 3"
    )
    run = compare(corner.changed(arena={"size": (600, 600), "elasticity": 0.7}), ["impulse", "exact"]).runs["impulse"]
    assert run.figures.gap_max < 1e-9
    assert run.differences == ()


def test_a_late_contact_has_the_normal_that_it_was_found_on_and_the_right_one() -> None:
    """Two balls of radius 20 approach at 300 px/s, 20 px off centre: they touch at sin = 1/2, and are found deeper."""
    scene = scene_of(
        "radius = 20\nposition = [100, 300]\nvelocity = [300, 0]",
        "radius = 20\nposition = [203, 320]",
        more="seconds = 1",
    )
    comparison = compare(scene, ["pymunk", "exact"])
    [one] = comparison.runs["pymunk"].differences[:1]
    assert one.should_normal == pytest.approx((math.sqrt(3) / 2, 0.5))
    assert one.normal_at_touch == pytest.approx(one.should_normal)
    away = 203 - 100 - 300 * one.time  # of the centres along x, when it was found
    assert one.normal == pytest.approx((away / math.hypot(away, 20), 20 / math.hypot(away, 20)))
    assert one.depth == pytest.approx(40 - math.hypot(away, 20))
    assert 40 - math.hypot(away, 20) > 1
