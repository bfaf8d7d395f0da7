"""Recorded traces: read, thinned, and held against what a grip can give."""
