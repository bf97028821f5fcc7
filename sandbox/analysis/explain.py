"""Sentences that explain what is wrong with a contact, or that a contact is missing."""

import math
from typing import Final

import numpy as np

from sandbox.analysis.findings import pair_friction
from sandbox.analysis.flights import PUSHED_OUT, SPIN_CHANGED, VELOCITY_CHANGED, Flights
from sandbox.analysis.start_overlaps import StartOverlap
from sandbox.analysis.tunnelling import Passage
from sandbox.judge.causes import NEGLIGIBLE, Cause
from sandbox.scene.model import ARENA_WALLS, Scene

WRONG_REFERENCE: Final = "The reference is wrong here."
UNCONVERGED: Final = "Several contacts at once: the solver's iterations ended before all were right."
DISORDERED: Final = (
    "Several contacts were found late, at the end of a step, and resolved in another order than they happened."
)
RESOLVED_TOGETHER: Final = (
    "Several contacts that happened one after another were found late, at the end of a step, and resolved together."
)
NO_CAUSE: Final = "The evidence fits no single cause."
BY_STATES: Final = "It is more than its radius from where the reference has it."
CLAMPED_EARLY: Final = "It is clamped before restitution."
FRACTIONS: Final = {0.25: "a quarter", 0.5: "half", 2: "twice that"}
MORE_THAN: Final = 1.001  # steps, far above what float32 rounds
CLAMPED_WITHIN: Final = 1e-3  # of friction, far above what float32 rounds


def explain(scene: Scene, contact: np.void, finding: np.void, *, clamps_early: bool = False) -> str:
    """Explain the largest error of a contact, as the ledger found it. clamps_early: as in `Record`."""
    cause = Cause(finding["cause"])
    if cause in (Cause.FRICTION_SMALL, Cause.FRICTION_LARGE):
        return _explain_friction(scene, contact, finding, clamps_early=clamps_early)
    if cause in (Cause.SMALL, Cause.LARGE):
        return _explain_impulse(scene, contact, finding)
    if cause == Cause.RESCALED:
        return _explain_rescaled(scene, contact)
    if cause in (Cause.LATE, Cause.EARLY):
        return _explain_timing(scene, contact, finding)
    if cause in (Cause.VELOCITY, Cause.NORMAL):
        return _explain_velocity(scene, contact, finding)
    off = f"{finding['displacement_error']:.3g} px"
    return {
        Cause.PLACED: f"The contact left a ball {off} from where it should be, though no overlap is that deep.",
        Cause.UNTOLD: "Velocities change in flight, without a reported contact, and the impulse is off by no more.",
        Cause.UNKNOWN: _explain_unknown(scene, contact, finding),
        Cause.OVERSHOOT: f"The ball was put back on the wall, which discarded {off} of its way.",
        Cause.PUSHED: (
            f"The two were pushed apart, and are up to {off} from where they should be."
            if contact["second"] >= 0
            else f"The ball was pushed out of the wall, and is {off} from where it should be."
        ),
        Cause.TURNED: "The ball was already leaving the wall, and was reversed again.",
        Cause.STALE: "The solver began with the impulse of an earlier touch, and pulled at what was parting.",
        Cause.UNCONVERGED: UNCONVERGED,
        Cause.DAMPING: "Restitution was of the speed before the step's damping.",
        Cause.GRAVITY: "Gravity pulled for a whole step, though the ball met the wall within it.",
    }.get(cause, f"{cause.label.capitalize()}.")


def explain_flight(scene: Scene, flights: Flights, ball: int, kind: int) -> str:
    """Explain the first error of a kind of a ball in flight."""
    (x, y), (vx, vy) = flights.change[ball, kind].tolist(), flights.before[ball, kind].tolist()
    size, speed, time = math.hypot(x, y), math.hypot(vx, vy), scene.clock.time(int(flights.step[ball, kind]))
    when = f"in the step to {time:.3f} s"
    if kind == SPIN_CHANGED:
        return f"The spin of ball {ball} changed by {x:.3g} rad/s {when}, without a reported contact."
    if kind == VELOCITY_CHANGED:
        return f"The velocity of ball {ball} changed by {size:.3g} px/s {when}, without a reported contact."
    if kind == PUSHED_OUT:
        return f"Ball {ball}, which overlapped, was moved by {size:.3g} px {when}, besides its flight."
    moved = f"Ball {ball} was put {size:.3g} px from where its flight led {when}, with no overlap at the step's ends"
    way = speed * scene.clock.length(time)
    if way and abs(x * vy - y * vx) <= size * speed / 1000:
        return f"{moved}: {_percent(size / way)} of its way {'further' if x * vx + y * vy > 0 else 'short'}."
    return f"{moved}."


