"""Optimal experimental design: torque and sampling that determine the parameters best."""
