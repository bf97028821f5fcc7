"""The ledger: every change has its cause, and the lines add up to the whole change."""

import math

import numpy as np
import pytest
from conftest import ball_at, sample, scene_of
from hypothesis import given, settings
from hypothesis import strategies as st
from verdicts import on_states

from sandbox.analysis.comparison import compare
from sandbox.analysis.figures import Run
from sandbox.engines import can_run, registry
from sandbox.judge.causes import Cause, Entry
from sandbox.run.inputs import Grab, Input, Move, Release
from sandbox.scene.files import bundled, load
from sandbox.scene.model import Scene
from sandbox.state import States

ENGINES = tuple(registry())
SCENES = [*bundled(), *sample(bundled("truths"), 6)]
OWN = ("pymunk", "article", "impulse", "exact")  # that report everything they do
LONGEST = {  # s, as so many contacts take time
    "pile": 0.8,
    "funnel": 0.6,
    "gas-dense": 0.2,
    "gas-1000": 0.2,
    "galton-board": 0.25,
    "plinko": 0.15,  # the same for its first rows
}


def ledger_of(scene: Scene, engine: str) -> tuple[Run, dict[str, Entry]]:
    run = compare(scene, [engine]).runs[engine]
    return run, {entry.cause.key: entry for entry in run.figures.ledger}


def remainder(run: Run) -> float:
    """Return how far the lines are from adding up to the change of energy, as a share of the most there was."""
    change = run.energy[-1] - run.energy[0]
    lines = sum(entry.energy for entry in run.figures.ledger if entry.cause != Cause.SPIN)
    return float(abs(lines - change) / (np.abs(run.energy).max() or 1.0))


@pytest.mark.wide
@pytest.mark.parametrize("name", SCENES)
def test_the_lines_add_up_to_the_whole_change(name: str) -> None:
    scene = load(name)
    engines = [engine for engine in ENGINES if can_run(engine, scene)]
    for engine, run in compare(scene.changed(seconds=min(scene.seconds, LONGEST.get(name, 1.0))), engines).runs.items():
        energies = {entry.cause: entry.energy for entry in run.figures.ledger}
        assert remainder(run) < 1e-9, engine
        if engine in OWN and name != "funnel":  # exact keeps discs at rest in a heap without contacts
            assert Cause.UNREPORTED not in energies, engine
            rounding = abs(energies.get(Cause.ROUNDING, 0.0))
            assert rounding < 1e-3 * np.abs(run.energy).max(), engine  # most in the hops of a heap


def test_small_bounces_of_an_exact_ball_take_energy_by_its_elasticity_alone() -> None:
    run, ledger = ledger_of(load("bouncing"), "exact")
    assert all(abs(entry.energy) < 1e-9 * run.energy[0] for key, entry in ledger.items() if key != "elasticity")


number = st.floats(0.05, 1.0)


@pytest.mark.wide
@given(
    st.integers(1, 12),
    st.integers(0, 1000),
    number,
    number,
    st.sampled_from([(0.0, 0.0), (0.0, 900.0), (-300.0, 200.0)]),
    st.sampled_from([30, 60, 240]),
    st.booleans(),
    st.sampled_from([0.0, 0.3, 1.0]),
)
@settings(max_examples=15)
def test_the_lines_add_up_in_any_scene(
    count: int, seed: int, size: float, e: float, gravity: tuple[float, float], rate: int, ramp: bool, friction: float
) -> None:
    rubs = f"\nfriction = {friction}\nspin = {{from = -10, to = 10}}"
    balls = (
        f"count = {count}\nradius = {20 * size}\nelasticity = {e}\ninside = [[0, 0], [300, 180]]\nspeed = 300{rubs}",
        f"count = 2\nradius = 10\nmass = {size}\nx = {{from = 20, to = 280}}\ny = {{from = 20, to = 180}}\nspeed = 200"
        + rubs,
    )
    wall = "\n[[walls]]\nfrom = [50, 200]\nto = [250, 260]\nelasticity = 0.9\nfriction = 0.5" if ramp else ""
    head = f"seed = {seed}\nseconds = 0.3\nrate = {rate}\ngravity = {list(gravity)}"
    scene = scene_of(*balls[:-1], balls[-1] + wall, size="[300, 300]\nfriction = 0.7", more=head)
    runs = compare(scene, [engine for engine in ENGINES if engine != "article"]).runs
    for engine, run in runs.items():
        assert remainder(run) < 1e-9, engine
    assert runs["exact"].missed == 0


def test_the_article_loses_energy_by_the_missing_part_of_the_impulse() -> None:
    """Head-on, each contact with restitution -0.9 takes (1 - 0.81) μ u²/2, until the two go on together."""
    run, ledger = ledger_of(load("head-on").changed(seconds=2.0), "article")
    assert set(ledger) <= {"small", "rounding"}
    assert ledger["small"].energy == pytest.approx(run.energy[-1] - run.energy[0], rel=1e-12)
    first = run.energy[np.flatnonzero(np.diff(run.energy))[0] + 1]
    assert run.energy[0] - first == pytest.approx((1 - 0.9**2) * 0.5 * 200**2 / 2, rel=1e-12)


