"""What `--json` writes of a comparison, as types: its JSON Schema and the columns of CSV come from them.

They are made from the dataclasses that the JSON itself is made from, so a new figure is in all three.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, Final, get_args, get_type_hints

from pydantic import BaseModel, Field, TypeAdapter, WithJsonSchema, create_model

from sandbox.analysis.difference import Difference
from sandbox.analysis.figures import Figures
from sandbox.analysis.gas import THEORY_FIGURES, TheoryRow
from sandbox.judge.causes import Cause, Entry
from sandbox.judge.summary import CauseOfError

JSON_SCHEMA: Final = "https://json-schema.org/draft/2020-12/schema"
CauseKey = Annotated[str, WithJsonSchema({"type": "string", "enum": [cause.key for cause in Cause]})]


@dataclass(frozen=True)
class Conditions:
    """What all engines of a comparison share, by the keys of JSON and CSV; see `Comparison` for their meaning."""

    scene: str
    seed: int
    rate: int  # steps per second
    since: float  # s
    seconds: float
    against: str
    horizon: float | None  # s
    undecided: float | None  # s
    unresolved: float | None  # s
    reference_until: float | None  # s
    energy_scale: float  # kg px²/s²


@dataclass(frozen=True)
class Failure:
    """What JSON has of an engine that failed."""

    time: float  # s
    message: str


@dataclass(frozen=True)
class TrialFigures:
    """What JSON has of a run of Pymunk with some settings changed, compared with the reference."""

    changes: dict[str, int]
    passages: int  # of balls through walls or each other, without a contact
    escapes: int  # balls that left the arena
    apart: float | None  # s, when its paths leave the reference's; None if not while the reference means anything
    gap: float  # RMS, px, over all balls and the times up to when the reference means nothing
    theory: float | None  # the worst figure of a gas, as a fraction of what is expected; None if unknown
    energy_error: float | None  # as in `Figures`, None if the mouse gives each engine its own energy
    astray: float  # the same, with the mouse's
    gap_rms: float  # px, over all times


def _model(name: str, required: Mapping[str, Any], optional: Mapping[str, Any] | None = None) -> type[BaseModel]:
    """Return the type of a JSON object. required, optional: key -> type; an optional key may be absent."""
    fields: dict[str, Any] = {key: (kind, ...) for key, kind in required.items()}
    fields |= {key: (kind, Field(default_factory=dict)) for key, kind in (optional or {}).items()}
    return create_model(name, **fields)


def _fields(of: type, without: str = "") -> dict[str, Any]:
    """Return the fields of a dataclass with their types."""
    return {name: kind for name, kind in get_type_hints(of).items() if name != without}


@cache  # building the types takes longer than writing a comparison
def _engine() -> type[BaseModel]:
    """Return the type of an engine's part of a comparison."""
    first_difference = _model("FirstDifference", _fields(Difference) | {"cause": CauseKey})
    ledger_line = _model("LedgerLine", _fields(Entry, without="cause") | {"share": float | None})
    ledger = _model("Ledger", {}, {cause.key: ledger_line for cause in Cause})
    theory_line = _model("TheoryLine", _fields(TheoryRow, without="figure"))
    theory = _model("Theory", {}, dict.fromkeys(THEORY_FIGURES, theory_line))
    cause_of_error = _model("CauseOfError", _fields(CauseOfError) | {"cause": CauseKey})
    changed = {"first_difference": first_difference | None, "causes": list[cause_of_error], "ledger": ledger}  # type: ignore[valid-type]
    return _model("Engine", _fields(Figures) | changed, {"theory": theory})


def _columns(of: type[BaseModel], prefix: str = "") -> Iterator[str]:
    """Yield the names of all values in a JSON object; those of an object inside it are dotted."""
    for name, field in of.model_fields.items():
        kinds = (field.annotation, *get_args(field.annotation))
        inner = next((kind for kind in kinds if isinstance(kind, type) and issubclass(kind, BaseModel)), None)
        yield from _columns(inner, f"{prefix}{name}.") if inner else (f"{prefix}{name}",)


@cache
def figure_columns() -> tuple[str, ...]:
    """Return the columns of an engine's figures, the same for all engines and scenes."""
    return tuple(column for column in _columns(_engine()) if not column.startswith("causes."))


def json_schema(of: Any) -> dict[str, Any]:
    """Return the JSON Schema of a type. It allows more keys, since formats grow."""
    return {"$schema": JSON_SCHEMA} | TypeAdapter(of).json_schema()


def comparison_schema() -> dict[str, Any]:
    """Return the JSON Schema of what `sandbox compare --json` writes."""
    trial = _model("Trial", _fields(TrialFigures) | {"advised": bool})
    advice = {"advice": list[trial], "recommendation": str}  # type: ignore[valid-type]
    engines = {"engines": dict[str, _engine()], "failed": dict[str, Failure]}  # type: ignore[misc]
    comparison = _model("Comparison", _fields(Conditions) | engines, advice)
    description = {"description": "What `sandbox compare --json` writes; docs/formats.md explains the keys."}
    return json_schema(comparison) | description
