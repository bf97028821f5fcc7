"""The base class of the tables of scenes and of recorded inputs, and the types of their values."""

import difflib
import functools
import re
from collections.abc import Iterator, Mapping
from random import Random
from typing import Annotated, Any, ClassVar, Final, Self, TypeVar, cast, get_args

from PIL import ImageColor
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    ModelWrapValidatorHandler,
    Strict,
    Tag,
    TypeAdapter,
    ValidationError,
    model_validator,
)

from sandbox.errors import shown
from sandbox.scene.validation import NUMBER, TABLE, Problem, invalid, problems_of, sandbox_error
from sandbox.text import unprintable

# Okabe and Ito's colours, which colour-blind people can tell apart (https://jfly.uni-koeln.de/color/).
PALETTE: Final = ("#0072b2", "#e69f00", "#009e73", "#d55e00", "#56b4e9", "#cc79a7")


def rgb(colour: str) -> tuple[int, int, int]:
    """Return the red, green and blue of a CSS colour name or #rrggbb, 0 to 255."""
    red, green, blue, *_ = ImageColor.getrgb(colour)
    return red, green, blue


def _check_colour(name: str) -> str:
    if name.lower() in ImageColor.colormap or re.fullmatch("#([0-9a-fA-F]{3}){1,2}", name):
        return name
    raise invalid(((), _not_a_colour(name)))


@functools.cache
def _not_a_colour(name: str) -> str:
    close = difflib.get_close_matches(name.lower(), ImageColor.colormap, n=1)
    hint = f"did you mean {close[0]}?" if close else "write a CSS name or #rrggbb"
    return f"is not a valid colour: {shown(name)}; {hint}"


def _check_not_tiny(number: float) -> float:
    if number < 1e-6:
        raise invalid(((), f"must be at least 1e-06, got {number:g}"))
    return number


def _check_bits(number: int) -> int:
    if number >= 2**32:
        raise invalid(((), f"must have at most 32 bits, got {number:#x}"))
    return number


def _check_printable(line: str) -> str:
    """Reject letters that control a terminal, or make text look like other text."""
    letter = next(filter(unprintable, line), None)
    if letter is not None:
        raise invalid(((), f"must not have control characters, got U+{ord(letter):04X}"))
    return line


def _check_lines_printable(text: str) -> str:
    for line in text.split("\n"):
        _check_printable(line.replace("\t", " "))
    return text


MAX_NUMBER: Final = 1e9  # keeps squares and quotients of a scene's numbers far from overflow
Number = Annotated[float, Strict(), Field(ge=-MAX_NUMBER, le=MAX_NUMBER)]
Positive = Annotated[Number, Field(gt=0)]
NotNegative = Annotated[Number, Field(ge=0)]
MAX_COUNT: Final = 1_000_000
Count = Annotated[int, Strict(), Field(ge=1, le=MAX_COUNT)]
NotTiny = Annotated[Number, Field(gt=0), AfterValidator(_check_not_tiny)]
Index = Annotated[int, Strict(), Field(ge=0, lt=2**63)]
Elasticity = Annotated[Number, Field(ge=0, le=1)]
Bits = Annotated[int, Strict(), Field(ge=0), AfterValidator(_check_bits)]
Colour = Annotated[str, AfterValidator(_check_colour)]
Line = Annotated[str, AfterValidator(_check_printable)]
Title = Annotated[str, Field(max_length=100), AfterValidator(_check_printable)]
Text = Annotated[str, Field(max_length=2_000), AfterValidator(_check_lines_printable)]
Vector = tuple[Number, Number]


