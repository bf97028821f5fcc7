"""Event-driven hard discs."""

from sandbox.engines.exact.engine import ExactEngine

__all__ = ["ExactEngine"]
