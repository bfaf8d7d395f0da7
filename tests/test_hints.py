"""Hints of the program, typed as it prints them: each has to help."""

import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from biogrip.arrays import Array
from tests.helpers.identified import by_quantity, identified, identify, write_trace

# An option with what it takes, as a message has it.
OPTION = re.compile(r"(--[a-z-]+ (?:'[^']*'|[^\s']+?))(?=[.,;)]?(?:\s|$))")
TIME_S: Array = np.arange(0.5, 30, 0.25)
STRAIN = 5 / 500 + 5 / 400 * (1 - np.exp(-TIME_S / 5))
CREEP = ["--hold", "5 Pa", "--model", "zener_kelvin", "--no-compare"]


def noisy(values: Array, seed: int = 1) -> Array:
    return values * (1 + 0.003 * np.random.default_rng(seed).standard_normal(len(values)))


def blocks(path: Path) -> list[str]:
    """Two blocks, of which the second goes on."""
    rows = [f"{t},{x}" for t, x in zip(TIME_S, noisy(STRAIN), strict=True)]
    path.write_text("\n".join(["time_s,strain", *rows[:60], "time_s,strain", *rows[60:]]))
    return ["--reading", "strain=strain", *CREEP]


def samples(path: Path) -> list[str]:
    """Two samples below each other."""
    path.write_text(
        "\n".join(
            [
                "time_s,cell,strain",
                *(f"{t},A,{x}" for t, x in zip(TIME_S, noisy(STRAIN), strict=True)),
                *(f"{t},B,{3 * x}" for t, x in zip(TIME_S, noisy(STRAIN, 2), strict=True)),
            ]
        )
    )
    return ["--reading", "strain=strain", *CREEP]


def repeats(path: Path) -> list[str]:
    """A clock that is rounded to whole seconds, of a sample that is at rest, and then creeps."""
    times = np.repeat(TIME_S, 2)
    values = np.repeat(STRAIN, 2) * np.random.default_rng(1).normal(1, 0.003, len(times))
    write_trace(path, times, values, header="time_s,strain")
    return ["--reading", "strain=strain", *CREEP]


def turned(path: Path) -> list[str]:
    write_trace(path, TIME_S, -noisy(STRAIN), header="time_s,strain")
    return ["--reading", "strain=strain", *CREEP]


def another_quantity(path: Path) -> list[str]:
    write_trace(path, TIME_S, 100 * noisy(STRAIN), header="time_s,Strain (%)")
    return ["--reading", "Strain (%)", "--model", "zener_kelvin", "--no-compare"]


def separation(path: Path) -> list[str]:
    """Of a punch, which is negative in contact: 2 R E/(1 - nu^2) d of 500 nm, 400 and 500 Pa."""
    time_s = np.r_[np.arange(-2, 0, 0.1), TIME_S]
    depth = np.where(time_s > 0, 500.0, np.minimum(500 * time_s, 0))
    relaxed = 400 + 500 * np.exp(-time_s / 5)
    force_nN = np.where(time_s > 0, noisy(2 * 2e-6 / 0.75 * relaxed * 5e-7 * 1e9), 0.0)
    write_trace(path, time_s, force_nN, -depth, header="time_s,F_nN,d_nm")
    given = ["--reading", "force=F_nN", "--load", "d_nm", "--shape", "punch 2 um", "--start", "0"]
    return [*given, "--model", "zener_maxwell", "--no-compare"]


HINTS = {
    blocks: (["--block 1", "--block 1,2"], "k_s", 500),
    samples: (["--rows cell=A"], "k_s", 500),
    repeats: (["--set measurement.average_repeated=true"], "k_s", 500),
    turned: (["--set measurement.scale=-1"], "k_s", 500),
    another_quantity: (["--reading 'strain=Strain (%)'"], "k_s", 500),
    separation: (["--set measurement.load_scale=-1"], "k_p", 400),
}


@pytest.mark.parametrize("make", HINTS, ids=lambda make: make.__name__)
def test_a_hint_helps(tmp_path: Path, make: object) -> None:
    hints, name, true = HINTS[make]  # type: ignore[index]
    path = tmp_path / "t.csv"
    given = make(path)  # type: ignore[operator]
    status, _, message = identify(path, *given)
    assert status == 1
    printed = [hint.rstrip(".,;)") for hint in OPTION.findall(message)]
    assert [hint for hint in hints if hint in printed] == hints, message
    typed = shlex.split(hints[-1])
    held = ["--hold", "5 Pa"] if make is another_quantity else []
    found = by_quantity(identified(tmp_path, path, *given, *held, *typed, config=""))
    assert found[name]["value"] == pytest.approx(true, rel=0.03)


def test_models_have_the_names_that_people_type(tmp_path: Path) -> None:
    """A damper before a Kelvin-Voigt solid is a Burgers fluid without its spring."""
    strain = 5 * (TIME_S / 4000 + (1 - np.exp(-TIME_S / 5)) / 400)
    path = write_trace(tmp_path / "t.csv", TIME_S, noisy(strain), header="time_s,strain")
    given = ["--reading", "strain=strain", "--hold", "5 Pa", "--no-compare", "--model"]
    found = by_quantity(identified(tmp_path, path, *given, "jeffreys", config=""))
    for name, true in (("c_s", 4000), ("k_v", 400), ("tau_v", 5)):
        assert found[name]["value"] == pytest.approx(true, rel=0.05), name
    _, _, message = identify(path, *given, "slss")
    assert "found 'slss'. Did you mean 'sls' or " in message
    assert len(message) < 150
