"""BLAS threads: the products of small matrices that fits make are slower with several."""

import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from biogrip import library

OPTIONS = """
import sys
from biogrip.cli import _parser
from biogrip.command.options import GROUPS

VALUES = {"--hold": "5", "--set": "measurement.block=2", "--fix": "k_p=0"}
VALUES |= {"--start": "1.5", "--at": "1,10", "--ramp": "1s", "--contact": "fit"}
VALUES |= {"--block": "1,2", "--rows": "T=20", "--noise-share": "2%", "--phase-sd": "1deg"}
parser = _parser()
for name, metavar, *_ in (option for options in GROUPS.values() for option in options):
    given = [name, VALUES.get(name, "a")] if metavar else [name]
    parser.parse_args(["identify", "trace.csv", *given])
    assert "numpy" not in sys.modules, name
parser.parse_args(["groups", "found.csv", "--by", "dish"])
parser.parse_args(["design", "my.yaml"])
assert "numpy" not in sys.modules
"""


def threads() -> set[int]:
    return {each["num_threads"] for each in threadpool_info() if each["user_api"] == "blas"}


def tell(*given: Any, **more: Any) -> Any:
    raise library.BiogripError(f"threads: {threads()}")


def test_reading_an_option_loads_no_numpy() -> None:
    """So that the command limits the threads before NumPy starts them, whatever is typed."""
    subprocess.run([sys.executable, "-c", OPTIONS], check=True)


def test_a_notebook_that_has_threads_keeps_them_and_fits_with_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    time_s, held = np.arange(1, 30.0), (library.hold(30.0, 1.0),)
    creep = library.set_up(library.INSTRUMENTS["strain"], held, library.Sample("liquid_drop"))
    for name in ("read_trace", "identify_many"):
        monkeypatch.setattr(library, name, tell)
    trace: tuple[Any, Any] = time_s, 2 - np.exp(-time_s)
    with threadpool_limits(2, "blas"):
        for use in (
            lambda: library.identify_trace(*trace, reads="strain", hold=1.0),
            lambda: library.identify_sample(creep, *trace),
        ):
            with pytest.raises(library.BiogripError, match=r"threads: .1.$"):
                use()
            assert threads() == {2}
