"""A scene that a program runs step by step: a game draws its balls, and kicks or drags them between the steps."""

from collections.abc import Iterable

from sandbox.engines import Source
from sandbox.errors import SandboxError, shown
from sandbox.run.inputs import Grab, Input, Kick, Move, Release, Start
from sandbox.run.lockstep import Lockstep
from sandbox.scene.model import Scene
from sandbox.scripting.arguments import AnyScene, plain, replay
from sandbox.state import Contacts, State, no_contacts


class Simulation:
    """A scene in one engine, step by step: to the bit what `simulate` does, and what the window does underneath.

    scene: a Scene, the name of a bundled scene, or a file; engine: a name such as "pymunk", a class or a function, as
    in `simulate`; seed, rate: by default the scene's.
    Raises SandboxError if an argument is wrong, Refused if the engine cannot run the scene.

    >>> simulation = Simulation("oblique", "pymunk")
    >>> simulation.kick(0, (0, -60))
    >>> for _ in range(30):
    ...     simulation.step()
    >>> simulation.state.time, simulation.state.velocity[0]
    (0.5, array([200., -60.]))
    """

    def __init__(self, scene: AnyScene, engine: Source, *, seed: int | None = None, rate: int | None = None) -> None:
        if not isinstance(engine, str) and not callable(engine):
            raise SandboxError(f"engine must be a name, a class or a function, got {shown(engine)}")
        self._lockstep = Lockstep(replay(scene, None, seed=seed, rate=rate)[0], engine)
        [self._runner] = self._lockstep.engines.values()
        self._runner.record_contacts()
        self._contacts = no_contacts()

    @property
    def scene(self) -> Scene:
        """The scene: `scene.bodies.radius` and `scene.colors` are what a program draws balls with."""
        return self._lockstep.scene

    @property
    def state(self) -> State:
        """A snapshot of the balls now, which later steps do not change."""
        return self._runner.state()

    @property
    def contacts(self) -> Contacts:
        """The contacts of the last step, by time: (k,) of CONTACT."""
        return self._contacts

    @property
    def inputs(self) -> list[Input]:
        """What was given so far, as `simulate` and `compare` accept it, to replay this run in any engine."""
        scene = self.scene
        return [Start(scene=scene.name, seed=scene.seed, rate=scene.rate), *self._lockstep.given]

    def step(self) -> None:
        """Advance by one step of 1/rate seconds.

        Raises a SandboxError: EngineError if an engine of your own fails, LimitReached if the engine ends early.
        """
        self._lockstep.step()
        self._contacts = self._runner.contacts()

    def kick(self, ball: int, dv: Iterable[float]) -> None:
        """Add dv (px/s) to a ball's velocity, before the next step. Raises SandboxError if there is no such ball."""
        self._lockstep.apply(Kick(step=self._lockstep.steps, ball=plain(ball), velocity=plain(dv)))

    def grab(self, ball: int, at: Iterable[float]) -> None:
        """Let the mouse grab a ball, and pull it to a point (px). Raises SandboxError if there is no such ball."""
        self._lockstep.apply(Grab(step=self._lockstep.steps, ball=plain(ball), at=plain(at)))

    def move(self, at: Iterable[float]) -> None:
        """Pull the grabbed ball to another point (px); without one, do nothing."""
        given = Move(step=self._lockstep.steps, at=plain(at))
        if self._lockstep.mouse.ball is not None:
            self._lockstep.apply(given)

    def release(self) -> None:
        """Let go of the grabbed ball; without one, do nothing."""
        if self._lockstep.mouse.ball is not None:
            self._lockstep.apply(Release(step=self._lockstep.steps))
