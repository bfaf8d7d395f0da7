"""What an instrument controls, what it reads, and its words for both.

A gripper controls a torque. Creep controls a load and reads what a sample yields: micropipettes,
stretchers, rheometers. A sample under the force F is displaced by x, F(s) = [k_p + c_p s + ...]
x(s); under a stress it is strained, and its springs and dampers are in Pa and Pa s. Relaxation
controls a deformation and reads the load that is left: AFM dwells, rheometers. Oscillation strains
by sines, one frequency after the other, and reads two moduli: rheometers, microrheology.

Shapes stand between a force and a modulus: tips, pipettes, cylinders. Under a load F a sample of
Young's modulus E yields by the depth d as F = factor E d^n or, as a half-space under a tip, F =
factor E/(1 - nu^2) d^n with Poisson's ratio nu. So F over the factor is a stress under the strain
d^n, in a unit of length; of a viscoelastic sample under a tip, too, while the contact does not
shrink (Lee and Radok, J. Appl. Mech. 27 (1960), 438-444).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import pi, sqrt, tan
from typing import Any


@dataclass(frozen=True)
class Channel:
    """A quantity that an instrument controls or reads."""

    name: str
    """Name in messages, in the config, and of the option for its column."""
    unit: str
    """SI unit; empty for a pure number."""
    units: Mapping[str, float] = field(hash=False, compare=False)
    """Units of a file's column, as multiples of the SI unit."""
    label: str = ""
    """Name on axes, where it says more."""
    usual: str = ""
    """Usual name of a column whose numbers have another unit."""
    power: float = field(default=1.0, compare=False)
    """Exponent of a number in such a unit, as 1.5 of the depth of a sphere."""

    def in_si(self, sizes: Any, unit: str, scale: float = 1.0) -> Any:
        """Return numbers in one of the units, times a scale, in the SI unit."""
        return _raised(sizes * (self.units[unit] * scale), self.power)

    def slope(self, sizes: Any) -> Any:
        """Return the slope of the SI value over sizes, which are numbers times their unit."""
        return self.power * abs(sizes) ** (self.power - 1)

    def in_unit(self, values: Any, unit: str) -> Any:
        """Return values in the SI unit as numbers in one of the units."""
        return _raised(values, 1 / self.power) / self.units[unit]

    @property
    def title(self) -> str:
        """Name on axes."""
        return self.label or self.name

    @property
    def suffix(self) -> str:
        """End of the names of columns and keys: the SI unit."""
        plain = self.unit.replace("1/", "per_").replace(" ", "")
        return f"_{plain}" if plain else ""

    @property
    def column(self) -> str:
        """Usual name of a column or key: the name with the unit."""
        return self.usual or self.name + self.suffix


def _raised(sizes: Any, power: float) -> Any:
    """Return a power of each size, with its sign."""
    if power == 1:
        return sizes
    return (1.0 * (sizes > 0) - (sizes < 0)) * abs(sizes) ** power


@dataclass(frozen=True)
class Instrument:
    """What an instrument controls and reads."""

    kind: str
    """`gripper`, `creep`, `relaxation` or `oscillation`."""
    controlled: Channel
    """What the protocol sets."""
    read: Channel
    """What a trace is of."""
    stiffness: str = "N/m"
    """Unit of a sample's stiffnesses: Pa if they are moduli, none if these are shares; those of
    its dampings and compliances follow."""
    relative: bool = False
    """True if what is read is divided by the largest controlled value."""
    partners: tuple[Channel, ...] = ()
    """What may be read beside it at each frequency of a sweep, so that both tell both moduli."""
    sentence: str = "In {kind} the {read} was recorded"
    """What a paper says of it."""

    @property
    def in_words(self) -> str:
        """What a paper says of it, up to what was controlled."""
        return self.sentence.format(kind=self.kind, read=self.read.name.replace("_", " "))

    @property
    def deforms(self) -> bool:
        """True if a deformation is controlled and a load is read."""
        return self.kind == "relaxation" or self.sweeps

    @property
    def sweeps(self) -> bool:
        """True if frequencies are swept; else readings follow one another in time."""
        return self.kind == "oscillation"

    @property
    def has_jaws(self) -> bool:
        """True if it grips the sample between arms, which yield and may let it go."""
        return self.kind == "gripper"


TORQUE = Channel(
    "torque", "N m", {"N m": 1.0, "mN m": 1e-3, "uN m": 1e-6, "nN m": 1e-9, "pN m": 1e-12}
)
ROTATION = Channel(
    "rotation",
    "rad",
    {"rad": 1.0, "mrad": 1e-3, "urad": 1e-6, "deg": pi / 180},
    "closing rotation",
)
GRIPPER = Instrument(
    *("gripper", TORQUE, ROTATION),
    sentence="The {read} of an arm of a microgripper was recorded",
)
"""Its read rotation is the closing one of its left arm."""

