"""What is unusual, and may be meant: small Spaces where it is named with its figures, and their mended twins."""

import math
from collections.abc import Callable
from typing import Any

import pymunk
import pytest
from spaces import add, at, ball, body, box, ground, wall, watched, world

from sandbox.space.diagnosis import Diagnosis
from sandbox.space.findings import UNUSUAL

STANDS = (0, 184.95)  # a box of 20 px on the floor


def falls(gravity: float = 900, x: float = 0) -> Diagnosis:
    """A ball falls on a floor from x = -500 to 500."""
    space = ground(gravity=gravity)
    ball(space, x, 150)
    return watched(space, 60)


def in_metres(slop: float) -> Diagnosis:
    space = world(gravity=9.81)
    space.collision_slop = slop
    wall(space, (-2, 2), (2, 2), 0.1)
    box(space, 0, 1.7, (0.3, 0.3))
    return watched(space, 60)


def passes(kind: int, key: str = "", value: tuple[float, float] = (0, 0), **values: Any) -> Diagnosis:
    """A body goes to the right through a wall, or is stopped there; halfway, the program may set a value of it."""
    space, mover = world(gravity=0), body(0, 0, (60, 0), kind)
    wall(space, (50, -50), (50, 50))
    add(space, pymunk.Circle(mover, 10), mass=1, **values)
    return watched(space, 80, at(50, lambda: setattr(mover, key, value) if key else None))


def jointed(change: Callable[[pymunk.Body, pymunk.Body], pymunk.Constraint], **values: Any) -> Diagnosis:
    space = world(gravity=0)
    joint = change(ball(space, 0, 0), ball(space, 50, 0))
    for name, value in values.items():
        setattr(joint, name, value)
    space.add(joint)
    return watched(space)


def pushed(
    act: Callable[[pymunk.Body, int], object], gravity: float = 900, moment: float = 0, **values: Any
) -> Diagnosis:
    """A box of 20 px stands on a floor, with a wall to its right; the program acts before each of 120 steps."""
    space = ground(gravity=gravity, friction=1)
    wall(space, (100, 0), (100, 200), friction=values.pop("wall", 1))
    made = box(space, *values.pop("place", STANDS), **values)
    made.moment = moment or made.moment
    return watched(space, 120, lambda number: act(made, number))


def carried(speed: Callable[[pymunk.Body], float]) -> Diagnosis:
    """A player on a lift that goes to the right, with a speed that the program sets before each step."""
    space, lift = world(), body(0, 0, (60, 0), pymunk.Body.KINEMATIC)
    add(space, pymunk.Poly.create_box(lift, (400, 10)))
    player = box(space, 0, -14.95)

    def walk(_: int) -> None:
        player.velocity = speed(player), player.velocity.y

    return watched(space, 60, walk)


def force(x: float, y: float = 0, every: int = 1, call: str = "apply_force_at_local_point", aside: float = 0) -> Any:
    def act(made: pymunk.Body, number: int) -> None:
        if number % every == 0:
            getattr(made, call)((x, y), pymunk.Vec2d(aside, 0) + made.position if "world" in call else (0, 0))

    return act


def turning(call: str, aside: float = 0) -> Diagnosis:
    """A rocket that turns by 2 rad while it is pushed; aside: px, of the point from its position."""
    space = world(gravity=0)
    rocket = box(space, 0, 0, (10, 30))
    rocket.angular_velocity = 2
    return watched(space, 60, lambda number: force(0, -50, call=call, aside=aside)(rocket, number))


def runs(velocity: float) -> Callable[[pymunk.Body, int], None]:
    def act(made: pymunk.Body, _: int) -> None:
        made.velocity = velocity, made.velocity.y

    return act


def rolling(damping: float, call: str = "") -> Diagnosis:
    space = ground(friction=1)
    space.damping = damping
    wheel = ball(space, -300, 184.95, velocity=(100, 0), friction=1, elasticity=0)
    wheel.angular_velocity = 10
    return watched(space, 120, lambda number: force(20, every=40, call=call)(wheel, number) if call else None)


# By their rules: the Space, its mended twin, and the detail or the symptom's end
CASES: dict[str, tuple[Callable[[], Diagnosis], Callable[[], Diagnosis], str]] = {
    "coarse-slop": (lambda: in_metres(0.1), lambda: in_metres(0.001), "is 0.3 wide, and collision_slop 0.1"),
    "ghosts": (lambda: passes(pymunk.Body.KINEMATIC), lambda: passes(pymunk.Body.DYNAMIC), "neither moves by forces"),
    "single-pushes": (lambda: pushed(force(9000, every=4)), lambda: pushed(force(1500)), "in 30 of 120 steps"),
    "in-vain": (lambda: pushed(force(100)), lambda: pushed(force(1500)), "100 on a mass of 1: 100 px/s²"),
    "turns-not": (
        lambda: turning("apply_force_at_world_point"),
        lambda: turning("apply_force_at_local_point"),
        "50, while the body turned by 1.97 rad",
    ),
    "velocity-set": (
        lambda: carried(lambda _: 0),
        lambda: carried(lambda made: made.velocity.x),
        "px/s are lost in one",
    ),
    "tips": (
        lambda: pushed(runs(60), place=(0, 170), size=(10, 50)),
        lambda: pushed(runs(60), place=(0, 170), size=(10, 50), moment=math.inf),
        "turned by",
    ),
    "clings": (
        lambda: pushed(force(3000), place=(84, 50)),
        lambda: pushed(force(3000), place=(84, 50), wall=0),
        "steps",
    ),
}


