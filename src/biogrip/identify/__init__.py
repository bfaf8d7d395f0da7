"""Identification of a recorded trace: what was read and what was done go in, a diagnosis comes out."""
