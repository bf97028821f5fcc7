"""What is wrong in a command is one message, before anything runs or is written."""

import shlex
from pathlib import Path

import pytest
from conftest import Command

PROGRAM = "game.py: is a Python program"
SCHEDULER = "must have a host and a port up to 65535, as in tcp://host:8786"
SETTING = "must be a setting of Pymunk"
REFUSED = {
    # Options
    r"Invalid value for '--engines': 'a,,\x1b' must be different names separated by commas, as in pymunk,exact": (
        "compare article --engines a,,\x1b"
    ),
    'an engine must have a printable name, got ""': "trace article --engine ''",
    "Invalid value for '--rates': '0' must be whole numbers from 1 on": "sweep article --rates 0",
    f"Invalid value for '--set': 'substeps' {SETTING}": "sweep article --set substeps",
    "Invalid value for '--seeds': '9:5' must be two numbers A:B": "sweep article --seeds 9:5",
    "Invalid value for '--seconds': Input should be a valid number": "compare article --seconds abc",
    "No such option: --seconds (see sandbox run --help)": "run article --seconds 3",
    "Option '--json' requires an argument (see sandbox compare --help)": "compare article --json",
    "Missing argument 'SCENE' (see sandbox compare --help)": "compare",
    "No such option: --seed (see sandbox --help)": "--seed 3",
    "No such command 'no-command' (see sandbox --help)": "no-command",
    "--steps and --seconds exclude": "trace article --engine article --steps 2 --seconds 1",
    # Scenes, engines and runs
    "article: is a scene; sandbox run article opens it, sandbox compare article compares engines": "article",
    "my.toml: is a scene; sandbox run my.toml opens it": "my.toml",
    f"{PROGRAM}; sandbox watch game.py runs it, if it uses Pymunk": "game.py",
    f"{PROGRAM}, not a scene; sandbox watch game.py runs a Pymunk program, and --engines": "compare game.py",
    "no engine 'foo'; known are article, ": "compare article --engines pymunk,foo",
    "article: gravity and elasticity below 1 are not part of": "compare bouncing --engines article",
    "seconds must be at least one step, 0.0166667 s, got 0.001": "compare article --seconds 0.001",
    "t.txt: a trace must end in one of .npz, .csv": "trace article --engine article --out t.txt",
    "a trace of 9,999,999 steps needs 640 GB of memory": "trace gas-1000 --engine article --steps 9999999",
    "nothing to score: no [[expect]] in article": "verify article",
    "none.jsonl: cannot be read: No such file or directory": "run article --inputs none.jsonl",
    # Sweeps
    "a sweep of 2,000,000 rows is larger": "sweep article --seeds 0:1000000 --engines pymunk,article",
    "--set subteps: is neither a setting of pymunk nor of every contact; did": "sweep article --set subteps=1",
    "elasticity must be a number from 0 to 1, got 2": "sweep article --set elasticity=2",
    "--set rate: --rates runs several of them": "sweep article --set rate=120",
    "--set substeps: pymunk(substeps=2) has a value of its own; name it without": (
        "sweep article --engines 'pymunk(substeps=2)' --set substeps=1"
    ),
    "--set substeps changes a setting of pymunk, which is not among": (
        "sweep article --engines article --set substeps=1"
    ),
    "--workers and --scheduler exclude": "sweep article --workers 2 --scheduler tcp://127.0.0.1:1",
    f"--scheduler '': {SCHEDULER}": "sweep article --out f.csv --scheduler ''",
    f"--scheduler 'foo:bar': {SCHEDULER}": "sweep article --out f.csv --scheduler foo:bar",
    f"--scheduler 'tcp://[::1': {SCHEDULER}": "sweep article --out f.csv --scheduler 'tcp://[::1'",
    "--scheduler 'tcp://no-such-host.invalid:8786': no scheduler answers: ": (
        "sweep article --out f.csv --scheduler tcp://no-such-host.invalid:8786"
    ),
    "--scheduler 'tcp://127.0.0.1:1': no scheduler answers: Connection refused": (
        "sweep article --out f.csv --scheduler tcp://127.0.0.1:1"
    ),
}


@pytest.mark.parametrize(("message", "line"), REFUSED.items(), ids=REFUSED)
def test_what_is_wrong_is_one_message_and_exit_code_2(
    working_folder: Path, command: Command, line: str, message: str
) -> None:
    code, out, err = command(*shlex.split(line))
    assert (code, out) == (2, "")
    assert err.startswith(message)
    assert err.count("\n") == 1
    assert list(working_folder.iterdir()) == []
