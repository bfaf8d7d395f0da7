"""What a simulated case of any kind is told is enough for its first jobs."""

from pathlib import Path

from tests.helpers.runs import snakemake

DROP = {"model": "liquid_drop", "k": 1.0, "k_p": 0.1, "c": 10.0}
CASES = {
    "crept": {
        "instrument": "creep",
        "sample": {"model": "zener_maxwell", "k": 300.0, "k_p": 200.0, "c": 900.0},
        "protocol": {"phases": [{"duration_s": 30, "stress_Pa": 40}]},
    },
    "relaxed": {
        "instrument": "relaxation",
        "sample": {"model": "zener_maxwell", "k": 300.0, "k_p": 200.0, "c": 900.0},
        "protocol": {"phases": [{"duration_s": 30, "strain": 0.1}]},
    },
    "sized": {"sample": DROP | {"size_m": 60e-6}, "assumed_gripper": "calibrated"},
    "in_volts": {"sample": DROP, "protocol": {"phases": [{"duration_s": 50, "voltage_V": 12}]}},
}
CONFIG = {
    "seeds": 1,
    "methods": ["genetic"],
    "identifiability": {"coverage_seeds": 0},
    "genetic_algorithm": {
        "population": 20,
        "survivors": 10,
        "min_generations": 2,
        "max_generations": 4,
    },
    "only": list(CASES),
    "cases": CASES,
}


def test_every_kind_of_case_is_identified(tmp_path: Path) -> None:
    files = [f"results/identifications/{case}/genetic/seeds_0-0.csv" for case in CASES]
    run = snakemake(tmp_path, "--", *files, config=CONFIG)
    assert run.status == 0, run.output
    assert (tmp_path / "results/calibrations/sized.yaml").is_file()
