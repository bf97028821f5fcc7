"""Sentences on what is wrong with a step, and with many."""

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
    low, high = float(np.min(values)), float(np.max(values))
    if high - low <= ALIKE * max(abs(low), abs(high)):
        return fault.says(float(np.median(values)))
    return f"{fault.says(float(np.median(values)))[:-1]} at the median, {low:.3g} to {high:.3g} in all."
