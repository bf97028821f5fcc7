"""The programs in this folder are run by its tests; one of them never ends, so that none may be imported."""

from pathlib import Path

FILES = sorted(Path(__file__).parent.glob("*.py"))
collect_ignore = [path.name for path in FILES if path.stem not in ("conftest", "test_cases")]
