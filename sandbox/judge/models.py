"""The error models: what can be wrong with a step, each with its cause, its parameter and its sentence.

A model changes fields of LAW. A *rule* says how an engine makes its steps, without a parameter. A *fault* is wrong with
the contacts in its scope: of one kind without a parameter, or of one with a parameter to fit.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import product
from typing import Final, NamedTuple

from sandbox.judge.causes import Cause
from sandbox.judge.law import Exchange, Masses, Mixing, Order, Place, Scope, When

Fields = Mapping[str, float]


IN_TIME: Final[Fields] = {}


class Fault(NamedTuple):
    """Something that can be wrong with contacts.

    name: of the model; cause: of a value (1 if it has no parameter); fields: of LAW, fixed; of: the fields that get the
    parameter, none if it has none; low, high: its range, and right: its right value; rough: whether it is of friction
    or spin; in_radii: whether its range is in radii of the smallest ball; odd: whether another model that explains a
    step as well is more likely; always: whether an engine that does so does it in every contact; says: the sentence,
    from the value.
    """

    name: str
    cause: Callable[[float], Cause]
    says: Callable[[float], str]
    fields: Fields = IN_TIME
    of: tuple[str, ...] = ()
    low: float = 0.0
    high: float = 0.0
    right: float = 1.0
    rough: bool = False
    pairs_only: bool = False
    walls_only: bool = False
    odd: bool = False
    always: bool = False
    in_radii: bool = False


def _size(value: float) -> Cause:
    return Cause.SMALL if value < 1 else Cause.LARGE


def _friction(value: float) -> Cause:
    return Cause.FRICTION_SMALL if value < 1 else Cause.FRICTION_LARGE


def _always(cause: Cause) -> Callable[[float], Cause]:
    return lambda _: cause


_VELOCITY: Final = _always(Cause.UNEXPLAINED_IMPULSE)


def _figure(p: float) -> str:
    """Return a fitted value in four digits, 0 if it is that to within the fit."""
    return f"{0.0 if abs(p) < 1e-6 else p:.4g}"


def _restitution(p: float) -> str:
    if p < 0:
        return f"The two still approach after the contact, at {_figure(-p)} of the speed at which they should part."
    return f"The restitution is {_figure(p)} of the scene's."


def _impulse(p: float) -> str:
    if p < 0:
        return f"The impulse pulls instead of pushing, {-p:.4g} of what is due."
    return f"The impulse is {_figure(p)} of what is due."


FAULTS: Final = (
    Fault("impulse", _size, _impulse, {}, ("impulse",), -1.0, 3.0),
    Fault("restitution", _size, _restitution, {}, ("restitution",), -1.0, 2.0),
    Fault(
        "full restitution",
        _always(Cause.LARGE),
        lambda _: "The restitution is 1, whatever the scene's elasticity.",
        {"constant": 1.0},
    ),
    Fault(
        "no restitution",
        _always(Cause.SMALL),
        lambda _: "The restitution is 0, whatever the scene's elasticity.",
        {"constant": 0.0},
    ),
    Fault(
        "offset",
        lambda p: Cause.EARLY if p > 0 else Cause.LATE,
        lambda p: f"Found {abs(p):.4g} px {'before the two touch' if p > 0 else 'deep'}.",
        {},
        ("offset",),
        -1.1,
        1.1,
        0.0,
        in_radii=True,
    ),
    Fault(
        "turn",
        _always(Cause.NORMAL),
        lambda p: f"The contact is in time, but its normal is turned by {abs(math.degrees(p)):.4g}°.",
        {},
        ("turn",),
        -0.8,
        0.8,
        0.0,
    ),
    Fault(
        "tangential",
        _VELOCITY,
        lambda p: f"Besides the impulse along the normal, {abs(p):.4g} of it acts along the tangent.",
        {},
        ("tangential",),
        -1.0,
        1.0,
        0.0,
    ),
    Fault(
        "first share",
        _VELOCITY,
        lambda p: f"The first ball gets {_figure(p)} of its impulse, and the second all: momentum is not kept.",
        {},
        ("first_share",),
        -1.0,
        4.0,
        pairs_only=True,
    ),
    Fault(
        "second share",
        _VELOCITY,
        lambda p: f"The second ball gets {_figure(p)} of its impulse, and the first all: momentum is not kept.",
        {},
        ("second_share",),
        -1.0,
        4.0,
        pairs_only=True,
    ),
    Fault(
        "brake",
        _VELOCITY,
        lambda p: f"The wall brakes the ball along itself, by {_figure(p)} of its impulse.",
        {},
        ("brake",),
        0.0,
        1.0,
        0.0,
        walls_only=True,
    ),
    Fault(
        "along",
        _VELOCITY,
        lambda p: f"The speed along the contact becomes {_figure(p)} of what it should be.",
        {},
        ("slope",),
        -1.5,
        2.0,
    ),
    Fault(
        "friction",
        _friction,
        lambda p: f"Friction is {_figure(p)} of what it should be.",
        {},
        ("friction",),
        -2.0,
        4.0,
        rough=True,
    ),
    Fault(
        "coefficient",
        _friction,
        lambda p: f"The coefficient of friction is {_figure(p)} of the scene's.",
        {},
        ("coefficient",),
        0.0,
        5.0,
        rough=True,
    ),
    Fault(
        "added friction",
        lambda p: Cause.FRICTION_LARGE if p > 0 else Cause.FRICTION_SMALL,
        lambda p: f"The coefficient of friction is {abs(p):.4g} {'more' if p > 0 else 'less'} than the scene's.",
        {},
        ("added",),
        -1.0,
        2.0,
        0.0,
    ),
    Fault(
        "moment",
        _VELOCITY,
        lambda p: f"The moment of inertia is taken {_figure(p)} times that of a disc.",
        {},
        ("moment",),
        0.1,
        5.0,
        rough=True,
    ),
    Fault(
        "turning",
        _VELOCITY,
        lambda p: f"Friction turns the balls by {_figure(p)} of what it should.",
        {},
        ("first_turns", "second_turns"),
        -2.0,
        3.0,
        rough=True,
    ),
    Fault(
        "cap",
        _always(Cause.UNREPORTED),
        lambda p: f"Speeds are cut to {p:.5g} px/s.",
        {},
        ("cap",),
        1.0,
        2000.0,
        math.inf,
        odd=True,
    ),
    Fault(
        "apart",
        _always(Cause.TELEPORTED),
        lambda p: (
            f"After the contact, each is put {abs(p):.4g} px {'further from' if p > 0 else 'nearer to'} the other."
        ),
        {},
        ("apart",),
        -2.0,
        2.0,
        0.0,
    ),
    Fault("missed", _always(Cause.MISSED), lambda _: "The contact is missed.", {"missed": 1}),
    Fault(
        "twice",
        _always(Cause.DOUBLE_BOUNCE),
        lambda _: "Resolved twice: the second time the two were already parting.",
        {"twice": 1},
        odd=True,
    ),
    Fault(
        "masses swapped",
        _VELOCITY,
        lambda _: "Each ball is accelerated as if it had the other's mass.",
        {"masses": Masses.SWAPPED},
        pairs_only=True,
        always=True,
    ),
    Fault(
        "equal masses",
        _VELOCITY,
        lambda _: "The impulse is that of equal masses.",
        {"masses": Masses.EQUAL},
        pairs_only=True,
        always=True,
    ),
    Fault(
        "masses by area",
        _VELOCITY,
        lambda _: "Masses are taken as radius squared.",
        {"masses": Masses.BY_AREA},
        pairs_only=True,
        always=True,
    ),
    Fault(
        "masses by radius",
        _VELOCITY,
        lambda _: "Masses are taken as the radius.",
        {"masses": Masses.BY_RADIUS},
        pairs_only=True,
        always=True,
    ),
    Fault(
        "swap",
        _VELOCITY,
        lambda _: "The two swap their whole velocities.",
        {"exchange": Exchange.WHOLE},
        pairs_only=True,
        odd=True,
    ),
    Fault("reversed", _VELOCITY, lambda _: "Whole velocities are reversed.", {"exchange": Exchange.REVERSED}, odd=True),
    Fault(
        "speeds",
        _VELOCITY,
        lambda _: "Each velocity is reflected at the tangent, and the two swap their speeds.",
        {"exchange": Exchange.SPEEDS},
        pairs_only=True,
    ),
    Fault(
        "each",
        _VELOCITY,
        lambda _: "Each velocity is reflected at the tangent by itself.",
        {"exchange": Exchange.EACH},
        pairs_only=True,
        odd=True,
    ),
    Fault(
        "tangents",
        _VELOCITY,
        lambda _: (
            "The two swap what their velocities have along the tangent, and keep what they have along the normal."
        ),
        {"exchange": Exchange.TANGENTS},
        pairs_only=True,
        odd=True,
    ),
    Fault(
        "along velocity",
        _always(Cause.NORMAL),
        lambda _: "The impulse is along the relative velocity, not along the line of centres.",
        {"exchange": Exchange.ALONG_VELOCITY},
        pairs_only=True,
    ),
    Fault(
        "signs",
        _VELOCITY,
        lambda _: "A component of each velocity changes sign.",
        {"exchange": Exchange.ALONG_SIGNS},
        odd=True,
        pairs_only=True,
    ),
    Fault("stop", _VELOCITY, lambda _: "Velocities become 0.", {"exchange": Exchange.STOP}, odd=True),
    Fault(
        "first only",
        _VELOCITY,
        lambda _: "Only the first ball gets its impulse.",
        {"exchange": Exchange.FIRST_ONLY},
        pairs_only=True,
    ),
    Fault(
        "second only",
        _VELOCITY,
        lambda _: "Only the second ball gets its impulse.",
        {"exchange": Exchange.SECOND_ONLY},
        pairs_only=True,
    ),
    Fault("no friction", _always(Cause.FRICTION_SMALL), lambda _: "There is no friction.", {"friction": 0}, rough=True),
    Fault(
        "sum of frictions",
        _friction,
        lambda _: "The factors of friction are added, not multiplied.",
        {"mixing": Mixing.SUM},
        rough=True,
        always=True,
    ),
    Fault(
        "root of frictions",
        _friction,
        lambda _: "Friction is that of the root of the product.",
        {"mixing": Mixing.ROOT},
        rough=True,
        always=True,
    ),
    Fault(
        "larger friction",
        _friction,
        lambda _: "Friction is that of the larger factor.",
        {"mixing": Mixing.LARGER},
        rough=True,
        always=True,
    ),
    Fault(
        "no limit",
        _friction,
        lambda _: "Friction stops every slip, whatever the impulse allows.",
        {"unlimited": 1},
        rough=True,
        always=True,
    ),
    Fault(
        "early limit",
        _friction,
        lambda _: "Friction is limited by the impulse without restitution.",
        {"clamped": 1},
        rough=True,
        always=True,
    ),
    Fault(
        "slip without spin",
        _friction,
        lambda _: "The slip leaves the spins out.",
        {"without_spin": 1},
        rough=True,
        always=True,
    ),
    Fault(
        "first does not turn",
        _VELOCITY,
        lambda _: "Friction does not turn the first ball.",
        {"first_turns": 0},
        rough=True,
        odd=True,
    ),
    Fault(
        "second does not turn",
        _VELOCITY,
        lambda _: "Friction does not turn the second ball.",
        {"second_turns": 0},
        rough=True,
        pairs_only=True,
        odd=True,
    ),
)
BY_NAME: Final = {fault.name: fault for fault in FAULTS}


def scopes(contacts: Sequence[tuple[int, int]]) -> list[Fields]:
    """Return which contacts of a step may be wrong: all, those of a kind, or one. contacts: of first and second."""
    of_contacts: list[Fields] = [{}]
    kinds = {second >= 0 for _, second in contacts}
    if len(kinds) > 1:
        of_contacts += [{"scope": Scope.PAIRS}, {"scope": Scope.WALLS}]
    if len(contacts) > 1:
        of_contacts += [{"scope": Scope.ONE, "first": first, "second": second} for first, second in contacts]
    return of_contacts


def rules(*, gravity: bool, flight: Fields) -> Iterator[Fields]:
    """Return the ways to make a step that finds contacts at its end, or at its start. flight: what is known of that."""
    thetas = (flight["theta"],) if "theta" in flight else (0.5, 0.0, 1.0) if gravity else (0.5,)
    walls = (Place.REFLECT, Place.ON, Place.LEAVE, Place.MIRROR, *((Place.FALLEN,) if gravity else ()))
    pairs = (Place.LEAVE, Place.HALVES, Place.BY_MASS)
    one_by_one = (Order.WALLS_FIRST, Order.PAIRS_FIRST, Order.REVERSED)
    for when, parting, after, theta, order, at_wall, at_pair in product(
        (When.AFTER_MOVE, When.BEFORE_MOVE, When.ONE_BY_ONE),
        (0, 2, 1),
        (0, 1) if gravity else (0,),
        thetas,
        one_by_one,
        walls,
        pairs,
    ):
        yield _rule(when, after, theta, order, at_wall, at_pair) | {"parting": parting}
    for when, rebound, after, theta, at_wall, at_pair in product(
        (When.AFTER_MOVE, When.BEFORE_MOVE), (0, 1), (0, 1) if gravity else (0,), thetas, (Place.LEAVE, Place.ON), pairs
    ):
        if not rebound or ((gravity or flight) and when == When.AFTER_MOVE and not after):
            yield _rule(when, after, theta, Order.TOGETHER, at_wall, at_pair) | {"rebound": rebound, "parting": 0}


def _rule(when: When, after: int, theta: float, order: Order, at_wall: Place, at_pair: Place) -> dict[str, float]:
    return {
        "when": when,
        "after": after,
        "theta": theta,
        "order": order,
        "wall_place": at_wall,
        "pair_place": at_pair,
    }
