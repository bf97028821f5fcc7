"""What `--json` writes is what `sandbox schema` says."""

import json
from collections.abc import Iterator
from typing import Any

import pytest
from conftest import Command, scene_of

from sandbox.analysis.advice import as_json as advice_as_json
from sandbox.analysis.advice import try_settings
from sandbox.analysis.comparison import compare
from sandbox.analysis.documents import comparison_schema, json_schema
from sandbox.scene.files import load
from sandbox.scene.model import Scene
from sandbox.scores.verify import Board, Outcome, Result, Scores, as_json, verify

TYPES = {"object": dict, "array": list, "string": str, "integer": int, "boolean": bool, "null": type(None)}
NOTES = {"title", "description", "$schema", "$defs"}


def errors(value: Any, schema: dict[str, Any], root: dict[str, Any], path: str = "") -> Iterator[str]:
    """Yield where a value is not as a JSON Schema says, or has a key that it does not know."""
    rules = {key: rule for key, rule in schema.items() if key not in NOTES}
    if reference := rules.pop("$ref", None):
        yield from errors(value, root["$defs"][reference.removeprefix("#/$defs/")], root, path)
    if choices := rules.pop("anyOf", None):
        found = [list(errors(value, choice, root, path)) for choice in choices]
        if all(found):
            yield min(found, key=len)[0]
    kind = rules.pop("type", None)
    is_number = kind == "number" and isinstance(value, int | float)
    if kind and not (is_number or type(value) is TYPES.get(kind)):
        yield f"{path}: {value!r:.40} is not a {kind}"
        return
    if "enum" in rules and value not in rules.pop("enum"):
        yield f"{path}: {value!r} is not one of the enum"
    for key in rules.pop("required", ()):
        if key not in value:
            yield f"{path}: has no {key}"
    known, others = rules.pop("properties", {}), rules.pop("additionalProperties", None)
    if kind == "object":
        for key, inner in value.items():
            rule = known.get(key, others)
            yield from [f"{path}.{key}: unknown"] if rule is None else errors(inner, rule, root, f"{path}.{key}")
    if kind == "array":
        first, rest = rules.pop("prefixItems", []), rules.pop("items", {})
        if not rules.pop("minItems", 0) <= len(value) <= rules.pop("maxItems", len(value)):
            yield f"{path}: has {len(value)} items"
        for index, inner in enumerate(value):
            yield from errors(inner, first[index] if index < len(first) else rest, root, f"{path}[{index}]")
    assert not rules, f"{path}: this test does not know {rules}"


def read(document: object) -> Any:
    return json.loads(json.dumps(document, allow_nan=False))


AT_REST = scene_of("radius = 20\npositions = [[100, 100], [200, 200]]", more="seconds = 0.1")
SPINNING = scene_of(
    "radius = 20\nfriction = 0.4\nelasticity = 0.8\nspin = 9\npositions = [[100, 300], [300, 310]]\n"
    "velocities = [[300, 0], [0, 0]]",
    more="seconds = 2\ngravity = [0, 200]",
)
SCENES = {
    "article": (load("article").changed(seconds=3), ["pymunk", "article", "impulse", "exact"]),
    "gas": (load("gas-100").changed(seconds=1), ["pymunk", "article", "exact"]),
    "alone": (load("head-on").changed(seconds=2), ["pymunk"]),
    "at rest": (AT_REST, ["pymunk", "exact"]),
    "spinning": (SPINNING, ["pymunk", "impulse", "exact"]),
}


@pytest.mark.parametrize(("scene", "engines"), SCENES.values(), ids=list(SCENES))
def test_a_comparison_is_as_its_schema_says(scene: Scene, engines: list[str]) -> None:
    schema = read(comparison_schema())
    assert list(errors(read(compare(scene, engines).as_json()), schema, schema)) == []


def test_a_comparison_with_advice_is_as_its_schema_says() -> None:
    scene, schema = load("oblique").changed(seconds=1), read(comparison_schema())
    document = compare(scene, ["pymunk", "exact"]).as_json() | advice_as_json(try_settings(scene, "exact", ()))
    assert document["advice"]
    assert list(errors(read(document), schema, schema)) == []


def test_the_schema_rejects_what_no_comparison_has() -> None:
    schema = read(comparison_schema())
    document = read(compare(load("oblique").changed(seconds=1), ["pymunk", "exact"]).as_json())
    figures = document["engines"]["pymunk"]
    figures["first_difference"] |= {"cause": "magic", "before": [[1, 2, 3]]}
    figures["ledger"]["magic"] = {}
    del figures["gap_max"]
    document["seed"] = 0.5
    paths = [error.partition(":")[0] for error in errors(document, schema, schema)]
    pymunk = ".engines.pymunk"
    assert sorted(paths) == [pymunk, f"{pymunk}.first_difference", f"{pymunk}.ledger.magic", ".seed"]


def board() -> Board:
    """Return a board with each outcome."""
    found = dict(verify([load("oblique"), load("bouncing")], ["exact", "pymunk", "article"]))
    expect = {"at": 1.02, "ball": 0, "velocity": (0, 0), "tolerance": 1, "because": "a wall is between the steps"}
    scene = scene_of("radius = 20\nposition = [680, 100]\nvelocity = [98, 0]").changed(rate=7, expect=[expect])
    found |= verify([scene], ["exact", "pymunk", "article"])
    outcomes = {"exact": Outcome.BROKE, "pymunk": Outcome.NOT_RUN, "article": Outcome.REFUSED}
    found["broken"] = {engine: Result(outcome, message="why") for engine, outcome in outcomes.items()}
    assert {result.outcome for row in found.values() for result in row.values()} == set(Outcome)
    return found


def test_scores_are_as_their_schema_says() -> None:
    schema = read(json_schema(Scores))
    document = read(as_json(board()))
    assert list(errors(document, schema, schema)) == []
    document["scenes"]["oblique"]["exact"]["passed"] = "yes"
    assert len(list(errors(document, schema, schema))) == 1


@pytest.mark.parametrize(
    ("argument", "schema"),
    [("compare", comparison_schema()), ("verify", json_schema(Scores))],
    ids=["compare", "verify"],
)
def test_the_command_prints_the_schema(command: Command, argument: str, schema: dict[str, Any]) -> None:
    code, out, err = command("schema", argument)
    assert (code, json.loads(out), err) == (0, read(schema), "")
    assert command("schema", "scene") == command("schema")
