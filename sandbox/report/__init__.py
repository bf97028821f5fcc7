"""What a user gets: comparisons, advice and scores as text, a comparison as an HTML page, trajectories as files."""
