"""What was in a Space while it was recorded: its bodies, shapes and joints, as snapshots name them."""

import numpy as np
import pymunk

from sandbox.space.contents import shapes_of
from sandbox.space.memory import joint_key, shape_address, shape_fingerprints


class Roster:
    """Follows what is in a Space, and keeps it, because Pymunk would give the ids of what is gone to others.

    by_id (also bodies that only have a shape or a joint in it), by_key, by_address: bodies, joints and shapes as
    snapshots name them; unsteady: the shapes that changed, or that came or went in mid-run without their body.
    """

    def __init__(self, space: pymunk.Space) -> None:
        self._space = space
        self.by_id: dict[int, pymunk.Body] = {}
        self.by_key: dict[int, pymunk.Constraint] = {}
        self.by_address: dict[int, pymunk.Shape] = {}
        self.unsteady: set[pymunk.Shape] = set()
        self._seen: int | None = None
        self._bodies: set[pymunk.Body] = set()  # in the Space when it was looked at, and its shapes
        self._shapes: set[pymunk.Shape] = set()
        self._prints = np.empty(0, np.uint64)  # fingerprints of all shapes so far

    def look(self, fingerprint: int) -> None:
        """Look at what is new. fingerprint: of the Space now."""
        if fingerprint == self._seen:
            return
        listed, joints = shapes_of(self._space), list(self._space.constraints)
        bodies, shapes = set(self._space.bodies), set(listed)
        used = [
            *self._space.bodies,
            *(shape.body for shape in listed),
            *(body for joint in joints for body in (joint.a, joint.b)),
        ]
        by_id = {body.id: body for body in used if body not in (None, self._space._static_body)}
        guests = {body for key, body in by_id.items() if key not in self.by_id and body.space is None}
        if self._seen is not None:
            came, went = (bodies - self._bodies) | guests, self._bodies - bodies
            self.unsteady |= {shape for shape in shapes - self._shapes if shape.body not in came}
            self.unsteady |= {shape for shape in self._shapes - shapes if shape.body not in went}
        self.by_id |= by_id
        self.by_key |= {joint_key(joint): joint for joint in joints}
        self.by_address |= {int(shape_address(shape)): shape for shape in listed}
        before, self._prints = self._prints, shape_fingerprints(np.array([*self.by_address], np.uint64))
        known = list(self.by_address.values())
        changed = np.flatnonzero(self._prints[: len(before)] != before).tolist()
        self.unsteady |= {known[row] for row in changed} & shapes & self._shapes
        self._seen, self._bodies, self._shapes = fingerprint, bodies, shapes
