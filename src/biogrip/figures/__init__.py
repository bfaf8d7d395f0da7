"""Figures of traces and of cells."""
