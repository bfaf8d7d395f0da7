"""BLAS threads: the products of small matrices that fits make are slower with several."""

import os
import subprocess
import sys

from tests.helpers.places import ROOT

OPTIONS = """
import sys
from biogrip.cli import _parser
from biogrip.command.options import GROUPS

VALUES = {"--hold": "5", "--set": "measurement.block=2", "--fix": "k_p=0"}
VALUES |= {"--start": "1.5", "--at": "1,10"}
parser = _parser()
for name, metavar, *_ in (option for options in GROUPS.values() for option in options):
    given = [name, VALUES.get(name, "a")] if metavar else [name]
    parser.parse_args(["identify", "trace.csv", *given])
    assert "numpy" not in sys.modules, name
parser.parse_args(["groups", "found.csv", "--by", "dish"])
parser.parse_args(["design", "my.yaml"])
assert "numpy" not in sys.modules
"""

NOTEBOOK = """
import numpy as np
import pytest
from threadpoolctl import threadpool_info

import biogrip
from biogrip import library

def threads():
    return {each["num_threads"] for each in threadpool_info() if each["user_api"] == "blas"}

def tell(*given, **more):
    raise biogrip.BiogripError(f"threads: {threads()}")

before, time_s = threads(), np.arange(1, 30.0)
trace = time_s, 2 - np.exp(-time_s)
library.read_trace = library.identify_many = library.diagnose = tell
held, model = (biogrip.hold(30.0, 1.0),), biogrip.Sample("liquid_drop")
creep = biogrip.set_up(biogrip.INSTRUMENTS["strain"], held, model)
for use in (
    lambda: biogrip.identify_trace(*trace, reads="strain", hold=1.0),
    lambda: biogrip.identify_sample(creep, *trace),
    lambda: biogrip.judge(creep, *trace, None),
):
    with pytest.raises(biogrip.BiogripError, match="threads: .1.$"):
        use()
    assert threads() == before
"""


def run(code: str, threads: str | None = None) -> None:
    given = {name: it for name, it in os.environ.items() if name != "OPENBLAS_NUM_THREADS"}
    given |= {} if threads is None else {"OPENBLAS_NUM_THREADS": threads}
    subprocess.run([sys.executable, "-c", code], env=given, cwd=ROOT, check=True)


def test_reading_an_option_loads_no_numpy() -> None:
    """So that the command limits the threads before NumPy starts them, whatever is typed."""
    run(OPTIONS)


def test_a_notebook_that_has_threads_keeps_them_and_fits_with_one() -> None:
    run(NOTEBOOK, threads="2")
