"""A running scene: steps, inputs, edits, the mouse, and engines in lockstep."""
