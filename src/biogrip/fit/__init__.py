"""Identification of the sample's parameters from a trace."""
