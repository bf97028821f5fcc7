"""What the recorded steps of a Space show: the rules that look at them, and the account of its energy."""

import math
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise, takewhile
from typing import Any, Final, NamedTuple

import numpy as np
import pymunk
from numpy.typing import NDArray

from sandbox.space.causes import Cause
from sandbox.space.contents import Contents, half_length, half_width, is_dynamic, is_static, shape_words
from sandbox.space.energy import LARGEST, Ledger, ledger_of
from sandbox.space.figures import (
    IN_ANGLE,
    LAWLESS,
    Hit,
    Series,
    escapes,
    hits,
    jitter,
    joint_residuals,
    meetings,
    overlaps,
    residuals,
    stretches,
    wrong_bounces,
)
from sandbox.space.findings import BodyReport, Fault, Finding, Rules, found_by
from sandbox.space.mechanics import Floats, Rows, common, is_within
from sandbox.space.passages import Passage, Passages
from sandbox.space.recording import Recording, Step
from sandbox.space.rules import PRODUCT_RULES, passing_words

MAX_STRETCH: Final = 0.05  # of the joint's length, or half that of the bodies that it connects
MAX_ANGLE: Final = 0.1  # rad, of a joint's angle off its law
MAX_DEPTH: Final = 0.5  # of the smaller half width, beyond collision_slop, in an impact
MAX_LASTING_DEPTH: Final = 0.25
LASTING: Final = 0.2  # s: as long as that, an overlap is no impact
WITHIN: Final = 1.0  # s, in which contacts that carry too little do so for LASTING
MAX_CREEP: Final = 0.25  # of the smaller half width
MAX_REVERSALS: Final = 0.5  # of the steps of a body at rest
MIN_PUSHES: Final = 3  # of a body, into others or at points in other coordinates
MOST: Final = 0.5  # of the steps
MANY_MOVES: Final = 10  # steps before which the program set a body's position
MAX_JOINT_ENERGY: Final = 0.01  # of the largest kinetic energy
CALLBACK: Final = 1e-6  # of the largest kinetic energy, in a step: above rounding


