"""Relaxation: a deformation is held, and the load that is left is read; AFM dwells, rheometers."""

from biogrip.instrument.instrument import (
    DISPLACEMENT,
    FORCE,
    STRAIN,
    STRESS,
    STRESS_UNITS,
    Instrument,
    Quantity,
)

MODULUS = Quantity("modulus", "Pa", STRESS_UNITS)

RELAXATION = (
    Instrument("relaxation", DISPLACEMENT, FORCE),
    Instrument("relaxation", STRAIN, STRESS, per_area=True),
    Instrument("relaxation", STRAIN, MODULUS, per_area=True, relative=True),
)
"""What may be held and read."""
