"""Imports run one way, and each library is imported only where the table below allows it."""

import ast
import re
import subprocess
import sys
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path
from typing import Final

import pytest

import sandbox
from sandbox.engines import registry

ROOT: Final = Path(sandbox.__file__).parent
LAYOUT: Final = (ROOT.parent / "docs" / "developing.md").read_text().partition("\nsandbox/")[2].partition("```")[0]
SHARED: Final = re.findall(r"\w+", re.findall(r"^  \*\.py .*  (.*): ", LAYOUT, re.MULTILINE)[0])
ORDER: Final = SHARED + re.findall(r"^  (\w+)/ ", LAYOUT, re.MULTILINE)  # each may import itself and those above it
MODULES: Final = {
    ".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): file
    for file in sorted(ROOT.rglob("*.py"))
    if file.parent != ROOT or not file.name.startswith("__")
}
PLAIN: Final = ("bench.engines", "bench.window")  # benchmarks of plain Pymunk and pygame, for comparison
LIBRARIES: Final = {  # library -> the modules and folders that may import it; numpy is imported everywhere
    "pydantic": ("scene", "run", "space", "view"),
    "pydantic_core": ("scene",),
    "tomlkit": ("scene.files",),
    "PIL": ("scene", "view"),
    "numba": ("compiled",),
    "pymunk": ("engines.pymunk", "engines.space_reader", "space", "view.debug_draw", *PLAIN),
    "pyb2d3": ("engines.box2d",),
    "distributed": ("sweeps.workers",),
    "bokeh": ("report",),
    "jinja2": ("report",),
    "pygame": ("view", "bench.window", "scripting.program"),
    "av": ("view",),
    "rich": ("cli", "report"),
    "typer": ("cli",),
}


@cache
def imported(file: Path) -> set[str]:
    """Return the full names that a file imports, at its top or within a function."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}: relative import"
            members = {f"{node.module}.{alias.name}" for alias in node.names}
            is_of_modules = {name.removeprefix("sandbox.") for name in members} <= MODULES.keys()
            names |= members | (set() if is_of_modules else {str(node.module)})
        elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith("import_module"):
            names |= {str(argument.value) for argument in node.args if isinstance(argument, ast.Constant)}
    return names


def of_the_sandbox(module: str) -> set[str]:
    """Return the sandbox's modules that one of them imports."""
    return {name.removeprefix("sandbox.") for name in imported(MODULES[module])} & set(MODULES)


def top(module: str) -> str:
    return module.split(".", maxsplit=1)[0]


def is_within(module: str, place: str) -> bool:
    """Return whether a module is a place, or in that folder."""
    return module == place or module.startswith(f"{place}.")


def test_the_documented_order_names_every_entry() -> None:
    assert len(ORDER) == len(set(ORDER))
    assert {top(module) for module in MODULES} == set(ORDER)


def test_imports_run_one_way() -> None:
    for module in MODULES:
        for other in of_the_sandbox(module):
            assert ORDER.index(top(other)) <= ORDER.index(top(module)), f"{module} imports {other}"


def test_only_the_last_folder_imports_from_the_package_s_surface() -> None:
    """The surface loads names from any folder, so importing it elsewhere would hide an upward import."""
    for module in MODULES:
        assert top(module) == ORDER[-1] or "sandbox" not in imported(MODULES[module]), module


def test_the_room_of_spaces_is_imported_by_its_commands_only() -> None:
    allowed = {"cli.commands", "cli.diagnoses", "scripting.program", "scripting.tries", "scripting.watchdog"}
    for module in MODULES:
        imports = {other for other in of_the_sandbox(module) if is_within(other, "space")}
        assert not imports or is_within(module, "space") or module in allowed, f"{module} imports {imports}"


def test_no_module_imports_itself_through_others() -> None:
    TopologicalSorter({module: of_the_sandbox(module) - {module} for module in MODULES}).prepare()


def test_engines_do_not_import_each_other() -> None:
    engines = {entry.module.removeprefix("sandbox.") for entry in registry().values()}
    for module in (name for name in MODULES if is_within(name, "engines")):
        for engine in engines:
            others = of_the_sandbox(module) if not is_within(module, engine) else set()
            assert not any(is_within(other, engine) for other in others), f"{module} imports {engine}"


def test_a_library_is_imported_only_where_the_table_allows() -> None:
    for module, file in MODULES.items():
        libraries = {top(name) for name in imported(file)} - sys.stdlib_module_names
        for library in libraries - {"sandbox", "numpy"}:
            assert any(is_within(module, place) for place in LIBRARIES.get(library, ())), f"{module} imports {library}"


@pytest.mark.parametrize(
    ("module", "allowed"),
    [
        ("sandbox", set()),
        ("sandbox.cli.commands", {"typer", "rich"}),
        ("sandbox.analysis.comparison", {"numpy", "pydantic", "pydantic_core", "tomlkit", "PIL"}),
    ],
    ids=["surface", "command line", "comparison"],
)
def test_heavy_libraries_are_loaded_only_when_needed(module: str, allowed: set[str]) -> None:
    program = f"import sys, {module}; print(*{{name.split('.')[0] for name in sys.modules}})"
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert set(ran.stdout.split()) & {*LIBRARIES, "numpy"} <= allowed


@pytest.mark.wide
@pytest.mark.parametrize("command", ["check article", "schema", "scenes", "--help", "--version"])
def test_commands_that_run_nothing_need_neither_a_compiler_nor_an_engine(command: str) -> None:
    program = "import atexit, sys; atexit.register(lambda: print(*sys.modules, file=sys.stderr))"
    program += f"; sys.argv[1:] = {command.split()}; from sandbox.cli import main; main()"
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    loaded = set(ran.stderr.split())
    assert "sandbox.cli.commands" in loaded
    assert loaded.isdisjoint({"numba", "llvmlite", "pymunk", "pygame", "bokeh"})
