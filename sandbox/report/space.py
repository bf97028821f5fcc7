"""Recorded Spaces of a program -> one HTML page that plays them, with what was found in them."""

import base64
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from sandbox.space.description import AnyConstraint, AnyShape, BodyType, Parts, SpaceDescription
from sandbox.space.energy import Ledger
from sandbox.space.findings import Finding
from sandbox.space.finer import Finer
from sandbox.space.recording import Recording
from sandbox.space.replay import STATIC, Motion, Script, points_of

MAX_NUMBERS: Final = 1_000_000  # places and angles, 4 bytes each, of all Spaces together
MARGIN: Final = 0.1  # of the view, around bodies that move
STRAY: Final = 2.0  # per cent of all places that may be out of the view, on each side
COLOURS: Final = {  # of pymunk.SpaceDebugDrawOptions
    BodyType.DYNAMIC: (52, 152, 219, 255),
    BodyType.KINEMATIC: (39, 174, 96, 255),
    BodyType.STATIC: (149, 165, 166, 255),
}


@dataclass(frozen=True)
class PlayedSpace:
    """A Space of the page: its heading, what was found, and what it is compared with, in paragraphs.

    recording: None if there was none; finer: the finer run, if there was one, by the name of the reference.
    """

    heading: str
    findings: Sequence[Finding]
    ledger: Ledger | None
    paragraphs: Sequence[str]
    recording: Recording | None
    finer: Finer | None
    reference: str


