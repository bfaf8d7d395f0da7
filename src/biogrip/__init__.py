"""How well a MEMS microgripper identifies the viscoelastic parameters of a cell."""

__version__ = "0.1.0"
