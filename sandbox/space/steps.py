"""What the recorded steps of a Space show: the rules that look at them."""

import math
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import combinations, pairwise
from typing import Any, Final, NamedTuple

import numpy as np
import pymunk

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
from sandbox.space.energy import pair_key
from sandbox.space.findings import Fault, Rules
from sandbox.space.passages import Passage
from sandbox.space.recording import Numbers, Recording, Rows, Run, Step
from sandbox.space.rules import END_RULES
from sandbox.state import Floats

MAX_STRETCH: Final = 0.1  # of the joint's length, or half that of the bodies that it connects
MAX_DEPTH: Final = 0.5  # of the smaller half width, beyond collision_slop, in an impact
MAX_LASTING_DEPTH: Final = 0.25
LASTING: Final = 0.2  # s: as long as that, an overlap is no impact
WITHIN: Final = 1.0  # s, in which what lasts does so for LASTING
SHRINKS: Final = 0.99  # of the depth a step before: Pymunk pushes bodies apart, unless something holds them
MOST: Final = 0.5  # of the steps
MANY_MOVES: Final = 10  # steps before which the program set a body's position
MIN_RESTING: Final = 30  # steps
RESTING_SPEED: Final = 2.0  # in units of what gravity adds in a step: slower bodies count as at rest
CAUGHT: Final = 0.2  # of its speed, that a body loses at a seam
ALONG: Final = 0.7  # cosine: a normal that far off a floor's pushes along the floor
MARGIN: Final = 10.0  # of the size of the world, beyond which bodies have left it
FRICTION_STEPS: Final = 0.05  # of the steps: with contacts in fewer, nothing rubs on a body
KEPT_SPEED: Final = 0.8  # of its largest speed: slower in the end, something has slowed a body
MAX_MASS_RATIO: Final = 100.0
DT_VARIES: Final = 1e-6  # relative, above rounding


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
    passages: Sequence[Passage] = ()

    @cached_property
    def run(self) -> Run:
        """The columns of the recording."""
        return Run(self.recording)

    @cached_property
    def overlaps(self) -> list[Series]:
        """The depth of the deepest point of each pair of bodies, where they overlap, px."""
        step, contacts = self.run.contacts
        deep = contacts["distance"] < 0
        step, contacts = step[deep], contacts[deep]
        found = []
        for rows in by_key(pair_key(contacts, "body"), step):
            at, first = np.unique(step[rows], return_index=True)
            found.append(Series(contacts[rows[0]], at, np.maximum.reduceat(-contacts["distance"][rows], first)))
        return found

    @cached_property
    def stretches(self) -> list[Series]:
        """How far joints that may pull as hard as they need are off their law, once that has begun to grow."""
        step, joints = self.run.joints
        hard = np.isinf(joints["max_force"])
        step, joints = step[hard], joints[hard]
        found = []
        for rows in by_key(joints["key"], step):
            values = np.abs(joints["error"][rows])
            grows = np.flatnonzero(np.diff(values, prepend=0.0) > 0)
            begin = grows[0] if len(grows) else len(values)
            if begin == 0 and len(grows) > 1 and values[0] > values[1]:  # it was off when it was added
                begin = grows[1]
            if begin < len(values):
                found.append(Series(joints[rows[0]], step[rows][begin:], values[begin:]))
        return found

    @cached_property
    def met(self) -> Contents:
        """What the Space has now, and which of its shapes touched, in the order of time."""
        step, contacts = self.run.contacts
        found = []
        for rows in by_key(pair_key(contacts, "shape"), step):
            a, b = (self.recording.shapes.get(int(contacts[side][rows[0]])) for side in ("shape_a", "shape_b"))
            if a and b and a.body and b.body:
                largest = (float(contacts[name][rows].max()) for name in ("elasticity", "friction"))
                found.append(Meeting(a, b, self.run.steps[step[rows[0]]].end, *largest))
        return replace(self.contents, meetings=found)

    @cached_property
    def touching(self) -> set[tuple[int, int]]:
        """The bodies that touched something, with the number of the step."""
        step, contacts = self.run.contacts
        return {
            pair for side in ("body_a", "body_b") for pair in zip(step.tolist(), contacts[side].tolist(), strict=True)
        }

    @cached_property
    def too_deep(self) -> dict[str, list[Fault]]:
        """The overlaps that are too deep, by the rules for why: impacts unless of what sank in before.

        What is crushed is thrown about then, and its impacts are no cause.
        """
        found = [(each.ends, *deep) for each in self.overlaps if (deep := _deep_overlap(self, each))]
        faults: dict[str, list[Fault]] = defaultdict(list)
        sunk: set[int] = set()
        for ends, rule, fault in sorted(found, key=lambda each: each[2].since or 0.0):
            moving = {body.id for body in self.bodies(*ends) if is_dynamic(body)}
            if rule == "sinks-in":
                sunk |= moving
            if rule == "sinks-in" or not moving & sunk:
                faults[rule].append(fault)
        return faults

    def placed(self, number: int, ends: tuple[int, int]) -> float:
        """Return how far the program put one of two bodies elsewhere before a step, by its number, px."""
        step, old, new = self.run.set
        at = (step == number) & np.isin(old["id"], ends)
        return float(np.hypot(*(new["position"] - old["position"])[at].T).max(initial=0.0))

    def driven(self, steps: Numbers, ends: tuple[int, int]) -> int:
        """Return before how many of some steps, by their numbers, the program changed the velocity of two bodies."""
        step, old, new = self.run.set
        is_changed = (old["velocity"] != new["velocity"]).any(axis=1)
        return len(np.unique(step[is_changed & np.isin(step, steps) & np.isin(new["id"], ends)]))

    def lasts(self, steps: Numbers) -> bool:
        """Return whether some steps, by their numbers, follow so closely that they are more than an impact."""
        ends = self.run.time[1:][steps]
        count = math.ceil(LASTING / self.run.dt[steps[0]]) if len(steps) else 0
        return bool(len(steps)) and bool(((ends[count:] - ends[:-count]) < WITHIN).any())

    def came_in(self, number: int, *ids: int) -> bool:
        """Return whether one of some bodies was not in the Space before a step, by its number."""
        known = [body for body in ids if body in self.recording.bodies]
        return number == 0 or not np.isin(known, self.run.steps[number - 1].after.bodies["id"]).all()

    def half_width(self, *ids: int) -> float:
        """Return the smallest half width of the shapes of those of some bodies that move by forces, px."""
        shapes = [shape for body in self.bodies(*ids) if is_dynamic(body) for shape in body.shapes]
        return min(filter(None, map(half_width, shapes)), default=math.inf)

    def bodies(self, *ids: int) -> list[pymunk.Body]:
        """Return those of some bodies that are not the Space's own static one."""
        return [self.recording.bodies[body] for body in ids if body in self.recording.bodies]

    def fault(
        self, ids: Sequence[int], step: Step, what: str, size: float = 1.0, figure: str = "", since: float | None = None
    ) -> Fault:
        """Return the fault of the first dynamic body of some, where it was after a step.

        what: is wrong with it, where `{}` is the name of the body that is left; since: s, by default the step's end.
        """
        bodies = [self.recording.bodies.get(body) or self.contents.space.static_body for body in ids]
        first, *rest = sorted(bodies, key=lambda body: not is_dynamic(body))
        report = self.contents.report(first, what.format(*map(self.contents.name, rest)))
        rows = step.after.bodies
        for x, y in rows["position"][rows["id"] == first.id].tolist():
            report = replace(report, position=(x, y))
        return Fault(report, size, figure, step.end if since is None else since)

    def figures(self) -> dict[str, float]:
        """Return the figures of the rules whose cures can be tried: px, bodies, or a share of steps."""
        deepest = max((overlap.worst[1] for overlap in self.overlaps), default=0.0)
        return {
            "passed-through": float(len(self.passages)),
            "joint-stretched": max((each.worst[1] for each in self.stretches), default=0.0),
            "sinks-in": deepest,
            "deep-at-once": deepest,
            "jitters": 100 * max(reversals(self.run).values(), default=0.0),
        }


