"""The linter: each fault, put into a Space on purpose, is named with its figures; its twin without has no finding."""

import math
import pickle
import random
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pymunk
import pytest
from spaces import add, body, boxed, keys_in, wall, world

import sandbox
from sandbox.errors import SandboxError
from sandbox.space import rules
from sandbox.space.findings import Certainty, Finding

BOUNCY = {"elasticity": 0.5, "friction": 0.5}


def disc(space: pymunk.Space, x: float = 100, y: float = 100, *, radius: float = 20, moment: float = 200) -> Any:
    body = pymunk.Body(1, moment)
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


def body_with(make: Callable[..., Any], **values: object) -> Callable[[pymunk.Space], None]:
    """Return a function that adds a body of a disc or a box, and sets attributes of it."""

    def add_body(space: pymunk.Space) -> None:
        made = body_of(make(space, 200))
        for name, value in values.items():
            setattr(made, name, value)

    return add_body


def floor_without(space: pymunk.Space, quantity: str) -> None:
    setattr(next(iter(space.shapes)), quantity, 0)
    group_all_but_the_floor(space)


def group_all_but_the_floor(space: pymunk.Space) -> None:
    for shape in list(space.shapes)[1:]:
        shape.filter = pymunk.ShapeFilter(group=1)


def corners_from_the_corner(space: pymunk.Space) -> None:
    body = pymunk.Body(1, pymunk.moment_for_box(1, (40, 40)))
    body.position = 200, 200
    shape = pymunk.Poly(body, [(0, 0), (40, 0), (40, 40), (0, 40)])
    body.moment = pymunk.moment_for_poly(1, shape.get_vertices())
    add(space, shape, **BOUNCY)


def forgotten_shape(space: pymunk.Space) -> None:
    body = pymunk.Body(1, 50)
    shape = pymunk.Circle(body, 10)
    space.add(body)
    KEPT.append(shape)


KEPT: list[Any] = []  # what is in no Space is kept alive by its program only


def spring(space: pymunk.Space, **values: Any) -> None:
    joint = pymunk.DampedSpring(space.static_body, body_of(disc(space, 200)), (200, 0), (0, 0), 100, 10, 1)
    for name, value in values.items():
        setattr(joint, name, value)
    space.add(joint)


def corners_on_a_spring(space: pymunk.Space) -> None:
    corners_from_the_corner(space)
    space.add(pymunk.DampedSpring(space.static_body, list(space.bodies)[-1], (200, 0), (0, 0), 100, 10, 1))


def overlapping(space: pymunk.Space) -> None:
    disc(space, 110, 100)


def overlapping_on_a_joint(space: pymunk.Space) -> None:
    a, b = body_of(disc(space, 100, 300)), body_of(disc(space, 130, 300))
    space.add(pymunk.PivotJoint(a, b, (115, 300)))


def moved_wall(space: pymunk.Space) -> None:
    body = pymunk.Body(body_type=pymunk.Body.STATIC)
    shape = pymunk.Poly.create_box(body, (40, 40))
    add(space, shape, **BOUNCY)
    body.position = 500, 200


def removed_without_its_shape(space: pymunk.Space) -> None:
    KEPT.append(body_of(disc(space, 200)))
    space.remove(KEPT[-1])


def wall_placed_twice(space: pymunk.Space) -> None:
    on = body(300, 400, kind=pymunk.Body.STATIC)  # a shape does not keep its body alive
    add(space, pymunk.Segment(on, (0, 400), (600, 400), 5), **BOUNCY)


def numbered_categories(space: pymunk.Space) -> None:
    for number in (1, 2, 3):
        disc(space, 150 * number + 250, 200).filter = pymunk.ShapeFilter(categories=number)


def group_of_old(space: pymunk.Space) -> None:
    vars(disc(space, 200))["group"] = 1


