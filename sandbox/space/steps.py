"""What the recorded steps of a Space show: the rules that look at them."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final, NamedTuple

import numpy as np
import pymunk

from sandbox.space.contents import (
    Contents,
    body_of,
    corners_of,
    half_length,
    half_width,
    is_dynamic,
    is_static,
    may_collide,
    shape_words,
    solid_of,
)
from sandbox.space.findings import Fault, Rules
from sandbox.space.passages import Passage, Passages
from sandbox.space.recording import Numbers, Recording, Rows, Run, Step
from sandbox.space.rules import Touched, unused
from sandbox.state import Bools, Floats

MAX_STRETCH: Final = 0.1  # of the joint's length, or half that of the bodies that it connects
FELT: Final = 0.01  # of a stretch, for what the program puts elsewhere, step after step
MAX_DEPTH: Final = 0.5  # of the smaller half width, beyond collision_slop, in an impact
MAX_LASTING_DEPTH: Final = 0.25
LASTING: Final = 0.2  # s: as long as that, an overlap is no impact
WITHIN: Final = 1.0  # s, in which what lasts does so for LASTING
SHRINKS: Final = 0.99  # of the depth a step before: Pymunk pushes bodies apart, unless something holds them
MOST: Final = 0.5  # of the steps
MANY_MOVES: Final = 10  # pairs of successive steps, before both of which the program set a body's position
CAUGHT: Final = 0.2  # of its momentum, that a body loses at a seam
ALONG: Final = 0.7  # cosine of the angle between two normals, below which one pushes along the other's surface
FLUSH: Final = 0.1  # of a body's half width, within which two surfaces are one
MAX_MASS_RATIO: Final = 100.0
STABLE: Final = 4.0  # of the square of a spring's frequency, times dt
DT_VARIES: Final = 1e-6  # relative, above rounding
LONGEST_STEP: Final = 0.05  # s: with longer ones, a screen would show less than 20 pictures in a second


class Series(NamedTuple):
    """A figure of two bodies that touch, or of a joint, in n steps.

    first: its first contact or joint; steps: (n,) the numbers of the steps, from 0; values: (n,) px.
    """

    first: Any
    steps: Numbers
    values: Floats

    @property
    def ends(self) -> tuple[int, int]:
        """The ids of both bodies."""
        return int(self.first["body_a"]), int(self.first["body_b"])

    @property
    def worst(self) -> tuple[int, float]:
        """The number of the step of the largest value, and that value."""
        at = int(self.values.argmax())
        return int(self.steps[at]), float(self.values[at])


@dataclass(frozen=True)
class Evidence:
    """A recording of at least one step, what the Space has now, and the passages that were seen while it ran."""

    recording: Recording
    contents: Contents
    passages: Passages

    @cached_property
    def run(self) -> Run:
        """The columns of the recording."""
        return Run(self.recording)

    @cached_property
    def overlaps(self) -> list[Series]:
        """The depth of the deepest point of each pair of bodies, where they overlap, px, unless they came in so."""
        step, contacts, slop = self.run.contact_step, self.run.contacts, self.contents.space.collision_slop
        found = []
        for rows in by_key(pair_key(contacts), step, contacts["distance"] < 0):
            at, first = np.unique(step[rows], return_index=True)
            series = Series(contacts[rows[0]], at, np.maximum.reduceat(-contacts["distance"][rows], first))
            deep = at[series.values > slop + MAX_LASTING_DEPTH * self.half_width(*series.ends)]
            if not (len(deep) and self.came_in(deep[0], *series.ends)):
                found.append(series)
        return found

    @cached_property
    def stretches(self) -> list[Series]:
        """How far joints that may pull as hard as they need are off their law, px."""
        step, joints = self.run.joint_step, self.run.joints
        return [Series(joints[rows[0]], step[rows], joints["error"][rows]) for rows in by_key(joints["key"], step)]

    @cached_property
    def put(self) -> Floats:
        """(n,) px that the program put bodies elsewhere before each step, and turned kinematic ones.

        0 if that is no further than a kinematic body's own velocities would move it, as a correction is.
        """
        old, was, fixed = self.run.old, self.run.was, np.isinf(self.run.old["mass"])
        ids, index = np.unique(old["id"], return_inverse=True)
        bodies = (self.recording.bodies[body] for body in ids.tolist())
        reach = np.array([max(map(half_length, body.shapes), default=0.0) for body in bodies])[index] * fixed
        way = np.hypot(*(old["position"] - was["position"]).T) + reach * np.abs(old["angle"] - was["angle"])
        speed = np.hypot(*old["velocity"].T) + reach * np.abs(old["spin"])
        return np.asarray(way * (~fixed | (way > speed * self.run.dt[self.run.step])))

    def placed(self, number: int, ends: tuple[int, int]) -> float:
        """Return how far the program put one of two bodies elsewhere before a step, by its number, px."""
        rows = slice(*self.run.step.searchsorted([number, number + 1]))
        return float(self.put[rows][np.isin(self.run.old["id"][rows], ends)].max(initial=0.0))

    @cached_property
    def sides(self) -> tuple[Rows, Numbers]:
        """All contacts as each body has them, as B: twice, the second time with A and B exchanged; and their steps."""
        contacts, swapped = self.run.contacts, self.run.contacts.copy()
        for name in ("body", "row", "shape", "arm"):
            swapped[f"{name}_a"], swapped[f"{name}_b"] = contacts[f"{name}_b"], contacts[f"{name}_a"]
        swapped["normal"] *= -1
        return np.append(contacts, swapped), np.tile(self.run.contact_step, 2)

    def touched(self, quantity: str) -> Iterator[Touched]:
        """Yield shapes whose contacts with walls, or with bodies, all had none; the first partner; and when, s."""
        (contacts, step), shapes = self.sides, self.recording.shapes
        moving = [key for key, shape in shapes.items() if shape.body and is_dynamic(shape.body)]
        is_body = np.isin(contacts["shape_a"], np.array(moving, "u8"))
        for kind in (~is_body, is_body):
            for rows in by_key(contacts["shape_b"], step, kind):
                partner, shape = (shapes[int(contacts[side][rows[0]])] for side in ("shape_a", "shape_b"))
                if shape.space and partner.space and not contacts[quantity][rows].any():
                    yield shape, partner, self.run.steps[step[rows[0]]].end

    def lasts(self, steps: Numbers) -> bool:
        """Return whether some steps, by their numbers, follow so closely that they are more than an impact."""
        ends = self.run.time[1:][steps]
        count = math.ceil(LASTING / self.run.dt[steps[0]]) if len(steps) else 0
        return bool(len(steps)) and bool(((ends[count:] - ends[:-count]) < WITHIN).any())

    def came_in(self, number: int, *ids: int) -> bool:
        """Return whether one of some bodies was not in the Space before a step, by its number."""
        known = [body for body in ids if body in self.recording.bodies]
        return number == 0 or not np.isin(known, self.run.steps[number - 1].new["id"]).all()

    def half_width(self, *ids: int) -> float:
        """Return the smallest half width of the shapes of those of some bodies that move by forces, px."""
        shapes = [shape for body in self.bodies(*ids) if is_dynamic(body) for shape in body.shapes]
        return min(filter(None, map(half_width, shapes)), default=math.inf)

    def bodies(self, *ids: int) -> list[pymunk.Body]:
        """Return those of some bodies that are not the Space's own static one."""
        return [self.recording.bodies[body] for body in ids if body in self.recording.bodies]

    def fault(self, rule: str, ids: Sequence[int], step: Step, what: str, size: float = 1.0, figure: str = "") -> Fault:
        """Return the fault of the first dynamic body of some, where it was after a step, since the end of that step.

        what: is wrong with it, where `{}` is the name of the body that is left.
        """
        bodies = [self.recording.bodies.get(body) or self.contents.space.static_body for body in ids]
        first, *rest = sorted(bodies, key=lambda body: not is_dynamic(body))
        report = self.contents.report(first, what.format(*map(self.contents.name, rest)))
        for x, y in step.new["position"][step.new["id"] == first.id].tolist():
            report = replace(report, position=(x, y))
        return Fault(rule, report, size, figure, step.end)

    def first(self, passages: Sequence[Passage]) -> list[tuple[pymunk.Body, Passage]]:
        """Return the first of some passages of each body; none if bodies fly apart: they pass everything."""
        return [] if self.run.broken else list({body_of(each.shape): each for each in passages[::-1]}.items())

    def length(self, stretch: Series) -> float:
        """Return the length of a joint, px, or half that of what it connects if that is more."""
        joint = self.recording.joints[int(stretch.first["key"])]
        sizes = [half_length(shape) for body in self.bodies(*stretch.ends) for shape in body.shapes]
        return float(max([getattr(joint, "distance", getattr(joint, "max", 0.0)), *sizes])) or math.inf

    def figures(self) -> dict[str, float]:
        """Return the figures of the rules whose cures can be tried: passages, or px of what is worst for its size."""
        depths = [(each.worst[1] / self.half_width(*each.ends), each.worst[1]) for each in self.overlaps]
        errors = [(each.worst[1] / self.length(each), each.worst[1]) for each in self.stretches]
        (_, depth), (_, error) = (max(figures, default=(0.0, 0.0)) for figures in (depths, errors))
        passages = float(len(self.passages.found))
        return {"passed-through": passages, "joint-stretched": error, "sinks-in": depth, "deep-at-once": depth}


