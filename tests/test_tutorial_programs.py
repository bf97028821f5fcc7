"""Each program of `tutorials/` has the mistake that it is there for: its balls go where a formula says they do."""

import math
from collections.abc import Callable
from typing import Final

import numpy as np
import pytest
from conftest import scene_of
from tutorial_programs import FOLDER, PROGRAMS

from sandbox.judge.causes import Cause
from sandbox.run.trajectory import Trajectory, simulate
from sandbox.scene.model import Scene

# Head-on: the balls approach by 6 px a step from 45 px apart, and are found 3 px deep after step 8.
FAST, BACK, GAP, FOUND, DEPTH = 240.0, -120.0, 45.0, 8, 3.0
GRAVITY: Final = 900.0
Of = Callable[[complex], complex]


def run(name: str, scene: Scene, steps: int) -> Trajectory:
    return simulate(scene, PROGRAMS[name].spec, steps=steps)


def head_on(
    masses: tuple[float, float] = (1, 1), radii: tuple[float, float] = (20, 20), elasticity: float = 1
) -> Scene:
    """Two balls on one line; the first turns at no wall within 20 steps."""
    return pair((FAST, BACK), masses, radii, elasticity, GAP)


def pair(
    speeds: tuple[float, float],
    masses: tuple[float, float] = (1, 1),
    radii: tuple[float, float] = (20, 20),
    elasticity: float = 1,
    gap: float = GAP,
) -> Scene:
    places = 300.0, 300 + sum(radii) + gap
    values = zip(places, speeds, masses, radii, strict=True)
    return scene_of(
        *(
            f"radius = {r}\nmass = {m}\nelasticity = {elasticity}\nposition = [{x}, 300]\nvelocity = [{v}, 0]"
            for x, v, m, r in values
        )
    )


def one_ball(position: tuple[float, float], velocity: tuple[float, float], more: str = "", ball: str = "") -> Scene:
    return scene_of(f"radius = 20\nposition = {list(position)}\nvelocity = {list(velocity)}\n{ball}", more=more)


def to_the_wall(elasticity: float, gap: float, along: float = 0) -> Scene:
    """A ball of 4 px a step, `gap` px from the left wall."""
    return one_ball((20 + gap, 100), (-FAST, along), ball=f"elasticity = {elasticity}")


# The table


def test_each_file_is_in_the_table_and_short() -> None:
    assert set(PROGRAMS) == {file.stem for file in FOLDER.glob("*.py")}
    assert len(PROGRAMS) >= 30
    for program in PROGRAMS.values():
        assert program.source.count("\n") < 40
        assert program.wrong.endswith(".")
        assert "\n" not in program.wrong
        assert program.true <= {cause.key for cause in Cause}


@pytest.mark.parametrize("name", PROGRAMS)
def test_the_mistake_shows_in_the_program_s_scene(name: str) -> None:
    """A ball is more than 2 px from where it should be at some time, or never by more than rounding."""
    program = PROGRAMS[name]
    off = np.abs(simulate(program.scene, program.spec).position - simulate(program.scene, "exact").position).max()
    assert off > 2 if program.says else off < 1e-3, f"off by {off:.3g} px"


# Two balls head-on: velocities after their contact


@pytest.mark.parametrize(
    ("name", "scene", "after"),
    [
        # v1 = 2 V - u1, where V = (m1 u1 + m2 u2) / (m1 + m2) = -48 px/s is the velocity of the centre of mass
        ("textbook", head_on((1, 4)), (-336, 24)),
        ("substeps", head_on((1, 4)), (-336, 24)),
        ("moved_one_by_one", head_on((1, 4)), (-336, 24)),
        ("pushed_by_half", head_on((1, 4)), (-336, 24)),
        ("pushed_first_only", head_on((1, 4)), (-336, 24)),
        ("pushed_twice", head_on((1, 4)), (-336, 24)),
        ("slowed_by_contacts", head_on((1, 4)), (0.9 * -336, 0.9 * 24)),
        ("centre_of_mass_formula", head_on((1, 4)), (-336, 24)),
        ("several_at_once", head_on((1, 4)), (-336 * 0.999**20, 24 * 0.999**20)),
        # that of masses 1 and 1/4, as the radii say
        ("mass_as_radius_squared", head_on((1, 1), (20, 10)), (2 * 168 - 240, 2 * 168 + 120)),
        # and as 1 and 1/8
        ("mass_as_radius_cubed", head_on((1, 1), (20, 10)), (2 * 200 - 240, 2 * 200 + 120)),
        # as equal masses
        ("masses_ignored", head_on((1, 4)), (-120, 240)),
        ("whole_velocities_swapped", head_on((1, 4)), (-120, 240)),
        # both with the velocity of the centre of mass; Verlet's, which ignores masses, with the mean
        ("impulse_without_restitution", head_on((1, 4)), (-48, -48)),
        ("merged", head_on((1, 4)), (-48, -48)),
        ("position_based", head_on((1, 4)), (-48, -48)),
        ("verlet", head_on((1, 4)), (60, 60)),
        # not at all; each turned round by itself; one only
        ("tangential_parts_swapped", head_on(), (FAST, BACK)),
        ("each_reflected", head_on(), (-240, 120)),
        ("only_one_changed", head_on(), (240, 240)),
    ],
)
def test_velocities_after_a_head_on_contact(name: str, scene: Scene, after: tuple[float, float]) -> None:
    velocity = run(name, scene, 20).velocity
    assert velocity[FOUND - 1, :, 0] == pytest.approx((FAST, BACK), rel=0.01)  # one damps them
    assert velocity[20, :, 0] == pytest.approx(after)
    assert velocity[20, :, 1] == pytest.approx(0)


