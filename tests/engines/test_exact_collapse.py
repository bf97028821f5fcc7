"""Unending sequences of impacts in `exact`, beside sequences that are continued impact by impact in 60 digits."""

import math

import numpy as np
import pytest
from conftest import sample
from exact_scenes import ball, box_of, engine_of, play, wall
from impacts_in_decimal import Ending, Touching, continued
from recorded import recorded

from sandbox.scene.model import Scene
from sandbox.state import Contacts, State

CLOSE = 1e-9  # of the first approach: how exact a limit is


INTO_AN_EDGE = box_of(  # a heavy disc drives a light one between two walls
    ball(
        (400.6334911614038, 274.58513881521594),
        (1.700979851030615, 167.08843077996687),
        radius=9.238553584535552,
        mass=0.08893584341771264,
        elasticity=0.9187186714076987,
    ),
    ball(
        (408.55582327511337, 250.63909916641137),
        (-160.57780703155237, 321.6096613412195),
        radius=8.05125157126015,
        mass=88855.69596830348,
    ),
    wall((400, 300), (229.99766702931933, 116.69913588712734), 6, elasticity=0.4475937226804527),
    wall((400, 300), (621.7755734561568, 184.6067808829618), 6, elasticity=0.6301416053908512),
)
BETWEEN_TWO_WALLS = box_of(  # a disc a hundred thousandth of the other
    ball(
        (382.1628249591288, 325.7177793654876),
        (113.51745392914499, -281.2156917763774),
        radius=9.61840422768127,
        mass=0.003147156772101831,
        spin=-18.488614127777442,
    ),
    ball(
        (367.60160282240196, 346.64112852391895),
        (61.730889541602274, -181.9034183473347),
        radius=10.145556572911573,
        mass=830.2901044480155,
        elasticity=0.2410515398802102,
        friction=1,
        spin=1.3285147406914675,
    ),
    wall((400, 300), (421.6776896810591, 549.0583822522175), 6, elasticity=0.4177942047261937, friction=1),
    wall((400, 300), (159.13590185287993, 366.9663066308313), 0, elasticity=0.6257253316320613),
    head="gravity = [-86.29568993011407, 852.1326622751883]\nrate = 25_000",
    elasticity=0.9507718831955101,
    friction=1,
)
SQUEEZED_OUT = box_of(  # a light disc leaves an edge along a face
    ball(
        (396.0131190275047, 279.0087722016777),
        (140.0118368519391, 310.6326835008253),
        radius=8.224015568245033,
        mass=0.16202779085870775,
        elasticity=0.4583241076536169,
    ),
    ball(
        (400.5326981386905, 254.54785240875728),
        (5.140114294665236, 314.75790493053086),
        radius=11.61847344505281,
        mass=256.7912169038791,
    ),
    wall((400, 300), (162.14313682747405, 223.03174263551062), 0, elasticity=0.4570626372618981),
    wall((400, 300), (639.5954138061459, 228.6274724907285), 6, elasticity=0.2877322797373405),
    head="rate = 500",
    elasticity=0.7407649063973388,
)


def column_of(masses: list[float], e: float, friction: float = 0, velocity: tuple[float, float] = (0, 100)) -> Scene:
    """Return a column of discs that touch each other and the floor; the highest one has a velocity."""
    balls = (
        ball((400, 590 - 20 * below), (0, 0) if k else velocity, mass=mass, elasticity=e, friction=friction)
        for k, (mass, below) in enumerate(zip(masses, range(len(masses))[::-1], strict=True))
    )
    return box_of(*balls, elasticity=e, friction=friction)


def after_a_step(scene: Scene) -> tuple[State, Contacts]:
    engine, contacts = recorded("exact", scene, 1)
    return engine.state(), contacts


@pytest.mark.parametrize("e", [0.5, 0.7, 0.9])
@pytest.mark.parametrize("ratio", sample([10, 30, 100, 300], 2))
def test_heavy_on_light_ends_as_its_impacts_do_one_by_one(e: float, ratio: float) -> None:
    scene = column_of([ratio, 1], e)
    outcome, (state, contacts) = continued(Touching(scene, CLOSE)), after_a_step(scene)
    assert state.velocity == pytest.approx(outcome.speeds[:, :2], abs=100 * CLOSE)
    assert (outcome.ending == Ending.PARTED) == (state.velocity[0, 1] < -1)
    to_floor = contacts["impulse"][contacts["second"] < 0].sum()
    assert to_floor == pytest.approx(float(outcome.impulses[0, 0]), rel=CLOSE)


@pytest.mark.parametrize("e", [0.0, 0.05, 0.5, 0.7, 0.9])
@pytest.mark.parametrize("ratio", [1e3, 1e4, 1e6])
def test_a_much_heavier_disc_comes_to_rest_on_a_light_one(e: float, ratio: float) -> None:
    """A round of both impacts is a linear map of the two velocities with determinant e⁴ (e² each).

    Its eigenvalues are real, so that signs never change and nothing parts, if its trace is 2 e² or more.
    """
    r, m = e * e, 1 / ratio
    heavy = np.array([[1 - (1 + r) * m / (1 + m), (1 + r) * m / (1 + m)], [(1 + r) / (1 + m), 1 - (1 + r) / (1 + m)]])
    floor = np.array([[1, 0], [0, -r]])
    assert np.trace(floor @ heavy) >= 2 * r
    state, contacts = after_a_step(column_of([ratio, 1], e))
    assert state.velocity == pytest.approx(np.zeros((2, 2)), abs=100 * CLOSE)
    assert contacts["impulse"][contacts["second"] < 0].sum() == pytest.approx(ratio * 100, rel=CLOSE)


