"""Times of contacts that contradict the states: an engine may report the start or the end of a step for all of them.

When such a contact is reported, its bodies are not as deep in each other as the engine says. Earlier or later in the
step, on their flight from the state before it, they are. If the step's contacts, each at that time and with its
reported impulse, lead to the state after the step, these are the times at which they were resolved.
"""

import math
from typing import Final

import numpy as np

from sandbox.analysis.findings import SceneConstants, StepLengths, give_impulse, line_to_wall, of_step
from sandbox.compiled import Record, entry, kernel
from sandbox.engines.walls import ARENA_COUNT
from sandbox.judge.causes import NEGLIGIBLE
from sandbox.state import Contacts, Floats, Integers

PARTS: Final = 16  # of a step, in which the first is looked for at whose end two bodies are deep enough
HALVINGS: Final = 50  # of that part


@kernel
def _depth_at(constants: SceneConstants, contact: Record, x: Floats, v: Floats, clock: Floats, time: float) -> float:
    """Return how deep a contact's bodies are in each other at a time in the step (s), px; negative if apart."""
    i, j = contact.first, contact.second
    since = time - clock[i]
    ax = x[i, 0] + since * (v[i, 0] + since * constants.fall[0] / 2)
    ay = x[i, 1] + since * (v[i, 1] + since * constants.fall[1] / 2)
    if j >= 0:
        since = time - clock[j]
        dx = x[j, 0] + since * (v[j, 0] + since * constants.fall[0] / 2) - ax
        dy = x[j, 1] + since * (v[j, 1] + since * constants.fall[1] / 2) - ay
        depth: float = constants.radius[i] + constants.radius[j] - math.hypot(dx, dy)
    else:
        dx, dy = line_to_wall(constants, ~j, ax, ay)
        depth = constants.radius[i] + constants.wall[~j, 2] - math.hypot(dx, dy)
        if ~j < ARENA_COUNT:  # its normal points outwards, also for a ball beyond it
            depth = constants.radius[i] - (dx * contact.normal[0] + dy * contact.normal[1])
    return depth


@kernel
def _fly_to(constants: SceneConstants, x: Floats, v: Floats, clock: Floats, ball: int, time: float) -> None:
    """Let a ball fly on its parabola to a time in the step (s)."""
    since = time - clock[ball]
    for axis in range(2):
        x[ball, axis] += since * (v[ball, axis] + since * constants.fall[axis] / 2)
        v[ball, axis] += since * constants.fall[axis]
    clock[ball] = time


@kernel
def _time_of(constants: SceneConstants, contact: Record, x: Floats, v: Floats, clock: Floats) -> float:
    """Return when in the step (s) a contact's bodies first are as deep in each other as it reports; -1 if never."""
    since: float = clock[contact.first]
    if contact.second >= 0:
        since = max(since, clock[contact.second])
    slight = NEGLIGIBLE * constants.radius[contact.first]
    if _depth_at(constants, contact, x, v, clock, since) >= contact.depth - slight:
        return since
    part, low, high = (constants.dt - since) / PARTS, since, -1.0
    for k in range(1, PARTS + 1):
        if _depth_at(constants, contact, x, v, clock, since + k * part) >= contact.depth - slight:
            low, high = since + (k - 1) * part, since + k * part
            break
    if high < 0:
        return -1.0
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        if _depth_at(constants, contact, x, v, clock, middle) >= contact.depth:
            high = middle
        else:
            low = middle
    return high


@entry
def _replace_times(
    every_step: SceneConstants,
    lengths: StepLengths,
    position: Floats,
    velocity: Floats,
    contacts: Contacts,
    step_of: Integers,
    times: Floats,
    found: Floats,
    x: Floats,
    v: Floats,
    clock: Floats,
) -> None:
    """Replace times, see `true_times`. found: (contacts,), x, v: (n, 2) and clock: (n,), to work in."""
    begin = len(contacts) if every_step.together else 0
    while begin < len(contacts):
        step, end = step_of[begin], begin
        constants = of_step(every_step, lengths, step)
        while end < len(contacts) and step_of[end] == step:
            for ball in (contacts[end].first, contacts[end].second):
                if ball >= 0:
                    clock[ball] = 0.0
                    for axis in range(2):
                        x[ball, axis], v[ball, axis] = position[step - 1, ball, axis], velocity[step - 1, ball, axis]
            end += 1
        slight = 10 * NEGLIGIBLE * constants.radius[contacts[begin].first]
        depth = _depth_at(constants, contacts[begin], x, v, clock, times[begin])
        leads = abs(depth - contacts[begin].depth) > slight
        for k in range(begin, end):
            found[k] = _time_of(constants, contacts[k], x, v, clock) if leads else -1.0
            leads = leads and found[k] >= 0
            if leads:
                _fly_to(constants, x, v, clock, contacts[k].first, found[k])
                if contacts[k].second >= 0:
                    _fly_to(constants, x, v, clock, contacts[k].second, found[k])
                give_impulse(constants, contacts[k], v)
        for k in range(begin, end if leads else begin):
            for ball in (contacts[k].first, contacts[k].second):
                if ball >= 0:
                    _fly_to(constants, x, v, clock, ball, constants.dt)
                    away = math.hypot(x[ball, 0] - position[step, ball, 0], x[ball, 1] - position[step, ball, 1])
                    leads = leads and away <= 10 * NEGLIGIBLE * constants.radius[ball]
        for k in range(begin, end if leads else begin):
            times[k] = found[k]
        begin = end


def true_times(
    constants: SceneConstants,
    lengths: StepLengths,
    position: Floats,
    velocity: Floats,
    contacts: Contacts,
    step_of: Integers,
    within: Floats,
) -> Floats:
    """Return when each contact was resolved, s since its step began: (contacts,), as `within` if nothing contradicts.

    Nothing does in an engine that resolves all contacts of one time together.
    position, velocity: (steps + 1, n, 2) px and px/s; step_of: (contacts,) from 1, ascending.
    """
    times, n = within.copy(), position.shape[1]
    work = np.empty(len(contacts)), np.empty((n, 2)), np.empty((n, 2)), np.empty(n)
    _replace_times(constants, lengths, position, velocity, contacts, step_of, times, *work)
    return times
