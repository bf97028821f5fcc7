"""What the recorded steps of a Space show: the rules that look at them."""

import math
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations, pairwise, takewhile
from typing import Any, Final, NamedTuple

import numpy as np
import pymunk
from numpy.typing import NDArray

from sandbox.space.contents import (
    Contents,
    Meeting,
    body_of,
    corners_of,
    half_length,
    half_width,
    is_dynamic,
    is_static,
    may_collide,
    shape_words,
)
from sandbox.space.energy import LARGEST, common, is_within
from sandbox.space.findings import BodyReport, Fault, Rules
from sandbox.space.passages import Passage
from sandbox.space.recording import CONTACT, JOINT, JointKind, Recording, Rows, Step
from sandbox.space.rules import END_RULES, MAX_MASS_RATIO
from sandbox.state import Floats

Numbers = NDArray[np.intp]

MAX_STRETCH: Final = 0.1  # of the joint's length, or half that of the bodies that it connects
MAX_ANGLE: Final = 0.1  # rad, of a joint's angle off its law
MAX_DEPTH: Final = 0.5  # of the smaller half width, beyond collision_slop, in an impact
MAX_LASTING_DEPTH: Final = 0.25
LASTING: Final = 0.2  # s: as long as that, an overlap is no impact
WITHIN: Final = 1.0  # s, in which what lasts does so for LASTING
SHRINKS: Final = 0.99  # of the depth a step before: Pymunk pushes bodies apart, unless something holds them
MIN_PUSHES: Final = 3  # of a body into others
MOST: Final = 0.5  # of the steps
MANY_MOVES: Final = 10  # steps before which the program set a body's position
MIN_RESTING: Final = 30  # steps
RESTING_SPEED: Final = 2.0  # in units of what gravity adds in a step: slower bodies count as at rest
CAUGHT: Final = 0.2  # of its speed, that a body loses at a seam
ALONG: Final = 0.7  # cosine: a normal that far off a floor's pushes along the floor
MARGIN: Final = 10.0  # of the size of the world, beyond which bodies have left it
FRICTION_STEPS: Final = 0.05  # of the steps: with contacts in fewer, nothing rubs on a body
KEPT_SPEED: Final = 0.8  # of its largest speed: slower in the end, something has slowed a body
IN_ANGLE: Final = (JointKind.ROTARY_LIMIT, JointKind.RATCHET, JointKind.GEAR)