def pair_key(contacts: Rows) -> Rows:
    """Return a number for the two bodies of each contact, whichever is A, by their ids, which are addresses."""
    low, high = np.minimum(contacts["body_a"], contacts["body_b"]), np.maximum(contacts["body_a"], contacts["body_b"])
    return np.asarray(low * np.uint64(0x9E3779B97F4A7C15) + high * np.uint64(0xC2B2AE3D27D4EB4F))


def by_key(keys: Rows, step: Numbers, chosen: Bools | slice = slice(None)) -> list[Numbers]:
    """Return the chosen rows of each key, by step.

    Keys are in the order of their first rows: addresses differ from run to run.
    """
    rows = np.arange(len(keys))[chosen]
    _, begin, group = np.unique(keys[rows], return_index=True, return_inverse=True)
    group = begin.argsort().argsort()[group]
    order = np.lexsort((step[rows], group))
    return np.split(rows[order], np.bincount(group).cumsum()[:-1]) if len(rows) else []


def _steps_vary(evidence: Evidence) -> Iterator[Fault]:
    dt = np.array([step.dt for step in evidence.recording.steps])
    if dt.max() > dt.min() * (1 + DT_VARIES):
        since = evidence.recording.steps[int((dt != dt[0]).argmax())].time
        yield Fault("dt-varies", None, figure=f"from {dt.min():.4g} to {dt.max():.4g} s", since=since)