STRESS_UNITS = {
    **{"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "mPa": 1e-3, "bar": 1e5, "mbar": 1e2},
    **{"cmH2O": 98.0665, "mmHg": 133.322387415},
}
"""Units of stresses and moduli; columns of water and mercury are the conventional ones."""

_FORCES = {"N": 1.0, "mN": 1e-3, "uN": 1e-6, "nN": 1e-9, "pN": 1e-12, "kN": 1e3, "MN": 1e6}
FORCE = Channel("force", "N", _FORCES | {"gf": 9.80665e-3, "kgf": 9.80665})
DISPLACEMENT = Channel(
    "displacement", "m", {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9}
)
STRESS = Channel("stress", "Pa", STRESS_UNITS)
STRAIN = Channel("strain", "", {"1": 1.0, "%": 1e-2, "‰": 1e-3, "ppm": 1e-6})

COMPLIANCE = Channel(
    "compliance", "1/Pa", {f"1/{unit}": 1 / size for unit, size in STRESS_UNITS.items()}
)

MODULUS = Channel("modulus", "Pa", STRESS_UNITS)
RELATIVE_MODULUS = Channel("relative_modulus", "", {"1": 1.0, "%": 1e-2}, "relative modulus")

_STIFFNESSES = {"N/m": 1.0, "mN/m": 1e-3, "N/mm": 1e3, "nN/um": 1e-3, "pN/um": 1e-6, "pN/nm": 1e-3}
PHASE = Channel("phase", "rad", {"rad": 1.0, "mrad": 1e-3, "deg": pi / 180})
LOSS_FACTOR = Channel("loss_factor", "", {"1": 1.0, "%": 1e-2})
LOSS = Channel("loss", "Pa", STRESS_UNITS)
_LOSSES = LOSS, PHASE, LOSS_FACTOR
_STIFF_LOSSES = Channel("loss", "N/m", _STIFFNESSES), PHASE, LOSS_FACTOR
_MODULI = [Channel(name, "Pa", STRESS_UNITS) for name in ("storage", "complex_modulus")]
VISCOSITY = Channel(
    *("complex_viscosity", "Pa", {"Pa s": 1.0, "mPa s": 1e-3, "P": 0.1, "cP": 1e-3}),
    usual="complex_viscosity_Pas",
)
"""It is times the angular frequency a modulus, which is what a trace has of it."""
_STIFF = Channel("storage_stiffness", "N/m", _STIFFNESSES)

_READ_BOTH = "In oscillation storage and loss moduli were recorded over frequency"
_READ_LOSS = "In oscillation loss moduli were recorded over frequency, without storage moduli"

INSTRUMENTS: dict[str, Instrument] = {
    instrument.read.name: instrument
    for instrument in (
        GRIPPER,
        Instrument("creep", FORCE, DISPLACEMENT),
        Instrument("creep", STRESS, STRAIN, stiffness="Pa"),
        Instrument("creep", STRESS, COMPLIANCE, stiffness="Pa", relative=True),
        Instrument("relaxation", DISPLACEMENT, FORCE),
        Instrument("relaxation", STRAIN, STRESS, stiffness="Pa"),
        Instrument("relaxation", STRAIN, MODULUS, stiffness="Pa", relative=True),
        Instrument("relaxation", STRAIN, RELATIVE_MODULUS, stiffness="", relative=True),
        *(
            Instrument("oscillation", STRAIN, of, "Pa", True, _LOSSES, _READ_BOTH)
            for of in (*_MODULI, VISCOSITY)
        ),
        Instrument("oscillation", DISPLACEMENT, _STIFF, "N/m", True, _STIFF_LOSSES, _READ_BOTH),
        # Where no other is named: else it is a partner.
        Instrument("oscillation", STRAIN, LOSS, "Pa", True, (), _READ_LOSS),
    )
}
"""Instruments by the name of the quantity that they read."""

PARTNERS = {each.name: each for of in INSTRUMENTS.values() for each in of.partners}
"""What sweeps read beside another modulus, by name."""

KINDS = tuple(dict.fromkeys(instrument.kind for instrument in INSTRUMENTS.values()))
"""Values of the config key `instrument`."""

CONTROLLED = tuple(dict.fromkeys(instrument.controlled for instrument in INSTRUMENTS.values()))
"""Quantities that protocols set."""


def in_contact(loads: Any, power: float, deeper: float) -> Any:
    """Return powers of depths that are deeper by some unit, from powers of depths with their sign.

    Before its contact a tip neither presses nor indents.
    """
    depths = _raised(loads, 1 / power) + deeper
    return _raised(0.5 * (depths + abs(depths)), power)


def of_kind(kind: str) -> list[Instrument]:
    """Return the instruments of a kind."""
    return [each for each in INSTRUMENTS.values() if each.kind == kind]


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
