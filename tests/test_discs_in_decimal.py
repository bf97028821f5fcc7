"""The independent program in 50 digits, where closed forms are known."""

import math
from collections.abc import Sequence
from decimal import Decimal, localcontext
from itertools import pairwise
from typing import Any, Final

import pytest
from discs_in_decimal import Run, run
from roots_in_decimal import DIGITS
from table_in_decimal import Disc, Table, Wall

SIDE: Final = 1000
CORNERS: Final = ((0, SIDE), (0, 0), (SIDE, 0), (SIDE, SIDE), (0, SIDE))
RADIUS: Final = 10
DROP: Final = Decimal("1e-20")  # px, to a face on which a disc is to lie at once
LYING: Final = Decimal(SIDE - RADIUS) - DROP
G: Final = 900  # px/s²

Number = int | float | str | Decimal


def disc(x: Number, y: Number, vx: Number = 0, vy: Number = 0, **more: Number) -> Disc:
    """Return a disc of 10 px, by default of 1 kg and elastic."""
    numbers = {"radius": RADIUS, "mass": 1, "elasticity": 1, "x": x, "y": y, "vx": vx, "vy": vy, **more}
    exact: dict[str, Any] = {name: Decimal(value) for name, value in numbers.items()}
    return Disc(**exact)


def wall(*ends: Number, thickness: Number = 0, friction: Number = 1) -> Wall:
    """Return an elastic wall from (x, y) to (x, y)."""
    return Wall(4, *map(Decimal, (*ends, Decimal(thickness) / 2, 1, friction)))


def box(*discs: Disc, walls: Sequence[Wall] = (), e: Number = 1, friction: Number = 1, gravity: int = 0) -> Table:
    """Return discs in a square arena."""
    sides = []
    for side, (start, end) in enumerate(pairwise(CORNERS)):
        sides.append(Wall(side, *map(Decimal, (*start, *end, 0, e, friction)), one_sided=True))
    return Table(list(discs), (*sides, *walls), (Decimal(0), Decimal(gravity)))


def played(table: Table, *seconds: Number) -> Run:
    return run(table, [Decimal(time) for time in seconds], 1000)


def after(table: Table, seconds: Number) -> Disc:
    """Return the first disc after a time, s."""
    return played(table, seconds).snapshots[-1].discs[0]


def energy(discs: Sequence[Disc]) -> Decimal:
    """Return the energy of flight and of spin, kg px²/s²."""
    with localcontext(prec=DIGITS):
        flight = sum((one.mass * (one.vx**2 + one.vy**2) / 2 for one in discs), Decimal(0))
        return flight + sum((one.mass * one.radius**2 / 2 * one.spin**2 / 2 for one in discs), Decimal(0))


def close(expected: object) -> object:
    """Equal but for the rounding of what is expected."""
    return pytest.approx(expected, rel=1e-14, abs=1e-14)


def test_a_light_disc_between_a_wall_and_a_heavy_one_counts_the_digits_of_pi() -> None:
    table = box(disc(100, 500), disc(200, 500, -100, mass=10_000))
    found = played(table, 9)
    assert len(found.contacts) == 314
    assert abs(energy(found.snapshots[-1].discs) / energy(table.discs) - 1) < Decimal("1e-44")


def test_an_inelastic_pair_parts_by_the_law_of_restitution() -> None:
    table = box(disc(100, 500, 100, mass=3, elasticity="0.5"), disc(220, 500))
    found = played(table, 2)
    assert [contact.time for contact in found.contacts] == [Decimal(1)]
    assert [contact.impulse for contact in found.contacts] == [Decimal(1.5 * 100 * 3 / 4)]
    for one, expected in zip(found.snapshots[0].discs, ("62.5", "112.5"), strict=True):
        assert abs(one.vx - Decimal(expected)) < Decimal("1e-44")


def test_a_disc_lies_once_infinitely_many_bounces_are_over() -> None:
    """From 450 px with 900 px/s² to the floor in 1 s; each bounce then lasts half of the one before: 1 + 2 s."""
    table = box(disc(500, SIDE - RADIUS - 450), e="0.5", gravity=G)
    found = played(table, Decimal(3) - Decimal("1e-8"), Decimal(3), 5)
    assert [float(contact.time) for contact in found.contacts] == close([3 - 2 ** (1 - k) for k in range(13)])
    bouncing, *lying = (table.discs[0] for table in found.snapshots)
    assert not bouncing.face
    for one in lying:
        assert one.face
        assert (float(one.y), float(one.vy)) == (SIDE - RADIUS, 0)
    assert float(lying[-1].pushed_y) == close(-5 * G)


