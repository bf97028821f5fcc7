"""Two versions of pygame in one environment, or a damaged one."""

import sys
from pathlib import Path
from types import ModuleType

import pygame
import pytest

from sandbox.errors import SandboxError
from sandbox.view import REPAIR, check_pygame


def test_both_pygames_are_named_with_the_one_that_is_complete(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert check_pygame() is None
    for name, version in (("pygame", "2.6.9"), ("pygame_ce", "2.5.99")):
        information = tmp_path / f"{name}-{version}.dist-info"
        information.mkdir()
        (information / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    monkeypatch.syspath_prepend(tmp_path)
    both = "warning: pygame 2.6.9 and pygame-ce 2.5.99 are both installed, in one folder"
    assert check_pygame() == f"{both}, where {pygame.ver} is complete; {REPAIR}"


@pytest.mark.parametrize(
    ("module", "why"),
    [(None, "import of pygame halted"), (ModuleType("pygame"), "cannot import name")],
    ids=["absent", "damaged"],
)
def test_a_pygame_that_lacks_parts_is_reported(
    module: ModuleType | None, why: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pygame", module)
    with pytest.raises(SandboxError, match=rf"^pygame cannot be used: {why}.*; {REPAIR}$"):
        check_pygame()
