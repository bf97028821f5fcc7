"""Imports run one way, and the libraries stay where they belong."""

import ast
from pathlib import Path

import pytest

import sandbox
from sandbox.engines import registry

ROOT = Path(sandbox.__file__).parent
LAYERS = (  # each may import from those before it, and from its own
    ("plaintext", "mistakes", "output", "ending", "state", "clock"),
    ("scene",),
    ("quantity", "edits"),
    ("inputs",),
    ("gas",),
    ("crowd",),
    ("spawn",),
    ("engines",),
    ("trajectory", "truth", "ledger"),
    ("difference", "memory", "yardstick"),
    ("marks",),
    ("comparison", "verdict", "report", "session"),
    ("verify", "sweep"),
    ("sweep_report",),
    ("view",),
    ("bench",),
    ("tables",),
    ("cli",),
    ("__main__",),
)
BESIDE = ("bench.plain", "bench.window")  # what the sandbox is measured beside is plain Pymunk and pygame
RANK = {name: rank for rank, layer in enumerate(LAYERS) for name in layer}
MODULES = {
    ".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): file
    for file in sorted(ROOT.rglob("*.py"))
    if file != ROOT / "__init__.py"
}


def imported(file: Path) -> set[str]:
    """Return the full names of the modules that a file imports, wherever in it."""
    names = set()
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}: relative import"
            names.add(str(node.module))
    return names


def test_every_module_has_its_layer() -> None:
    assert {name.split(".")[0] for name in MODULES} == set(RANK)


@pytest.mark.parametrize("module", MODULES)
def test_imports_run_one_way(module: str) -> None:
    own = module.split(".", maxsplit=1)[0]
    for name in imported(MODULES[module]):
        if name.startswith("sandbox."):
            other = name.split(".")[1]
            assert RANK[other] <= RANK[own], f"{module} imports {name}"


@pytest.mark.parametrize("module", [name for name in MODULES if name.startswith("engines.")])
def test_engines_do_not_import_each_other(module: str) -> None:
    engines = {entry.module for entry in registry().values()}
    assert not imported(MODULES[module]) & engines


@pytest.mark.parametrize("module", MODULES)
def test_a_library_is_its_engine_s_and_pygame_the_view_s(module: str) -> None:
    libraries = {name.split(".")[0] for name in imported(MODULES[module])}
    assert "pygame" not in libraries or module.startswith("view.") or module in BESIDE
    assert "pymunk" not in libraries or module in ("engines.pymunk", "view.debug_draw", *BESIDE)
    assert "pyb2d3" not in libraries or module == "engines.box2d"
