"""Shapes that stand between a force and a modulus: tips, pipettes, cylinders.

Under a load F a sample of Young's modulus E yields by the depth d as F = factor E d^n or, as a
half-space under a tip, F = factor E/(1 - nu^2) d^n with Poisson's ratio nu. So F over the factor is
a stress under the strain d^n, in a unit of length; of a viscoelastic sample under a tip, too, while
the contact does not shrink (Lee and Radok, J. Appl. Mech. 27 (1960), 438-444).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import pi, sqrt, tan

from biogrip.physics.instruments import (
    DISPLACEMENT,
    FORCE,
    PHASE,
    STRAIN,
    STRESS,
    Channel,
    Instrument,
)

INCOMPRESSIBLE = 0.5
"""Poisson's ratio of samples of which nothing says another."""

# Length of which a depth is a multiple where a shape has none, in m.
_UNIT_M = 1e-6
_WALL_FACTOR = 2.1


@dataclass(frozen=True)
class Shape:
    """What a load and a depth are to a modulus."""

    example: str
    """Its name and its sizes."""
    exponent: float
    """Power of the depth."""
    factor: Callable[..., float]
    """Load over modulus and power of the depth, of its sizes, in m or rad."""
    law: str
    """The same in words."""
    source: str
    """Who found it."""
    condition: str
    """When it holds."""
    load: Channel = FORCE
    """What presses or sucks."""
    is_tip: bool = True
    """True if it touches a half-space, and more of it the deeper it is."""

    @property
    def sizes(self) -> Channel:
        """Units that its sizes may have."""
        return PHASE if self.example.endswith("deg") else DISPLACEMENT


KNOWN_SHAPES = {
    shape.example.partition(" ")[0]: shape
    for shape in (
        Shape(
            *("sphere 2.5 um", 1.5, lambda radius: 4 / 3 * sqrt(radius)),
            *("F = (4/3) sqrt(R) E/(1 - nu^2) d^1.5", "Hertz 1882", "d is far below R"),
        ),
        Shape(
            *("cone 35 deg", 2.0, lambda angle: 2 / pi * tan(angle)),
            *("F = (2/pi) tan(a) E/(1 - nu^2) d^2", "Sneddon 1965", "a is that of axis and side"),
        ),
        Shape(
            *("pyramid 17.5 deg", 2.0, lambda angle: 0.7453 * tan(angle)),
            *("F = 0.7453 tan(a) E/(1 - nu^2) d^2", "Bilodeau 1992"),
            "it has four sides, and a is that of axis and face",
        ),
        Shape(
            *("punch 2 um", 1.0, lambda radius: 2 * radius),
            *("F = 2 R E/(1 - nu^2) d", "Sneddon 1965", "its end is flat and all of it touches"),
        ),
        Shape(
            *("pipette 2.5 um", 1.0, lambda radius: 2 * pi / (3 * _WALL_FACTOR * radius)),
            *("p = 2 pi E d/(3 * 2.1 R)", "Theret 1988", "the cell is far larger than R"),
            *(STRESS, False),
        ),
        Shape(
            "cylinder 8 mm x 4 mm",
            *(1.0, lambda diameter, height: pi * diameter**2 / (4 * height)),
            *("F = pi D^2 E d/(4 h)", "uniaxial compression", "both plates let it slide"),
            is_tip=False,
        ),
    )
}
"""Shapes by name."""


def under_shape(
    instrument: Instrument, shape: Shape, sizes: Sequence[float], poisson: float
) -> Instrument:
    """Return an instrument of stress and strain that has the load and depth of a shape.

    Sizes are in m or rad. A `KeyError` has a quantity that is neither stress nor strain.
    """
    length_m = _UNIT_M if shape.sizes == PHASE else sizes[-1]
    factor = shape.factor(*sizes) / (1 - poisson**2 if shape.is_tip else 1)
    stress = 1 / (factor * length_m**shape.exponent)
    loads = {unit: size * stress for unit, size in shape.load.units.items()}
    depths = {unit: size / length_m for unit, size in DISPLACEMENT.units.items()}
    depth = replace(STRAIN, units=depths, label="depth", power=shape.exponent)
    of = {STRESS: replace(STRESS, units=loads, label=shape.load.name), STRAIN: depth}
    return replace(instrument, controlled=of[instrument.controlled], read=of[instrument.read])
