"""Recorded traces of one's own, from files to verdicts, without a workflow."""
