"""What is unusual, and may be meant: small Spaces where it is named with its figures, and their mended twins."""

import math
from collections.abc import Callable
from typing import Any

import pymunk
import pytest
from spaces import add, at, ball, body, box, ground, wall, watched, world

from sandbox.space.diagnosis import Diagnosis
from sandbox.space.findings import TEXTS, Certainty

UPDATE = pymunk.Body.update_velocity
STANDS = (0, 184.95)  # a box of 20 px on the floor
TALL: dict[str, Any] = {"place": (0, 170), "size": (10, 50)}
BESIDE: dict[str, Any] = {"place": (84, 50)}  # the wall


def falls(gravity: float = 900, x: float = 0) -> Diagnosis:
    """A ball falls on a floor from x = -500 to 500."""
    space = ground(gravity=gravity)
    ball(space, x, 150)
    return watched(space, 60)


def passes(kind: int, key: str = "", value: tuple[float, float] = (0, 0), **values: Any) -> Diagnosis:
    """A body goes to the right through two walls, or is stopped there; halfway, the program may set a value of it."""
    space, mover = world(gravity=0), body(0, 0, (60, 0), kind)
    wall(space, (50, -50), (50, 50))
    wall(space, (65, -40), (65, 40))
    add(space, pymunk.Circle(mover, 10), mass=1, **values)
    return watched(space, 80, at(50, lambda: setattr(mover, key, value) if key else None))


def pushed(
    act: Callable[[pymunk.Body, int], object], gravity: float = 900, moment: float = 0, **values: Any
) -> Diagnosis:
    """A box of 20 px stands on a floor, with a wall to its right; the program acts before each of 120 steps."""
    space = ground(gravity=gravity, friction=1)
    wall(space, (100, 0), (100, 200), friction=values.pop("wall", 1))
    made = box(space, *values.pop("place", STANDS), **values)
    made.moment = moment or made.moment
    return watched(space, 120, lambda number: act(made, number))


def glances(moment: float, wall: float = 1, gravity: float = 0) -> Diagnosis:
    """A ball hits a wall at 45 degrees."""
    space = ground(gravity=gravity, friction=wall)
    ball(space, 0, 100, velocity=(200, 200)).moment = moment
    return watched(space, 60)


def runs(velocity: float) -> Callable[[pymunk.Body, int], None]:
    def act(made: pymunk.Body, _: int) -> None:
        made.velocity = velocity, made.velocity.y

    return act


def carried(speed: Callable[[pymunk.Body], float]) -> Diagnosis:
    """A player on a lift that goes to the right, with a speed that the program sets before each step."""
    space, lift = world(), body(0, 0, (60, 0), pymunk.Body.KINEMATIC)
    add(space, pymunk.Poly.create_box(lift, (400, 10)))
    player = box(space, 0, -14.95)

    def walk(_: int) -> None:
        player.velocity = speed(player), player.velocity.y

    return watched(space, 60, walk)


def force(x: float, y: float = 0, every: int = 1, call: str = "apply_force_at_local_point") -> Any:
    def act(made: pymunk.Body, number: int) -> None:
        if number % every == 0:
            getattr(made, call)((x, y))

    return act


def kick(every: int, y: float = -20) -> Any:
    return force(0, y, every, "apply_impulse_at_local_point")


def in_metres(slop: float) -> Diagnosis:
    space = world(gravity=9.81)
    space.collision_slop = slop
    wall(space, (-2, 2), (2, 2), 0.1)
    box(space, 0, 1.7, (0.3, 0.3))
    return watched(space, 60)


def thrust(function: Callable[..., None]) -> Diagnosis:
    """A rocket with a velocity_func is pushed once."""
    space = world(gravity=0)
    made = ball(space, 0, 0)
    made.velocity_func = function
    return watched(space, 60, at(5, lambda: made.apply_force_at_local_point((100, 0))))


def wheel(max_force: float, rate: float = 3) -> Diagnosis:
    space = world(gravity=0)
    motor = pymunk.SimpleMotor(space.static_body, ball(space, 0, 0), rate)
    motor.max_force = max_force
    space.add(motor)
    return watched(space)


def handled(callback: Callable[..., Any], method: str = "begin") -> Diagnosis:
    space = ground()
    ball(space, 0, 150)
    space.on_collision(0, 0, **{method: callback})
    return watched(space)


def lets(arbiter: pymunk.Arbiter, *_: object) -> bool:
    arbiter.process_collision = False
    return False


def says_no(*_: object) -> bool:
    return False