def test_a_disc_that_falls_on_a_round_end_leaves_it_by_the_mirror() -> None:
    """It falls on the end of a thick wall, 30 px from its centre and 18 px beside it: 24 px above it, 320 px deep."""
    standing = wall(500, 500, 500, 900, thickness=40)
    found = played(box(disc(518, 500 - 24 - 320), walls=[standing], gravity=1000), "0.9")
    contact = found.contacts[0]
    assert (contact.first, ~contact.second) == (0, standing.number)
    assert float(contact.time) == close(0.8)
    assert float(contact.impulse) == close(2 * 800 * 24 / 30)
    one = found.snapshots[0].discs[0]
    assert float(one.vx) == close(1280 * 18 / 30)
    assert float(one.vy) == close(800 - 1280 * 24 / 30 + 1000 * 0.1)


@pytest.mark.parametrize(
    ("friction", "speed", "rim"),
    [
        ("0.2", 260, -80),  # J_n = 200, so friction gives 0.2 J_n = 40 to the flight and 2 x 40 to the rim
        ("0.6", 200, -200),  # a third of the slip of 300, after which the rim sticks; it needs 0.5 J_n
    ],
)
def test_an_impact_on_a_ceiling_slides_or_sticks(friction: str, speed: int, rim: int) -> None:
    found = played(box(disc(200, 110, 300, -100, friction=friction)), 2)
    one, contact = found.snapshots[0].discs[0], found.contacts[0]
    assert (float(one.vx), float(one.vy), float(one.spin * RADIUS)) == close((speed, 100, rim))
    assert float(one.angle) == close(rim / RADIUS)
    assert (float(contact.tangential), float(contact.slip)) == close((300 - speed, 300))


def test_a_disc_that_slides_begins_to_roll_at_two_thirds_of_its_speed() -> None:
    """Friction of 0.25 brakes 225 px/s², and the slip by three times that: v_0 / (3 mu g) = 0.4 s for 270 px/s."""
    start = disc(100, LYING, 270, friction="0.25")
    one = after(box(start, gravity=G), "0.4")
    assert (float(one.x), float(one.vx)) == close((100 + 5 * 270**2 / (18 * 0.25 * G), 180))
    one = after(box(start, gravity=G), "1.4")
    assert (float(one.vx), float(one.spin)) == close((180, 180 / RADIUS))
    assert float(one.x) == close(100 + 90 + 180)
    assert float(one.angle) == close(180 / RADIUS * (0.4 / 2 + 1))


def test_backspin_brings_a_disc_back() -> None:
    """It rolls at (2 v_0 - r w) / 3 for a spin of -w, which is backwards."""
    one = after(box(disc(500, LYING, 90, friction="0.5", spin=-27), gravity=G), "0.5")
    assert (float(one.vx), float(one.spin * RADIUS)) == close((-30, -30))


def ramp(down: int, across: int, friction: Number) -> Wall:
    """Return a thin wall from (200, 300), which falls to the right."""
    return wall(200, 300, 200 + 2 * across, 300 + 2 * down, friction=friction)


def on_ramp(down: int, across: int, distance: Number, speed: Number = 0, **more: Number) -> Disc:
    """Return a disc on a ramp at a distance from its upper end, px, with a speed down it, px/s."""
    long = math.isqrt(down**2 + across**2)
    x, y = Decimal(across) / long, Decimal(down) / long
    place, speed, off = Decimal(distance), Decimal(speed), RADIUS + DROP
    return disc(200 + place * x + off * y, 300 + place * y - off * x, speed * x, speed * y, friction=1, **more)


def moved(down: int, across: int, friction: Number, seconds: Number, speed: Number = 0) -> tuple[float, float, float]:
    """Return how far a disc has gone down a ramp, px, and its speed and that of its rim, px/s."""
    one = after(box(on_ramp(down, across, 400, speed), walls=[ramp(down, across, friction)], gravity=G), seconds)
    x, y = across / math.hypot(down, across), down / math.hypot(down, across)
    along = (float(one.x) - 200) * x + (float(one.y) - 300) * y - 400
    return along, float(one.vx) * x + float(one.vy) * y, float(one.spin * RADIUS)


