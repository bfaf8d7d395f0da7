"""Samples under force control, identified by what the field uses."""
