"""The example notebook runs from top to bottom, its code has types, and it is stored without outputs."""

import ast
import json
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
from conftest import REQUIRED

from sandbox.report import notebook

ROOT = Path(__file__).parent.parent
CELLS: list[dict[str, Any]] = [
    cell
    for cell in json.loads((ROOT / "docs" / "examples" / "notebook.ipynb").read_text())["cells"]
    if cell["cell_type"] == "code"
]
CODE = ["".join(cell["source"]) for cell in CELLS]


def run_cell(code: str, names: dict[str, Any]) -> object:
    """Run a cell as a notebook does, and return the value of its last line."""
    *body, last = ast.parse(code).body
    if not isinstance(last, ast.Expr):
        exec(code, names)
        return None
    exec(compile(ast.Module(body, []), "cell", "exec"), names)
    return eval(compile(ast.Expression(last.value), "cell", "eval"), names)


def test_it_runs_from_top_to_bottom_and_has_bokeh_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(notebook, "_provider", None)
    names: dict[str, Any] = {"__name__": "__main__"}
    values = [run_cell(code, names) for code in CODE]
    pages = [value._repr_html_() for value in values if hasattr(value, "_repr_html_")]
    assert [page.startswith("<script>") for page in pages] == [True, False]
    assert all(len(page) < 1_000_000 for page in pages)


def test_it_is_stored_without_outputs() -> None:
    assert len(CELLS) == 6
    assert not any(cell["outputs"] or cell["execution_count"] for cell in CELLS)


def test_its_code_passes_a_strict_type_checker(tmp_path: Path) -> None:
    if find_spec("mypy") is None:
        (pytest.fail if REQUIRED else pytest.skip)("needs mypy")
    (tmp_path / "notebook.py").write_text("\n".join(CODE))
    cache = ROOT / ".pytest_cache" / "mypy"
    command = [sys.executable, "-m", "mypy", f"--cache-dir={cache}", "--strict", "notebook.py"]
    checked = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert checked.returncode == 0, checked.stdout