class Series(NamedTuple):
    """A figure of two bodies that touch, or of a joint, in n steps.

    first: its first contact or joint; steps: (n,) the numbers of the steps, from 0; values: (n,) px, or rad.
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
    """A recording, what the Space has now, and the passages that were seen while it ran."""

    recording: Recording
    contents: Contents
    passages: Sequence[Passage] = ()

    @cached_property
    def steps(self) -> list[Step]:
        """The steps that are kept, until one leaves a number that is not finite, or too large; at least one."""
        steps = list(self.recording.steps)
        return steps[:1] + list(takewhile(lambda step: is_within(LARGEST, step.after), steps[1:]))

    @cached_property
    def contacts(self) -> tuple[Rows, Numbers]:
        """The contacts of all steps, and the number of the step of each."""
        return _listed([step.after.contacts for step in self.steps], CONTACT)

    @cached_property
    def overlaps(self) -> list[Series]:
        """The depth of the deepest point of each pair of bodies, where they overlap, px."""
        contacts, number = self.contacts
        deep = contacts["distance"] < 0
        contacts, number = contacts[deep], number[deep]
        return [
            Series(contacts[rows[0]], at, np.maximum.reduceat(-contacts["distance"][rows], first))
            for rows, at, first in _by_pair(contacts, number, "body")
        ]

    @cached_property
    def stretches(self) -> list[Series]:
        """How far joints that may pull as hard as they need are off their law, once that has begun to grow."""
        joints, number = _listed([step.after.joints for step in self.steps], JOINT)
        hard = np.isinf(joints["max_force"])
        joints, number = joints[hard], number[hard]
        found = []
        for rows, at, _ in _by_key(joints["key"][:, None], number):
            values = np.abs(joints["error"][rows])
            grows = np.flatnonzero(np.diff(values, prepend=0.0) > 0)
            begin = grows[0] if len(grows) else len(values)
            if begin == 0 and len(grows) > 1 and values[0] > values[1]:  # it was off when it was added
                begin = grows[1]
            if begin < len(values):
                found.append(Series(joints[rows[0]], at[begin:], values[begin:]))
        return found

    @cached_property
    def after_run(self) -> Contents:
        """What the Space has now, and which of its shapes touched, in the order of time."""
        contacts, number = self.contacts
        found = []
        for rows, at, _ in _by_pair(contacts, number, "shape"):
            a, b = (self.recording.shapes.get(int(contacts[side][rows[0]])) for side in ("shape_a", "shape_b"))
            if a and b and a.body and b.body:
                largest = (float(contacts[name][rows].max()) for name in ("elasticity", "friction"))
                found.append(Meeting(a, b, self.steps[at[0]].end, *largest))
        return replace(self.contents, met=sorted(found, key=lambda meeting: meeting.since))

    @cached_property
    def too_deep(self) -> dict[str, list[Fault]]:
        """The overlaps that are too deep, by the rules for why."""
        faults: dict[str, list[Fault]] = defaultdict(list)
        for rule, fault in filter(None, (_deep_overlap(self, overlap) for overlap in self.overlaps)):
            faults[rule].append(fault)
        return faults

    @cached_property
    def moved(self) -> dict[int, list[int]]:
        """The numbers of the steps, from 0, before which the program set a body's position, by body."""
        steps: dict[int, list[int]] = defaultdict(list)
        for number, (last, step) in enumerate(pairwise(self.steps), 1):
            if last.after is not step.before:
                old, new = common(last.after.bodies, step.before.bodies)
                for body in np.sort(old["id"][(old["position"] != new["position"]).any(axis=1)]).tolist():
                    steps[body].append(number)
        return steps

    def pushes_together(self, number: int, ends: tuple[int, int], by: Sequence[str]) -> float:
        """Return how far the program pushed two bodies into each other before a step, by its number, px.

        That is by what it set of their position and velocity, along the normal of their deepest contact in the step.
        """
        step, last, pushes = self.steps[number], self.steps[max(0, number - 1)].after, np.zeros(2)
        if last is step.before:
            return 0.0
        contacts = step.after.contacts
        pair = contacts[np.isin(contacts["body_a"], ends) & np.isin(contacts["body_b"], ends)]
        deepest = pair[pair["distance"].argmin()]
        for side, sign in (("a", 1), ("b", -1)):
            old, new = (rows[rows["id"] == deepest[f"body_{side}"]] for rows in (last.bodies, step.before.bodies))
            for name in by if len(old) and len(new) else ():
                pushes += sign * (step.dt if name == "velocity" else 1.0) * (new[name][0] - old[name][0])
        return float(pushes @ deepest["normal"])

    def lasts(self, steps: Numbers) -> bool:
        """Return whether some steps, by their numbers, follow so closely that they are more than an impact."""
        ends = np.array([self.steps[number].end for number in steps])
        count = math.ceil(LASTING / self.steps[steps[0]].dt) if len(steps) else 0
        return bool(len(steps)) and bool(((ends[count:] - ends[:-count]) < WITHIN).any())

    def came_in(self, step: Step, *ids: int) -> bool:
        """Return whether one of some bodies was not in the Space before a step."""
        row = step.number - self.steps[0].number
        known = [body for body in ids if body in self.recording.bodies]
        return row == 0 or not np.isin(known, self.steps[row - 1].after.bodies["id"]).all()

    def half_width(self, *ids: int) -> float:
        """Return the smallest half width of the shapes of those of some bodies that move by forces, px."""
        shapes = [shape for body in self.bodies(*ids) if is_dynamic(body) for shape in body.shapes]
        return min(filter(None, map(half_width, shapes)), default=math.inf)

    def bodies(self, *ids: int) -> list[pymunk.Body]:
        """Return those of some bodies that are not the Space's own static one."""
        return [self.recording.bodies[body] for body in ids if body in self.recording.bodies]

    def report(self, ids: Sequence[int], step: Step, detail: str) -> BodyReport:
        """Name the first dynamic body of some, where it was after a step, and what is wrong with it.

        detail: `{}` is the name of the body that is left.
        """
        static = self.contents.space.static_body
        bodies = [self.recording.bodies.get(body, static) for body in ids]
        first, *rest = sorted(bodies, key=lambda body: not is_dynamic(body))
        report = self.contents.report(first, detail.format(*map(self.contents.name, rest)))
        rows = step.after.bodies
        place = rows["position"][rows["id"] == first.id]
        return replace(report, position=(float(place[0, 0]), float(place[0, 1]))) if len(place) else report

    def figures(self) -> dict[str, float]:
        """Return the figures of the rules whose cures can be tried: px, bodies, or a share of steps."""
        deepest = max((overlap.worst[1] for overlap in self.overlaps), default=0.0)
        stretched = max((each.worst[1] for each in self.stretches if each.first["kind"] not in IN_ANGLE), default=0.0)
        return {
            "passed-through": float(len(self.passages)),
            "joint-stretched": stretched,
            "sinks-in": deepest,
            "deep-at-once": deepest,
            "jitters": 100 * max(_reversals(self.steps).values(), default=0.0),
        }


