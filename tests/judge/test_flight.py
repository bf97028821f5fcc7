"""How an engine flies is read off flights: each law, in any order, however gravity is integrated."""

from collections.abc import Callable
from typing import Final

import numpy as np
import pytest
from conftest import numbers_in, scene_of
from verdicts import causes_of, on_states

from sandbox.judge.causes import Cause
from sandbox.judge.summary import CauseOfError, Verdict
from sandbox.scene.model import Scene
from sandbox.state import NO_DAMPING, Damping, Floats, States

STEPS: Final = 40
DT: Final = 1 / 60
G: Final = np.array([0.0, 300.0])
NONE: Final = 0 * G
RADIUS: Final = np.array([10.0, 20.0, 30.0])
MASS: Final = np.array([1.0, 3.0, 0.5])
START: Final = np.array([[500.0, 500.0], [1500.0, 500.0], [1000.0, 1200.0]])
VELOCITY: Final = np.array([[220.0, -150.0], [-90.0, -60.0], [70.0, 180.0]])
BEFORE: Final = {"before": 1.0, "after": 0.0, "half": 0.5}  # the share of gravity that acts before a step's move

Change = Callable[[Floats], Floats]  # of velocities (n, 2) in a step


def field(gravity: Floats, friction: float = 0.0) -> Scene:
    """Three balls far from each other and from all walls, for a second."""
    tables = (
        f"radius = {r}\nmass = {m}\nposition = {x.tolist()}\nvelocity = {v.tolist()}\nfriction = {friction}"
        for r, m, x, v in zip(RADIUS, MASS, START, VELOCITY, strict=True)
    )
    return scene_of(*tables, size=f"[2000, 2000]\nfriction = {friction}", more=f"gravity = {gravity.tolist()}")


def flown(change: Change, pull: Floats, fall: str = "half", *, first: bool = True, dt: Floats | None = None) -> States:
    """Fly by a change of velocities in each step, before its move or after it. dt: (STEPS,) s."""
    states = States.empty(STEPS + 1, 3)
    x, v = START.copy(), VELOCITY.copy()
    states.position[0], states.velocity[0] = x, v
    for step, h in enumerate(np.full(STEPS, DT) if dt is None else dt, start=1):
        v = v + BEFORE[fall] * h * pull
        v = change(v) if first else v
        x = x + h * v
        v = v if first else change(v)
        v = v + (1 - BEFORE[fall]) * h * pull
        states.position[step], states.velocity[step] = x, v
    return states


def law_of(verdict: Verdict, cause: Cause) -> CauseOfError:
    [law] = [each for each in verdict.causes if each.cause == cause]
    return law


def as_it_is(v: Floats) -> Floats:
    return v


def slowed_by(drag: Callable[[Floats], Floats]) -> Change:
    """Return the change by a drag. drag: px/s² against the velocity, of speeds (n,) px/s."""

    def change(v: Floats) -> Floats:
        speed = np.hypot(*v.T)
        return np.asarray(v * np.maximum(0, 1 - DT * drag(speed) / speed)[:, None])

    return change


LAWS: Final[dict[str, tuple[Change, float]]] = {  # what a sentence has of each law, and its number
    " v² px/s": (slowed_by(lambda v: 5e-4 * v**2), 5e-4),
    "takes 20 px/s": (slowed_by(lambda v: 20 + 0 * v), 20),
    "takes -30 px/s": (slowed_by(lambda v: -30 + 0 * v), -30),
    "velocities by": (lambda v: 0.99 * v, 0.99),
}
OTHERS: Final[tuple[Change, ...]] = (  # of which a law is not read
    slowed_by(lambda v: 0.4 * v / MASS),
    slowed_by(lambda v: 1e-4 * v**2 * RADIUS**2 / MASS),
    lambda v: v * [0.98, 1],
    lambda v: v * [1, 1.01],
)


@pytest.mark.parametrize("first", [True, False])
@pytest.mark.parametrize("says", LAWS)
def test_a_drag_is_named_with_its_law(says: str, first: bool) -> None:
    change, number = LAWS[says]
    [law] = on_states(field(NONE), flown(change, NONE, first=first)).causes
    assert law.cause == Cause.UNREPORTED
    assert says in law.sentence
    assert numbers_in(law.sentence)[0] == pytest.approx(number)


@pytest.mark.parametrize("first", [True, False])
@pytest.mark.parametrize("change", OTHERS)
def test_a_drag_of_another_law_is_a_change_without_a_contact(change: Change, first: bool) -> None:
    """Of which no number is said, nor anything of gravity."""
    for pull in (NONE, G):
        verdict = on_states(field(pull), flown(change, pull, first=first))
        assert Cause.UNREPORTED in causes_of(verdict) <= {Cause.UNREPORTED, Cause.UNKNOWN}


