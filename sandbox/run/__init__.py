"""Running a scene: the clock, inputs, edits and the mouse; engines in lockstep; trajectories."""
