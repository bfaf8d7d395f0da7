"""What the workflow makes of a study: settings of each job, and names of files."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from biogrip.study.batches import Batch, existing_batches, plan_batches
from biogrip.study.config import Case, Study

METHOD = "genetic"


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

    def batches(self, case: str) -> list[Batch]:
        """Batches of seeds of a case, those with results kept."""
        folder = self.results / "identifications" / case / METHOD
        return plan_batches(self.study.seeds, self.study.batch_size, existing_batches(folder))

    def batch_files(self, pattern: str, case: str) -> list[str]:
        """Fill ``{case}``, ``{method}`` and ``{batch}`` of a path for every batch of a case."""
        return [
            pattern.format(case=case, method=METHOD, batch=batch.name)
            for batch in self.batches(case)
        ]

    def target(self, case: str) -> str:
        """Settings of the target stage."""
        c = self._case(case)
        return _json(
            gripper=c.blocks["gripper"],
            protocol=c.blocks["protocol"],
            rate_Hz=c.blocks["measurement"]["rate_Hz"],
            model=c.model.name,
            parameters=c.parameters,
        )

    def measurement(self, case: str) -> str:
        """Settings of the measurement stage."""
        return _json(
            study_seed=self.study.config["study_seed"],
            case=case,
            noise=self._case(case).blocks["measurement"]["noise"],
        )

    def identification(self, case: str) -> str:
        """Settings of the identification stage."""
        c = self._case(case)
        return _json(
            study_seed=self.study.config["study_seed"],
            case=case,
            gripper=c.blocks["gripper"],
            protocol=c.blocks["protocol"],
            model=c.model.name,
            search_range=c.blocks["search_range"],
            genetic_algorithm=c.blocks["genetic_algorithm"],
        )

    def collection(self) -> str:
        """Settings of the collection stage."""
        return _json(seeds=self.study.seeds)

    def errors(self, case: str) -> str:
        """Settings of a case's error table."""
        truth = self._truth(self._case(case))
        return _json(case=case, noise_floor_tolerance=self._tolerance, **truth)

    def convergence(self, case: str) -> str:
        """Settings of the figure of a case's convergence."""
        c = self._case(case)
        return _json(
            title=c.title,
            mutation_start=c.blocks["genetic_algorithm"]["mutation_start"],
            noise_floor_tolerance=self._tolerance,
        )

    def fit(self, case: str) -> str:
        """Settings of the figure of a case's best fit."""
        return _json(**self._fit(self._case(case)))

    def evolution(self, case: str) -> str:
        """Settings of the figure of the parameters' evolution."""
        return _json(**self._truth(self._case(case)))

    def overview(self) -> str:
        """Settings of the overview figure."""
        cases = {
            name: {**self._fit(case), **self._truth(case)}
            for name, case in self.study.cases.items()
        }
        return json.dumps({"cases": cases, "noise_floor_tolerance": self._tolerance})

    def blocks(self, *keys: str) -> str:
        """Study-wide blocks by name, for tables and figures that show them."""
        return _json(**{key: self.study.config[key] for key in keys})

    def evidence(self) -> str:
        """Settings of the tables that hold the paper against itself."""
        return _json(
            cases={
                name: self._truth(case) for name, case in self.study.cases.items() if case.published
            },
            **{key: self.study.config[key] for key in ("gripper", "actuator", "search_range")},
        )

    @property
    def _tolerance(self) -> float:
        return float(self.study.config["evaluation"]["noise_floor_tolerance"])

    def _case(self, name: str) -> Case:
        return self.study.cases[name]

    @staticmethod
    def _truth(case: Case) -> dict[str, Any]:
        return {
            "title": case.title,
            "model": case.model.name,
            "parameters": case.parameters,
            "published": case.published,
        }

    @staticmethod
    def _fit(case: Case) -> dict[str, Any]:
        return {
            "title": case.title,
            "model": case.model.name,
            "gripper": case.blocks["gripper"],
            "protocol": case.blocks["protocol"],
        }


def _json(**settings: Any) -> str:
    return json.dumps(settings, sort_keys=True)