def explain_start(ball: int, away: float, slower: float) -> str:
    """Explain that a ball is apart from the reference's from the start: by px, and by px/s."""
    return (
        f"When the comparison begins, ball {ball} is {away:.3g} px and {slower:.3g} px/s from the reference's: what "
        "follows begins with that."
    )


def explain_overlap(scene: Scene, overlap: StartOverlap) -> str:
    """Explain a difference by two bodies that overlapped at the start."""
    other = f"ball {overlap.second}" if overlap.second >= 0 else scene.wall_name(~overlap.second)
    return (
        f"Ball {overlap.first} and {other} overlapped by {overlap.depth:.3g} px when the comparison began: no step led "
        "them there, and engines part them in different ways."
    )


def explain_gravity(scene: Scene, flights: Flights) -> str:
    """Explain how an engine's flight differs from the parabola of the scene's gravity."""
    (gx, gy), (x, y) = flights.gravity, scene.gravity
    if (gx, gy) != (x, y):
        found, right = (f"({a:.6g}, {b:.6g})" for a, b in ((gx, gy), (x, y)))
        return f"Balls in flight accelerate by {found} px/s², where the scene's gravity is {right}."
    off = math.hypot(*flights.off_parabola)
    side = "beyond" if flights.off_parabola[0] * gx + flights.off_parabola[1] * gy > 0 else "short of"
    shortest, longest = (off * length**2 for length in scene.clock.lengths)
    size = f"{shortest:.3g} to {longest:.3g}" if scene.clock.varies else f"{longest:.3g}"
    return f"Gravity is integrated in steps: each ends {size} px {side} the parabola."


def explain_damping(damping: float, other: str, of_other: float) -> str:
    """Explain damping that another engine has not: the shares of a velocity that both leave after a second."""
    left = f"Space.damping = {damping:g} leaves {_percent(damping)} of the velocity each second"
    return f"Damping: {left}. {other} has {'none' if of_other == 1 else f'{of_other:g}'}."


def explain_passage(scene: Scene, passage: Passage) -> str:
    """Explain a passage without a reported contact."""
    if passage.within_step:
        return f"The two passed through each other within a step, in which one flew {passage.flown:.3g} px."
    if passage.second >= 0:
        return "The two passed into each other without a reported contact."
    wall = scene.walls[~passage.second - len(ARENA_WALLS)]
    ends = " and ".join("({:g}, {:g})".format(*end) for end in (wall.start, wall.to))
    return (
        f"The ball went through the wall between {ends}: it flew {passage.flown:.3g} px in the step, and the wall is "
        f"{wall.thickness:g} px thick."
    )


def _explain_rescaled(scene: Scene, contact: np.void) -> str:
    """Name the change of dt, and what it made of the impulse that a lasting contact had before."""
    clock = scene.clock
    step = int(clock.steps_containing(float(contact["time"])))
    before, now = (clock.length(clock.time(one)) for one in (step - 1, step))
    took_back, so = "no more than the impulse itself", "the rest pushed the two apart"
    if contact["impulse"] < 0:
        took_back, so = "more than that", "it pulled at what was parting"
    return (
        f"dt {'grew' if now > before else 'shrank'} from {1e3 * before:.3g} to {1e3 * now:.3g} ms. Then Pymunk "
        f"multiplies the impulse of a lasting contact by {now / before:.3g}, and its solver took back {took_back}: "
        f"{so}. A constant dt avoids that."
    )


