"""Watching a live Space: what is recorded is what it did, and what its program did to it is booked to the program."""

import json
import math
import re
import runpy
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pymunk
import pytest
from conftest import sample

import sandbox
from sandbox.analysis.verdict import verdict
from sandbox.errors import SandboxError, SpaceWarning
from sandbox.judge.causes import Cause
from sandbox.scripting.comparison import Comparison
from sandbox.scripting.watch import Watched, watch

RATE = 60
EXAMPLES = sorted((Path(__file__).parents[2] / "docs" / "examples").glob("*.py"))


def box(gravity: float = 0) -> pymunk.Space:
    """Return a box of 400 x 300 px, whose four walls are on the Space's own static body."""
    space = pymunk.Space()
    space.gravity = 0, gravity
    corners = [(0, 0), (400, 0), (400, 300), (0, 300)]
    for k in range(4):
        wall = pymunk.Segment(space.static_body, corners[k - 1], corners[k], 4)
        wall.elasticity = 1
        space.add(wall)
    return space


def add_ball(space: pymunk.Space, x: float, y: float, vx: float = 0, vy: float = 0, mass: float = 1) -> pymunk.Body:
    body = pymunk.Body(mass, pymunk.moment_for_circle(mass, 0, 10))
    body.position, body.velocity = (x, y), (vx, vy)
    disc = pymunk.Circle(body, 10)
    disc.elasticity = 1
    space.add(body, disc)
    return body


def ledger(watched: Watched, engine: str = "space") -> dict[Cause, float]:
    return {entry.cause: entry.energy for entry in watched.comparison.runs[engine].figures.ledger}


