"""Run one rigid-body scene in several solvers side by side, and see how far they drift apart.

    load        reads a scene: a TOML file, or a bundled scene
    from_space  returns the scene of a live pymunk.Space
    lint        returns what is wrong in how a live pymunk.Space is set up
    write       writes a scene file
    simulate    runs a scene in one engine or several, and returns trajectories
    compare     runs a scene in several engines, and returns how far they are apart, since when, and why
    verify      scores engines against what scenes expect
    sweep       runs a scene with many seeds, rates, engines and settings, and returns a table
    watch       records what a live pymunk.Space does, and compares it with the exact reference

>>> import sandbox
>>> sandbox.simulate("article", "article", seconds=1).position.shape  # steps + 1, balls, x and y
(61, 3, 2)
>>> comparison = sandbox.compare("article", ["pymunk", "article"])
>>> round(comparison["article"].energy_ratio, 4)
0.4159
"""

from importlib import import_module
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from sandbox.engines import Engine
    from sandbox.engines.engine import Traits
    from sandbox.errors import Refused, SandboxError, SpaceWarning
    from sandbox.run.trajectory import Trajectory
    from sandbox.scene import Scene, load, write
    from sandbox.scene.from_pymunk import from_space
    from sandbox.scripting.calls import compare, simulate, sweep, verify
    from sandbox.scripting.comparison import Comparison
    from sandbox.scripting.results import Scores, SweepTable
    from sandbox.scripting.watch import watch
    from sandbox.space.findings import Finding
    from sandbox.space.lint import lint
    from sandbox.state import Contacts, State

__version__ = "0.1.0"

__all__ = [
    "Comparison",
    "Contacts",
    "Engine",
    "Finding",
    "Refused",
    "SandboxError",
    "Scene",
    "Scores",
    "SpaceWarning",
    "State",
    "SweepTable",
    "Traits",
    "Trajectory",
    "__version__",
    "compare",
    "from_space",
    "lint",
    "load",
    "simulate",
    "sweep",
    "verify",
    "watch",
    "write",
]

_MODULES: Final = {
    "Comparison": "scripting.comparison",
    "Contacts": "state",
    "Engine": "engines",
    "Finding": "space.findings",
    "Refused": "errors",
    "SandboxError": "errors",
    "Scene": "scene",
    "Scores": "scripting.results",
    "SpaceWarning": "errors",
    "State": "state",
    "SweepTable": "scripting.results",
    "Traits": "engines.engine",
    "Trajectory": "run.trajectory",
    "compare": "scripting.calls",
    "from_space": "scene.from_pymunk",
    "lint": "space.lint",
    "load": "scene",
    "simulate": "scripting.calls",
    "sweep": "scripting.calls",
    "verify": "scripting.calls",
    "watch": "scripting.watch",
    "write": "scene",
}


def __dir__() -> list[str]:
    return __all__


if not TYPE_CHECKING:  # with this function, a type checker would accept any name

    def __getattr__(name: str) -> object:
        """Import a public name when it is first used: numba and pydantic are slow to import."""
        if name not in _MODULES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return getattr(import_module(f"sandbox.{_MODULES[name]}"), name)
