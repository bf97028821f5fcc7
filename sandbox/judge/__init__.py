"""Judging an engine by its states: each step against the exact one, and against exact ones with one thing wrong."""