def _not_finite(evidence: Evidence) -> Iterator[Fault]:
    if step := evidence.run.broken:
        for row in step.new[step.lost]:
            numbers = *row["position"], *row["velocity"], row["spin"], row["mass"]
            what = "position ({:.4g}, {:.4g}), velocity ({:.4g}, {:.4g}), spin {:.4g}, mass {:.4g}".format(*numbers)
            yield evidence.fault("not-finite", [int(row["id"])], step, what)


def _stiff_springs(evidence: Evidence) -> Iterator[Fault]:
    """Springs of bodies that fly apart: a step without damping is stable up to dt² k (1/m + 1/M) = 4."""
    dt = evidence.run.broken.dt if evidence.run.broken else 0.0
    for joint in evidence.recording.joints.values():
        ends = [body for body in (joint.a, joint.b) if is_dynamic(body) and body.mass]
        times = dt**2 * getattr(joint, "stiffness", 0.0) * sum(1 / body.mass for body in ends) / STABLE
        if isinstance(joint, pymunk.DampedSpring) and times > 1:
            what = f"its DampedSpring has stiffness {joint.stiffness:.4g}, {times:.3g} times what is stable"
            yield evidence.contents.fault("stiff-spring", ends[0], what, times)


def _passed(evidence: Evidence) -> Iterator[Fault]:
    """Bodies that passed a wall, each once."""
    for body, (step, shape, wall, way, *_) in evidence.first(evidence.passages.found):
        what, half = f"{way:.3g} px in the step, through a {shape_words(wall)}", half_width(shape)
        yield evidence.fault("passed-through", [body.id], step, what, way / half if half else math.inf)


def _ghosts(evidence: Evidence) -> Iterator[Fault]:
    """Bodies that went through walls with which they do not collide, by their kinds or by a filter, and never do."""
    for body, (step, shape, wall, *_) in evidence.first(evidence.passages.ghosts):
        is_held = any(body_of(wall) in (joint.a, joint.b) for joint in body.constraints)
        if not is_held and not may_collide(shape, wall):
            why = "by a filter" if is_dynamic(body) else "as neither moves by forces"
            yield evidence.fault("ghosts", [body.id], step, f"through a {shape_words(wall)}, {why}")