def test_parting_pairs_are_turned_back_until_they_stick() -> None:
    """At e = 0.36 they part by 2.16 px a step, and so still overlap: 3 - 2.16 + 0.36 * 2.16 - ... = 3 - 2.16/1.36."""
    scene = head_on(elasticity=0.6)
    reversed_again, right = (run(name, scene, 40) for name in ("parting_pairs_reversed", "textbook"))
    assert right.velocity[40, :, 0] == pytest.approx((60 - 0.36 * 180, 60 + 0.36 * 180))
    assert reversed_again.velocity[40, :, 0] == pytest.approx((60, 60))
    distance = reversed_again.position[40, 1, 0] - reversed_again.position[40, 0, 0]
    assert 40 - distance == pytest.approx(3 - 2.16 / 1.36)


def test_pushing_by_half_moves_the_centre_of_mass() -> None:
    masses = np.array([1.0, 4.0])
    position = run("pushed_by_half", head_on((1, 4)), 20).position[:, :, 0]
    centre = position @ masses / 5
    assert centre[20] - (centre[0] - 48 * 20 / 60) == pytest.approx(DEPTH / 2 * (4 - 1) / 5)


def test_balls_of_one_radius_meet_too_early() -> None:
    """The second has 10 px, not 20: contact should be 45 px later than where it is."""
    velocity = run("one_radius", head_on(radii=(20, 10)), 20).velocity[:, 0, 0]
    early, right = (math.floor(gap / 6) + 1 for gap in (GAP - 10, GAP))
    assert (early, right) == (6, 8)
    assert [velocity[early - 1], velocity[early]] == pytest.approx([FAST, BACK])


def test_a_ball_that_moves_first_meets_one_that_has_yet_to_move_away() -> None:
    """They approach by 2 px a step from 7 px apart, so touch in step 4; the first is 4 px ahead in between."""
    scene = pair((240, 120), gap=7)
    found = [int(np.argmax(run(name, scene, 8).velocity[:, 0, 0] < 200)) for name in ("textbook", "moved_one_by_one")]
    assert found == [4, 3]


def test_springs_are_pressed_in_as_an_oscillator_is() -> None:
    """Depth u sqrt(m / k) for the reduced mass m, for half a period, pi sqrt(m / k), in steps that are short."""
    period = math.sqrt(0.5 / 500)
    end = run("springs", head_on().changed(rate=2400), 1200)
    depth = 40 - (end.position[:, 1, 0] - end.position[:, 0, 0])
    assert depth.max() == pytest.approx(360 * period, rel=0.01)
    assert (depth > 0).sum() == pytest.approx(2400 * math.pi * period, rel=0.01)
    assert end.velocity[-1, :, 0] == pytest.approx((BACK, FAST), abs=3)


def test_damped_springs_return_what_a_damped_oscillator_does() -> None:
    """e = exp(-pi z / sqrt(1 - z²)) for the damping ratio z, in steps that are short."""
    ratio = 5 / (2 * math.sqrt(500 * 0.5))
    velocity = run("springs_damped", head_on().changed(rate=2400), 1200).velocity[-1, :, 0]
    restitution = math.exp(-math.pi * ratio / math.sqrt(1 - ratio**2))
    assert (velocity[1] - velocity[0]) / 360 == pytest.approx(restitution, abs=0.01)


# Two balls at an angle: `oblique`, found after step 52


def oblique_contact(name: str) -> tuple[complex, complex, complex]:
    """Return both velocities after the contact, and the unit normal as found, as complex numbers."""
    velocity = run(name, PROGRAMS["whole_velocities_swapped"].scene, 52).velocity
    assert velocity[51].tolist() == [[200, 0], [0, 0]]
    away = complex(300, 128.2842712474619) - complex(100 + 200 * 52 / 60, 100)
    return complex(*velocity[52, 0]), complex(*velocity[52, 1]), away / abs(away)


