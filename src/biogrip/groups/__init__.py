"""Groups of cells: replicates fitted jointly, populations, and differences between groups."""
