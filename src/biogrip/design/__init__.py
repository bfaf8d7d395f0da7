"""Which torque to apply and when to look, so that every parameter shows."""
