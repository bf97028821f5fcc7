"""Pages in one HTML file: of a comparison, of a sweep."""
