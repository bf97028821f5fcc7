"""A comparison -> one self-contained HTML page: no network, no server, no other file."""

import base64
import hashlib
import json
import platform
import shlex
from collections.abc import Iterable, Iterator, Sequence
from importlib.metadata import PackageNotFoundError, version
from importlib.resources import files
from typing import Any, Final

import numpy as np
from bokeh.resources import Resources
from jinja2 import Environment, PackageLoader, StrictUndefined
from numpy.typing import NDArray

from sandbox.analysis.advice import TriedSettings, advice_rows, recommend
from sandbox.analysis.comparison import Comparison
from sandbox.analysis.difference import MAX_DIFFERENCES, pair_name
from sandbox.analysis.figures import Run
from sandbox.analysis.verdict import summaries
from sandbox.report.about import about
from sandbox.report.charts import as_document, charts
from sandbox.report.numbers import minus, readable
from sandbox.report.scales import gap_scale
from sandbox.report.tables import comparison_rows, headline, velocities_and_spins
from sandbox.scene.fields import rgb
from sandbox.scene.files import TRUTHS, bundled, parse
from sandbox.scene.model import Scene
from sandbox.scene.units import Dimension
from sandbox.state import Floats

MAX_PATHS_BYTES: Final = 3_300_000  # of all packed paths; with Bokeh's script a page stays under 6 MB
MAX_NUMBERED: Final = 20  # balls that have their numbers drawn on them
MAX_TRAILED: Final = 200  # balls for which trails are on at first
MAX_PACKED: Final = 65_535  # of a coordinate in 16 bits
SAME_TIME: Final = 1e-9  # s; a contact that is later than a step by less is counted at its end
PACKAGES: Final = ("pymunk-sandbox", "pymunk", "pyb2d3", "numpy", "numba", "bokeh")
SCRIPTS: Final = ("charts.js", "player.js")


def page(comparison: Comparison, trials: Sequence[TriedSettings] = ()) -> str:
    """Return a comparison, with trials of other settings, as one page of HTML. The same input gives the same page."""
    scene = comparison.scene
    every = thinning(comparison, MAX_PATHS_BYTES)
    drawn = charts(comparison)
    document, roots = as_document(drawn)
    scripts = [Resources(mode="inline", components=["bokeh"], minified=True).js_raw[0], *map(_text, SCRIPTS)]
    return (
        templates()
        .get_template("page.html")
        .render(
            charts=drawn,
            units=scene.units,
            engines={name: about(name) for name in comparison.runs},
            versions={"python": platform.python_version()} | dict(_installed()),
            policy=_policy(scripts),
            style=_text("page.css"),
            scripts=scripts,
            document=_json({"document": document, "roots": roots}),
            title=scene.title or scene.name,
            scene=scene,
            settings=headline(comparison).removeprefix(f"{scene.title or scene.name}: "),
            comparison=comparison,
            others=comparison.others,
            figures=[["", *comparison.runs], *comparison_rows(comparison)],
            summaries=summaries(comparison),
            trials=list(advice_rows(trials)) if trials else [],
            recommendation=recommend(trials) if trials else "",
            max_differences=MAX_DIFFERENCES,
            pair_name=lambda difference: pair_name(scene, difference),
            motion=lambda difference: velocities_and_spins(scene, difference),
            is_bundled=_is_bundled(scene),
            command=_command(comparison) if _equals_its_text(scene) else None,
            python=scene.model_dump_json(by_alias=True, exclude_defaults=True, indent=2),
            inputs="\n".join(given.model_dump_json() for given in comparison.inputs),
            trailed=len(scene.bodies) <= MAX_TRAILED,
            frames=_about_frames(comparison, every),
            data=_json(_data(comparison, every)),
        )
    )


def templates() -> Environment:
    """Return what renders the templates of this folder."""
    environment = Environment(
        loader=PackageLoader("sandbox.report", ""),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"minus": minus, "readable": readable}
    return environment


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


def _installed() -> Iterator[tuple[str, str]]:
    for package in PACKAGES:
        try:
            yield package, version(package)
        except PackageNotFoundError:  # an extra
            continue


def thinning(comparison: Comparison, max_bytes: int) -> int:
    """Return the number n such that every n-th frame of the paths fits into some bytes of a page."""
    whole = sum(run.path.size for run in comparison.runs.values()) * 2 * 4 / 3  # two bytes a number, then base64
    return max(1, int(np.ceil(whole / max_bytes)))


def fixed_point(scene: Scene) -> tuple[float, float]:
    """Return how coordinates are packed: px per unit, and px of margin around the arena, for balls that left it."""
    margin = 2 * float(scene.bodies.radius.max())
    return (max(scene.arena.size) + 2 * margin) / MAX_PACKED, margin


