"""Functions for notebooks: identify a trace; simulate, add noise, fit.

The commands and the workflow use the same functions. Columns of pandas do as arrays.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike
from threadpoolctl import threadpool_limits

from biogrip.arrays import Array, as_column
from biogrip.command.files import data_of, sample_of
from biogrip.command.options import Setting
from biogrip.command.outputs import Outcome, table_of
from biogrip.command.settings import MODEL, Asked, read_trace
from biogrip.command.words import in_words
from biogrip.config.loading import default_ranges
from biogrip.config.source import HOLD, RAMP
from biogrip.errors import BiogripError
from biogrip.fit.experiment import Experiment
from biogrip.fit.least_squares import identify_many
from biogrip.fit.problem import Fit, GeneRange, silent
from biogrip.identify.identify import identify
from biogrip.judging.diagnosis import Diagnosis
from biogrip.physics.gripper import NO_ARMS, Arm, Gripper
from biogrip.physics.instruments import GRIPPER, INSTRUMENTS, Instrument
from biogrip.physics.models import Sample
from biogrip.physics.noise import Noise, add_noise
from biogrip.physics.protocol import Phase, hold
from biogrip.physics.response import simulated_response

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

_Function = TypeVar("_Function", bound=Callable[..., Any])

one_blas_thread: Callable[[_Function], _Function] = threadpool_limits.wrap(
    limits=1, user_api="blas"
)
"""Decorator of what fits: its matrices are small, and BLAS threads cost more than they bring."""


@dataclass(frozen=True, repr=False)
class TraceResult:
    """What a trace tells; ``print`` says all that the command says."""

    diagnosis: Diagnosis
    """The fit and all that was tested."""
    data: dict[str, Any]
    """The same as plain data, not rounded, with the keys of the command's JSON file."""
    arguments: Mapping[str, Any]
    """Arguments of `identify_trace`."""

    @property
    def status(self) -> str:
        """Status of the fit: ok, doubtful or rejected."""
        return str(self.data["fit"])

    def to_frame(self, what: str = "quantities") -> "pd.DataFrame":
        """Return a table of what the trace tells, with NaN where there is no limit.

        Instead of ``"quantities"`` it may be of the sample ``"models"`` that were compared, or of
        the ``"moduli"`` of the best fit over angular frequencies in 1/s.
        """
        # Imported here, as below: loading pandas and Matplotlib takes long.
        import pandas as pd

        limits = {"value": float, "low": float, "high": float}
        if what != "quantities":
            return pd.DataFrame(self.data[what])
        frame = pd.DataFrame(self.data[what], columns=["quantity", "unit", "verdict", *limits])
        return frame.astype(limits).set_index("quantity")

    def without_model(self, at: Sequence[float] = ()) -> "pd.DataFrame":
        """Return a table of what any linear sample would show, whatever its model.

        At times in s after a step, and inverse angular frequencies; by default one a decade.
        """
        import pandas as pd

        level = self.diagnosis.without_model(at)
        columns = ["quantity", "at_s", "unit", "value", "low", "high"]
        frame = pd.DataFrame(level.told)[columns]
        return frame.astype(dict.fromkeys(["at_s", "value", "low", "high"], float))

    def refit(self, **changed: Any) -> "TraceResult":
        """Identify the trace again with some other arguments, as ``model="sls"``."""
        again = identify_together if "traces" in self.arguments else identify_trace
        return again(**{**self.arguments, **changed})

    def plot(self, what: str = "fit") -> "Figure":
        """Draw the trace, its fit and the residuals, or instead the ``"profiles"``."""
        from biogrip.command.page import draw_best
        from biogrip.figures.likelihood import draw_profiles_of
        from biogrip.figures.style import styled

        if what == "fit":
            return draw_best(self.diagnosis)
        with styled():
            return draw_profiles_of(self.data)

    def __repr__(self) -> str:
        """Return status and verdicts, a line each."""
        lines = (f"  {item['quantity']}  {item['in_words']}" for item in self.data["quantities"])
        return "\n".join([f"{self.data['model_title']}: fit {self.status}", *lines])

    def _repr_html_(self) -> str:
        """Return status, table and picture, which Jupyter shows."""
        from biogrip.command.page import address

        table = self.to_frame().to_html(na_rep="", border=0)
        said = f"<p>{self.data['model_title']}: fit {self.status}</p>"
        return f'{said}{table}<img src="{address(self.plot())}" width="560">'

    def __str__(self) -> str:
        """Return what the command prints."""
        return in_words(self.data)


