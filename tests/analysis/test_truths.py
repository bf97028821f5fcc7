"""Every scene in scenes/truths states a law, and its numbers do not contradict each other."""

import numpy as np
import pytest

from sandbox.quantity import energy, momentum
from sandbox.scene.files import TRUTHS, bundled, load
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn, warnings
from sandbox.state import Floats

NAMES = list(bundled(TRUTHS))
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
    """Return the expected position or velocity of every ball at a time, (n, 2), if the scene says them all."""
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


def test_each_states_what_it_is_and_by_which_law(scene: Scene) -> None:
    assert scene.title
    assert scene.about
    assert scene.expect
    for one in scene.expect:
        assert one.because
        assert one.tolerance == 1e-6
        assert 0 < one.at <= scene.seconds


def test_expected_balls_are_inside_the_arena(scene: Scene) -> None:
    for one in scene.expect:
        if one.position is not None and one.ball is not None:
            radius = scene.bodies.radius[one.ball]
            assert np.all(np.array(one.position) >= radius)
            assert np.all(np.array(one.position) <= np.array(scene.arena.size) - radius)


def test_momentum_is_what_the_start_and_gravity_make_it(scene: Scene) -> None:
    start, mass = spawn(scene), scene.bodies.mass
    for at, value in expected(scene, "momentum"):
        grown = momentum(start.velocity, mass) + mass.sum() * np.array(scene.gravity) * at
        assert value == pytest.approx(grown, abs=1e-9 * mass.sum())
        velocity = all_balls(scene, "velocity", at)
        if velocity is not None:
            assert value == pytest.approx(momentum(velocity, mass), abs=1e-9 * mass.sum())


def test_the_centre_of_mass_flies_as_one_ball(scene: Scene) -> None:
    start = spawn(scene)
    for at, value in expected(scene, "centre_of_mass"):
        flown = start.position + start.velocity * at + np.array(scene.gravity) * at**2 / 2
        assert value == pytest.approx(centre(flown, scene), abs=1e-9)
        position = all_balls(scene, "position", at)
        if position is not None:
            assert value == pytest.approx(centre(position, scene), abs=1e-9)


def test_energy_is_that_of_the_expected_balls(scene: Scene) -> None:
    start = spawn(scene)
    field = scene.bodies.mass, scene.gravity, scene.arena.size
    for at, value in expected(scene, "energy_ratio"):
        position, velocity = all_balls(scene, "position", at), all_balls(scene, "velocity", at)
        if position is not None and velocity is not None:
            ratio = energy(position, velocity, *field) / energy(start.position, start.velocity, *field)
            assert value == pytest.approx(ratio, abs=1e-12)


def test_enough_scenes_state_every_ball_along_with_the_sums() -> None:
    """The three tests above check little if scenes state only the sums."""
    scenes = [load(name) for name in NAMES]
    stated = [(scene, at) for scene in scenes for at, _ in expected(scene, "momentum")]
    assert sum(all_balls(scene, "velocity", at) is not None for scene, at in stated) >= 15
    stated = [(scene, at) for scene in scenes for at, _ in expected(scene, "energy_ratio")]
    assert sum(all_balls(scene, "position", at) is not None for scene, at in stated) >= 25