@pytest.mark.parametrize(
    ("name", "first", "second"),
    [
        # A ball at rest has the angle 0, mirrored at the tangent i n: its direction is (i n)². Momentum is not kept.
        ("angles_reflected", lambda n: 0, lambda n: 200 * (1j * n) ** 2),
        ("whole_velocities_swapped", lambda n: 0, lambda n: 200),
        ("normal_from_velocities", lambda n: 0, lambda n: 200),
        ("textbook", lambda n: 200 - 200 * n.real * n, lambda n: 200 * n.real * n),
        # Along the normal, the first ball keeps all of its velocity.
        ("tangential_parts_swapped", lambda n: 200 * n.real * n, lambda n: 200 - 200 * n.real * n),
    ],
)
def test_velocities_after_an_oblique_contact(name: str, first: Of, second: Of) -> None:
    *velocities, normal = oblique_contact(name)
    assert velocities == pytest.approx([first(normal), second(normal)], abs=1e-10)


def test_the_centre_of_mass_formula_knows_no_elasticity() -> None:
    """Equal balls exchange their velocities, though e is 0.36."""
    velocity = run("centre_of_mass_formula", head_on(elasticity=0.6), 20).velocity[20, :, 0]
    assert velocity == pytest.approx((BACK, FAST))


def test_bounding_boxes_meet_before_the_balls_do() -> None:
    """At 4 px a step, boxes 18 px apart meet in step 5; the balls, 28 px aside, touch at sqrt(40² - 28²) = 28.6 px."""
    scene = scene_of("radius = 20\nposition = [100, 100]\nvelocity = [240, 0]", "radius = 20\nposition = [158, 128]")
    found = [int(np.argmax(run(name, scene, 12).velocity[:, 1, 0] > 0)) for name in ("bounding_boxes", "textbook")]
    assert found == [5, 8]


# One ball in flight


def fall(name: str, steps: int = 24) -> tuple[float, float]:
    """Return how far a ball has fallen from rest, px, and its velocity, px/s."""
    end = run(name, one_ball((100, 100), (0, 0), f"gravity = [0, {GRAVITY}]"), steps)
    return end.position[steps, 0, 1] - 100, end.velocity[steps, 0, 1]


_Q: Final = 0.999
_SPEEDS: Final = [_Q * (1 - _Q**k) / (1 - _Q) for k in range(1, 25)]  # g dt; v' = q (v + g dt) in each step
_DAMPED_FALL: Final = (2 * sum(_SPEEDS), _SPEEDS[-1] / 24)


@pytest.mark.parametrize(
    ("name", "shares", "speed"),
    [
        ("explicit_gravity", 24 * 23, 1),  # g dt² (0 + 1 + ... + 23)
        ("semi_implicit_gravity", 24 * 25, 1),  # g dt² (1 + 2 + ... + 24)
        ("walls_that_flip", 24**2, 1),
        ("several_at_once", *_DAMPED_FALL),
        ("gravity_twice", 2 * 24**2, 2),
        ("moved_twice", (2 * 24) ** 2, 2),
    ],
)
def test_a_fall_of_24_steps(name: str, shares: float, speed: float) -> None:
    assert fall(name) == pytest.approx((GRAVITY / 60**2 * shares / 2, speed * GRAVITY * 24 / 60))


def test_verlet_falls_as_semi_implicit_euler_does() -> None:
    assert fall("verlet") == pytest.approx(fall("semi_implicit_gravity"))
    assert fall("position_based") == pytest.approx(fall("semi_implicit_gravity"))


@pytest.mark.parametrize(
    ("name", "way", "speed"),
    [
        ("textbook", 90, 90),
        ("mirrored_walls", 90, 90),
        ("damped", 90 / 60 * 0.99 * (1 - 0.99**60) / (1 - 0.99), 90 * 0.99**60),
        ("fixed_dt", 90 * 60 / 50, 90),
        ("substeps", 90, 90),
        ("substeps_of_a_whole_step", 4 * 90, 90),
        ("whole_pixels", 60, 90),  # 1 of 1.5 px a step
        ("slow_balls_stopped", 90, 90),
        ("rolling_friction", 90 - 20 / 60 * 61 / 2, 70),  # 1/3 px/s less in each step, which it then moves
        ("speeds_limited", 90, 90),
    ],
)
def test_a_second_of_straight_flight(name: str, way: float, speed: float) -> None:
    end = run(name, one_ball((100, 100), (90, 0)), 60)
    assert end.position[60, 0, 0] - 100 == pytest.approx(way)
    assert end.velocity[60, 0, 0] == pytest.approx(speed)


