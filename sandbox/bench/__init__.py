"""Benchmarks: how fast the sandbox is, as figures with their spread.

Machines are noisy. So two things to compare are measured alternately, and their ratio says more than either alone; and
what runs in this process is measured in processor time.
"""

import sandbox.view  # noqa: F401  (pygame prints a banner unless this is imported before it)
