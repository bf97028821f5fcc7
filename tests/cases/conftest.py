"""The programs in this folder are run by its tests; one of them never ends, so that none may be imported."""

from pathlib import Path

PROGRAMS = sorted(Path(__file__).parent.glob("*.py"))
collect_ignore = [path.name for path in PROGRAMS if path.stem not in ("conftest", "test_cases")]
    path.name for path in Path(__file__).parent.glob("*.py") if path.stem not in ("conftest", "test_cases")
]
