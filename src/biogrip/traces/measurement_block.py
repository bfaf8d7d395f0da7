"""Config block of the measurement: sampling, noise, and the file of a recorded trace.

A simulated trace has a rate and a noise. A recorded one has a file, the names of
its columns with their units, and what is known of its noise; what identifications fit along
with the sample is the same for both.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated

from pydantic import Field, Tag

from biogrip.keys import BY_KIND, Block, Complaint, Distinct, OneOf
from biogrip.physics.instruments import (
    INCOMPRESSIBLE,
    INSTRUMENTS,
    LOSS,
    PARTNERS,
    ROTATION,
    STRAIN,
    STRESS,
    Channel,
    Instrument,
    under_shape,
)
from biogrip.physics.noise import Noise
from biogrip.traces.columns import AXES, shape_and_sizes, trace_file_problem

COLOURED = "coloured"
KNOWN_NOISE = ("noise_rad", "sd", "noise_share")
"""Keys that say how large the noise is."""

ARRAYS = "<arrays>"
"""The file of a trace that is given as arrays."""

READINGS = tuple(INSTRUMENTS)
"""Keys that name the column of the readings, one for each quantity that an instrument reads."""

_OF_TIMES = {"start_s", "load", "fit_start", "offset", "drift"}
_OF_SWEEPS = ("frequency", "frequency_unit", *PARTNERS, "partner_unit", "loss_sd", "phase_sd_rad")
# Keys of simulated traces, too; the others are of a file.
_OF_ALL = {"rate_Hz", "file", "noise", "noise_model", "offset", "drift"}
# What keys that no option of the command sets but `--set` may say, beside units.
_BY_SET = {"loss_sd": "COLUMN", "load_scale": "-1", "scale": "-1", "average_repeated": "true"}
# Keys that go with another one, and pairs of keys that do not.
_GOES_WITH = {"load_scale": "load", "poisson": "shape", "phase_sd_rad": "noise_share"}
_EITHER = (
    *(("fit_start", "start_s"), ("fit_start", "load"), ("noise_rad", "sd"), ("noise_share", "sd")),
    *(("rotation_unit", key) for key in READINGS if key != ROTATION.name),
    ("reading_unit", ROTATION.name),
)

_Name = Annotated[str | None, Field(min_length=1, max_length=4000)]
_Unit = Annotated[str | None, Field(min_length=1, max_length=20)]

_BlockNumber = Annotated[int, Field(ge=1, le=1_000_000)]
_Blocks = Annotated[
    Annotated[_BlockNumber, Tag("a number")]
    | Annotated[
        Distinct[tuple[_BlockNumber, ...]], Field(min_length=1, max_length=1000), Tag("a list")
    ],
    BY_KIND,
]

_Value = Annotated[Annotated[float, Tag("a number")] | Annotated[str, Tag("text")], BY_KIND]


@dataclass(frozen=True, kw_only=True)
class MeasurementBlock(Block):
    """Sampling and noise of what the instrument reads, or the file of a recorded trace."""

    rate_Hz: Annotated[float, Field(ge=1e-9, le=1e9)]
    """Sampling rate; the first sample is at t = 0."""
    file: _Name = None
    """A recorded trace, CSV, instead of a simulated one; relative to where Snakemake runs."""
    time: _Name = None
    """Name of the file's column of times; its clock starts with the protocol, or before."""
    rotation: _Name = None
    """Name of the file's column of the left arm's closing rotation."""
    displacement: _Name = None
    """Name of the column of displacements under a held force (`instrument: creep`)."""
    strain: _Name = None
    """Name of the column of strains under a held stress (creep)."""
    compliance: _Name = None
    """Name of the column of creep compliances, strains over the largest held stress (creep)."""
    force: _Name = None
    """Name of the column of forces at a held displacement (`instrument: relaxation`)."""
    stress: _Name = None
    """Name of the column of stresses at a held strain (relaxation)."""
    modulus: _Name = None
    """Name of the column of relaxation moduli, stresses over the largest held strain
    (relaxation)."""
    relative_modulus: _Name = None
    """Name of the column of relaxation moduli over another one, as G/G0, without a unit
    (relaxation)."""
    storage: _Name = None
    """Name of the column of storage moduli of a frequency sweep (`instrument: oscillation`)."""
    complex_modulus: _Name = None
    """Name of the column of absolute values of the complex modulus (oscillation)."""
    complex_viscosity: _Name = None
    """Name of the column of complex viscosities, moduli over the angular frequency
    (oscillation)."""
    storage_stiffness: _Name = None
    """Name of the column of storage stiffnesses, in N/m (oscillation)."""
    frequency: _Name = None
    """Name of the column of frequencies of a sweep, in any order."""
    loss: _Name = None
    """Name of the column of loss moduli; a sweep has this, `phase` or `loss_factor`, or this alone,
    of which nothing tells springs that do not relax."""
    phase: _Name = None
    """Name of the column of phases between strain and stress."""
    loss_factor: _Name = None
    """Name of the column of loss factors, loss over storage modulus (tan delta)."""
    frequency_unit: _Unit = None
    """Unit of the frequencies, rad/s, Hz, mHz or kHz, where the name does not end in it."""
    partner_unit: _Unit = None
    """Unit of loss moduli or phases, where the column's name does not end in it; of loss moduli by
    default that of the storage moduli."""
    loss_sd: _Name = None
    """Name of the column of the loss moduli's standard deviations; `sd` has those of the others."""
    time_unit: _Unit = None
    """Unit of the times, s, ms, us, min, h or d, where the column's name does not end in it."""
    rotation_unit: _Unit = None
    """Unit of the rotations, rad, mrad, urad or deg, where the column's name does not end in it."""
    reading_unit: _Unit = None
    """Unit of what another instrument reads, where the column's name does not end in it; of strains
    by default 1."""
    block: _Blocks | None = None
    """Number of the block to read, where several tables follow one another in the file; or a list,
    as `[1, 2]`, of blocks that are one test, such as creep and recovery, to join in this order.
    Times that begin anew in one go on from the last one before."""
    rows: Annotated[Mapping[str, _Value], Field(min_length=1)] | None = None
    """Values of other columns in the rows to use, as `{Segment: dwell}`; the others are left
    out."""
    load: _Name = None
    """Name of the file's column of what was controlled: torques, or the forces, stresses,
    displacements or strains under which the readings were taken. The protocol follows it from row
    to row, from start_s on; without that from its first row or, if there it is not zero, from 0.
    Only for `biogrip identify`."""
    load_unit: _Unit = None
    """Unit of the column `load`, where its name does not end in it."""
    load_scale: Annotated[float | None, Field(ge=-1e30, le=1e30)] = None
    """Load, in its unit, over the number in its column, as `scale` is of the readings: -1 for a
    tip's separation, which is negative in contact. By default 1."""
    shape: Annotated[str | None, Field(min_length=1, max_length=60)] = None
    """What stands between force and modulus, with its sizes, as `sphere 2.5 um`, `cone 35 deg`,
    `pyramid 17.5 deg`, `punch 2 um`, `pipette 2.5 um` or `cylinder 8 mm x 4 mm`. The columns then
    have forces, of a pipette stresses, and displacements, and moduli are Young's."""
    poisson: Annotated[float | None, Field(ge=0, le=0.5)] = None
    """Poisson's ratio of a sample that a tip indents. By default 0.5, incompressible."""
    fit_contact: bool = False
    """If true, fit the depth along at which a tip touches the sample, as where its contact was set
    by eye; the limits allow for its uncertainty. It takes readings of the approach. By default
    false."""
    average_repeated: bool = False
    """If true, average the readings of equal times, as a rounded clock writes them."""
    from_s: Annotated[float | None, Field(ge=-1e12, le=1e12)] = None
    """First time of the file's clock to use: readings before it are left out, as where a rheometer
    has not yet reached its strain. The protocol stays. Of a sweep the lowest frequency to use, in
    the unit of its column. By default all are used."""
    until_s: Annotated[float | None, Field(ge=-1e12, le=1e12)] = None
    """Last time of the file's clock to use, as before a sample slips; or the highest frequency, as
    below that from which inertia shows."""
    scale: Annotated[float | None, Field(ge=-1e30, le=1e30)] = None
    """Rotation, in its unit, over the number in the column: for a sensor's volts, or -1 for a
    rotation that is positive where the arm opens. By default 1."""
    start_s: Annotated[float | None, Field(ge=-1e12, le=1e12)] = None
    """Time of the file's clock at which the protocol starts. Readings before it tell of the zero
    only. By default 0, before which there may be none."""
    fit_start: bool = False
    """If true, fit the start along; the limits allow for its uncertainty. By default false."""
    noise_rad: Annotated[float | None, Field(ge=1e-15, le=1e12)] = None
    """Standard deviation of the recorded noise, if it is known; by default it is estimated from the
    residuals."""
    sd: _Name = None
    """Name of the file's column of the readings' standard deviations, in the unit of the rotations.
    Every reading then has the weight 1/sd² in all fits, and the noise is known."""
    noise_share: Annotated[float | None, Field(gt=0, le=1)] = None
    """Standard deviation of the noise as a share of the rotation, with weights as by sd. To it is
    added noise_rad, squared; without that, it is at least the scatter of the tenth of the readings
    with the smallest rotations."""
    phase_sd_rad: Annotated[float | None, Field(gt=0, le=1)] = None
    """Standard deviation of a sweep's phases; `noise_share` is then that of its amplitudes."""
    offset: bool | None = None
    """If true, fit a constant offset of the instrument along. By default only with a coloured noise
    model."""
    drift: bool | None = None
    """If true, fit a linear drift of the instrument along. By default only with a coloured noise
    model; false where the instrument is known not to drift, and the sample may flow."""
    noise_model: Annotated[str | None, OneOf(("white", COLOURED))] = None
    """Model of the noise when a trace is judged. `white`: samples are independent; `coloured`:
    noise may be autocorrelated (AR(1), 1/f, a random walk) and grow with the rotation, and outliers
    are left out, so that intervals are wider and keep their coverage; every identification, judged
    or not, then fits an offset and a drift along, unless they are false. By default white."""
    noise: Noise

    @property
    def coloured(self) -> bool:
        """True if the noise model is more than white noise."""
        return self.noise_model == COLOURED

    @property
    def instrument(self) -> Instrument:
        """The instrument of a recorded trace, with the units that its columns may have."""
        instrument = INSTRUMENTS[self.readings[0]]
        if self.shape is None:
            return instrument
        poisson = INCOMPRESSIBLE if self.poisson is None else self.poisson
        return under_shape(instrument, *shape_and_sizes(self.shape), poisson)

    @property
    def has_tip(self) -> bool:
        """True if a tip indents the sample, of which nothing holds while its contact shrinks."""
        return self.shape is not None and shape_and_sizes(self.shape)[0].is_tip

    @property
    def tip_power(self) -> float | None:
        """Exponent of a recorded depth of a tip; None if none was recorded."""
        recorded = self.has_tip and self.load is not None
        controlled = self.instrument.controlled if recorded else None
        return controlled.power if controlled and controlled.name == STRAIN.name else None

    @property
    def partner(self) -> Channel | None:
        """What a sweep reads beside another modulus."""
        return next((it for it in self.instrument.partners if getattr(self, it.name)), None)

    @property
    def axis(self) -> str:
        """What readings follow: a key of `AXES`."""
        return "frequency" if self.instrument.sweeps else "time"

    @property
    def named(self) -> dict[str, str]:
        """Names of a file's columns by the key that says them, in the order of reading."""
        partner = [self.partner.name] if self.partner else []
        keys = (self.axis, self.readings[0], *partner, "sd", "loss_sd", "load")
        return {key: name for key in keys if (name := getattr(self, key)) is not None}

    @property
    def blocks(self) -> tuple[int, ...]:
        """Numbers of the blocks to read, in their order; none if nothing says which."""
        return (self.block,) if isinstance(self.block, int) else self.block or ()

    def units_of(self, key: str) -> Mapping[str, float]:
        """Return the units that a column of `named` may have."""
        if key == self.axis:
            return AXES[key]
        if key == "load":
            return self.instrument.controlled.units
        partner = self.partner
        return partner.units if partner and key == partner.name else self.instrument.read.units

    @property
    def axis_column(self) -> str:
        """Name of the column of times, or of a sweep's frequencies."""
        return self.named[self.axis]

    @property
    def reading_column(self) -> str:
        """Name of that of what the instrument reads."""
        return self.named[self.readings[0]]

    def said_by(self, *keys: str) -> str:
        """Return the options of the command that say keys, for messages."""
        return " and ".join(map(_option, keys))

    @property
    def deepened(self) -> str:
        """What makes a tip's load positive in contact, for messages."""
        if self.load_scale is None:
            return f"turn it by {self.said_by('load_scale')}"
        return "its zero is where the tip touches, as of a height less that of the contact"

    def unit_key(self, key: str) -> str:
        """Return the key that says the unit of a column of `named`."""
        if key in (self.axis, "load"):
            return f"{key}_unit"
        if self.partner and key == self.partner.name:
            return "partner_unit"
        return "rotation_unit" if self.rotation else "reading_unit"

    @property
    def readings(self) -> list[str]:
        """Quantities whose columns are named; of a valid recorded trace, one."""
        named = [name for name in READINGS if getattr(self, name) is not None]
        # Beside another modulus, a loss modulus is its partner.
        return [name for name in named if name != LOSS.name] or named

    @property
    def along(self) -> dict[str, bool]:
        """True for offset and drift as far as they are fitted along."""
        said = {"offset": self.offset, "drift": self.drift}
        return {name: self.coloured if it is None else it for name, it in said.items()}

    def complaints(self) -> Iterator[Complaint]:
        """Find keys that are in conflict, and what a recorded trace lacks."""
        given = {key: it for key, it in vars(self).items() if it is not None and it is not False}
        for key in (key for key in KNOWN_NOISE if key in given and self.coloured):
            yield (key,), "is that of white noise; leave it out where noise_model is coloured."
        for key, other in _EITHER:
            if key in given and other in given:
                yield (key,), f"does not go with {other}; allowed is one of them."
        for key, other in _GOES_WITH.items():
            if key in given and other not in given:
                yield (key,), f"goes with {other}; give both, or leave it out."
        for key in ("scale", "load_scale"):
            if given.get(key) == 0:
                yield (key,), "found 0, allowed is another number."
        used = {key for key, value in given.items() if value != 0}
        if self.file is None:
            for key in (key for key in given if key in used - _OF_ALL):
                yield (key,), "is only for a recorded trace, whose measurement has a file."
            return
        yield from self._axis_complaints(used)
        yield from self._reading_complaints()
        if self.file != ARRAYS and (complaint := trace_file_problem(self.file)):
            yield ("file",), complaint

    def _axis_complaints(self, given: set[str]) -> Iterator[Complaint]:
        """Find what a sweep or a trace in time lacks, and what only the other one has."""
        sweeps = any(INSTRUMENTS[name].sweeps for name in self.readings)
        axis = "frequency" if sweeps else "time"
        if axis not in given:
            yield (axis,), f"is missing: a recorded trace needs the name of its {axis} column."
        for key in sorted(given & {*(_OF_TIMES if sweeps else _OF_SWEEPS)}):
            kind = "a trace in time, and this is a frequency sweep" if sweeps else "a sweep"
            yield (key,), f"is of {kind}; leave it out."
        if not sweeps:
            return
        if len(partners := given & {*PARTNERS}) != 1:
            found = " and ".join(sorted(partners)) or "none"
            text = f"goes with one of {', '.join(PARTNERS)}; found {found}"
            way = "--reading loss=COLUMN, or in a table of traces by a column measurement.loss"
            yield (self.readings[0],), f"{text}. Say which, as in {way}."
        if self.coloured:
            yield ("noise_model",), "found coloured, allowed with a frequency sweep is white."
        if self.readings == [LOSS.name]:
            for key in sorted(given & {"loss_sd", "phase_sd_rad"}):
                yield (key,), "is of both moduli, and only the loss modulus is read; leave it out."
            return
        alone = len(given & {"sd", "loss_sd"}) == 1 or ("sd" in given and "loss" not in given)
        if alone or {"sd", "complex_viscosity"} <= given:
            yield ("sd",), "of a sweep goes with loss and loss_sd: both moduli need deviations."

    def _reading_complaints(self) -> Iterator[Complaint]:
        if not self.readings:
            text = "is missing: a recorded trace needs the name of its rotation column"
            yield (ROTATION.name,), f"{text}, or of another reading: {', '.join(READINGS[1:])}."
            return
        name, *others = self.readings
        for other in others:
            yield (other,), f"does not go with {name}; allowed is one of {', '.join(READINGS)}."
        if complaints := [*self._shape_complaints(name)]:
            yield from complaints
        elif self.fit_contact and self.tip_power is None:
            text = "takes the shape of a tip, and a recorded depth (--load)"
            yield ("fit_contact",), f"{text}: of a dwell alone nothing tells it."

    def _shape_complaints(self, name: str) -> Iterator[Complaint]:
        """Find what is wrong with a shape, where a quantity is read."""
        if self.shape is None:
            return
        try:
            shape, _ = shape_and_sizes(self.shape)
        except ValueError as error:
            yield ("shape",), f"{error}."
            return
        if name not in (STRESS.name, STRAIN.name):
            load = "pressure" if shape.load == STRESS else "force"
            yield ("shape",), f"goes with a {load} or a displacement, not with {name}."
        elif self.poisson is not None and not shape.is_tip:
            yield ("poisson",), f"goes with the shape of a tip, not with '{self.shape}'."


UNREAD = MeasurementBlock(rate_Hz=1.0, noise=Noise("gaussian", 0.0, "peak"))
"""What a recording of no file was read by."""


def _option(key: str) -> str:
    if key.endswith("_unit") or key in _BY_SET:
        return f"--set measurement.{key}={_BY_SET.get(key, 'UNIT')}"
    if key in PARTNERS:
        return f"--reading {key}=COLUMN"
    return "--reading" if key in INSTRUMENTS else f"--{key}"
