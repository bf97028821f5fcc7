"""What runs come to: energy by cause, first differences from the reference, statistics compared with theory."""
