"""The linter: each fault, put into a Space on purpose, is named with its figures; its twin without has no finding."""

import math
import random
import subprocess
import sys
from collections.abc import Callable, Sequence
from typing import Any

import pymunk
import pytest
from spaces import add, body, boxed, wall, world

import sandbox
from sandbox.errors import SandboxError
from sandbox.space.findings import Certainty, Finding
from sandbox.space.rules import RULES

BOUNCY = {"elasticity": 0.5, "friction": 0.5}


def disc(
    space: pymunk.Space, x: float = 100, y: float = 100, *, radius: float = 20, mass: float = 1, moment: float = 0
) -> Any:
    body = pymunk.Body(mass, moment or pymunk.moment_for_circle(mass, 0, radius))
    body.position = x, y
    return add(space, pymunk.Circle(body, radius), **BOUNCY)


def box(space: pymunk.Space, x: float = 300, y: float = 100, *, size: float = 40, mass: float = 1) -> Any:
    body = pymunk.Body(mass, pymunk.moment_for_box(mass, (size, size)))
    body.position = x, y
    return add(space, pymunk.Poly.create_box(body, (size, size)), **BOUNCY)


def body_of(shape: pymunk.Shape) -> pymunk.Body:
    assert shape.body is not None
    return shape.body


def sound_space() -> pymunk.Space:
    space = world()
    wall(space, (0, 400), (600, 400), **BOUNCY)
    disc(space)
    box(space)
    return space


def small_moment(space: pymunk.Space) -> None:
    disc(space, 200, moment=10)


def large_moment_of_a_box(space: pymunk.Space) -> None:
    body_of(box(space, 200)).moment = 800 / 3 * 5


def stiff_spring(space: pymunk.Space) -> None:
    """Between its middle and a fixed point, k dt² / m may be 4."""
    shape = box(space, 400, mass=2)
    assert shape.body
    space.add(pymunk.DampedSpring(space.static_body, shape.body, (400, 0), (0, 0), 100, 40_000, 0))


def wall_without_elasticity(space: pymunk.Space) -> None:
    next(iter(space.shapes)).elasticity = 0


def smooth_floor_alone_with_discs_of_one_group(space: pymunk.Space) -> None:
    floor_segment, *others = space.shapes
    floor_segment.friction = 0
    for shape in others:
        shape.filter = pymunk.ShapeFilter(group=1)


def bare_floor_alone_with_discs_of_one_group(space: pymunk.Space) -> None:
    floor_segment, *others = space.shapes
    floor_segment.elasticity = 0
    for shape in others:
        shape.filter = pymunk.ShapeFilter(group=1)


def wall_without_friction(space: pymunk.Space) -> None:
    next(iter(space.shapes)).friction = 0


def super_ball(space: pymunk.Space) -> None:
    disc(space, 200).elasticity = 1.2


def corners_from_the_corner(space: pymunk.Space) -> None:
    body = pymunk.Body(1, pymunk.moment_for_box(1, (40, 40)))
    body.position = 200, 200
    shape = pymunk.Poly(body, [(0, 0), (40, 0), (40, 40), (0, 40)])
    body.moment = pymunk.moment_for_poly(1, shape.get_vertices())
    add(space, shape, **BOUNCY)


def no_mass(space: pymunk.Space) -> None:
    add(space, pymunk.Circle(body(200, 200), 10), **BOUNCY)


def weightless_part(space: pymunk.Space) -> None:
    body = pymunk.Body()
    body.position = 200, 200
    heavy, light = pymunk.Circle(body, 10, (-1, 0)), pymunk.Circle(body, 10, (1, 0))
    heavy.density = 1
    for shape in (heavy, light):
        shape.elasticity, shape.friction = 0.5, 0.5
    space.add(body, heavy, light)


def bare_body(space: pymunk.Space) -> None:
    space.add(pymunk.Body(1, 1))


