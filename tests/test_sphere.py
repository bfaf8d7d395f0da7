"""A sphere that indents the sample, as of an AFM, by simulations of their own."""

from pathlib import Path

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.physics.instruments import INSTRUMENTS, under_sphere
from biogrip.traces.reader import recording_of_arrays
from tests.helpers.columns import columns_of
from tests.helpers.identified import by_quantity, identified, identify, write_trace

RADIUS_M = 2.5e-6
STIFF_PA, SOFT_PA, TIME_S = 1200.0, 800.0, 3.0
SPHERE = ("--sphere", "2.5 um", "--no-compare")
APPROACH = ["--reading", "force=force_nN", "--load", "indentation_nm", *SPHERE]
APPROACH += ["--model", "zener_maxwell"]


def _approach(time_s: Array) -> Array:
    """Return the force of Hertz's hereditary integral, d(t) a ramp of half a second, then held."""
    forces = []
    for now in time_s:
        s = np.linspace(0, min(max(now, 0), 0.5), 2001)
        rate = 1.5 * (5e-7 / 0.5) ** 1.5 * np.sqrt(s)
        modulus = SOFT_PA + STIFF_PA * np.exp(-(now - s) / TIME_S)
        forces.append(16 / 9 * np.sqrt(RADIUS_M) * np.trapezoid(modulus * rate, s))
    return np.array(forces)


@pytest.fixture(scope="module")
def afm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write an approach that begins before the contact, a dwell, and the way back."""
    time_s = np.r_[np.arange(-0.2, 0.5, 0.02), np.arange(0.5, 30, 0.1)]
    force = _approach(time_s)
    force += np.random.default_rng(5).normal(0, 0.004 * force.max(), len(time_s))
    depth = np.minimum(time_s / 0.5, 1) * 5e-7
    back = 29.95 + np.arange(1, 10) * 0.05
    time_s, force = np.r_[time_s, back], np.r_[force, np.linspace(force[-1], 0, 9)]
    depth = np.r_[depth, np.linspace(5e-7, 0, 10)[1:]]
    path, header = tmp_path_factory.mktemp("afm") / "afm.csv", "time_s,force_nN,indentation_nm"
    return write_trace(path, time_s, 1e9 * force, 1e9 * depth, header=header)


def test_an_approach_and_its_dwell_tell_the_modulus_of_young(afm: Path) -> None:
    found = identified(afm.parent, afm, *APPROACH, "--until", "29.9", "--start", "0")
    limits = by_quantity(found)
    for name, true in (("k", STIFF_PA), ("k_p", SOFT_PA), ("tau", TIME_S)):
        # Limits of this noise are 0.2 to 1 % wide.
        assert limits[name]["value"] == pytest.approx(true, rel=0.015), name
        assert limits[name]["high"] < 1.02 * limits[name]["low"], name
    assert (found["fit"], found["models"]) == ("ok", [])
    assert "Hertz's contact with a sphere of radius 2.5 um" in found["load"]
    assert "0 to 500 nm" in found["load"]


def test_a_sphere_that_is_drawn_back_is_noted(afm: Path) -> None:
    _, said, _ = identify(afm, *APPROACH)
    assert "The contact shrinks from 30 s on" in said
    assert "--until 30.\n" in said


def test_a_force_that_is_held_tells_compliances(tmp_path: Path) -> None:
    """d^1.5 = 9 F J(t)/(16 sqrt(R)), J of 500 Pa before a Kelvin element of 400 Pa and 2 s."""
    time_s = np.arange(0.1, 20, 0.1)
    compliance = 1 / 500 + (1 - np.exp(-time_s / 2)) / 400
    depth = (9 * 1e-9 * compliance / (16 * np.sqrt(RADIUS_M))) ** (2 / 3)
    depth += np.random.default_rng(6).normal(0, 0.002 * depth.max(), len(time_s))
    trace = write_trace(tmp_path / "held.csv", time_s, 1e6 * depth, header="time_s,depth_um")
    given = ("--reading", "displacement=depth_um", "--hold", "1 nN", *SPHERE)
    limits = by_quantity(identified(tmp_path, trace, *given, "--model", "zener_kelvin", config=""))
    for name, true in (("k_s", 500), ("k_v", 400), ("tau_v", 2)):
        assert limits[name]["low"] < true < limits[name]["high"], name


def test_a_number_counts_by_its_power_and_back() -> None:
    depth = under_sphere(INSTRUMENTS["strain"], 2e-6).read
    assert depth.in_si(np.array([8.0, -8.0, 0.0]), "um").tolist() == [8.0, -8.0, 0.0]
    assert depth.in_unit(np.array([8.0, 0.0]), "um") == pytest.approx([8.0, 0.0])
    # 1.5 sqrt(d/R) for each radius.
    assert depth.slope(4.0) == 3.0
    # A column of half micrometres: 16 of them are 4 radii of 2 um, and one is 0.25.
    columns = columns_of("time_s", "d_um", "strain", sd="sd", scale=0.5, sphere="2 um")
    number, sd = np.full(9, 16.0), np.full(9, 0.1)
    found = recording_of_arrays(columns, np.arange(9.0), number, sd)
    assert found.readings == pytest.approx(8.0)
    assert found.sd == pytest.approx(0.1 * 0.25 * 3.0)


def test_what_no_sphere_is_told_by_is_refused(afm: Path) -> None:
    for given, said in (
        ("2.5 --hold 1nN", "found '2.5', allowed is a radius with its unit"),
        *((f"{it} --hold 1nN", f"found '{it}', allowed is a radius") for it in ("2.5Pa", "0um")),
        ("2um --hold 500", "--hold: found no unit, allowed are m, cm, mm, um"),
        ("2um --hold 1nN", "the unit 'nN' of a"),
        ("2um --reading modulus=force_nN", "goes with a force or an indentation, not with modulus"),
        ("2um --reading strain=force_nN", "found a sphere and a reading of strain; allowed are a"),
    ):
        reading = () if "--reading" in given else ("--reading", "force=force_nN")
        status, _, message = identify(afm, *reading, "--sphere", *given.split())
        assert (status, said in message) == (1, True)