def test_slow_balls_stand_still() -> None:
    end = run("slow_balls_stopped", one_ball((100, 100), (40, 30)), 60)
    assert end.position[60, 0].tolist() == [100, 100]
    assert end.velocity[60, 0].tolist() == [0, 0]


def test_single_precision_keeps_24_bits() -> None:
    position = run("single_precision", one_ball((100, 100), (90, 70)), 60).position
    assert np.array_equal(position[1:], position[1:].astype(np.float32))
    assert position[60, 0] == pytest.approx((190, 170), rel=1e-5)
    assert not np.array_equal(position, run("mirrored_walls", one_ball((100, 100), (90, 70)), 60).position)


# One ball at a wall, found 2 px deep after step 11


@pytest.mark.parametrize(
    ("name", "place"),
    [("mirrored_walls", 2), ("textbook", -2), ("walls_that_clamp", 0), ("walls_that_stop_sliding", -2)],
)
def test_where_a_ball_found_in_a_wall_goes(name: str, place: float) -> None:
    end = run(name, to_the_wall(1, 42), 12)
    assert end.position[11:, 0, 0] == pytest.approx([20 + place, 20 + place + 4])
    assert end.velocity[12, 0, 0] == pytest.approx(FAST)


def test_a_move_into_a_wall_is_undone_or_only_across_the_wall() -> None:
    """41 px from the wall, 3 px deep after step 11: back to 1 px from it, and along it by 2 px or not."""
    scene = to_the_wall(1, 41, along=120)
    ends = [run(name, scene, 11).position[11, 0] for name in ("move_undone", "move_undone_on_an_axis")]
    assert ends == pytest.approx(np.array([[21, 120], [21, 122]]))


def test_substeps_find_a_wall_a_quarter_of_a_step_late() -> None:
    """42.5 px from the wall, at 1 px a substep: half a px deep after 43 of them, and so half a px out after 44."""
    places = [run(name, to_the_wall(1, 42.5), 11).position[11, 0, 0] - 20 for name in ("substeps", "textbook")]
    assert places == pytest.approx([0.5, -1.5])


@pytest.mark.parametrize(
    ("name", "after"),
    [
        ("textbook", (0.8 * FAST, 100)),
        ("walls_without_elasticity", (FAST, 100)),
        ("restitution_of_whole_velocity", (0.8 * FAST, 80)),
        ("walls_that_stop_sliding", (0.8 * FAST, 0)),
        ("verlet", (0, 100)),
        ("position_based", (0, 100)),
    ],
)
def test_velocity_after_a_wall_of_elasticity_0_8(name: str, after: tuple[float, float]) -> None:
    assert run(name, to_the_wall(0.8, 42, along=100), 13).velocity[13, 0] == pytest.approx(after, abs=1e-9)


def test_a_ball_that_is_flipped_in_every_step_stays_in_the_wall() -> None:
    """Found 3 px deep, at e = 1/2: 3 - 2 + 1 - 1/2 + ... = 3 - 2 / (1 + 1/2) px deep in the end."""
    place = run("walls_that_flip", to_the_wall(0.5, 41), 60).position[60, 0, 0]
    assert 20 - place == pytest.approx(5 / 3)
    assert run("textbook", to_the_wall(0.5, 41), 60).position[60, 0, 0] == pytest.approx(17 + 2 * 49)


def test_walls_at_centres_let_a_ball_in_by_its_radius() -> None:
    position = run("walls_at_centres", to_the_wall(1, 42), 40).position[:, 0, 0]
    assert position.min() == pytest.approx(-2)  # 62 px in steps of 4


def test_of_two_walls_in_one_step_only_one_is_found() -> None:
    """At 3 px a step, both of the ball's coordinates are beyond the wall after step 10."""
    velocity = run("one_contact_a_step", one_ball((49, 49), (-180, -180)), 12).velocity[:, 0]
    assert velocity[9:12].tolist() == [[-180, -180], [180, -180], [180, 180]]


def test_energy_that_a_wall_takes_is_given_to_all_balls() -> None:
    """Two balls of one speed, of which one bounces at e = 0.8: each is 2 / (1 + 0.8²) times as energetic."""
    ball = "radius = 20\nvelocity = [-240, 0]\nelasticity"
    scene = scene_of(f"{ball} = 0.8\nposition = [62, 100]", f"{ball} = 1\nposition = [700, 300]")
    velocity = run("energy_rescaled", scene, 12).velocity[12, :, 0]
    factor = math.sqrt(2 / 1.64)
    assert velocity == pytest.approx([0.8 * 240 * factor, -240 * factor])
