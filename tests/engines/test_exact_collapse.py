"""Unending sequences of impacts in `exact`, beside sequences that are continued impact by impact in 60 digits."""

from dataclasses import dataclass
from decimal import Decimal, localcontext
from typing import NamedTuple

import numpy as np
import pytest

from sandbox.engines.exact import ExactEngine
from sandbox.scene.files import parse
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.state import Contacts, State

DIGITS = 60
MAX_IMPACTS = 200_000
STILL = Decimal("1e-30")  # of the first approach
CLOSE = 1e-9  # of the first approach: how exact a limit is


@dataclass
class Disc:
    """A disc whose place does not change: its mass, its velocity, and the speed of its rim, which turns x to y."""

    mass: Decimal
    vx: Decimal = Decimal(0)
    vy: Decimal = Decimal(0)
    rim: Decimal = Decimal(0)


class Law(NamedTuple):
    elasticity: Decimal
    friction: Decimal = Decimal(0)


def impact(upper: Disc, lower: Disc | None, law: Law) -> Decimal:
    """Resolve a contact with what is below, a disc or the floor (y is down). Returns the speed of its approach."""
    below = lower or Disc(Decimal("Infinity"))
    approach = upper.vy - below.vy
    if approach <= 0:
        return Decimal(0)
    per_mass = 1 / upper.mass + 1 / below.mass
    impulse = approach * (1 + law.elasticity) / per_mass
    slip = -(upper.vx - below.vx) + upper.rim + below.rim  # along t = (-n_y, n_x) = (-1, 0)
    limit = law.friction * impulse
    tangential = max(-limit, min(limit, slip / (3 * per_mass)))
    for disc, sign in ((upper, -1), (below, 1)):
        disc.vy += sign * impulse / disc.mass
        disc.vx -= sign * tangential / disc.mass
        disc.rim -= 2 * tangential / disc.mass
    return approach


def continued(discs: list[Disc], law: Law) -> bool:
    """Resolve the contacts of a column of discs, the lowest on the floor, to their end or limit.

    The floor has the same factors as the discs. Returns whether they part after finitely many.
    """
    with localcontext(prec=DIGITS):
        first = Decimal(0)
        for _ in range(MAX_IMPACTS):
            approaches = [impact(upper, lower, law) for upper, lower in zip(discs, [*discs[1:], None], strict=True)]
            first = max(first, *approaches)
            if max(approaches) <= STILL * first:
                return not any(approaches)
    raise AssertionError("neither an end nor a limit")


def column_of(masses: list[float], e: float, friction: float = 0, velocity: tuple[float, float] = (0, 100)) -> Scene:
    """Return a column of discs that touch each other and the floor; the highest one has a velocity."""
    kind = f"radius = 10\nelasticity = {e}\nfriction = {friction}\n"
    balls = "".join(
        f"[[balls]]\n{kind}mass = {mass}\nposition = [400, {590 - 20 * (len(masses) - 1 - k)}]\n"
        + (f"velocity = {[*velocity]}\n" if k == 0 else "")
        for k, mass in enumerate(masses)
    )
    return parse(f"[arena]\nsize = [800, 600]\nelasticity = {e}\nfriction = {friction}\n{balls}", "test")


def after_a_step(scene: Scene) -> tuple[State, Contacts]:
    engine = ExactEngine(scene, spawn(scene))
    engine.contacts()
    engine.step()
    return engine.state(), engine.contacts()


@pytest.mark.parametrize("e", [0.5, 0.7, 0.9])
@pytest.mark.parametrize("ratio", [10, 30, 100, 300])
def test_heavy_on_light_ends_as_its_impacts_do_one_by_one(e: float, ratio: float) -> None:
    discs = [Disc(Decimal(ratio), vy=Decimal(100)), Disc(Decimal(1))]
    parts = continued(discs, Law(Decimal(e) ** 2))
    state, contacts = after_a_step(column_of([ratio, 1], e))
    assert state.velocity[:, 1] == pytest.approx([float(disc.vy) for disc in discs], abs=100 * CLOSE)
    assert parts == (state.velocity[0, 1] < -1)
    to_floor = contacts["impulse"][contacts["second"] < 0].sum()
    assert to_floor == pytest.approx(float(Decimal(ratio) * (100 - discs[0].vy) - discs[1].vy), rel=CLOSE)


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
def test_a_light_disc_between_heavy_ones_leaves_them_their_momentum_alone(
    masses: tuple[float, float, float], e: float
) -> None:
    kind = f"radius = 10\nelasticity = {e}\n"
    velocities = (130.0, 0.0, -70.0)
    balls = "".join(
        f"[[balls]]\n{kind}mass = {mass}\nposition = [{380 + 20 * k}, 300]\nvelocity = [{v}, 0]\n"
        for k, (mass, v) in enumerate(zip(masses, velocities, strict=True))
    )
    state, _ = after_a_step(parse(f"[arena]\nsize = [800, 600]\n{balls}", "test"))
    common = np.dot(masses, velocities) / sum(masses)
    assert state.velocity[:, 0] == pytest.approx([common] * 3, abs=200 * CLOSE)


