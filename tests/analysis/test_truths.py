"""Every scene in scenes/truths states a law, and its numbers are those of the law.

Every scored scene, bundled ones too, is missed by balls that fly through everything.
"""

import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np
import pytest
from conftest import sample
from recorded import recorded

from sandbox.quantity import momentum
from sandbox.scene.files import TRUTHS, bundled, load
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn, warnings
from sandbox.scene.walls import segment_distance
from sandbox.scores.verify import _scores_of_flight
from sandbox.state import Floats

NAMES = list(bundled(TRUTHS))
LEANING = "truths/discs-that-lean"  # a lasting contact, which solvers follow in steps or hops
FALLING = "truths/pyramid-falls"  # likewise
SLIDING = "truths/sliding-trains"
CARRIED = {SLIDING, FALLING, "truths/floor-under-a-heap", "truths/full-floor"}  # by walls, which take up momentum
OUTRUN = {"truths/thin-wall-60-hz"}  # in which a ball deliberately moves more than its radius in a step


@pytest.fixture(params=NAMES)
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def scene(name: str) -> Scene:
    return load(name)


def expected(scene: Scene, key: str) -> list[tuple[float, Floats]]:
    """List the times at which the scene expects a quantity of all balls together, with its value."""
    return [(one.at, np.array(getattr(one, key))) for one in scene.expect if getattr(one, key) is not None]


def all_balls(scene: Scene, key: str, at: float) -> Floats | None:
    """Return the expected position or velocity, (n, 2), or spin, (n,), of all balls at a time, if it says them all."""
    said = {one.ball: getattr(one, key) for one in scene.expect if one.at == at and getattr(one, key) is not None}
    return np.array([said[ball] for ball in range(len(scene.bodies))]) if len(said) == len(scene.bodies) else None


def centre(position: Floats, scene: Scene) -> Floats:
    return np.average(position, axis=0, weights=scene.bodies.mass)


def test_there_are_truths_and_no_other_scene_has_their_names() -> None:
    assert len(NAMES) >= 30
    assert set(NAMES) >= {f"{TRUTHS}/{law}" for law in ("head-on-equal-masses", "grazing", "bounce-elastic")} | OUTRUN
    assert not {load(name).name for name in NAMES} & set(bundled())  # `name` is what files and reports are called by


def test_each_loads_by_its_name_and_warns_of_nothing(name: str, scene: Scene) -> None:
    assert name == f"{TRUTHS}/{scene.name}"
    warned = list(warnings(scene, spawn(scene)))
    if name in OUTRUN:
        assert len(warned) == 1
        assert "more than its radius" in warned[0]
    else:
        assert warned == []


def test_each_states_what_it_is_and_by_which_law(name: str, scene: Scene) -> None:
    assert scene.title
    assert scene.about
    assert scene.expect
    for one in scene.expect:
        assert one.because
        if one.overlap is None:
            assert one.tolerance in ((0.5, 2) if name in (LEANING, FALLING) else (1e-6,))
        else:  # a solver that finds contacts at the end of a step has balls in each other
            assert one.tolerance <= scene.bodies.radius.min()
        assert 0 < one.at <= scene.seconds


def test_momentum_is_what_the_start_and_gravity_make_it(name: str, scene: Scene) -> None:
    if name in CARRIED:
        return
    start, mass = spawn(scene), scene.bodies.mass
    for at, value in expected(scene, "momentum"):
        grown = momentum(start.velocity, mass) + mass.sum() * np.array(scene.gravity) * at
        assert value == pytest.approx(grown, abs=1e-9 * mass.sum())


def test_the_centre_of_mass_flies_as_one_ball(name: str, scene: Scene) -> None:
    if name in CARRIED:
        return
    start = spawn(scene)
    for at, value in expected(scene, "centre_of_mass"):
        flown = start.position + start.velocity * at + np.array(scene.gravity) * at**2 / 2
        assert value == pytest.approx(centre(flown, scene), abs=1e-9)


