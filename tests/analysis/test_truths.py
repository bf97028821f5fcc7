"""Every scene in scenes/truths states a law, and its numbers do not contradict each other.

Every scored scene, bundled ones too, is failed by engines in which balls fly through what they should not.
"""

import math
from collections.abc import Sequence
from fractions import Fraction
from importlib.metadata import EntryPoint

import numpy as np
import pytest

import sandbox.engines
from sandbox.analysis.expectations import steps_around
from sandbox.analysis.verify import Outcome, verify
from sandbox.engines.exact import ExactEngine
from sandbox.quantity import energy, momentum, segment_distance
from sandbox.scene.balls import BallGroup
from sandbox.scene.fields import Vector
from sandbox.scene.files import TRUTHS, bundled, load
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn, warnings
from sandbox.state import Contacts, Floats, State, States, no_contacts

NAMES = list(bundled(TRUTHS))
LEANING = "truths/discs-that-lean"  # a lasting contact, which solvers follow in steps or hops
SLIDING = "truths/sliding-trains"  # along walls, which take up momentum
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


def test_each_states_what_it_is_and_by_which_law(name: str, scene: Scene) -> None:
    assert scene.title
    assert scene.about
    assert scene.expect
    for one in scene.expect:
        assert one.because
        if one.overlap is None:
            assert one.tolerance == (0.5 if name == LEANING else 1e-6)
        else:  # a solver that finds contacts at the end of a step has balls in each other
            assert one.tolerance <= scene.bodies.radius.min()
        assert 0 < one.at <= scene.seconds


def test_expected_balls_are_inside_the_arena(scene: Scene) -> None:
    for one in scene.expect:
        if one.position is not None and one.ball is not None:
            radius = scene.bodies.radius[one.ball]
            assert np.all(np.array(one.position) >= radius)
            assert np.all(np.array(one.position) <= np.array(scene.arena.size) - radius)


def test_momentum_is_what_the_start_and_gravity_make_it(name: str, scene: Scene) -> None:
    if name == SLIDING:
        return
    start, mass = spawn(scene), scene.bodies.mass
    for at, value in expected(scene, "momentum"):
        grown = momentum(start.velocity, mass) + mass.sum() * np.array(scene.gravity) * at
        assert value == pytest.approx(grown, abs=1e-9 * mass.sum())
        velocity = all_balls(scene, "velocity", at)
        if velocity is not None:
            assert value == pytest.approx(momentum(velocity, mass), abs=1e-9 * mass.sum())


def test_the_centre_of_mass_flies_as_one_ball(name: str, scene: Scene) -> None:
    if name == SLIDING:
        return
    start = spawn(scene)
    for at, value in expected(scene, "centre_of_mass"):
        flown = start.position + start.velocity * at + np.array(scene.gravity) * at**2 / 2
        assert value == pytest.approx(centre(flown, scene), abs=1e-9)
        position = all_balls(scene, "position", at)
        if position is not None:
            assert value == pytest.approx(centre(position, scene), abs=1e-9)


def test_energy_is_that_of_the_expected_balls(scene: Scene) -> None:
    start = spawn(scene)
    field = scene.bodies, scene.gravity, scene.arena.size
    for at, value in expected(scene, "energy_ratio"):
        position, velocity = all_balls(scene, "position", at), all_balls(scene, "velocity", at)
        if position is not None and velocity is not None:
            ratio = energy(State(at, position, velocity), *field) / energy(start, *field)
            assert value == pytest.approx(ratio, abs=1e-12)


def test_enough_scenes_state_every_ball_along_with_the_sums() -> None:
    """The three tests above check little if scenes state only the sums."""
    scenes = [load(name) for name in NAMES]
    stated = [(scene, at) for scene in scenes for at, _ in expected(scene, "momentum")]
    assert sum(all_balls(scene, "velocity", at) is not None for scene, at in stated) >= 15
    stated = [(scene, at) for scene in scenes for at, _ in expected(scene, "energy_ratio")]
    assert sum(all_balls(scene, "position", at) is not None for scene, at in stated) >= 25


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


