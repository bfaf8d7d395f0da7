"""Identifications at the paper's budget, under other code paths of numpy and BLAS."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from biogrip.identify.methods import METHODS
from biogrip.study.config import load_study
from biogrip.study.plan import Plan
from tests.workflow.conftest import ROOT

CASES = ("endothelial_cell", "liquid_drop_1", "liquid_drop_2")
SEEDS = "seeds_0-2"

NO_AVX512 = "X86_V4 AVX512_ICL AVX512_SPR"
NO_AVX2 = f"{NO_AVX512} X86_V3"
SETTINGS = {
    "no AVX-512": {"NPY_DISABLE_CPU_FEATURES": NO_AVX512},
    "no AVX2": {"NPY_DISABLE_CPU_FEATURES": NO_AVX2},
    "Nehalem": {"OPENBLAS_CORETYPE": "Nehalem"},
    "Haswell": {"OPENBLAS_CORETYPE": "Haswell"},
    "SkylakeX": {"OPENBLAS_CORETYPE": "SkylakeX"},
    "one BLAS thread": {"OPENBLAS_NUM_THREADS": "1"},
    "two BLAS threads": {"OPENBLAS_NUM_THREADS": "2"},
}
BITS = """
import hashlib, numpy as np
x = -np.geomspace(1e-9, 700, 100_000)
a, b = np.random.default_rng(0).standard_normal((2, 400, 63))
print(hashlib.sha256(np.exp(x).tobytes()).hexdigest(), end=" ")
print(hashlib.sha256((a @ b.T).tobytes()).hexdigest())
"""


def in_process(environment: dict[str, str], *arguments: str, given: str = "") -> str:
    done = subprocess.run(
        [sys.executable, *arguments],
        env={**os.environ, "OPENBLAS_NUM_THREADS": "2", **environment},
        input=given,
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout


COMMANDS = """
import json, sys
from biogrip.cli import main
sys.exit(max(map(main, json.load(sys.stdin))))
"""


def study(folder: Path, environment: dict[str, str]) -> dict[str, bytes]:
    """Targets to error tables, through the command line's commands in one process."""
    config = ROOT / "config" / "config.yaml"
    plan = Plan(load_study(yaml.safe_load(config.read_text()), [config]), folder)
    calls: list[list[object]] = []
    for case in CASES:
        target, noisy = folder / f"{case}.csv", folder / f"{case}.parquet"
        calls += [
            ["target", "--settings", plan.target(case), "--output", target],
            [
                *("measurement", "--settings", plan.measurement(case), "--seeds", SEEDS),
                *("--target", target, "--output", noisy),
            ],
        ]
        aside = folder.parent / f"{folder.name}_aside"
        for method in METHODS:
            # The way to an optimum may differ in its last digits; its end may not.
            end = folder if method == "genetic" else aside
            files = [folder / f"{case}_{method}.csv", end / f"{case}_{method}.parquet"]
            calls.append(
                [
                    *("identification", "--settings", plan.identification(case, method)),
                    *("--seeds", SEEDS, "--measurements", noisy),
                    *("--output", files[0], "--history", files[1]),
                    *("--timing", aside / files[0].name),
                ]
            )
        calls.append(
            [
                *("table", "errors", "--settings", plan.errors(case)),
                *("--inputs", folder / f"{case}_genetic.csv"),
                *("--output", folder / f"errors_{case}.csv"),
            ]
        )
    words = [[str(word) for word in arguments] for arguments in calls]
    in_process(environment, "-c", COMMANDS, given=json.dumps(words))
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    return study(tmp_path_factory.mktemp("reference"), {})


@pytest.mark.parametrize("name", SETTINGS)
def test_other_code_paths_change_no_byte(
    name: str, reference: dict[str, bytes], tmp_path: Path
) -> None:
    ours = study(tmp_path, SETTINGS[name])
    assert ours.keys() == reference.keys()
    assert [file for file in ours if ours[file] != reference[file]] == []


def test_the_settings_do_change_last_bits() -> None:
    """Else the tests above would compare nothing: exp and products really differ."""
    bits = {name: in_process(SETTINGS[name], "-c", BITS).split() for name in SETTINGS}
    exponentials = {exp for exp, _ in bits.values()}
    products = {bits[name][1] for name in ("Nehalem", "Haswell", "SkylakeX")}
    features = Path("/proc/cpuinfo").read_text() if Path("/proc/cpuinfo").exists() else ""
    if "avx512f" not in features:
        pytest.skip("needs a processor with AVX-512 to have other code paths to compare with")
    assert len(exponentials) >= 2
    assert len(products) >= 2
