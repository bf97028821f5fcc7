"""Any file loads or is rejected with clear messages: no traceback, never more than 5 s.

`pytest -m slow tests/slow/test_fuzz.py` tries 10,000 scene files and 10,000 input files.
"""

import contextlib
import io
import json
import math
import signal
import tomllib
from collections.abc import Callable, Iterator
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomlkit
from conftest import sizes
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sandbox.cli.options import scene_and_inputs
from sandbox.engines import registry
from sandbox.errors import SandboxError
from sandbox.files import MAX_TEXT_FILE_BYTES
from sandbox.quantity import length
from sandbox.report.trajectory import simulate
from sandbox.run.edits import AddBall, ChangeBall, Edit, SetGravity, SetRate, SetVelocity
from sandbox.run.inputs import INPUT_KINDS, Input, Kick, load_inputs
from sandbox.scene.files import bundled, load, schema
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn, warnings

MAX_CASE_TIME = 5.0  # s of processor time
ENGINES = list(registry())
FILES = [file.read_bytes() for folder in ("", "truths") for file in bundled(folder).values()]

Strategy = st.SearchStrategy[Any]
Document = dict[str, Any]

# --- Documents that a schema allows, and that no schema allows --------------------------------------------------

TEXT = st.text(max_size=20) | st.sampled_from(
    ["\x00", "\x1b[31m", "\u202e", "e\u0301", "\ufeff", "\u0085", "a.b", "=1"]
)
NUMBERS = [0, -1, 1e-300, 1e300, -0.0, 2**31, 2**63, 10**400, float("nan"), float("inf"), True]
WILD = st.recursive(
    st.sampled_from([*NUMBERS, date(1979, 5, 27), "\uff11\uff12"]) | st.floats() | TEXT,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(TEXT, inner, max_size=3),
    max_leaves=5,
)


def within(node: Document, root: Document) -> Strategy:
    """Draw a value that a node of the JSON Schema `root` allows."""
    node = resolved(node, root)
    if kinds := node.get("anyOf", node.get("oneOf")):
        return st.one_of([within(kind, root) for kind in kinds if kind != {"type": "null"}])
    if "const" in node:
        return st.just(node["const"])
    if node["type"] == "object":
        keys = {key: within(inner, root) for key, inner in node["properties"].items()}
        kinds = [key for key, inner in node["properties"].items() if "const" in inner]
        required = {key: keys.pop(key) for key in [*node.get("required", ()), *kinds]}
        return st.fixed_dictionaries(required, optional=keys)
    if "prefixItems" in node:
        return st.tuples(*[within(inner, root) for inner in node["prefixItems"]]).map(list)
    if node["type"] == "array":
        return st.lists(within(node["items"], root), min_size=node.get("minItems", 0), max_size=3)
    return numbers(node) if node["type"] in ("integer", "number") else st.sampled_from(["red", "#0072b2"]) | TEXT


def numbers(node: Document) -> Strategy:
    """Draw an allowed number, small more often than large, so that most documents are valid as a whole."""
    low, high = int(node["minimum"]), int(node.get("maximum", 2**63 - 1))
    if node["type"] == "integer":
        small = st.integers(low, min(high, low + 3))
        return st.one_of(small, small, small, small, st.integers(low, high))
    small = st.one_of(st.integers(0, min(high, 600)), st.floats(0, min(high, 600)))
    return st.one_of(small, small, small, small, st.floats(low, high))


def resolved(node: Document, root: Document) -> Document:
    return root["$defs"][node["$ref"].rsplit("/", 1)[-1]] if "$ref" in node else node


def tables(value: Any) -> Iterator[Document]:
    """Yield each table of a document."""
    if isinstance(value, dict):
        yield value
    for inner in value.values() if isinstance(value, dict) else value if isinstance(value, list) else ():
        yield from tables(inner)


@st.composite
def changed(draw: st.DrawFn, documents: Strategy) -> Document:
    """Draw a document, and set, add or delete up to three keys."""
    document: Document = draw(documents)
    for _ in range(draw(st.integers(0, 3))):
        table = draw(st.sampled_from(list(tables(document))))
        key = draw(st.sampled_from(sorted(table)) | TEXT) if table else draw(TEXT)
        if draw(st.booleans()):
            table[key] = draw(WILD)
        else:
            table.pop(key, None)
    return document


# --- Damaged files ----------------------------------------------------------------------------------------------