# Data of the player


def _data(comparison: Comparison, every: int) -> dict[str, Any]:
    scene, names = comparison.scene, list(comparison.runs)
    unit, margin = fixed_point(scene)
    energy, unit_of_energy = _energies(comparison)
    return {
        "size": scene.arena.size,
        "background": _hex(scene.arena.background),
        "walls": [(*wall.start, *wall.to, wall.thickness) for wall in scene.walls],
        "radius": scene.bodies.radius.tolist(),
        "colors": [_hex(color) for color in scene.colors],
        "numbered": len(scene.bodies) <= MAX_NUMBERED,
        "frame": comparison.stride * every / scene.rate,
        "unit": unit,
        "margin": margin,
        "against": names.index(comparison.against),
        "energy": unit_of_energy,
        "length": scene.units.length,
        "least": gap_scale(scene.units).least,
        "engines": [
            {
                "path": packed(_fixed(run.path[::every], unit, margin)),
                "readings": packed(_readings(comparison, run, energy[name])[:: comparison.stride * every]),
            }
            for name, run in comparison.runs.items()
        ],
    }


def _energies(comparison: Comparison) -> tuple[dict[str, Floats], str]:
    """Return each engine's energy over time and its unit: %, 100 at the start, or the scene's if nothing moves."""
    runs = comparison.runs
    if comparison.energy_scale:
        return {name: 100 * (1 + run.energy_change) for name, run in runs.items()}, "%"
    units = comparison.scene.units
    factor = units.factor(Dimension.ENERGY)
    return {name: factor * run.energy for name, run in runs.items()}, units.name(Dimension.ENERGY)


def _fixed(path: NDArray[np.float32], unit: float, margin: float) -> NDArray[np.uint16]:
    fixed: NDArray[np.uint16] = np.clip(np.rint((path + margin) / unit), 0, MAX_PACKED).astype("<u2")
    return fixed


def _readings(comparison: Comparison, run: Run, energy: Floats) -> NDArray[np.float32]:
    """Return the readings below a pane, (steps + 1, 3): gap and energy as shown, contacts so far."""
    factor = comparison.scene.units.factor(Dimension.LENGTH)
    contacts = np.searchsorted(run.contacts["time"], comparison.time + SAME_TIME, side="right")
    return np.column_stack([factor * run.gap_max, energy, contacts]).astype("<f4")


def _hex(color: str) -> str:
    return "#{:02x}{:02x}{:02x}".format(*rgb(color))


# Text of the page


def _about_frames(comparison: Comparison, every: int) -> str:
    steps, stride = len(comparison.time) - 1, comparison.stride * every
    unit, _ = fixed_point(comparison.scene)
    rounded = comparison.scene.units.text(Dimension.LENGTH, "{:.2g}", unit)
    shown = "Every step is shown" if stride == 1 else f"To keep the page small, 1 step in {stride} is shown"
    states = f"{steps // stride + 1:,} of {steps + 1:,} states"
    return f"{shown}: {states}, with positions rounded to {rounded}."


def _command(comparison: Comparison) -> str:
    """Return the command that repeats the comparison, from the files on the page."""
    scene = comparison.scene
    options = {
        "--engines": ",".join(comparison.runs),
        "--against": comparison.against,
        "--seed": str(scene.seed),
        "--rate": str(scene.rate),
        "--seconds": repr(float(scene.seconds)).removesuffix(".0"),
    } | ({"--inputs": "inputs.jsonl"} if comparison.inputs else {})
    words = (word for option in options.items() for word in option)
    return shlex.join(["sandbox", "compare", _file_of(scene), *words])


def _file_of(scene: Scene) -> str:
    """Return a scene as an argument of a command, which must not look like an option."""
    file = scene.name if _is_bundled(scene) else f"{scene.name}.toml"
    return f"./{file}" if file.startswith("-") else file


def _equals_its_text(scene: Scene) -> bool:
    """Return whether a scene equals its text, apart from seed, rate and seconds, which commands set."""
    if not scene.source:
        return False
    read = parse(scene.source, scene.name).changed(seed=scene.seed, rate=scene.rate, seconds=scene.seconds)
    return read.model_dump() == scene.model_dump()


def _is_bundled(scene: Scene) -> bool:
    """Return whether a scene comes with the sandbox, unchanged, so that its name is enough."""
    file = {**bundled(), **bundled(TRUTHS)}.get(scene.name)
    return file is not None and file.read_text(encoding="utf-8") == scene.source


def packed(values: NDArray[Any]) -> str:
    """Return an array's bytes in base64."""
    return base64.b64encode(values.tobytes()).decode()