def forgotten_shape(space: pymunk.Space) -> None:
    body = pymunk.Body(1, 50)
    shape = pymunk.Circle(body, 10)
    space.add(body)
    KEPT.append(shape)


KEPT: list[pymunk.Shape] = []  # a shape that is in no Space is kept alive by its program only


def overlapping(space: pymunk.Space) -> None:
    disc(space, 110, 100)


def overlapping_on_a_joint(space: pymunk.Space) -> None:
    a, b = body_of(disc(space, 100, 300)), body_of(disc(space, 130, 300))
    space.add(pymunk.PivotJoint(a, b, (115, 300)))


def cracked_floor(space: pymunk.Space) -> None:
    for x in (0, 100, 200):
        wall(space, (x, 300), (x + 100, 300), 2, **BOUNCY)


def bullet(space: pymunk.Space) -> None:
    body_of(disc(space, 300, 200, radius=5)).velocity = 0, 700


def heavy_on_light(space: pymunk.Space) -> None:
    disc(space, 200, 375, mass=1)
    disc(space, 200, 335.05, mass=150)


def tiny(space: pymunk.Space) -> None:
    disc(space, 200, radius=0.05)


def moved_wall(space: pymunk.Space) -> None:
    body = pymunk.Body(body_type=pymunk.Body.STATIC)
    shape = pymunk.Poly.create_box(body, (40, 40))
    add(space, shape, **BOUNCY)
    body.position = 500, 200


def motor_of_any_torque(space: pymunk.Space) -> None:
    space.add(pymunk.SimpleMotor(space.static_body, body_of(disc(space, 200)), 1))


def removed_without_its_shape(space: pymunk.Space) -> None:
    space.remove(body_of(disc(space, 200)))


def joint_to_nothing(space: pymunk.Space) -> None:
    space.add(pymunk.PivotJoint(pymunk.Body(), body_of(disc(space, 200)), (200, 100)))


def wall_placed_twice(space: pymunk.Space) -> None:
    body = pymunk.Body(body_type=pymunk.Body.STATIC)
    body.position = 300, 400
    add(space, pymunk.Segment(body, (0, 400), (600, 400), 5), **BOUNCY)


def anchor_in_the_space(space: pymunk.Space) -> None:
    space.add(pymunk.PinJoint(space.static_body, body_of(disc(space, 200)), (200, 0), (200, 100)))


def numbered_categories(space: pymunk.Space) -> None:
    for number in (1, 2, 3):
        disc(space, 150 * number + 250, 200).filter = pymunk.ShapeFilter(categories=number)


def damping_above_1(space: pymunk.Space) -> None:
    space.damping = 1.1


def elasticity_of_a_body(space: pymunk.Space) -> None:
    vars(body_of(disc(space, 200)))["elasticity"] = 0.9


def group_of_old(space: pymunk.Space) -> None:
    vars(disc(space, 200))["group"] = 1


def speed_limit_of_old(space: pymunk.Space) -> None:
    vars(body_of(disc(space, 200)))["velocity_limit"] = 100


def not_a_number(space: pymunk.Space) -> None:
    body_of(disc(space, 200)).velocity = math.nan, 0


def ignore(_arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: object) -> Any:  # mypy would find a bool
    return False


def as_before_pymunk_7(space: pymunk.Space) -> None:
    space.on_collision(1, 2, begin=ignore)


