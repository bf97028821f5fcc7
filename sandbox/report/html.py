"""The frame of all pages: one file of HTML with its style, its scripts and its charts, and nothing from a network."""

import base64
import hashlib
import json
import platform
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from importlib.resources import files
from typing import Any, Final

from bokeh.resources import Resources
from jinja2 import Environment, PackageLoader, StrictUndefined

from sandbox.report.charts import DARK, Chart, as_document
from sandbox.report.glossary import About, about, words_in
from sandbox.report.numbers import minus, number, readable, share
from sandbox.scene.files import parse
from sandbox.scene.model import Scene
from sandbox.scene.units import PIXELS, Dimension, Units

PACKAGES: Final = ("pymunk-sandbox", "pymunk", "pyb2d3", "numpy", "numba", "bokeh")


def render(
    template: str,
    charts: Sequence[Chart],
    scripts: Sequence[str],
    engines: Iterable[str],
    *,
    units: Units = PIXELS,
    in_notebook: bool = False,
    data: object = None,
    **values: Any,
) -> str:
    """Return a page.

    template: the name of the file for its sections; charts: drawn where a section has an element of their name;
    scripts: the names of files that run after that for the charts; engines: their names, which are explained; units: of
    the scene; data: for the scripts, as JSON; in_notebook: for a frame in a notebook, without Bokeh's script, for which
    it asks its parent; values: of the template.
    """
    environment = templates()
    document, roots = as_document(charts)
    known = {"charts": charts, "in_notebook": in_notebook, "versions": _versions(), "units": units} | values
    ours = {name: _text(name) for name in ("charts.js", *scripts)}
    run = ({"bokeh": bokeh_script()} if charts and not in_notebook else {}) | ours
    return environment.get_template("base.html").render(
        known,
        sections=environment.get_template(template).render(known),
        engines=_described(engines),
        words_in=partial(words_in, units),
        policy=_policy([bokeh_script(), *ours.values()]),
        style=_text("page.css"),
        scripts=run.values(),
        data=_json(data),
        document=_json({"document": document, "roots": roots, "dark": DARK}),
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
    environment.globals |= {dimension.name: dimension for dimension in Dimension}
    environment.filters |= {"number": number, "share": share, "minus": minus, "readable": readable}
    return environment


def bokeh_script() -> str:
    """Return the library that draws the charts, without what they do not need."""
    script: str = Resources(mode="inline", components=["bokeh"], minified=True).js_raw[0]
    return script


def _described(names: Iterable[str]) -> dict[str, About]:
    return {name: about(name) for name in names}


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


def _versions() -> Mapping[str, str]:
    return {"python": platform.python_version()} | dict(_installed())


def _installed() -> Iterator[tuple[str, str]]:
    for package in PACKAGES:
        try:
            yield package, version(package)
        except PackageNotFoundError:  # an extra
            continue


def scene_file(scene: Scene) -> str:
    """Return the name of a scene's file as an argument of a command, which must not look like an option."""
    file = f"{scene.name}.toml"
    return f"./{file}" if file.startswith("-") else file


def equals_its_text(scene: Scene) -> bool:
    """Return whether a scene equals its text, apart from seed, rate and seconds, which commands set."""
    if not scene.source:
        return False
    read = parse(scene.source, scene.name).changed(seed=scene.seed, rate=scene.rate, seconds=scene.seconds)
    return read.model_dump() == scene.model_dump()


def seconds_text(seconds: float) -> str:
    """Return a time (s) as one writes it in a command: 2 and not 2.0."""
    return repr(float(seconds)).removesuffix(".0")