@dataclass(frozen=True)
class Evidence:
    """A recording, what the Space has now, and contacts that were seen to be set by a handler while it ran."""

    recording: Recording
    contents: Contents
    set_by_handler: Sequence[Fault] = ()

    @cached_property
    def steps(self) -> list[Step]:
        """The steps that are kept, until one leaves a number that is not finite, or too large; at least one."""
        steps = list(self.recording)
        return steps[:1] + list(takewhile(lambda step: is_within(LARGEST, step.after), steps[1:]))

    @cached_property
    def ledger(self) -> Ledger:
        """The energy ledger of these steps."""
        return ledger_of(self.steps)

    def findings(self) -> list[Finding]:
        """Return what the steps show."""
        return found_by({**MET_RULES, **STEP_RULES}, self)

    @cached_property
    def after_run(self) -> Contents:
        """What the Space has now, and which of its shapes touched."""
        return replace(self.contents, met=meetings(self.steps, self.recording.roster.by_address))

    @cached_property
    def passages(self) -> list[Passage]:
        """The bodies that passed each other, each pair once."""
        return list(Passages(self.recording, self.contents.space))

    @cached_property
    def too_fast(self) -> "dict[frozenset[int], _FastHit]":
        """By two bodies that hit, but did not pass each other: their hit that came nearest to that, if it was near."""
        return _fast_hits(self)

    @cached_property
    def too_deep(self) -> dict[str, list[Fault]]:
        """The overlaps that are too deep, the deepest first, by the rules for why."""
        faults: dict[str, list[Fault]] = defaultdict(list)
        for rule, fault in filter(None, (_deep_overlap(self, overlap) for overlap in overlaps(self.steps))):
            faults[rule].append(fault)
        return faults

    @cached_property
    def changed_by_callbacks(self) -> NDArray[np.bool_]:
        """(n,) whether more than the recorded impulses changed the energy in a step, or what followed is not finite."""
        ledger = self.ledger
        changed = np.ones(len(self.steps), bool)
        changed[: len(ledger.work)] = np.abs(ledger.of(Cause.CALLBACKS)) > CALLBACK * ledger.scale
        return changed

    @cached_property
    def residuals(self) -> tuple[list[Series], list[Series]]:
        """What the solver left undone at contacts that lasted: approach and slip."""
        return residuals(self.steps)

    @cached_property
    def fall(self) -> Floats:
        """(n,) the speed that gravity adds in each step, px/s."""
        return np.array([math.hypot(*step.before.settings["gravity"]) * step.dt for step in self.steps])

    @cached_property
    def set_by_program(self) -> dict[str, dict[int, NDArray[np.intp]]]:
        """The numbers of the steps, from 0, before which the program set `position` or `velocity`, by body."""
        steps: dict[str, dict[int, list[int]]] = {"position": {}, "velocity": {}}
        for number, (last, step) in enumerate(pairwise(self.steps), 1):
            if last.after is not step.before:
                old, new = common(last.after.bodies, step.before.bodies)
                for name, of_body in steps.items():
                    for body in np.sort(old["id"][(old[name] != new[name]).any(axis=1)]).tolist():
                        of_body.setdefault(body, []).append(number)
        return {name: {body: np.array(each) for body, each in of_body.items()} for name, of_body in steps.items()}

    def pushes_together(
        self, number: int, ends: tuple[int, int], by: Sequence[str] = ("position", "velocity")
    ) -> float:
        """Return how far the program pushed two bodies into each other before a step, by its number, px.

        That is by the position or velocity that it set, along the normal of their deepest contact in the step.
        """
        step, last = self.steps[number], self.steps[max(0, number - 1)].after
        deepest, pushes = _deepest(step, ends), np.zeros(2)
        for side, sign in (("a", 1), ("b", -1)) if last is not step.before else ():
            old, new = (rows[rows["id"] == deepest[f"body_{side}"]] for rows in (last.bodies, step.before.bodies))
            for name in by if len(old) and len(new) else ():
                time = step.dt if name == "velocity" else 1.0
                pushes += sign * time * (new[name][0] - old[name][0])
        return float(pushes @ deepest["normal"][0])

    def lasts(self, steps: NDArray[np.intp]) -> bool:
        """Return whether some steps, by their numbers, follow so closely that they are more than an impact."""
        ends = np.array([self.steps[number].end for number in steps])
        count = math.ceil(LASTING / self.steps[steps[0]].dt) if len(steps) else 0
        return bool(len(steps)) and bool(((ends[count:] - ends[:-count]) < WITHIN).any())

    def came_in(self, step: Step, *ids: int) -> bool:
        """Return whether one of some bodies was not in the Space before a step."""
        row = step.number - self.steps[0].number
        known = [body for body in ids if self.recording.body(body)]
        return row == 0 or not np.isin(known, self.steps[row - 1].after.bodies["id"]).all()

    def shapes(self, *ids: int) -> Iterator[pymunk.Shape]:
        """Yield the shapes of some bodies."""
        for body in filter(None, map(self.recording.body, ids)):
            yield from body.shapes

    def half_width(self, *ids: int) -> float:
        """Return the smallest half width of the shapes of those of some bodies that move by forces, px."""
        shapes = self.shapes(*filter(self.is_dynamic, ids))
        return min(filter(None, map(half_width, shapes)), default=math.inf)

    def report(self, ids: tuple[int, int] | tuple[int], step: Step, detail: str) -> BodyReport:
        """Name the first dynamic body of some, where it was after a step, and what is wrong with it.

        detail: `{}` is the name of the body that is left.
        """
        first, *rest = sorted(ids, key=lambda body: not self.is_dynamic(body))
        body = self.recording.body(first) or self.contents.space.static_body
        report = self.contents.report(body, detail.format(*map(self._name, rest)))
        rows = step.after.bodies
        place = rows["position"][rows["id"] == first]
        return replace(report, position=(float(place[0, 0]), float(place[0, 1]))) if len(place) else report

    def is_dynamic(self, body_id: int) -> bool:
        """Return whether a body moves by forces."""
        body = self.recording.body(body_id)
        return body is not None and is_dynamic(body)

    def _name(self, body_id: int) -> str:
        body = self.recording.body(body_id)
        if body is None:
            return "the Space's static body"
        report = self.contents.report(body, "")
        return report.kind if report.index is None else f"body {report.index}, {report.kind},"


def _deepest(step: Step, ends: tuple[int, int]) -> Rows:
    """Return the deepest contact of two bodies, by id, that touch in a step, as a table of one row."""
    contacts = step.after.contacts
    pair = contacts[np.isin(contacts["body_a"], ends) & np.isin(contacts["body_b"], ends)]
    return pair[[pair["distance"].argmin()]]