FAULTS: dict[Callable[[pymunk.Space], None], tuple[str, str]] = {
    small_moment: ("moment", "moment 10, 20 times too small: its shapes have 200"),
    large_moment_of_a_box: ("moment", "moment 1333, 5 times too large: its shapes have 266.7"),
    stiff_spring: ("spring-stiff", "stiffness 4e+04; steps of 0.01667 s bear 2.88e+04"),
    wall_without_elasticity: ("elasticity-zero", "elasticity 0.5, but a segment of length 600 has elasticity 0"),
    wall_without_friction: ("friction-zero", "friction 0.5, but a segment of length 600 has friction 0"),
    bare_floor_alone_with_discs_of_one_group: ("elasticity-unused", "elasticity 0.5, but a segment"),
    smooth_floor_alone_with_discs_of_one_group: ("friction-unused", "friction 0.5, but a segment of length 600"),
    super_ball: ("elasticity", "elasticity 1.2"),
    corners_from_the_corner: ("off-centre", "centre of gravity at (0, 0), middle of its shapes at (20, 20): 28.28 px"),
    no_mass: ("mass", "its mass is 0"),
    weightless_part: ("density", "its circle of radius 10 has density 0"),
    bare_body: ("no-shape", "it has no shape and no joint"),
    forgotten_shape: ("shape-not-added", "its circle of radius 10 is not in the Space"),
    overlapping: ("overlap", "overlaps a circle of radius 20 of body 2 by 30 px"),
    overlapping_on_a_joint: ("overlap-joined", "overlaps a circle of radius 20 of body 3 by 10 px"),
    cracked_floor: ("cracks", "meets the next segment at (100, 300) without set_neighbors"),
    bullet: ("tunnelling", "700 px/s; from 600 px/s on, one step can carry it through a segment of length 600"),
    heavy_on_light: ("mass-ratio", "mass 150, 150 times that of body 2"),
    tiny: ("slop", "half of its width is 0.05, collision_slop 0.1: 200% of that"),
    moved_wall: ("static-moved", "its bounding box is 500 px off where it was added"),
    motor_of_any_torque: ("motor-unlimited", "turns against the Space's static body at 1 rad/s"),
    removed_without_its_shape: ("body-not-added", "its circle of radius 20 is still in the Space"),
    joint_to_nothing: ("joint-not-added", "its PivotJoint holds on to a Body() that was never added and has no mass"),
    wall_placed_twice: ("placed-twice", "its body is at (300, 400), as are its corners; so they are about (600, 800)"),
    anchor_in_the_space: ("anchor-far", "its PinJoint to the Space's static body has the anchor (200, 100)"),
    numbered_categories: ("categories", "category 3 is 1 and 2 at once"),
    damping_above_1: ("damping-range", ""),
    elasticity_of_a_body: ("attribute", "body.elasticity was set; write shape.elasticity"),
    group_of_old: ("attribute", "shape.group was set; write shape.filter = pymunk.ShapeFilter(group=..."),
    speed_limit_of_old: ("attribute", "body.velocity_limit was set; write a velocity_func that scales body.velocity"),
    as_before_pymunk_7: ("return-ignored", ""),
    not_a_number: ("not-finite", "position (200, 100), velocity (nan, 0)"),
}


def rules_of(findings: list[Finding]) -> list[str]:
    return [finding.rule for finding in findings]


@pytest.mark.parametrize("add_fault", FAULTS, ids=lambda fault: fault.__name__)
def test_a_fault_is_named_alone_with_its_figures(add_fault: Callable[[pymunk.Space], None]) -> None:
    rule, detail = FAULTS[add_fault]
    space = sound_space()
    assert sandbox.lint(space) == []
    add_fault(space)
    (finding,) = sandbox.lint(space)
    assert finding.rule == rule
    assert detail in (finding.bodies[0].detail if finding.bodies else "")


@pytest.mark.parametrize("about", [(0.0, 0.0), (-20.0, -20.0)], ids=["the corner", "the middle"])
def test_a_moment_that_fits_about_the_middle_or_the_centre_of_gravity_is_no_second_error(
    about: tuple[float, float],
) -> None:
    """Corners are from one of them: the centre of gravity is wrong, and the moment is that of the shape."""
    space, corners = sound_space(), [(0, 0), (40, 0), (40, 40), (0, 40)]
    body = pymunk.Body(2, pymunk.moment_for_poly(2, corners, about))
    shape = pymunk.Poly(body, corners)
    body.position = 300, 200
    add(space, shape, **BOUNCY)
    assert rules_of(sandbox.lint(space)) == ["off-centre"]
    body.moment *= 20
    space.remove(body, shape)
    space.add(body, shape)
    assert "moment" in rules_of(sandbox.lint(space))


