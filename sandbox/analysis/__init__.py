"""Analysis of runs: energy by cause, first differences from the reference, statistics compared with theory."""
