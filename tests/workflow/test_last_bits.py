"""Identifications at the paper's budget, under other code paths of numpy and BLAS."""

import os
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

from biogrip.fit.methods import METHODS
from tests.helpers.runs import built_once, results_of, snakemake

pytestmark = pytest.mark.nightly

# One of each model.
CASES = ("endothelial_cell", "liquid_drop_2")

NO_AVX512 = "X86_V4 AVX512_ICL AVX512_SPR"
NO_AVX2 = f"{NO_AVX512} X86_V3"
# Code paths of numpy, those of BLAS, and threads: three at a time, for each changes bits of its
# own. The reference has what the processor has, and two threads, which go to sleep as soon as they
# are through: on small matrices they would else spend more time waiting than working.
SETTINGS = {
    "no AVX-512, Haswell": {
        "NPY_DISABLE_CPU_FEATURES": NO_AVX512,
        "OPENBLAS_CORETYPE": "Haswell",
    },
    "no AVX2, Nehalem": {"NPY_DISABLE_CPU_FEATURES": NO_AVX2, "OPENBLAS_CORETYPE": "Nehalem"},
    "SkylakeX": {"OPENBLAS_CORETYPE": "SkylakeX"},
}
CPU = Path("/proc/cpuinfo")
needs_avx512 = pytest.mark.skipif(
    not CPU.exists() or "avx512f" not in CPU.read_text(),
    reason="needs a processor with AVX-512, to run its code or to have another to compare with",
)
TWO_THREADS = {"OPENBLAS_NUM_THREADS": "2", "OPENBLAS_THREAD_TIMEOUT": "4"}
BITS = """
import hashlib, numpy as np
x = -np.geomspace(1e-9, 700, 100_000)
a, b = np.random.default_rng(0).standard_normal((2, 400, 63))
print(hashlib.sha256(np.exp(x).tobytes()).hexdigest(), end=" ")
print(hashlib.sha256((a @ b.T).tobytes()).hexdigest())
"""


STUDY = {"seeds": 2, "only": list(CASES), "methods": list(METHODS)}
WANTED = [
    f"results/{name}"
    for case in CASES
    for name in (f"tables/errors_{case}.csv", f"selection/{case}/seeds_0-1.csv")
]


def make(folder: Path, environment: dict[str, str]) -> None:
    """Targets to error tables."""
    with pytest.MonkeyPatch.context() as patch:
        for name, value in environment.items():
            patch.setenv(name, value)
        run = snakemake(folder, "--", *WANTED, config=STUDY)
    assert run.status == 0, run.output


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory, worker_id: str) -> Callable[[str], Path]:
    """What came out in a setting, made by one worker for all."""

    def made_in(name: str) -> Path:
        build = partial(make, environment=SETTINGS.get(name, TWO_THREADS))
        return built_once(f"bits {name}", build, tmp_path_factory, worker_id)

    return made_in


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[needs_avx512] * (name == "SkylakeX")) for name in SETTINGS],
)
def test_other_code_paths_change_no_byte(name: str, made: Callable[[str], Path]) -> None:
    ours, reference = (results_of(made(settings)) for settings in (name, "two threads"))
    assert ours.keys() == reference.keys()
    assert len(ours) > 30
    assert [file for file in ours if ours[file] != reference[file]] == []


@needs_avx512
def test_the_settings_do_change_last_bits() -> None:
    """Else the tests above would compare nothing: exp and products really differ."""
    bits = []
    for settings in SETTINGS.values():
        environment = os.environ | {"OPENBLAS_NUM_THREADS": "1"} | settings
        said = subprocess.check_output([sys.executable, "-c", BITS], env=environment, text=True)
        bits.append(said.split())
    for hashes in zip(*bits, strict=True):
        assert len(set(hashes)) >= 2
