"""Templates of pages, self-contained HTML."""
