"""Watching a live `pymunk.Space`: its steps are recorded beside its own program, and then diagnosed."""

from functools import cached_property, partial
from types import TracebackType
from typing import Any, Self
from unittest.mock import patch

import pymunk

from sandbox.errors import SandboxError
from sandbox.space.contents import Origins
from sandbox.space.diagnosis import Diagnosis
from sandbox.space.findings import Finding
from sandbox.space.trial import Trial
from sandbox.text import DEFAULT_WIDTH, json_text


def watch(space: pymunk.Space) -> "Watched":
    """Record what the steps of a Space do; afterwards, find what is wrong with it.

    Raises SandboxError if it is not a Space.

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
    return Watched(space)


class Watched:
    """Records the steps of a Space: of `Space.step` within a `with` block, or of its own `step`.

    What `sandbox watch` prints and writes is its `table` and `to_json`.
    """

    def __init__(self, space: pymunk.Space) -> None:
        self._space, self._origins = space, Origins()
        self._trial = Trial(space, self._origins, space.step)

    def __enter__(self) -> Self:
        self._patch = patch.multiple(self._space, step=self.step, add=partial(self._add, self._space.add))
        self._patch.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._patch.stop()

    def step(self, dt: float) -> None:
        """Call `Space.step`, and record what it does. dt: s; a step of 0 s, which does nothing, does not count."""
        vars(self).pop("diagnosis", None)
        self._trial.step(dt)

    def _add(self, add: Any, *objects: Any) -> None:
        add(*objects)
        self._origins.remember(objects)
        self._trial.changed = True

    @cached_property
    def diagnosis(self) -> Diagnosis:
        """All that was recorded so far, made when it is first asked for."""
        return self._trial.diagnosis(1)

    @property
    def findings(self) -> list[Finding]:
        """What is wrong with the Space and its steps, worst first."""
        return list(self.diagnosis.findings)

    def table(self, width: int = DEFAULT_WIDTH) -> str:
        """Return the text that `sandbox watch` prints, in so many columns."""
        return "\n".join(self.diagnosis.lines(width))

    def to_json(self) -> str:
        """Return what `sandbox watch --json` writes about the Space."""
        return json_text(self.diagnosis.as_json())
