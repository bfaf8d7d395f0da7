"""Identifications at the paper's budget, under other code paths of numpy and BLAS."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from biogrip.identify.methods import METHODS
from biogrip.running.resolved import write_study
from tests.helpers.default import study_of
from tests.helpers.places import ROOT

CASES = ("endothelial_cell", "liquid_drop_1", "liquid_drop_2")
SEEDS = "seeds_0-1"

NO_AVX512 = "X86_V4 AVX512_ICL AVX512_SPR"
NO_AVX2 = f"{NO_AVX512} X86_V3"
# Code paths of numpy, those of BLAS, and threads: three at a time, for each changes bits of its
# own. The reference has what the processor has, and two threads, which on small matrices take
# longer than one.
SETTINGS = {
    "no AVX-512, Haswell": {
        "NPY_DISABLE_CPU_FEATURES": NO_AVX512,
        "OPENBLAS_CORETYPE": "Haswell",
    },
    "no AVX2, Nehalem": {"NPY_DISABLE_CPU_FEATURES": NO_AVX2, "OPENBLAS_CORETYPE": "Nehalem"},
    "SkylakeX": {"OPENBLAS_CORETYPE": "SkylakeX"},
}
TWO_THREADS = {"OPENBLAS_NUM_THREADS": "2"}
BITS = """
import hashlib, numpy as np
x = -np.geomspace(1e-9, 700, 100_000)
a, b = np.random.default_rng(0).standard_normal((2, 400, 63))
print(hashlib.sha256(np.exp(x).tobytes()).hexdigest(), end=" ")
print(hashlib.sha256((a @ b.T).tobytes()).hexdigest())
"""


def in_process(
    environment: dict[str, str], *arguments: str, given: str = "", folder: Path = ROOT
) -> str:
    done = subprocess.run(
        [sys.executable, *arguments],
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1", **environment},
        cwd=folder,
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
    results = folder / "results"
    write_study(study_of("seeds: 2"), results)
    calls = []
    for case in CASES:
        batch = ["--case", case, "--batch", SEEDS]
        calls += [["make", "target", "--case", case], ["make", "measurement", *batch]]
        calls += [["make", "identification", *batch, "--method", method] for method in METHODS]
        calls.append(["make", "identifications", "errors", "--case", case])
    in_process(environment, "-c", COMMANDS, given=json.dumps(calls), folder=folder)
    found = [
        *(results / "targets").glob("*.csv"),
        *(results / "measurements").glob("*/*.parquet"),
        *(results / "identifications").glob("**/*.csv"),
        # The way to an optimum may differ in its last digits; its end may not.
        *(results / "histories").glob("*/genetic/*.parquet"),
        *(results / "tables").glob("errors_*.*"),
    ]
    assert len(found) == len(CASES) * (1 + 1 + 1 + len(METHODS) + 1 + 4)
    return {str(path.relative_to(results)): path.read_bytes() for path in found}


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    return study(tmp_path_factory.mktemp("reference"), TWO_THREADS)


@pytest.mark.parametrize("name", SETTINGS)
def test_other_code_paths_change_no_byte(
    name: str, reference: dict[str, bytes], tmp_path: Path
) -> None:
    ours = study(tmp_path, SETTINGS[name])
    assert ours.keys() == reference.keys()
    assert [file for file in ours if ours[file] != reference[file]] == []


POSTERIOR = """
import hashlib
from tests.identifiability import test_posterior as own
problem = own.posed_for(own.MODELS["liquid_drop"], *own.trace_of("liquid_drop_2"))
found = own.sample(own.posterior_of(problem), 3)
print(hashlib.sha256(found.log_parameters.tobytes()).hexdigest())
"""


@pytest.fixture(scope="module")
def walked() -> str:
    return in_process(TWO_THREADS, "-c", POSTERIOR)


@pytest.mark.parametrize("name", SETTINGS)
def test_other_code_paths_sample_the_same_posterior(name: str, walked: str) -> None:
    """To the last bit, over some hundred thousand decisions."""
    assert in_process(SETTINGS[name], "-c", POSTERIOR) == walked


def test_the_settings_do_change_last_bits() -> None:
    """Else the tests above would compare nothing: exp and products really differ."""
    bits = {name: in_process(SETTINGS[name], "-c", BITS).split() for name in SETTINGS}
    exponentials = {exp for exp, _ in bits.values()}
    products = {product for _, product in bits.values()}
    features = Path("/proc/cpuinfo").read_text() if Path("/proc/cpuinfo").exists() else ""
    if "avx512f" not in features:
        pytest.skip("needs a processor with AVX-512 to have other code paths to compare with")
    assert len(exponentials) >= 2
    assert len(products) >= 2