def test_balls_that_overlapped_when_watching_began_are_not_found_late() -> None:
    space = box()
    add_ball(space, 100, 100, 100)
    add_ball(space, 119, 105)
    with watch(space) as watched:
        for _ in range(RATE // 2):
            space.step(1 / RATE)
    one = watched.comparison.runs["space"].figures.first_difference
    assert one is not None
    assert one.cause == Cause.OVERLAPPED
    assert "overlapped by 0.353 px when the comparison began" in one.because
    assert "At the start, bodies overlap by up to 0.353 px, " in verdict(watched.comparison)


def test_what_is_recorded_is_what_pymunk_does_with_the_scene() -> None:
    space = box(gravity=300)
    for k in range(6):
        add_ball(space, 60 + 50 * k, 60 + 20 * k, 90 - 40 * k, 30 * k)
    scene = sandbox.from_space(space).changed(seconds=2)
    with watch(space) as watched:
        for _ in range(2 * RATE):
            space.step(1 / RATE)
    theirs = sandbox.compare(scene, ["pymunk", "exact"])
    own, pymunk_s = watched.comparison.runs["space"], theirs.runs["pymunk"]
    assert len(own.contacts) > 10
    assert own.contacts.tobytes() == pymunk_s.contacts.tobytes()
    assert own.energy.tobytes() == pymunk_s.energy.tobytes()
    assert own.figures.first_difference == pymunk_s.figures.first_difference
    assert own.figures.ledger == pymunk_s.figures.ledger
    assert watched.comparison.trusted_until == theirs.trusted_until


def test_damping_is_recognised() -> None:
    space = box()
    space.damping = 0.5
    add_ball(space, 60, 150, 100)
    with watch(space) as watched:
        for _ in range(RATE):
            space.step(1 / RATE)
    assert set(ledger(watched)) <= {Cause.DAMPING, Cause.ROUNDING}
    assert ledger(watched)[Cause.DAMPING] == pytest.approx(-(100**2) / 2 * (1 - 0.5**2))


def test_two_walls_of_one_body_that_are_touched_at_once_are_told_apart() -> None:
    space = box()
    add_ball(space, 380, 280, 100, 100)  # meets the right and the bottom wall at 6 px, in step 4
    with watch(space) as watched:
        for _ in range(8):
            space.step(1 / RATE)
    contacts = watched.comparison.runs["space"].contacts
    assert [(~contact["second"], contact["normal"].round(9).tolist()) for contact in contacts] == [
        (4 + 3, [0, 1]),  # walls 0 to 3 are the arena's; corner 2 to corner 3 is the fourth segment
        (4 + 2, [1, 0]),
    ]
    assert contacts["impulse"] == pytest.approx([200, 200])


def test_velocities_that_the_program_sets_are_booked_to_it_and_given_to_the_reference() -> None:
    space = box()
    ball = add_ball(space, 60, 150, 30)
    other = add_ball(space, 200, 60, mass=2)
    with watch(space) as watched:
        for step in range(RATE):
            if step == 10:
                ball.velocity, other.velocity = (90, 0), (0, 60)
            if step == 20:
                other.apply_impulse_at_world_point((0, 40), other.position)  # 20 px/s
            space.step(1 / RATE)
    given = (90**2 - 30**2) / 2 + 80**2  # m (v2² - v1²) / 2, of 1 kg and of 2 kg
    for engine in ("space", "exact"):
        assert ledger(watched, engine)[Cause.APPLIED] == pytest.approx(given)
        run = watched.comparison.runs[engine]
        assert run.final.position == pytest.approx(np.array([[60 + 5 + 75, 150], [200, 60 + 10 + 40 / 60 * 80]]))
    figures = watched.comparison.runs["space"].figures
    assert figures.first_difference is None
    assert (figures.momentum_drift or 0.0) < 1e-12
    assert figures.gap_max < 1e-9


def test_the_summary_says_how_much_more_energy_the_program_gave_the_space_than_the_reference() -> None:
    """A kick of dv adds m v.dv + m dv²/2; the ball is found late on the floor, and so has another v there."""
    space = box(gravity=900)
    ball = add_ball(space, 200, 200, 0, 333)
    kicked, before = 30, 0.0
    with watch(space) as watched:
        for step in range(40):
            if step == kicked:
                before = ball.velocity.y
                ball.velocity = 0, before - 100
            space.step(1 / RATE)
    comparison = watched.comparison
    given = {name: ledger(watched, name)[Cause.APPLIED] for name in ("space", "exact")}
    assert given["space"] == pytest.approx(-100 * before + 100**2 / 2)
    bounces = 2 * math.sqrt(333**2 + 2 * 900 * (300 - 4 - 10 - 200))  # px/s, that the floor at 286 px gives
    assert given["exact"] == pytest.approx(-100 * (333 + 900 * kicked / RATE - bounces) + 100**2 / 2)
    share = (given["space"] - given["exact"]) / comparison.energy_scale
    than = f"{100 * abs(share):.3g} % {'less' if share < 0 else 'more'} than exact"
    assert f"In all, the mouse or your code gave it {than}." in verdict(comparison)


def test_the_space_s_own_step_comes_back_even_after_an_error() -> None:
    space = box()
    add_ball(space, 60, 150)
    with pytest.raises(ZeroDivisionError), watch(space) as watched:
        space.step(1 / RATE / int(space.step != watched.step))
    assert "step" not in vars(space)


def test_step_of_the_object_records_without_a_with_block() -> None:
    space = box()
    add_ball(space, 60, 150, 240)
    watched = watch(space)
    for steps in (90, 180):  # one more wall each
        for _ in range(90):
            watched.step(1 / RATE)
        assert len(watched.comparison.time) == steps + 1
        assert len(watched.comparison.runs["space"].contacts) == steps // 90


def add_one(space: pymunk.Space) -> None:
    add_ball(space, 300, 200)


def remove_one(space: pymunk.Space) -> None:
    space.remove(*[shape for shape in space.shapes if isinstance(shape, pymunk.Circle)][1:])


def first(space: pymunk.Space) -> pymunk.Body:
    return next(body for body in space.bodies if body.body_type == pymunk.Body.DYNAMIC)


BREAKS: dict[str, Callable[[pymunk.Space], object]] = {
    "the circles changed": add_one,
    "a radius, elasticity or friction changed": lambda space: setattr(list(space.shapes)[-1], "elasticity", 0.5),
    "a mass or moment changed": lambda space: setattr(first(space), "mass", 3),
    "the gravity changed": lambda space: setattr(space, "gravity", (0, 100)),
    "a setting of the Space changed": lambda space: setattr(space, "iterations", 20),
    "a wall changed": lambda space: setattr(next(iter(space.shapes)), "friction", 0.5),
    "the position of ball 0 was set": lambda space: setattr(first(space), "position", (100, 100)),
    "the angular velocity of ball 0 was set": lambda space: setattr(first(space), "angular_velocity", 3),
}


@pytest.mark.parametrize("why", BREAKS)
def test_after_any_other_change_the_recording_begins_anew_and_says_so(why: str) -> None:
    space = box()
    add_ball(space, 60, 150, 30)
    with watch(space) as watched:
        for step in range(30):
            if step == 10:
                BREAKS[why](space)
            space.step(1 / RATE)
    with pytest.warns(SpaceWarning, match=f"^before step 11, {why}; .*, steps 11 to 30 of 30$"):
        comparison = watched.comparison
    assert len(comparison.time) == 21
    assert comparison.since == pytest.approx(10 / RATE)
    assert comparison.runs["space"].apart is None
    assert Cause.APPLIED not in ledger(watched)


def test_forces_and_joints_are_named_and_the_longest_part_without_them_is_compared() -> None:
    space = box()
    ball = add_ball(space, 60, 150, 30)
    with watch(space) as watched:
        for step in range(40):
            if step == 20:
                ball.apply_force_at_local_point((600, 0))
            if step == 35:
                space.add(pymunk.PivotJoint(space.static_body, ball, ball.position))
            space.step(1 / RATE)
    had = "the Space had 1 body with a force or torque, which a scene cannot have"
    match = f"^before step 21, {had}, and 1 more such change; .*, steps 1 to 20 of 40$"
    with pytest.warns(SpaceWarning, match=match):
        assert len(watched.comparison.time) == 21


@pytest.mark.parametrize("velocity", [math.nan, 1e308])
def test_a_velocity_that_is_no_number_of_a_scene_ends_the_recording_and_not_the_program(velocity: float) -> None:
    space = box()
    ball = add_ball(space, 60, 150, 30)
    with watch(space) as watched:
        for step in range(12):
            if step == 10:
                ball.velocity = velocity, 0
            space.step(1 / RATE)
    what = f"before step 11, the velocity of ball 0 was [{velocity}, 0.0], not within "
    with pytest.warns(SpaceWarning, match=rf"^{re.escape(what)}.*, steps 1 to 10 of 12$"):
        assert len(watched.comparison.time) == 11


IRREGULAR = [(12 + 7 * k % 11) / 1000 for k in range(90)]  # s, as `clock.tick(60) / 1000` gives them


def varying(watched: Watched) -> Comparison:
    """Return the comparison of a run whose dt varied, which warns of nothing else."""
    with pytest.warns(SpaceWarning) as warned:
        comparison = watched.comparison
    assert [str(one.message)[:15] for one in warned] == ["dt varied from "]
    return comparison


def test_a_variable_dt_is_compared_to_the_end_with_a_warning_that_says_what_it_does() -> None:
    space = box()
    add_ball(space, 60, 150, 30)
    with watch(space) as watched:
        for step in range(30):
            space.step(1 / RATE if step < 12 else 1 / 120)
    match = r"^dt varied from 0\.008333 to 0\.01667 s: in longer steps, contacts are found later "
    with pytest.warns(SpaceWarning, match=match):
        comparison = watched.comparison
    assert comparison.time[[12, 30]] == pytest.approx([12 / 60, 12 / 60 + 18 / 120])
    assert (comparison.scene.rate, comparison.since) == (round(30 / 0.35), 0)
    assert "0.35 s in steps of 8.333 to 16.67 ms, " in repr(comparison)
    for run in comparison.runs.values():
        assert run.final.position[0, 0] == pytest.approx(60 + 30 * (12 / 60 + 18 / 120))
    assert comparison["space"].first_difference is None


def test_gravity_in_irregular_steps_falls_short_by_half_a_step_s_fall_in_each() -> None:
    """Pymunk moves a ball before gravity pulls: x grows by v dt, where a parabola has v dt + g dt²/2."""
    space = box(gravity=120)
    add_ball(space, 60, 50, 30)
    with watch(space) as watched:
        for dt in IRREGULAR:
            space.step(dt)
    comparison = varying(watched)
    short = 120 / 2 * np.square(IRREGULAR)
    assert comparison.time == pytest.approx(np.append(0, np.cumsum(IRREGULAR)))
    exact = 50 + 120 / 2 * sum(IRREGULAR) ** 2
    assert comparison.runs["exact"].final.position[0, 1] == pytest.approx(exact)
    assert comparison.runs["space"].gap_max == pytest.approx(np.append(0, np.cumsum(short)), abs=1e-9)
    assert set(ledger(watched)) <= {Cause.GRAVITY, Cause.ROUNDING}
    assert ledger(watched)[Cause.GRAVITY] == pytest.approx(120 * short.sum())
    found = comparison["space"].first_difference
    assert found is not None
    assert found.because == (
        "Gravity is integrated in steps, which move balls at the velocity before it: each step ends "
        f"{short.min():.3g} to {short.max():.3g} px short of the parabola."
    )


class Faulty(pymunk.Space):
    """Adds to a velocity, or to a position, in one of its steps."""

    def __init__(self, at: int, key: str) -> None:
        super().__init__()
        self.at, self.key, self.calls = at, key, 0

    def step(self, dt: float) -> None:
        super().step(dt)
        self.calls += 1
        if self.calls == self.at:
            body = first(self)
            setattr(body, self.key, getattr(body, self.key) + pymunk.Vec2d(5, 0))


@pytest.mark.parametrize("at", [1, 33, 80])
@pytest.mark.parametrize(
    ("key", "cause"), [("position", Cause.TELEPORTED), ("velocity", Cause.UNREPORTED)], ids=["position", "velocity"]
)
def test_a_fault_in_one_of_irregular_steps_is_named_at_that_step(at: int, key: str, cause: Cause) -> None:
    space = Faulty(at, key)
    add_ball(space, 60, 150, 30)
    with watch(space) as watched:
        for dt in IRREGULAR:
            space.step(dt)
    found = varying(watched)["space"].first_difference
    assert found is not None
    time = sum(IRREGULAR[:at])
    assert found.cause == cause
    assert found.time == pytest.approx(time)
    assert f"in the step to {time:.3f} s" in found.because


def test_what_rests_while_dt_varies_is_explained_by_its_contacts() -> None:
    """Pymunk begins a lasting contact with its last impulse times the ratio of the two dt, and reports another sum."""
    space = box(gravity=300)
    for k in range(4):
        add_ball(space, 60 + 20 * k, 286 - 0.05)
    with watch(space) as watched:
        for dt in IRREGULAR:
            space.step(dt)
    comparison = varying(watched)
    assert len(comparison.runs["space"].contacts) > 100
    assert not {Cause.UNREPORTED, Cause.LARGE, Cause.SMALL} & set(ledger(watched))
    assert comparison["space"].momentum_drift == pytest.approx(0, abs=1e-12)


def test_damping_is_recognised_while_dt_varies() -> None:
    space = box()
    space.damping = 0.5
    add_ball(space, 60, 150, 100)
    with watch(space) as watched:
        for dt in IRREGULAR:
            space.step(dt)
    comparison = varying(watched)
    assert set(ledger(watched)) <= {Cause.DAMPING, Cause.ROUNDING}
    left = 0.5 ** (2 * sum(IRREGULAR))
    assert ledger(watched)[Cause.DAMPING] == pytest.approx(-(100**2) / 2 * (1 - left))
    assert comparison.runs["space"].final.velocity[0, 0] == pytest.approx(100 * math.sqrt(left))


def test_velocities_set_between_irregular_steps_reach_the_reference_at_the_same_moments() -> None:
    space = box()
    ball = add_ball(space, 60, 150, 30)
    with watch(space) as watched:
        for step, dt in enumerate(IRREGULAR):
            if step == 40:
                ball.velocity = 90, 0
            space.step(dt)
    comparison = varying(watched)
    x = 60 + 30 * sum(IRREGULAR[:40]) + 90 * sum(IRREGULAR[40:])
    for run in comparison.runs.values():
        assert run.final.position[0, 0] == pytest.approx(x)
    assert comparison["space"].first_difference is None


def test_a_dt_that_is_no_whole_rate_is_compared_without_a_warning() -> None:
    space = box()
    add_ball(space, 60, 150, 200)
    with watch(space) as watched:
        for _ in range(150):
            space.step(0.016)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        comparison = watched.comparison
    assert comparison.time[-1] == pytest.approx(2.4)
    assert "2.4 s at 62.5 steps per second" in repr(comparison)
    touch = (400 - 4 - 10 - 60) / 200  # s
    found = comparison.runs["space"].contacts["time"]
    assert found == pytest.approx([0.016 * math.ceil(touch / 0.016)])


def test_steps_of_no_time_do_not_count() -> None:
    """Pymunk does nothing in them."""
    runs = []
    for between in (False, True):
        space = box(gravity=300)
        ball = add_ball(space, 60, 150, 90)
        with watch(space) as watched:
            for step in range(60):
                if step == 20:
                    ball.velocity = 0, -100
                if between:
                    space.step(0)
                space.step(1 / RATE)
        runs.append(watched.comparison)
    assert runs[0].to_json() == runs[1].to_json()


def test_a_step_back_in_time_ends_the_recording() -> None:
    space = box()
    add_ball(space, 60, 150, 30)
    with watch(space) as watched:
        for step in range(30):
            space.step(-0.01 if step == 20 else 1 / RATE)
    match = r"^before step 21, dt was -0\.01 s, which must be from 1e-06 to 1 s; .*, steps 1 to 20 of 29$"
    with pytest.warns(SpaceWarning, match=match):
        assert len(watched.comparison.time) == 21


def test_the_recorded_steps_are_not_for_engines_that_take_equal_ones() -> None:
    space = box()
    add_ball(space, 60, 150, 30)
    with watch(space) as watched:
        for dt in IRREGULAR:
            space.step(dt)
    scene = varying(watched).scene
    with pytest.raises(sandbox.Refused, match=r"^pymunk: cannot repeat recorded steps, in steps of 12 to 22 ms; use"):
        sandbox.compare(scene, ["pymunk", "exact"])
    assert len(sandbox.compare(scene.changed(rate=60), ["pymunk", "exact"]).runs) == 2


def test_the_trajectory_is_what_the_space_did() -> None:
    space = box(gravity=900)
    body = add_ball(space, 60, 150, 300, mass=2)
    body.angle, body.angular_velocity = 0.5, 3.0
    seen = []
    with watch(space) as watched:
        for step in range(60):
            if step == 20:
                body.position = 200, 150  # begins a part
            space.step(1 / RATE)
            seen.append((*body.position, *body.velocity, body.angle, body.angular_velocity))
    with pytest.warns(SpaceWarning, match=r"the trajectory covers the longest part .*, steps 21 to 60 of 60$"):
        trajectory = watched.trajectory
    position, velocity = trajectory.position[1:, 0], trajectory.velocity[1:, 0]
    turning = trajectory.angle[1:, 0], trajectory.spin[1:, 0]
    assert np.column_stack([position, velocity, *turning]).tolist() == [list(row) for row in seen[20:]]
    assert trajectory.position[0].tolist() == [[200, 150]]
    assert trajectory.time.tolist() == pytest.approx([step / RATE for step in range(20, 61)], abs=1e-12)
    assert trajectory.contacts["time"].min() > 20 / RATE
    kinetic = 2 * (np.array(seen)[20:, 2:4] ** 2).sum(axis=1) / 2 + 2 * 10**2 / 2 * 3.0**2 / 2
    potential = -2 * 900 * position[:, 1]  # from where it counts is a convention
    assert np.ptp(trajectory.energy[1:] - kinetic - potential) < 1e-6
    with pytest.raises(SandboxError, match=r"^there is nothing to return: no step with a dt above 0 was done$"):
        watch(space).trajectory  # noqa: B018


def test_nothing_to_compare_is_one_error() -> None:
    space = box()
    with pytest.raises(SandboxError, match=r"^there is nothing to compare: no step with a dt above 0 was done$"):
        watch(space).comparison  # noqa: B018
    watched = watch(space)
    watched.step(1 / RATE)
    with pytest.raises(SandboxError, match=r"^there is nothing to compare: before step 1, there were no circles$"):
        watched.comparison  # noqa: B018
    add_ball(space, 60, 150)
    watched = watch(space)
    watched.step(1e-9)
    with pytest.raises(SandboxError, match=r"before step 1, dt was 1e-09 s, which must be from 1e-06 to 1 s$"):
        watched.comparison  # noqa: B018


def jointed() -> pymunk.Space:
    """Return a box that falls, and a rope of ten links that hold it."""
    space = box(gravity=900)
    last = space.static_body
    for k in range(10):
        link = pymunk.Body()
        link.position = 20 * k + 120, 100
        shape = pymunk.Poly.create_box(link, (10, 4)) if k == 9 else pymunk.Circle(link, 2)
        shape.mass, shape.filter = 1, pymunk.ShapeFilter(group=1)
        space.add(link, shape, pymunk.PinJoint(last, link, (100, 100) if k == 0 else (0, 0)))
        last = link
    return space


def test_a_space_that_exact_cannot_run_is_diagnosed_with_its_energy_and_finer_steps() -> None:
    space = jointed()
    with watch(space) as watched:
        for _ in range(RATE):
            space.step(1 / RATE)
    had = "before step 1, the Space had 10 PinJoints, 1 dynamic polygon"
    with pytest.raises(SandboxError, match=f"^there is nothing to compare: {had}, which a scene cannot have$"):
        watched.comparison  # noqa: B018
    assert "joint-stretched" in [finding.rule for finding in watched.findings]
    document = json.loads(watched.to_json())
    assert document["finer"]["error"] > 10 * document["finer"]["error_bar"]
    energy = document["energy"]
    assert sum(energy["lines"].values()) == pytest.approx(energy["end"] - energy["start"], rel=1e-9)
    text = watched.table(100)
    assert "Joints do not hold" in text
    assert "\nCompared with itself in finer steps, pymunk in " in text


def test_what_is_added_while_a_space_is_watched_has_the_line_that_added_it() -> None:
    space = box()
    with watch(space) as watched:
        body = pymunk.Body(1, 10)
        shape = pymunk.Circle(body, 20)
        shape.friction = 0.5
        body.position = 100, 100
        space.add(body, shape)
        space.step(1 / RATE)
    assert "add" not in vars(space)
    finding = next(finding for finding in watched.findings if finding.rule.startswith("moment"))
    assert re.fullmatch(r".*test_watch\.py:\d+", finding.bodies[0].line)


def test_other_moments_than_those_of_discs_are_not_compared() -> None:
    space = box()
    next(iter(add_ball(space, 60, 150).shapes)).friction = 0.5
    first(space).moment = 20
    watched = watch(space)
    watched.step(1 / RATE)
    with pytest.raises(SandboxError, match=r"moments m r²/2; in this Space, ball 0 20 instead of 50$"):
        watched.comparison  # noqa: B018


@pytest.mark.parametrize(
    ("arguments", "message"),
    [({"size": 5}, "size must be a list in brackets, got 5"), ({"title": 5}, "title must be text in quotes, got 5")],
    ids=["size", "title"],
)
def test_what_a_scene_cannot_have_is_refused_at_once(arguments: dict[str, Any], message: str) -> None:
    space = box()
    add_ball(space, 60, 150)
    with pytest.raises(SandboxError, match=f"^{message}$"):
        watch(space, **arguments)


def test_bodies_that_sleep_and_wake_are_read_as_themselves_and_rest_as_in_exact() -> None:
    space = box(gravity=900)
    space.sleep_time_threshold = 0.3
    balls = [add_ball(space, x, 286 - height) for x, height in ((60, 80), (160, 200), (260, 0))]
    for ball in balls:
        next(iter(ball.shapes)).elasticity = 0
    asleep, places = list[list[bool]](), list[Any]()
    with watch(space) as watched:
        for step in range(4 * RATE):
            if step == 3 * RATE:
                balls[1].velocity = 0, -300
            space.step(1 / RATE)
            asleep.append([ball.is_sleeping for ball in balls])
            places.append([ball.position for ball in balls])
    assert [*map(any, zip(*asleep, strict=True))] == [True] * 3
    assert asleep[3 * RATE - 1] == [True] * 3
    assert asleep[3 * RATE] == [True, False, True]
    assert watched.trajectory.position[1:].tolist() == np.array(places).tolist()
    assert watched.trajectory.velocity[3 * RATE].tolist() == [[0, 0]] * 3
    assert Cause.UNKNOWN not in ledger(watched)
    assert Cause.UNREPORTED not in ledger(watched)


@pytest.mark.parametrize("file", sample(EXAMPLES, 3), ids=lambda file: file.stem)
def test_the_examples_become_scenes_and_are_watched(file: Path, tmp_path: Path) -> None:
    program = runpy.run_path(str(file))
    space = program["make_space"]()
    scene = sandbox.from_space(space)
    sandbox.write(scene, tmp_path / "mine.toml")
    assert sandbox.load(tmp_path / "mine.toml") == scene
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with watch(space) as watched:
            program["run"](space)
        comparison = watched.comparison
    assert (comparison["space"].momentum_drift or 0.0) < 1e-9
    assert Cause.UNREPORTED not in ledger(watched)
    assert (Cause.APPLIED in ledger(watched)) == (file.stem == "pinball")


def test_there_are_examples() -> None:
    assert [file.stem for file in EXAMPLES] == ["gas", "pile", "pinball"]