def page(title: str, spaces: Sequence[PlayedSpace]) -> str:
    """Return the page."""
    from sandbox.report.html import render  # noqa: PLC0415  (Bokeh is slow to import)

    return render(
        "space.html",
        [],
        ["playback.js", "space.js"],
        [],
        data=[_data(space, MAX_NUMBERS // len(spaces)) for space in spaces],
        title=title,
        spaces=spaces,
        keys=(("Space", "play or pause"), ("← →", "one frame"), ("Home End", "start, end")),
    )


def _data(space: PlayedSpace, most: int) -> dict[str, Any] | None:
    """Return what the player draws. most: numbers."""
    recording = space.recording
    start = recording.roster.start if recording else None
    if recording is None or start is None or recording.dropped or not len(recording):
        return None
    script = Script(recording, len(recording))
    count, bodies = script.recorded.place.shape
    stride = max(1, -(-count * bodies * (6 if space.finer else 3) // most))
    frames = np.arange(0, count, stride)
    scene = _Scene(script, frames)
    return {
        "times": [round(script.steps[frame].end, 6) for frame in frames.tolist()],
        "view": _view(script, list(scene.shapes.values())),
        "down": start.settings.gravity[1] >= 0,
        "bodies": bodies,
        "poses": _packed(script.recorded, frames),
        "reference": _packed(_counted(space.finer), frames) if space.finer else None,
        "shapes": list(scene.shapes.values()),
        "joints": [joint for joint in scene.joints.values() if joint["points"]],
    }


def _counted(finer: Finer) -> Motion:
    """Return where the reference counts."""
    is_known = ~np.isnan(finer.error)
    nowhere = complex(np.nan, np.nan)
    return Motion(np.where(is_known, finer.reference.place, nowhere), np.where(is_known, finer.reference.angle, np.nan))


def _packed(motion: Motion, frames: np.ndarray) -> str:
    """Return place and angle of each body in each frame, as base64 of 32-bit numbers, NaN for absent bodies."""
    shown = frames[frames < len(motion.place)]
    numbers = np.stack([motion.place[shown].real, motion.place[shown].imag, motion.angle[shown]], axis=-1)
    return base64.b64encode(numbers.astype("<f4").tobytes()).decode()


def _view(script: Script, shapes: Sequence[dict[str, Any]]) -> list[float]:
    """Return the box in which bodies move, and what of the rest is near: left, bottom, width and height, px."""
    place = script.recorded.place[~np.isnan(script.recorded.place)]
    fixed = np.array([point for shape in shapes if shape["body"] == STATIC for point in shape["points"]]).reshape(-1, 2)
    seen = np.stack([place.real, place.imag], axis=1) if len(place) else fixed
    if not len(seen):
        return [-100.0, -100.0, 200.0, 200.0]
    low, high = np.percentile(seen, [STRAY, 100 - STRAY], axis=0)
    margin = 2 * float(np.median(script.sizes)) if len(script.sizes) else 1.0
    reach = np.max(high - low) + margin
    near = fixed[((fixed > low - reach) & (fixed < high + reach)).all(axis=1)]
    low, high = np.min([low - margin, *near], axis=0), np.max([high + margin, *near], axis=0)
    edge = MARGIN * np.max(high - low)
    return [*(low - edge).tolist(), *(high - low + 2 * edge).tolist()]


class _Scene:
    """What is drawn: shapes and joints, each from one frame to another. frames: the steps after which they are."""

    def __init__(self, script: Script, frames: np.ndarray) -> None:
        self._frames = frames
        self._centers = [complex(*body.center_of_gravity) for body in script.roster.bodies]
        self._kinds: list[BodyType] = [BodyType.STATIC] * len(self._centers)
        assert script.roster.start
        static = script.roster.start.static_body
        self._origin, self._turn = complex(*static.position), np.exp(1j * static.angle)
        self.shapes: dict[int, dict[str, Any]] = {}
        self.joints: dict[int, dict[str, Any]] = {}
        start = script.roster.start
        self._add(0, start, [range(len(each)) for each in (start.bodies, start.shapes, start.constraints)])
        for step, changes in script.roster.changes.items():
            for change in changes:
                for number in change.removed[1]:
                    self.shapes[number]["to"] = self._frame(step)
                for number in change.removed[2]:
                    self.joints[number]["to"] = self._frame(step)
                self._add(step, change.parts, change.added)

    def _frame(self, step: int) -> int:
        return int(np.searchsorted(self._frames, step))

    def _add(self, step: int, parts: SpaceDescription | Parts, numbers: Sequence[Sequence[int]]) -> None:
        span = {"from": self._frame(step), "to": len(self._frames)}
        for number, body in zip(numbers[0], parts.bodies, strict=True):
            self._kinds[number] = body.body_type
        for number, shape in zip(numbers[1], parts.shapes, strict=True):
            self.shapes[number] = self._shape(shape) | span
        for number, joint in zip(numbers[2], parts.constraints, strict=True):
            self.joints[number] = {"points": list(self._anchors(joint))} | span

    def _local(self, body: int | None, point: Sequence[float]) -> list[float]:
        """Return a point from the centre of gravity of its body; of the Space's static body, where it is."""
        place = complex(*point)
        place = self._origin + self._turn * place if body is None else place - self._centers[body]
        return [place.real, place.imag]

    def _shape(self, shape: AnyShape) -> dict[str, Any]:
        kind = BodyType.STATIC if shape.body is None else self._kinds[shape.body]
        red, green, blue, opacity = shape.color or COLOURS[kind]
        return {
            "kind": shape.kind,
            "body": STATIC if shape.body is None else shape.body,
            "points": [self._local(shape.body, point) for point in points_of(shape)],
            "radius": shape.radius,
            "color": f"rgb({red:.0f} {green:.0f} {blue:.0f} / {opacity / 255:.3g})",
        }

    def _anchors(self, joint: AnyConstraint) -> Iterator[list[float]]:
        """Yield the points of a joint, if it has any, each after the number of its body."""
        for body, names in ((joint.a, ("anchor_a", "groove_a", "groove_b")), (joint.b, ("anchor_b",))):
            for name in names:
                if hasattr(joint, name):
                    yield [STATIC if body is None else body, *self._local(body, getattr(joint, name))]
