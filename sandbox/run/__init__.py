"""Running a scene: inputs, edits and the mouse; engines in lockstep."""
