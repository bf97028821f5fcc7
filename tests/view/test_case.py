"""What the window says of a run so far is what `sandbox compare` says of the same run."""

import json
from dataclasses import asdict
from pathlib import Path

import pytest
from conftest import Command

from sandbox.judge.causes import Cause
from sandbox.run.edits import SetVelocity
from sandbox.run.inputs import Grab, Input, Move, Release, write_run
from sandbox.scene.files import load
from sandbox.session.session import Session
from sandbox.view.case_so_far import Case, case_of
from sandbox.view.run_so_far import ComparisonSoFar, RunSoFar

DRAG: tuple[Input, ...] = (
    Grab(step=20, ball=1, at=(300, 300)),
    Move(step=24, at=(420, 380)),
    Move(step=30, at=(200, 120)),
    Release(step=40),
)
RUNS = [  # scene, engines, inputs, steps
    ("article", ("pymunk", "impulse"), (), 300),
    ("article", ("pymunk", "article"), DRAG, 200),
    ("bouncing", ("pymunk", "impulse"), (), 130),
    ("newtons-cradle", ("pymunk", "article"), (), 120),
    ("break-shot", ("pymunk", "impulse"), (), 150),
    ("bouncing", ("pymunk", "exact"), (SetVelocity(step=50, ball=0, velocity=(90.0, -60.0)),), 140),
    pytest.param("gas-100", ("pymunk(substeps=2)", "pymunk"), DRAG, 90, marks=pytest.mark.wide),
]


def session_of(scene: str, engines: tuple[str, ...], inputs: tuple[Input, ...], steps: int) -> Session:
    """Return a session that has done some steps, as in the window."""
    session = Session(load(scene), engines, inputs, reference="exact")
    for _ in range(steps):
        session.advance()
    return session


def case(session: Session) -> Case:
    run, so_far = RunSoFar.of(session), ComparisonSoFar()
    return case_of(run, so_far.of(run), so_far.marks)


@pytest.mark.usefixtures("working_folder")
@pytest.mark.parametrize(("scene", "engines", "inputs", "steps"), RUNS)
def test_the_window_says_what_compare_says(
    command: Command, scene: str, engines: tuple[str, ...], inputs: tuple[Input, ...], steps: int
) -> None:
    session = session_of(scene, engines, inputs, steps)
    write_run(session.start, session.given(), session.step, "inputs.jsonl")
    names = ",".join(dict.fromkeys([*engines, "exact"]))
    options = ("--engines", names, "--inputs", "inputs.jsonl", "--seconds", repr(session.lockstep.time))
    found = case(session)
    _, printed, _ = command("compare", scene, *options, "--all", "--first")
    command("compare", scene, *options, "--json", "run.json")
    expected = json.loads(Path("run.json").read_text())
    words = " ".join(printed.split())
    assert found.since == expected["since"]
    assert set(found.engines) == set(expected["engines"]) - {"exact"}
    for name, one in found.engines.items():
        of_engine = expected["engines"][name]
        first = of_engine["first_difference"]
        assert bool(one.contacts) == bool(first)
        assert " ".join([name, *one.lines]) in words
        if first:
            assert json.loads(json.dumps(asdict(one.contacts[0].difference))) == first | {"cause": first_cause(one)}
            assert f"{name}, {one.contacts[0].sentence}" in words
            assert " ".join(one.contacts[0].speeds.split()) in words
        shares = {line["share"] for line in of_engine["ledger"].values() if abs(line["share"] or 0) > 5e-7}
        assert not one.ledger or {line.share for line in one.ledger} == shares
        assert all(f"energy: {line.cause} " in words and line.text in words for line in one.ledger)


def first_cause(one: object) -> int:
    """Return the number of a cause, which JSON has by its key."""
    return int(one.contacts[0].difference.cause)  # type: ignore[attr-defined]


def test_contacts_are_at_the_steps_that_contain_them() -> None:
    """Pymunk finds them in the step's end state; the edit at 50 steps moves the origin of times."""
    edit = SetVelocity(step=50, ball=0, velocity=(90.0, -60.0))
    session = session_of("bouncing", ("pymunk", "exact"), (edit,), 140)
    found = case(session)
    assert found.since == 50 / 60
    contacts = [one for one in found.engines["pymunk"].contacts if one.difference.cause == Cause.LATE]
    assert contacts
    for one in contacts:
        before, moment = session.moments(one.step - 1, one.step)
        turned = before.states["pymunk"].velocity != moment.states["pymunk"].velocity
        assert turned[one.difference.first].any()
        assert moment.time - 1 / 60 < one.time <= moment.time + 1e-9