def _stretched(evidence: Evidence) -> Iterator[Fault]:
    """Joints that may pull as hard as they need to, and are off their law."""
    for stretch in stretches(evidence.steps):
        joint, is_angle = evidence.recording.joint(int(stretch.first["key"])), stretch.first["kind"] in IN_ANGLE
        limit = MAX_ANGLE if is_angle else _max_stretch(joint, evidence.shapes(*stretch.ends))
        over, (number, error) = np.abs(stretch.values) > limit, stretch.worst
        if math.isinf(joint.max_force) and over.any():
            worst, first = evidence.steps[number], evidence.steps[stretch.steps[over.argmax()]]
            off = f"{abs(error):.3g} {'rad' if is_angle else 'px'}"
            what = f"its {type(joint).__name__} to {{}} is off by {off} at {worst.end:.3f} s"
            yield Fault(abs(error) / limit, evidence.report(stretch.ends, worst, what), off, since=first.end)


def _max_stretch(joint: pymunk.Constraint, shapes: Iterable[pymunk.Shape]) -> float:
    length = getattr(joint, "distance", getattr(joint, "max", 0.0))
    return MAX_STRETCH * max([length, *map(half_length, shapes)])


def _deep_overlap(evidence: Evidence, overlap: Series) -> tuple[str, Fault] | None:
    """Return the rule for why an overlap is too deep, if it is; not of bodies that came into the Space so."""
    ends, slop = overlap.ends, evidence.contents.space.collision_slop
    half = evidence.half_width(*ends)
    lasting = overlap.steps[(overlap.values > slop + MAX_LASTING_DEPTH * half) & _is_held(evidence, overlap)]
    is_lasting = evidence.lasts(lasting)
    deep = lasting if is_lasting else overlap.steps[overlap.values > slop + MAX_DEPTH * half]
    if not len(deep) or evidence.came_in(evidence.steps[deep[0]], *ends):
        return None
    rule = _why_deep(evidence, overlap, deep, is_lasting=is_lasting)
    if rule == "deep-at-once":
        if frozenset(ends) in evidence.too_fast:
            return None
        late = ~_is_placed(evidence, overlap)
        overlap = overlap._replace(steps=overlap.steps[late], values=overlap.values[late])
        deep = deep[np.isin(deep, overlap.steps)]
        if not len(deep):
            return None
    number, depth = overlap.worst
    worst = evidence.steps[number]
    report = evidence.report(ends, worst, f"{depth:.3g} px deep in {{}} at {worst.end:.3f} s")
    return rule, Fault(depth, report, f"{depth:.3g} px", since=evidence.steps[deep[0]].end)


def _is_placed(evidence: Evidence, overlap: Series) -> NDArray[np.bool_]:
    """Return which steps of an overlap follow from one in which the program put a body into the other: (n,).

    Without a step apart between them, and by more than half the depth at the first.
    """
    begins = np.flatnonzero(np.diff(overlap.steps, prepend=-2) != 1)
    placed = [
        evidence.pushes_together(int(overlap.steps[at]), overlap.ends, by=("position",)) > overlap.values[at] / 2
        for at in begins
    ]
    return np.repeat(placed, np.diff(begins, append=len(overlap.steps)))


def _is_held(evidence: Evidence, overlap: Series) -> NDArray[np.bool_]:
    """Return whether something holds two bodies in each other in each step in which they overlap, or presses them.

    Otherwise Pymunk lets its part `collision_bias` to the power of dt remain of an overlap; here, half the way there.
    """
    space = evidence.contents.space
    beyond = np.maximum(overlap.values - space.collision_slop, 0.0)
    lengths = np.array([evidence.steps[number].dt for number in overlap.steps])
    before = np.where(np.diff(overlap.steps, prepend=-2) == 1, np.roll(beyond, 1), 0.0)
    return np.asarray(beyond > (1 + space.collision_bias**lengths) / 2 * before)


def _why_deep(evidence: Evidence, overlap: Series, deep: NDArray[np.intp], *, is_lasting: bool) -> str:
    """Return the rule for what makes an overlap deep: the program, again and again, until it is deepest; or not."""
    ends, slop = overlap.ends, evidence.contents.space.collision_slop
    pushed = np.array([evidence.pushes_together(number, ends) > slop for number in overlap.steps.tolist()])
    growing = np.isin(overlap.steps, deep) & (overlap.steps <= overlap.steps[overlap.values.argmax()])
    if pushed.sum() >= MIN_PUSHES and pushed[growing].mean() > MOST:
        return "pushed-by-hand"
    first = int(np.flatnonzero(overlap.steps == deep[0])[0])
    is_apart = not first or overlap.steps[first - 1] < deep[0] - 1
    is_impact = is_apart or overlap.values[first - 1] < overlap.values[first] / 2
    return "deep-at-once" if is_impact and not is_lasting else "sinks-in"