def test_trains_slide_as_gravity_along_their_slopes_makes_them() -> None:
    scene = load(SLIDING)
    start, mass, radius = spawn(scene), scene.bodies.mass, 10
    slopes = np.array([np.subtract(wall.to, wall.start) for wall in scene.walls])
    slopes /= np.hypot(*slopes.T)[:, None]
    faces = np.array([wall.start for wall in scene.walls])  # of the walls' centre lines
    up = np.array([(y, -x) if x > 0 else (-y, x) for x, y in slopes])  # across each, away from the wall
    of_ball = (start.position[:, 0] > 1000).astype(int)  # the number of its wall
    along, across = slopes[of_ball], up[of_ball]
    speed, place = (np.sum(vector * along, axis=1) for vector in (start.velocity, start.position - faces[of_ball]))
    assert np.sum(start.velocity * across, axis=1) == pytest.approx(0)
    pull = along @ scene.gravity
    assert [at for at, _ in expected(scene, "momentum")] == [at for at, _ in expected(scene, "centre_of_mass")]
    for (at, momentum_then), (_, centre_then) in zip(
        expected(scene, "momentum"), expected(scene, "centre_of_mass"), strict=True
    ):
        assert momentum_then == pytest.approx(momentum((speed + pull * at)[:, None] * along, mass), abs=1e-9)
        slid = (place + speed * at + pull * at**2 / 2)[:, None] * along
        on_face = faces[of_ball] + slid + (radius + scene.walls[0].thickness / 2) * across
        assert centre_then == pytest.approx(centre(on_face, scene), abs=1e-9)


def test_soft_chains_end_as_contacts_in_turn_make_them_whatever_the_gaps() -> None:
    scene = load("truths/chains-touching-soft")
    start, bodies = spawn(scene), scene.bodies
    position, velocity = all_balls(scene, "position", 1), all_balls(scene, "velocity", 1)
    assert position is not None
    assert velocity is not None
    for y in dict.fromkeys(start.position[:, 1].tolist()):
        row = np.flatnonzero(start.position[:, 1] == y)
        mass = [Fraction(one) for one in bodies.mass[row].tolist()]
        e = Fraction(str(bodies.elasticity[row[0]])) ** 2
        gaps = [[1] * len(row), [1, 9, 2, 5][: len(row)], [7, 1, 8, 3][: len(row)]]
        ends = [after_all_contacts(mass, [300, *[0] * (len(row) - 1)], gap, e) for gap in gaps]
        assert ends[0] == ends[1] == ends[2]
        assert velocity[row, 0] == pytest.approx([float(one) for one in ends[0]], abs=1e-10)
        touch = (300 - 40 - 150) / 300  # s
        met = start.position[row, 0] + [110, *[0] * (len(row) - 1)]
        assert position[row, 0] == pytest.approx(met + velocity[row, 0] * (1 - touch), abs=1e-9)
    assert velocity[:, 1] == pytest.approx(0)
    assert position[:, 1] == pytest.approx(start.position[:, 1])


def after_all_contacts(
    mass: list[Fraction], speed: Sequence[float], gaps: Sequence[int], e: Fraction
) -> list[Fraction]:
    """Return the velocities of points on a line after all their contacts. gaps: before each point."""
    x, v = [Fraction(sum(gaps[: k + 1])) for k in range(len(mass))], [Fraction(one) for one in speed]
    while meetings := [((x[k + 1] - x[k]) / (v[k] - v[k + 1]), k) for k in range(len(x) - 1) if v[k] > v[k + 1]]:
        time, k = min(meetings)
        x = [place + rate * time for place, rate in zip(x, v, strict=True)]
        closing, both = v[k] - v[k + 1], mass[k] + mass[k + 1]
        v[k] -= (1 + e) * closing * mass[k + 1] / both
        v[k + 1] += (1 + e) * closing * mass[k] / both
    return v