def _listed(of_step: Sequence[Rows], kind: np.dtype[Any]) -> tuple[Rows, Numbers]:
    """Return the contacts or joints of all steps, and the number of the step of each."""
    return np.concatenate([np.empty(0, kind), *of_step]), np.repeat(np.arange(len(of_step)), [*map(len, of_step)])


def _by_pair(contacts: Rows, number: Numbers, of: str) -> Iterator[tuple[Numbers, Numbers, Numbers]]:
    """Yield the rows of each pair of bodies or shapes, as `_by_key` does."""
    return _by_key(np.sort(np.stack([contacts[f"{of}_a"], contacts[f"{of}_b"]], axis=1), axis=1), number)


def _by_key(keys: Rows, number: Numbers) -> Iterator[tuple[Numbers, Numbers, Numbers]]:
    """Yield the rows of each key by step, the numbers of these steps, and where each begins. keys: (n, k).

    Keys come in the order of their first rows: they are addresses, whose order differs from run to run.
    """
    _, begin, group = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    group = begin.argsort().argsort()[group.ravel()]
    order = np.lexsort((number, group))
    for rows in np.split(order, np.bincount(group).cumsum()[:-1]) if len(order) else ():
        at, first = np.unique(number[rows], return_index=True)
        yield rows, at, first


def _passed(evidence: Evidence) -> Iterator[Fault]:
    """Bodies that passed each other: each body once."""
    reported: set[int] = set()
    for step, shape, wall, way in evidence.passages:
        bodies = body_of(shape), body_of(wall)
        light = next(body for body in bodies if is_dynamic(body))
        if light.id in reported:
            continue
        reported |= {body.id for body in bodies if is_dynamic(body)}
        half = half_width(shape)
        widest = half + half_width(wall)
        cures = f"dt below {widest / way * step.dt:.2g} s" if widest else ""
        if is_static(body_of(wall)):
            how = f"{way:.3g} px in the step, through a {shape_words(wall)}"
            cures += f"{' or ' if widest else ''}a wall {2 * (way - half):.3g} px thick"
        else:
            how = f"went {way:.3g} px through {{}} in the step"
        report = evidence.report([body.id for body in bodies], step, f"{how}; {cures} prevents that")
        yield Fault(way / half if half else math.inf, report, since=step.end)