def by_key(keys: Rows, step: Numbers) -> list[Numbers]:
    """Return the rows of each key, by step; keys in the order of their first rows: addresses differ from run to run."""
    _, begin, group = np.unique(keys, return_index=True, return_inverse=True)
    group = begin.argsort().argsort()[group]
    order = np.lexsort((step, group))
    return np.split(order, np.bincount(group).cumsum()[:-1]) if len(order) else []


def _steps_vary(evidence: Evidence) -> Iterator[Fault]:
    dt = np.array([step.dt for step in evidence.recording.steps])
    if dt.max() > dt.min() * (1 + DT_VARIES):
        since = evidence.recording.steps[int((dt != dt[0]).argmax())].time
        yield Fault(None, figure=f"from {dt.min():.4g} to {dt.max():.4g} s", since=since)


def _not_finite(evidence: Evidence) -> Iterator[Fault]:
    if step := evidence.run.broken:
        for row in step.after.bodies:
            if not np.isfinite([*row["position"], *row["velocity"], row["angle"], row["spin"]]).all():
                (x, y), (u, v) = row["position"], row["velocity"]
                what = f"position ({x:.4g}, {y:.4g}), velocity ({u:.4g}, {v:.4g})"
                yield evidence.fault([int(row["id"])], step, what)


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
        what = f"{how}; {cures} prevents that"
        yield evidence.fault([body.id for body in bodies], step, what, way / half if half else math.inf)


