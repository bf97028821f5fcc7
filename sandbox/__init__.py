"""A rigid-body sandbox: several solvers run one scene side by side, and are told how far they are apart."""

from sandbox.mistakes import Mistake
from sandbox.scene import Scene, load
from sandbox.simulate import Trajectory, simulate

__all__ = ["Mistake", "Scene", "Trajectory", "load", "simulate"]