FAULTS: dict[str, tuple[str, Callable[[pymunk.Space], None]]] = {
    "moment 10, 20 times too small: its shapes have 200": ("moment", small_moment),
    "moment 1333, 5 times too large: its shapes have 266.7": ("moment", body_with(box, moment=800 / 3 * 5)),
    "elasticity 0.5, but a segment": ("elasticity-unused", lambda space: floor_without(space, "elasticity")),
    "friction 0.5, but a segment of length 600": ("friction-unused", lambda space: floor_without(space, "friction")),
    "centre of gravity at (0, 0), middle of its shapes at (20, 20): 28.28 px": ("off-centre", corners_from_the_corner),
    "its circle of radius 10 is not in the Space": ("shape-not-added", forgotten_shape),
    "10 px deep in body 3, a dynamic circle of radius 20": ("overlap", overlapping_on_a_joint),
    "30 px deep in body 2, a dynamic circle of radius 20": ("overlap", overlapping),
    "its bounding box is 500 px off where it was added": ("static-moved", moved_wall),
    "its circle of radius 20 is still in the Space": ("body-not-added", removed_without_its_shape),
    "its PivotJoint holds on to a Body() that was never added and has no mass": (
        "joint-not-added",
        lambda space: space.add(pymunk.PivotJoint(pymunk.Body(), body_of(disc(space, 200)), (200, 100))),
    ),
    "its body is at (300, 400), as are its corners; so they are about (600, 800)": ("placed-twice", wall_placed_twice),
    "its PinJoint to the Space's static body has the anchor (200, 100)": (
        "anchor-far",
        lambda space: space.add(pymunk.PinJoint(space.static_body, body_of(disc(space, 200)), (200, 0), (200, 100))),
    ),
    "position (200, 100), velocity (nan, 0)": ("not-finite", body_with(disc, velocity=(math.nan, 0))),
    "joint.max_Force was set; write joint.max_force": ("attribute", lambda space: spring(space, max_Force=10)),
    "centre of gravity at (0, 0), middle of its shapes at (20, 20)": ("off-centre", corners_on_a_spring),
    "angle 20, 3.18 turns": ("degrees", body_with(box, angle=20)),
    "category 3 is 1 and 2 at once": ("categories", numbered_categories),
    "body.elasticity was set; write shape.elasticity": ("attribute", body_with(disc, elasticity=0.9)),
    "shape.group was set; write shape.filter = pymunk.ShapeFilter(group=...": ("attribute", group_of_old),
    "body.velocity_limit was set; write a velocity_func that scales body.velocity": (
        "attribute",
        body_with(disc, velocity_limit=100),
    ),
}


def rules_of(findings: list[Finding]) -> list[str]:
    return [finding.rule for finding in findings]


@pytest.mark.parametrize("detail", FAULTS)
def test_a_fault_is_named_alone_with_its_figures(detail: str) -> None:
    rule, add_fault = FAULTS[detail]
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


def test_a_circle_that_no_contact_can_turn_may_have_any_moment() -> None:
    space = sound_space()
    disc(space, 200, moment=10).friction = 0
    assert "moment" not in rules_of(sandbox.lint(space))


def test_a_rod_without_thickness_has_the_mass_of_its_length_and_a_point_has_none() -> None:
    """The rod has 200 px, and a box 400 px²: a third and two thirds of the mass."""
    space, ends = pymunk.Space(), ((-100, 0), (100, 0))
    moment = pymunk.moment_for_box(2, (20, 20)) + pymunk.moment_for_segment(1, *ends, 0)
    body = pymunk.Body(3, 8 * moment)
    rod, flat = pymunk.Segment(body, *ends, 0), pymunk.Poly(body, ends, radius=5)
    point = pymunk.Segment(pymunk.Body(1, 100), (900, 0), (900, 0), 0)
    space.add(body, pymunk.Poly.create_box(body, (20, 20)), rod, flat, body_of(point), point)
    (finding,) = sandbox.lint(space)
    assert finding.bodies[0].detail == f"moment {8 * moment:.4g}, 8 times too large: its shapes have {moment:.4g}"


def test_a_centre_of_gravity_that_masses_of_two_shapes_or_the_program_explain_is_right() -> None:
    """A hammer, whose head has nine times the mass of its handle, and a box, slightly rounded off, about its corner."""
    space, hammer, crate = sound_space(), pymunk.Body(10, 1500), pymunk.Body(1, pymunk.moment_for_box(1, (40, 40)))
    rounded = pymunk.Poly(crate, [(0, 0), (40, 0), (40, 40), (0, 40)], radius=-0.1)
    parts = pymunk.Circle(hammer, 5, (-36, 0)), pymunk.Circle(hammer, 8, (4, 0)), rounded
    hammer.position, crate.position, crate.center_of_gravity = (200, 200), (400, 200), (20, 20)
    space.add(hammer, crate, *parts)
    assert sandbox.lint(space) == []