def _stretched(evidence: Evidence) -> Iterator[Fault]:
    """Joints that stretch by more than a part of their length, or of half that of what they connect."""
    for stretch in evidence.stretches:
        joint = evidence.recording.joints[int(stretch.first["key"])]
        sizes = [half_length(shape) for body in evidence.bodies(*stretch.ends) for shape in body.shapes]
        length = max([getattr(joint, "distance", getattr(joint, "max", 0.0)), *sizes])
        number, error = stretch.worst
        if length and error > MAX_STRETCH * length:
            masses = [body.mass for body in (joint.a, joint.b) if is_dynamic(body) and body.mass]
            ratio = max(masses) / min(masses) if masses else 1.0
            differ = f"; their masses differ {ratio:.3g} times" if ratio > MAX_MASS_RATIO else ""
            worst, off = evidence.run.steps[number], f"{error:.3g} px"
            what = f"its {type(joint).__name__} to {{}} is off by {off} at {worst.end:.3f} s{differ}"
            since = evidence.run.steps[stretch.steps[(stretch.values > MAX_STRETCH * length).argmax()]].end
            yield evidence.fault(stretch.ends, worst, what, error / length, off, since)


def _deep_overlap(evidence: Evidence, overlap: Series) -> tuple[str, Fault] | None:
    """Return the rule for why an overlap is too deep, if it is; not of bodies that came into the Space so."""
    ends, slop, half = overlap.ends, evidence.contents.space.collision_slop, evidence.half_width(*overlap.ends)
    before = np.where(np.diff(overlap.steps, prepend=-2) == 1, np.roll(overlap.values, 1), 0.0)
    is_held = overlap.values > SHRINKS * before  # otherwise Pymunk is pushing them apart
    lasting = overlap.steps[(overlap.values > slop + MAX_LASTING_DEPTH * half) & is_held]
    is_lasting = evidence.lasts(lasting)
    deep = lasting if is_lasting else overlap.steps[overlap.values > slop + MAX_DEPTH * half]
    if not len(deep) or evidence.came_in(deep[0], *ends):
        return None
    number, depth = overlap.worst
    at = overlap.steps == deep[0]
    is_impact = not is_lasting and bool((before[at] < overlap.values[at] / 2).all())
    if is_impact and evidence.placed(deep[0], ends) > depth / 2:
        return None  # the program put one into the other
    worst, since = evidence.run.steps[number], evidence.run.steps[deep[0]].end
    times = evidence.driven(deep, ends)
    driven = f"; the program changed its velocity before {times} of the steps" if times > MOST * len(deep) else ""
    what = f"{depth:.3g} px deep in {{}} at {worst.end:.3f} s{driven}"
    return "deep-at-once" if is_impact else "sinks-in", evidence.fault(
        ends, worst, what, depth / half, f"{depth:.3g} px", since
    )


def reversals(run: Run) -> dict[int, float]:
    """Return how often bodies at rest reverse their velocity, as a share of the steps, by their id.

    A body is at rest while it is slower than what gravity adds in two steps. Reversals count from a tenth of that on,
    of bodies that were at rest for MIN_RESTING steps.
    """
    step, _, new = run.moved
    gravity = np.array([math.hypot(*each.before.settings.gravity) for each in run.steps])
    limit, speed = (RESTING_SPEED * gravity * run.dt)[step], np.hypot(*new["velocity"].T)
    resting = np.isfinite(new["mass"]) & ~new["asleep"] & (speed > 0) & (speed < limit)
    step, rows, limit = step[resting], new[resting], limit[resting]
    shares = {}
    for at in by_key(rows["id"], step):
        if len(at) >= MIN_RESTING:
            velocity = rows["velocity"][at]
            turns = (velocity[1:] * velocity[:-1]).sum(axis=1) < -((limit[at][1:] / 10) ** 2)
            shares[int(rows["id"][at[0]])] = float(turns.sum() / len(at))
    return shares