@pytest.mark.parametrize("rule", CASES)
def test_what_is_unusual_is_named_with_its_figures_and_mended_it_is_not(rule: str) -> None:
    make, mend, says = CASES[rule]
    finding = next(each for each in make().findings if each.rule == rule)
    assert finding.certainty == "possible"
    assert "Cause:" not in str(finding)
    assert says in " ".join([finding.symptom, *(body.detail for body in finding.bodies)])
    assert rule not in {each.rule for each in mend().findings}


def alone(act: Callable[[Any, int], object] = lambda *_: None, gravity: Any = (0, 900), **values: Any) -> Diagnosis:
    """A ball without anything that it could touch."""
    space = world()
    space.gravity, space.damping, space.collision_slop = gravity, values.pop("damping", 1), 0.1
    made = ball(space, 0, 0, **{key: values.pop(key) for key in values.keys() & {"r", "velocity"}})
    for name, value in values.items():
        setattr(made, name, value)
    return watched(space, 120, lambda number: act(made, number))


def wander(made: pymunk.Body, _: int) -> None:
    made.angular_velocity, made.velocity = 3, (60, made.velocity.y)


def moved_wall() -> Diagnosis:
    space, door = world(), body(0, 0, kind=pymunk.Body.STATIC)
    add(space, pymunk.Circle(door, 10))

    def move(number: int) -> None:
        door.position = number, number
        space.reindex_shapes_for_body(door)

    return watched(space, 60, move)


def slope(**values: Any) -> Diagnosis:
    """A ball that rolls down, or is slowed by damping so that it keeps its speed."""
    space = ground(friction=1)
    space.gravity, space.damping = (100, 900), values.pop("damping", 1)
    ball(space, -450, 184.95, friction=1, **values)
    return watched(space, 180)


def on_a_belt() -> Diagnosis:
    """A ball lies on what carries it along."""
    space, belt = world(), body(0, 0, (60, 0), pymunk.Body.KINEMATIC)
    add(space, pymunk.Poly.create_box(belt, (400, 10)))
    ball(space, 0, -14.95, velocity=(60, 0))
    return watched(space, 120)


def pinned() -> Diagnosis:
    """A flipper hangs on the end of a wall, and swings about it; both are in one group."""
    space, group = world(), pymunk.ShapeFilter(group=1)
    wall(space, (-100, 0), (0, 0), filter=group)
    flipper = box(space, 0, 0, (60, 10), filter=group)
    space.add(pymunk.PivotJoint(space.static_body, flipper, (0, 0)))
    return watched(space, 60, lambda _: flipper.apply_impulse_at_local_point((0, 20), (20, 0)))


UPDATE = pymunk.Body.update_velocity
RIGHT: tuple[tuple[str, Callable[[], Diagnosis]], ...] = (
    ("coarse-slop", lambda: alone(r=0.1)),
    ("in-vain", lambda: alone(force(0, -900))),
    ("in-vain", lambda: alone(lambda made, number: force(0, -1500 if number % 2 else -100)(made, 0))),
    ("velocity-set", lambda: pushed(force(0, -15, call="apply_impulse_at_local_point"), place=(0, 100))),
    ("tips", lambda: pushed(wander, place=(0, 170), size=(10, 50))),
    ("ghosts", pinned),
    ("clings", lambda: pushed(force(300))),
    ("clings", lambda: pushed(force(3000), place=(84, 15), wall=0.3)),
    ("ghosts", moved_wall),
    ("ghosts", lambda: passes(pymunk.Body.KINEMATIC, "velocity", (-60, 0))),
    ("ghosts", lambda: passes(pymunk.Body.KINEMATIC, "position", (80, 0))),
)


@pytest.mark.parametrize(("rule", "make"), RIGHT)
def test_a_right_program_is_not_said_to_be_unusual(rule: str, make: Callable[[], Diagnosis]) -> None:
    assert rule not in {each.rule for each in make().findings}


def test_a_filter_that_lets_a_body_through_is_named() -> None:
    assert "by a filter" in str(passes(pymunk.Body.DYNAMIC, filter=pymunk.ShapeFilter(mask=0)).findings)


def test_every_rule_has_a_case() -> None:
    assert set(CASES) == set(UNUSUAL)