def _passed(evidence: Evidence) -> Iterator[Fault]:
    """Bodies that passed each other: each body once."""
    reported: set[int] = set()
    for passage in evidence.passages:
        mover, target, step, way = passage.mover, passage.target, passage.step, passage.way
        light = next(body for body in (mover, target) if evidence.is_dynamic(body))
        if light in reported:
            continue
        reported.add(light)
        half = half_width(passage.shape)
        widest = half + half_width(passage.wall)
        cures = f"dt below {widest / way * step.dt:.2g} s" if widest else ""
        if passage.wall.body and is_static(passage.wall.body):
            how = f"{way:.3g} px in the step, through a {shape_words(passage.wall)}"
            cures += f"{' or ' if widest else ''}a wall {2 * (way - half):.3g} px thick"
        else:
            how = f"went {way:.3g} px through {{}} in the step"
        report = evidence.report((mover, target), step, f"{how}; {cures} prevents that")
        yield Fault(way / widest if widest else math.inf, report, since=step.end)


class _FastHit(NamedTuple):
    """A hit of a body with a shape so fast that a step could have carried it through: `size` times that speed."""

    size: float
    hit: Hit
    wall: pymunk.Shape


def _fast_hits(evidence: Evidence) -> dict[frozenset[int], _FastHit]:
    """Return the fastest of such hits by the ids of both bodies.

    A step that begins up to its whole way before the wall ends beyond its middle, if that way is longer than half the
    body and half the wall.
    """
    passed = {
        (body, wall)
        for each in evidence.passages
        for body in (each.mover, each.target)
        for wall in (each.shape, each.wall)
    }
    worst: dict[frozenset[int], _FastHit] = {}
    for hit in hits(evidence.steps):
        pair, wall = frozenset((hit.body, hit.other_body)), evidence.recording.roster.by_address.get(hit.other)
        if wall and wall.body and evidence.is_dynamic(hit.body) and (hit.body, wall) not in passed:
            size = hit.speed * hit.step.dt / (hit.reach + half_width(wall))
            if size > max(1.0, worst[pair].size if pair in worst else 0.0) and not evidence.came_in(hit.step, *pair):
                worst[pair] = _FastHit(size, hit, wall)
    return worst


def _too_fast(evidence: Evidence) -> Iterator[Fault]:
    """Bodies that hit others, but did not pass them, so fast that a step could have carried them through."""
    for size, hit, wall in evidence.too_fast.values():
        what = f"a {shape_words(wall)}" if wall.body and is_static(wall.body) else "{}"
        what = f"hit {what} at {hit.speed:.4g} px/s; {passing_words(hit.speed / size)}"
        yield Fault(size, evidence.report((hit.body, hit.other_body), hit.step, what), since=hit.step.end)


def _after_run(find: Callable[[Contents], Iterator[Fault]]) -> Callable[[Evidence], Iterator[Fault]]:
    """Return a rule for how a Space is set up as one that looks at what touched in a run."""
    return lambda evidence: find(evidence.after_run)


def _unsolved(evidence: Evidence) -> Iterator[Fault]:
    """Contacts and joints that bear less than nothing would: off by more than gravity adds in a step, for long."""
    approaches, _ = evidence.residuals
    for contact in approaches:
        yield from _unsolved_for_long(evidence, contact, "goes on into {{}} at {0} px/s at {1} s")
    for residual in joint_residuals(evidence.steps, evidence.recording.joint):
        name = type(evidence.recording.joint(int(residual.first["key"]))).__name__
        yield from _unsolved_for_long(evidence, residual, f"its {name} to {{{{}}}} gives way at {{0}} px/s at {{1}} s")


