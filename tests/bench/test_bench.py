"""The baselines of the benchmarks do the same work as the engines. Speed itself is not tested."""

import json
import os
import re
from collections.abc import Generator
from itertools import islice
from pathlib import Path
from typing import cast

import numpy as np
import pytest
from conftest import Command

from sandbox.bench import parts
from sandbox.bench.engines import plain_space
from sandbox.bench.figure import Figure, figure
from sandbox.bench.parts import PARTS, Benchmark, bench
from sandbox.engines import create
from sandbox.errors import SandboxError
from sandbox.scene.files import load
from sandbox.scene.spawn import spawn


@pytest.mark.parametrize("scene", ["article", "gas-100"])
def test_the_plain_pymunk_loop_is_the_engine_s_run(scene: str) -> None:
    """Contacts of one step may be solved in another order, so only a third of a second is compared."""
    space, engine = plain_space(load(scene)), create("pymunk", load(scene), spawn(load(scene)))
    for _ in range(20):
        space.step(1 / 60)
        engine.step()
    assert np.array([body.position for body in space.bodies]) == pytest.approx(engine.state().position, abs=1e-6)


def test_a_part_yields_figures_with_their_spread() -> None:
    environment = dict(os.environ)
    [(title, figures)] = bench(["window"])
    found = list(islice(figures, 2))
    cast("Generator[Figure]", figures).close()
    assert title == f"window: {PARTS['window'].guards}"
    assert [one.name for one in found] == ["frame n=3", "frame / plain n=3"]
    assert all(0 < one.lowest <= one.median <= one.highest for one in found)
    assert dict(os.environ) == environment


def test_the_help_and_the_documents_name_every_part(command: Command) -> None:
    _, out, _ = command("bench", "--help")
    page = (Path(__file__).parents[2] / "docs" / "engines.md").read_text()
    for name in PARTS:
        assert re.search(rf"\b{name}\b", out)
        assert f"`{name}`" in page


def test_the_error_for_an_unknown_part_names_the_nearest() -> None:
    with pytest.raises(SandboxError, match=r"^no benchmark 'pymnk'; did you mean pymunk\?$"):
        next(bench(["pymnk"]))


def test_json_on_standard_output_stays_alone(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    made_up = figure("time", "time of a frame", [3.0, 2.0, 2.5], "ms")
    monkeypatch.setattr(parts, "PARTS", {"made-up": Benchmark("Made up", lambda _rounds: iter([made_up]))})
    code, out, err = command("bench", "--json", "-")
    assert (code, err) == (0, "")
    [written] = json.loads(out)
    assert [written[key] for key in ("median", "lowest", "highest", "unit")] == [2.5, 2.0, 3.0, "ms"]
    _, out, _ = command("bench")
    assert out.split()[-5:] == ["frame", "2.5", "2", "3", "ms"]