class Model(BaseModel):
    """A table of keys. It rejects unknown keys, NaN and infinity, and does not change once it is built.

    Keys that are words of Python, such as `from`, go by their attribute's name in Python: `Wall(start=..., to=...)`.
    Raises SandboxError with every error in the arguments, worded as for a file.
    """

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        allow_inf_nan=False,
        use_attribute_docstrings=True,
        validate_by_name=True,
        validate_by_alias=True,
    )

    def __init__(self, **values: Any) -> None:
        try:
            super().__init__(**values)
        except ValidationError as error:
            raise sandbox_error(error, type(self)) from None

    # As BaseModel's own: pydantic then builds inner tables without `__init__`, and their errors keep their path.
    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]

    _invalid: ClassVar[frozenset[str]] = frozenset()  # of a table with errors: keys that are not valid, or unknown

    @property
    def _may_lack_keys(self) -> bool:
        """Whether a key that it does not have is missing: not if one of its keys is unknown, and perhaps mistyped."""
        return self._invalid <= type(self).model_fields.keys()

    def problems(self) -> Iterator[Problem]:
        """Yield what is wrong in keys together.

        In a table with errors, keys that are missing or not valid are None, and the others are checked all the same.
        """
        yield from ()

    @model_validator(mode="wrap")
    @classmethod
    def _check(cls, given: object, check: ModelWrapValidatorHandler[Self]) -> Self:
        try:
            table = check(given)
        except ValidationError as error:
            raise invalid(*problems_of(error, cls), *partial(cls, given).problems()) from None
        if problems := [*table.problems()]:
            raise invalid(*problems)
        return table


M = TypeVar("M", bound=Model)


def partial(model: type[M], given: object) -> M:
    """Return a table without its errors: keys that are missing or not valid are None, in lists of tables too."""
    table = given if isinstance(given, Mapping) else dict(given) if isinstance(given, Model) else {}
    values, aliases = dict[str, Any](), {field.validation_alias for field in model.model_fields.values()}
    invalid_keys = {*table} - {*model.model_fields} - aliases
    for name, field in model.model_fields.items():
        key = alias if isinstance(alias := field.validation_alias, str) and alias in table else name
        values[name] = None if field.is_required() else field.default
        if table.get(key) is not None:
            values[name] = _valid(model, name, table[key])
            if values[name] is None:
                invalid_keys.add(name)
    built = cast("M", model.model_construct(**values))
    built.__dict__["_invalid"] = frozenset(invalid_keys)
    return built


def _valid(model: type[Model], name: str, value: object) -> Any:
    """Return the value of a key, or None if it is not valid; of a list of tables, each without its errors."""
    inner, *_ = (*get_args(model.model_fields[name].annotation), None)
    if isinstance(inner, type) and issubclass(inner, Model) and isinstance(value, list | tuple):
        return tuple(each if isinstance(each, inner) else partial(inner, each) for each in value)
    try:
        return _adapter(model, name).validate_python(value)
    except ValidationError:
        return None


@functools.cache
def _adapter(model: type[Model], name: str) -> TypeAdapter[Any]:
    field = model.model_fields[name]
    return TypeAdapter(Annotated[field.annotation, name, *field.metadata])  # type: ignore[arg-type]


class Range(Model):
    """A number drawn at random for each ball: from `from` to `to`, in whole steps of `step` if it is given."""

    start: Number = Field(validation_alias="from", serialization_alias="from")
    to: Number
    step: Number | None = None

    def problems(self) -> Iterator[Problem]:
        """Yield why the range is empty, or its end not reached."""
        start, to, step = self.start, self.to, self.step
        if self._invalid or start is None or to is None:
            return
        if step is None:
            if start > to:
                yield (), f"is empty: from {start:g} is greater than to {to:g}"
        elif not all(number.is_integer() for number in (start, to, step)):
            yield (), "must have whole numbers as from, to and step"
        elif step == 0 or (to - start) * step < 0:
            yield (), f"is empty: steps of {step:g} from {start:g} never reach {to:g}"
        elif rest := (to - start) % step:
            yield ("to",), f"is not reached in steps of {step:g} from {start:g}; write {to - rest:g}"

    def draw(self, rng: Random) -> float:
        """Draw a number, with exactly one call of the generator."""
        if self.step is None:
            return rng.uniform(self.start, self.to)
        start, to, step = int(self.start), int(self.to), int(self.step)
        return float(rng.randrange(start, to + step, step))


def _kind(value: object) -> str:
    return TABLE if isinstance(value, Range | dict) else NUMBER


NumberOrRange = Annotated[Annotated[Number, Tag(NUMBER)] | Annotated[Range, Tag(TABLE)], Discriminator(_kind)]
