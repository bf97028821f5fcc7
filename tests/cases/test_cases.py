"""Small programs of real problems: the first line of the answer names what is wrong, and is gone with the mend."""

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from conftest import Command

CASES = Path(__file__).parent


class Case(NamedTuple):
    """The rule whose finding comes first, what its answer says, and what may be left after the mend."""

    rule: str
    says: str
    left: frozenset[str] = frozenset()


LATE = frozenset({"deep-at-once"})  # a fast impact is found late in either form
TABLE: dict[str, Case] = {
    "anchor": Case("anchor-far", "its PinJoint to the Space's static body has the anchor (420, 150)"),
    "anvil": Case("sinks-in", "too heavy for the passes that the solver does"),
    "arm": Case("contacts-within", "though joints hold both"),
    "cup": Case("concave", "a vertex that was given is 10 px inside of what collides"),
    "dragged": Case("passed-through", "through a segment of length 300", LATE),
    "hammer": Case("", "", LATE),
    "hook": Case("joint-not-added", "a Body() that was never added and has no mass"),
    "landing": Case("deep-at-once", "deep in the Space's static body"),
    "paddle": Case("moved-by-hand", "before 239 of the steps", LATE),
    "pendulum": Case("", "joints -"),
    "player": Case("sinks-in", "A velocity that is set between steps is carried out before contacts"),
    "potted": Case("body-not-added", "its circle of radius 15 is still in the Space"),
    "shelf": Case("hangs", "sleeps, and touches nothing"),
    "ship": Case("off-centre", "middle of its shapes at (48.2, 10): 49.23 px off"),
    "tiles": Case("seams", "is caught where two polygons meet"),
    "topdown": Case("friction-untouched", "still goes at 250 px/s"),
    "twice": Case("placed-twice", "so they are about (500, 700)", LATE),
    "wrecker": Case("joint-stretched", "their masses differ 500 times", frozenset({"joint-stretched"})),
}


def answer(command: Command, name: str, *arguments: str) -> dict[str, Any]:
    """Return the diagnosis of the one Space of a program."""
    _, out, err = command("watch", "--headless", "--no-tries", "--json", "-", CASES / f"{name}.py", *arguments)
    [space] = json.loads(out)["spaces"]
    assert "Traceback" not in err
    return dict(space)


def rules_of(space: dict[str, Any]) -> list[str]:
    return [finding["rule"] for finding in space["findings"]]


def test_every_program_is_in_the_table() -> None:
    assert {file.stem for file in CASES.glob("*.py")} - {"conftest", "test_cases", "asleep"} == set(TABLE)


@pytest.mark.parametrize("name", TABLE)
def test_the_first_finding_of_a_program_is_its_cause(command: Command, name: str) -> None:
    case, space = TABLE[name], answer(command, name)
    assert (rules_of(space) or [""])[0] == case.rule
    text = json.dumps(space["findings"][0] if case.rule else space["headline"])
    assert case.says in text
    named = [(body["index"], body["detail"]) for finding in space["findings"] for body in finding["bodies"]]
    assert len(set(named)) == len(named)
    assert (space["energy"] is None) == (name == "hook")  # its first step leaves no number


@pytest.mark.parametrize("name", TABLE)
def test_the_mend_of_a_program_leaves_no_such_finding(command: Command, name: str) -> None:
    case, space = TABLE[name], answer(command, name, "mended")
    assert set(rules_of(space)) <= case.left
    assert case.rule or not case.says or case.says not in space["headline"]


def run(name: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    program = [sys.executable, "-m", "sandbox", "watch", "--headless", str(CASES / f"{name}.py"), *arguments]
    return subprocess.run(program, capture_output=True, text=True, check=False, timeout=300)


def test_a_step_that_never_returns_ends_with_its_line() -> None:
    ran = run("asleep")
    assert ran.returncode == 2
    assert re.search(r"step \d+ of its Space does not return\. It is in \S*asleep\.py:39\.", ran.stderr)
    assert "add_post_step_callback" in ran.stderr


def test_a_cure_that_helps_is_printed_with_what_it_costs() -> None:
    out = " ".join(run("landing").stdout.split())
    assert "Cure: Shorter steps: for _ in range(4): space.step(dt / 4), and forces before each." in out
    assert "Tried: with steps in 4 parts," in out
    assert "steps cost" in out


def test_a_cure_that_does_not_help_is_not_printed() -> None:
    out = " ".join(run("wrecker").stdout.split())
    assert "4 times the iterations do not help" in out
    assert "space.iterations = 40" not in out
