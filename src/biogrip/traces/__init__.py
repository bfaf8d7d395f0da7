"""Recorded traces: reading, thinning, and plausibility checks."""
