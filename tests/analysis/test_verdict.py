"""What a comparison comes to, and what other settings gain."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import scene_of

from sandbox.analysis.causes import Cause
from sandbox.analysis.comparison import compare
from sandbox.analysis.ledger import Entry
from sandbox.analysis.measurement import Run
from sandbox.analysis.verdict import energy_error, verdict
from sandbox.scene.files import load


def test_it_says_how_long_each_engine_agrees_and_what_the_largest_error_is() -> None:
    comparison = compare(load("article"), ["pymunk", "article", "impulse", "exact"])
    until = {name: run.apart for name, run in comparison.runs.items()}
    gap = comparison.runs["pymunk"].gap_max
    assert until["pymunk"] is not None
    assert gap[round(until["pymunk"] * 60)] > 20 >= gap[round(until["pymunk"] * 60) - 1]
    said = verdict(comparison)
    assert said.startswith(
        "impulse agrees with exact until 1.42 s, pymunk until 1.08 s, article until 0.88 s, when a ball is first more "
        "than its radius off. "
    )
    assert (
        "The largest energy error is article's: it loses 58.4 % of the energy, mostly through “impulse too small”."
        in said
    )
    assert "For pymunk, a higher rate, or more substeps, finds contacts sooner." in said
    assert "compare statistics only" not in said


def test_beyond_the_horizon_it_recommends_statistics() -> None:
    comparison = compare(load("gas-100").changed(seconds=5.0), ["impulse", "exact"])
    assert f"After {comparison.horizon:.2f} s compare statistics only: " in verdict(comparison)


def test_paths_that_agree_to_the_end_are_reported() -> None:
    comparison = compare(load("oblique"), ["pymunk", "exact"])
    agrees = "pymunk agrees with exact to the end at 3 s"
    assert verdict(comparison).startswith(f"{agrees}: no ball is more than its radius off.")
    said = verdict(compare(load("oblique"), ["pymunk", "article", "exact"]))
    assert said.startswith(f"{agrees}, article until 1.07 s, when a ball is first more than its radius off.")


def test_float32_rounding_is_no_energy_error() -> None:
    start, line = 1e6, Entry(Cause.ROUNDING, 3, 0.9, 0.0, 0.0)  # kg px²/s²
    run = compare(load("head-on").changed(seconds=0.1), ["exact"]).runs["exact"]
    kept = replace(run, energy=np.array([start, start + 0.9]), figures=replace(run.figures, ledger=(line,)))
    assert energy_error(kept) is None
    line = replace(line, energy=1.1)
    found = energy_error(replace(kept, figures=replace(run.figures, ledger=(line,))))
    assert found is not None
    assert found[0] == pytest.approx(1.1e-6)


def with_ledger(run: Run, **lines: float) -> Run:
    """Return a run that began with 100 kg px²/s² and has these lines in its ledger."""
    ledger = tuple(Entry(Cause[cause.upper()], 1, energy, 0.0, 0.0) for cause, energy in lines.items())
    return replace(run, energy=np.array([100.0, 100.0]), figures=replace(run.figures, ledger=ledger))


def test_the_largest_error_has_either_sign_and_its_cause_the_same_sign() -> None:
    comparison = compare(load("head-on").changed(seconds=1 / 60), ["pymunk", "impulse", "exact"])
    lost = with_ledger(comparison.runs["pymunk"], gravity=9.0, late=-8.0, stale=-4.0)
    gained = with_ledger(comparison.runs["impulse"], pushed=2.0)
    said = verdict(replace(comparison, runs=comparison.runs | {"pymunk": lost, "impulse": gained}))
    assert "The largest energy error is pymunk's: it loses 3 % of the energy, mostly through “found late”." in said


def test_a_single_engine_is_measured_against_nothing() -> None:
    assert verdict(compare(load("head-on"), ["exact"])) == "Nothing is measured against exact."


def test_energy_lost_to_the_scene_s_elasticity_is_no_error() -> None:
    scene = scene_of("radius = 20\nelasticity = 0.5\nposition = [100, 300]\nvelocity = [400, 0]").changed(seconds=3.0)
    run = compare(scene, ["pymunk", "exact"]).runs["pymunk"]
    assert run.figures.energy_ratio == pytest.approx(0.25)
    assert energy_error(run) is None