def test_what_a_joint_holds_may_swing_about_another_point_than_its_middle() -> None:
    space = sound_space()
    corners_from_the_corner(space)
    hinged = list(space.bodies)[-1]
    space.add(pymunk.PivotJoint(space.static_body, hinged, (0, 0), (0, 0)))
    assert sandbox.lint(space) == []


def test_an_arm_that_is_placed_after_it_was_added_is_placed_once() -> None:
    space, arm = sound_space(), body(0, 0, kind=pymunk.Body.KINEMATIC)
    add(space, pymunk.Poly(arm, [(100, -10), (140, -10), (140, 10), (100, 10)]), **BOUNCY)
    arm.position = 60, 200
    assert sandbox.lint(space) == []


def test_an_attribute_that_a_class_of_the_program_has_is_its_own() -> None:
    class Ship(pymunk.Body):
        top_speed = 0

    space, ship = sound_space(), Ship(1, pymunk.moment_for_circle(1, 0, 20))
    ship.position, ship.top_speed = (200, 200), 5
    add(space, pymunk.Circle(ship, 20), **BOUNCY)
    assert sandbox.lint(space) == []


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
    assert all(f"{20 - distance} px deep in" in finding.bodies[0].detail for finding in found)


def test_every_rule_has_a_fault() -> None:
    of_programs, of_factors = {"concave", "wrong-point"}, {"elasticity-unused", "friction-unused"}
    assert {rule for rule, _ in FAULTS.values()} == keys_in(rules) - of_programs | of_factors


def last_shape(space: pymunk.Space) -> pymunk.Shape:
    return list(space.shapes)[-1]


CURES: dict[Callable[[pymunk.Space], None], Callable[[pymunk.Space], None]] = {
    moved_wall: lambda space: space.reindex_shapes_for_body(body_of(last_shape(space))),
    overlapping_on_a_joint: lambda space: setattr(next(iter(space.constraints)), "collide_bodies", False),
    overlapping: group_all_but_the_floor,
    corners_from_the_corner: lambda space: setattr(last_shape(space), "mass", 1),
    small_moment: lambda space: setattr(body_of(last_shape(space)), "moment", math.inf),
}


@pytest.mark.parametrize("fault", CURES, ids=lambda fault: fault.__name__)
def test_the_cure_leaves_no_finding(fault: Callable[[pymunk.Space], None]) -> None:
    space = sound_space()
    fault(space)
    CURES[fault](space)
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
    overlapping(space)
    small_moment(space)
    removed_without_its_shape(space)
    findings = sandbox.lint(space)
    assert rules_of(findings) == ["body-not-added", "moment", "overlap"]
    assert findings[0].certainty == Certainty.CERTAIN
    text = " ".join(str(findings[0]).split())
    assert "a dynamic circle of radius 20 at (200, 100): its circle of radius 20 is still in the Space" in text
    assert text.endswith("or space.add(body).")


@pytest.mark.parametrize("call", [sandbox.lint, sandbox.from_space])
def test_what_is_no_space_is_refused(call: Callable[[Any], object]) -> None:
    with pytest.raises(SandboxError, match=r"^space must be a pymunk\.Space, got list$"):
        call([])


def test_a_file_of_a_space_has_no_functions_and_runs_none(tmp_path: Path) -> None:
    space = pymunk.Space()
    space.on_collision(1, 2, begin=print)
    with pytest.raises(SandboxError, match=r"builtins.print is not a class of Pymunk$"):
        sandbox.save_space(space, tmp_path / "a.space")
    for thing, name in ((print, "builtins.print"), (subprocess.Popen, "subprocess.Popen")):
        (tmp_path / "b.space").write_bytes(pickle.dumps(thing))
        with pytest.raises(SandboxError, match=rf"b.space: cannot be read as a Space: {name} is not a class of Pymunk"):
            sandbox.load_space(tmp_path / "b.space")


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
    assert out == "('overlap', '10 px deep in body 1, a dynamic circle of radius 20')\n"
