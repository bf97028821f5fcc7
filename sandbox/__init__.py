"""Run one rigid-body scene in several solvers side by side, and see how far they drift apart.

    load        reads a scene: a TOML file, or a bundled scene
    from_space  returns the scene of a live pymunk.Space
    to_space    returns the pymunk.Space of a scene
    lint        returns what is wrong in how a live pymunk.Space is set up
    dump        writes a scene file
    simulate    runs a scene in one engine or several, and returns trajectories
    Simulation  runs a scene step by step, in a loop of your own
    compare     runs a scene in several engines, and returns how far they are apart, since when, and why
    advise      tries other settings of Pymunk on a scene, and returns which are better
    verify      scores engines against what scenes expect
    sweep       runs a scene with many seeds, rates, engines and settings, and returns a table
    watch       records what a live pymunk.Space does, and returns what is wrong with it
    scenes      returns the bundled scenes
    engines     returns what each engine supports

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
    from sandbox.engines.engine import Engine, Traits
    from sandbox.engines.support import engines
    from sandbox.errors import Refused, SandboxError, SpaceWarning
    from sandbox.run.trajectory import Trajectory
    from sandbox.scene import Scene, dump, load, scenes
    from sandbox.scripting.calls import advise, compare, simulate, sweep, verify
    from sandbox.scripting.results import Advice, Comparison, Scores, SweepTable
    from sandbox.scripting.simulation import Simulation
    from sandbox.space.findings import Finding
    from sandbox.space.from_pymunk import from_space, to_space
    from sandbox.space.lint import lint
    from sandbox.space.watch import watch
    from sandbox.state import Contacts, State

__version__ = "0.1.0"

__all__ = [
    "Advice",
    "Comparison",
    "Contacts",
    "Engine",
    "Finding",
    "Refused",
    "SandboxError",
    "Scene",
    "Scores",
    "Simulation",
    "SpaceWarning",
    "State",
    "SweepTable",
    "Traits",
    "Trajectory",
    "__version__",
    "advise",
    "compare",
    "dump",
    "engines",
    "from_space",
    "lint",
    "load",
    "scenes",
    "simulate",
    "sweep",
    "to_space",
    "verify",
    "watch",
]

_MODULES: Final = {
    name: module
    for module, names in {
        "engines.engine": "Engine Traits",
        "engines.support": "engines",
        "errors": "Refused SandboxError SpaceWarning",
        "run.trajectory": "Trajectory",
        "scene": "Scene dump load scenes",
        "scripting.calls": "advise compare simulate sweep verify",
        "scripting.results": "Advice Comparison Scores SweepTable",
        "scripting.simulation": "Simulation",
        "space.findings": "Finding",
        "space.from_pymunk": "from_space to_space",
        "space.lint": "lint",
        "space.watch": "watch",
        "state": "Contacts State",
    }.items()
    for name in names.split()
}


def __dir__() -> list[str]:
    return __all__


if not TYPE_CHECKING:  # with this function, a type checker would accept any name

    def __getattr__(name: str) -> object:
        """Import a public name when it is first used: numba and pydantic are slow to import."""
        if name not in _MODULES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return getattr(import_module(f"sandbox.{_MODULES[name]}"), name)
