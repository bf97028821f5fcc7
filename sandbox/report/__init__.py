"""Comparisons, advice and scores as text; a comparison as a page in one HTML file."""
