"""What the workflow makes of a study: settings of each job, and names of files."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from biogrip.identify.methods import METHODS
from biogrip.study import build
from biogrip.study.batches import Batch, existing_batches, plan_batches, seeds_a_batch
from biogrip.study.config import Case, Study
from biogrip.study.source import overlaid

_OVERVIEWED = 3


@dataclass(frozen=True)
class Plan:
    """The jobs of a study.

    Parameters
    ----------
    study
        What to do.
    results
        Folder of the results; what it already holds decides the batches.
    """

    study: Study
    results: Path
    _planned: dict[tuple[str, ...], list[Batch]] = field(default_factory=dict, init=False)

    def batches(self, case: str, method: str) -> list[Batch]:
        """Batches of seeds of a case and method, those with results kept."""
        return self._batches(self.seeds(case), "identifications", case, method)

    def coverage_batches(self, case: str) -> list[Batch]:
        """Batches of the seeds that intervals are tested with."""
        return self._batches(self._coverage_seeds(case), "coverage", case)

    def selection_batches(self, case: str) -> list[Batch]:
        """Batches of the seeds that sample models are compared on."""
        return self._batches(self.seeds(case), "selection", case)

    def seeds(self, case: str) -> int:
        """Number of traces of a case; of a recorded one there is one."""
        return 1 if self._case(case).recorded else self.study.seeds

    def joined(self, stage: str, case: str) -> str:
        """Settings of the joining of a case's batches in a stage."""
        return _json(seeds=self._coverage_seeds(case) if stage == "coverage" else self.seeds(case))

    def _coverage_seeds(self, case: str) -> int:
        asked: int = self._case(case).blocks["identifiability"]["coverage_seeds"]
        return asked if case in self.simulated else 0

    def _batches(self, seeds: int, *folder: str) -> list[Batch]:
        # Listed once: a plan does not change while it is carried out.
        if folder not in self._planned:
            existing = existing_batches(self.results.joinpath(*folder))
            size = self.study.batch_size or seeds_a_batch(seeds, len(self.study.methods))
            self._planned[folder] = plan_batches(seeds, size, existing)
        return self._planned[folder]

    def batch_files(self, pattern: str, case: str) -> list[str]:
        """Fill ``{case}``, ``{method}`` and ``{batch}`` of a path for every batch of a case.

        A pattern without a method is filled for the method that is shown.
        """
        methods = self.study.methods if "{method}" in pattern else [self.shown]
        return [
            pattern.format(case=case, method=method, batch=batch.name)
            for method in methods
            for batch in self.batches(case, method)
        ]

    def stage_files(self, stage: str, case: str) -> list[str]:
        """Files of a stage that works in batches, of a case."""
        suffix = ".parquet" if stage in ("measurements", "histories") else ".csv"
        if stage in ("selection", "coverage"):
            planned = self.selection_batches if stage == "selection" else self.coverage_batches
            return [f"results/{stage}/{case}/{batch.name}{suffix}" for batch in planned(case)]
        method = "" if stage == "measurements" else "{method}/"
        return self.batch_files(f"results/{stage}/{{case}}/{method}{{batch}}{suffix}", case)

    def batch_of_seed(self, pattern: str, case: str, seed: int) -> str:
        """Fill ``{case}`` and ``{batch}`` of a path for the batch that holds a seed."""
        batches = self.batches(case, self.shown)
        found = [batch for batch in batches if batch.first <= seed <= batch.last]
        batch = found[0] if found else Batch(seed, seed)
        return pattern.format(case=case, batch=batch.name)

    @property
    def shown(self) -> str:
        """Return the method that tables and figures of one method show."""
        return self.study.methods[0]

    def target(self, case: str) -> str:
        """Settings of the target stage."""
        c = self._case(case)
        return _json(
            **self._simulation(c),
            gripper=self._gripper(c),
            nonlinear=c.blocks["models"]["target"] == "nonlinear",
            sampling=self._sampling(c),
            parameters=c.parameters,
            stroke_rad=self._stroke_rad(c),
        )

    def measurement(self, case: str) -> str:
        """Settings of the measurement stage."""
        return _json(
            study_seed=self.study.config["study_seed"],
            case=case,
            noise=self._case(case).blocks["measurement"]["noise"],
        )

    def calibration(self, case: str) -> str:
        """Settings of the calibration stage."""
        c = self._case(case)
        return _json(
            study_seed=self.study.config["study_seed"],
            case=case,
            gripper=self._gripper(c),
            calibration=c.blocks["calibration"],
        )

    def is_calibrated(self, case: str) -> bool:
        """Whether the identification of a case takes its gripper from a calibration."""
        return self._case(case).assumed_gripper == "calibrated"

    def recording(self, case: str) -> str:
        """Settings of the recording stage."""
        c = self._case(case)
        keys = ("time", "rotation", "time_unit", "rotation_unit", "noise_rad", "offset", "drift")
        measurement = c.blocks["measurement"]
        return _json(
            gripper=self._gripper(c),
            measurement={key: measurement[key] for key in keys if key in measurement},
            **self._driving(c.blocks["protocol"]),
        )

    def identification(self, case: str, method: str) -> str:
        """Settings of the identification stage."""
        return _json(**self._identified(self._case(case), method), method=method)

    def identifiability(self, case: str) -> str:
        """Settings of the identifiability stage, on a case's trace."""
        return _json(**self._judged(self._case(case)))

    def expected(self, case: str) -> str:
        """Settings of the identifiability stage, on a case's target."""
        c = self._case(case)
        noise = c.blocks["measurement"]["noise"]
        return _json(**self._judged(c), parameters=c.parameters, noise=noise)

    def coverage(self, case: str) -> str:
        """Settings of the coverage stage."""
        c = self._case(case)
        noise = c.blocks["measurement"]["noise"]
        return _json(**self._judged(c), parameters=c.parameters, noise=noise)

    def selection(self, case: str) -> str:
        """Settings of the selection stage."""
        models = self.study.config["model_selection"]["models"]
        return _json(**self._identified(self._case(case), "least_squares"), models=models)

    def collection(self, case: str) -> str:
        """Settings of the collection stage."""
        c = self._case(case)
        return _json(
            seeds=self.seeds(case),
            methods=self.study.methods,
            model=c.model.name,
            branches=c.branches,
        )

    def errors(self, case: str) -> str:
        """Settings of a case's error table."""
        truth = self._truth(self._case(case))
        return _json(case=case, method=self.shown, noise_floor_tolerance=self._tolerance, **truth)

    def convergence(self, case: str) -> str:
        """Settings of the figure of a case's convergence."""
        c = self._case(case)
        mutates = "genetic_algorithm" in METHODS[self.shown].blocks
        return _json(
            title=c.title,
            method=self.shown,
            step=METHODS[self.shown].step,
            mutation_start=c.blocks["genetic_algorithm"]["mutation_start"] if mutates else None,
            noise_floor_tolerance=self._tolerance,
        )

    def fit(self, case: str) -> str:
        """Settings of the figure of a case's best fit."""
        return _json(**self._fit(self._case(case)), step=METHODS[self.shown].step)

    def evolution(self, case: str) -> str:
        """Settings of the figure of the parameters' evolution."""
        step = METHODS[self.shown].step
        return _json(method=self.shown, step=step, **self._truth(self._case(case)))

    def methods(self) -> str:
        """Settings of the comparison of methods."""
        cases = {
            name: {**self._truth(self._case(name)), "samples": self._samples(name)}
            for name in self.simulated
        }
        return json.dumps({"cases": cases, **self.study.config["evaluation"]})

    def waterfall(self, case: str) -> str:
        """Settings of the waterfall of a case."""
        c = self._case(case)
        return _json(title=c.title, samples=self._samples(case), **self.study.config["evaluation"])

    def scatter(self, case: str) -> str:
        """Settings of the figure of a case's errors over seeds."""
        c = self._case(case)
        noise = c.blocks["measurement"]["noise"]
        return _json(**{**self._posed(c), **self._truth(c)}, noise=noise)

    def profiles(self, case: str) -> str:
        """Settings of the figure of a case's profile likelihoods."""
        c = self._case(case)
        return _json(title=c.title, parameters=c.parameters)

    def summary(self, case: str) -> str:
        """Settings of a case's summary."""
        c = self._case(case)
        trace = c.blocks["measurement"]["file"] if c.recorded else "seed 0 of the simulated traces"
        return _json(case=case, title=c.title, model=c.model.title, trace=trace)

    def summary_figures(self, case: str) -> list[str]:
        """Figures that a case's summary shows."""
        return ["fit", "profiles", *(["valley"] if self.has_valley(case) else [])]

    def has_valley(self, case: str) -> bool:
        """Whether two exchangeable parameters of a case are searched, among others."""
        c = self._case(case)
        pair = [name for name in c.model.exchangeable if name not in c.fixed]
        return len(pair) == 2 and len(c.model.names) - len(c.fixed) > 2

    def valley(self, case: str) -> str:
        """Settings of the figure of a case's valley."""
        c = self._case(case)
        methods = self.study.methods
        method = "least_squares" if "least_squares" in methods else self.shown
        return _json(title=c.title, method=method, parameters=c.parameters, published=c.published)

    def verdicts(self, case: str) -> str:
        """Settings of the table of verdicts on a case."""
        c = self._case(case)
        return _json(case=case, title=c.title, parameters=c.parameters)

    def coverage_table(self) -> str:
        """Settings of the table of coverage."""
        cases = {}
        for name in self.covered:
            c = self._case(name)
            cases[name] = {
                **self._posed(c),
                "parameters": c.parameters,
                "noise": c.blocks["measurement"]["noise"],
            }
        return json.dumps(_shared("cases", cases))

    def models_table(self) -> str:
        """Settings of the table of sample models."""
        cases = {
            name: None if case.recorded else case.model.name
            for name, case in self.study.cases.items()
        }
        return json.dumps({"cases": cases})

    @property
    def simulated(self) -> list[str]:
        """Cases with a target."""
        return [name for name, case in self.study.cases.items() if not case.recorded]

    @property
    def recorded(self) -> list[str]:
        """Cases whose trace was recorded."""
        return [name for name, case in self.study.cases.items() if case.recorded]

    def recorded_file(self, case: str) -> str:
        """Return the user's file of a recorded case."""
        return str(self._case(case).blocks["measurement"]["file"])

    @property
    def covered(self) -> list[str]:
        """Simulated cases whose intervals are tested."""
        return [name for name in self.simulated if self._coverage_seeds(name) > 0]

    @property
    def overviewed(self) -> list[str]:
        """Cases that the overview has room for."""
        return self.simulated[:_OVERVIEWED]

    def overview(self) -> str:
        """Settings of the overview figure."""
        cases = {
            name: {**self._fit(self._case(name)), **self._truth(self._case(name))}
            for name in self.overviewed
        }
        return json.dumps({"cases": cases, "noise_floor_tolerance": self._tolerance})

    def blocks(self, *keys: str) -> str:
        """Study-wide blocks by name, for tables and figures that show them."""
        return _json(**{key: self.study.config[key] for key in keys})

    def linearisation(self) -> str:
        """Settings of the comparison of linear and nonlinear model, in the order of the cases."""
        cases = {
            name: {**self._truth(case), "gripper": self._gripper(case)}
            for name, case in self.study.cases.items()
            if not case.recorded
        }
        return json.dumps({"cases": cases, **self._driving(self.study.config["protocol"])})

    def evidence(self) -> str:
        """Settings of the tables that hold the paper against itself."""
        return _json(
            cases={
                name: self._truth(case) for name, case in self.study.cases.items() if case.published
            },
            method=self.shown,
            **{key: self.study.config[key] for key in ("gripper", "actuator", "search_range")},
        )

    def sampling_evidence(self) -> str:
        """Settings of the table of what sampling the paper's errors speak for."""
        cases = {
            name: {**self._truth(case), **self._met(case)}
            for name, case in self.study.cases.items()
            if case.published
        }
        return _json(cases=cases)

    def points(self, sweep: str, case: str) -> list[str]:
        """Names of the cases that are the points of a sweep over a case."""
        return [point.name for point in self.study.sweeps[sweep].points(case)]

    def sweep_files(self, pattern: str, sweep: str) -> list[str]:
        """Fill ``{sweep}`` and ``{case}`` of a path for every case that a sweep is laid over."""
        return [pattern.format(sweep=sweep, case=case) for case in self.study.sweeps[sweep].cases]

    def robustness(self, sweep: str, case: str) -> str:
        """Settings of the robustness stage; what all points share is said once."""
        points = {
            point.name: {
                "row": point.row.text,
                "column": point.column.text,
                "sampling": self._sampling(self._case(point.name)),
                "search_range": self._case(point.name).blocks["search_range"],
                **self._met(self._case(point.name)),
            }
            for point in self.study.sweeps[sweep].points(case)
        }
        return json.dumps(
            {
                "methods": self.study.methods,
                "noise_floor_tolerance": self._tolerance,
                "parameters": self._case(case).parameters,
                **_shared("points", points),
            }
        )

    def heat_maps(self, sweep: str) -> str:
        """Settings of a sweep's heat maps and of its table."""
        chosen = self.study.sweeps[sweep]
        axes = {"rows": chosen.rows, "columns": chosen.columns}
        return json.dumps(
            {
                "title": chosen.title,
                "cases": {name: self._case(name).title for name in chosen.cases},
                "methods": self.study.methods,
                **{
                    name: {
                        "label": axis.label,
                        "values": {value.text: value.shown for value in axis.values},
                        "reconstructed": any(
                            self._is_reconstructed(key)
                            for value in axis.values
                            for key in value.overrides
                        ),
                    }
                    for name, axis in axes.items()
                },
            }
        )

    def _is_reconstructed(self, key: str) -> bool:
        marked = self.study.config["reconstructed"]
        return any(key == name or key.startswith(f"{name}.") for name in marked)

    @property
    def _tolerance(self) -> float:
        return float(self.study.config["evaluation"]["noise_floor_tolerance"])

    def _case(self, name: str) -> Case:
        return self.study.points[name] if name in self.study.points else self.study.cases[name]

    @staticmethod
    def _truth(case: Case) -> dict[str, Any]:
        return {
            "title": case.title,
            "model": case.model.name,
            "branches": case.branches,
            "parameters": case.parameters,
            "published": case.published,
        }

    def _fit(self, case: Case) -> dict[str, Any]:
        return {**self._posed(case), "method": self.shown, "title": case.title}

    def _identified(self, case: Case, method: str) -> dict[str, Any]:
        """What an identification needs, with a method's blocks."""
        return {
            **self._posed(case),
            "study_seed": self.study.config["study_seed"],
            "case": case.name,
            **{block: case.blocks[block] for block in METHODS[method].blocks},
        }

    def _met(self, case: Case) -> dict[str, Any]:
        """What the identification of a case assumes, and the noise that it meets."""
        return {**self._posed(case), "noise": case.blocks["measurement"]["noise"]}

    def _judged(self, case: Case) -> dict[str, Any]:
        confidence = case.blocks["identifiability"]["confidence"]
        return {**self._identified(case, "least_squares"), "confidence": confidence}

    def _posed(self, case: Case) -> dict[str, Any]:
        """What the identification of a case assumes, see `case_problem`."""
        measurement = case.blocks["measurement"]
        return {
            **self._simulation(case),
            "gripper": self._assumed_gripper(case),
            "nonlinear": case.blocks["models"]["identification"] == "nonlinear",
            "offset": measurement.get("offset", False),
            "drift": measurement.get("drift", False),
            "noise_rad": measurement.get("noise_rad"),
            "fixed": case.fixed,
            "search_range": case.blocks["search_range"],
        }

    def _samples(self, name: str) -> int:
        """Samples in each trace of a simulated case."""
        c = self._case(name)
        torque = build.torque(self._driving(c.blocks["protocol"]))
        return len(build.sampling(c.blocks["measurement"], torque.end_s))

    @staticmethod
    def _sampling(case: Case) -> dict[str, Any]:
        measurement = case.blocks["measurement"]
        key = "times_s" if "times_s" in measurement else "rate_Hz"
        return {key: measurement[key]}

    def _simulation(self, case: Case) -> dict[str, Any]:
        """What every simulation of a case needs, but for the gripper."""
        return {
            "model": case.model.name,
            "branches": case.branches,
            **self._driving(case.blocks["protocol"]),
        }

    def _driving(self, protocol: dict[str, Any]) -> dict[str, Any]:
        """A protocol, and the comb drive if it is given in volts."""
        actuator = {"actuator": self.study.config["actuator"]}
        return {"protocol": protocol} | (actuator if build.uses_voltage(protocol) else {})

    def _gripper(self, case: Case) -> dict[str, Any]:
        """The true gripper where its jaws touch the sample."""
        block = case.blocks["gripper"]
        angle = block["reference_angle_deg"]
        if case.size_m is not None:
            touching = build.contact_of(block, self.study.config["actuator"], case.size_m)
            angle = touching.reference_angle_deg
        return {
            "arm_length_m": block["arm_length_m"],
            "reference_angle_deg": angle,
            "left": block["left"],
            "right": block["right"],
        }

    def _stroke_rad(self, case: Case) -> float:
        """What the comb drive's stroke leaves for gripping, after closing onto the sample."""
        actuator = self.study.config["actuator"]
        stroke = math.radians(actuator["stroke_deg"])
        if case.size_m is None:
            return stroke
        return stroke - build.contact_of(case.blocks["gripper"], actuator, case.size_m).closing_rad

    def _assumed_gripper(self, case: Case) -> dict[str, Any]:
        """The gripper that the identification believes in; a calibration replaces its arms."""
        if isinstance(case.assumed_gripper, str):
            return self._gripper(case)
        believed: dict[str, Any] = overlaid(self._gripper(case), case.assumed_gripper)
        return believed


def _shared(name: str, blocks: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Say once what all blocks say: a command has room for 128 KiB."""
    first = next(iter(blocks.values()), {})
    shared = {
        key: value
        for key, value in first.items()
        if all(key in block and block[key] == value for block in blocks.values())
    }
    rest = {
        name: {key: value for key, value in block.items() if key not in shared}
        for name, block in blocks.items()
    }
    return {**shared, name: rest}


def _json(**settings: Any) -> str:
    return json.dumps(settings, sort_keys=True)
