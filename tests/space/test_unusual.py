"""What is unusual, and may be meant: small Spaces where it is named with its figures, and their mended twins."""

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import pymunk
import pytest
from spaces import add, at, ball, body, box, ground, wall, watched, world

from sandbox.space.diagnosis import Diagnosis
from sandbox.space.findings import TEXTS, Certainty

Act = Callable[[pymunk.Body, int], object]
UPDATE = pymunk.Body.update_velocity
ABOVE: dict[str, Any] = {"gravity": (0, 0)}  # seen from above
BESIDE: dict[str, Any] = {"make": box, "place": (84, 50)}  # the wall


def rest(*_: object) -> None:
    pass


def moves(
    act: Act = rest,
    place: tuple[float, float] = (0, 150),
    make: Callable[..., pymunk.Body] = ball,
    space: Any = (),
    body: Any = (),
    wall_friction: float = 1,
    pin: tuple[float, float] | None = None,
    **values: Any,
) -> Diagnosis:
    """A body above a floor, whose top is at 195 px, with a wall at 95 px; the program acts before each of 120 steps."""
    room = ground(friction=wall_friction)
    wall(room, (100, 0), (100, 200), friction=wall_friction)
    made = make(room, *place, **values)
    for thing, settings in ((room, space), (made, body)):
        for name, value in dict(settings).items():
            setattr(thing, name, value)
    if pin:
        room.add(pymunk.PivotJoint(room.static_body, made, pin))
    return watched(room, 120, lambda number: act(made, number))


glides = partial(moves, velocity=(-100, 0), elasticity=0, space=ABOVE)
flies = partial(moves, space=ABOVE)
stands = partial(moves, make=box, place=(0, 184.95))
alone = partial(moves, place=(0, 9999))


def force(x: float, y: float = 0, every: int = 1, call: str = "apply_force_at_local_point") -> Act:
    def act(made: pymunk.Body, number: int) -> None:
        if number % every == 0:
            getattr(made, call)((x, y))

    return act


def driven(velocity_func: Callable[..., None]) -> Diagnosis:
    return alone(force(100, every=99), body={"velocity_func": velocity_func})


def runs(speed: Callable[[pymunk.Body, int], float], push: float = 0) -> Act:
    def act(made: pymunk.Body, number: int) -> None:
        made.velocity = speed(made, number), made.velocity.y
        made.apply_force_at_local_point((push, 0))

    return act


def passes(kind: int, key: str = "", value: tuple[float, float] = (0, 0), **values: Any) -> Diagnosis:
    """A body goes to the right through two walls, or is stopped there; halfway, the program may set a value of it."""
    space, mover = world(gravity=0), body(0, 0, (60, 0), kind)
    wall(space, (50, -50), (50, 50))
    wall(space, (65, -40), (65, 40))
    add(space, pymunk.Circle(mover, 10), mass=1, **values)
    return watched(space, 80, at(50, lambda: setattr(mover, key, value) if key else None))


def in_metres(slop: float, y: float = 0, radius: float = 0.15) -> Diagnosis:
    """Something falls on a floor: a segment without thickness, or of some radius."""
    space = world(gravity=9.81)
    space.collision_slop = slop
    wall(space, (-2, 2), (2, 2), 0.1)
    add(space, pymunk.Segment(body(0, y), (-0.1, 0), (0.1, 0), radius), mass=1)
    return watched(space, 60)


def joined(joint: Callable[..., pymunk.Constraint], **values: float) -> Diagnosis:
    space = world(gravity=0)
    made = joint(space.static_body, ball(space, 0, 0))
    for name, value in values.items():
        setattr(made, name, value)
    space.add(made)
    return watched(space)


def handled(callback: Callable[..., Any], method: str = "begin") -> Diagnosis:
    space = ground()
    ball(space, 0, 184.95).velocity_func = partial(UPDATE)
    space.on_collision(0, 0, **{method: callback})
    return watched(space, 60)


