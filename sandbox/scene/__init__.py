"""Scenes: their model, their files, and their initial state."""

from sandbox.scene.files import bundled, load, parse, schema, write
from sandbox.scene.model import Scene

__all__ = ["Scene", "bundled", "load", "parse", "schema", "write"]