def _long_steps(evidence: Evidence) -> Iterator[Fault]:
    """Bodies that move by more than their width in a step that is longer than any screen shows a picture."""
    run = evidence.run
    ids, dt, way = run.old["id"], run.dt[run.step], np.hypot(*run.old["velocity"].T) * run.dt[run.step]
    for at in by_key(ids, run.step, (dt > LONGEST_STEP) & np.isfinite(run.old["mass"])):
        width = 2 * evidence.half_width(int(ids[at[0]]))
        for row in at[way[at] > width][:1]:
            enough, step = dt[row] * width / way[row], run.steps[run.step[row]]
            what = f"moves by {way[row]:.3g} px in a step, and is {width:.3g} px wide: dt below {enough:.2g} s"
            fault = evidence.fault("dt-large", [int(ids[row])], step, what, way[row] / width, f"{dt[row]:.3g} s")
            yield fault._replace(since=step.time)


def _stretched(evidence: Evidence) -> Iterator[Fault]:
    """Joints that stretch by more than a part of their length, or of half that of what they connect."""
    for stretch in evidence.stretches:
        joint, length = evidence.recording.joints[int(stretch.first["key"])], evidence.length(stretch)
        number, error = stretch.worst
        if error > MAX_STRETCH * length:
            masses = [body.mass for body in (joint.a, joint.b) if is_dynamic(body) and body.mass]
            ratio = max(masses) / min(masses) if masses else 1.0
            differ = f"; their masses differ {ratio:.3g} times" if ratio > MAX_MASS_RATIO else ""
            is_put = evidence.placed(number, stretch.ends) > FELT * error
            put = ", as the program puts one of them elsewhere before the step" if is_put else ""
            worst, off = evidence.run.steps[number], f"{error:.3g} px"
            what = f"its {type(joint).__name__} to {{}} is off by {off} at {worst.end:.3f} s{put}{differ}"
            fault = evidence.fault("joint-stretched", stretch.ends, worst, what, error / length, off)
            first = stretch.steps[(stretch.values > MAX_STRETCH * length).argmax()]
            yield fault._replace(since=evidence.run.steps[first].end)


def _too_deep(evidence: Evidence) -> Iterator[Fault]:
    """Overlaps that last; impacts only if nothing sinks in or passes a wall, which may cause them."""
    faults = list(filter(None, (_deep_overlap(evidence, each) for each in evidence.overlaps)))
    lasting = [fault for fault in faults if fault.rule == "sinks-in"]
    yield from lasting or ([] if evidence.passages.found else faults)


def _deep_overlap(evidence: Evidence, overlap: Series) -> Fault | None:
    """Return the fault of an overlap that is too deep, if it is."""
    ends, slop, half = overlap.ends, evidence.contents.space.collision_slop, evidence.half_width(*overlap.ends)
    before = np.where(np.diff(overlap.steps, prepend=-2) == 1, np.roll(overlap.values, 1), 0.0)
    is_held = overlap.values > SHRINKS * before  # otherwise Pymunk is pushing them apart
    lasting = overlap.steps[(overlap.values > slop + MAX_LASTING_DEPTH * half) & is_held]
    is_lasting = evidence.lasts(lasting)
    deep = lasting if is_lasting else overlap.steps[overlap.values > slop + MAX_DEPTH * half]
    number, depth = overlap.worst
    if not len(deep) or (not is_lasting and evidence.placed(deep[0], ends) > depth / 2):
        return None  # or the program put one into the other
    worst, since = evidence.run.steps[number], evidence.run.steps[deep[0]].end
    what = f"{depth:.3g} px deep in {{}} at {worst.end:.3f} s"
    rule = "sinks-in" if is_lasting else "deep-at-once"
    return evidence.fault(rule, ends, worst, what, depth / half, f"{depth:.3g} px")._replace(since=since)


def _moved(evidence: Evidence) -> Iterator[Fault]:
    """Bodies that the program puts elsewhere again and again; of kinematic ones, those that touch something then."""
    run, way, ids = evidence.run, evidence.put, evidence.run.old["id"]
    contacts, step = evidence.sides
    touches = np.isin(np.arange(len(ids)), run.rows_of(step, contacts["row_b"]))
    for at in by_key(ids, run.step, (way > 0) & (np.isfinite(run.old["mass"]) | touches)):
        if (np.diff(run.step[at]) == 1).sum() > MANY_MOVES:
            body, first = ids[at[0]], run.steps[run.step[at[0]]]
            what = f"before {int((way[ids == body] > 0).sum())} of the steps"
            yield evidence.fault("moved-by-hand", [int(body)], first, what, len(at))._replace(since=first.time)