@pytest.mark.parametrize("friction", [0.1, 0.3, 1.0])
@pytest.mark.parametrize("sideways", [20.0, 300.0])
@pytest.mark.parametrize("ratio", [10, 100, 400])
def test_friction_takes_in_a_collapse_what_it_takes_impact_by_impact(
    ratio: float, sideways: float, friction: float
) -> None:
    e = 0.5
    discs = [Disc(Decimal(ratio), Decimal(sideways), Decimal(100)), Disc(Decimal(1))]
    continued(discs, Law(Decimal(e) ** 2, Decimal(friction) ** 2))
    engine = ExactEngine(scene := column_of([ratio, 1], e, friction, (sideways, 100)), spawn(scene))
    engine.advance(1, *engine._row)
    state = engine.state()
    assert state.velocity[0] == pytest.approx([float(discs[0].vx), float(discs[0].vy)], abs=1e-6)
    assert state.spin * 10 == pytest.approx([float(disc.rim) for disc in discs], abs=1e-6)


@pytest.mark.parametrize("masses", [[3000, 2, 1], [800, 1, 50, 1], [1e5, 3, 1, 2]])
def test_a_heavy_disc_on_a_chain_comes_to_rest_with_it(masses: list[float]) -> None:
    state, contacts = after_a_step(column_of(masses, 0.5))
    assert state.velocity == pytest.approx(np.zeros((len(masses), 2)), abs=100 * CLOSE)
    assert contacts["impulse"][contacts["second"] < 0].sum() == pytest.approx(masses[0] * 100, rel=CLOSE)


def test_a_ball_in_a_slot_of_its_width_keeps_its_motion_along_it() -> None:
    scene = parse(
        "gravity = [0, 100]\n[arena]\nsize = [20, 4000]\n"
        "[[balls]]\nradius = 10\nposition = [10, 50]\nvelocity = [300, 40]\n",
        "test",
    )
    engine = ExactEngine(scene, spawn(scene))
    for _ in range(120):
        engine.step()
    state = engine.state()
    assert state.position[0] == pytest.approx([10, 50 + 40 * 2 + 100 * 2**2 / 2], abs=1e-9)
    assert state.velocity[0] == pytest.approx([0, 240], abs=1e-9)


@pytest.mark.parametrize("friction", [0.0, 0.5])
@pytest.mark.parametrize("elasticity", [0.0, 0.5, 0.9])
@pytest.mark.parametrize("wider", [0.0, 1e-12])
def test_the_walls_of_a_full_row_carry_its_weight(wider: float, elasticity: float, friction: float) -> None:
    factors = f"elasticity = {elasticity}\nfriction = {friction}\n"
    scene = parse(
        f"gravity = [0, 900]\nseed = 3\n[arena]\nsize = [{100 + wider!r}, 200]\n{factors}"
        f"[[balls]]\n{factors}radius = 10\ncount = 13\ninside = [[0, 0], [{100 + wider!r}, 200]]\nspeed = 100\n",
        "test",
    )
    engine = ExactEngine(scene, spawn(scene))
    for _ in range(240):
        engine.step()
    engine.contacts()
    before = scene.bodies.mass @ engine.state().velocity
    for _ in range(60):
        engine.step()
    gained = scene.bodies.mass @ engine.state().velocity - before
    contacts = engine.contacts()
    at_wall = contacts[contacts["second"] < 0]
    (nx, ny), j, t = at_wall["normal"].T, at_wall["impulse"], at_wall["tangential"]
    weight = 13 * 900
    given = j @ nx - t @ ny, j @ ny + t @ nx
    assert given == pytest.approx((-gained[0], weight - gained[1]), abs=1e-9 * weight)
    assert np.abs(engine.state().velocity).max() < 1