def _stretched(evidence: Evidence) -> Iterator[Fault]:
    for stretch in evidence.stretches:
        joint, is_angle = evidence.recording.joints[int(stretch.first["key"])], stretch.first["kind"] in IN_ANGLE
        sizes = [half_length(shape) for body in evidence.bodies(*stretch.ends) for shape in body.shapes]
        length = max([getattr(joint, "distance", getattr(joint, "max", 0.0)), *sizes])
        limit, (number, error) = MAX_ANGLE if is_angle else MAX_STRETCH * length, stretch.worst
        if limit and error > limit:
            worst, first = evidence.steps[number], evidence.steps[stretch.steps[(stretch.values > limit).argmax()]]
            off = f"{error:.3g} {'rad' if is_angle else 'px'}"
            what = f"its {type(joint).__name__} to {{}} is off by {off} at {worst.end:.3f} s{_ratio_words(joint)}"
            yield Fault(error / (length or 1), evidence.report(stretch.ends, worst, what), off, since=first.end)


def _ratio_words(joint: pymunk.Constraint) -> str:
    masses = [body.mass for body in (joint.a, joint.b) if is_dynamic(body) and body.mass]
    ratio = max(masses) / min(masses) if masses else 1.0
    return f"; their masses differ {ratio:.3g} times" if ratio > MAX_MASS_RATIO else ""


def _deep_overlap(evidence: Evidence, overlap: Series) -> tuple[str, Fault] | None:
    """Return the rule for why an overlap is too deep, if it is; not of bodies that came into the Space so."""
    ends, slop, half = overlap.ends, evidence.contents.space.collision_slop, evidence.half_width(*overlap.ends)
    before = np.where(np.diff(overlap.steps, prepend=-2) == 1, np.roll(overlap.values, 1), 0.0)
    is_held = overlap.values > SHRINKS * before  # otherwise Pymunk is pushing them apart
    lasting = overlap.steps[(overlap.values > slop + MAX_LASTING_DEPTH * half) & is_held]
    is_lasting = evidence.lasts(lasting)
    deep = lasting if is_lasting else overlap.steps[overlap.values > slop + MAX_DEPTH * half]
    if not len(deep) or evidence.came_in(evidence.steps[deep[0]], *ends):
        return None
    number, depth = overlap.worst
    worst = evidence.steps[number]
    placed = evidence.pushes_together(int(deep[0]), ends, ["position"])
    at = overlap.steps == deep[0]
    is_impact = not is_lasting and bool((before[at] < overlap.values[at] / 2).all())
    rule = "deep-at-once" if is_impact else "sinks-in"
    if _is_pushed(evidence, overlap, deep):
        rule = "pushed-by-hand"
    elif is_impact and placed > depth / 2:
        return None  # the program put one into the other
    report = evidence.report(ends, worst, f"{depth:.3g} px deep in {{}} at {worst.end:.3f} s")
    return rule, Fault(depth / half, report, f"{depth:.3g} px", since=evidence.steps[deep[0]].end)


def _is_pushed(evidence: Evidence, overlap: Series, deep: Numbers) -> bool:
    """Return whether the program pushes two bodies into each other again and again, until they are deepest."""
    until = overlap.steps[overlap.values.argmax()]
    slop = evidence.contents.space.collision_slop
    by = "position", "velocity"
    pushed = np.array([evidence.pushes_together(number, overlap.ends, by) > slop for number in overlap.steps.tolist()])
    growing = np.isin(overlap.steps, deep) & (overlap.steps <= until)
    return bool(pushed.sum() >= MIN_PUSHES and growing.any() and pushed[growing].mean() > MOST)


