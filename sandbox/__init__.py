"""Run one rigid-body scene in several solvers side by side, and see how far they drift apart.

>>> import sandbox
>>> sandbox.simulate("article", "article", seconds=1).position.shape  # steps + 1, balls, x and y
(61, 3, 2)
>>> comparison = sandbox.compare("article", ["pymunk", "article"])
>>> round(comparison["article"].energy_ratio, 4)
0.4159
"""

from importlib import import_module
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:  # each name as itself, which exports it
    # isort: off
    from sandbox.engines.engine import Engine as Engine, Traits as Traits
    from sandbox.engines.support import engines as engines
    from sandbox.errors import Refused as Refused, SandboxError as SandboxError, SpaceWarning as SpaceWarning
    from sandbox.report.trajectory import Trajectory as Trajectory
    from sandbox.scene import Scene as Scene, dump as dump, load as load, scenes as scenes
    from sandbox.scripting.calls import (
        advise as advise,
        compare as compare,
        converge as converge,
        simulate as simulate,
        sweep as sweep,
        verify as verify,
    )
    from sandbox.scripting.results import (
        Advice as Advice,
        Comparison as Comparison,
        Scores as Scores,
        SweepTable as SweepTable,
    )
    from sandbox.scripting.simulation import Simulation as Simulation
    from sandbox.space.files import load_space as load_space, save_space as save_space
    from sandbox.space.findings import Finding as Finding
    from sandbox.space.from_pymunk import from_space as from_space, to_space as to_space
    from sandbox.space.lint import lint as lint
    from sandbox.space.watch import watch as watch
    from sandbox.sweeps.convergence import Convergence as Convergence
    from sandbox.state import Contacts as Contacts, State as State

__version__ = "0.1.0"

_MODULES: Final = {
    name: module
    for module, names in {
        "engines.engine": "Engine Traits",
        "engines.support": "engines",
        "errors": "Refused SandboxError SpaceWarning",
        "report.trajectory": "Trajectory",
        "scene": "Scene dump load scenes",
        "scripting.calls": "advise compare converge simulate sweep verify",
        "scripting.results": "Advice Comparison Scores SweepTable",
        "scripting.simulation": "Simulation",
        "space.files": "load_space save_space",
        "space.findings": "Finding",
        "space.from_pymunk": "from_space to_space",
        "space.lint": "lint",
        "space.watch": "watch",
        "state": "Contacts State",
        "sweeps.convergence": "Convergence",
    }.items()
    for name in names.split()
}

__all__ = ["__version__", *_MODULES]  # noqa: PLE0604  (all are strings)


def __dir__() -> list[str]:
    return __all__


if not TYPE_CHECKING:  # with this function, a type checker would accept any name

    def __getattr__(name: str) -> object:
        """Import a public name when it is first used: numba and pydantic are slow to import."""
        if name not in _MODULES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return getattr(import_module(f"sandbox.{_MODULES[name]}"), name)