def test_elasticity_acts_on_the_speed_at_first_touch() -> None:
    """As in `oblique`, the two touch at 45 degrees and approach at 100 √2 px/s along the normal, however late."""
    scene = scene_of(
        ball_at(100, 300, vx=200, elasticity=0.5), ball_at(300, 300 + 20 * math.sqrt(2)), more="seconds = 1.5"
    )
    for engine in ("pymunk", "impulse", "exact"):
        run, ledger = ledger_of(scene, engine)
        assert run.figures.pair_contacts == 1
        assert ledger["elasticity"].energy == pytest.approx(-(1 - 0.5**2) * 0.5 * (100 * math.sqrt(2)) ** 2 / 2)


def test_late_contacts_turn_the_normal_as_geometry_predicts() -> None:
    """In `oblique` the centres are 20 √2 px aside; found d deep, the normal's slope is by asin(20 √2 / (40 - d))."""
    run, ledger = ledger_of(load("oblique"), "impulse")
    first = compare(load("oblique"), ["impulse", "exact"]).runs["impulse"].figures.first_difference
    assert first is not None
    contact = run.contacts[run.contacts["second"] == 1][0]
    turned = math.asin(20 * math.sqrt(2) / (40 - contact["depth"])) - math.asin(20 * math.sqrt(2) / 40)
    x, y = np.array(first.normal or (0, 0)), np.array(first.should_normal or (0, 0))
    assert math.acos(float(x @ y)) == pytest.approx(turned, rel=1e-3)
    right = 2 * 0.5 * 200 * math.cos(math.pi / 4)  # the impulse along the normal of first touch
    impulse = contact["impulse"]
    apart = math.sqrt(impulse**2 + right**2 - 2 * impulse * right * math.cos(turned))
    assert ledger["late"].momentum == pytest.approx(apart, rel=1e-9)
    assert ledger["late"].energy == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("engine", ["pymunk", "impulse", "exact"])
@pytest.mark.parametrize(("friction", "spin", "tangential"), [(0.2, 0.0, 80.0), (1.0, 0.0, 200.0), (0.2, -30.0, -80.0)])
def test_friction_takes_its_heat_and_turns_the_ball(
    engine: str, friction: float, spin: float, tangential: float
) -> None:
    """A ball of 2 kg and radius 20 meets the top wall with 300 px/s along it and 100 px/s towards it.

    It slides with 0.2 of the impulse of 400 kg px/s, or else a third of 2 x 300 kg px/s stops its slip. With a spin of
    -30 rad/s it slips backwards, at -300 px/s.
    """
    scene = scene_of(
        ball_at(100, 100, vx=300, vy=-100, mass=2, friction=friction, spin=spin),
        size="[800, 600]\nfriction = 1",
        more="seconds = 1",
    )
    run, ledger = ledger_of(scene, engine)
    slip = 300 + 20 * spin
    assert ledger["friction"].energy == pytest.approx(-(tangential * slip - tangential**2 / (2 * 2 / 3)), rel=1e-12)
    assert ledger["friction"].energy == pytest.approx(run.energy[-1] - run.energy[0], rel=1e-12)
    turned = spin - 2 * tangential / (2 * 20)
    assert ledger["spin"].energy == pytest.approx(2 * 20**2 / 4 * (turned**2 - spin**2), rel=1e-9)
    assert not {"friction_small", "friction_large", "velocity"} & set(ledger)


@pytest.mark.parametrize("engine", ["pymunk", "impulse", "exact"])
def test_a_ball_that_slides_and_then_rolls_is_braked_by_rightful_friction_alone(engine: str) -> None:
    """From 90 px/s it rolls at 60: of 90²/2, friction takes a third, and a third of what is left is spin."""
    scene = scene_of(
        ball_at(50, 590, vx=90, radius=10, friction=0.5, elasticity=0),
        size="[800, 600]\nfriction = 0.4",
        more="gravity = [0, 600]\nseconds = 1",
    )
    _, ledger = ledger_of(scene, engine)
    is_known = engine != "pymunk"  # in its second step it falls on the floor and slides, before it shows how it flies
    assert ("unknown" in ledger) != is_known
    assert is_known or ledger["unknown"].contacts == 1
    braked = sum(ledger[key].energy for key in ("friction", "unknown") if key in ledger)
    assert braked == pytest.approx(-(90**2) / 6, rel=0.01)
    assert ledger["spin"].energy == pytest.approx(60**2 / 4, rel=0.01)
    assert not {"friction_small", "friction_large", "velocity", "untold"} & set(ledger)


