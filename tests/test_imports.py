"""Imports run one way, and the libraries stay where they belong."""

import ast
import re
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import sandbox
from sandbox.engines import registry

ROOT = Path(sandbox.__file__).parent
LAYOUT = (ROOT.parent / "docs" / "developing.md").read_text()
ORDER = re.findall(r"^  (\w+)(?:\.py|/) ", LAYOUT, re.MULTILINE)  # each may import those before it, and itself
BESIDE = ("bench.plain", "bench.window")  # what the sandbox is measured beside is plain Pymunk and pygame
MODULES = {
    ".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): file
    for file in sorted(ROOT.rglob("*.py"))
    if file.parent != ROOT or not file.name.startswith("__")
}


def imported(file: Path) -> set[str]:
    """Return the full names of all modules that a file imports, at its top or within a function."""
    names = set()
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}: relative import"
            names |= {str(node.module), *(f"{node.module}.{alias.name}" for alias in node.names)}
    return names


def of_the_sandbox(module: str) -> set[str]:
    """Return which modules of the sandbox a module of it imports."""
    return {name.removeprefix("sandbox.") for name in imported(MODULES[module])} & set(MODULES)


def top(module: str) -> str:
    return module.split(".", maxsplit=1)[0]


def test_the_documented_order_names_every_entry() -> None:
    assert len(ORDER) == len(set(ORDER))
    assert {top(module) for module in MODULES} == set(ORDER)


@pytest.mark.parametrize("module", MODULES)
def test_imports_run_one_way(module: str) -> None:
    for other in of_the_sandbox(module):
        assert ORDER.index(top(other)) <= ORDER.index(top(module)), f"{module} imports {other}"


def test_no_module_imports_itself_through_others() -> None:
    TopologicalSorter({module: of_the_sandbox(module) - {module} for module in MODULES}).prepare()


@pytest.mark.parametrize("module", [name for name in MODULES if name.startswith("engines.")])
def test_engines_do_not_import_each_other(module: str) -> None:
    engines = {entry.module.removeprefix("sandbox.") for entry in registry().values()}
    own = next((engine for engine in engines if module == engine or module.startswith(f"{engine}.")), "")
    for other in engines - {own}:
        assert not {one for one in of_the_sandbox(module) if one == other or one.startswith(f"{other}.")}


@pytest.mark.parametrize("module", MODULES)
def test_a_library_is_its_engine_s_and_pygame_the_view_s(module: str) -> None:
    libraries = {name.split(".")[0] for name in imported(MODULES[module])}
    assert "pygame" not in libraries or module.startswith("view.") or module in BESIDE
    assert "pymunk" not in libraries or module in ("engines.pymunk", "view.debug_draw", *BESIDE)
    assert "pyb2d3" not in libraries or module == "engines.box2d"