@pytest.mark.parametrize(("says", "fall"), [*((says, "before") for says in LAWS), ("velocities by", "after")])
def test_a_drag_is_named_beside_the_way_in_which_gravity_is_integrated(says: str, fall: str) -> None:
    """A step of 1/60 s at the velocity before or after gravity ends g dt²/2 = 0.0417 px off."""
    verdict = on_states(field(G), flown(LAWS[says][0], G, fall, first=fall == "before"))
    assert causes_of(verdict) == {Cause.UNREPORTED, Cause.GRAVITY}
    assert says in law_of(verdict, Cause.UNREPORTED).sentence
    assert numbers_in(law_of(verdict, Cause.GRAVITY).sentence) == [0.0417]


@pytest.mark.parametrize(
    ("pull", "numbers"), [(NONE, [0]), (0.5 * G, [0.5]), (1.01 * G, [1.01]), (np.array([6.0, 300.0]), [6, 300])]
)
def test_another_gravity_is_named_with_its_share_or_its_pull(pull: Floats, numbers: list[float]) -> None:
    [law] = on_states(field(G), flown(as_it_is, pull)).causes
    assert law.cause == Cause.GRAVITY
    assert numbers_in(law.sentence) == pytest.approx(numbers)


@pytest.mark.parametrize(("fall", "sign"), [("before", -1), ("after", 1)])
def test_gravity_in_steps_changes_the_energy_by_what_places_are_off(fall: str, sign: int) -> None:
    """In each step each ball is g dt²/2 lower or higher than its parabola: m g² dt²/2 of energy."""
    verdict = on_states(field(G), flown(as_it_is, G, fall))
    [line] = [entry for entry in verdict.ledger if entry.cause == Cause.GRAVITY]
    assert line.energy == pytest.approx(sign * STEPS * MASS.sum() * (G[1] * DT) ** 2 / 2)
    assert line.contacts == STEPS * 3
    assert line.displacement == pytest.approx(STEPS * 3 * G[1] * DT**2 / 2)


@pytest.mark.parametrize("clock", [0.5, 1.01, 2.0])
@pytest.mark.parametrize("gravity", [NONE, G], ids=["straight", "falling"])
def test_another_step_is_named_with_its_share(gravity: Floats, clock: float) -> None:
    [law] = on_states(field(gravity), flown(as_it_is, gravity, dt=np.full(STEPS, clock * DT))).causes
    assert law.cause == Cause.TELEPORTED
    assert numbers_in(law.sentence) == [pytest.approx(clock)]


def test_a_length_that_not_all_steps_have_is_not_said_of_each() -> None:
    states = flown(as_it_is, G, dt=np.resize([0.7, 0.7, 1.6], STEPS) * DT)
    assert not on_states(field(G), states).flights


def test_what_slows_a_ball_down_near_a_wall_is_no_contact_if_it_still_approaches() -> None:
    states = flown(as_it_is, G)
    states.position[:, 0] = 1000, 1989
    states.position[:, 0, 1] -= 260 * DT * np.arange(STEPS, -1, -1)
    states.velocity[:, 0] = 0, 260
    assert causes_of(on_states(field(G), states)) <= {Cause.UNREPORTED, Cause.UNKNOWN}


@pytest.mark.parametrize(
    ("damping", "cause"), [(Damping(0.5), Cause.DAMPING), (NO_DAMPING, Cause.UNREPORTED)], ids=["declared", "silent"]
)
def test_damping_that_an_engine_declares_is_damping(damping: Damping, cause: Cause) -> None:
    """With a half left after a second, a fourth of the energy is."""
    states = flown(lambda v: 0.5**DT * v, NONE)
    verdict = on_states(field(NONE), states, damping=damping)
    assert causes_of(verdict) == {cause}
    [line] = [entry for entry in verdict.ledger if entry.cause == cause]
    assert line.energy == pytest.approx((MASS[:, None] * VELOCITY**2).sum() / 2 * (0.25 ** (STEPS * DT) - 1))


def test_spins_that_die_away_are_named_with_their_share() -> None:
    states = flown(as_it_is, G)
    states.spin[:] = 7 * 0.99 ** np.arange(STEPS + 1)[:, None]
    [law] = on_states(field(G, friction=0.5), states).causes
    assert law.cause == Cause.UNREPORTED
    assert numbers_in(law.sentence) == [0.99]
