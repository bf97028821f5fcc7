"""A comparison -> one self-contained HTML page: no network, no server, no other file."""

import base64
import hashlib
import json
import platform
import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version
from importlib.resources import files
from typing import Any, Final

import numpy as np
from bokeh.resources import Resources
from jinja2 import Environment, StrictUndefined
from numpy.typing import NDArray

from sandbox.analysis.advice import Trial, advice_rows, recommend
from sandbox.analysis.causes import Cause
from sandbox.analysis.comparison import Comparison
from sandbox.analysis.difference import MAX_DIFFERENCES, Kind, Velocities, pair_name
from sandbox.analysis.measurement import Run
from sandbox.analysis.series import contacts_by, energies
from sandbox.analysis.verdict import key_figures, mark_words, reference_words, verdict
from sandbox.report.charts import as_document, charts
from sandbox.scene.fields import rgb
from sandbox.scene.files import parse
from sandbox.scene.model import Scene
from sandbox.state import Floats

MAX_PATHS_BYTES: Final = 3_300_000  # of all packed paths; with Bokeh's script a page stays under 6 MB
MAX_NOTEBOOK_PATHS_BYTES: Final = 240_000  # in a notebook, whose cells stay under 1 MB
MAX_NUMBERED: Final = 20  # balls that have their numbers drawn on them
MAX_TRAILED: Final = 200  # balls for which trails are on at first
MAX_PACKED: Final = 65_535  # of a coordinate in 16 bits
PACKAGES: Final = ("pymunk-sandbox", "pymunk", "pyb2d3", "numpy", "numba", "bokeh")
KINDS: Final = {
    Kind.OUTCOME: "other outcome",
    Kind.MISSING: "missing",
    Kind.EXTRA: "extra",
    Kind.ORDER: "other order",
    Kind.FLIGHT: "in flight",
    Kind.STATES: "by states",
    Kind.START: "at the start",
}
KEYS: Final = (
    ("Space", "play or pause"),
    ("← →", "previous or next frame"),
    ("Home End", "first or last frame"),
    ("D", "next contact that differs"),
    ("G", "ghosts on or off"),
    ("T", "trails on or off"),
    ("+ -", "double or halve the speed"),
)


def page(comparison: Comparison, trials: Sequence[Trial] = (), *, in_notebook: bool = False) -> str:
    """Return a comparison, with trials of other settings, as one page of HTML. The same input gives the same page.

    in_notebook: for a frame in a notebook, with fewer frames, and without Bokeh's script, for which it asks its parent.
    """
    scene = comparison.scene
    every = thinning(comparison, MAX_NOTEBOOK_PATHS_BYTES if in_notebook else MAX_PATHS_BYTES)
    drawn = charts(comparison)
    document, roots = as_document(drawn)
    scripts = {"bokeh": bokeh_script(), "player": _text("player.js")}
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    environment.filters |= {"number": _number, "share": _share, "minus": _minus}
    return environment.from_string(_text("page.html")).render(
        title=scene.title or scene.name,
        scene=scene,
        settings=_settings(comparison),
        comparison=comparison,
        others={name: run for name, run in comparison.runs.items() if name != comparison.against},
        ledgers={name: run for name, run in comparison.runs.items() if run.figures.ledger},
        figures=[(label, values) for label, *values in key_figures(comparison)],
        mark=mark_words(comparison),
        verdict=verdict(comparison),
        trials=list(advice_rows(trials)) if trials else [],
        recommendation=recommend(trials) if trials else "",
        theory={name: run.theory for name, run in comparison.runs.items() if run.theory},
        charts=drawn,
        kinds=KINDS,
        keys=KEYS,
        missed=Cause.MISSED,
        max_differences=MAX_DIFFERENCES,
        pair_name=lambda difference: pair_name(scene, difference),
        outcome=_outcome,
        command=_command(comparison) if _equals_its_text(scene) else None,
        python=scene.model_dump_json(by_alias=True, exclude_defaults=True, indent=2),
        inputs="\n".join(given.model_dump_json() for given in comparison.inputs),
        versions=_versions(),
        trailed=len(scene.bodies) <= MAX_TRAILED,
        frames=_about_frames(comparison, every),
        policy=_policy(scripts.values()),
        style=_text("page.css"),
        scripts=scripts,
        in_notebook=in_notebook,
        data=_json(_data(comparison, every)),
        document=_json({"document": document, "roots": roots}),
    )


def bokeh_script() -> str:
    """Return the library that draws the charts, without what they do not need."""
    script: str = Resources(mode="inline", components=["bokeh"], minified=True).js_raw[0]
    return script


def thinning(comparison: Comparison, max_bytes: int) -> int:
    """Return the number n such that every n-th frame of the paths fits into some bytes of a page."""
    whole = sum(run.path.size for run in comparison.runs.values()) * 2 * 4 / 3  # two bytes a number, then base64
    return max(1, int(np.ceil(whole / max_bytes)))


def fixed_point(scene: Scene) -> tuple[float, float]:
    """Return how coordinates are packed: px per unit, and px of margin around the arena, for balls that left it."""
    margin = 2 * float(scene.bodies.radius.max())
    return (max(scene.arena.size) + 2 * margin) / MAX_PACKED, margin


def _text(name: str) -> str:
    return files("sandbox.report").joinpath(name).read_text(encoding="utf-8")


