"""The six numbers of a contact, and what is wrong with them, of contacts that are made by closed forms."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import pytest
from conftest import scene_of
from hypothesis import given, settings
from hypothesis import strategies as st
from verdicts import on_states

from sandbox.judge.causes import Cause
from sandbox.judge.contacts import due
from sandbox.judge.observe import Singles, When
from sandbox.judge.run import Contacts, Run
from sandbox.judge.summary import CauseOfError
from sandbox.run.mouse import PUSH
from sandbox.scene.model import Scene
from sandbox.state import States

DT: Final = 1 / 60
CENTRE: Final = 400 + 300j  # px, where the first ball is when the two touch
WALL: Final = 2  # the right one, at 800 px


@dataclass(frozen=True)
class Touch:
    """A contact in a step: normal by its angle, speeds along and across it in px/s, spins in rad/s, time in s.

    first, second: radius and mass, None for the right wall. factor, rubs, share: what the impulse, the friction and the
    second's part of both are of the right ones.
    """

    angle: float = 0.3
    closing: float = 200.0
    across: float = 80.0
    spins: tuple[float, float] = (5.0, -3.0)
    time: float = 0.006
    first: tuple[float, float] = (20.0, 1.0)
    second: tuple[float, float] | None = (30.0, 2.5)
    e: float = 0.8
    mu: float = 0.1
    gravity: complex = 0j
    factor: float = 1.0
    rubs: float = 1.0
    share: float = 1.0

    @property
    def n(self) -> complex:
        return complex(np.exp(1j * self.angle)) if self.second else 1 + 0j

    def numbers(self) -> tuple[float, float]:
        """Return the right impulse, (1 + e) m u, and Coulomb's friction with it, kg px/s.

        Discs' rims slip three times as fast as their centres do after a tangential impulse.
        """
        reduced = 1 / (1 / self.first[1] + (1 / self.second[1] if self.second else 0))
        impulse = (1 + self.e) * reduced * self.closing
        slip = self.across + self.first[0] * self.spins[0] + (self.second[0] * self.spins[1] if self.second else 0)
        return impulse, float(np.clip(reduced * slip / 3, -self.mu * impulse, self.mu * impulse))

    def scene(self) -> Scene:
        bodies = [self.first] + ([self.second] if self.second else [])
        root = f"elasticity = {self.e if not self.second else self.e**0.5}\nfriction = {self.mu**0.5}"
        balls = [
            f"radius = {r}\nmass = {m}\nposition = [{200 * k + 200}, 300]\n{root}" for k, (r, m) in enumerate(bodies)
        ]
        gravity = [self.gravity.real, self.gravity.imag]
        return scene_of(*balls, size=f"[800, 600]\nfriction = {self.mu**0.5}", more=f"gravity = {gravity}")

    def states(self) -> States:
        """Return the states before and after the step; a wall is a ball whose mass has no end."""
        (impulse, rub), n, g, t, left = self.numbers(), self.n, self.gravity, self.time, DT - self.time
        r, m = np.array([self.first, self.second or (1, np.inf)]).T
        given = (self.factor * impulse + self.rubs * rub * 1j) * n * np.array([-1, self.share])
        drift = 30 - 20j if self.second else 0j  # px/s, of both
        x = CENTRE + n * (r[0] + r[1]) * np.array([0, 1]) if self.second else np.full(2, 800 - r[0] + 300j)
        before = drift + (self.closing + 1j * self.across) * n * np.array([1, 0])
        after = before + given / m
        turned = 2 * self.rubs * rub / (m * r) * np.array([1, self.share])
        place = np.array([x - t * before + g * t**2 / 2, x + left * after + g * left**2 / 2])
        velocity, spin = np.array([before - g * t, after + g * left]), np.array([self.spins, self.spins - turned])
        count = 2 if self.second else 1
        place, velocity = (np.stack([z.real, z.imag], axis=-1)[:, :count] for z in (place, velocity))
        return States(place, velocity, 0 * spin[:, :count], spin[:, :count])

    def singles(self) -> Singles:
        """Return the contact as the judge reads it."""
        run = Run(self.scene(), self.states(), np.empty(0, PUSH), np.array([DT]))
        dt = run.dt[:, None]
        run.fly(run.x[:-1] + run.v0 * dt + run.g * dt**2 / 2, run.v0 + run.g * dt, run.g, 1.0, 1.0)
        c = Contacts(*(np.array([part]) for part in (0, 0, 1 if self.second else ~WALL)))
        return Singles(run, c, due(run, c))

    def said(self) -> tuple[CauseOfError, ...]:
        return on_states(self.scene(), self.states(), clock=[DT]).causes


SIZES: Final = st.tuples(st.floats(10, 40), st.floats(0.2, 5))
SPEEDS: Final = st.floats(-150, 150)
TOUCHES: Final = st.builds(
    Touch,
    angle=st.floats(0, 6.28),
    closing=st.floats(30, 400),
    across=SPEEDS,
    spins=st.tuples(st.floats(-10, 10), st.floats(-10, 10)),
    time=st.floats(0.001, 0.016),
    first=SIZES,
    second=st.none() | SIZES,
    e=st.floats(0.1, 1),
    mu=st.floats(0, 1),
    gravity=st.sampled_from([0j, 300j]),
)


@settings(max_examples=60)
@given(TOUCHES)
def test_the_six_numbers_are_those_of_the_closed_form(touch: Touch) -> None:
    """Impulse and friction of both, and friction by the spin of both; the time is read off places alone."""
    s, (impulse, rub) = touch.singles(), touch.numbers()
    met = s.met(When.TOUCH)
    close = 1e-6 * impulse
    assert s.touch == pytest.approx(touch.time, abs=1e-9)
    assert met.six.ravel() == pytest.approx([impulse] * 2 + [rub] * 4, abs=close)
    assert [met.due[0], met.rub[0]] == pytest.approx([impulse, rub], abs=close)
    shown = next(met for met in s.all_met() if met.when == When.SHOWN)
    assert shown.t == pytest.approx(touch.time, abs=1e-7)
    assert met.depth == pytest.approx(0, abs=1e-7)
    assert touch.said() == ()


SLIDES: Final = 0.05  # a factor of friction that does not stop the slip
BALLS, AT_WALL = Touch(mu=SLIDES), Touch(mu=SLIDES, second=None)


@pytest.mark.parametrize(
    ("touch", "cause", "parameter"),
    [
        (replace(BALLS, factor=0.05, rubs=0.05), Cause.SMALL, 0.05),
        (replace(BALLS, factor=1.02, rubs=1.02), Cause.LARGE, 1.02),
        (replace(AT_WALL, factor=0.9, rubs=0.9), Cause.SMALL, 0.9),
        (replace(BALLS, rubs=0.0), Cause.FRICTION_SMALL, 0.0),
        (replace(AT_WALL, rubs=0.0), Cause.FRICTION_SMALL, 0.0),
        (replace(BALLS, rubs=0.6), Cause.FRICTION_SMALL, 0.6),
        (replace(BALLS, rubs=2.0, mu=0.3), Cause.FRICTION_LARGE, 2.0),
    ],
)
def test_what_is_wrong_is_named_with_its_parameter(touch: Touch, cause: Cause, parameter: float) -> None:
    [said] = touch.said()
    assert said.cause == cause
    assert said.parameter == pytest.approx(parameter, abs=1e-6)
    assert (said.contacts, said.share) == (1, 1)


def test_an_impulse_that_the_second_does_not_get_makes_momentum() -> None:
    """What the second lacks is gained by both together; what a wall gives is no momentum out of nothing."""
    touch, at_wall = replace(BALLS, share=0.5), replace(AT_WALL, factor=0.9, rubs=0.9)
    verdict = on_states(touch.scene(), touch.states(), clock=[DT])
    impulse, rub = touch.numbers()
    lost = -0.5 * (impulse + 1j * rub) * touch.n
    assert verdict.gained[-1, :2] == pytest.approx([lost.real, lost.imag])
    assert not on_states(at_wall.scene(), at_wall.states(), clock=[DT]).gained.any()
