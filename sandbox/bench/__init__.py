"""Benchmarks: figures with their spread, in processor time. What is compared is measured alternately."""

import sandbox.view  # noqa: F401  (pygame prints a banner unless this is imported before it)
