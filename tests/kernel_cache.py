"""A folder for numba's compiled kernels that is named after their sources, so that no test runs a stale one.

Numba compiles a kernel anew after an edit to its own file only, not after one to a kernel or a constant that it uses
from another.
"""

import ast
import hashlib
import multiprocessing
import re
import shutil
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from operator import call
from pathlib import Path

import sandbox

ROOT = Path(sandbox.__file__).parent
CACHE = Path(__file__).parents[1] / ".pytest_cache" / "kernels"
COMPILES = re.compile(r"^from (?:numba|sandbox\.compiled) import .*\b(?:njit|kernel|entry)\b", re.MULTILINE)
IMPORTS = re.compile(r"^from (sandbox[\w.]*) import", re.MULTILINE)


@cache
def folder() -> Path:
    """Return the folder for the kernels of these sources, and remove those of earlier ones."""
    current = CACHE / digest(kernel_sources(ROOT))
    for other in CACHE.glob("*"):
        if other != current:
            shutil.rmtree(other, ignore_errors=True)
    return current


def fill() -> None:
    """Compile all kernels into the folder, in two processes, unless this has been done."""
    from sandbox.view.compilation import COMPUTATION, DRAWING  # it imports numba, which reads where its cache is

    done = folder() / "filled"  # numba makes the folder as soon as it is imported
    if done.exists():
        return
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as pool:
        list(pool.map(call, (part.compile for part in (*COMPUTATION, DRAWING))))
    done.touch()


def kernel_sources(package: Path) -> list[Path]:
    """List a package's files that contain kernels, and those that they import names from."""
    texts = {file: file.read_text("utf-8") for file in package.rglob("*.py")}
    kernels = {file: text for file, text in texts.items() if COMPILES.search(text)}
    names = {name for text in kernels.values() for name in IMPORTS.findall(text)}
    imported = {package.parent.joinpath(*name.split(".")).with_suffix(".py") for name in names}
    return sorted({*kernels, *imported & {*texts}})


def digest(files: Iterable[Path]) -> str:
    """Hash the code of files: neither comments nor docstrings are part of it."""
    code = hashlib.sha256()
    for file in files:
        tree = ast.parse(file.read_bytes())
        for node in ast.walk(tree):
            if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
                node.value = ast.Constant(None)
        code.update(ast.dump(tree).encode())
    return code.hexdigest()[:16]