def lets(arbiter: pymunk.Arbiter, *_: object) -> bool:
    arbiter.process_collision = False
    return False


def says_no(arbiter: pymunk.Arbiter, *_: object) -> bool:
    return arbiter.total_ke < 0 if arbiter.is_first_contact else False


def pushes(arbiter: pymunk.Arbiter, *_: object) -> None:
    arbiter.bodies[0].force = 10, 0


SIGNAL = type("Signal", (), {"__getattr__": lambda *_: object(), "__call__": rest})()  # has any attribute
kick = partial(force, call="apply_impulse_at_local_point")
walk = runs(lambda *_: 60)
motor = partial(pymunk.SimpleMotor, rate=3)
spring = partial(pymunk.DampedSpring, anchor_a=(0, 0), anchor_b=(0, 0), rest_length=9, stiffness=1, damping=0)
throw: dict[str, Any] = {"velocity": (30, 100), "place": (0, 100), "space": ABOVE}
# By their rules: the Space, its mended twin, and the detail or the symptom's end
CASES: dict[str, tuple[Callable[[], Diagnosis], Callable[[], Diagnosis], str]] = {
    "ghosts": (lambda: passes(pymunk.Body.KINEMATIC), lambda: passes(pymunk.Body.DYNAMIC), "neither moves by forces"),
    "single-pushes": (lambda: stands(force(9000, every=4)), lambda: stands(force(1500)), "in 30 of 120 steps"),
    "weak-force": (lambda: stands(force(100)), lambda: stands(force(1500)), "100 on a mass of 1 is 100 px/s²"),
    "slow-fall": (lambda: moves(space={"gravity": (0, 9.81)}), moves, "takes 2 s to fall by its own width, 20"),
    "falls-away": (lambda: moves(place=(600, 150)), moves, "is below all walls"),
    "adds-up": (lambda: flies(kick(0, -20)), lambda: flies(kick(0, -20, 60)), "by 20 px/s before most"),
    "cannot-roll": (lambda: moves(**throw, body={"moment": math.inf}), lambda: moves(**throw), "friction 0.8 in a"),
    "velocity-set": (lambda: stands(walk), lambda: stands(runs(lambda made, _: made.velocity.x)), "px/s are lost"),
    "coarse-slop": (lambda: in_metres(0.1), lambda: in_metres(0.001), "is 0.3 wide, and collision_slop 0.1"),
    "force-kept": (lambda: driven(rest), lambda: driven(UPDATE), "a force of 200 is left after a step"),
    "strong-motor": (lambda: joined(motor), lambda: joined(motor, max_force=9), "of 3 rad/s has max_force inf"),
    "pushing-spring": (lambda: joined(spring, stiffness=-1), lambda: joined(spring), "DampedSpring has stiffness -1"),
    "returned": (lambda: handled(says_no, "pre_solve"), lambda: handled(lets), "What says_no returns"),
    "clings": (lambda: moves(walk, **BESIDE), lambda: moves(walk, wall_friction=0, **BESIDE), "steps"),
}


@pytest.mark.parametrize("rule", CASES)
def test_what_is_unusual_is_named_with_its_figures_and_mended_it_is_not(rule: str) -> None:
    make, mend, says = CASES[rule]
    finding = next(each for each in make().findings if each.rule == rule)
    assert finding.certainty == Certainty.POSSIBLE
    assert "Cause:" not in str(finding)
    assert says in " ".join([finding.symptom, *(body.detail for body in finding.bodies)])
    assert rule not in {each.rule for each in mend().findings}


def moved_wall() -> Diagnosis:
    space, door = world(), body(0, 0, kind=pymunk.Body.STATIC)
    add(space, pymunk.Circle(door, 10))

    def move(number: int) -> None:
        door.position = number, number
        space.reindex_shapes_for_body(door)

    return watched(space, 60, move)