def _unsolved_for_long(evidence: Evidence, approach: Series, how: str) -> Iterator[Fault]:
    """Yield the fault of an approach. how: what it means, by speed and time."""
    fall = evidence.fall[approach.steps]
    over = (approach.values > fall) & (fall > 0) & ~evidence.changed_by_callbacks[approach.steps]
    steps = approach.steps[over]
    if not evidence.lasts(steps):
        return
    worst = int(np.flatnonzero(over)[approach.values[over].argmax()])
    speed, step = approach.values[worst], evidence.steps[approach.steps[worst]]
    what = f"{how.format(f'{speed:.3g}', f'{step.end:.3f}')}; a step's gravity adds {fall[worst]:.3g}"
    report = evidence.report(approach.ends, step, what)
    yield Fault(float(speed / fall[worst]), report, since=evidence.steps[steps[0]].end)


def _creeping(evidence: Evidence) -> Iterator[Fault]:
    """Contacts that slip though friction is below its limit, by a part of a body."""
    _, slips = evidence.residuals
    for slip in slips:
        lengths = np.array([evidence.steps[number].dt for number in slip.steps])
        way = abs((np.where(evidence.changed_by_callbacks[slip.steps], 0.0, slip.values) * lengths).sum())
        if way > MAX_CREEP * evidence.half_width(*slip.ends):
            first, last = (evidence.steps[slip.steps[at]] for at in (0, -1))
            what = f"crept {way:.3g} px along {{}} in {last.end - first.time:.3g} s"
            yield Fault(way, evidence.report(slip.ends, last, what), f"{way:.3g} px", since=first.time)


def _other_bounces(evidence: Evidence) -> Iterator[Fault]:
    """Contacts that end with another velocity, in steps in which more than the recorded impulses changed the energy."""
    steps = [step for step, is_changed in zip(evidence.steps, evidence.changed_by_callbacks, strict=True) if is_changed]
    for bounce in wrong_bounces(steps):
        due = bounce.elasticity * bounce.approach
        what = f"left {{}} at {bounce.separation:.3g} instead of {due:.3g} px/s at {bounce.step.end:.3f} s"
        report = evidence.report((bounce.body_a, bounce.body_b), bounce.step, what)
        yield Fault(abs(bounce.separation - due) / bounce.approach, report, since=bounce.step.end)


def _jittery(evidence: Evidence) -> Iterator[Fault]:
    last = evidence.steps[-1]
    for body, share in jitter(evidence.steps).items():
        if share > MAX_REVERSALS and evidence.recording.body(body):
            what = f"turns back in {100 * share:.0f} % of its steps at rest"
            yield Fault(share, evidence.report((body,), last, what))


def _gone(evidence: Evidence) -> Iterator[Fault]:
    for escape in escapes(evidence.steps):
        if escape.is_finite:
            since = escape.step.end
            report = evidence.report((escape.body,), escape.step, f"far off from {since:.3f} s on")
            yield Fault(1 / since, report, since=since)


def _moved(evidence: Evidence) -> Iterator[Fault]:
    """Bodies whose positions the program sets again and again; of kinematic ones, those that touch something then."""
    for body, numbers in evidence.set_by_program["position"].items():
        steps = [step for step in map(evidence.steps.__getitem__, numbers.tolist()) if _matters(evidence, step, body)]
        if len(steps) > MANY_MOVES:
            report = evidence.report((body,), steps[0], f"before {len(numbers)} of the steps")
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
    known = evidence.recording.body(body)
    is_kinematic = known is not None and known.body_type == pymunk.Body.KINEMATIC
    return is_kinematic and is_touching and math.hypot(*way) > math.hypot(*row["velocity"]) * step.dt


class _Push(NamedTuple):
    """A force with its torque, or an impulse with its angular one, that the program gave a body before a step."""

    step: Step
    row: Any
    linear: Floats
    angular: float

    @property
    def lever(self) -> float:
        """How far from the centre of gravity it acts, px."""
        return abs(self.angular) / math.hypot(*self.linear)

    def off(self, *, is_local: bool) -> float:
        """Return how far the point is at which it acts from where one in other coordinates would be, px.

        is_local: it is the body's position, taken as a point of the body; otherwise the origin of the Space.
        """
        x, y = self.row["position"] if is_local else -self.row["position"]
        angle = float(self.row["angle"]) if is_local else 0.0
        x, y = x * math.cos(angle) - y * math.sin(angle), x * math.sin(angle) + y * math.cos(angle)
        return float(abs(self.angular - (x * self.linear[1] - y * self.linear[0])) / math.hypot(*self.linear))