def test_a_leaning_disc_drives_the_other_away_until_two_thirds_of_its_height() -> None:
    scene = load(LEANING)
    start, radius, gravity, height = spawn(scene), 25, scene.gravity[1], scene.arena.size[1]
    begin = math.acos((start.position[1, 1] - start.position[0, 1]) / (2 * radius))
    end = math.acos(2 / 3 * math.cos(begin))

    def turning(angle: Floats | float) -> Floats:  # rad/s, from the energy
        return np.sqrt(gravity / radius * (math.cos(begin) - np.cos(angle)))

    node, weight = np.polynomial.legendre.leggauss(60)
    root = (node + 1) / 2 * math.sqrt(end - begin)  # angle = begin + root²: the turning starts from 0
    apart = float(np.sum(weight * root / turning(begin + root**2))) * math.sqrt(end - begin)  # s
    speed = 2 * radius * math.cos(end) * turning(end)
    assert speed == pytest.approx(math.sqrt(16 / 27 * gravity * radius * math.cos(begin) ** 3))
    away = [one for one in scene.expect if one.ball == 1]
    assert away
    for one in away:
        x = radius + 2 * radius * math.sin(end) + speed * (one.at - apart)
        assert one.position == pytest.approx((x, height - radius), abs=1e-9)
        assert one.velocity == pytest.approx((speed, 0), abs=1e-9)
    falls = 2 * radius * math.cos(end)  # px, after they part, from this speed downwards
    down = 2 * radius * math.sin(end) * turning(end)
    lands = apart + (math.sqrt(down**2 + 2 * gravity * falls) - down) / gravity
    [fallen] = [one for one in scene.expect if one.ball == 0]
    assert fallen.at > lands
    assert (fallen.position, fallen.velocity) == ((radius, height - radius), (0, 0))
    faces = [segment_distance(start.position[2], wall.start, wall.to) - wall.thickness / 2 for wall in scene.walls]
    assert faces == pytest.approx([radius, radius])
    slopes = [np.subtract(wall.to, wall.start) for wall in scene.walls]
    assert slopes[0] == pytest.approx([-slopes[1][0], slopes[1][1]])  # alike, so that they carry it evenly
    [grooved] = [one for one in scene.expect if one.ball == 2]
    assert (grooved.position, grooved.velocity) == (tuple(start.position[2]), (0, 0))


def test_the_pyramid_that_falls_hardly_moves_for_a_second() -> None:
    scene = load(FALLING)
    start, (lower, _, upper), radius, gravity = spawn(scene), scene.bodies.friction, 25, scene.gravity[1]
    friction = lower * upper
    assert friction == pytest.approx(0.26)
    begin = math.asin((start.position[1, 0] - start.position[2, 0]) / (2 * radius))
    assert begin == pytest.approx(math.pi / 6)

    def change(angle: float, turning: float) -> tuple[float, float]:
        """Return angle' and angle'': x = 2 r sin(angle), y = -2 r cos(angle), and the two laws that give N and x''."""
        sine, cosine = math.sin(angle), math.cos(angle)
        drive = 2 / 3 * (sine - friction * (1 + cosine))  # x'' / N: a lower disc rolls, with the friction on both ends
        inward = 2 * radius * turning**2 / cosine
        force = (gravity - inward) / (2 * (cosine + friction * sine) + drive * sine / cosine)
        assert 0 < drive * force < gravity  # the upper one presses, and the lower ones roll outwards
        return turning, (drive * force / (2 * radius) + turning**2 * sine) / cosine

    state, step, states = np.array([begin, 0.0]), 1 / 600, {}
    for number in range(1, 601):  # the classical Runge-Kutta method
        first = np.array(change(*state))
        second = np.array(change(*(state + step / 2 * first)))
        third = np.array(change(*(state + step / 2 * second)))
        last = np.array(change(*(state + step * third)))
        state = state + step / 6 * (first + 2 * second + 2 * third + last)
        states[number / 600] = state
    early = [one for one in scene.expect if one.at <= 1]
    assert [(one.at, one.ball) for one in early] == [(0.5, 2), (1, 2), (1, 0), (1, 1)]
    for one in early:
        angle, turning = states[one.at]
        side = {0: -1, 1: 1, 2: 0}[one.ball or 0]
        place = (500 + side * 2 * radius * math.sin(angle), 575 - (not side) * 2 * radius * math.cos(angle))
        speed = 2 * radius * turning * (side * math.cos(angle) + (not side) * math.sin(angle))
        assert one.position == pytest.approx(place, abs=1e-6)
        assert one.velocity == pytest.approx((speed, 0) if side else (0, speed), abs=1e-6)
        assert one.spin == pytest.approx(speed / radius if side else 0, abs=1e-6)