def _reversals(steps: Sequence[Step]) -> dict[int, float]:
    """Return how often bodies at rest reverse their velocity, as a share of the steps, by their id.

    A body is at rest while it is slower than what gravity adds in two steps. Reversals count from a tenth of that on,
    of bodies that were at rest for MIN_RESTING steps.
    """
    last: dict[int, NDArray[Any]] = {}
    reversals: dict[int, int] = defaultdict(int)
    resting: dict[int, int] = defaultdict(int)
    for step in steps:
        limit = RESTING_SPEED * math.hypot(*step.before.settings.gravity) * step.dt
        bodies = step.after.bodies
        bodies = bodies[np.isfinite(bodies["mass"]) & ~bodies["asleep"]]
        speed = np.hypot(*bodies["velocity"].T)
        for row in bodies[(speed > 0) & (speed < limit)]:
            body = int(row["id"])
            resting[body] += 1
            reversals[body] += body in last and bool(last[body] @ row["velocity"] < -((limit / 10) ** 2))
            last[body] = row["velocity"]
    return {body: reversals[body] / count for body, count in resting.items() if count >= MIN_RESTING}


def _jittery(evidence: Evidence) -> Iterator[Fault]:
    for body, share in _reversals(evidence.steps).items():
        if share > MOST and body in evidence.recording.bodies:
            what = f"turns back in {100 * share:.0f} % of its steps at rest"
            yield Fault(share / 100, evidence.report([body], evidence.steps[-1], what), since=evidence.steps[0].time)


def _moved(evidence: Evidence) -> Iterator[Fault]:
    """Bodies whose positions the program sets again and again; of kinematic ones, those that touch something then."""
    for body, numbers in evidence.moved.items():
        steps = [step for step in map(evidence.steps.__getitem__, numbers) if _matters(evidence, step, body)]
        if len(steps) > MANY_MOVES:
            report = evidence.report([body], steps[0], f"before {len(numbers)} of the steps")
            yield Fault(len(steps), report, since=steps[0].time)


def _matters(evidence: Evidence, step: Step, body: int) -> bool:
    """Return whether a body, put elsewhere before a step, moves by forces; or touches something, and is moved further.

    Further than its own velocity moves it: that is a correction.
    """
    contacts, before = step.after.contacts, step.before.bodies
    row = before[before["id"] == body][0]
    if np.isfinite(row["mass"]):
        return True
    last = evidence.steps[step.number - evidence.steps[0].number - 1].after.bodies
    way = row["position"] - last["position"][last["id"] == body][0]
    is_touching = bool(((contacts["body_a"] == body) | (contacts["body_b"] == body)).any())
    is_kinematic = any(each.body_type == pymunk.Body.KINEMATIC for each in evidence.bodies(body))
    return is_kinematic and is_touching and math.hypot(*way) > math.hypot(*row["velocity"]) * step.dt


def _wrong_points(evidence: Evidence) -> Iterator[Fault]:
    """Bodies that the program pushed at points far outside of them."""
    for body, push in evidence.contents.origins.pushes.items():
        size = max(map(half_length, body.shapes), default=math.inf)
        if body.space is evidence.contents.space and push.lever > 4 * size and math.isfinite(body.moment):
            where = "the Space" if "local" in push.call else "the body"
            what = f"{push.call} in {push.line}: {push.lever:.3g} px off, as if the point were one of {where}"
            yield Fault(push.lever / size, evidence.contents.report(body, what), since=evidence.steps[0].time)


def _contacts_within(evidence: Evidence) -> Iterator[Fault]:
    """Bodies that joints hold together, directly or through others, and that press on each other most of the time."""
    assembly: dict[int, set[int]] = {}  # of each dynamic body: the bodies that joints hold together, shared by all
    for joint in evidence.recording.joints.values():
        if is_dynamic(joint.a) and is_dynamic(joint.b):
            joined = assembly.get(joint.a.id, {joint.a.id}) | assembly.get(joint.b.id, {joint.b.id})
            assembly |= dict.fromkeys(joined, joined)
    contacts, number = evidence.contacts
    for rows, at, _ in _by_pair(contacts, number, "body"):
        first = contacts[rows[0]]
        ends = int(first["body_a"]), int(first["body_b"])
        is_mostly = len(at) > MOST * (len(evidence.steps) - at[0])
        if ends[1] in assembly.get(ends[0], ()) and is_mostly and evidence.lasts(at):
            step = evidence.steps[at[0]]
            what = f"presses on {{}}, in {len(at)} steps, though joints hold both"
            yield Fault(len(at), evidence.report(ends, step, what), since=step.end)