SHAPES: Sequence[Callable[[pymunk.Body], pymunk.Shape]] = (
    lambda body: pymunk.Circle(body, 10),
    lambda body: pymunk.Segment(body, (-30, 0), (30, 0), 10),
    lambda body: pymunk.Poly.create_box(body, (20, 20)),
)


@pytest.mark.parametrize("distance", [0, 4, 21])
@pytest.mark.parametrize("first", SHAPES)
@pytest.mark.parametrize("second", SHAPES)
def test_an_overlap_is_found_whichever_shape_came_first(
    first: Callable[[pymunk.Body], pymunk.Shape], second: Callable[[pymunk.Body], pymunk.Shape], distance: float
) -> None:
    """All are 20 px high, and lie above each other, or one in the other."""
    space = pymunk.Space()
    for number, make in enumerate((first, second)):
        shape = make(pymunk.Body(1, 1000))
        assert shape.body
        shape.body.position = 0, number * distance
        shape.friction = shape.elasticity = 0.5
        space.add(shape.body, shape)
    found = [finding for finding in sandbox.lint(space) if finding.rule == "overlap"]
    assert [len(finding.bodies) for finding in found] == ([] if distance == 21 else [1])
    assert all(f"by {20 - distance} px" in finding.bodies[0].detail for finding in found)


class Game:
    """The callback of one-way platforms as Pymunk 6 had it, as it is now, and one that only counts."""

    hits = 0

    def one_way(self, arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: object) -> bool:
        return arbiter.normal.y > 0

    def one_way_now(self, arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: object) -> bool:
        arbiter.process_collision = arbiter.normal.y > 0
        return arbiter.normal.y > 0

    def count(self, _arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: object) -> Any:
        self.hits += 1
        return True


@pytest.mark.parametrize(
    ("callback", "says"),
    [(Game().one_way, "a condition (pre_solve of types 1 and any: Game.one_way)"), (Game().one_way_now, None)],
)
def test_a_callback_that_returns_whether_two_collide_is_named(callback: Callable[..., Any], says: str | None) -> None:
    space = sound_space()
    space.on_collision(1, None, pre_solve=callback, post_solve=ignore)
    space.on_collision(3, 4, begin=Game().count)
    found = [(finding.rule, finding.symptom) for finding in sandbox.lint(space)]
    expected = f"Bodies collide that a callback shall let pass: it returns {says}"
    assert found == ([("return-ignored", expected)] if says else [])


def test_shapes_of_one_body_with_the_same_error_are_one_line() -> None:
    space = sound_space()
    body = pymunk.Body(2, 500)
    body.position = 300, 200
    space.add(body)
    for x in (-10, 10):
        shape = pymunk.Circle(body, 15, (x, 0))
        shape.elasticity, shape.friction = 1.2, 0.5
        space.add(shape)
    [finding] = sandbox.lint(space)
    assert (finding.rule, len(finding.bodies)) == ("elasticity", 1)


def test_every_rule_has_a_fault() -> None:
    of_steps = {"dt-invalid", "dt-long", "dt-varies", "concave"}  # below, and in the tests of programs
    assert {rule for rule, _ in FAULTS.values()} == set(RULES) - of_steps


@pytest.mark.parametrize(("dt", "rule"), [(0.05, "dt-long"), (-0.01, "dt-invalid"), (math.nan, "dt-invalid")])
def test_a_wrong_dt_is_named(dt: float, rule: str) -> None:
    assert rules_of(sandbox.lint(sound_space(), dt=dt)) == [rule]
    assert sandbox.lint(sound_space(), dt=1 / 30) == []


