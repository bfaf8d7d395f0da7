"""Creep: a load is held, and what a sample yields is read; micropipettes, stretchers, rheometers.

A sample under the force F is displaced by x, with F(s) = [k_p + c_p s + ...] x(s); under a stress
it is strained, and its springs and dampers are in Pa and Pa s.
"""

from biogrip.instrument.instrument import (
    DISPLACEMENT,
    FORCE,
    STRAIN,
    STRESS,
    STRESS_UNITS,
    Instrument,
    Quantity,
)

_PER_STRESS = {f"1/{unit}": 1 / size for unit, size in STRESS_UNITS.items()}

COMPLIANCE = Quantity("compliance", "1/Pa", _PER_STRESS)

CREEP = (
    Instrument("creep", FORCE, DISPLACEMENT),
    Instrument("creep", STRESS, STRAIN, per_area=True),
    Instrument("creep", STRESS, COMPLIANCE, per_area=True, relative=True),
)
"""What may be held and read."""