def _policy(scripts: Iterable[str]) -> str:
    """Return the page's Content-Security-Policy: no network, and no script but these, whatever a scene contains."""
    digests = (base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in scripts)
    allowed = " ".join(f"'sha256-{digest}'" for digest in digests)
    return f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; img-src data:"


def _json(value: object) -> str:
    """Return JSON that cannot close the script element that contains it."""
    return json.dumps(value, separators=(",", ":")).replace("<", "\\u003c")


# Data of the player


def _data(comparison: Comparison, every: int) -> dict[str, Any]:
    scene, names = comparison.scene, list(comparison.runs)
    unit, margin = fixed_point(scene)
    energy, unit_of_energy = energies(comparison)
    return {
        "size": scene.arena.size,
        "background": _hex(scene.arena.background),
        "walls": [(*wall.start, *wall.to, wall.thickness) for wall in scene.walls],
        "radius": scene.bodies.radius.tolist(),
        "colors": [_hex(color) for color in scene.colors],
        "numbered": len(scene.bodies) <= MAX_NUMBERED,
        "frame": comparison.stride * every / scene.rate,
        "times": comparison.time[:: comparison.stride * every].tolist() if scene.clock.varies else None,
        "unit": unit,
        "margin": margin,
        "against": names.index(comparison.against),
        "energy": unit_of_energy,
        "engines": [
            {
                "path": _base64(_packed(run.path[::every], unit, margin)),
                "readings": _base64(_readings(comparison, run, energy[name])[:: comparison.stride * every]),
            }
            for name, run in comparison.runs.items()
        ],
    }


def _packed(path: NDArray[np.float32], unit: float, margin: float) -> NDArray[np.uint16]:
    packed: NDArray[np.uint16] = np.clip(np.rint((path + margin) / unit), 0, MAX_PACKED).astype("<u2")
    return packed


def _readings(comparison: Comparison, run: Run, energy: Floats) -> NDArray[np.float32]:
    """Return the readings below a pane, (steps + 1, 3): gap (px), energy, contacts so far."""
    return np.column_stack([run.gap_max, energy, contacts_by(comparison.time, run)]).astype("<f4")


def _base64(values: NDArray[Any]) -> str:
    return base64.b64encode(values.tobytes()).decode()


def _hex(color: str) -> str:
    return "#{:02x}{:02x}{:02x}".format(*rgb(color))


# Text of the page


def _settings(comparison: Comparison) -> str:
    scene, balls = comparison.scene, len(comparison.scene.bodies)
    replayed = " Recorded inputs were replayed into all engines." if comparison.inputs else ""
    run = f"{balls:,} ball{'s' * (balls > 1)}, seed {scene.seed}, {_seconds(scene.seconds)} s"
    return f"{run} {scene.clock}, {reference_words(comparison)}.{replayed}"


def _about_frames(comparison: Comparison, every: int) -> str:
    steps, stride = comparison.scene.steps, comparison.stride * every
    unit, _ = fixed_point(comparison.scene)
    shown = "Every step is shown" if stride == 1 else f"To keep the page small, 1 step in {stride} is shown"
    states = f"{steps // stride + 1:,} of {steps + 1:,} states"
    return f"{shown}: {states}, with positions rounded to {unit:.2g} px."


def _command(comparison: Comparison) -> str:
    """Return the command that repeats the comparison, from the files on the page."""
    scene = comparison.scene
    options = {
        "--engines": ",".join(comparison.runs),
        "--against": comparison.against,
        "--seed": str(scene.seed),
        "--rate": str(scene.rate),
        "--seconds": _seconds(scene.seconds),
    } | ({"--inputs": "inputs.jsonl"} if comparison.inputs else {})
    words = (word for option in options.items() for word in option)
    file = f"{scene.name}.toml"
    return shlex.join(["sandbox", "compare", f"./{file}" if file.startswith("-") else file, *words])


def _equals_its_text(scene: Scene) -> bool:
    """Return whether a scene equals its text, apart from seed, rate and seconds, which the command sets."""
    if not scene.source:
        return False
    read = parse(scene.source, scene.name).changed(seed=scene.seed, rate=scene.rate, seconds=scene.seconds)
    return read.model_dump() == scene.model_dump()


def _versions() -> Mapping[str, str]:
    return {"python": platform.python_version()} | dict(_installed())


def _installed() -> Iterator[tuple[str, str]]:
    for package in PACKAGES:
        try:
            yield package, version(package)
        except PackageNotFoundError:  # an extra
            continue


def _seconds(seconds: float) -> str:
    return repr(float(seconds)).removesuffix(".0")


def _outcome(before: Velocities | None, after: Velocities | None) -> list[str]:
    """Return the velocities before and after a contact, a line for each ball."""
    if before is None or after is None:
        return ["no such contact"]
    return [" → ".join(map(_vector, of_ball)) for of_ball in zip(before, after, strict=True)]


def _vector(velocity: tuple[float, float]) -> str:
    return "({}, {})".format(*map(_number, velocity))


def _number(value: float) -> str:
    return _minus(f"{value:,.4g}" if abs(value) < 1e4 else f"{value:,.0f}")


def _share(value: float, whole: float) -> str:
    """Format an energy as a percentage of the start, or in its unit if that was 0."""
    if not value:
        return "0"
    return _minus(f"{100 * value / whole:+.4g} %") if whole else f"{_number(value)} kg px²/s²"


def _minus(number: str) -> str:
    return number.replace("-", "\N{MINUS SIGN}")
