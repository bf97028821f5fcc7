"""The options that commands share: how each is parsed, described and completed."""

import inspect
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, is_dataclass
from functools import wraps
from pathlib import Path
from typing import IO, TYPE_CHECKING, Annotated, Any, Final, NamedTuple, TypeVar

import typer

from sandbox.errors import SandboxError, suggestion
from sandbox.text import printable
from sandbox.view import Layer, check_pygame

if TYPE_CHECKING:
    from sandbox.engines.specs import Value
    from sandbox.run.inputs import Input
    from sandbox.scene.model import Scene

T = TypeVar("T")


class OptionError(typer.BadParameter):
    """A wrong value, reported in one line as all errors are: typer's own report puts the usage above it."""

    def show(self, file: IO[Any] | None = None) -> None:
        """Print the message to standard error."""
        option = f"{self.param.opts[0]} " if self.param else ""
        typer.echo(printable(f"{option}{self.message}"), file=file, err=True)


@dataclass(frozen=True)
class Size:
    """Width and height of a recording, px."""

    width: int
    height: int

    def __str__(self) -> str:
        return f"{self.width}x{self.height}"


DEFAULT_SIZE: Final = Size(1280, 720)


class Setting(NamedTuple):
    """A setting of Pymunk, elasticity or friction, and the values to run it with."""

    key: str
    values: "Sequence[Value]"


def parse_names(text: str) -> Sequence[str]:
    """Parse "pymunk,article".

    >>> parse_names("pymunk(substeps=4, iterations=30), article")
    ['pymunk(substeps=4, iterations=30)', 'article']
    """
    names = [name.strip() for name in re.split(r",(?![^(]*\))", text)]  # not at the commas in brackets
    if not any(names):
        raise OptionError(f"{text!r}: must be names separated by commas")
    if not all(names):
        raise OptionError(f"{text}: has a comma without a name")
    if len(set(names)) < len(names):
        raise OptionError(f"{text}: has a name twice")
    return names


def parse_engines(text: str) -> Sequence[str]:
    """Parse "pymunk,exact". The message for an empty text says how to run the default engines."""
    if not text.strip(" ,"):
        raise OptionError(f"{text!r}: must name an engine, as in pymunk,exact; leave the option out for the default")
    return parse_names(text)


def parse_engine(text: str) -> str:
    """Parse "pymunk": an engine, which must not be empty."""
    if not text.strip():
        raise OptionError(f"{text!r}: must name an engine, as in pymunk")
    return text


def parse_layers(text: str) -> Sequence[Layer]:
    """Parse "charts,trails"; an empty text shows none."""
    names = parse_names(text) if text else []
    for name in names:
        if name not in tuple(Layer):
            raise OptionError(f"{name}: is not something to show; {suggestion(name, Layer)}")
    return [Layer(name) for name in names]


def parse_size(text: str) -> Size:
    """Parse "1280x720"."""
    sides = re.fullmatch(r"(\d{1,9})x(\d{1,9})", text)
    if not sides:
        raise OptionError(f"{text}: write width x height in px, as in 1280x720")
    return Size(int(sides[1]), int(sides[2]))


def parse_seeds(text: str) -> range:
    """Parse "A:B": the seeds from A up to but not including B.

    >>> list(parse_seeds("3:6"))
    [3, 4, 5]
    """
    ends = re.fullmatch(r"(\d{1,18}):(\d{1,18})", text)
    if not ends or int(ends[1]) >= int(ends[2]):
        raise OptionError(f"{text}: must be two numbers A:B, for the seeds from A up to but not including B")
    return range(int(ends[1]), int(ends[2]))


