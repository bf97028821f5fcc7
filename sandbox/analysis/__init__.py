"""What a run amounts to: energy by cause, first differences, statistics beside theory."""