@pytest.mark.parametrize(("friction", "slope"), [("0.3", (180, 240)), (1, (180, 240))])
def test_a_disc_rolls_down_a_ramp_if_its_tangent_is_below_three_times_the_friction(
    friction: Number, slope: tuple[int, int]
) -> None:
    a = 2 / 3 * G * 0.6
    assert moved(*slope, friction, "0.5") == close((a / 8, a / 2, a / 2))


def test_a_disc_slides_down_a_ramp_if_friction_cannot_hold_its_rim() -> None:
    """tan = 0.75 is more than 3 mu = 0.6: a = g (sin - mu cos), and the rim's 2 mu g cos."""
    a, rim = G * (0.6 - 0.2 * 0.8), 2 * 0.2 * G * 0.8
    assert moved(180, 240, "0.2", "0.5") == close((a / 8, a / 2, rim / 2))


def test_a_disc_that_is_thrown_up_a_ramp_rolls_and_comes_back() -> None:
    """It slips upwards, which brakes it and turns it, until it rolls; from there, a = 2/3 g sin."""
    speed, brake, rim = -324.0, G * (0.6 + 0.3 * 0.8), 2 * 0.3 * G * 0.8
    time = -speed / (brake + rim)
    along, speed = speed * time + brake * time**2 / 2, speed + brake * time
    assert moved(180, 240, "0.3", Decimal(time), -324) == close((along, speed, speed))
    rest, a = 1 - time, 2 / 3 * G * 0.6
    assert moved(180, 240, "0.3", 1, -324) == close((along + speed * rest + a * rest**2 / 2, *[speed + a * rest] * 2))


def test_a_disc_that_is_thrown_up_a_slippery_ramp_comes_down_sliding() -> None:
    """Its slip ends while it still goes up, from where friction pushes it up, to no avail: tan > 3 mu."""
    speed, brake, rim = -324.0, G * (0.6 + 0.2 * 0.8), 2 * 0.2 * G * 0.8
    time = -speed / (brake + rim)
    rest, speed, a = 1 - time, speed + brake * time, G * (0.6 - 0.2 * 0.8)
    along = -324 * time + brake * time**2 / 2 + speed * rest + a * rest**2 / 2
    assert moved(180, 240, "0.2", 1, -324) == close((along, speed + a * rest, speed + rim * rest))


def test_bounces_to_rest_brake_as_lying_does() -> None:
    """While the rim slips, friction is mu N: x + mu h falls as with -mu g, whatever the bounces do to the height h."""
    found = played(box(disc(20, SIDE - RADIUS - 50, 300, friction="0.1"), e="0.5", gravity=G), "0.6", "1.1")
    for snapshot in found.snapshots:
        one, t = snapshot.discs[0], float(snapshot.time)
        x = 20 + 300 * t - 0.1 * (G * t**2 / 2 - 50 + float(SIDE - RADIUS - one.y))
        assert float(one.x) == close(x)
    assert one.face
    assert float(one.vx) == close(300 - 0.1 * G * 1.1)


def test_a_disc_that_rolls_into_another_keeps_a_third_of_its_speed() -> None:
    """The other is smooth, so the first stops but keeps its spin, from which friction brings it to v/3."""
    found = played(box(disc(100, LYING, 150, spin=15, friction="0.5"), disc(220, LYING), gravity=G), "0.7", "1.2")
    for snapshot in found.snapshots:
        assert all(one.face for one in snapshot.discs)
    stopped, rolls = (snapshot.discs[0] for snapshot in found.snapshots)
    time, brake = 0.7 - 2 / 3, 0.5 * G
    assert (float(stopped.vx), float(stopped.spin)) == close((brake * time, 15 - 2 * brake * time / RADIUS))
    assert (float(rolls.vx), float(rolls.spin * RADIUS)) == close((50, 50))
    assert float(found.snapshots[-1].discs[1].vx) == close(150)


