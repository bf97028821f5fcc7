"""No code and no settings of the current folder are used."""

import subprocess
import sys
from pathlib import Path

import pytest
from conftest import Command
from hostile import SCENE

pytestmark = pytest.mark.usefixtures("working_folder")


@pytest.mark.wide
def test_no_module_of_the_current_folder_is_run(tmp_path: Path) -> None:
    """Worker processes of Python would search it first."""
    program = tmp_path / "elsewhere" / "program.py"
    program.parent.mkdir()
    program.write_text("if __name__ == '__main__':\n    from sandbox.cli import main\n    main()")
    Path("mine.toml").write_text(SCENE)
    for module in ("multiprocessing", "pickle", "numpy", "sandbox"):
        Path(f"{module}.py").write_text("open('ran', 'w')")
    arguments = ["sweep", "mine.toml", "--engines", "article", "--workers", "1"]
    run = subprocess.run([sys.executable, program, *arguments], capture_output=True, text=True, check=False)
    assert (run.returncode, run.stderr) == (0, "")
    assert len(run.stdout.splitlines()) == 2
    assert not Path("ran").exists()


def test_numba_settings_in_the_current_folder_are_rejected(command: Command) -> None:
    """They can name a folder of compiled code, which is pickled: reading it runs it."""
    Path(".numba_config.yaml").write_text("cache_dir: cache")
    Path("mine.toml").write_text(SCENE)
    message = ".numba_config.yaml: numba would obey it; move it away, or go to another folder\n"
    assert command("check", "mine.toml") == (2, "", message)
    assert not Path("cache").exists()