def pinned() -> Diagnosis:
    """A flipper hangs on the end of a wall, and swings about it; both are in one group."""
    space, group = world(), pymunk.ShapeFilter(group=1)
    wall(space, (-100, 0), (0, 0), filter=group)
    flipper = box(space, 0, 0, (60, 10), filter=group)
    space.add(pymunk.PivotJoint(space.static_body, flipper, (0, 0)))
    return watched(space, 60, lambda _: flipper.apply_impulse_at_local_point((0, 20), (20, 0)))


def drops_through() -> Diagnosis:
    """A ball falls through a platform, as its filter lets it for a while."""
    space = world()
    wall(space, (-100, 100), (100, 100))
    shape = next(iter(ball(space, 0, 0, filter=pymunk.ShapeFilter(mask=0)).shapes))
    return watched(space, 60, at(40, lambda: setattr(shape, "filter", pymunk.ShapeFilter())))


def hung_on_its_wall() -> Diagnosis:
    """A ball swings through a wall of the body on which it hangs."""
    space = world()
    wall(space, (0, 20), (0, 60), filter=pymunk.ShapeFilter(group=1))
    space.add(pymunk.PinJoint(space.static_body, ball(space, -40, 0, filter=pymunk.ShapeFilter(group=1))))
    return watched(space, 60)


def floor(**values: Any) -> Act:
    """Return what changes the floor at first, such as to a belt, which carries along what it touches."""

    def act(made: pymunk.Body, _: int) -> None:
        assert made.space
        for name, value in values.items():
            setattr(next(iter(made.space.shapes)), name, value)

    return act


def gone(made: pymunk.Body, number: int) -> None:
    """Push a box, remove it in the end, and switch gravity off: what was recorded counts."""
    made.apply_force_at_local_point((100, 0))
    if number == 119 and made.space:
        made.space.gravity = 0, 0
        made.space.remove(made, *made.shapes)