class _Seam(NamedTuple):
    """Where the sides of two polygons continue each other: the place, px, and the direction out of both."""

    place: pymunk.Vec2d
    out: pymunk.Vec2d


def _seams(evidence: Evidence) -> dict[pymunk.Shape, list[_Seam]]:
    """Return the seams of static polygons."""
    ends: dict[tuple[int, ...], list[tuple[pymunk.Shape, pymunk.Vec2d, pymunk.Vec2d]]] = defaultdict(list)
    for shape in evidence.contents.solid:
        if isinstance(shape, pymunk.Poly) and is_static(body_of(shape)):
            corners = [body_of(shape).local_to_world(corner) for corner in corners_of(shape)]
            for a, b in pairwise([*corners, corners[0]]):
                out = (b - a).perpendicular().normalized() * -1
                for end in (a, b):
                    ends[round(end.x), round(end.y), round(8 * out.x), round(8 * out.y)].append((shape, end, out))
    seams: dict[pymunk.Shape, list[_Seam]] = defaultdict(list)
    for meeting in ends.values():
        for (first, place, out), (second, _, _) in combinations(meeting, 2):
            if first is not second:
                seams[first].append(_Seam(place, out))
                seams[second].append(_Seam(place, out))
    return seams


def _caught(evidence: Evidence) -> Iterator[Fault]:
    """Bodies that a contact at a seam turned back or stopped, along the floor on which they are."""
    seams, shapes = _seams(evidence), evidence.recording.shapes
    contacts, number = evidence.contacts
    for row, step in zip(contacts, (evidence.steps[at] for at in number.tolist()), strict=True) if seams else ():
        for side, mover, sign in (("a", "b", 1.0), ("b", "a", -1.0)):
            wall = shapes.get(int(row[f"shape_{side}"]))
            if wall not in seams or row["impulse"] <= 0:
                continue
            bodies = step.before.bodies
            of_mover = bodies[bodies["id"] == row[f"body_{mover}"]]
            normal = sign * row["normal"]  # towards the mover
            if not len(of_mover) or row["impulse"] < CAUGHT * of_mover["mass"][0] * np.hypot(*of_mover["velocity"][0]):
                continue
            place = of_mover["position"][0] + of_mover["velocity"][0] * step.dt + row[f"arm_{mover}"]
            size = evidence.half_width(int(row[f"body_{mover}"]))
            for seam in seams[wall]:
                off = place - np.array(seam.place)
                if abs(normal @ np.array(seam.out)) < ALONG and abs(off @ normal) < size / 4 and np.hypot(*off) < size:
                    x, y = seam.place
                    what = f"is caught where two polygons meet, at ({x:.4g}, {y:.4g}), at {step.end:.3f} s"
                    ends = [int(row["body_a"]), int(row["body_b"])]
                    yield Fault(1, evidence.report(ends, step, what), since=step.end)
                    break


