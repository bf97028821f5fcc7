"""A rigid-body sandbox: several solvers run one scene side by side, and you see how far they are apart.

>>> import sandbox
>>> scene = sandbox.load("article")
>>> sandbox.simulate(scene, "article", seconds=1).position.shape  # steps + 1, balls, x and y
(61, 3, 2)
>>> round(sandbox.compare(scene, ["pymunk", "article"]).runs["article"].figures.energy_ratio, 4)
0.4159
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sandbox.analysis.comparison import Comparison, compare
    from sandbox.errors import SandboxError
    from sandbox.run.trajectory import Trajectory, simulate
    from sandbox.scene import Scene, load

__all__ = ["Comparison", "SandboxError", "Scene", "Trajectory", "compare", "load", "simulate"]

_HOME = {
    "Comparison": "analysis.comparison",
    "SandboxError": "errors",
    "Scene": "scene",
    "Trajectory": "run.trajectory",
    "compare": "analysis.comparison",
    "load": "scene",
    "simulate": "run.trajectory",
}


def __getattr__(name: str) -> object:
    """Import a name of the surface when it is first used: numba and pydantic are slow to import."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    if _HOME[name] == "analysis.comparison":
        import_module("sandbox.report.notebook")  # registers how a notebook shows a comparison
    return getattr(import_module(f"sandbox.{_HOME[name]}"), name)