RIGHT: tuple[tuple[str, Callable[[], Diagnosis]], ...] = (
    ("weak-force", lambda: alone(force(0, -900))),
    ("weak-force", lambda: stands(lambda made, number: force(300 if number % 2 else -300)(made, 0))),
    ("weak-force", lambda: moves(force(0, -1500), place=(0, 214.95), make=box)),
    ("weak-force", lambda: stands(force(-300), velocity=(300, 0), place=(0, 100))),
    ("weak-force", lambda: stands(runs(lambda *_: 0, push=2000))),
    ("weak-force", lambda: stands(force(-600), space={"damping": 1e-6}, wall_friction=0)),
    ("weak-force", lambda: stands(force(100), pin=(0, 185), place=(0, 185))),
    ("slow-fall", lambda: moves(space={"gravity": (0, 10)}, body={"velocity_func": partial(UPDATE)})),
    ("slow-fall", lambda: in_metres(0.1)),
    ("slow-fall", lambda: moves(space={"gravity": (9.81, 0)})),
    ("slow-fall", lambda: moves(space={"gravity": (0, 9.81), "collision_slop": 0.01})),
    ("slow-fall", lambda: moves(space={"gravity": (0, 50)})),
    ("slow-fall", lambda: moves(space={"gravity": (0, 1)})),
    ("coarse-slop", lambda: in_metres(0.1, y=1.7)),
    ("coarse-slop", lambda: in_metres(0.1, radius=0)),
    ("force-kept", lambda: handled(pushes, "post_solve")),
    ("force-kept", lambda: alone(force(1), body={"velocity_func": partial(UPDATE)})),
    ("velocity-set", lambda: stands(kick(0, -300, 40))),
    ("velocity-set", lambda: stands(runs(lambda *_: -60), wall_friction=0.01)),
    ("adds-up", lambda: stands(runs(lambda _, number: 200 if number % 40 < 20 else -200))),
    ("adds-up", lambda: flies(runs(lambda made, _: 0.9 * made.velocity.x - 20))),
    ("adds-up", lambda: flies(kick(-2), velocity=(240, 0), place=(-300, 0))),
    ("adds-up", lambda: moves(kick(0.5), place=(84, 0), make=box, wall_friction=0)),
    ("cannot-roll", lambda: moves(**throw, body={"moment": math.inf}, wall_friction=0)),
    ("cannot-roll", lambda: moves(velocity=(100, 100), body={"moment": math.inf})),
    ("cannot-roll", lambda: moves(floor(surface_velocity=(300, 0)), **throw, body={"moment": math.inf})),
    ("cannot-roll", lambda: moves(force(1), **throw, body={"moment": math.inf})),
    ("cannot-roll", lambda: moves(make=box, **throw, body={"moment": math.inf})),
    ("falls-away", lambda: moves(place=(600, 165), velocity=(-300, 0))),
    ("falls-away", lambda: moves(place=(200, 400), pin=(0, 400))),
    ("falls-away", lambda: moves(place=(600, -2000))),
    ("falls-away", lambda: moves(place=(600, 3000), velocity=(0, -1900))),
    ("falls-away", lambda: moves(floor(sensor=True))),
    ("falls-away", lambda: moves(place=(-900, -200), velocity=(700, 300), filter=pymunk.ShapeFilter(mask=0))),
    ("strong-motor", lambda: joined(motor, rate=0)),
    ("returned", lambda: handled(lambda *_: True, "pre_solve")),
    ("returned", lambda: handled(SIGNAL)),
    ("friction-untouched", lambda: glides(kick(-5, 0, 10))),
    ("friction-untouched", lambda: glides(space={"gravity": (0, 9)})),
    ("friction-untouched", lambda: glides(space={"gravity": (0, 0), "damping": 0.99})),
    ("friction-untouched", lambda: glides(body={"velocity_func": partial(UPDATE)})),
    ("friction-untouched", lambda: glides(friction=0)),
    ("friction-untouched", lambda: glides(body={"body_type": pymunk.Body.KINEMATIC, "velocity": (100, 0)})),
    ("friction-untouched", lambda: glides(runs(lambda made, number: made.velocity.x / (1 + (number == 60))))),
    ("ghosts", pinned),
    ("clings", lambda: moves(force(3000), place=(84, 15), make=box, wall_friction=0.3)),
    ("clings", lambda: moves(runs(lambda *_: 200), space=ABOVE, **BESIDE)),
    ("ghosts", moved_wall),
    ("ghosts", drops_through),
    ("ghosts", hung_on_its_wall),
    ("ghosts", lambda: passes(pymunk.Body.KINEMATIC, "velocity", (-60, 0))),
    ("ghosts", lambda: passes(pymunk.Body.KINEMATIC, "position", (80, 0))),
)


@pytest.mark.parametrize(("rule", "make"), RIGHT)
def test_a_right_program_is_not_said_to_be_unusual(rule: str, make: Callable[[], Diagnosis]) -> None:
    assert rule not in {each.rule for each in make().findings}


def test_what_is_gone_in_the_end_is_judged_by_what_was_recorded() -> None:
    found = {finding.rule: finding.bodies[0].detail for finding in stands(gone).findings}
    assert found == {"weak-force": "a force of 100 on a mass of 1 is 100 px/s², and gravity 900 px/s²"}


def test_a_filter_that_lets_a_body_through_is_named() -> None:
    """Of two walls, the first is named."""
    (finding,) = passes(pymunk.Body.DYNAMIC, filter=pymunk.ShapeFilter(mask=0)).findings
    assert [body.detail for body in finding.bodies] == ["through a segment of length 100, by a filter"]


def test_every_rule_has_a_case() -> None:
    possible = {rule for rule, texts in TEXTS.items() if texts["certainty"] == "possible"}
    assert set(CASES) == possible - {"deep-at-once"}
