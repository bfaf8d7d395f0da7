"""The instrument: how it is built, what its voltage does, how it is calibrated."""
