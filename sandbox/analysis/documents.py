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

    scene: str  # its name
    seed: int  # of what is drawn at random
    rate: int  # steps per second
    since: float  # s, time of the last edit, from which times count
    seconds: float  # how long the engines ran
    against: str  # the reference
    horizon: float | None  # s, from when on its paths mean nothing; None if they mean something to the end
    undecided: float | None  # s, likewise
    unresolved: float | None  # s, likewise
    reference_until: float | None  # s, when an engine that cannot go on ended the comparison; None if none did
    energy_scale: float  # kg px²/s², what shares of energy are relative to; 0 if nothing moves


@dataclass(frozen=True)
class Failure:
    """What JSON has of an engine that failed."""

    time: float  # s, when it failed
    message: str  # why


@dataclass(frozen=True)
class TrialFigures:
    """What JSON has of a run of Pymunk with some settings changed, compared with the reference."""

    changes: dict[str, int]  # settings of `[pymunk]`
    passages: int  # of balls through walls or each other, without a contact
    escapes: int  # balls that left the arena
    apart: float | None  # s, when its paths leave the reference's; None if not while the reference means anything
    gap_rms: float  # px, over all balls and the times up to when the reference means nothing
    energy_error: float | None  # as in `Figures`, None if the mouse gives each engine its own energy


def _model(name: str, of: type | None = None, /, **changed: Any) -> type[BaseModel]:
    """Return the type of a JSON object: the fields of a dataclass, some of them changed, left out (None), or added."""
    kinds = (get_type_hints(of) if of else {}) | changed
    fields: dict[str, Any] = {key: (kind, ...) for key, kind in kinds.items() if kind is not None}
    return create_model(name, **fields)


def _sparse(name: str, kinds: Mapping[str, Any]) -> type[BaseModel]:
    """Return the type of a JSON object of which every key may be absent."""
    fields: dict[str, Any] = {key: (kind, Field(default_factory=dict)) for key, kind in kinds.items()}
    return create_model(name, **fields)


@cache  # building the types takes longer than writing a comparison
def _engine() -> type[BaseModel]:
    """Return the type of an engine's part of a comparison."""
    first_difference = _model("FirstDifference", Difference, cause=CauseKey)
    line = _model("LedgerLine", Entry, cause=None, share=float | None)
    theory = _sparse("Theory", dict.fromkeys(THEORY_FIGURES, _model("TheoryLine", TheoryRow, figure=None)))
    figures = _model(
        "Figures",
        Figures,
        first_difference=first_difference | None,
        causes=list[_model("CauseOfError", CauseOfError, cause=CauseKey)],  # type: ignore[misc]
        ledger=_sparse("Ledger", {cause.key: line for cause in Cause}),
    )
    return create_model("Engine", __base__=figures, theory=(theory, Field(default_factory=dict)))


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
    trial: Any = _model("Trial", TrialFigures, advised=bool)
    advice: dict[str, Any] = {
        "advice": (list[trial], Field(default_factory=list)),
        "recommendation": (str, Field(default_factory=str)),
    }
    runs: dict[str, Any] = {"engines": dict[str, _engine()], "failed": dict[str, Failure]}  # type: ignore[misc]
    comparison = create_model("Comparison", __base__=_model("Runs", Conditions, **runs), **advice)
    description = {"description": "What `sandbox compare --json` writes; docs/formats.md explains the keys."}
    return json_schema(comparison) | description