def mend(space: pymunk.Space, fault: Callable[[pymunk.Space], None]) -> None:
    """Mend a fault as its cure says."""
    shapes, last = list(space.shapes), list(space.shapes)[-1]
    if fault is cracked_floor:
        for number, segment in enumerate(shapes[-3:]):
            assert isinstance(segment, pymunk.Segment)
            segment.set_neighbors((100 * number - 100, 300), (100 * number + 200, 300))
    elif fault is moved_wall:
        space.reindex_shapes_for_body(body_of(last))
    elif fault is overlapping_on_a_joint:
        next(iter(space.constraints)).collide_bodies = False
    elif fault is overlapping:
        for shape in shapes[1:]:
            shape.filter = pymunk.ShapeFilter(group=1)
    elif fault is corners_from_the_corner:
        last.mass = 1
    elif fault is no_mass:
        last.density = 1
    elif fault is tiny:
        space.collision_slop = 0.001
    elif fault is small_moment:
        body_of(last).moment = math.inf


MENDED = (
    *(cracked_floor, moved_wall, overlapping_on_a_joint, overlapping, corners_from_the_corner, no_mass, tiny),
    small_moment,
)


@pytest.mark.parametrize("fault", MENDED, ids=lambda fault: fault.__name__)
def test_the_cure_leaves_no_finding(fault: Callable[[pymunk.Space], None]) -> None:
    space = sound_space()
    fault(space)
    mend(space, fault)
    assert sandbox.lint(space) == []


def random_shape(draw: random.Random, body: pymunk.Body) -> pymunk.Shape:
    match draw.randrange(4):
        case 0:
            return pymunk.Circle(body, draw.uniform(10, 40))
        case 1:
            return pymunk.Poly.create_box(body, (draw.uniform(15, 50), draw.uniform(15, 50)))
        case 2:
            return pymunk.Segment(body, (-20, 0), (20, 0), draw.uniform(4, 10))
        case _:
            return pymunk.Poly(body, [(0, 0), (30, 0), (0, 25)])


def random_space(seed: int) -> pymunk.Space:
    """Return a Space of bodies in a box, without faults: shapes, masses and joints at random."""
    draw = random.Random(seed)
    space = pymunk.Space()
    space.gravity = 0, draw.choice([0, 500, 900])
    elasticity, friction = draw.uniform(0.1, 1), draw.uniform(0.1, 1)
    boxed(space, 800, 600)
    before = None
    for column in range(8):
        for row in range(6):
            body = pymunk.Body()
            body.position, body.angle = (50 + 100 * column, 50 + 100 * row), draw.uniform(0, 6)
            body.velocity = draw.uniform(-200, 200), draw.uniform(-200, 200)
            shape = random_shape(draw, body)
            shape.density = draw.uniform(0.5, 2)
            space.add(body, shape)
            if before and draw.random() < 0.2:
                space.add(pymunk.PinJoint(before, body))
            before = body
    for shape in space.shapes:
        shape.elasticity, shape.friction = elasticity, friction
    return space


@pytest.mark.parametrize("seed", range(20))
def test_random_spaces_without_faults_have_no_finding(seed: int) -> None:
    assert sandbox.lint(random_space(seed)) == []


def test_the_linter_changes_nothing() -> None:
    """A Space that was linted steps to the same bits, also where a static body was moved without reindexing."""

    def run(*, linted: bool) -> list[tuple[float, float]]:
        space = random_space(3)
        moved_wall(space)
        for step in range(60):
            if linted and step % 10 == 0:
                sandbox.lint(space)
            space.step(1 / 60)
        return [(body.position.x, body.position.y) for body in space.bodies]

    assert run(linted=True) == run(linted=False)


