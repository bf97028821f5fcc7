"""The options that commands share: how each is parsed and described."""

import re
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from sandbox.errors import SandboxError, suggestion
from sandbox.view import Layer

if TYPE_CHECKING:
    from sandbox.engines.specs import Value
    from sandbox.run.inputs import Input
    from sandbox.scene.model import Scene


def parse_names(text: str) -> Sequence[str]:
    """Parse "pymunk,article".

    >>> parse_names("pymunk(substeps=4, iterations=30), article")
    ['pymunk(substeps=4, iterations=30)', 'article']
    """
    names = [name.strip() for name in re.split(r",(?![^(]*\))", text)]  # not at the commas in brackets
    if not all(names) or len(set(names)) < len(names):
        raise typer.BadParameter(f"{text!r} must be different names separated by commas, as in pymunk,exact")
    return names


def parse_layers(text: str) -> Sequence[Layer]:
    """Parse "charts,trails"; an empty text shows none."""
    names = parse_names(text) if text else []
    for name in names:
        if name not in tuple(Layer):
            raise typer.BadParameter(f"{name!r} is not something to show; {suggestion(name, Layer)}")
    return [Layer(name) for name in names]


def parse_size(text: str) -> tuple[int, int]:
    """Parse "1280x720": width and height, px."""
    sides = re.fullmatch(r"(\d{1,9})x(\d{1,9})", text)
    if not sides:
        raise typer.BadParameter(f"{text!r} must be width x height in px, as in 1280x720")
    return int(sides[1]), int(sides[2])


def parse_seeds(text: str) -> range:
    """Parse "A:B": the seeds from A up to but not including B.

    >>> list(parse_seeds("3:6"))
    [3, 4, 5]
    """
    ends = re.fullmatch(r"(\d{1,18}):(\d{1,18})", text)
    if not ends or int(ends[1]) >= int(ends[2]):
        raise typer.BadParameter(f"{text!r} must be two numbers A:B, for the seeds from A up to but not including B")
    return range(int(ends[1]), int(ends[2]))


def parse_rates(text: str) -> Sequence[int]:
    """Parse "60,240": steps per second."""
    if not re.fullmatch(r"[1-9]\d{0,8}(,[1-9]\d{0,8})*", text):
        raise typer.BadParameter(f"{text!r} must be whole numbers from 1 on, separated by commas, as in 60,240")
    return [int(rate) for rate in text.split(",")]


def parse_setting(text: str) -> "tuple[str, Sequence[Value]]":
    """Parse "substeps=1,4": a setting of Pymunk, elasticity or friction, and the values to run it with.

    >>> parse_setting("collision_bias=0.5,1")
    ('collision_bias', [0.5, 1])
    """
    from sandbox.engines.specs import parse_value, split_values

    key, _, values = text.partition("=")
    try:
        return key.strip(), [parse_value(value) for value in split_values(values)]
    except (ValueError, TypeError):
        raise typer.BadParameter(
            f"{text!r} must be a setting of Pymunk, elasticity or friction, and its values, such as substeps=1,4 or "
            "elasticity=0.5,1"
        ) from None


def settings_by_key(settings: "Sequence[tuple[str, Sequence[Value]]]") -> "dict[str, Sequence[Value]]":
    """Return the values of each setting. Raises SandboxError if one is given twice; a parser sees one --set only."""
    keys = [key for key, _ in settings]
    for key in keys:
        if keys.count(key) > 1:
            raise SandboxError(f"--set {key}: is given twice; write all its values in one, separated by commas")
    return dict(settings)


def _names(what: str, parser: Callable[[str], Any] = parse_names) -> Any:
    """Return an option for names, separated by commas."""
    return typer.Option(metavar="A,B,...", parser=parser, help=what)


def _limit(of: str, metavar: str = "X") -> Any:
    """Return an option for a limit of a comparison."""
    return typer.Option(min=0, metavar=metavar, help=f"Exit with 1 if {of}.")


def file_option(what: str, *names: str) -> Any:
    """Return an option for a file. names: the option's, if it is not the parameter's."""
    return typer.Option(*names, metavar="FILE", help=what)


SceneArgument = Annotated[str, typer.Argument(metavar="SCENE", help="A file, or the name of a bundled scene.")]
Engines = Annotated[Sequence[str] | None, _names("Engines. Default: pymunk, and article or else impulse.")]
EnginesToCompare = Annotated[Sequence[str] | None, _names("Engines. Default: pymunk, article or else impulse, exact.")]
EnginesToScore = Annotated[Sequence[str] | None, _names("Engines. Default: all.")]
Parts = Annotated[Sequence[str] | None, _names("Parts to measure. Default: all.")]
Against = Annotated[
    str | None, typer.Option(help="Engine that the others are measured against. Default: exact, or else the last.")
]
EngineToTrace = Annotated[str, typer.Option(help="The engine that runs it.")]
Seed = Annotated[int | None, typer.Option(help="Seed, instead of the scene's.")]
Seconds = Annotated[float | None, typer.Option(help="Seconds to run, instead of the scene's.")]
Rate = Annotated[int | None, typer.Option(help="Steps per second, instead of the scene's.")]
Inputs = Annotated[Path | None, file_option("Replay the drags and edits saved with --save-inputs.")]
JsonFile = Annotated[str | None, file_option("Write the figures as JSON.", "--json")]
CsvFile = Annotated[str | None, file_option("Write the figures as CSV.", "--csv")]
ReportFile = Annotated[str | None, file_option("Write a report as one .html file.")]
SizeOption = Annotated[Any, typer.Option(metavar="WxH", parser=parse_size, help="Width and height, px.")]
Layers = Annotated[Any, _names(f"What to show: {', '.join(Layer)}.", parse_layers)]
MaxGap = Annotated[float | None, _limit("a gap is larger", "PX")]
MaxEnergyError = Annotated[float | None, _limit("energy differs by a larger fraction from the reference's")]
AllRows = Annotated[bool, typer.Option("--all", help="Print all rows of the table.")]
First = Annotated[bool, typer.Option("--first", help="Print the first difference of each engine.")]
FirstContacts = Annotated[
    int | None, typer.Option(min=0, metavar="N", help="Print the motion at the first N contacts of each engine.")
]
Seeds = Annotated[
    range | None, typer.Option(metavar="A:B", parser=parse_seeds, help="Seeds from A up to but not including B.")
]
Rates = Annotated[Sequence[int] | None, typer.Option(metavar="R,R,...", parser=parse_rates, help="Steps per second.")]
Settings = Annotated[
    list[Any] | None,
    typer.Option(
        "--set",
        metavar="KEY=V,V,...",
        parser=parse_setting,
        help="Run with each value of a setting of Pymunk, of elasticity or of friction; may be repeated.",
    ),
]
Workers = Annotated[int | None, typer.Option(min=1, help="Local processes. Default: one per core.")]
Scheduler = Annotated[str | None, typer.Option(metavar="ADDRESS", help="Run on the cluster of a Dask scheduler.")]


def scene_and_inputs(scene: str, inputs: Path | None, **changes: object) -> "tuple[Scene, Sequence[Input]]":
    """Load a scene and apply the changes that are not None; recorded inputs bring their own seed and rate.

    Prints what its author may not have meant. Raises SandboxError if its balls do not fit.
    """
    from sandbox.scene.spawn import spawn, warnings
    from sandbox.scripting.arguments import replay

    chosen, recorded = replay(scene, inputs, **changes)
    for warning in warnings(chosen, spawn(chosen)):
        print(warning, file=sys.stderr)
    return chosen, recorded