def _explain_impulse(scene: Scene, contact: np.void, finding: np.void) -> str:
    """Name the fraction of the impulse that is missing or too much, and the restitution that it amounts to."""
    first, second, bodies = int(contact["first"]), int(contact["second"]), scene.bodies
    approach = float(finding["approach"])
    if approach <= 0:
        slight = NEGLIGIBLE * abs(float(finding["approach_after"]))
        were = "were parting" if approach < -slight else "did not approach"
        return f"The two {were}, and had an impulse of {contact['impulse']:.4g} kg px/s."
    share = float(contact["impulse"] / finding["expected_impulse"])
    restitution = round(-float(finding["approach_after"]) / approach, 9) + 0.0  # not -0
    amount = f"{_percent(1 - share)} of it is missing" if share < 1 else f"it is {_percent(share - 1)} too large"
    still = ", and the balls are still approaching" if restitution < 0 else ""
    if second < 0:
        expected = float(finding["expected_impulse"]) / (float(bodies.mass[first]) * approach) - 1
        gave = f"gave back {_percent(restitution)} of the speed, where {_percent(expected)} is right."
        return f"{scene.wall_name(~second).capitalize()} {gave}"
    radius, mass = float(bodies.radius[first]), float(bodies.mass[first])
    alike = radius == bodies.radius[second] and mass == bodies.mass[second]
    if alike and math.isclose(contact["impulse"] * radius, mass * approach, rel_tol=1e-9):
        return (
            f"The impulse was 2 v_n / {2 * radius:g} where two equal masses need v_n: {amount}{still}. Dividing "
            f"by the diameter amounts to a restitution of {restitution:.3g} (2/r - 1)."
        )
    return f"The impulse is wrong: {amount}{still}. It amounts to a restitution of {restitution:.3g}."


def _explain_friction(scene: Scene, contact: np.void, finding: np.void, *, clamps_early: bool) -> str:
    """Name a contact's friction and Coulomb's, and the fraction that it is."""
    tangential, right = float(finding["tangential"]), float(finding["expected_tangential"])
    if right == 0:
        why = "where the two have none" if finding["slip"] else "though the two do not slip"
        return f"Friction is {abs(tangential):.4g} kg px/s, {why}."
    law = f"Friction is {abs(tangential):.4g} kg px/s where Coulomb's law gives {abs(right):.4g}"
    share = tangential / right
    if share < 0:
        return f"{law}, and acts along the slip, not against it."
    if share == 0:
        return f"There is no friction where Coulomb's law gives {abs(right):.4g} kg px/s."
    if clamps_early and _is_clamped_early(scene, contact, finding):
        return f"{law}: {_fraction(share)}. {CLAMPED_EARLY}"
    return f"{law}: {_fraction(share)}."


def _is_clamped_early(scene: Scene, contact: np.void, finding: np.void) -> bool:
    """Return whether friction is as large as the impulse without restitution, μ v_n, allows, and no larger."""
    bodies, first, second = scene.bodies, int(contact["first"]), int(contact["second"])
    per_mass = 1 / bodies.mass[first] + (1 / bodies.mass[second] if second >= 0 else 0.0)
    most = pair_friction(scene, np.array([contact]))[0] * finding["approach"] / per_mass
    return math.isclose(abs(finding["tangential"]), most, rel_tol=CLAMPED_WITHIN)


def _fraction(share: float) -> str:
    """Return a fraction in words.

    >>> _fraction(0.5001), _fraction(1.3)
    ('half', '130 % of it')
    """
    close = (word for value, word in FRACTIONS.items() if math.isclose(share, value, rel_tol=5e-3))
    return next(close, f"{_percent(share)} of it")


def _explain_unknown(scene: Scene, contact: np.void, finding: np.void) -> str:
    """Say what is known of a contact whose evidence fits no cause."""
    if of_spin := _spin_error(scene, int(contact["first"]), int(contact["second"]), finding):
        return f"The evidence fits no cause. {of_spin}"
    if finding["gap"] > 0:
        return (
            f"The evidence fits no cause: a contact of the two is reported, and they are {finding['gap']:.3g} px apart."
        )
    return "The evidence fits no cause: in this step, velocities changed by something else than the reported impulses."


