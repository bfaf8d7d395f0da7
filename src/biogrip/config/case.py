"""A case: one sample with its experiment, as blocks of a config describe them."""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from biogrip.arrays import Array
from biogrip.config.loading import default_ranges, read_configs, trace_defaults
from biogrip.config.trace_blocks import CommonBlocks, SampleBlocks
from biogrip.fit.experiment import Experiment
from biogrip.keys import plain
from biogrip.physics.gripper import NO_ARMS, Contact, Gripper
from biogrip.physics.instruments import Instrument
from biogrip.physics.models import CANDIDATES, Sample
from biogrip.physics.noise import Noise
from biogrip.physics.protocol import Course, Phase, join_phases, sample_times
from biogrip.physics.sample_model import Network, with_fixed


@dataclass(frozen=True)
class SampleCase:
    """One sample with its experiment."""

    name: str
    """Name used in files."""
    block: SampleBlocks
    """Config block, with the blocks that cases share merged in."""
    common: CommonBlocks
    """What all cases share."""
    record: Array | None = None
    """What was controlled in a recorded trace, if it was recorded; see `Experiment.record`."""

    @cached_property
    def plain(self) -> dict[str, Any]:
        """Config block as plain values, without keys that have their default."""
        return plain(self.block)

    @property
    def recorded(self) -> bool:
        """True if the trace was recorded, not simulated."""
        return self.block.recorded

    @property
    def noise(self) -> Noise:
        """Noise of simulated traces."""
        return self.block.measurement.noise

    @cached_property
    def times_s(self) -> Array:
        """Times of a simulated trace, (n_samples,)."""
        return sample_times(self.torque.end_s, self.block.measurement.rate_Hz)

    @property
    def instrument(self) -> Instrument:
        """The instrument, by its kind, and by what the protocol holds and the trace is of."""
        return self.block.instrument_used

    @cached_property
    def phases(self) -> tuple[Phase, ...]:
        """Phases of the protocol, in torques or what else the instrument holds."""
        return self.block.protocol.make_phases(self.instrument, self.common.actuator)

    @cached_property
    def torque(self) -> Course:
        """What the instrument holds over time."""
        return join_phases(self.phases, deforms=self.instrument.deforms)

    @cached_property
    def _contact(self) -> Contact | None:
        """State of the gripper when it is closed onto the sample, if its size is known."""
        size_m = self.block.sample.size_m
        return None if size_m is None else self.block.gripper.contact(self.common.actuator, size_m)

    @cached_property
    def gripper(self) -> Gripper:
        """True gripper, at the angle at which the jaws touch the sample; or none."""
        if not self.instrument.has_jaws:
            return NO_ARMS
        neutral, at = self.block.gripper.neutral, self._contact
        return replace(neutral, reference_angle_deg=at.reference_angle_deg) if at else neutral

    @property
    def stroke(self) -> float:
        """Rotation left for gripping: the comb drive's stroke minus closing onto the sample."""
        closing = self._contact.closing if self._contact else 0.0
        return math.radians(self.common.actuator.stroke_deg) - closing

    @cached_property
    def sample(self) -> Sample:
        """Constitutive model."""
        return replace(self.block.sample.sample, stiffness=self.instrument.stiffness)

    @property
    def parameters(self) -> dict[str, float]:
        """True parameters by name, SI units, branches by relaxation time; none if recorded."""
        given, model = self.block.sample.parameters, self.sample.model
        known = {name: given[name] for name in model.names if name in given}
        whole = len(known) == len(model.names)
        return with_fixed(model, self.block.fixed).named_in_order(known) if whole else known

    @cached_property
    def network(self) -> Network:
        """Springs and dampers of the simulated sample."""
        return self.sample.model.sample(self.parameters)

    @property
    def confidence(self) -> float:
        """Confidence level of all intervals."""
        return self.block.identifiability.confidence

    @property
    def assumed_gripper(self) -> Gripper:
        """Gripper that identifications assume."""
        return self.gripper

    @cached_property
    def experiment(self) -> Experiment:
        """What was done, for any identification."""
        measurement = self.block.measurement
        uncertainty = self.block.gripper.uncertainty if self.instrument.has_jaws else None
        ranges, usual = dict(vars(self.block.search_range)), default_ranges()
        return Experiment(
            self.assumed_gripper,
            self.phases,
            ranges,
            self.sample,
            self.block.fixed,
            self.instrument,
            offset=measurement.along["offset"],
            drift=measurement.along["drift"],
            noise_sd=measurement.noise_rad,
            noise_share=measurement.noise_share,
            coloured=measurement.coloured,
            uncertainty=uncertainty.by_part if uncertainty else {},
            fit_start=measurement.fit_start,
            record=self.record,
            tip_power=measurement.tip_power,
            fit_contact=measurement.fit_contact,
            undeclared=frozenset(
                name for name in measurement.along if getattr(measurement, name) is None
            ),
            given_ranges=frozenset(name for name in ranges if ranges[name] != usual[name]),
            simulated=not self.recorded,
            name=self.name,
        )

    @property
    def judged_experiment(self) -> Experiment:
        """What was done, and how a trace is judged."""
        judged = replace(
            self.experiment,
            least_squares=self.block.least_squares,
            confidence=self.confidence,
            study_seed=self.common.study_seed,
        )
        if not self.recorded:
            return judged
        measured, models = self.block.measurement, self.common.model_selection.models
        # A recorded load that is there in its first row came before that.
        first = None if self.record is None else self.record[0, 1]
        known = measured.fit_start or first == 0 or (measured.tip_power and (first or 0.0) < 0)
        usual = read_configs([trace_defaults()])["model_selection"]["models"]
        return replace(
            judged,
            start_given=bool(known) or measured.start_s is not None,
            models=models,
            usual_models=[*models] == usual,
        )

    @property
    def models(self) -> dict[str, Sample]:
        """Sample models to fit to the case's traces by name, see `CANDIDATES`."""
        names = (*self.common.model_selection.models, self.sample.candidate)
        unit = self.instrument.stiffness
        return {name: replace(CANDIDATES[name], stiffness=unit) for name in names}
