"""The error models: what can be wrong with a step, each with its cause, its parameter and its sentence.

A model changes fields of LAW. A *rule* says how an engine makes its steps, without a parameter. A *fault* is wrong with
the contacts in its scope: of one kind without a parameter, or of one with a parameter to fit.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain, product
from typing import Final, NamedTuple

import numpy as np

from sandbox.judge.causes import Cause
from sandbox.judge.law import UNDONE, Exchange, Masses, Mixing, Order, Parting, Place, Scope, When
from sandbox.scene.units import Dimension, Units
from sandbox.state import Floats

Fields = Mapping[str, float]


IN_TIME: Final[Fields] = {}
PARTINGS: Final = (  # at walls, and of pairs, the likelier first
    (Parting.PLACE, Parting.PLACE),
    (Parting.PLACE, Parting.NONE),
    (Parting.RESOLVE, Parting.RESOLVE),
    (Parting.RESOLVE, Parting.NONE),
    (Parting.RESOLVE, Parting.PLACE),
    (Parting.PLACE, Parting.RESOLVE),
    (Parting.NONE, Parting.NONE),
)


class Fault(NamedTuple):
    """Something that can be wrong with contacts.

    name: of the model; cause: one, or that of a value below the right one and that of others; says: a sentence, or
    that of a negative value and that of others, with `value`, `figure`, `share`, `size`, `degrees` and `unit`;
    fields: those of LAW that are fixed; dimension: of the parameter; span: the least, the right and the largest
    value of the parameter, None if it has none; of: the fields that get the parameter, by default that of the
    model's name; kind: of contacts that can have it; rough: whether it is of friction or spin; in_radii: whether
    its span is in radii of the smallest ball; odd: whether another model that explains a step as well is more
    likely; always: whether an engine that does so does it in every contact.
    """

    name: str
    cause: Cause | tuple[Cause, Cause]
    says: str | tuple[str, str]
    fields: Fields = IN_TIME
    span: tuple[float, float, float] | None = None
    of: tuple[str, ...] = ()
    kind: Scope = Scope.ALL
    rough: bool = False
    in_radii: bool = False
    odd: bool = False
    always: bool = False
    dimension: Dimension = Dimension.NUMBER

    def fields_at(self, value: float) -> dict[str, float]:
        """Return the fields of LAW that it changes, with a value of its parameter."""
        return {**self.fields, **dict.fromkeys(self.parameters, value)}

    @property
    def parameters(self) -> tuple[str, ...]:
        """The fields of LAW that get the parameter."""
        return (self.of or (self.name,)) if self.span else ()

    def cause_of(self, value: float) -> Cause:
        """Return the cause of a value."""
        right = self.span[1] if self.span else 1.0
        return self.cause if isinstance(self.cause, Cause) else self.cause[value >= right]

    def sentence(self, value: float, units: Units) -> str:
        """Return what a value says is wrong; a figure is 0 if it is that to within the fit."""
        says = self.says if isinstance(self.says, str) else self.says[value >= 0]
        [value] = units.scaled(self.dimension, value)
        figure = f"{0.0 if abs(value) < 1e-6 else value:.4g}"
        share = f"{figure} of" if 0 < float(figure) <= 1 else "none of" if figure == "0" else f"{figure} times"
        return says.format(
            value=value,
            figure=figure,
            share=share,
            size=f"{abs(value):.4g}",
            degrees=f"{abs(math.degrees(value)):.4g}",
            unit=units.name(self.dimension),
        )

    def sentence_of_many(self, values: Floats, units: Units) -> str:
        """Return the sentence of the median of some values, with their range in the numbers of that sentence."""
        if isinstance(self.says, str) and ("{size}" in self.says or "{degrees}" in self.says):
            values = np.abs(values)
        median = float(np.median(values))
        says = self.says if isinstance(self.says, str) else self.says[median >= 0]
        shown = units.factor(self.dimension) * (np.degrees(values) if "{degrees}" in says else values)
        if "{size}" in says and median < 0:
            shown = -shown
        sentence = self.sentence(median, units)
        return f"{sentence[:-1]} (the median; {shown.min():.4g} to {shown.max():.4g} in all)."


_SIZE: Final = Cause.SMALL, Cause.LARGE
FRICTION: Final = Cause.FRICTION_SMALL, Cause.FRICTION_LARGE
_VELOCITY: Final = Cause.UNEXPLAINED_IMPULSE
_PARTS: Final = "The two still approach after the contact, at {size} of the speed at which they should part."
_PULLS: Final = "The impulse pulls instead of pushing, {size} of what is due."
_MORE: Final = "The coefficient of friction is {size} more than the scene's."
_LESS: Final = "The coefficient of friction is {size} less than the scene's."
_FURTHER: Final = "After the contact, each is put {size} {unit} further from the other."
_NEARER: Final = "After the contact, each is put {size} {unit} nearer to the other."
_FIRST: Final = "The first ball gets {share} its impulse, and the second all: momentum is not kept."
_SECOND: Final = "The second ball gets {share} its impulse, and the first all: momentum is not kept."
_TANGENTS: Final = (
    "The two swap what their velocities have along the tangent, and keep what they have along the normal."
)

FAULTS: Final = (
    Fault("impulse", _SIZE, (_PULLS, "The impulse is {share} what is due."), span=(-1.0, 1.0, 3.0)),
    Fault("restitution", _SIZE, (_PARTS, "The restitution is {share} the scene's."), span=(-1.0, 1.0, 2.0)),
    Fault("full restitution", Cause.LARGE, "The restitution is 1, whatever the scene's elasticity.", {"constant": 1}),
    Fault("no restitution", Cause.SMALL, "The restitution is 0, whatever the scene's elasticity.", {"constant": 0}),
    Fault(
        "offset",
        (Cause.LATE, Cause.EARLY),
        ("Found {size} {unit} deep.", "Found {size} {unit} before the two touch."),
        span=(-1.1, 0.0, 1.1),
        in_radii=True,
        dimension=Dimension.LENGTH,
    ),
    Fault("turn", Cause.NORMAL, "The normal is turned by {degrees}°.", span=(-0.8, 0.0, 0.8)),
    Fault(
        "tangential",
        _VELOCITY,
        "Besides the impulse along the normal, {size} of it acts along the tangent.",
        span=(-1.0, 0.0, 1.0),
    ),
    Fault("first_share", _VELOCITY, _FIRST, span=(-1.0, 1.0, 4.0), kind=Scope.PAIRS),
    Fault("second_share", _VELOCITY, _SECOND, span=(-1.0, 1.0, 4.0), kind=Scope.PAIRS),
    Fault(
        "brake",
        _VELOCITY,
        "The wall brakes the ball along itself, by {share} its impulse.",
        span=(0.0, 0.0, 1.0),
        kind=Scope.WALLS,
    ),
    Fault("slope", _VELOCITY, "The speed along the contact becomes {share} what it should be.", span=(-1.5, 1.0, 2.0)),
    Fault(
        "scaled",
        _VELOCITY,
        "After the contact, whole velocities are {share} what they should be.",
        span=(0.0, 1.0, 2.0),
        odd=True,
    ),
    Fault("friction", FRICTION, "Friction is {share} what it should be.", span=(-2.0, 1.0, 4.0), rough=True),
    Fault(
        "coefficient",
        FRICTION,
        "The coefficient of friction is {share} the scene's.",
        span=(0.0, 1.0, 5.0),
        rough=True,
    ),
    Fault("added", FRICTION, (_LESS, _MORE), span=(-1.0, 0.0, 2.0)),
    Fault(
        "moment",
        _VELOCITY,
        "The moment of inertia is taken {figure} times that of a disc.",
        span=(0.1, 1.0, 5.0),
        rough=True,
    ),
    Fault(
        "turning",
        _VELOCITY,
        "Friction turns the balls by {share} what it should.",
        span=(-2.0, 1.0, 3.0),
        of=("first_turns", "second_turns"),
        rough=True,
    ),
    Fault(
        "cap",
        Cause.UNREPORTED,
        "Speeds are cut to {value:.5g} {unit}.",
        span=(1.0, math.inf, 2000.0),
        odd=True,
        dimension=Dimension.VELOCITY,
    ),
    Fault("apart", Cause.TELEPORTED, (_NEARER, _FURTHER), span=(-2.0, 0.0, 2.0), dimension=Dimension.LENGTH),
    Fault("missed", Cause.MISSED, "The contact is missed.", {"missed": 1}),
    Fault(
        "undone",
        Cause.MISSED,
        "The contact changes no velocity: it is left out, or resolved and then undone.",
        {"impulse": 0},
    ),
    Fault(
        "twice",
        Cause.DOUBLE_BOUNCE,
        "Resolved twice: the second time the two were already parting.",
        {"twice": 1},
        odd=True,
    ),
    *(
        Fault(name, _VELOCITY, says, {"masses": masses}, kind=Scope.PAIRS, always=True)
        for name, says, masses in (
            ("masses swapped", "Each ball is accelerated as if it had the other's mass.", Masses.SWAPPED),
            ("equal masses", "The impulse is that of equal masses.", Masses.EQUAL),
            ("masses by area", "Masses are taken as radius squared.", Masses.BY_AREA),
            ("masses by radius", "Masses are taken as the radius.", Masses.BY_RADIUS),
            ("masses by volume", "Masses are taken as radius cubed.", Masses.BY_VOLUME),
        )
    ),
    Fault(
        "swap",
        _VELOCITY,
        "The two swap their whole velocities.",
        {"exchange": Exchange.WHOLE},
        kind=Scope.PAIRS,
        odd=True,
    ),
    Fault("reversed", _VELOCITY, "Whole velocities are reversed.", {"exchange": Exchange.REVERSED}, odd=True),
    Fault(
        "speeds",
        _VELOCITY,
        "Each velocity is reflected at the tangent, and the two swap their speeds.",
        {"exchange": Exchange.SPEEDS},
        kind=Scope.PAIRS,
    ),
    Fault(
        "each",
        _VELOCITY,
        "Each velocity is reflected at the tangent by itself.",
        {"exchange": Exchange.EACH},
        kind=Scope.PAIRS,
        odd=True,
    ),
    Fault("tangents", _VELOCITY, _TANGENTS, {"exchange": Exchange.TANGENTS}, kind=Scope.PAIRS, odd=True),
    Fault(
        "along velocity",
        Cause.NORMAL,
        "The impulse is along the relative velocity, not along the line of centres.",
        {"exchange": Exchange.ALONG_VELOCITY},
        kind=Scope.PAIRS,
    ),
    Fault(
        "signs",
        _VELOCITY,
        "A component of each velocity changes sign.",
        {"exchange": Exchange.ALONG_SIGNS},
        kind=Scope.PAIRS,
        odd=True,
    ),
    Fault(
        "merge",
        _VELOCITY,
        "The two go on together, at the velocity of their centre of mass.",
        {"exchange": Exchange.MERGE},
        kind=Scope.PAIRS,
        odd=True,
    ),
    Fault("stop", _VELOCITY, "Velocities become 0.", {"exchange": Exchange.STOP}, odd=True),
    Fault("first only", _VELOCITY, "Only the first ball gets its impulse.", {"second_share": 0}, kind=Scope.PAIRS),
    Fault("second only", _VELOCITY, "Only the second ball gets its impulse.", {"first_share": 0}, kind=Scope.PAIRS),
    Fault("no friction", Cause.FRICTION_SMALL, "There is no friction.", {"friction": 0}, rough=True),
    Fault(
        "sum of frictions",
        FRICTION,
        "The factors of friction are added, not multiplied.",
        {"mixing": Mixing.SUM},
        rough=True,
        always=True,
    ),
    Fault(
        "root of frictions",
        FRICTION,
        "Friction is that of the root of the product.",
        {"mixing": Mixing.ROOT},
        rough=True,
        always=True,
    ),
    Fault(
        "larger friction",
        FRICTION,
        "Friction is that of the larger factor.",
        {"mixing": Mixing.LARGER},
        rough=True,
        always=True,
    ),
    Fault(
        "no limit",
        FRICTION,
        "Friction stops every slip, whatever the impulse allows.",
        {"unlimited": 1},
        rough=True,
        always=True,
    ),
    Fault(
        "early limit",
        FRICTION,
        "Friction is limited by the impulse without restitution.",
        {"clamped": 1},
        rough=True,
        always=True,
    ),
    Fault(
        "slip without spin", FRICTION, "The slip leaves the spins out.", {"without_spin": 1}, rough=True, always=True
    ),
    Fault(
        "first does not turn",
        _VELOCITY,
        "Friction does not turn the first ball.",
        {"first_turns": 0},
        rough=True,
        odd=True,
    ),
    Fault(
        "second does not turn",
        _VELOCITY,
        "Friction does not turn the second ball.",
        {"second_turns": 0},
        kind=Scope.PAIRS,
        rough=True,
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
    afters = (0, 1) if gravity else (0,)
    thetas = (flight["theta"],) if "theta" in flight else (0.5, 0.0, 1.0) if gravity else (0.5,)
    walls = (Place.REFLECT, Place.ON, Place.LEAVE, Place.MIRROR, *((Place.FALLEN,) if gravity else ()))
    pairs = (Place.LEAVE, Place.HALVES, Place.BY_MASS)
    in_turn = (Order.WALLS_FIRST, Order.PAIRS_FIRST, Order.REVERSED)
    at_ends = (When.AFTER_MOVE, When.BEFORE_MOVE)
    names = ("when", "rebound", "partings", "after", "theta", "order", "wall_place", "pair_place")
    together = ((Order.TOGETHER,), (Place.LEAVE, Place.ON), pairs)
    partings = range(len(PARTINGS))
    for values in chain(
        product(at_ends, (0,), partings, afters, thetas, in_turn, walls, pairs),
        product((When.ONE_BY_ONE,), (0,), partings, (0,), thetas, in_turn, walls, pairs),
        # after a move that is undone, nothing overlaps that parts
        product((When.AFTER_MOVE, When.ONE_BY_ONE), (0,), (0,), afters, thetas, in_turn, UNDONE, (*pairs, Place.BEGIN)),
        product((When.AFTER_MOVE, When.ONE_BY_ONE), (0,), (0,), afters, thetas, in_turn, walls, (Place.BEGIN,)),
        product(at_ends, (0,), (0,), afters, thetas, *together),
        product((When.AFTER_MOVE,), (1,) if gravity or flight else (), (0,), (0,), thetas, *together),
    ):
        rule = dict(zip(names, values, strict=True))
        wall, pair = PARTINGS[rule.pop("partings")]
        yield rule | {"wall_parting": wall, "pair_parting": pair}