def _jittery(evidence: Evidence) -> Iterator[Fault]:
    for body, share in reversals(evidence.run).items():
        if share > MOST and body in evidence.recording.bodies:
            what = f"turns back in {100 * share:.0f} % of its steps at rest"
            yield evidence.fault([body], evidence.run.steps[-1], what, share, since=evidence.run.steps[0].time)


def _moved(evidence: Evidence) -> Iterator[Fault]:
    """Bodies whose positions the program sets again and again.

    Of kinematic ones, those that touch something then, and are moved further than their own velocity moves them, which
    would be a correction.
    """
    step, old, new = evidence.run.set
    way = np.hypot(*(new["position"] - old["position"]).T)
    step, new, way = step[way > 0], new[way > 0], way[way > 0]
    is_further = way > np.hypot(*new["velocity"].T) * evidence.run.dt[step]
    for rows in by_key(new["id"], step):
        body, matters = int(new["id"][rows[0]]), rows.tolist()
        if not all(map(is_dynamic, evidence.bodies(body))):
            matters = [row for row in matters if is_further[row] and (int(step[row]), body) in evidence.touching]
        if len(matters) > MANY_MOVES:
            first = evidence.run.steps[step[matters[0]]]
            what = f"before {len(rows)} of the steps"
            yield evidence.fault([body], first, what, len(matters), since=first.time)


def _wrong_points(evidence: Evidence) -> Iterator[Fault]:
    """Bodies that the program pushed at points far outside of them."""
    for body, push in evidence.contents.origins.pushes.items():
        size = max(map(half_length, body.shapes), default=math.inf)
        if body.space is evidence.contents.space and push.lever > 4 * size and math.isfinite(body.moment):
            where = "the Space" if "local" in push.call else "the body"
            what = f"{push.call} in {push.line}: {push.lever:.3g} px off, as if the point were one of {where}"
            yield evidence.contents.fault(body, what, push.lever / size)._replace(since=evidence.run.steps[0].time)


def _contacts_within(evidence: Evidence) -> Iterator[Fault]:
    """Bodies that joints hold together, directly or through others, and that press on each other most of the time."""
    assembly: dict[int, set[int]] = {}  # of each dynamic body: the bodies that joints hold together, shared by all
    for joint in evidence.recording.joints.values():
        if is_dynamic(joint.a) and is_dynamic(joint.b):
            joined = assembly.get(joint.a.id, {joint.a.id}) | assembly.get(joint.b.id, {joint.b.id})
            assembly |= dict.fromkeys(joined, joined)
    step, contacts = evidence.run.contacts
    for rows in by_key(pair_key(contacts, "body"), step) if assembly else ():
        first, at = contacts[rows[0]], np.unique(step[rows])
        ends = int(first["body_a"]), int(first["body_b"])
        is_mostly = len(at) > MOST * (len(evidence.run.steps) - at[0])
        if ends[1] in assembly.get(ends[0], ()) and is_mostly and evidence.lasts(at):
            what = f"presses on {{}}, in {len(at)} steps, though joints hold both"
            yield evidence.fault(ends, evidence.run.steps[at[0]], what, len(at))


class _Seam(NamedTuple):
    """Where the sides of two polygons continue each other: the place, px, and the direction out of both."""

    place: pymunk.Vec2d
    out: pymunk.Vec2d


def _seams(contents: Contents) -> dict[pymunk.Shape | None, list[_Seam]]:
    """Return the seams of static polygons."""
    ends: dict[tuple[int, ...], list[tuple[pymunk.Shape, _Seam]]] = defaultdict(list)
    for shape in contents.solid:
        if isinstance(shape, pymunk.Poly) and is_static(body_of(shape)):
            corners = [body_of(shape).local_to_world(corner) for corner in corners_of(shape)]
            for a, b in pairwise([*corners, corners[0]]):
                out = (b - a).perpendicular().normalized() * -1
                for end in (a, b):
                    key = round(end.x), round(end.y), round(8 * out.x), round(8 * out.y)
                    ends[key].append((shape, _Seam(end, out)))
    seams: dict[pymunk.Shape | None, list[_Seam]] = defaultdict(list)
    for meeting in ends.values():
        for (first, seam), (second, _) in combinations(meeting, 2):
            if first is not second:
                seams[first].append(seam)
                seams[second].append(seam)
    return seams