def test_findings_are_in_the_order_of_the_rules_and_print_their_cure() -> None:
    space = sound_space()
    heavy_on_light(space)
    super_ball(space)
    small_moment(space)
    no_mass(space)
    findings = sandbox.lint(space)
    assert rules_of(findings) == ["mass", "moment", "elasticity", "overlap", "mass-ratio"]
    text = str(findings[2])
    assert findings[2].certainty == Certainty.CERTAIN
    assert "a dynamic circle of radius 20 at (200, 100): elasticity 1.2" in text
    assert text.endswith("meant to add energy.")


def test_what_is_no_space_is_refused() -> None:
    with pytest.raises(SandboxError, match=r"^space must be a pymunk\.Space, got list$"):
        sandbox.lint([])  # type: ignore[arg-type]


@pytest.mark.wide
def test_assertions_are_not_needed() -> None:
    """`python -O` removes the assertions by which Pymunk says that shapes do not touch."""
    program = (
        "import pymunk, sandbox; s = pymunk.Space()\n"
        "for x in (0, 30, 100):\n"
        "    b = pymunk.Body(1, 200); b.position = x, 0; s.add(b, pymunk.Circle(b, 20))\n"
        "print(*[(f.rule, f.bodies[0].detail) for f in sandbox.lint(s)])"
    )
    out = subprocess.check_output([sys.executable, "-O", "-c", program], text=True)
    assert out == "('overlap', 'overlaps a circle of radius 20 of body 1 by 10 px')\n"


@pytest.mark.parametrize(("neighbours", "rolls_on"), [(False, False), (True, True)])
def test_a_ball_is_turned_back_by_a_crack_and_not_where_neighbours_are_set(neighbours: bool, rolls_on: bool) -> None:
    space = pymunk.Space()
    space.gravity = 0, 900
    for k in range(10):
        segment = pymunk.Segment(space.static_body, (50 * k, 300), (50 * k + 50, 300), 1)
        segment.friction = segment.elasticity = 0.8
        if neighbours:
            segment.set_neighbors((50 * k - 50, 300), (50 * k + 100, 300))
        space.add(segment)
    ball = disc(space, 20, 279)
    body_of(ball).velocity, body_of(ball).angular_velocity = (10, 0), 0.5
    assert (rules_of(sandbox.lint(space)) == []) == rolls_on
    ball.elasticity = 0
    for _ in range(300):
        space.step(1 / 60)
    assert body_of(ball).velocity.x == pytest.approx(10) if rolls_on else body_of(ball).velocity.x < 0


@pytest.mark.parametrize("damping", [0.0, 40.0])
@pytest.mark.parametrize("is_rotary", [False, True])
@pytest.mark.parametrize(("share", "explodes"), [(0.97, False), (1.03, True)])
def test_a_spring_is_too_stiff_where_its_swings_grow(
    damping: float, share: float, *, is_rotary: bool, explodes: bool
) -> None:
    """Of two bodies that move the spring by 1/m = 1/2 + 1/3; the limit is k dt² / m = 2 (1 + exp(damping dt / m))."""
    space, dt = pymunk.Space(), 1 / 60
    a, b = pymunk.Body(2, 2), pymunk.Body(3, 3)
    b.position, b.angle = (10_010, 0), 1
    stiffness = share * 2 * (1 + math.exp(damping * dt * 5 / 6)) / dt**2 / (5 / 6)
    anchors = (0, 0), (0, 0)
    spring = (
        pymunk.DampedRotarySpring(a, b, 0, stiffness, damping)
        if is_rotary
        else pymunk.DampedSpring(a, b, *anchors, 10_000, stiffness, damping)
    )
    space.add(a, b, spring)
    assert ("spring-stiff" in {finding.rule for finding in sandbox.lint(space, dt=dt)}) == explodes
    for _ in range(400):
        space.step(dt)
    off = abs(b.angle - a.angle) if is_rotary else abs((b.position - a.position).length - 10_000)
    assert (off > 100) == explodes