def _contacts_within(evidence: Evidence) -> Iterator[Fault]:
    """Bodies that joints hold together, directly or through others, and that press on each other most of the time."""
    assembly: dict[int, set[int]] = {}  # of each dynamic body: the bodies that joints hold together, shared by all
    for joint in evidence.recording.joints.values():
        if is_dynamic(joint.a) and is_dynamic(joint.b):
            joined = assembly.get(joint.a.id, {joint.a.id}) | assembly.get(joint.b.id, {joint.b.id})
            assembly |= dict.fromkeys(joined, joined)
    step, contacts = evidence.run.contact_step, evidence.run.contacts
    for rows in by_key(pair_key(contacts), step) if assembly else ():
        first, at = contacts[rows[0]], np.unique(step[rows])
        ends = int(first["body_a"]), int(first["body_b"])
        is_mostly = len(at) > MOST * (len(evidence.run.steps) - at[0])
        if ends[1] in assembly.get(ends[0], ()) and is_mostly and evidence.lasts(at):
            what = f"presses on {{}}, in {len(at)} steps, though joints hold both"
            yield evidence.fault("contacts-within", ends, evidence.run.steps[at[0]], what, len(at))


def _caught(evidence: Evidence) -> Iterator[Fault]:
    """Bodies that move along static polygons until one stops them, though it only continues the others."""
    run, slop, shapes = evidence.run, evidence.contents.space.collision_slop, evidence.recording.shapes.items()
    tiles = [key for key, shape in shapes if isinstance(shape, pymunk.Poly) and shape.body and is_static(shape.body)]
    contacts, step = evidence.sides
    rows = run.rows_of(step, contacts["row_b"])
    chosen = np.isin(contacts["shape_a"], np.array(tiles, "u8")) & (rows < len(run.old))
    contacts, step, old = contacts[chosen], step[chosen], run.old[rows[chosen]]
    way = -(old["velocity"] * contacts["normal"]).sum(axis=1) * run.dt[step]
    is_stopped = (way > slop) & (contacts["impulse"] > CAUGHT * old["mass"] * np.hypot(*old["velocity"].T))
    for row in np.flatnonzero(is_stopped).tolist():
        contact, number = contacts[row], step[row]
        beside = contacts[(step == number) & (contacts["body_b"] == contact["body_b"])]
        others = beside[beside["shape_a"] != contact["shape_a"]]
        is_across = bool((others["normal"] @ contact["normal"] < ALONG).all())
        if is_across and any(_continues(evidence, contact, other) for other in others):
            what = f"is caught where two polygons meet, at {run.steps[number].end:.3f} s"
            yield evidence.fault("seams", [int(contact["body_b"])], run.steps[number], what)


def _continues(evidence: Evidence, contact: Any, other: Any) -> bool:
    """Return whether a polygon that a body touched begins where another one ends, and rises no higher."""
    tile, floor = (evidence.recording.shapes[int(each["shape_a"])] for each in (contact, other))
    x, y = body_of(tile).position + contact["arm_a"]
    margin = FLUSH * evidence.half_width(int(contact["body_b"]))
    corners = ([body_of(each).local_to_world(corner) for corner in corners_of(each)] for each in (tile, floor))
    top, floor_top = ((np.array(each) @ other["normal"]).max() for each in corners)
    return bool(top < floor_top + margin) and floor.point_query((x, y)).distance < margin


def _hanging(evidence: Evidence) -> Iterator[Fault]:
    """Bodies that sleep, though nothing touches or holds them and gravity pulls."""
    space = evidence.contents.space
    for body in evidence.contents.bodies if not evidence.run.broken else ():
        if not (is_dynamic(body) and body.is_sleeping and space.gravity.length) or body.constraints:
            continue
        solid = solid_of(body)
        near = [hit.shape for shape in solid for hit in space.shape_query(shape) if hit.shape not in solid]
        holds = [each for each in near if each and not each.sensor and any(may_collide(shape, each) for shape in solid)]
        if solid and not holds:
            yield evidence.contents.fault("hangs", body, "sleeps, and touches nothing")


def _unused(evidence: Evidence) -> Iterator[Fault]:
    for quantity in evidence.contents.origins.zeros:
        yield from unused(evidence.contents, quantity, evidence.touched(quantity))


_OF_MOTION: Final = (_steps_vary, _not_finite, _stiff_springs, _long_steps, _moved, _passed, _ghosts, _hanging)
_OF_CONTACTS: Final = (_contacts_within, _caught, _too_deep, _unused)
STEP_RULES: Final[Rules[Evidence]] = (*_OF_MOTION, *_OF_CONTACTS, _stretched)