def _caught(evidence: Evidence) -> Iterator[Fault]:
    """Bodies that a contact at a seam turned back or stopped, along the floor on which they are."""
    seams, shapes = _seams(evidence.contents), evidence.recording.shapes
    for number, row in zip(*evidence.run.contacts, strict=True) if seams else ():
        for side, mover, sign in (("a", "b", 1.0), ("b", "a", -1.0)):
            wall, step = shapes.get(int(row[f"shape_{side}"])), evidence.run.steps[number]
            bodies = step.before.bodies
            if wall not in seams:
                continue
            body = bodies[bodies["id"] == row[f"body_{mover}"]]
            if not len(body) or not row["impulse"] >= CAUGHT * body["mass"][0] * np.hypot(*body["velocity"][0]) > 0:
                continue
            normal = sign * row["normal"]  # towards the mover
            place = body["position"][0] + body["velocity"][0] * step.dt + row[f"arm_{mover}"]
            size = evidence.half_width(int(row[f"body_{mover}"]))
            for seam in seams[wall]:
                off = place - np.array(seam.place)
                if abs(normal @ np.array(seam.out)) < ALONG and abs(off @ normal) < size / 4 and np.hypot(*off) < size:
                    x, y = seam.place
                    what = f"is caught where two polygons meet, at ({x:.4g}, {y:.4g}), at {step.end:.3f} s"
                    yield evidence.fault([int(row["body_a"]), int(row["body_b"])], step, what)
                    break


def _untouched(evidence: Evidence) -> Iterator[Fault]:
    """Bodies with friction and no bounce that go on and on after a push, and hardly touch anything."""
    space, (_, contacts) = evidence.contents.space, evidence.run.contacts
    if tuple(space.gravity) != (0, 0) or space.damping != 1:
        return
    new = evidence.run.moved.new
    for body in evidence.contents.bodies:
        speed = np.hypot(*new["velocity"][new["id"] == body.id].T)
        touching = int(((contacts["body_a"] == body.id) | (contacts["body_b"] == body.id)).sum())
        shapes = evidence.contents.solid_of.get(id(body), ())
        is_rough = any(shape.friction for shape in shapes) and not any(shape.elasticity for shape in shapes)
        is_going = len(speed) > MIN_RESTING and 0 < speed.max() * KEPT_SPEED < speed[-1]
        is_pushed = body in evidence.contents.origins.pushes
        is_free = is_pushed and is_dynamic(body) and not body.constraints and body._velocity_func is None
        if is_rough and is_going and is_free and touching < FRICTION_STEPS * len(evidence.run.steps):
            what = f"still goes at {speed[-1]:.3g} px/s, and touched something in {touching} steps"
            yield evidence.fault([body.id], evidence.run.steps[-1], what, since=evidence.run.steps[0].time)


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
            what = "sleeps, and touches nothing"
            yield evidence.fault([body.id], evidence.run.steps[-1], what)._replace(since=None)


def _gone(evidence: Evidence) -> Iterator[Fault]:
    """Bodies that are now far outside of the box in which all were when they were first seen."""
    old = evidence.run.moved.old
    _, first = np.unique(old["id"], return_index=True)
    places = np.append(old["position"][first], [[0.0, 0.0]], axis=0)
    low, high = places.min(axis=0), places.max(axis=0)
    size = MARGIN * max(float((high - low).max()), 100.0)
    step = evidence.run.steps[-1]
    last = step.after.bodies
    outside = ((last["position"] < low - size) | (last["position"] > high + size)).any(axis=1)
    for body in last["id"][outside & np.isfinite(last["mass"])].tolist():
        if body in evidence.recording.bodies:
            yield evidence.fault([body], step, "is far off")


def _met(find: Callable[[Contents], Iterator[Fault]], evidence: Evidence) -> Iterator[Fault]:
    """Yield the faults of a rule for how a Space is set up, by what touched in a run."""
    return find(evidence.met)


ALWAYS: Final[Rules[Evidence]] = {
    "dt-varies": _steps_vary,
    "not-finite": _not_finite,
}  # also of a first step that fails
STEP_RULES: Final[Rules[Evidence]] = {
    **ALWAYS,
    "wrong-point": _wrong_points,
    "contacts-within": _contacts_within,
    "seams": _caught,
    "moved-by-hand": _moved,
    "friction-untouched": _untouched,
    "passed-through": _passed,
    "hangs": _hanging,
    "joint-stretched": _stretched,
    "sinks-in": lambda evidence: iter(evidence.too_deep["sinks-in"]),
    "deep-at-once": lambda evidence: iter(evidence.too_deep["deep-at-once"]),
    "jitters": _jittery,
    "leaves": _gone,
    **{rule: partial(_met, find) for rule, find in END_RULES.items()},
}