def _pushes(evidence: Evidence) -> Iterator[_Push]:
    """Yield what the program gave bodies that makes them turn too."""
    for step in evidence.steps:
        rows = step.before.bodies
        for row in rows[(rows["torque"] != 0) & rows["force"].any(axis=1)]:
            yield _Push(step, row, row["force"], float(row["torque"]))
    for body, numbers in evidence.set_by_program["velocity"].items():
        for last, step in ((evidence.steps[number - 1], evidence.steps[number]) for number in numbers.tolist()):
            old, new = (rows[rows["id"] == body][0] for rows in (last.after.bodies, step.before.bodies))
            if new["spin"] != old["spin"] and np.isfinite([new["mass"], new["moment"]]).all():
                linear, angular = new["velocity"] - old["velocity"], new["spin"] - old["spin"]
                yield _Push(step, new, new["mass"] * linear, float(new["moment"] * angular))


def _wrong_points(evidence: Evidence) -> Iterator[Fault]:
    """Bodies that the program pushes where a point in other coordinates would be, far outside of them."""
    far: dict[int, list[_Push]] = {}
    sizes: dict[int, float] = {}
    for push in _pushes(evidence):
        body = int(push.row["id"])
        size = sizes.setdefault(body, 2 * max(map(half_length, evidence.shapes(body)), default=math.inf))
        if push.lever > 2 * size:
            far.setdefault(body, []).append(push)
    for body, pushes in far.items():
        for is_local, how in (
            (True, "..._at_local_point had got a point of the Space"),
            (False, "..._at_world_point had got a point of the body"),
        ):
            found = [push for push in pushes if push.off(is_local=is_local) < sizes[body]]
            if len(found) >= MIN_PUSHES and len(found) > len(pushes) / 2:
                step, lever = found[0].step, found[0].lever
                what = f"{lever:.3g} px from its centre of gravity, before {len(found)} of the steps, as if {how}"
                yield Fault(lever / sizes[body], evidence.report((body,), step, what), since=step.time)


def _joints_that_drive(evidence: Evidence) -> Iterator[Fault]:
    """Joints that add energy, with those of all bodies that they hold together: the solver sets these off in one."""
    ledger = evidence.ledger
    rows = {int(row["key"]): row for step in evidence.steps for row in step.after.joints}
    passive = [key for key in ledger.of_joints if key in rows and rows[key]["kind"] not in LAWLESS]
    assembly: dict[int, set[int]] = {}  # of each dynamic body: the keys of the joints that hold it, shared by all
    for key in passive:
        bodies = (int(rows[key][end]) for end in ("body_a", "body_b"))
        joined = {key}.union(*(assembly.get(body, set()) for body in bodies))
        held = [end for other in joined for end in (int(rows[other]["body_a"]), int(rows[other]["body_b"]))]
        assembly.update({end: joined for end in held if evidence.is_dynamic(end)})
    for key in passive:
        joint, work = evidence.recording.joint(key), ledger.of_joints[key]
        ends = int(rows[key]["body_a"]), int(rows[key]["body_b"])
        joined = set[int]().union(*(assembly.get(end, set()) for end in ends))
        together = sum(ledger.of_joints[each] for each in passive if each in joined)
        moved = pymunk.Body.KINEMATIC in (joint.a.body_type, joint.b.body_type)
        if min(work, together) > MAX_JOINT_ENERGY * ledger.scale and not moved:
            share = f"{100 * work / ledger.scale:,.1f} %"
            what = f"its {type(joint).__name__} to {{}} adds {share} of the largest kinetic energy"
            yield Fault(work, evidence.report(ends, evidence.steps[-1], what), share)


STEP_RULES: Final[Rules[Evidence]] = {
    "passed-through": _passed,
    "joint-stretched": _stretched,
    "sinks-in": lambda evidence: iter(evidence.too_deep["sinks-in"]),
    "wrong-point": _wrong_points,
    "pushed-by-hand": lambda evidence: iter(evidence.too_deep["pushed-by-hand"]),
    "unsolved": _unsolved,
    "creeps": _creeping,
    "deep-at-once": lambda evidence: iter(evidence.too_deep["deep-at-once"]),
    "other-bounce": _other_bounces,
    "joint-drives": _joints_that_drive,
    "jitters": _jittery,
    "moved-by-hand": _moved,
    "leaves": _gone,
    "set-by-handler": lambda evidence: iter(evidence.set_by_handler),
}
MET_RULES: Final[Rules[Evidence]] = {  # for how a Space is set up, of which a run shows more
    "tunnelling": _too_fast,
    **{rule: _after_run(find) for rule, find in PRODUCT_RULES.items()},
}