def test_a_disc_flies_off_the_end_of_a_face() -> None:
    """It rolls off at 150 px/s from 200 px above the floor, too fast to go round the end: v² > g r."""
    one = after(
        box(disc(300, 290 - DROP, 150, spin=15, friction=1), walls=[wall(100, 300, 450, 300)], gravity=G), "1.5"
    )
    assert (float(one.x), float(one.y), float(one.vx), float(one.vy)) == close((525, 290 + G / 8, 150, G / 2))
    assert (float(one.spin), float(one.angle)) == close((15, 22.5))


def test_order_does_not_matter_where_equal_discs_swap_velocities() -> None:
    found = played(box(disc(500, 500, 10), disc(400, 500, 100), disc(600, 500, -80)), 1)
    assert [float(one.vx) for one in found.snapshots[0].discs] == close([10, -80, 100])


def test_discs_whose_impacts_never_end_go_on_together() -> None:
    """A light one is between two heavy ones, one of which hits it after 80/99 s and moves on with it, to the other."""
    heavy = disc(400, 500, 99, mass=99), disc(540, 500, mass=99)
    found = played(box(heavy[0], disc(500, 500, elasticity="0.1"), heavy[1]), "1.2")
    assert found.ended == ""
    assert len(found.streaks) == 1
    for one in found.snapshots[0].discs:
        assert abs(one.vx - Decimal(99 * 99) / 199) < Decimal("1e-24")
    places = [one.x for one in found.snapshots[0].discs]
    assert [float(b - a) for a, b in pairwise(places)] == close([2 * RADIUS] * 2)


@pytest.mark.parametrize(
    ("discs", "walls", "why"),
    [
        ([disc(480, 800, elasticity="0.5")], [wall(400, 800, 500, 900), wall(500, 900, 600, 800)], "in a corner"),
        ([disc(500, LYING), disc(500, 700, elasticity="0.5")], [], "on a disc"),
        ([disc(500, 500, elasticity="0.5")], [wall(500, 600, 500, 900)], "on a wall's end"),
        ([disc(500, LYING, 10, mass=2), disc(400, LYING, 100), disc(600, LYING, -80)], [], "simultaneous"),
    ],
)
def test_a_run_ends_before_what_it_does_not_treat(discs: list[Disc], walls: list[Wall], why: str) -> None:
    found = played(box(*discs, walls=walls, e="0.5", gravity=G), *range(1, 5))
    assert found.ended == why
    assert all(contact.time < found.until for contact in found.contacts)


@pytest.mark.parametrize(("friction", "slides"), [("0.05", True), ("1.5", False)])
def test_an_impact_of_two_loses_what_the_laws_take_and_keeps_each_angular_momentum(friction: str, slides: bool) -> None:
    """m_n (1 - e²) v_n² / 2 + |J_t u| - J_t² / (2 m_n / 3); about the point of contact, no impulse turns a disc."""
    nx, ny, slip, reduced = Decimal("0.6"), Decimal("0.8"), Decimal(10 * 7 - 25 * 4 - 120), 3 * 5 / Decimal(8)
    a = disc(300 - 50, 500 - 10, 100, 20, friction=friction, elasticity="0.5", spin=7, mass=3)
    b = disc(321 + 25, 528, -50, friction=1, spin=-4, mass=5, radius=25)
    found = played(box(a, b), "0.7")
    (contact,), now = found.contacts, found.snapshots[0].discs
    impulse, friction_impulse = Decimal("1.5") * reduced * (150 * nx + 20 * ny), contact.tangential
    slip += -ny * 150 + nx * 20 + 120
    assert (contact.time, contact.impulse, contact.slip) == pytest.approx((Decimal("0.5"), impulse, slip))
    assert abs(friction_impulse) == pytest.approx(impulse * Decimal(friction) if slides else -slip * reduced / 3)
    lost = reduced * (1 - Decimal("0.25")) * (impulse / reduced / Decimal("1.5")) ** 2 / 2
    lost += abs(friction_impulse * slip) - friction_impulse**2 / (2 * reduced / 3)
    assert energy([a, b]) - energy(now) == pytest.approx(lost)
    for before, one, arm in ((a, now[0], 10), (b, now[1], -25)):
        torque = arm * (nx * (one.vy - before.vy) - ny * (one.vx - before.vx))
        assert one.radius**2 / 2 * (one.spin - before.spin) == pytest.approx(torque)
