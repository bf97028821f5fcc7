"""Run one rigid-body scene in several solvers side by side, and see how far they drift apart.

    load        reads a scene: a TOML file, or a bundled scene
    from_space  returns the scene of a live pymunk.Space
    write       writes a scene file
    simulate    runs a scene in one engine, and returns its trajectory
    compare     runs a scene in several engines, and returns how far they are apart, since when, and why
    watch       records what a live pymunk.Space does, and compares it with the exact reference

>>> import sandbox
>>> scene = sandbox.load("article")
>>> sandbox.simulate(scene, "article", seconds=1).position.shape  # steps + 1, balls, x and y
(61, 3, 2)
>>> round(sandbox.compare(scene, ["pymunk", "article"]).runs["article"].figures.energy_ratio, 4)
0.4159
"""

from importlib import import_module
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from sandbox.analysis.comparison import Comparison, compare
    from sandbox.analysis.watch import watch
    from sandbox.engines import Engine
    from sandbox.errors import Refused, SandboxError, SpaceWarning
    from sandbox.run.trajectory import Trajectory, simulate
    from sandbox.scene import Scene, load, write
    from sandbox.scene.from_pymunk import from_space
    from sandbox.state import Contacts, State

__version__ = "0.1.0"

__all__ = [
    "Comparison",
    "Contacts",
    "Engine",
    "Refused",
    "SandboxError",
    "Scene",
    "SpaceWarning",
    "State",
    "Trajectory",
    "__version__",
    "compare",
    "from_space",
    "load",
    "simulate",
    "watch",
    "write",
]

_MODULES: Final = {
    "Comparison": "analysis.comparison",
    "Contacts": "state",
    "Engine": "engines",
    "Refused": "errors",
    "SandboxError": "errors",
    "Scene": "scene",
    "SpaceWarning": "errors",
    "State": "state",
    "Trajectory": "run.trajectory",
    "compare": "analysis.comparison",
    "from_space": "scene.from_pymunk",
    "load": "scene",
    "simulate": "run.trajectory",
    "watch": "analysis.watch",
    "write": "scene",
}


def __dir__() -> list[str]:
    return __all__


if not TYPE_CHECKING:  # with this function, a type checker would accept any name

    def __getattr__(name: str) -> object:
        """Import a public name when it is first used: numba and pydantic are slow to import."""
        if name not in _MODULES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        if _MODULES[name] == "analysis.comparison":
            import_module("sandbox.report.notebook")  # registers how a notebook shows a comparison
        return getattr(import_module(f"sandbox.{_MODULES[name]}"), name)
