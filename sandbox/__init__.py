"""A rigid-body sandbox: several solvers run one scene side by side, and are told how far they are apart.

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
    from sandbox.comparison import Comparison, compare
    from sandbox.mistakes import Mistake
    from sandbox.scene import Scene, load
    from sandbox.trajectory import Trajectory, simulate

__all__ = ["Comparison", "Mistake", "Scene", "Trajectory", "compare", "load", "simulate"]

_HOME = {
    "Comparison": "comparison",
    "Mistake": "mistakes",
    "Scene": "scene",
    "Trajectory": "trajectory",
    "compare": "comparison",
    "load": "scene",
    "simulate": "trajectory",
}


def __getattr__(name: str) -> object:
    """Import a name of the surface when it is first used: numba and pydantic are slow to import."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"sandbox.{_HOME[name]}"), name)