SCRAPS = [
    *("\ufeff", "\x00", "\u202e", "\u0301", "\uff11", "\u0085", "\u2028", "\ud800", "\\ud800", "\\U00110000"),
    *("\r", "\r\n", "\r\r\n"),
    *("9" * 5_000, "0x" + "f" * 5_000, "1e999", "-nan", "Infinity", "1979-05-27T07:32:00Z", "1_0", "true", "null"),
    *("[" * 5_000, "{a=" * 5_000, '{"a":' * 5_000, "[[balls]]\n" * 20_000, "[[walls]]\n" * 20_000),
    *('"""', "'''", '"', "#", "=", "\\", "{}", "a = 1\n", "a" * 500_000, "#" * MAX_TEXT_FILE_BYTES),
]
SCRAP_BYTES = [scrap.encode(errors="surrogatepass") for scrap in SCRAPS]


@st.composite
def damaged(draw: st.DrawFn, contents: st.SearchStrategy[bytes]) -> bytes:
    """Draw the content of a file, and flip, cut, double, splice and insert up to three times."""
    content = draw(contents)
    for _ in range(draw(st.sampled_from([0, 0, 0, 1, 2, 3]))):
        at, to = sorted(draw(st.tuples(*[st.integers(0, len(content))] * 2)))
        match draw(st.sampled_from(["flip", "cut", "double", "splice", "insert", "windows"])):
            case "flip":
                content = content[:at] + bytes([draw(st.integers(0, 255))]) + content[at + 1 :]
            case "cut":
                content = content[:at] + content[to:]
            case "double":
                part = content[at : min(to, at + 2_000)]
                content = content[:at] + part * draw(st.sampled_from([2, 3, 1_000])) + content[at:]
            case "splice":
                content = content[:at] + draw(contents)[at:]
            case "insert":
                content = content[:at] + draw(st.sampled_from(SCRAP_BYTES)) + content[at:]
            case "windows":
                content = content.replace(b"\n", b"\r\n")
    return content


def toml(document: Document) -> bytes:
    return tomlkit.dumps(document).encode(errors="surrogatepass")


SCHEMA = schema()
SCENES = st.sampled_from(FILES).map(lambda content: tomllib.loads(content.decode()))
SCENE_FILES = damaged(st.sampled_from(FILES) | changed(SCENES).map(toml) | within(SCHEMA, SCHEMA).map(toml))

KINDS = [kind.model_json_schema() for kind in INPUT_KINDS.values()]


@st.composite
def recordings(draw: st.DrawFn) -> bytes:
    """Draw a file of inputs, many of them in order and some with changed or unknown keys."""
    kinds = draw(st.lists(st.sampled_from(KINDS), max_size=5))
    lines = [draw(changed(within(kind, kind)) if draw(st.booleans()) else within(kind, kind)) for kind in kinds]
    for step, line in enumerate(lines):
        if "step" in line and line.get("do") != "start" and draw(st.booleans()):
            line["step"] = step
    return "".join(json.dumps(line, default=str) + "\n" for line in lines).encode()


RECORDINGS = damaged(recordings())

# --- Loading, checking and running within limits ----------------------------------------------------------------


def run(case: Callable[[], object], *files: Path) -> None:
    """Run a case, which must succeed or raise a clear SandboxError within the time."""

    def too_long(*_: object) -> None:
        raise AssertionError(f"took more than {MAX_CASE_TIME:g} s")

    handler = signal.signal(signal.SIGPROF, too_long)
    signal.setitimer(signal.ITIMER_PROF, MAX_CASE_TIME)
    try:
        case()
    except SandboxError as error:
        assert_clear(str(error), files)
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, handler)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("fuzz")


def assert_clear(message: str, files: tuple[Path, ...]) -> None:
    """Assert that each line of a message is short and printable, and begins with a file or an engine."""
    for line in message.removesuffix("\n").split("\n") if message else ():
        assert line.isprintable()
        file = next((str(one) for one in files if line.startswith(f"{one}:")), "")
        assert file or line.split(":")[0] in ENGINES, line
        assert len(line.removeprefix(file)) < 300


def check(file: Path) -> None:
    """Check a file as `sandbox check` does, and run the scene in all engines if it is small."""
    scene = load(file)
    initial = spawn(scene)
    assert np.isfinite(initial.position).all()
    assert np.isfinite(initial.velocity).all()
    for warning in warnings(scene, initial):
        assert_clear(warning, (file,))
    replay(scene, [])


