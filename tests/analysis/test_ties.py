"""Contacts at the same time, of which no law says which comes first."""

import numpy as np

from sandbox.analysis.ties import SIMULTANEOUS, Tie, find_tie
from sandbox.state import CONTACT, Contacts


def log(*contacts: tuple[float, int, int, float]) -> Contacts:
    """Return contacts along x, each with time (s), first, second and impulse (kg px/s)."""
    rows = [(time, first, second, (1.0, 0.0), impulse, 0.0, 0.0, 0.0) for time, first, second, impulse in contacts]
    return np.array(rows, CONTACT)


AT = 0.5  # s
ONE = log((AT, 0, 1, 6.0), (AT, 0, 2, 4.0))
OTHER = log((AT, 0, 2, 7.0), (AT, 0, 1, 5.0))


def test_a_ball_that_touches_two_in_either_order_with_other_velocities_after_is_a_tie() -> None:
    assert find_tie(ONE, OTHER, together=False) == Tie(AT, 1, 2, ball=0)


def test_an_order_that_changes_no_velocity_is_no_tie() -> None:
    assert find_tie(ONE, log((AT, 0, 2, 4.0), (AT, 0, 1, 6.0)), together=False) is None


def test_other_impulses_in_the_same_order_are_no_tie() -> None:
    assert find_tie(ONE, log((AT, 0, 1, 3.0), (AT, 0, 2, 4.0)), together=False) is None


def test_contacts_at_different_times_are_no_tie() -> None:
    later = AT + 3 * SIMULTANEOUS
    assert (
        find_tie(log((AT, 0, 1, 6.0), (later, 0, 2, 4.0)), log((AT, 0, 1, 5.0), (later, 0, 2, 7.0)), together=False)
        is None
    )


def test_contacts_of_different_balls_are_no_tie() -> None:
    one = log((AT, 0, 1, 6.0), (AT, 2, 3, 4.0))
    assert find_tie(one, one[::-1].copy(), together=False) is None


def test_one_contact_each_but_with_other_bodies_is_a_tie() -> None:
    """In a wide corner, a ball leaves the second wall at once after bouncing off the first."""
    assert find_tie(log((AT, 0, -5, 6.0)), log((AT, 0, -6, 6.0)), together=False) is None  # the same momentum
    assert find_tie(log((AT, 0, -5, 6.0)), log((AT, 0, -6, 4.0)), together=False) == Tie(AT, -5, -6, ball=0)


def test_contacts_resolved_together_are_in_no_order() -> None:
    assert find_tie(ONE, log((AT, 0, 1, 3.0), (AT, 0, 2, 7.5)), together=True) == Tie(AT, 1, 2, ball=0)
    assert find_tie(ONE, ONE, together=True) is None