@one_blas_thread
def identify_trace(
    time_s: ArrayLike,
    readings: ArrayLike,
    *,
    reads: str = GRIPPER.read.name,
    model: str = MODEL,
    hold: float | str | None = None,
    ramp: float | None = None,
    start: float | str | None = None,
    sd: ArrayLike | None = None,
    loss: ArrayLike | None = None,
    noise: float | None = None,
    noise_share: float | None = None,
    noise_model: str | None = None,
    offset: bool | None = None,
    drift: bool | None = None,
    fixed: Mapping[str, float] | None = None,
    config: Mapping[str, Any] | None = None,
) -> TraceResult:
    """Identify the sample of a trace as ``biogrip identify`` does, with all its tests.

    Parameters
    ----------
    time_s, readings : (n_samples,)
        Ascending times in s, and readings in SI units: arrays, lists, or columns of pandas; of a
        sweep angular frequencies in rad/s, and storage moduli.
    reads
        What is read: rotation (gripper); displacement, strain, compliance (creep); force, stress,
        modulus (relaxation), storage, storage_stiffness (sweep).
    model
        Name of the sample model.
    hold
        What is held from 0 to the end, in SI units or with its unit, as ``"20 pN"``, unless
        ``config`` has the protocol.
    ramp
        Time in s within which it was reached, linearly and from its start on; by default at once.
    start
        Start of the protocol on the clock of `time_s`, in s, or ``"fit"``.
    sd : (n_samples,), optional
        Standard deviations of the readings; weights are 1/sd^2.
    loss : (n_samples,), optional
        Loss moduli of a sweep.
    noise
        Standard deviation of the noise, SI units, if it is known.
    noise_share
        The same as a share of what is read.
    noise_model
        ``"white"`` or ``"coloured"``.
    offset, drift
        Whether the instrument may have added a constant, and a line in time.
    fixed
        Known parameters by name.
    config
        Blocks of the config: gripper, protocol, search_range, model_selection, ...

    Raises
    ------
    BiogripError
        If a setting or the trace cannot be used; the message says what is allowed.
    """
    arguments = locals()
    for name, block in (("fixed", fixed or {}), ("config", config or {})):
        if not isinstance(block, Mapping) or not all(isinstance(value, str) for value in block):
            raise BiogripError(f"{name}: found {block!r:.40}, allowed are values by name.")
    if not isinstance(reads, str) or reads not in INSTRUMENTS:
        raise BiogripError(f"reads: found '{reads}', allowed are {', '.join(INSTRUMENTS)}.")
    column = INSTRUMENTS[reads].read.column
    axis = "omega_rad_per_s" if INSTRUMENTS[reads].sweeps else "time_s"
    beside = f"loss in {INSTRUMENTS[reads].read.unit}"
    more = {beside: loss, "sd": sd}
    given = {axis: time_s, column: readings} | {
        n: value for n, value in more.items() if value is not None
    }
    columns = {name: as_column(values, name) for name, values in given.items()}
    if len({len(values) for values in columns.values()}) > 1:
        lengths = " and ".join(f"{len(values)} of {name}" for name, values in columns.items())
        raise BiogripError(f"found {lengths}; allowed are as many of each.")
    onset = ("fit_start", True) if isinstance(start, str) and start == "fit" else ("start_s", start)
    chosen: list[tuple[str, str, Any]] = [
        *(("config", block, value) for block, value in (config or {}).items()),
        ("model", "sample.model", model),
        ("hold", *HOLD, hold),
        ("ramp", *RAMP, ramp),
        ("reads", f"measurement.{reads}", column),
        ("loss", "measurement.loss", None if loss is None else beside),
        ("start", f"measurement.{onset[0]}", onset[1]),
        ("sd", "measurement.sd", None if sd is None else "sd"),
        ("noise", "measurement.noise_rad", noise),
        ("noise_share", "measurement.noise_share", noise_share),
        ("noise_model", "measurement.noise_model", noise_model),
        ("offset", "measurement.offset", offset),
        ("drift", "measurement.drift", drift),
        ("fixed", "fixed", fixed and {**fixed}),
    ]
    settings = [
        Setting(by, tuple(key.split(".")), value) for by, key, value in chosen if value is not None
    ]
    asked = Asked(Path("trace"), None, tuple(settings), "arguments", arrays=(*columns.values(),))
    recording, case = read_trace(asked)
    diagnosis = identify(recording, case.judged_experiment)
    data = data_of(diagnosis, case, asked.name, asked.given)
    return TraceResult(diagnosis, data, arguments)


