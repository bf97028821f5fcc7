"""The interface of an engine: one solver running one scene."""

from dataclasses import dataclass, replace
from typing import Protocol

from sandbox.errors import SandboxError, shown
from sandbox.scene.fields import Vector
from sandbox.state import NO_DAMPING, Contacts, Damping, State, States
from sandbox.text import counted


@dataclass(frozen=True)
class Traits:
    """How an engine is to be judged, and what it can do. Raises SandboxError for a value of another type.

    damping: how it damps velocities and spins in flight, as Pymunk does if a scene asks for it.
    soft: whether its contacts last several steps, as springs do: they are not judged one by one.
    reports_contacts: whether it reports contacts, and not states only; False without a method `contacts`.
    can_be_dragged: whether the mouse can drag its balls; False without a method `kick`.
    """

    damping: Damping = NO_DAMPING
    soft: bool = False
    reports_contacts: bool = True
    can_be_dragged: bool = True

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if name != "damping" and not isinstance(value, bool):
                raise SandboxError(f"Traits: {name} must be True or False, got {shown(value)}")
        if not isinstance(self.damping, Damping):
            raise SandboxError(f"Traits: damping must be a sandbox.state.Damping, got {shown(self.damping)}")


class Engine(Protocol):
    """One solver running one scene: all that an engine of your own must have.

    The same scene and kicks give the same bytes, in any process on one machine. An engine may declare `traits`, such as
    `traits = Traits(soft=True)` on its class, and have methods of `RunningEngine`. With a static method `check(scene)`,
    which raises Refused if the engine cannot run a scene, it need not be built for that.
    """

    def step(self) -> None:
        """Advance by one step of 1/rate seconds."""

    def state(self) -> State:
        """Return a snapshot, which later steps do not change."""

    def __repr__(self) -> str:
        state = self.state()
        return f"<{type(self).__name__}: {counted(len(state.position), 'ball')} at {state.time:.4g} s>"


class RunningEngine(Engine, Protocol):
    """An engine as the sandbox runs it, which also reports its contacts and takes kicks."""

    def contacts(self) -> Contacts:
        """Return the contacts resolved since the last call, by time; at equal times, in the order they were resolved.

        `record_contacts` must have been called.
        """

    def record_contacts(self) -> None:
        """Start to record contacts; a run whose contacts are not recorded does not pay for them."""

    def kick(self, ball: int, dv: Vector) -> None:
        """Add dv (px/s) to a ball's velocity."""


class SubsteppingEngine(RunningEngine, Protocol):
    """An engine whose steps have substeps, each of which is judged as a step of its own: its damping says how many."""

    def substates(self) -> States:
        """Return the states after each substep since the last call, oldest first; the first call starts recording."""


def traits_of(engine: RunningEngine) -> Traits:
    """Return the traits of an engine: what it declares, without what it has no method for."""
    traits = getattr(engine, "traits", Traits())
    return replace(
        traits,
        reports_contacts=traits.reports_contacts and callable(getattr(engine, "contacts", None)),
        can_be_dragged=traits.can_be_dragged and callable(getattr(engine, "kick", None)),
    )


def advance(engine: RunningEngine, states: States) -> None:
    """Do as many steps as there are rows, and write the state after each into them; angles and spins are zeros so far.

    An engine with a method `advance(steps, position, velocity, angle, spin)` does so in one call. States and contacts
    are to the byte those of as many calls of `step`, `state` and `contacts`.
    """
    steps = len(states.position)
    if in_one_call := getattr(engine, "advance", None):
        in_one_call(steps, *states)
        return
    for step in range(steps):
        engine.step()
        states.fill(step, engine.state())
