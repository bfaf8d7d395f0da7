"""The study's identification methods beside least squares."""