def test_gravity_integrated_in_steps_is_entered() -> None:
    """Pymunk flies on at the velocity that it had before gravity: g dt²/2 short in a step, m (g dt)²/2 too much."""
    scene = scene_of(ball_at(400, 100), more="gravity = [0, 900]\nseconds = 0.5")
    _, ledger = ledger_of(scene, "pymunk")
    assert ledger["gravity"].energy == pytest.approx(30 * (900 / 60) ** 2 / 2)
    assert set(ledger) <= {"gravity", "rounding"}


@pytest.mark.parametrize("seconds", [2.0, 20.0])
def test_a_ball_at_rest_does_not_fill_the_ledger(seconds: float) -> None:
    """In a corner, gravity and two walls give and take in every step; no line is more than what is gained or lost."""
    scene = scene_of(ball_at(780, 580, elasticity=0.5), more="gravity = [300, 900]")
    run, ledger = ledger_of(scene.changed(seconds=seconds), "pymunk")
    assert run.energy[-1] / run.energy[0] == pytest.approx(1, abs=0.01)
    assert all(abs(entry.energy) < 0.03 * run.energy[0] for entry in ledger.values())


RESTING = {
    "one": "position = [200, 285]",
    "three": "positions = [[100, 285], [200, 285], [300, 285]]",
    "corner": "position = [385, 285]",
    "rolling": "position = [50, 285]\nvelocity = [200, 0]",
}


@pytest.mark.parametrize("place", RESTING.values(), ids=list(RESTING))
def test_a_ball_that_rests_or_rolls_is_not_in_flight(place: str) -> None:
    """Gravity gives and the floor takes in every step: only the ball above them flies, for all of its 12 steps."""
    falling = "\n[[balls]]\nradius = 15\nposition = [150, 30]"
    scene = scene_of(
        f"radius = 15\nelasticity = 0\n{place}{falling}", size="[400, 300]", more="gravity = [0, 900]\nseconds = 0.2"
    )
    _, ledger = ledger_of(scene, "pymunk")
    assert ledger["gravity"].contacts <= 12 + 2 * (len(scene.bodies) - 1)  # until Pymunk has found the floor


def test_a_ball_that_hops_within_a_step_changes_nothing() -> None:
    """A substep of 1/240 s sinks it by 0.016 px, less than Pymunk corrects."""
    scene = scene_of(ball_at(200, 285, radius=15), size="[400, 300]", more="gravity = [0, 900]\nseconds = 0.2")
    run, ledger = ledger_of(scene, "pymunk(substeps=4)")
    assert all(abs(entry.energy) < 1e-9 * run.energy[0] for entry in ledger.values())


def test_a_floor_that_throws_a_resting_ball_up_is_not_gravity() -> None:
    """Gravity brings it to 15 px/s in a step. Restitution 0.5 gives 7.5 px/s back, and the floor gives 200."""
    scene = scene_of(ball_at(200, 285, radius=15, elasticity=0.5), size="[400, 300]", more="gravity = [0, 900]")
    states = States.empty(3, 1)
    states.position[:] = 200, 285
    states.velocity[:] = np.array([(0, 0), (0, 0), (0, -200)])[:, None]
    ledger = on_states(scene, states).ledger
    [error] = [entry for entry in ledger if entry.cause not in (Cause.ELASTICITY, Cause.ROUNDING)]
    assert error.cause != Cause.GRAVITY
    assert error.energy == pytest.approx(200**2 / 2)


def test_the_mouse_s_work_is_entered_as_the_mouse_s() -> None:
    scene = scene_of(ball_at(400, 300)).changed(seconds=0.6)
    inputs: list[Input] = [Grab(step=6, ball=0, at=(600, 300)), Move(step=20, at=(200, 200)), Release(step=30)]
    for engine in OWN:
        run = compare(scene, [engine], inputs=inputs).runs[engine]
        [entry] = [entry for entry in run.figures.ledger if entry.cause != Cause.ROUNDING]
        assert entry.cause == Cause.APPLIED
        assert entry.energy == pytest.approx(run.energy[-1])


@pytest.mark.parametrize("name", ["heavy-on-light-at-a-wall", "light-between-heavy", "slot"])
def test_the_reference_is_not_accused_of_sequences_of_impacts_that_it_sums_up(name: str) -> None:
    """What an unending sequence takes is the scene's own: all that is left is rounding, 1e-9 of the energy."""
    run = compare(load(f"truths/{name}"), ["exact"]).runs["exact"]
    rightful = (Cause.ELASTICITY, Cause.GRAVITY, Cause.UNKNOWN)  # if a sequence has no end
    wrong = [abs(entry.energy) for entry in run.figures.ledger if entry.cause not in rightful]
    assert sum(wrong) <= 1e-9 * run.energy.max()
    lost = sum(entry.energy for entry in run.figures.ledger if entry.cause in rightful)
    assert lost == pytest.approx(run.energy[-1] - run.energy[0], rel=1e-9)