def replay(scene: Scene, inputs: list[Input]) -> None:
    """Run ten steps, or half a second, in every engine, unless it refuses the scene."""
    if not is_small(scene, inputs):
        return
    steps = min(10, max(1, slowest_rate(scene, inputs) // 2))
    for name in ENGINES:
        with contextlib.suppress(SandboxError):  # an edit may find no room in an engine
            found = simulate(scene, name, steps=steps, inputs=inputs)
            present = ~np.isnan(found.position[:, :, 0])
            assert np.isfinite(found.position[present]).all()
            assert np.isfinite(found.velocity[present]).all()


def slowest_rate(scene: Scene, inputs: list[Input]) -> int:
    return min(one.rate for one in [scene, *inputs] if isinstance(one, Scene | SetRate))


def is_small(scene: Scene, inputs: list[Input]) -> bool:
    """Return whether balls and walls are few, and no ball can cross the arena a thousand times in a step."""
    edits = [one for one in inputs if isinstance(one, Edit)]
    rate = slowest_rate(scene, inputs)
    pull = max(math.hypot(*one.gravity) for one in [scene, *edits] if isinstance(one, Scene | SetGravity))
    speeds = [math.hypot(*one.velocity) for one in inputs if isinstance(one, Kick | SetVelocity | AddBall)]
    speeds += [math.hypot(one.vx or 0, one.vy or 0) for one in edits if isinstance(one, ChangeBall)]
    fastest = max([float(length(spawn(scene).velocity).max()), *speeds]) + 10 * pull / rate
    few = len(scene.bodies) * (1 + len(scene.walls)) * (scene.pymunk.iterations or 10) * scene.pymunk.substeps < 10_000
    return few and fastest < 1_000 * rate * min(scene.arena.size)


FUZZ = settings(suppress_health_check=list(HealthCheck))


@pytest.mark.parametrize("cases", sizes(50, slow=10_000))
def test_every_scene_file_loads_or_is_rejected(folder: Path, cases: int) -> None:
    @settings(FUZZ, max_examples=cases)
    @given(SCENE_FILES)
    def every_file(content: bytes) -> None:
        file = folder / "mine.toml"
        file.write_bytes(content)
        run(lambda: check(file), file)

    every_file()


@pytest.mark.parametrize("cases", sizes(50, slow=10_000))
def test_every_inputs_file_loads_or_is_rejected(folder: Path, cases: int) -> None:
    @settings(FUZZ, max_examples=cases)
    @given(st.sampled_from(["article", "funnel", "newtons-cradle", "truths/chain-of-five"]), RECORDINGS)
    def every_file(name: str, content: bytes) -> None:
        file = folder / "mine.jsonl"
        file.write_bytes(content)

        def read_and_replay() -> None:
            with contextlib.redirect_stderr(io.StringIO()) as stderr:
                scene, inputs = scene_and_inputs(name, file)
            assert_clear(stderr.getvalue(), (file, scene.file))
            replay(scene, list(inputs))

        run(read_and_replay, file)

    every_file()


# --- Files made to take long ------------------------------------------------------------------------------------

ARENA = "[arena]\nsize = [800, 600]\n"
BALL = "[[balls]]\nradius = 5\nposition = [100, 100]\n"
CROWD = "[[balls]]\nradius = {}\ncount = 100000\n{}"
ANYWHERE = "x = {{ from = {0}, to = {0} }}\ny = {{ from = 300, to = 300 }}\n"
TRAPS = {
    "empty-groups": ARENA + "[[balls]]\n" * 20_000,
    "unknown-keys": ARENA + BALL + "".join(f"radios{k} = 1\n" for k in range(20_000)),
    "unknown-colours": ARENA + BALL + "colors = [" + '"redd", ' * 50_000 + "]",
    "blank-lines": ARENA + "\n" * 1_000_000 + BALL,
    "carriage-returns": "\r" * 1_000_000,
    "quotes": 'a = """\n' + '\\"""\n' * 100_000,
    "expectations": ARENA + BALL + '[[expect]]\nat = 1\nenergy_ratio = 1\ntolerance = 1\nbecause = "it"\n' * 5_000,
    "crowd-at-random": ARENA + CROWD.format(0.5, "inside = [[0, 0], [800, 600]]\n"),
    "crowd-on-one-spot": ARENA + CROWD.format(5, ANYWHERE.format(400)),
    "crowd-beside-one": f"{ARENA}[[balls]]\nradius = 200\nposition = [400, 300]\n"
    + CROWD.format(1e-6, "x = { from = 1, to = 799 }\ny = { from = 1, to = 99 }\n"),
}


@pytest.mark.wide
@pytest.mark.parametrize("content", TRAPS.values(), ids=TRAPS)
def test_a_file_made_to_take_long_does_not(folder: Path, content: str) -> None:
    file = folder / "mine.toml"
    file.write_text(content, newline="")
    run(lambda: check(file), file)


def test_a_million_errors_in_inputs_do_not_take_long(folder: Path) -> None:
    file = folder / "mine.jsonl"
    file.write_text("x\n" * 900_000)
    run(lambda: load_inputs(file, load("article")), file)
