"""Sentences on what is wrong with a step, and with many."""

from collections.abc import Sequence

import numpy as np

from sandbox.judge.fit import Outcome
from sandbox.judge.models import BY_NAME, Fault
from sandbox.state import Floats

ALIKE = 1e-3  # of a value, by which those of several steps may differ to be said once


def of_outcome(outcome: Outcome) -> str:
    """Return what an outcome says is wrong with a step; empty if nothing is."""
    trial = outcome.trial
    said = BY_NAME[trial.fault].says(trial.value) if trial.fault else ""
    return said if trial.is_in_time else f"{said} {_late(outcome)}".strip()


def _late(outcome: Outcome) -> str:
    """Say how late a contact was found by a rule of steps."""
    met = max(outcome.met, key=lambda m: m["depth"])
    if met["closing"] <= 0:
        return f"The two were already parting, {met['depth']:.3g} px deep, and were resolved again."
    return f"Found {1e3 * met['depth'] / met['closing']:.3g} ms late, {met['depth']:.3g} px deep."


def summed(fault: Fault, values: Floats) -> str:
    """Return the sentence of a model with many values of its parameter."""
    low, high, median = float(np.min(values)), float(np.max(values)), float(np.median(values))
    if high - low <= ALIKE * max(abs(low), abs(high)):
        return fault.says(median)
    low, high = sorted((abs(low), abs(high))) if low * high > 0 else (low, high)
    return f"{fault.says(median)[:-1]} at the median, {low:.3g} to {high:.3g} in all."


def late_range(depths: Sequence[float]) -> str:
    """Return how deep contacts were found, px."""
    low, high = min(depths), max(depths)
    if high - low <= ALIKE * abs(high):
        return f"Contacts are found late, {high:.3g} px deep."
    return f"Contacts are found late, {low:.3g} to {high:.3g} px deep, {float(np.median(depths)):.3g} at the median."