def _explain_velocity(scene: Scene, contact: np.void, finding: np.void) -> str:
    """Name the angle of the normal, or what a contact changed besides its impulse: momentum, or along and across it."""
    changed = "The contact changed velocities by something else than its reported impulse"
    if finding["cause"] == Cause.NORMAL:
        turned = f"turned by {math.degrees(finding['turned']):.3g}°"
        if finding["unexplained"].any():
            return f"The impulse acted along a direction that is {turned} from the reported normal."
        return f"The impulse acted along a normal that is {turned} from the line of centres."
    first, second = int(contact["first"]), int(contact["second"])
    if of_spin := _spin_error(scene, first, second, finding):
        return of_spin
    on_first = -scene.bodies.mass[first] * finding["unexplained"][0]
    on_second = scene.bodies.mass[second] * finding["unexplained"][1] if second >= 0 else on_first
    reported, (nx, ny) = float(contact["impulse"]), contact["normal"].tolist()
    if second >= 0 and math.hypot(*(on_second - on_first)) > NEGLIGIBLE * 10 * abs(reported):
        each = (reported * contact["normal"] + extra for extra in (on_first, on_second))
        got = " and ".join(f"{math.hypot(*one):.4g}" for one in each)
        return f"{changed} of {reported:.4g} kg px/s: the balls got {got}, which makes or loses momentum."
    along, across = float(on_first @ (nx, ny)), float(on_first @ (-ny, nx))
    parts = [
        f"{abs(part):.3g} kg px/s {where} it"
        for part, where in ((along, "along"), (across, "across"))
        if abs(part) > NEGLIGIBLE * 10 * abs(reported)
    ]
    return f"{changed} of {reported:.4g} kg px/s along the normal: {' and '.join(parts)} are besides it."


def _spin_error(scene: Scene, first: int, second: int, finding: np.void) -> str:
    """Name the change of a spin, and what friction should have changed it by; empty if velocities changed by more."""
    bodies, balls = scene.bodies, [first] if second < 0 else [first, second]
    at_rim = bodies.mass[balls] * bodies.radius[balls] * np.abs(finding["spin_error"][: len(balls)]) / 2
    besides = bodies.mass[balls] * np.hypot(*finding["unexplained"][: len(balls)].T)
    at = int(at_rim.argmax())
    if at_rim[at] <= besides.max():
        return ""
    ball, tangential = balls[at], float(finding["tangential"])
    right = -2 * tangential / float(bodies.mass[ball] * bodies.radius[ball]) + 0.0  # not -0
    turned = right + float(finding["spin_error"][at])
    by = f"{turned:.4g} rad/s" if abs(turned) > NEGLIGIBLE * abs(right) else "nothing"
    return (
        f"The contact changed the spin of ball {ball} by {by}, where friction of {abs(tangential):.4g} kg px/s changes "
        f"a disc's by {right:.4g} rad/s."
    )


def _explain_timing(scene: Scene, contact: np.void, finding: np.void) -> str:
    """Name how late or early a contact was found, and the effect."""
    delay, depth = float(finding["delay"]), float(finding["depth"])
    off = f"positions are then {finding['displacement_error']:.3g} px off."
    step = scene.clock.length(float(contact["time"]))
    before_step = (delay - MORE_THAN * step) * float(finding["approach"])  # px deep as it began, on a parabola
    longer = before_step > math.hypot(*scene.gravity) * step**2  # no integration of gravity is off by more
    steps = f", which is more than a step of {1e3 * step:.3g} ms" if longer else ""
    if depth > 0 and contact["depth"] < depth / 2:  # the two were held before they overlapped
        return f"Velocities changed {1e3 * delay:.3g} ms after the two touched{steps}; {off}"
    found = f"Found {1e3 * abs(delay):.3g} ms {'late' if delay > 0 else 'early'}{steps}, "
    found += f"{depth:.2g} px deep" if depth > 0 else f"{-depth:.2g} px before they touch"
    if finding["normal_error"] > NEGLIGIBLE:
        return f"{found}, so the normal is turned by {math.degrees(finding['normal_error']):.2g}°."
    return f"{found}; {off}"


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %"