def _untouched(evidence: Evidence) -> Iterator[Fault]:
    """Bodies with friction and no bounce that go on and on after a push, and hardly touch anything."""
    space, contacts = evidence.contents.space, evidence.contacts[0]
    if tuple(space.gravity) != (0, 0) or space.damping != 1:
        return
    speeds: dict[int, list[float]] = defaultdict(list)
    for step in evidence.steps:
        rows = step.after.bodies
        for body, speed in zip(rows["id"].tolist(), np.hypot(*rows["velocity"].T).tolist(), strict=True):
            speeds[body].append(speed)
    for body in evidence.contents.bodies:
        touching = int(((contacts["body_a"] == body.id) | (contacts["body_b"] == body.id)).sum())
        shapes = evidence.contents.solid_of.get(id(body), ())
        is_rough = any(shape.friction for shape in shapes) and not any(shape.elasticity for shape in shapes)
        speed = speeds.get(body.id, [0.0])
        is_going = 0 < max(speed) * KEPT_SPEED < speed[-1] and len(speed) > MIN_RESTING
        is_pushed = body in evidence.contents.origins.pushes
        is_free = is_pushed and is_dynamic(body) and not body.constraints and body._velocity_func is None
        if is_rough and is_going and is_free and touching < FRICTION_STEPS * len(evidence.steps):
            what = f"still goes at {speed[-1]:.3g} px/s, and touched something in {touching} steps"
            yield Fault(1, evidence.report([body.id], evidence.steps[-1], what), since=evidence.steps[0].time)


def _hanging(evidence: Evidence) -> Iterator[Fault]:
    """Bodies that sleep, though nothing touches or holds them and gravity pulls."""
    space = evidence.contents.space
    for body in evidence.contents.bodies:
        if not (is_dynamic(body) and body.is_sleeping and space.gravity.length) or body.constraints:
            continue
        solid = evidence.contents.solid_of.get(id(body), [])
        near = [hit.shape for shape in solid for hit in space.shape_query(shape) if hit.shape not in solid]
        holds = [each for each in near if each and not each.sensor and any(may_collide(shape, each) for shape in solid)]
        if solid and not holds:
            yield Fault(1, evidence.report([body.id], evidence.steps[-1], "sleeps, and touches nothing"), since=None)


def _gone(evidence: Evidence) -> Iterator[Fault]:
    """Bodies that are now far outside of the box in which all were when they were first seen."""
    first: dict[int, Floats] = {}
    for step in evidence.steps:
        rows = step.before.bodies
        if (len(rows) and int(rows["id"][-1]) not in first) or len(rows) > len(first):
            first = {**dict(zip(rows["id"].tolist(), rows["position"], strict=True)), **first}
    places = np.array([place for place in first.values() if np.isfinite(place).all()]).reshape(-1, 2)
    low, high = places.min(axis=0, initial=0.0), places.max(axis=0, initial=0.0)
    size = MARGIN * max(float((high - low).max(initial=0)), 100.0)
    last = evidence.steps[-1].after.bodies
    outside = ((last["position"] < low - size) | (last["position"] > high + size)).any(axis=1)
    for body in last["id"][outside & np.isfinite(last["mass"])].tolist():
        if body in evidence.recording.bodies:
            yield Fault(1, evidence.report([body], evidence.steps[-1], "is far off"), since=evidence.steps[-1].end)


def _at_the_end(find: Callable[[Contents], Iterator[Fault]]) -> Callable[[Evidence], Iterator[Fault]]:
    """Return a rule for how a Space is set up as one that looks at what touched in a run."""
    return lambda evidence: find(evidence.after_run)


STEP_RULES: Final[Rules[Evidence]] = {
    "wrong-point": _wrong_points,
    "contacts-within": _contacts_within,
    "seams": _caught,
    "moved-by-hand": _moved,
    "pushed-by-hand": lambda evidence: iter(evidence.too_deep["pushed-by-hand"]),
    "friction-untouched": _untouched,
    "passed-through": _passed,
    "hangs": _hanging,
    "joint-stretched": _stretched,
    "sinks-in": lambda evidence: iter(evidence.too_deep["sinks-in"]),
    "deep-at-once": lambda evidence: iter(evidence.too_deep["deep-at-once"]),
    "jitters": _jittery,
    "leaves": _gone,
}
MET_RULES: Final[Rules[Evidence]] = {rule: _at_the_end(find) for rule, find in END_RULES.items()}