@pytest.mark.parametrize(("first", "half_angle"), [(0, math.pi / 12), (3, math.atan(1 / 3))])
def test_the_pyramids_that_stand_have_more_friction_than_the_tangent_of_half_their_angle(
    first: int, half_angle: float
) -> None:
    scene = load("truths/pyramid-stands")
    friction = scene.bodies.friction
    left, _, top = spawn(scene).position[first : first + 3]
    x, y = top - left
    assert math.atan2(x, -y) / 2 == pytest.approx(half_angle)
    assert math.tan(half_angle) < friction[first] * friction[first + 2] < 1.05 * math.tan(half_angle)


def test_forces_within_the_cones_of_friction_hold_the_heap() -> None:
    """Those that its expectations name: in units of a disc's weight, on the second disc of each contact."""
    scene = load("truths/floor-under-a-heap")
    position, friction = spawn(scene).position, scene.bodies.friction
    aside = math.tan(math.pi / 12) / 2
    forces = {  # lower disc (None: the floor), upper disc: force up and to the right
        (3, 5): (0, 0.5), (4, 5): (0, 0.5),
        (0, 3): (aside, 0.5), (2, 4): (-aside, 0.5),
        (1, 3): (-aside, 1.0), (1, 4): (aside, 1.0),
        (None, 0): (aside, 1.5), (None, 2): (-aside, 1.5), (None, 1): (0.0, 3.0),
    }  # fmt: skip
    force, torque = np.tile([0.0, 1.0], (6, 1)), np.zeros(6)  # the weights; y is down
    for (lower, upper), (right, up) in forces.items():
        given = np.array([right, -up])
        normal = np.array([0.0, -1.0]) if lower is None else (position[upper] - position[lower]) / 50
        across = normal[0] * given[1] - normal[1] * given[0]
        factor = scene.arena.friction if lower is None else friction[lower]
        assert abs(across) <= factor * friction[upper] * (normal @ given)
        force[upper] += given
        torque[upper] -= across
        if lower is not None:
            force[lower] -= given
            torque[lower] -= across
    assert force == pytest.approx(0, abs=1e-9)
    assert torque == pytest.approx(0, abs=1e-9)


def test_the_floor_carries_the_weight_of_the_heap() -> None:
    scene = load("truths/floor-under-a-heap").changed(seconds=0.25)
    _, found = recorded("exact", scene, scene.steps)
    on_floor = found[found["second"] == ~3]
    weight = scene.bodies.mass.sum() * scene.gravity[1]
    assert on_floor["impulse"].sum() == pytest.approx(weight * scene.steps / scene.rate, rel=1e-12)
    assert on_floor["tangential"].sum() == pytest.approx(0, abs=1e-9 * weight)


SCORED = sample((name for name in (*NAMES, *bundled()) if load(name).expect), 4)


@pytest.mark.parametrize("name", SCORED)
def test_every_scored_scene_is_missed_by_balls_that_fly_through_everything(name: str) -> None:
    assert not all(score.passed for score in _scores_of_flight(load(name)))