def parse_rates(text: str) -> Sequence[int]:
    """Parse "60,240", or "60:240", in which each rate is twice the one before.

    >>> parse_rates("60:240")
    [60, 120, 240]
    """
    if not re.fullmatch(r"[1-9]\d{0,8}((,[1-9]\d{0,8})*|:[1-9]\d{0,8})", text):
        raise OptionError(
            f"{text!r}: must be whole numbers from 1 on, separated by commas, such as 60,240, or 60:960 to double"
        )
    first, doubled, last = text.partition(":")
    if not doubled:
        return [int(rate) for rate in text.split(",")]
    if int(last) < int(first):
        raise OptionError(f"{text}: must be two rates A:B, of which the second is not the smaller one")
    return [int(first) << k for k in range((int(last) // int(first)).bit_length())]


def parse_setting(text: str) -> Setting:
    """Parse "substeps=1,4".

    >>> parse_setting("collision_bias=0.5,1")
    Setting(key='collision_bias', values=[0.5, 1])
    """
    from sandbox.engines.specs import parse_value, split_values

    key, _, values = text.partition("=")
    try:
        return Setting(key.strip(), [parse_value(value) for value in split_values(values)])
    except (ValueError, TypeError):
        raise OptionError(
            f"{text}: must be a setting of Pymunk, elasticity or friction, and its values, such as substeps=1,4 or "
            "elasticity=0.5,1"
        ) from None


def settings_by_key(settings: Sequence[Setting]) -> "dict[str, Sequence[Value]]":
    """Return the values of each setting. Raises SandboxError if one is given twice; a parser sees one --set only."""
    keys = [setting.key for setting in settings]
    for key in keys:
        if keys.count(key) > 1:
            raise SandboxError(f"--set {key}: is given twice; write all its values in one, separated by commas")
    return dict(settings)


def complete_scene(incomplete: str) -> list[str]:
    """List the bundled scenes, and the scene files of this folder; for other folders, the shell completes."""
    from sandbox.scene.files import bundled

    names = [*bundled(), *(bundled("truths") if "/" in incomplete else ()), *map(str, Path().glob("*.toml"))]
    return [name for name in names if name.startswith(incomplete)]


def complete_engine(incomplete: str) -> list[str]:
    """List the engines; after a comma, those not yet named."""
    from sandbox.engines import registry

    named, comma, begun = incomplete.rpartition(",")
    return [f"{named}{comma}{name}" for name in registry() if name.startswith(begun) and name not in named.split(",")]


def _if_text(parse: Callable[[str], T]) -> Callable[[Any], T]:
    """Return a parser that leaves defaults as they are: typer calls parsers on defaults too."""
    return lambda value: parse(value) if isinstance(value, str) else value


def file_option(what: str, *names: str) -> Any:
    """Return an option for a file. names: the option's, if it is not the parameter's."""
    return typer.Option(*names, metavar="FILE", help=what)


def _limit(of: str, metavar: str = "X") -> Any:
    """Return an option for a limit of a comparison."""
    return typer.Option(min=0, metavar=metavar, help=f"Exit with 1 if {of}.")


def _names(what: str, parser: Callable[[str], Any] = parse_names, **more: Any) -> Any:
    """Return an option for names, separated by commas."""
    return typer.Option(metavar="A,B,...", parser=parser, help=what, **more)


def _engines(default: str) -> Any:
    """Return an option for engines. default: those without it."""
    return _names(f"Engines. Default: {default}.", parse_engines, autocompletion=complete_engine)


def _engine(what: str) -> Any:
    """Return an option for one engine."""
    return typer.Option(metavar="ENGINE", parser=parse_engine, help=what, autocompletion=complete_engine)


SceneArgument = Annotated[
    str,
    typer.Argument(metavar="SCENE", help="A file, or the name of a bundled scene.", autocompletion=complete_scene),
]
Engines = Annotated[Sequence[str] | None, _engines("pymunk, and article or else impulse")]
EnginesToCompare = Annotated[Sequence[str] | None, _engines("pymunk, article or else impulse, exact")]
EnginesToScore = Annotated[Sequence[str] | None, _engines("all")]
Parts = Annotated[Sequence[str] | None, _names("Parts to measure. Default: all.")]
Against = Annotated[
    str | None, _engine("Engine that the others are measured against. Default: exact, or else the last.")
]
EngineToTrace = Annotated[str, _engine("The engine that runs it.")]
Seed = Annotated[int | None, typer.Option(help="Seed, instead of the scene's.")]
Seconds = Annotated[float | None, typer.Option(help="Seconds to run, instead of the scene's.")]
Inputs = Annotated[Path | None, file_option("Replay the drags and edits saved with --save-inputs.")]
JsonFile = Annotated[str | None, file_option("Write the figures as JSON.", "--json")]
ReportFile = Annotated[str | None, file_option("Write a report as one .html file.")]
JunitFile = Annotated[str | None, file_option("Write the results as JUnit XML.", "--junit")]
SizeOption = Annotated[Size, typer.Option(metavar="WxH", parser=_if_text(parse_size), help="Width and height, px.")]
Layers = Annotated[Sequence[Layer], _names(f"What to show: {', '.join(Layer)}.", _if_text(parse_layers))]
Seeds = Annotated[
    range | None, typer.Option(metavar="A:B", parser=parse_seeds, help="Seeds from A up to but not including B.")
]
Rates = Annotated[
    Sequence[int] | None,
    typer.Option(metavar="R,R,...", parser=parse_rates, help="Steps per second; A:B doubles them from A to B."),
]
Settings = Annotated[
    list[Setting] | None,
    typer.Option(
        "--set",
        metavar="KEY=V,V,...",
        parser=parse_setting,
        help="Run with each value of a setting of Pymunk, of elasticity or of friction; may be repeated.",
    ),
]


@dataclass(frozen=True)
class RunOptions:
    """How a scene is run: instead of what it says itself, and with which recorded inputs."""

    seconds: Seconds = None
    seed: Seed = None
    rate: Annotated[int | None, typer.Option(help="Steps per second, instead of the scene's.")] = None
    inputs: Inputs = None

    def load(self, scene: str) -> "tuple[Scene, Sequence[Input]]":
        """Load a scene with these changes, and the recorded inputs."""
        return scene_and_inputs(scene, self.inputs, seed=self.seed, rate=self.rate, seconds=self.seconds)


@dataclass(frozen=True)
class ComparisonFiles:
    """The files that a comparison is written to."""

    json: JsonFile = None
    csv: Annotated[str | None, file_option("Write the figures as CSV.", "--csv")] = None
    report: ReportFile = None

    @property
    def by_option(self) -> dict[str, str]:
        """The files that are wanted, by their options."""
        return {f"--{name}": file for name, file in vars(self).items() if file is not None}


@dataclass(frozen=True)
class Limits:
    """The limits of a comparison, beyond which its exit code is 1."""

    max_gap: Annotated[float | None, _limit("a gap is larger", "PX")] = None
    max_drift: Annotated[float | None, _limit("energy changes by a larger fraction")] = None
    max_energy_error: Annotated[float | None, _limit("energy differs by a larger fraction from the reference's")] = None


@dataclass(frozen=True)
class Shown:
    """What the text of a comparison shows besides its first lines and ten rows."""

    all_rows: Annotated[bool, typer.Option("--all", help="Print all rows of the table.")] = False
    first: Annotated[bool, typer.Option("--first", help="Print the first difference of each engine.")] = False
    contacts: Annotated[
        int | None, typer.Option(min=0, metavar="N", help="Print the motion at the first N contacts of each engine.")
    ] = None


@dataclass(frozen=True)
class Workforce:
    """Where the runs of a sweep are done."""

    workers: Annotated[int | None, typer.Option(min=1, help="Local processes. Default: one per core.")] = None
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Run on the cluster of a Dask scheduler.")
    ] = None


def grouped(command: Callable[..., None]) -> Callable[..., None]:
    """Return a command that typer can read: each parameter of a dataclass of options is replaced by its fields."""
    annotations = {name: parameter.annotation for name, parameter in inspect.signature(command).parameters.items()}
    groups: dict[str, type[Any]] = {
        name: kind for name, kind in annotations.items() if isinstance(kind, type) and is_dataclass(kind)
    }

    @wraps(command)
    def flat(**values: Any) -> None:
        for name, group in groups.items():
            values[name] = group(**{field.name: values.pop(field.name) for field in fields(group)})
        command(**values)

    parameters = list(_flat_parameters(command))
    flat.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]  # as inspect documents
    flat.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return flat


def _flat_parameters(command: Callable[..., None]) -> Iterator[inspect.Parameter]:
    for parameter in inspect.signature(command).parameters.values():
        if not is_dataclass(parameter.annotation):
            yield parameter.replace(kind=parameter.KEYWORD_ONLY)
            continue
        for field in fields(parameter.annotation):
            yield inspect.Parameter(field.name, parameter.KEYWORD_ONLY, default=field.default, annotation=field.type)


def scene_and_inputs(scene: str, inputs: Path | None, **changes: object) -> "tuple[Scene, Sequence[Input]]":
    """Load a scene and apply the changes that are not None; recorded inputs bring their own seed and rate."""
    from sandbox.scripting.arguments import replay

    chosen, recorded, warning = replay(scene, inputs, **changes)
    if warning:
        print(warning, file=sys.stderr)
    return chosen, recorded


def print_warnings(scene: "Scene") -> None:
    """Print what the author of a scene may not have meant. Raises SandboxError if its balls do not fit."""
    from sandbox.scene.spawn import spawn, warnings

    for warning in warnings(scene, spawn(scene)):
        print(warning, file=sys.stderr)


def warn_of_pygame() -> None:
    """Print a warning if two versions of pygame are installed. Raises SandboxError if none can be used."""
    if warning := check_pygame():
        print(warning, file=sys.stderr)
