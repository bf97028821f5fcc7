"""Scenes: their model, their files, and their initial state."""

from sandbox.scene.files import bundled, dump, load, parse, scenes, schema
from sandbox.scene.model import Scene

__all__ = ["Scene", "bundled", "dump", "load", "parse", "scenes", "schema"]
