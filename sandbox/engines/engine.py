"""The interface of an engine: one solver running one scene."""

from typing import Protocol, cast

from sandbox.scene.fields import Vector
from sandbox.state import Contacts, Floats, State, States


class Engine(Protocol):
    """One solver running one scene. The same scene and kicks give the same bytes, in any process on one machine.

    A solver that resolves all contacts of one time together, not one after another, sets `together = True` on its
    class: the ledger then judges each contact by the velocities after all of them.

    A solver that reports no impulses, so that those of its contacts are inferred from the changes of velocity, sets
    `infers_impulses = True`: they are then no evidence of where its momentum went.

    A solver that limits friction by the impulse without restitution sets `clamps_friction_early = True`: the sentence
    on a contact with just that much friction says why it is too little.

    A solver whose contacts last several steps, as springs do, sets `soft = True`: its contacts are not judged one by
    one.

    A solver that damps velocities and spins in flight, as Pymunk does if a scene asks for it, has that as `damping`.

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


def advance(engine: Engine, states: States) -> None:
    """Do as many steps as there are rows, and write the state after each into them, in any engine."""
    steps = len(states.position)
    if hasattr(engine, "advance"):
        cast("BlockEngine", engine).advance(steps, *states)
        return
    for step in range(steps):
        engine.step()
        states.fill(step, engine.state())
