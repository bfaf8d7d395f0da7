"""Identifiability analysis: which quantities a trace determines, and how precisely."""