@one_blas_thread
def identify_together(
    traces: Mapping[str, Mapping[str, Any]] | Iterable[Mapping[str, Any]], **shared: Any
) -> TraceResult:
    """Identify one sample from several traces, and test whether they are of one sample.

    Parameters
    ----------
    traces
        Arguments of `identify_trace` of each, by name or numbered: creep, relaxation, sweeps and
        grippers may be mixed where the stiffness has one unit.
    shared
        Arguments that all have, as ``model="sls"``.

    Raises
    ------
    BiogripError
        If a trace cannot be used, or they have not one model, unit of stiffness and confidence.
    """
    given = traces
    if not isinstance(given, Mapping):
        given = {f"trace {number}": arguments for number, arguments in enumerate(given, start=1)}
    results = {name: identify_trace(**{**shared, **own}) for name, own in given.items()}
    said = {name: (one.diagnosis, {**one.data, "trace": name}) for name, one in results.items()}
    sample, data = sample_of("sample", said)
    return TraceResult(sample, data, {"traces": given, **shared})


def to_table(
    results: Mapping[str, TraceResult] | Iterable[TraceResult],
    words: Mapping[str, Mapping[str, str]] | None = None,
) -> "pd.DataFrame":
    """Return results of several traces, by name or numbered, as the command's CSV: a row each.

    Words are those of a table of traces, by name and column, as of the treatment and the dish.
    ``to_csv("found.csv", index=False)`` makes a file for ``biogrip groups``.
    """
    import pandas as pd

    named = results
    if not isinstance(named, Mapping):
        named = {str(number): result for number, result in enumerate(named, start=1)}
    outcomes = [{**result.data, "trace": name} for name, result in named.items()]
    copied = {name: (words or {}).get(name, {}) for name in named}
    header, rows = table_of(Outcome(outcomes, {}, copied=copied))
    return pd.DataFrame(rows, columns=header)


def set_up(
    gripper: Gripper | Instrument,
    protocol: tuple[Phase, ...],
    sample: Sample,
    *,
    ranges: Mapping[str, GeneRange] | None = None,
    fixed: Mapping[str, float] | None = None,
) -> Experiment:
    """Return an experiment: instrument, protocol and sample model, with search ranges.

    Parameters
    ----------
    gripper
        Gripper, or one of `INSTRUMENTS`: ``INSTRUMENTS["strain"]`` is creep whose strain is read,
        ``INSTRUMENTS["modulus"]`` relaxation whose modulus is.
    protocol
        Phases of the torque, or of what else is controlled.
    sample
        Constitutive model of the sample.
    ranges
        Search ranges by name; by default those of every trace.
    fixed
        Fixed parameters by name, SI units.
    """
    instrument = gripper if isinstance(gripper, Instrument) else GRIPPER
    return Experiment(
        NO_ARMS if isinstance(gripper, Instrument) else gripper,
        protocol,
        ranges or default_ranges(),
        replace(sample, stiffness=instrument.stiffness),
        dict(fixed or {}),
        instrument,
    )


def simulate(
    experiment: Experiment,
    parameters: Mapping[str, float],
    time_s: ArrayLike,
) -> Array:
    """Simulate what the instrument reads without noise: of a gripper, the left arm's rotation.

    Parameters
    ----------
    experiment
        Experiment from `set_up`.
    parameters
        Parameters of the sample by name, SI units.
    time_s : (n_samples,)
        Sampling times, ascending.

    Returns
    -------
    (n_samples,)
        In SI units; of a rotation, rad.
    """
    network, torque = experiment.model.sample(parameters), experiment.torque
    times = as_column(time_s, "time_s")
    return simulated_response(experiment.gripper, network, torque, times)[0]


@one_blas_thread
def identify_sample(
    experiment: Experiment, time_s: ArrayLike, readings: ArrayLike, seed: int = 0
) -> Fit:
    """Identify the sample by least squares from many starts: a fit alone, nothing is judged.

    Parameters
    ----------
    experiment
        Experiment from `set_up`.
    time_s, readings : (n_samples,)
        Trace in SI units.
    seed
        Seed of the starts.
    """
    problem = experiment.of(as_column(time_s, "time_s"), as_column(readings, "readings"))
    rngs = [np.random.default_rng(seed)]
    return identify_many([problem], experiment.least_squares, rngs, silent)[0]


__all__ = [
    "INSTRUMENTS",
    "Arm",
    "BiogripError",
    "Diagnosis",
    "Experiment",
    "Fit",
    "GeneRange",
    "Gripper",
    "Noise",
    "Phase",
    "Sample",
    "TraceResult",
    "add_noise",
    "hold",
    "identify_sample",
    "identify_together",
    "identify_trace",
    "set_up",
    "simulate",
    "to_table",
]
