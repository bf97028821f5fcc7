"""Scores of engines against the expectations of scenes."""
