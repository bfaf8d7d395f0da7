"""Gripper, samples, protocols and noise, and the responses that they give."""