# By their rules: the Space, its mended twin, and the detail or the symptom's end
CASES: dict[str, tuple[Callable[[], Diagnosis], Callable[[], Diagnosis], str]] = {
    "ghosts": (lambda: passes(pymunk.Body.KINEMATIC), lambda: passes(pymunk.Body.DYNAMIC), "neither moves by forces"),
    "single-pushes": (lambda: pushed(force(9000, every=4)), lambda: pushed(force(1500)), "in 30 of 120 steps"),
    "weak-force": (lambda: pushed(force(100)), lambda: pushed(force(1500)), "100 on a mass of 1 is 100 px/s²"),
    "slow-fall": (lambda: falls(9.81), falls, "takes 2 s to fall by its own width, 20"),
    "falls-away": (lambda: falls(x=600), falls, "is below all walls"),
    "adds-up": (lambda: pushed(kick(1), gravity=0), lambda: pushed(kick(60), gravity=0), "by 20 px/s before most"),
    "tips": (lambda: pushed(runs(60), **TALL), lambda: pushed(runs(60), moment=math.inf, **TALL), "turned by"),
    "cannot-roll": (lambda: glances(math.inf), lambda: glances(50), "friction 0.8 in a contact"),
    "velocity-set": (lambda: carried(lambda _: 0), lambda: carried(lambda made: made.velocity.x), "px/s are lost"),
    "coarse-slop": (lambda: in_metres(0.1), lambda: in_metres(0.001), "is 0.3 wide, and collision_slop 0.1"),
    "force-kept": (lambda: thrust(lambda *_: None), lambda: thrust(UPDATE), "a force of 100 is left after a step"),
    "strong-motor": (lambda: wheel(math.inf), lambda: wheel(100), "its SimpleMotor of 3 rad/s has max_force inf"),
    "returned": (lambda: handled(says_no), lambda: handled(lets), "What says_no returns"),
    "clings": (lambda: pushed(force(3000), **BESIDE), lambda: pushed(force(3000), wall=0, **BESIDE), "steps"),
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
    bob = ball(space, -40, 0, filter=pymunk.ShapeFilter(group=1))
    space.add(pymunk.PinJoint(space.static_body, bob))
    return watched(space, 60)


def alone(act: Callable[[Any, int], object] = lambda *_: None, gravity: float = 900, **values: Any) -> Diagnosis:
    """A ball without anything that it could touch."""
    space = world(gravity=gravity)
    made = ball(space, 0, 0)
    for name, value in values.items():
        setattr(made, name, value)
    return watched(space, 120, lambda number: act(made, number))


def on_a_belt(moment: float) -> Diagnosis:
    """Seen from above, a belt carries a ball along that rolls off it at an angle."""
    space = ground(gravity=0)
    next(iter(space.shapes)).surface_velocity = 200, 0
    ball(space, 0, 150, velocity=(0, 100)).moment = moment
    return watched(space, 60)


def wander(made: pymunk.Body, _: int) -> None:
    made.angular_velocity, made.velocity = 3, (60, made.velocity.y)


RIGHT: tuple[tuple[str, Callable[[], Diagnosis]], ...] = (
    ("weak-force", lambda: alone(force(0, -900))),
    ("weak-force", lambda: alone(lambda made, number: force(0, -1500 if number % 2 else -100)(made, 0))),
    ("weak-force", lambda: pushed(force(0, 900))),
    ("weak-force", lambda: pushed(force(-300), velocity=(300, 0), place=(0, 100))),
    ("slow-fall", lambda: alone(gravity=9, velocity_func=lambda made, g, *rest: UPDATE(made, g * 99, *rest))),
    ("adds-up", lambda: pushed(lambda made, number: runs(200 if number % 40 < 20 else -200)(made, number))),
    ("tips", lambda: pushed(wander, **TALL)),
    ("cannot-roll", lambda: glances(math.inf, wall=0)),
    ("cannot-roll", lambda: glances(math.inf, gravity=10)),
    ("cannot-roll", lambda: on_a_belt(math.inf)),
    ("falls-away", lambda: pushed(force(0, -900), place=(0, 400))),
    ("falls-away", lambda: falls(x=495)),
    ("strong-motor", lambda: wheel(math.inf, 0)),
    ("returned", lambda: handled(lambda *_: True, "pre_solve")),
    ("returned", lambda: handled(print)),
    ("ghosts", pinned),
    ("clings", lambda: pushed(force(300))),
    ("clings", lambda: pushed(force(3000), place=(84, 15), wall=0.3)),
    ("ghosts", moved_wall),
    ("ghosts", drops_through),
    ("ghosts", hung_on_its_wall),
    ("ghosts", lambda: passes(pymunk.Body.KINEMATIC, "velocity", (-60, 0))),
    ("ghosts", lambda: passes(pymunk.Body.KINEMATIC, "position", (80, 0))),
)


@pytest.mark.parametrize(("rule", "make"), RIGHT)
def test_a_right_program_is_not_said_to_be_unusual(rule: str, make: Callable[[], Diagnosis]) -> None:
    assert rule not in {each.rule for each in make().findings}


def test_a_filter_that_lets_a_body_through_is_named() -> None:
    """Of two walls, the first is named."""
    (finding,) = passes(pymunk.Body.DYNAMIC, filter=pymunk.ShapeFilter(mask=0)).findings
    assert [body.detail for body in finding.bodies] == ["through a segment of length 100, by a filter"]


def test_every_rule_has_a_case() -> None:
    possible = {rule for rule, texts in TEXTS.items() if texts["certainty"] == "possible"}
    assert set(CASES) == possible - {"deep-at-once"}
