"""The interface of an engine: one solver running one scene."""

from dataclasses import dataclass, fields
from typing import Any, Protocol, cast

from sandbox.scene.fields import Vector
from sandbox.state import NO_DAMPING, Contacts, Damping, Floats, State, States


@dataclass(frozen=True)
class Traits:
    """How an engine is to be judged, and what it can do.

    together: whether it resolves all contacts of one time together, not one after another: each then acts on the
    velocities before all of them.
    damping: how it damps velocities and spins in flight, as Pymunk does if a scene asks for it.
    soft: whether its contacts last several steps, as springs do: they are not judged one by one.
    reports_contacts: whether it reports contacts, and not states only.
    can_be_dragged: whether the mouse can drag its balls.
    """

    together: bool = False
    damping: Damping = NO_DAMPING
    soft: bool = False
    reports_contacts: bool = True
    can_be_dragged: bool = True


class Engine(Protocol):
    """One solver running one scene. The same scene and kicks give the same bytes, in any process on one machine.

    It declares its traits by attributes of their names, such as `together = True` on its class; see `Traits`.

    An engine that refuses scenes may have a static method `check(scene)` that raises Refused. It saves building the
    engine to find out, which takes a second for many balls.
    """

    def step(self) -> None:
        """Advance by one step of 1/rate seconds."""

    def state(self) -> State:
        """Return a snapshot, which later steps do not change."""

    def contacts(self) -> Contacts:
        """Return the contacts resolved since the last call, by time; at equal times, in the order they were resolved.

        The first call returns none and starts recording; a run whose contacts are never read does not pay for them.
        """

    def kick(self, ball: int, dv: Vector) -> None:
        """Add dv (px/s) to a ball's velocity."""


class BlockEngine(Engine, Protocol):
    """An engine that can also do many steps in one call, which saves the time to return each state."""

    def advance(self, steps: int, position: Floats, velocity: Floats, angle: Floats, spin: Floats) -> None:
        """Do some steps, and write the state after each into the rows of arrays.

        position, velocity: (steps, n, 2) px, px/s; angle, spin: (steps, n) rad, rad/s, zeros until then. States and
        contacts are to the byte those of as many calls of `step`, `state` and `contacts`.
        """


class SubsteppingEngine(Engine, Protocol):
    """An engine whose steps have substeps, each of which is judged as a step of its own: its damping says how many."""

    def substates(self) -> States:
        """Return the states after each substep since the last call, oldest first; the first call starts recording."""


def traits_of(engine: Engine) -> Traits:
    """Return the traits that an engine declares; a wrapper has those of the engine inside as `traits`."""
    own = getattr(engine, "traits", None)
    if isinstance(own, Traits):
        return own
    declared: dict[str, Any] = {trait.name: getattr(engine, trait.name, trait.default) for trait in fields(Traits)}
    declared["reports_contacts"] = callable(getattr(engine, "contacts", None))
    declared["can_be_dragged"] = callable(getattr(engine, "kick", None))
    return Traits(**declared)


def advance(engine: Engine, states: States) -> None:
    """Do as many steps as there are rows, and write the state after each into them, in any engine."""
    steps = len(states.position)
    if hasattr(engine, "advance"):
        cast("BlockEngine", engine).advance(steps, *states)
        return
    for step in range(steps):
        engine.step()
        states.fill(step, engine.state())