@pytest.mark.parametrize("masses", [(1000.0, 1.0, 1000.0), (1e6, 1.0, 2e6), (500.0, 1.0, 30.0)])
@pytest.mark.parametrize("e", [0.25, 0.5])
@pytest.mark.parametrize("walls", [True, False])
def test_a_light_disc_between_heavy_ones_leaves_them_their_momentum_alone(
    masses: tuple[float, float, float], e: float, walls: bool
) -> None:
    velocities = (130.0, 0.0, -70.0)
    balls = (
        ball((380 + 20 * k, 300), (v, 0), mass=mass, elasticity=e)
        for k, (mass, v) in enumerate(zip(masses, velocities, strict=True))
    )
    state, _ = after_a_step(box_of(*balls, walls=walls))
    common = np.dot(masses, velocities) / sum(masses)
    assert state.velocity[:, 0] == pytest.approx([common] * 3, abs=200 * CLOSE)


@pytest.mark.parametrize("friction", [0.1, 0.3, 1.0])
@pytest.mark.parametrize("sideways", [20.0, 300.0])
@pytest.mark.parametrize("ratio", [10, 100, 400])
def test_friction_takes_in_a_collapse_what_it_takes_impact_by_impact(
    ratio: float, sideways: float, friction: float
) -> None:
    scene = column_of([ratio, 1], 0.5, friction, (sideways, 100))
    speeds, (state, _) = continued(Touching(scene, CLOSE)).speeds, after_a_step(scene)
    assert state.velocity[0] == pytest.approx(speeds[0, :2], abs=1e-6)
    assert state.spin * 10 == pytest.approx(speeds[:, 2], abs=1e-6)


@pytest.mark.parametrize("masses", [[3000, 2, 1], [800, 1, 50, 1], [1e5, 3, 1, 2]])
def test_a_heavy_disc_on_a_chain_comes_to_rest_with_it(masses: list[float]) -> None:
    state, contacts = after_a_step(column_of(masses, 0.5))
    assert state.velocity == pytest.approx(np.zeros((len(masses), 2)), abs=100 * CLOSE)
    assert contacts["impulse"][contacts["second"] < 0].sum() == pytest.approx(masses[0] * 100, rel=CLOSE)


@pytest.mark.parametrize("masses", [(6.06, 1.34, 87.0), (26.3, 2.75, 3.96), (4.84, 109.0, 9.41, 782.0)])
def test_impacts_at_one_time_are_single_impacts_in_some_order(masses: tuple[float, ...]) -> None:
    """No law says which of two contacts that close at one time comes first; whichever does, it has the law of one."""
    e, speed = 0.9, np.array([100.0] + [0.0] * (len(masses) - 1))
    per_mass = [1 / mass for mass in masses]
    state, contacts = after_a_step(column_of([*masses], math.sqrt(e)))
    assert len(contacts) < 64  # so that each is recorded by itself
    for contact in contacts:
        a, b = contact["first"], contact["second"]
        closing = speed[a] - (speed[b] if b >= 0 else 0)
        assert closing > 0
        impulse = (1 + e) * closing / (per_mass[a] + (per_mass[b] if b >= 0 else 0))
        assert contact["impulse"] == pytest.approx(impulse, rel=CLOSE)
        speed[a] -= impulse * per_mass[a]
        if b >= 0:
            speed[b] += impulse * per_mass[b]
    assert state.velocity[:, 1] == pytest.approx(speed, abs=100 * CLOSE)
    assert (np.diff([*speed, 0]) > -CLOSE).all()


def test_a_light_disc_that_is_driven_into_an_edge_stops_the_heavy_one_there() -> None:
    """The discs collapse as they meet both walls, and not before. The velocity is that of 60 decimal digits."""
    engine = engine_of(INTO_AN_EDGE)
    state, contacts = play(engine, 4), engine.contacts()
    assert state.velocity == pytest.approx(np.array([(0, 0), (-204.964111416, 31.342205345)]), abs=1e-8)
    assert len(contacts) < 300


def test_a_disc_a_hundred_thousandth_of_the_other_stops_between_it_and_two_walls() -> None:
    """From the end of the sequence on it falls. Solved with springs, it would move by their rounding."""
    state = play(engine_of(BETWEEN_TWO_WALLS), 3894)  # to 155.76 ms; the sequence ends after 155.740559051 ms
    assert state.velocity[0] == pytest.approx(
        np.array(BETWEEN_TWO_WALLS.gravity) * (0.15576 - 0.155740559051), abs=1e-7
    )


def test_a_disc_that_is_squeezed_out_along_a_face_passes_its_end_freely() -> None:
    """What rounding leaves of its approach to the face would be 1e-12 px of overlap at the end, and 5e-4 px/s there."""
    (x0, y0), (x1, y1) = SQUEEZED_OUT.walls[1].start, SQUEEZED_OUT.walls[1].to
    state = play(engine_of(SQUEEZED_OUT), 24)  # to 48 ms; it passes the end after 47.4 ms
    vx, vy = state.velocity[0]
    assert (vx * (y1 - y0) - vy * (x1 - x0)) / math.dist((x0, y0), (x1, y1)) == pytest.approx(0, abs=1e-7)
    assert math.hypot(vx, vy) > 1000


def test_a_ball_in_a_slot_of_its_width_keeps_its_motion_along_it() -> None:
    scene = box_of(ball((10, 50), (300, 40)), head="gravity = [0, 100]", size=(20, 4000))
    state = play(engine_of(scene), 120)
    assert state.position[0] == pytest.approx([10, 50 + 40 * 2 + 100 * 2**2 / 2], abs=1e-9)
    assert state.velocity[0] == pytest.approx([0, 240], abs=1e-9)
