"""Watching a live `pymunk.Space`: its steps are recorded beside its own program, and then diagnosed and compared."""

from functools import cached_property, partial
from types import TracebackType
from typing import Any, Self
from unittest.mock import patch
from warnings import warn

import pymunk

from sandbox.errors import SandboxError, SpaceWarning
from sandbox.run.trajectory import Trajectory
from sandbox.scene.fields import Vector
from sandbox.scene.model import Arena, Scene
from sandbox.scripting.comparison import Comparison
from sandbox.scripting.diagnosis import Diagnosis
from sandbox.scripting.exact import AgainstExact
from sandbox.scripting.trial import Trial
from sandbox.space.contents import Origins
from sandbox.space.findings import Finding
from sandbox.text import DEFAULT_WIDTH, json_text


def watch(space: pymunk.Space, *, size: Vector | None = None, title: str = "") -> "Watched":
    """Record what the steps of a Space do; afterwards, find what is wrong with it, and compare it with a reference.

    size: width and height of the view, px, as in `from_space`. Raises SandboxError if an argument is wrong.

    >>> space = pymunk.Space()
    >>> body = pymunk.Body(1, 10)
    >>> space.add(body, pymunk.Poly.create_box(body, (20, 20)))
    >>> with watch(space) as watched:
    ...     for _ in range(60):
    ...         space.step(1 / 60)
    >>> [finding.rule for finding in watched.findings]
    ['moment']
    """
    if not isinstance(space, pymunk.Space):
        raise SandboxError(f"space must be a pymunk.Space, got {type(space).__name__}")
    arena = Arena(size=size or (1, 1), walls=False)
    Scene(title=title, arena=arena, balls=[{"radius": 1, "position": (0, 0)}])  # raises if one of them is wrong
    return Watched(space, size, title)


class Watched:
    """Records the steps of a Space: of `Space.step` within a `with` block, or of its own `step`.

    What `sandbox watch` prints and writes is its `table` and `to_json`.
    """

    def __init__(self, space: pymunk.Space, size: Vector | None, title: str) -> None:
        self._space, self._origins = space, Origins()
        self._trial = Trial(space, self._origins, space.step)
        self._size, self._title = size, title
        self._has_warned = False

    def __enter__(self) -> Self:
        self._patch = patch.multiple(self._space, step=self.step, add=partial(self._add, self._space.add))
        self._patch.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._patch.stop()

    def step(self, dt: float) -> None:
        """Call `Space.step`, and record what it does. dt: s; a step of 0 s, which does nothing, does not count."""
        for name in ("diagnosis", "against_exact"):
            vars(self).pop(name, None)
        self._has_warned = False
        self._trial.step(dt)

    def _add(self, add: Any, *objects: Any) -> None:
        add(*objects)
        self._origins.remember(objects)
        self._trial.changed = True

    @cached_property
    def diagnosis(self) -> Diagnosis:
        """All that was recorded so far, made when it is first asked for."""
        return self._trial.diagnosis(1, self.against_exact)

    @cached_property
    def against_exact(self) -> AgainstExact:
        """The comparison with `exact`, or the reason why it is impossible; computed on first use."""
        return AgainstExact(self._trial.recording, self._size, self._title)

    @property
    def findings(self) -> list[Finding]:
        """What is wrong with the Space and its steps, worst first."""
        return list(self.diagnosis.findings)

    @property
    def comparison(self) -> Comparison:
        """The recorded run, as the engine `space`, compared with `exact`; of the longest part, if there are several.

        Raises SandboxError if `exact` cannot run the Space, for instance one with polygons or joints. `table` compares
        such a Space with itself in finer steps.
        """
        against = self.against_exact
        if against.comparison is None:
            raise SandboxError(f"there is nothing to compare: {against.why_not}")
        if not self._has_warned:
            self._has_warned = True
            for note in against.notes():
                warn(note, SpaceWarning, stacklevel=2)
        return against.comparison

    @property
    def trajectory(self) -> Trajectory:
        """The recorded run, of the longest part if there are several; its times count from the first step of all.

        Raises SandboxError as `comparison` does.
        """
        against = self.against_exact
        if against.trajectory is None:
            raise SandboxError(f"there is nothing to return: {against.why_not}")
        for note in against.notes("the trajectory"):
            warn(note, SpaceWarning, stacklevel=2)
        return against.trajectory

    def table(self, width: int = DEFAULT_WIDTH) -> str:
        """Return the text that `sandbox watch` prints, in so many columns."""
        return "\n".join(self.diagnosis.lines(width))

    def to_json(self) -> str:
        """Return what `sandbox watch --json` writes about the Space."""
        return json_text(self.diagnosis.as_json())