class Through:
    """Balls fly through everything."""

    def __init__(self, scene: Scene, initial: State) -> None:
        self._rate, self._steps, self._start, self._gravity = scene.rate, 0, initial, np.array(scene.gravity)

    def step(self) -> None:
        self._steps += 1

    def state(self) -> State:
        time, start = self._steps / self._rate, self._start
        flown = start.position + start.velocity * time + self._gravity * time**2 / 2
        return State(time, flown, start.velocity + self._gravity * time)

    def contacts(self) -> Contacts:
        return no_contacts()

    def kick(self, ball: int, dv: Vector) -> None:
        raise NotImplementedError


class WallsOnly(Through):
    """Balls fly through each other: each is alone in its arena."""

    def __init__(self, scene: Scene, initial: State) -> None:
        super().__init__(scene, initial)
        self._alone = []
        for ball, (radius, mass, elasticity) in enumerate(
            zip(scene.bodies.radius, scene.bodies.mass, scene.bodies.elasticity, strict=True)
        ):
            group = BallGroup(radius=radius, mass=mass, elasticity=elasticity, position=initial.position[ball])
            state = State(0.0, initial.position[[ball]], initial.velocity[[ball]])
            self._alone.append(ExactEngine(scene.changed(balls=[group], expect=()), state))

    def advance(self, steps: int, position: Floats, velocity: Floats, angle: Floats, spin: Floats) -> None:
        own = States.empty(steps, 1)
        for ball, engine in enumerate(self._alone):
            engine.advance(steps, *own)
            for ours, alone in zip((position, velocity, angle, spin), own, strict=True):
                ours[:, [ball]] = alone

    def state(self) -> State:
        states = [engine.state() for engine in self._alone]
        position, velocity = ([getattr(state, key)[0] for state in states] for key in ("position", "velocity"))
        return State(states[0].time, np.array(position), np.array(velocity))


class PairsOnly(Through):
    """Balls fly through walls: these are far away."""

    FAR = 2.0**14  # px, a power of two so that moving by it hardly rounds

    def __init__(self, scene: Scene, initial: State) -> None:
        super().__init__(scene, initial)
        width, height = scene.arena.size
        arena = scene.arena.model_copy(update={"size": (width + 2 * self.FAR, height + 2 * self.FAR)})
        moved = State(0.0, initial.position + self.FAR, initial.velocity)
        self._engine = ExactEngine(scene.changed(arena=arena, walls=(), expect=()), moved)

    def step(self) -> None:
        self._engine.step()

    def state(self) -> State:
        state = self._engine.state()
        return State(state.time, state.position - self.FAR, state.velocity)


SCORED = [name for name in (*NAMES, *bundled()) if load(name).expect]


def fails(engine: type, scene: Scene, monkeypatch: pytest.MonkeyPatch) -> bool:
    entry = EntryPoint("faulty", f"{__name__}:{engine.__name__}", sandbox.engines.ENTRY_POINTS)
    monkeypatch.setitem(sandbox.engines._BUILT_IN, "faulty", entry)
    [(_, row)] = verify([scene], ["faulty"])
    return row["faulty"].outcome is Outcome.MISSED


def touched(scene: Scene) -> tuple[bool, bool]:
    """Return whether two balls touch, and whether a ball and a wall do, before the last expectation."""
    engine = ExactEngine(scene, spawn(scene))
    engine.contacts()
    for _ in range(max(steps_around(one.at, scene.rate)[1] for one in scene.expect)):
        engine.step()
    second = engine.contacts()["second"]
    return bool((second >= 0).any()), bool((second < 0).any())


@pytest.mark.parametrize("name", SCORED)
def test_every_scored_scene_is_failed_by_an_engine_without_contacts(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    assert fails(Through, load(name), monkeypatch)


@pytest.mark.parametrize("name", SCORED)
def test_a_scene_in_which_balls_meet_is_failed_by_an_engine_of_walls_alone(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = load(name)
    balls_meet, _ = touched(scene)
    assert fails(WallsOnly, scene, monkeypatch) == balls_meet


@pytest.mark.parametrize("name", SCORED)
def test_a_scene_in_which_walls_are_met_is_failed_by_an_engine_of_pairs_alone(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = load(name)
    _, walls_are_met = touched(scene)
    assert fails(PairsOnly, scene, monkeypatch) == walls_are_met
