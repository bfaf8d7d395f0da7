"""Cells of whole dishes: replicates fitted jointly, populations, and how far two are apart."""
