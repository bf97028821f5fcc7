"""Engines with one known fault each, and programs of tutorials, judged by their states: no false cause is named."""

from collections import Counter, defaultdict
from collections.abc import Iterator
from functools import cache
from typing import Final

import pytest
from conftest import numbers_in, sample, scene_of
from event_driven import EventDriven
from faults import FAULTS, Fault, judged
from programs import PROGRAMS
from verdicts import causes_of

from sandbox.judge.causes import Cause
from sandbox.judge.summary import Verdict
from sandbox.scene.model import Scene

EIGHT: Final = "count = 8\nradius = 20\nspeed = 200\ninside = [[20, 20], [380, 280]]"
MIXED: Final = (
    "count = 4\nradius = 15\nspeed = 250\ninside = [[20, 20], [190, 280]]",
    "count = 3\nradius = 25\nmass = 5\nspeed = 120\ninside = [[200, 20], [380, 280]]",
)
WALLS: Final = (
    "[[walls]]\nfrom = [130, 60]\nto = [130, 150]\nthickness = 6\n[[walls]]\nfrom = [230, 250]\nto = [330, 180]"
)
ROUGH: Final = "\nfriction = 0.5\nspin = {from = -20, to = 20}"


def gas(*balls: str, seed: int, more: str = "", arena: str = "", walls: str = "") -> Scene:
    groups = [*balls[:-1], f"{balls[-1]}\n{walls}"]
    return scene_of(*groups, size=f"[400, 300]\n{arena}", more=f"seed = {seed}\nseconds = 1\n{more}")


@cache
def scenes(seed: int) -> dict[str, Scene]:
    return {
        "gas": gas(EIGHT, seed=seed),
        "gravity": gas(EIGHT, seed=seed, more="gravity = [0, 900]"),
        "mixed": gas(*MIXED, seed=seed),
        "inner walls": gas(EIGHT.replace("8", "6", 1), seed=seed, walls=WALLS),
        "rough": gas(EIGHT + ROUGH, seed=seed, arena="friction = 0.8"),
        "rough and falling": gas(
            *(group + ROUGH for group in MIXED), seed=seed, more="gravity = [0, 900]", arena="friction = 2"
        ),
        "elasticity": gas(EIGHT + "\nelasticity = 0.9", seed=seed, arena="elasticity = 0.8"),
        "rough bounce": gas(EIGHT.replace("8", "1", 1) + ROUGH, seed=seed, arena="friction = 0.4"),
        "rough and soft": gas(EIGHT + ROUGH + "\nelasticity = 0.8", seed=seed, arena="friction = 0.3"),
        "two balls": gas(EIGHT.replace("8", "2", 1), seed=seed),
        "sideways": gas(*MIXED, seed=seed, more="gravity = [-300, 200]", walls=WALLS),
    }


def scenes_for(fault: Fault, seeds: range, which: tuple[str, ...]) -> Iterator[Scene]:
    if fault.scene:
        yield fault.scene
    else:
        every = (scenes(seed)[key] for seed in seeds for key in which)
        yield from (scene for scene in every if fault.fits(scene))


def named(verdict: Verdict, *, at_least: float) -> set[Cause]:
    """Return the causes that are said: the first, and those with some share of the error."""
    first = {Cause(cause) for cause in verdict.errors["cause"][:1]}
    return (causes_of(verdict, at_least=at_least) | first) - {Cause.UNKNOWN}


def verdicts(name: str, seeds: range, which: tuple[str, ...], shares: dict[str, float]) -> Counter[str]:
    """Count what is said first of an engine with a fault: right, unknown, wrong, none. shares: of all causes, added."""
    fault, counted = FAULTS[name], Counter[str]()
    for scene in scenes_for(fault, seeds, which):
        verdict = judged(fault.engine, scene)
        first = Cause(verdict.errors["cause"][0]) if len(verdict.errors) else None
        kind = {None: "none", Cause.UNKNOWN: "unknown"}.get(first, "right" if first in fault.true else "wrong")
        counted[kind] += 1
        if kind == "wrong":
            print(f"{name}, {scene.seed}: {first}; {verdict.causes[:2]}; {fault.engine.__doc__}")
        for each in verdict.causes:
            is_true = each.cause in fault.true
            shares["unknown" if each.cause == Cause.UNKNOWN else "true" if is_true else "false"] += each.share
    return counted


@pytest.mark.parametrize("name", scenes(1))
def test_an_engine_without_a_fault_has_no_error(name: str) -> None:
    assert len(judged(EventDriven, scenes(1)[name]).errors) == 0


@pytest.mark.parametrize("name", sample([name for name in FAULTS if name not in PROGRAMS], 5))
def test_no_false_cause_is_named(name: str) -> None:
    assert verdicts(name, range(1, 2), ("gas", "rough and falling"), defaultdict(float))["wrong"] == 0


@pytest.mark.slow
def test_most_faults_are_named_and_none_falsely() -> None:
    """Of all causes, by their share of the error, the false are those of what drifts, or stands still, at a touch."""
    shares = defaultdict[str, float](float)
    table = {name: verdicts(name, range(1, 4), tuple(scenes(1)), shares) for name in FAULTS}
    for name, row in table.items():
        print(f"{name:32}", *(f"{kind} {row[kind]:3}" for kind in ("right", "unknown", "wrong", "none")))
    total = sum(table.values(), Counter[str]())
    print("all", total, dict(shares))
    assert total["wrong"] == 0
    assert total["right"] >= 0.95 * (total["right"] + total["unknown"])
    assert shares["false"] < 0.001 * sum(shares.values())


# Programs of tutorials

UNSAID: Final = ("only_one_changed", "one_radius", "walls_at_centres")  # said in words, or contact by contact
SHOWN: Final = 0.02  # of a program's error; less is not said
FIGURES_WITHIN: Final = 0.005  # of a figure, or of 0.1


def own(name: str) -> tuple[Fault, Scene]:
    """Return a program and its scene."""
    fault = PROGRAMS[name]
    assert fault.scene
    return fault, fault.scene


@pytest.mark.parametrize("name", sample(PROGRAMS, 3))
def test_the_verdict_on_a_program(name: str) -> None:
    """All causes of some share are true, one is that of the mistake, and its parameter is said."""
    fault, scene = own(name)
    verdict = judged(fault.engine, scene)
    causes = named(verdict, at_least=SHOWN)
    assert causes <= fault.true, fault.engine.__doc__
    assert causes & fault.says or not fault.says
    numbers = [number for each in verdict.causes for number in numbers_in(each.sentence)]
    is_said = (abs(n - figure) <= FIGURES_WITHIN * max(abs(figure), 0.1) for n in numbers for figure in fault.figures)
    assert not fault.figures or name in UNSAID or any(is_said), numbers


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("larger_elasticity", "the larger factor"),
        ("one_elasticity", "one factor of two"),
        ("mass_not_reduced", "the mass of one ball"),
        ("masses_added", "the sum of both masses"),
        ("walls_that_mirror_places", "mirrored at the wall"),
    ],
)
def test_what_is_said_of_a_wrong_law_is_what_the_program_does(name: str, words: str) -> None:
    fault, scene = own(name)
    assert words in " ".join(cause.sentence for cause in judged(fault.engine, scene).causes).lower()
