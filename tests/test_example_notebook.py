"""The example notebook runs from top to bottom, and is stored without outputs."""

import ast
import json
from pathlib import Path
from typing import Any

NOTEBOOK = Path(__file__).parents[1] / "docs" / "examples" / "notebook.ipynb"
CELLS: list[dict[str, Any]] = [
    cell for cell in json.loads(NOTEBOOK.read_text())["cells"] if cell["cell_type"] == "code"
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


def test_it_runs_from_top_to_bottom() -> None:
    names: dict[str, Any] = {"__name__": "__main__"}
    values = [run_cell(code, names) for code in CODE]
    shown = [value._repr_html_() for value in values if hasattr(value, "_repr_html_")]
    assert [text.startswith("<pre>") for text in shown] == [True, True]


def test_it_is_stored_without_outputs() -> None:
    assert len(CELLS) == 6
    assert not any(cell["outputs"] or cell["execution_count"] for cell in CELLS)
